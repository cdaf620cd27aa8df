"""Batches of starts that share a program, fitted side by side stage by stage."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...identification import LADDER, LANES, Maximum, Posterior, beginnings, finish, lanes_of, rungs, with_offsets
from ...structures import AccelerationGain, ForceGain, Structure
from ..evidence.fitted import Trial, lane_left, trial
from ..evidence.setup import Problem
from ..hypotheses.candidate import Candidate
from ..hypotheses.effect import families
from ..hypotheses.initial_values import Begin


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
        self.program, self.behind, self.samples = posteriors[0].program, math.inf, posteriors[0].leading
        self.limit, self.begun, self.candidates = problem.limit, False, candidates
        self.imposed, self.left = problem.imposed, 0.0
        self.climb = self._climb(posteriors, candidates, lanes, ladder)

    def _climb(self, posteriors: Sequence[Posterior], candidates: tuple[Candidate, ...], lanes: int, ladder):
        # Where one climbs alone it is the one that begins best, seen from where not too much is forgiven. How much that
        # is no one knows: the best from two places climb, where these are not the same.
        chosen = [0]
        if len(posteriors) > 1 and not self.limit.over:
            chosen = sorted({int(np.argmin(values)) for values in beginnings(posteriors, ladder[-2:])})
        for stands in zip(*(rungs(posteriors[i], ladder, limit=self.limit) for i in chosen), strict=True):
            found, best = min(zip(stands, chosen, strict=True), key=lambda one: np.min(one[0].value))
            self.posterior, self.candidates = posteriors[best], candidates[best * lanes :][:lanes]
            yield found

    def step(self) -> "Batch":
        """On to the next stage, unless the time is over."""
        if not self.limit.over:
            self.rung, self.begun = next(self.climb), True
            if self.imposed:
                self.left = lane_left(self.posterior, self.rung.theta, int(np.argmin(self.rung.value)))
        return self

    def misfit(self, share: float) -> float:
        """Mean square of the innovations of the best of its starts, in their variances, such a share of the force
        forgiven."""
        lane = int(np.argmin(self.rung.value))
        return self.posterior.misfit(self.rung.theta[lane], lane, share, first=True)

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
