"""From trials to a verdict.

A cause must do three things: be more probable than its absence, explain at least half of the power that a refit of the
model leaves, and do so on every set of samples, held-out ones included. Where the winner leaves nothing but noise, its
evidence is trusted as it stands; where it does not, evidence counts no more than some tens of independent looks, and
no cause is more probable than the share of the power that it explains. And no cause is named beside which laws of other
shapes would gain more than a small share of what it gains itself, or explain half of what it leaves; up to there it is
the less sure, by half at most. Nor is a record called consistent where they explain more than noise.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..identification import prior
from ..structures import AbstractTerm
from ._lack_of_fit import Unfit
from ._trial import Trial

GATE = 0.5
"""Share of the excess power that a cause explains, at least."""
SIGNIFICANT = 5.0
"""Nats by which something must beat nothing."""
_UNSEEN = 1.0
"""Nats by which a law must beat a special case of it for its further numbers to be seen."""
SECOND = 15.0
"""Nats by which two effects must beat either of them alone,"""
_WORTH_A_SECOND = 0.03
"""and share of the refit's error by which they must predict better."""
NEGLIGIBLE = 0.02
"""Excess, as a share of the signal, below which nothing but a perfect explanation is a finding."""
_NOTICEABLE = 0.1
"""Excess, as a share of the power that noise leaves, from which a set says anything about an effect."""
NEARLY_ALL, _MUCH = 0.8, 0.1
"""A law that explains less than this share of the excess and leaves more than this share of the signal is near."""
_ALMOST_ALL = 0.95
"""A law that explains this share of the excess along an imposed motion stands, whatever a map makes of the rest."""
_UNFIT = 20.0
"""Nats that laws of other shapes must gain beside a cause, beyond chance, for it to be doubted; twice as many, for it
not to be named,"""
_UNFIT_SHARE = {0: 0.02, 1: 0.1, 2: 0.05}
"""and share of the nats that its last effect gains, of own values, one effect or two: own values make up for many a
law, and two together stand for many a single one."""
_UNFIT_OF_WHITE = 0.005
"""The same where innovations are white: all else is right then."""
_UNFIT_OF_REST = 0.5
"""Share of innovations that are not white from which other shapes explain too much of them, whatever the gain."""
_NOT_RIGHT = "explains much of it, but is not of the right shape"
_ALIKE = 0.3
"""Probability of another law of its family, in those of a law that is not of the right shape, that may take its place.
"""
_NEAR = 0.01
"""Distance to the farthest own value, as a share of it, from which a value is there."""
_WHITE = 0.1
_SCALE = 0.5
_LOOKS = (10.0, 40.0)


@dataclass(frozen=True)
class Decision:
    """Verdict and winning trial; probability of every alternative and reason for every candidate, in their order."""

    verdict: str
    winner: Trial
    probability: dict[int, float]
    kappa: dict[int, float]
    why: dict[int, str]

    @property
    def named_term(self) -> AbstractTerm | None:
        """The winner's term, the first of them, if a law was named."""
        return next(iter(self.winner.laws), None) if self.verdict == "cause" else None

    def share(self, trial: Trial) -> float:
        """Probability of a trial; 0 for one that is no alternative."""
        return self.probability.get(id(trial), 0.0)

    def refused(self, why: str, instead: Trial) -> "Decision":
        """The decision without its winner, which something else speaks against."""
        probability = self.probability | {id(self.winner): 0.0}
        why_not = self.why | {id(self.winner): why}
        return replace(self, verdict="undecided", winner=instead, probability=probability, why=why_not)


def adequate(trial: Trial) -> bool:
    """Whether a trial leaves nothing but noise: white innovations of the size of the floor, no excess."""
    return white(trial) and trial.prediction.left < NEGLIGIBLE


def white(trial: Trial) -> bool:
    """Whether a trial's innovations are white, and of the size of the floor where that is known."""
    return trial.whiteness < _WHITE and bool(np.all(np.abs(trial.noise[trial.trusted]) < _SCALE))


def settled(trials: Sequence[Trial]) -> bool:
    """Whether the best of them leaves nothing but noise, and its laws are what they are called."""
    best = max(trials, key=lambda t: t.evidence)
    return adequate(best) and not any(law.otherwise(best.structure.stiffness_of(law.at)) for law in best.laws)


def something_left(
    trials: Sequence[Trial], refitted: Trial, lack_of_fit: Callable[[Trial], Unfit], *, imposed: bool
) -> bool:
    """Whether the best of them leaves enough for a second effect to be worth a search: what a pair has to gain."""
    best = max(trials, key=lambda t: t.evidence)
    if adequate(best) or (imposed and _almost_all(best, refitted)):
        return False
    if best.prediction.left < NEGLIGIBLE:
        gained = best.evidence - refitted.evidence
        return bool(best.effects) and lack_of_fit(best).nats > max(_UNFIT_SHARE[2] * gained, _UNFIT)
    return bool(np.all(best.prediction.beyond >= _WORTH_A_SECOND**2 * refitted.prediction.error))


def strained(trials: Sequence[Trial]) -> bool:
    """Whether the best of them holds only with own values that are hard to believe."""
    best = max(trials, key=lambda t: t.evidence)
    cost = 0.0
    for u, theta in zip(best.unknowns, best.theta, strict=True):
        if math.isfinite(u.degrees):  # of an own value
            cost += prior([u], np.array([theta]))[0] - prior([u], np.array([u.center]))[0]
    return bool(best.effects) and cost > SIGNIFICANT


def far_off(trial: Trial) -> set[str]:
    """Own values of a trial that went as far as they may: it is another structure's force that they make up for.

    Damping may go: a model without friction often states as viscous what friction takes.
    """
    own = [(u, theta) for u, theta in zip(trial.unknowns, trial.theta, strict=True) if math.isfinite(u.degrees)]
    low = {u.path for u, theta in own if theta < u.low + _NEAR and not u.path.startswith("damping@")}
    return low | {u.path for u, theta in own if theta > u.high - _NEAR}


def explained(trial: Trial, baseline: Trial) -> float:
    """Smallest share of the baseline's excess power that a trial explains, over the sets where there is any."""
    start, left = baseline.prediction.excess, trial.prediction.excess
    significant = start > np.maximum(_NOTICEABLE * baseline.prediction.expected, 1e-9)
    if not np.any(significant):
        return 0.0
    return float(np.min(1.0 - left[significant] / start[significant])) if np.all(np.isfinite(left)) else -math.inf


def probabilities(trials: Sequence[Trial], periods: float) -> np.ndarray:
    """Probability of each trial among them."""
    evidence = np.array([t.evidence for t in trials])
    best = trials[int(np.argmax(evidence))]
    if adequate(best):
        score = evidence / 2  # tempered: noise levels and priors are known to some ten per cent only
    else:
        looks = min(max(periods / 5, _LOOKS[0]), _LOOKS[1])
        error = np.array([math.sqrt(float(np.mean(t.prediction.error))) for t in trials])
        size = np.array([len(t.unknowns) for t in trials])
        score = -looks * np.log(error) - 0.5 * size * math.log(looks)
    share = np.exp(score - np.max(score))
    return 0.995 * share / np.sum(share) + 0.005 / len(trials)


def decide(
    given: Trial,
    refitted: Trial,
    tried: Sequence[Trial],
    stand_in: Callable[[Trial], Trial | None],
    lack_of_fit: Callable[[Trial], Unfit],
    periods: float,
    *,
    imposed: bool = False,
    forgiven: bool = False,
    untold: Callable[[Trial], str] = lambda t: "",
) -> Decision:
    """Verdict over the model as given, the model refitted, every candidate, and a map that stands for any law.

    `stand_in` adds to a trial the map of what it leaves; it is asked only where the winner leaves something.
    `lack_of_fit` tells what other laws would explain beside a trial's; it is asked of a cause that would be named.
    Where some force is `forgiven` to all none of them is right: laws of time would explain whatever is left, and a map
    of the little that a law leaves does not speak against it. Along an `imposed` motion a map repeats even the small
    faults of a law, one by one, as often as it repeats itself. What the motion leaves `untold`, and why, is a
    rival, and no finding.
    """
    kappa, why = {}, {}
    passing = []
    for t in tried:
        kappa[id(t)] = explained(t, refitted)
        why[id(t)] = _reason(t, given, refitted) or _needs_both(t, tried, refitted)
        if forgiven and any(law.timed for law in t.laws):
            why[id(t)] = why[id(t)] or "depends on time, and no second record shows the same"
        if not why[id(t)]:
            passing.append(t)
    alternatives = [given, refitted, *passing]
    share = probabilities(alternatives, periods)
    chance = {id(t): float(p) for t, p in zip(alternatives, share, strict=True)}
    winner = alternatives[int(np.argmax(share))]
    for t in passing:
        if t is not winner:
            why[id(t)] = "explains it too, but is less probable"
    if special := _special_case(winner, passing):
        why[id(winner)], why[id(special)] = "is hardly more probable than its special case", ""
        winner = special
    stands = imposed and bool(winner.effects) and _almost_all(winner, refitted)
    stands |= forgiven and bool(winner.effects) and explained(winner, refitted) >= NEARLY_ALL
    mapped = None if adequate(winner) or stands else stand_in(winner)
    verdict = _verdict(given, refitted, winner, tried, mapped)
    family = sum(chance[id(t)] for t in passing if families(t) == families(winner))
    if verdict == "cause" and not adequate(winner):
        # The rest may be the work of another law than the catalogue's: no name is surer than what it explains.
        chance = {which: p * kappa[id(winner)] for which, p in chance.items()}
    if verdict == "cause" and chance[id(winner)] < 0.5 and family < 0.8:
        verdict = "undecided"
    if verdict == "cause":
        fewer = [t.evidence for t in (given, refitted, *tried) if len(t.effects) < len(winner.effects)]

        def doubt_of(t: Trial) -> float:
            unfit = lack_of_fit(t)
            # Where none is right much of the rest has a shape, and says nothing against a law that explains nearly all.
            return _doubt(t, t.evidence - max(fewer), unfit._replace(share=0.0) if forgiven else unfit)

        leader = winner
        winner, doubt = _of_right_shape(leader, passing, chance, doubt_of)
        if winner is not leader:
            why[id(leader)], chance[id(leader)], why[id(winner)] = _NOT_RIGHT, 0.0, ""
        for t in passing:
            if families(t) == families(winner):
                chance[id(t)] *= 1.0 - 0.5 * min(doubt, 1.0)
        not_shown = untold(winner)
        if doubt > 1.0 or not_shown:
            why[id(winner)], chance[id(winner)] = not_shown or _NOT_RIGHT, 0.0
            mapped = stand_in(refitted)
            stands_in = mapped is not None and explained(mapped, refitted) >= GATE
            verdict, winner = ("unnamed", refitted) if stands_in else ("undecided", winner)
    if verdict == "parameters":
        doubt = _doubt(winner, winner.evidence - given.evidence, lack_of_fit(winner))
        chance[id(winner)] *= 1.0 - 0.5 * min(doubt, 1.0)
        if doubt > 1.0:
            chance[id(winner)], verdict = 0.0, "undecided"
    if verdict == "consistent" and white(refitted) and lack_of_fit(refitted).nats > 2 * _UNFIT:
        verdict = "undecided"  # no cause is likelier, and yet it is not noise alone
    if verdict == "consistent":
        winner = given
    elif verdict == "unnamed" and mapped is not None:
        # The map stands for the whole effect, not for what a law left that was not right.
        whole = mapped if winner is refitted else stand_in(refitted)
        winner = mapped if whole is None else whole
        mapped = winner
        kappa[id(mapped)] = explained(mapped, refitted)
    elif verdict == "undecided" and winner.effects:
        winner = refitted
    return Decision(verdict, winner, chance, kappa, why)


def families(t: Trial) -> list[str]:
    """Families of a trial's causes."""
    return sorted(effect.cause.family for effect in t.effects)


def _special_case(winner: Trial, passing: Sequence[Trial]) -> Trial | None:
    """The special case of the winner's law beside which its further numbers are not seen, if there is one."""
    if not winner.laws or len(winner.effects) > 1:
        return None
    law = winner.laws[0]
    cases = [t for t in passing if len(t.effects) == 1 and t.laws and t.laws[0].at == law.at]
    cases = [t for t in cases if isinstance(t.laws[0], law.contains) and winner.evidence - t.evidence < _UNSEEN]
    return max(cases, key=lambda t: t.evidence, default=None)


def _of_right_shape(
    winner: Trial, passing: Sequence[Trial], chance: dict[int, float], doubt_of: Callable[[Trial], float]
) -> tuple[Trial, float]:
    """The winner and its doubt; where that is too much, those of another law of its kind, if there is less of it.

    Predictions that all leave something hardly tell one law from another of its kind.
    """
    doubt = doubt_of(winner)
    if doubt <= 1.0 or adequate(winner):
        return winner, doubt
    alike = [t for t in passing if t is not winner and families(t) == families(winner)]
    for t in sorted(alike, key=lambda t: -chance[id(t)]):
        if chance[id(t)] > _ALIKE * chance[id(winner)] and (other := doubt_of(t)) <= 1.0:
            return t, other
    return winner, doubt


def _almost_all(t: Trial, refitted: Trial) -> bool:
    return explained(t, refitted) >= _ALMOST_ALL and t.prediction.left < _MUCH


def _reason(t: Trial, given: Trial, refitted: Trial) -> str:
    """Why a candidate is no alternative, or nothing."""
    over_refit, over_given = explained(t, refitted), explained(t, given)
    if not math.isfinite(t.evidence) or over_refit == -math.inf:
        return "its motion runs away"
    for law in t.laws:
        if other := law.otherwise(t.structure.stiffness_of(law.at)):
            return other
    if far := far_off(t) - far_off(refitted):
        return f"takes {' and '.join(sorted(far))} as far from what the model states as they may be"
    # A gain error and own values that are all off by the same share predict the same readings: only what is believed
    # beforehand weighs them, so such a candidate need not beat the refit by a margin, nor leave less.
    same = not t.laws and adequate(t) and adequate(refitted)
    better = t.evidence - (given.evidence if same else max(given.evidence, refitted.evidence))
    if better <= SIGNIFICANT:
        return f"no more probable than the model {'as given' if same else 'refitted'}"
    if over_refit >= GATE or (adequate(t) and over_given >= GATE):
        return ""
    return f"explains {max(over_refit, 0.0):.0%} of what a refit leaves, less than half"


def _needs_both(t: Trial, tried: Sequence[Trial], refitted: Trial) -> str:
    """Why a pair is no alternative to one of its effects alone, or to the best single one, or nothing."""
    if len(t.effects) == 1:
        return ""
    singles = [alone for alone in tried if len(alone.effects) == 1]
    best = max(singles, key=lambda alone: alone.evidence, default=refitted)
    size = np.sqrt(refitted.prediction.error)
    for alone in singles:
        if alone is not best and alone.effects[0] not in t.effects:
            continue
        if adequate(t) and adequate(alone) and len(t.laws) < 2:  # own values tell a gain by what is believed of them
            if t.evidence - alone.evidence <= SIGNIFICANT:
                return f"{alone.effects[0].label} alone is about as probable"
            continue
        gained = np.sqrt(alone.prediction.excess) - np.sqrt(t.prediction.excess)
        enough = explained(t, alone) >= GATE and bool(np.all(gained >= _WORTH_A_SECOND * size))
        if not enough or t.evidence - alone.evidence <= SECOND:
            return f"{alone.effects[0].label} alone explains it about as well"
    return ""


def _doubt(winner: Trial, gained: float, unfit: Unfit) -> float:
    """How far laws of other shapes gain beside the winner, whose last effect gained so many nats; above 1: too much."""
    if white(winner):
        return max(unfit.nats - _UNFIT, 0.0) / max(_UNFIT_OF_WHITE * gained - _UNFIT, _UNFIT)
    by_nats = max(unfit.nats - _UNFIT, 0.0) / max(_UNFIT_SHARE[len(winner.effects)] * gained - _UNFIT, _UNFIT)
    return max(by_nats, unfit.share / _UNFIT_OF_REST)


def _verdict(given: Trial, refitted: Trial, winner: Trial, tried: Sequence[Trial], mapped: Trial | None) -> str:
    clean = adequate(winner)
    if winner.evidence - given.evidence < SIGNIFICANT and (clean or given.prediction.left < NEGLIGIBLE):
        return "consistent"
    if given.prediction.left < NEGLIGIBLE and not clean:
        return "consistent"
    if clean:
        return "parameters" if winner is refitted else "cause" if winner.effects else "consistent"
    # No evidence for a map: it was fitted beforehand, and held-out samples judge it.
    stands_in = mapped is not None and explained(mapped, winner) >= GATE
    if winner.effects:
        # The nearest neighbour of a law that is not in the catalogue explains much of it, and leaves much.
        short = explained(winner, refitted) < NEARLY_ALL and winner.prediction.left > _MUCH
        return "unnamed" if stands_in else "undecided" if short else "cause"
    if stands_in:
        return "unnamed"
    if winner is refitted and explained(refitted, given) >= GATE and refitted.prediction.left < 2 * NEGLIGIBLE:
        return "parameters"
    return "undecided"
