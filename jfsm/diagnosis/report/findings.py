"""Named causes, wrong values and the candidates that lost, with their values and probabilities."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...identification import Nuisances, Unknown
from ...structures import PARAMETER_CAUSES, Clipping, Structure, is_offset
from .._diagnosis import CandidateResult, Finding, Rival
from ..advice.next_test import RIVAL
from ..channels.clipping import clipped_channel
from ..evidence.between_records import differences
from ..evidence.fitted import Trial
from ..hypotheses.effect import Effect, key_of, names, places
from ..verdict.decision import Decision
from .estimates import Units, all_effect_values, effect_values, estimate
from .law_class import WIDER, class_of


def findings_of(
    decision: Decision,
    winner: Trial,
    trials: Sequence[Trial],
    clipped: Sequence[Clipping],
    model: Structure,
    nuisances: Nuisances,
) -> tuple[Finding, ...]:
    """The causes or the wrong values that a decision names, the surest or the most wrong first.

    Clipped channels follow the causes.
    """
    units = nuisances.record.units
    if decision.verdict == "cause":
        found = [_finding(which, decision, winner, trials, model, nuisances) for which in range(len(winner.effects))]
        found.sort(key=lambda f: -f.probability)
        return (*found, *(clipped_channel(sensor, units[sensor.at[0]]) for sensor in clipped))
    if decision.verdict == "parameters":
        return _wrong_values(winner, decision.probability(winner.key), model, units)
    return ()


class _Replacement(NamedTuple):
    """An effect that takes the place of one of the winner's in a trial, and the trial's probability."""

    effect: Effect
    trial: Trial
    probability: float


def _finding(
    which: int,
    decision: Decision,
    winner: Trial,
    trials: Sequence[Trial],
    model: Structure,
    nuisances: Nuisances,
) -> Finding:
    """One effect of the winner; its rivals are the effects that may take its place, the winner's others aside."""
    effect = winner.effects[which]
    cause, values = effect.cause, effect_values(winner, which, model, nuisances.record.units)
    probability = sum((decision.probability(t.key) for t in trials if effect in t.effects), 0.0)
    replacements = _replacements(effect, decision, winner, trials)
    kind, kind_probability = _likely_class(effect, winner, probability, replacements, nuisances)
    rivals = _rivals(replacements)
    return Finding(
        cause.id, cause.family, effect.at, probability, values, rivals, cause.sentence, kind, kind_probability
    )


def _replacements(effect: Effect, decision: Decision, winner: Trial, trials: Sequence[Trial]) -> list[_Replacement]:
    """Effects in place of one of the winner's, in possible trials that have no other that the winner lacks."""
    found = []
    for t in trials:
        others, probability = set(t.effects) - set(winner.effects), decision.probability(t.key)
        if effect not in t.effects and len(others) == 1 and probability > 0:
            found.append(_Replacement(others.pop(), t, probability))
    return found


def _rivals(replacements: Sequence[_Replacement]) -> tuple[Rival, ...]:
    """The replacements that have a chance, each once, the most probable first."""
    shares = dict[Effect, float]()
    for one in replacements:
        shares[one.effect] = shares.get(one.effect, 0.0) + one.probability
    ranked = sorted(shares.items(), key=lambda item: -item[1])
    return tuple(Rival(effect.cause.id, effect.at, share) for effect, share in ranked if share > RIVAL)


def _likely_class(
    effect: Effect, winner: Trial, probability: float, replacements: Sequence[_Replacement], nuisances: Nuisances
) -> tuple[str, float]:
    """Class of an effect of some `probability` in words, and the probability of the class.

    Where the class is unlikely, and laws of the family are likelier, it is the family's.
    """
    peak = nuisances.crest * nuisances.length

    def class_in(t: Trial, effect: Effect) -> str:
        return class_of(effect.cause, t.parts[t.effects.index(effect)], peak, peak * nuisances.omega)

    kind, family = class_in(winner, effect), effect.cause.family
    there = [one for one in replacements if one.effect.at == effect.at]
    same_class = sum((one.probability for one in there if class_in(one.trial, one.effect) == kind), 0.0)
    same_family = sum((one.probability for one in there if one.effect.cause.family == family), 0.0)
    if probability + same_class < 0.5 and same_family > same_class + RIVAL and family in WIDER:
        return WIDER[family], probability + same_family
    return kind, probability + same_class


def _wrong_values(t: Trial, probability: float, model: Structure, units: Units) -> tuple[Finding, ...]:
    """Own values that moved by more than their error and than a third of what they are trusted to, the farthest
    first."""
    found, stated = list[tuple[float, Finding]](), model.values()
    apart = {one.path for one in differences(t)}
    for k, u in enumerate(t.unknowns):
        if not _is_physical(u, stated) or not (u.path in apart or _has_moved(t, k)):
            continue
        kind, place = u.path.split(".")[0].split("@")
        at = tuple(int(p) for p in place.split("-"))
        name = u.path.split(".")[-1] if "." in u.path else "mass"
        value = estimate(t, u.path, units)
        sentence = f"{kind} is off: stated {stated[u.path]:.6g}, found {value.value:.6g}"
        finding = Finding(
            PARAMETER_CAUSES[kind], "parameters", at, probability, {name: value}, (), sentence,
            "a wrong value", probability,
        )  # fmt: skip
        found.append((_moved(t, k) / u.width, finding))
    return tuple(f for _, f in sorted(found, key=lambda item: -item[0]))


def _is_physical(u: Unknown, stated: dict[str, float]) -> bool:
    """Whether an unknown is a stated mass, stiffness or damping, of the first record where records differ."""
    return (
        u.path in stated
        and not is_offset(u.path)
        and u.record in (None, 0)
        and u.path.split("@")[0] in PARAMETER_CAUSES
    )


def _moved(t: Trial, k: int) -> float:
    return float(abs(t.theta[k] - t.unknowns[k].center))


def _has_moved(t: Trial, k: int) -> bool:
    """Whether an own value moved by more than chance, and than a third of what it is trusted to."""
    moved, sd = _moved(t, k), math.sqrt(max(t.covariance[k, k], 0.0))
    return moved > 3 * sd and moved > t.unknowns[k].width / 3


def fitted_candidate(
    t: Trial, decision: Decision, refitted: Trial, unfit: float | None, model: Structure, units: Units
) -> CandidateResult:
    """A candidate that was fitted."""
    error = np.sqrt(t.prediction.error)
    sets = ["training", "holdout"] if error.size == 2 else [f"set {i + 1}" for i in range(error.size)]
    why = decision.reasons.get(t.key, "") or ("named" if t.key == decision.winner else "")
    return CandidateResult(
        t.name, t.at, t.evidence - refitted.evidence, {n: float(e) for n, e in zip(sets, error, strict=True)},
        decision.explained.get(t.key, 0.0), decision.probability(t.key), all_effect_values(t, model, units), why,
        t.prediction.left(), t.whiteness, unfit,
    )  # fmt: skip


def unfitted_candidate(effects: Sequence[Effect], decision: Decision, share: float = 0.0) -> CandidateResult:
    """A candidate that was not fitted to its end; the `share` of the missing force that it explains stands for κ."""
    why = decision.reasons[key_of(effects)]
    return CandidateResult(names(effects), places(effects), -math.inf, {}, share, 0.0, {}, why)
