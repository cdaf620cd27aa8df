"""Batches of starts climb in stages, the hopeless ones not to the end."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain
from typing import NamedTuple

from ..._threads import compiled_once, side_by_side
from ..evidence.fitted import Trial
from ..hypotheses.candidate import Candidate
from ..hypotheses.effect import Effect
from .batches import Batch, Schedule

FAR_BEHIND = 200.0
"""Nats behind the leader, one per cent of unmodelled force forgiven, from which a candidate is not pursued,"""
_ALWAYS_PURSUED = 4
"""unless it is among the best of them;"""
_TO_THE_TOP = 2
"""nor to its top, unless it is among so many."""
_BLIND = 10.0
"""Error power, in those of another start of the same effects, from which a start predicts nothing, whatever its
evidence."""
_ARRIVED = 2.0
"""Mean square of innovations, in their variances, up to which a leader leaves hardly more than noise."""
_HOPELESS = 50.0
"""Nats for each sample behind another start of the same candidates, after the same stage, from which a start is not
pursued;"""
_TELLING = 0.03
"""nor is it behind any other, once no more than such a share of the force is forgiven."""
_FIRST = 2
"""Leaders whose tops are known before the others go on."""


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


def climbed(batches: Sequence[Batch], schedule: Schedule, kept: Sequence[Batch], best: Trial, tell: Tell) -> Found:
    """All batches stage by stage, the hopeless ones that are not `kept` only so far; `best` is known already.

    Once the time is over they stay where they are, and those that are not at their tops are left behind.
    """
    pursued = _through_stages(batches, schedule, kept, tell)
    near = _near(pursued, _TO_THE_TOP, best.rung)
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
        pursued = _going_on(pursued, schedule, stage, kept)
        for done, batch in enumerate(side_by_side(Batch.step, pursued), start=1):
            tell(batch.label, schedule.foreseen(len(pursued), stages - stage) - done)
    return pursued


def _going_on(pursued: Sequence[Batch], schedule: Schedule, stage: int, kept: Sequence[Batch]) -> list[Batch]:
    """Those that go on to this stage. Once one has arrived the others cannot be far likelier: of those far behind only
    the laws that are kept go on."""
    share, staying = schedule.ladder[stage - 1], list(kept)
    pursued, least = _hopeful(pursued, share), schedule.going_on(len(pursued))
    if _arrived(pursued, share):
        least, staying = _ALWAYS_PURSUED, [batch for batch in kept if math.isfinite(batch.share)]
    near = _near(pursued, least)
    return [batch for batch in pursued if batch in near or batch in staying]


def _arrived(pursued: Sequence[Batch], share: float) -> bool:
    """Whether the leader leaves hardly more than noise, such a share of the force forgiven."""
    leader = min(pursued, key=lambda batch: batch.best, default=None)
    return leader is not None and not leader.limit.over and leader.misfit(share) < _ARRIVED


def _hopeful(pursued: Sequence[Batch], share: float) -> list[Batch]:
    """Those that are not far behind others of the same candidates, which began elsewhere, nor behind any others where
    such a share of the force, which is forgiven, tells."""
    leader, best = min((batch.best for batch in pursued), default=math.inf), dict[tuple[Candidate, ...], float]()
    for batch in pursued:
        best[batch.candidates] = min(batch.best, best.get(batch.candidates, math.inf))
    ahead = [leader if share <= _TELLING else best[batch.candidates] for batch in pursued]
    return [b for b, reference in zip(pursued, ahead, strict=True) if b.best - reference < _HOPELESS * b.samples]


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
