"""Named causes, wrong values and the candidates that lost, with their values and probabilities."""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...identification import Nuisances, Unknown
from ...reporting import place_name
from ...structures import (
    OWN_VALUE,
    PARAMETER_CAUSES,
    ChannelDelay,
    Clipping,
    CommandDelay,
    ForceDelay,
    Structure,
    is_offset,
)
from .._finding import FOUND, CandidateResult, Finding, Rival
from ..advice.next_test import RIVAL
from ..channels.clipping import clipped_channel
from ..evidence.between_records import differences
from ..evidence.fitted import Trial
from ..evidence.missing_force import Residual
from ..evidence.scorecard import Scorecard
from ..hypotheses.effect import Effect, key_of, names, places
from ..thresholds import THRESHOLDS
from ..verdict.claims import narrowest_sure
from ..verdict.decision import Decision
from .class_size import Member, size_of_class
from .estimates import Units, all_effect_values, effect_values, estimate


class Ranked(NamedTuple):
    """A decision with the hypotheses behind it: their trials and their scorecards, by key."""

    decision: Decision
    trials: Mapping[str, Trial]
    cards: Mapping[str, Scorecard]

    def members(self, kind: str, at: tuple) -> list[Member]:
        """Every effect of a class at a place, in each hypothesis that has a chance."""
        return [
            Member(self.trials[key], which, self.decision.probability_of_class(key))
            for key, card in self.cards.items()
            for which, effect in enumerate(card.effects)
            if effect.at == at and kind in effect.classes and self.decision.probability_of_class(key) > 0
        ]

    def shares(self, kind: str, at: tuple) -> dict[str, float]:
        """Probability of every cause of a class at a place, the most probable first; with that of a law of some other
        shape they make up the class."""
        found = dict[str, float]()
        for m in self.members(kind, at):
            found[m.cause] = found.get(m.cause, 0.0) + self.decision.probability(m.trial.key)
        return dict(sorted(found.items(), key=lambda item: -item[1]))

    def probability_of_effect(self, effect: Effect) -> float:
        """Probability of an effect, with or without others."""
        return sum((self.decision.probability(t.key) for t in self.trials.values() if effect in t.effects), 0.0)


def findings_of(
    ranked: Ranked,
    winner: Trial,
    clipped: Sequence[Clipping],
    model: Structure,
    missing: Residual,
    nuisances: Nuisances,
) -> tuple[Finding, ...]:
    """The causes or the wrong values that a decision names, the surest or the most wrong first.

    Clipped channels follow the causes.
    """
    units, decision = nuisances.record.units, ranked.decision
    if decision.verdict == "cause":
        found = [_finding(which, ranked, winner, model, missing, nuisances) for which in range(len(winner.effects))]
        found.sort(key=lambda f: -f.probability)
        return (*found, *(clipped_channel(sensor, units[sensor.at[0]]) for sensor in clipped))
    if decision.verdict == "parameters":
        return _wrong_values(winner, decision.probability(winner.key), model, units)
    return ()


def _finding(
    which: int, ranked: Ranked, winner: Trial, model: Structure, missing: Residual, nuisances: Nuisances
) -> Finding:
    """One effect of the winner; its rivals are the effects that may take its place, the winner's others aside."""
    effect, units, decision = winner.effects[which], nuisances.record.units, ranked.decision
    probability = ranked.probability_of_effect(effect)
    kind, kind_probability = narrowest_sure(ranked.cards[winner.key].effects[which], decision, ranked.cards)
    shares = ranked.shares(kind, effect.at)
    members = {cause: share for cause, share in shares.items() if share >= RIVAL or cause == effect.cause.id}
    likely = [m for m in ranked.members(kind, effect.at) if m.cause in members]
    rivals = _rivals(effect, decision, winner, list(ranked.trials.values()))
    sentence, other = effect.cause.sentence, _the_same_delay(effect, nuisances)
    if other is not None:
        sentence += f"; where one response is measured, a delay at {place_name(other.at)} is the same"
        rivals += () if (other.cause, other.at) in [(rival.cause, rival.at) for rival in rivals] else (other,)
    return Finding(
        cause=effect.cause.id,
        family=effect.cause.family,
        at=effect.at,
        probability=probability,
        parameters=effect_values(winner, which, model, units),
        rivals=rivals,
        sentence=sentence,
        kind=kind,
        kind_probability=kind_probability,
        law_open=probability < THRESHOLDS.class_named or winner.key in decision.near,
        members=members,
        size=size_of_class(kind, likely, model, missing, nuisances.record.dt, units),
    )


def _the_same_delay(effect: Effect, nuisances: Nuisances) -> Rival | None:
    """The delay that shows as the one of an effect does: of one force and one response either may be late."""
    delays = {ForceDelay: "channel_delay", CommandDelay: "channel_delay", ChannelDelay: "force_delay"}
    forces = [channel for channel in nuisances.record.channels if channel[0] == "force"]
    both = [*forces, *nuisances.record.responses]
    if effect.cause.effect not in delays or len(forces) != 1 or len(both) != 2:
        return None
    (other,) = (channel for channel in both if channel != effect.at)
    return Rival(delays[effect.cause.effect], other, 1 - FOUND)


def _rivals(effect: Effect, decision: Decision, winner: Trial, trials: Sequence[Trial]) -> tuple[Rival, ...]:
    """Effects that may take the place of one of the winner's, each once, the most probable first.

    They do so in possible trials that have no other effect that the winner lacks.
    """
    shares = dict[Effect, float]()
    for t in trials:
        others, probability = set(t.effects) - set(winner.effects), decision.probability(t.key)
        if effect not in t.effects and len(others) == 1 and probability > 0:
            other = others.pop()
            shares[other] = shares.get(other, 0.0) + probability
    ranked = sorted(shares.items(), key=lambda item: -item[1])
    return tuple(Rival(other.cause.id, other.at, share) for other, share in ranked if share > RIVAL)


def _wrong_values(t: Trial, probability: float, model: Structure, units: Units) -> tuple[Finding, ...]:
    """Own values that moved by more than their error and than a third of what they are trusted to, the farthest
    first."""
    found, stated = list[tuple[float, Finding]](), model.values()
    apart = {one.path for one in differences(t)}
    for k, u in enumerate(t.unknowns):
        if not _is_physical(u, stated) or not (u.path in apart or _has_moved(t, k)):
            continue
        kind, _, place = u.path.split(".")[0].partition("@")
        at = tuple(int(p) for p in place.split("-")) if place else ()
        name = u.path.split(".")[-1] if "." in u.path else kind
        value, cause = estimate(t, u.path, units), PARAMETER_CAUSES.get(kind, OWN_VALUE)
        sentence = f"{kind} is off: stated {stated[u.path]:.6g}, found {value.value:.6g}"
        finding = Finding(
            cause, "parameters", at, probability, {name: value}, (), sentence,
            "a wrong value", probability, members={cause: probability}, size=value,
        )  # fmt: skip
        found.append((_moved(t, k) / u.width, finding))
    return tuple(f for _, f in sorted(found, key=lambda item: -item[0]))


def _is_physical(u: Unknown, stated: dict[str, float]) -> bool:
    """Whether an unknown is a stated mass, stiffness or damping, or a simulation's own number, of the first record
    where records differ."""
    kind, at, _ = u.path.partition("@")
    physical = kind in PARAMETER_CAUSES or not at
    return physical and u.path in stated and not is_offset(u.path) and u.record in (None, 0)


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
