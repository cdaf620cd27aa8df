"""Batches of starts that share a program: fitted side by side in stages, the hopeless ones not to the end."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain
from typing import NamedTuple

import numpy as np

from ..._threads import compiled_once, side_by_side
from ...identification import LADDER, LANES, Maximum, Posterior, finish, lanes_of, rungs, with_offsets
from ...structures import AccelerationGain, ForceGain, Structure
from ..evidence.fitted import Trial, lane_left, trial
from ..evidence.setup import Problem
from ..hypotheses.candidate import Candidate
from ..hypotheses.effect import Effect, families
from ..hypotheses.initial_values import Begin

FAR_BEHIND = 200.0
"""Nats behind the leader, one per cent of unmodelled force forgiven, from which a candidate is not pursued,"""
_ALWAYS_PURSUED = 4
"""unless it is among the best of them."""
_BLIND = 10.0
"""Error power, in those of another start of the same effects, from which a start predicts nothing, whatever its
evidence."""
_FIRST = 2
"""Leaders whose tops are known before the others go on."""


class Schedule(NamedTuple):
    """Shares of the force that are forgiven stage by stage, and how many batches go on after an early stage: so many at
    least, and such a share of them.

    Those that are kept go on after every early stage, and `to_the_end` past the last one, too.
    """

    ladder: tuple[float, ...]
    least: int
    share: float
    to_the_end: bool = False

    def going_on(self, count: int) -> int:
        """How many of so many batches go on, at least."""
        return max(self.least, int(self.share * count))

    def foreseen(self, count: int, stages: int) -> int:
        """Steps to the tops that so many batches will take over these stages, as far as can be foreseen."""
        steps = 0
        for _ in range(stages):
            steps += count
            count = min(count, self.going_on(count))
        return steps + count


FROM_THERE = Schedule(LADDER[-1:], 1, 1.0)
"""Of candidates that begin from numbers of a fit."""


class LeftBehind(NamedTuple):
    """A candidate that was not pursued, and how many nats it was behind the best after the same rung: infinitely many
    where it had not begun when the time was over. `cut` is whether it was pursued until then."""

    effects: tuple[Effect, ...]
    nats: float
    cut: bool = False


class Found(NamedTuple):
    """The best trial of every candidate that was pursued, and the others."""

    trials: list[Trial]
    behind: list[LeftBehind]

    def and_then(self, found: "Found") -> "Found":
        """With what was found later."""
        trials = best_of_each([*self.trials, *found.trials])
        done = {t.effects for t in trials}
        behind = {one.effects: one for one in (*self.behind, *found.behind) if one.effects not in done}
        return Found(trials, list(behind.values()))


Tell = Callable[[str, int], None]
"""Told of every step: what, and how many more of the same kind there may be after it."""
Beginning = tuple[Candidate, Structure, Begin | None]
"""A candidate, the structure with the size of its effect, and where it begins otherwise (None: as given)."""


class Batch:
    """Starts of one law, fitted side by side stage by stage."""

    def __init__(self, beginnings: Sequence[Beginning], problem: Problem, ladder: Sequence[float]):
        candidates, starts, begins = zip(*beginnings, strict=True)
        lanes = lanes_of(starts[0])
        problem = problem.resolving(starts)
        posteriors = [
            problem.posterior(starts[i : i + lanes], begins[i : i + lanes]) for i in range(0, len(starts), lanes)
        ]
        self.label = " beside ".join(effect.label for effect in candidates[0].effects)
        self.families = families(candidates[0].effects)
        self.share = max(math.inf if candidate.share is None else candidate.share for candidate in candidates)
        self.program, self.behind = posteriors[0].program, math.inf
        self.limit, self.begun, self.candidates = problem.limit, False, candidates
        self.imposed, self.left = problem.imposed, 0.0
        self.climb = self._climb(posteriors, candidates, lanes, ladder)

    def _climb(self, posteriors: Sequence[Posterior], candidates: tuple[Candidate, ...], lanes: int, ladder):
        # Where one climbs alone it is the one that begins best, seen from where not too much is forgiven. How much that
        # is no one knows: the best from two places climb, where these are not the same.
        chosen = [0]
        if len(posteriors) > 1:
            begun = [[self._begins(p, share) for p in posteriors] for share in ladder[-2:]]
            chosen = sorted({int(np.argmin(values)) for values in begun})
        for stands in zip(*(rungs(posteriors[i], ladder, limit=self.limit) for i in chosen), strict=True):
            found, best = min(zip(stands, chosen, strict=True), key=lambda one: np.min(one[0].value))
            self.posterior, self.candidates = posteriors[best], candidates[best * lanes :][:lanes]
            yield found

    def _begins(self, posterior: Posterior, share: float) -> float:
        """How it begins where such a share is forgiven; past the time limit no one looks."""
        return math.inf if self.limit.over else float(np.min(posterior.values(posterior.initial(), share)))

    def step(self) -> "Batch":
        """On to the next stage, unless the time is over."""
        if not self.limit.over:
            self.rung, self.begun = next(self.climb), True
            if self.imposed:
                self.left = lane_left(self.posterior, self.rung.theta, int(np.argmin(self.rung.value)))
        return self

    def top(self, best: float) -> list[Trial]:
        """The best start of each candidate at its top, beside the best value known; none once the time is over."""
        if self.limit.over:
            return []
        return list(self.trials(finish(self.posterior, self.rung, best=best, limit=self.limit)))

    @property
    def best(self) -> float:
        return float(np.min(self.rung.value))

    def trials(self, found: Maximum) -> Iterator[Trial]:
        """The best start of each candidate as a trial."""
        for one in dict.fromkeys(self.candidates):
            lanes = [lane for lane, candidate in enumerate(self.candidates) if candidate is one]
            lane = min(lanes, key=lambda lane: found.value[lane])
            yield trial(self.posterior, found, lane, float(self.rung.value[lane]), effects=one.effects)


def batches_of(tried: Sequence[Candidate], own: Begin | None, problem: Problem, schedule: Schedule) -> list[Batch]:
    """Batches of the starts of these candidates, which begin from `own` values too."""
    return [Batch(beginnings, problem, schedule.ladder) for beginnings in groups(tried, own, problem)]


def groups(tried: Sequence[Candidate], own: Begin | None, problem: Problem) -> list[list[Beginning]]:
    """Starts that can share a program, as many together as it has lanes: one law, whatever its sign and place, and as
    many unknowns, of which a constant force leaves one less where a sensor measures the force."""
    by_law: dict[tuple, list[Beginning]] = {}
    for candidate in tried:
        alone = lanes_of(candidate.starts[0]) == 1  # all starts of one candidate then, of which one climbs
        offsets = len(with_offsets(candidate.starts[0], problem.records).sensors)
        law = offsets, *(effect.cause.effect for effect in candidate.effects)
        together = by_law.setdefault((law, candidate if alone else None), [])
        together += [(candidate, start, begin) for begin in _begins(candidate, own) for start in candidate.starts]
    found = list[list[Beginning]]()
    for (_, alone), together in by_law.items():
        width = len(together) if alone else LANES
        found += [together[i : i + width] for i in range(0, len(together), width)]
    return found


def _begins(candidate: Candidate, own: Begin | None) -> list[Begin | None]:
    """Where a law starts: from the own values as given and from those of the refit, since either may be far from what
    is right beside it. A gain lies on a ridge with the own values, and only a climb from those as given ends at its own
    end."""
    is_gain = all(issubclass(effect.cause.effect, ForceGain | AccelerationGain) for effect in candidate.effects)
    if candidate.begin or is_gain or own is None:
        return [candidate.begin]
    return [None, own]


def climbed(batches: Sequence[Batch], schedule: Schedule, kept: Sequence[Batch], best: Trial, tell: Tell) -> Found:
    """All batches stage by stage, the hopeless ones that are not `kept` only so far; `best` is known already.

    Once the time is over they stay where they are, and those that are not at their tops are left behind.
    """
    pursued = _through_stages(batches, schedule, kept, tell)
    near = _near(pursued, _ALWAYS_PURSUED, best.rung)
    pursued = [b for b in pursued if b in near or (schedule.to_the_end and b in kept)]
    trials = _at_their_tops(pursued, best.value, tell)
    return Found(trials, _left_behind(batches, pursued, trials))


def _through_stages(batches: Sequence[Batch], schedule: Schedule, kept: Sequence[Batch], tell: Tell) -> list[Batch]:
    """Those that have come through all stages."""
    stages = len(schedule.ladder)
    on_the_first = chain.from_iterable(side_by_side(Batch.step, together) for together in compiled_once(batches))
    for done, batch in enumerate(on_the_first, start=1):
        tell(batch.label, schedule.foreseen(len(batches), stages) - done)
    pursued = [batch for batch in batches if batch.begun]
    for stage in range(1, stages):
        near = _near(pursued, schedule.going_on(len(pursued)))
        pursued = [batch for batch in pursued if batch in near or batch in kept]
        for done, batch in enumerate(side_by_side(Batch.step, pursued), start=1):
            tell(batch.label, schedule.foreseen(len(pursued), stages - stage) - done)
    return pursued


def _at_their_tops(pursued: Sequence[Batch], best: float, tell: Tell) -> list[Trial]:
    """The best of each candidate. The leaders go first: beside their tops the others may be left where they are."""
    trials, done = list[Trial](), 0
    ranked = sorted(pursued, key=lambda batch: batch.behind)
    for together in (ranked[:_FIRST], ranked[_FIRST:]):
        for found in side_by_side(partial(Batch.top, best=best), together):
            done += 1
            tell("the best candidates", len(ranked) - done)
            trials += found
        if not any(batch.imposed for batch in together):
            best = min([best, *(t.value for t in trials)])
    return best_of_each(trials)


def _left_behind(batches: Sequence[Batch], pursued: Sequence[Batch], trials: Sequence[Trial]) -> list[LeftBehind]:
    """The candidates that were not fitted to their tops, each by its batch that came nearest."""
    fitted, behind = {t.effects for t in trials}, dict[tuple[Effect, ...], LeftBehind]()
    for batch in batches:
        cut = not batch.begun or batch in pursued
        for one in (LeftBehind(candidate.effects, batch.behind, cut) for candidate in batch.candidates):
            if one.effects not in fitted:
                behind[one.effects] = min(one, behind.get(one.effects, one), key=lambda one: one.nats)
    return list(behind.values())


def _near(batches: Sequence[Batch], least: int, leader: float = math.inf) -> list[Batch]:
    """Those that are not hopelessly behind after the same stage, or among the `least` best.

    Along an imposed motion also those of the best predictions: a law that remembers may follow any force by what noise
    of the motion does to it, and predict none.
    """
    leader = min([leader, *(batch.best for batch in batches)])
    for batch in batches:
        batch.behind = batch.best - leader
    ranked = sorted(batches, key=lambda batch: batch.behind)
    predicting = sorted((batch for batch in batches if batch.imposed), key=lambda batch: batch.left)[:least]
    best = [*ranked[:least], *predicting]
    return [batch for batch in ranked if batch in best or batch.behind < FAR_BEHIND]


def best_of_each(trials: Sequence[Trial]) -> list[Trial]:
    """The most probable start of every cause at every place, of those that predict anything."""
    best: dict[tuple, Trial] = {}
    for t in trials:
        other = best.get(t.effects, t)
        best[t.effects] = replace(_better(t, other), rung=min(t.rung, other.rung))
    return list(best.values())


def _better(one: Trial, other: Trial) -> Trial:
    """The one that predicts, where the other does not; else the more probable one."""
    left, rest = one.prediction.power, other.prediction.power
    if max(left, rest) > _BLIND * min(left, rest):
        return one if left < rest else other
    return one if one.evidence > other.evidence else other
