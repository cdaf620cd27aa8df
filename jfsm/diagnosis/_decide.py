"""From trials to a verdict.

A cause must do three things: be more probable than its absence, explain at least half of the power that a refit of the
model leaves, and do so on every set of samples, held-out ones included. Where the winner leaves nothing but noise, its
evidence is trusted as it stands; where it does not, evidence counts no more than some tens of independent looks, and
no cause is more probable than the share of the power that it explains. And no cause is named beside which laws of other
shapes would gain more than a small share of what it gains itself, or explain half of what it leaves; up to there it is
the less sure, by half at most. Of measured structures no law is exactly true: where what one of the wrong shape
leaves is negligible, though not noise, it is near, and its class is right, if nothing else stands and runs on held-out
readings confirm it. Nor is a record called consistent where they explain more than noise. And two laws of
which predictions show nothing are not named: together they can be what one is that is not in the catalogue.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..structures import AbstractTerm, Preload
from ._adequacy import (
    GATE,
    MUCH,
    NEARLY_ALL,
    NEGLIGIBLE,
    SIGNIFICANT,
    adequate,
    almost_all,
    explained,
    practically_all,
    unexplained,
    white,
)
from ._doubt import UNFIT, doubt
from ._effect import families
from ._enough import WORTH_A_SECOND
from ._lack_of_fit import Unfit
from ._standing import likelier_laws, special_case, why_not
from ._trial import Trial

_NOT_RIGHT = "explains much of it, but is not of the right shape"
_NEAR = "is of the right class, though not quite of the right shape"
_IN_STEP = "takes the place of a noisy drive, with which it is in step"
_LIKELIER = "is likelier than a sensor's fault, but not than own values that are off by enough to be named"
_UNSEEN = "are two laws of which predictions show nothing, and may stand for one of another shape"
_ALIKE = 0.3
"""Probability of another law of its family, in those of a law that is not of the right shape, that may take its place.
"""
_LOOKS = (10.0, 40.0)
_TEMPERED = 1.5
"""By which evidence is divided that is trusted: noise levels and priors are known to some ten per cent only. With 2
all of 63 hidden effects were right that were given 0.7 to 0.9."""


@dataclass(frozen=True)
class Decision:
    """Verdict and winning trial; probability of every alternative and reason for every candidate, in their order.

    The law that is `near` is of the right class at most: it is the cause where nothing else stands and runs on held-out
    readings confirm it. Of a search that was `cut` short others may be right that were not tried.
    """

    verdict: str
    winner: Trial
    probability: dict[int, float]
    kappa: dict[int, float]
    why: dict[int, str]
    near: Trial | None = None
    cut: bool = False

    @property
    def named_term(self) -> AbstractTerm | None:
        """The winner's term, the first of them, if a law was named."""
        return next(iter(self.winner.laws), None) if self.verdict == "cause" else None

    def share(self, trial: Trial) -> float:
        """Probability of a trial; 0 for one that is no alternative."""
        return self.probability.get(id(trial), 0.0)

    def open(self) -> "Decision":
        """The decision half as sure of every cause."""
        shares = {which: p / 2 if which in self.kappa else p for which, p in self.probability.items()}
        return replace(self, probability=shares)

    def cut_short(self, refitted: Trial) -> "Decision":
        """The decision of a search that was not finished: half as sure of a cause, and undecided without one."""
        instead = replace(self.open(), near=None, cut=True)
        if self.verdict == "cause":
            return instead
        return replace(instead, verdict="undecided", winner=refitted if self.winner.effects else self.winner)

    def refused(self, why: str, instead: Trial) -> "Decision":
        """The decision without its winner, which something else speaks against."""
        probability = self.probability | {id(self.winner): 0.0}
        why_not = self.why | {id(self.winner): why}
        return replace(self, verdict="undecided", winner=instead, probability=probability, why=why_not)

    def by_class(self) -> "Decision | None":
        """The decision with the law that is near named, where there is one and nothing else stands."""
        if self.verdict != "undecided" or self.near is None:
            return None
        return replace(self, verdict="cause", winner=self.near, why=self.why | {id(self.near): _NEAR})


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
    lasting: bool = False,
    untold: Callable[[Trial], str] = lambda t: "",
    in_step: Callable[[Trial], bool] = lambda t: False,
) -> Decision:
    """Verdict over the model as given, the model refitted, every candidate, and a map that stands for any law.

    `stand_in` adds to a trial the map of what it leaves; it is asked only where the winner leaves something.
    `lack_of_fit` tells what other laws would explain beside a trial's; it is asked of a cause that would be named.
    Where some force is `forgiven` to all none of them is right: laws of time would explain whatever is left, and a map
    of the little that a law leaves does not speak against it. Where the model is wrong in a `lasting` run, predictions
    over some periods that leave little do not make it consistent. Along an `imposed` motion a map repeats even the
    small faults of a law, one by one, as often as it repeats itself. What the motion leaves `untold`, and why, is a
    rival, and no finding. What is `in_step` with a drive, whose place it may take, is not even that where anything else
    leaves nothing but noise.
    """
    ranked = _Ranked(given, refitted, tried, periods, forgiven, in_step)
    winner, near = ranked.best(), None
    stands = imposed and bool(winner.effects) and almost_all(winner, refitted)
    stands |= forgiven and bool(winner.effects) and explained(winner, refitted) >= NEARLY_ALL
    mapped = None if adequate(winner) or stands else stand_in(winner)
    verdict = _verdict(given, refitted, winner, mapped, lasting)
    if verdict == "cause" and not ranked.is_sure_of(winner):
        verdict = "undecided"
    if verdict == "cause":

        def doubt_of(t: Trial) -> float:
            unfit = lack_of_fit(t)
            # Where none is right much of the rest has a shape, and says nothing against a law that explains nearly all;
            # nor does a trace that no second effect would be named for, nor one that a whole run is to judge.
            shapeless = forgiven or lasting or explained(t, refitted) > 1.0 - WORTH_A_SECOND**2
            return doubt(t, ranked.gained(t, winner), unfit._replace(share=0.0) if shapeless else unfit)

        winner, wrong_shape = ranked.of_right_shape(winner, doubt_of)
        against = untold(winner) or _unseen(winner, refitted)
        near = ranked.nearest(winner, lack_of_fit) if wrong_shape and not against else None
        if against or wrong_shape:
            ranked.refuse(winner, against or wrong_shape, entirely=near is None)
            mapped = stand_in(refitted)
            stands_in = mapped is not None and explained(mapped, refitted) >= GATE
            verdict, winner = ("unnamed", refitted) if stands_in else ("undecided", winner)
    if verdict == "parameters":
        unlikely = doubt(winner, winner.evidence - given.evidence, lack_of_fit(winner))
        ranked.make_less_sure([winner], unlikely)
        if unlikely > 1.0:
            ranked.chance[id(winner)] = 0.0
        if ranked.chance[id(winner)] < 0.5:
            verdict = "undecided"
    if verdict == "consistent" and white(refitted) and lack_of_fit(refitted).nats > 2 * UNFIT:
        verdict = "undecided"  # no cause is likelier, and yet it is not noise alone
    if verdict == "consistent":
        winner = given
    elif verdict == "unnamed" and mapped is not None:
        # The map stands for the whole effect, not for what a law left that was not right.
        whole = mapped if winner is refitted else stand_in(refitted)
        winner = whole if whole is not None and explained(whole, refitted) >= GATE else mapped
        ranked.kappa[id(winner)] = explained(winner, refitted)
    elif verdict == "undecided" and winner.effects:
        winner = refitted
    return Decision(verdict, winner, ranked.chance, ranked.kappa, ranked.why, near)


def first_alone(
    decision: Decision, tried: Sequence[Trial], refitted: Trial, decided: Callable[[Sequence[Trial]], Decision]
) -> Decision:
    """The decision, or that on single effects where two were likelier, and not of the right shape.

    What the second one should be is open then, not the first, if that explains almost all. Nothing changes where a map
    stands for both.
    """
    wrong = [t for t in tried if len(t.effects) > 1 and decision.why[id(t)] == _NOT_RIGHT]
    if decision.verdict != "undecided" or not wrong:
        return decision
    alone = decided([t for t in tried if len(t.effects) == 1])
    if alone.verdict != "cause" or not almost_all(alone.winner, refitted):
        return decision
    return replace(alone, kappa=decision.kappa | alone.kappa, why=decision.why | alone.why)


class _Ranked:
    """Candidates, why each is not named, how much it explains, and how probable those are that may be."""

    def __init__(
        self,
        given: Trial,
        refitted: Trial,
        tried: Sequence[Trial],
        periods: float,
        forgiven: bool,
        in_step: Callable[[Trial], bool],
    ):
        self.tried, self.refitted, self.periods = [given, refitted, *tried], refitted, periods
        self.kappa = {id(t): explained(t, refitted) for t in tried}
        told = [t for t in tried if not in_step(t)]
        self.why = {id(t): why_not(t, told, given, refitted) for t in tried}
        for t in tried:
            if forgiven and any(law.timed for law in t.laws):
                self.why[id(t)] = self.why[id(t)] or "depends on time, and no second record shows the same"
        if any(adequate(t) and not self.why.get(id(t)) for t in (given, refitted, *told)):
            for t in tried:
                self.why[id(t)] = self.why[id(t)] or (_IN_STEP if in_step(t) else "")
        self.passing = [t for t in tried if not self.why[id(t)]]
        self.alternatives = [given, refitted, *self.passing]
        self.told, self.chance = told, self._shares(self.alternatives)

    def best(self) -> Trial:
        """The most probable; of a law and its special case that are about as probable, the latter."""
        winner = max(self.alternatives, key=lambda t: self.chance[id(t)])
        for t in self.passing:
            if t is not winner:
                self.why[id(t)] = "explains it too, but is less probable"
        special = special_case(winner, self.passing)
        if special is None:
            return winner
        self.why[id(winner)], self.why[id(special)] = "is hardly more probable than its special case", ""
        return special

    def _shares(self, among: Sequence[Trial]) -> dict[int, float]:
        return {id(t): float(p) for t, p in zip(among, probabilities(among, self.periods), strict=True)}

    def is_sure_of(self, winner: Trial) -> bool:
        """Whether a name, or at least its family, is probable enough to be said."""
        if likelier := likelier_laws(winner, self.told, self.refitted):
            self.chance = self._shares([*self.alternatives, *likelier])
            self.why |= {id(t): _LIKELIER for t in likelier}
        family = sum(self.chance[id(t)] for t in self._family(winner))
        if not adequate(winner):
            # The rest may be the work of another law than the catalogue's: no name is surer than what it explains.
            self.chance = {which: p * self.kappa[id(winner)] for which, p in self.chance.items()}
        return self.chance[id(winner)] >= 0.5 or family >= 0.8

    def gained(self, t: Trial, winner: Trial) -> float:
        """Nats by which a trial beats whatever has fewer effects than the winner."""
        return t.evidence - max(one.evidence for one in self.tried if len(one.effects) < len(winner.effects))

    def of_right_shape(self, winner: Trial, doubt_of: Callable[[Trial], float]) -> tuple[Trial, str]:
        """The winner, or another law of its kind whose shape is right where its own is not, and what speaks against it.

        Predictions that all leave something hardly tell one law from another of its kind.
        """
        found, much = winner, doubt_of(winner)
        if much > 1.0 and not adequate(winner):
            alike = [t for t in self._family(winner) if t is not winner]
            for t in sorted(alike, key=lambda t: -self.chance[id(t)]):
                if self.chance[id(t)] > _ALIKE * self.chance[id(winner)] and (other := doubt_of(t)) <= 1.0:
                    found, much = t, other
                    self.refuse(winner, _NOT_RIGHT)
                    self.why[id(found)] = ""
                    break
        self.make_less_sure(self._family(found), much)
        return found, _NOT_RIGHT if much > 1.0 else ""

    def nearest(self, winner: Trial, lack_of_fit: Callable[[Trial], Unfit]) -> Trial | None:
        """The law of the winner's kind that is right in its class though not in its shape, or None.

        Predictions over some periods hardly tell such laws apart; runs over all that was fitted do.
        """
        alike = [t for t in self._family(winner) if self.chance[id(t)] > _ALIKE * self.chance[id(winner)]]
        kin = [t for t in alike if practically_all(t, self.refitted)]
        if not kin or white(winner) or len(winner.effects) > 1:
            return None
        strays = np.array([max(lack_of_fit(t).strays, 1e-9) for t in kin])
        chance = np.array([self.chance[id(t)] for t in kin])
        told = chance * (np.min(strays) / strays) ** _LOOKS[0]
        self.chance |= {id(t): float(p) for t, p in zip(kin, told * np.sum(chance) / np.sum(told), strict=True)}
        return kin[int(np.argmax(told))]

    def make_less_sure(self, trials: Sequence[Trial], much: float) -> None:
        """By half at most."""
        for t in trials:
            self.chance[id(t)] *= 1.0 - 0.5 * min(much, 1.0)

    def refuse(self, t: Trial, why: str, *, entirely: bool = True) -> None:
        self.why[id(t)] = why
        if entirely:
            self.chance[id(t)] = 0.0

    def _family(self, winner: Trial) -> list[Trial]:
        return [t for t in self.passing if families(t.effects) == families(winner.effects)]


def _unseen(t: Trial, refitted: Trial) -> str:
    """Why two laws that only their evidence speaks for are no finding, or nothing; a constant force is no such law."""
    laws = [e for e in t.effects if not e.cause.is_sensor and e.cause.effect is not Preload]
    return _UNSEEN if len(laws) > 1 and not np.any(unexplained(refitted)) else ""


def probabilities(trials: Sequence[Trial], periods: float) -> np.ndarray:
    """Probability of each trial among them."""
    evidence = np.array([t.evidence for t in trials])
    best = trials[int(np.argmax(evidence))]
    if adequate(best):
        score = evidence / _TEMPERED
    else:
        looks = min(max(periods / 5, _LOOKS[0]), _LOOKS[1])
        error = np.array([math.sqrt(float(np.mean(t.prediction.error))) for t in trials])
        size = np.array([len(t.unknowns) for t in trials])
        score = -looks * np.log(error) - 0.5 * size * math.log(looks)
    share = np.exp(score - np.max(score))
    return 0.995 * share / np.sum(share) + 0.005 / len(trials)


def _verdict(given: Trial, refitted: Trial, winner: Trial, mapped: Trial | None, lasting: bool) -> str:
    clean, slight = adequate(winner), given.prediction.left < NEGLIGIBLE and not lasting
    if winner.evidence - given.evidence < SIGNIFICANT and (clean or slight):
        return "consistent"
    if slight and not clean:
        return "consistent"
    if clean:
        return "parameters" if winner is refitted else "cause" if winner.effects else "consistent"
    # No evidence for a map: it was fitted beforehand, and held-out samples judge it.
    stands_in = mapped is not None and explained(mapped, winner) >= GATE
    if winner.effects:
        # The nearest neighbour of a law that is not in the catalogue explains much of it, and leaves much.
        short = explained(winner, refitted) < NEARLY_ALL and winner.prediction.left > MUCH
        return "unnamed" if stands_in else "undecided" if short else "cause"
    if stands_in:
        return "unnamed"
    if winner is refitted and explained(refitted, given) >= GATE and refitted.prediction.left < 2 * NEGLIGIBLE:
        return "parameters"
    return "undecided"
