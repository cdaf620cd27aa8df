"""Every hypothesis fitted: those that share a program side by side, the hopeless ones only so far."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain
from typing import NamedTuple

import numpy as np

from ..._threads import compiled_once, side_by_side
from ...identification import LADDER, LANES, Maximum, Posterior, approach, finish, lanes_of, rungs, with_offsets
from ...structures import AbstractSensor, AbstractTerm, AccelerationGain, ForceGain, Structure
from ..evidence.excess import explained, is_noise_only
from ..evidence.fitted import Trial, trial
from ..evidence.own_values import at_bounds
from ..evidence.setup import Problem
from ..hypotheses.candidate import Candidate
from ..hypotheses.effect import Effect, families
from ..hypotheses.initial_values import Begin, found_in, own_part
from ..thresholds import THRESHOLDS
from .pairs import crossed, instead, joined, pairs
from .related_laws import beside_a_spring, instead_of, late_instead, resting, special_cases
from .stopping import is_itself

FAR_BEHIND = 200.0
"""Nats behind the leader, one per cent of unmodelled force forgiven, from which a candidate is not pursued,"""
_ALWAYS_PURSUED = 4
"""unless it is among the best of them."""
_FIRST = 2
"""Leaders whose tops are known before the others go on."""
_PROMISING = 4
"""Laws that explain most of the missing force: no early rung ends them, nor causes of which it tells nothing. What they
are worth, a few steps may not show."""


class _Way(NamedTuple):
    """Rungs of a climb, and how many lots go on after an early one: so many at least, and such a share of them.

    Those that are kept go on after every early rung, and `to_the_end` past the last one, too.
    """

    ladder: tuple[float, ...]
    least: int
    share: float
    to_the_end: bool = False


_ALONE = _Way((0.3, 0.03, 0.01), 10, 0.5)
"""Of single effects: the refit has been at the top already."""
_TOGETHER = _Way((0.03, 0.01), 6, 0.25)
"""Of pairs: one of the two has been fitted already."""
_INSTEAD = _TOGETHER._replace(to_the_end=True)
"""Of those that share an effect with the best pair,"""
_ROUNDS = 3
"""which are looked for so many times, at most."""
_ALIKE = 20.0
"""Nats behind the best pair up to which effects of others of its families are tried together, too."""
_FROM_THERE = _Way(LADDER[-1:], 1, 1.0)
"""From numbers of what is akin."""
_CLOSE = 100.0
"""Nats behind a law up to which another one may have stopped on its way, and is tried again."""
_AGAIN = 4
"""Single effects, and pairs, of one problem that are fitted in another: the first in evidence, and in prediction; and
single effects close to the likeliest that are tried in its place."""


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


class _Lot:
    """Starts of one law on their way up, side by side."""

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

    def step(self) -> "_Lot":
        """On to the next rung, unless the time is over."""
        if not self.limit.over:
            self.rung, self.begun = next(self.climb), True
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


def fit_model(problem: Problem, near: Trial | None = None) -> tuple[Trial, Trial]:
    """The model as given, and with its own values refitted, each the better of two climbs.

    One comes down the ladder, for values that are far off; one begins at the values as given, for a model that lacks
    something, whose top rungs lead astray. Of values refitted before, `near` tells them.
    """
    own = None if near is None else own_part(found_in(near))
    both = min(2, lanes_of(problem.model))
    ladder = LADDER if near is None else LADDER[-1:]

    def climb(posterior: Posterior) -> tuple[Maximum, float]:
        rung = approach(posterior, ladder, limit=problem.limit)
        theta = np.vstack([rung.theta[:1], posterior.initial()[1:]])
        return finish(posterior, replace(rung, theta=theta), limit=problem.limit), float(rung.value[0])

    posteriors = [problem.posterior([problem.model] * both, [own] * both, refit=refit) for refit in (False, True)]
    posteriors[0].evaluate(posteriors[0].initial())  # compiled once, before both ask for it
    climbed = side_by_side(climb, posteriors)
    given, refitted = (
        trial(posterior, found, int(np.argmin(found.value)), rung, name)
        for name, posterior, (found, rung) in zip(("given", "refitted"), posteriors, climbed, strict=True)
    )
    return given, refitted


def refit_from(beside: Sequence[Trial], refitted: Trial, problem: Problem) -> Trial:
    """The model refitted, the better of two climbs: its own may have stopped below where one from own values leads that
    were found beside an effect."""
    begins = [own_part(found_in(t)) for t in sorted(beside, key=lambda t: t.value)[: lanes_of(problem.model)]]
    if not begins or problem.limit.over:
        return refitted
    posterior = problem.posterior([problem.model] * len(begins), begins)
    rung = approach(posterior, LADDER[-1:], limit=problem.limit)
    found = finish(posterior, rung, limit=problem.limit)
    again = trial(posterior, found, int(np.argmin(found.value)), float(np.min(rung.value)), refitted.label)
    return again if again.evidence > refitted.evidence else refitted


def groups(tried: Sequence[Candidate], own: Begin | None, problem: Problem) -> list[list[Beginning]]:
    """Starts that can share a program, in lots of its lanes: one law, whatever its sign and place, and as many
    unknowns, of which a constant force leaves one less where a sensor measures the force.

    A law starts twice, from the own values as given and from those of the refit: either may be far from what is right
    beside it. A gain lies on a ridge with the own values, and only a climb from those as given ends at its own end.
    """
    by_law: dict[tuple, list[Beginning]] = {}
    lots = []
    for candidate in tried:
        gain = all(issubclass(effect.cause.effect, ForceGain | AccelerationGain) for effect in candidate.effects)
        begins = [candidate.begin] if candidate.begin or gain or own is None else [None, own]
        alone = lanes_of(candidate.starts[0]) == 1  # all starts of one candidate then, of which one climbs
        offsets = len(with_offsets(candidate.starts[0], problem.records).sensors)
        law = offsets, *(effect.cause.effect for effect in candidate.effects)
        lot = by_law.setdefault((law, candidate if alone else None), [])
        lot += [(candidate, s, begin) for begin in begins for s in candidate.starts]
    for (_, alone), lot in by_law.items():
        width = len(lot) if alone else LANES
        lots += [lot[i : i + width] for i in range(0, len(lot), width)]
    return lots


def search(
    tried: Sequence[Candidate],
    given: Trial,
    refitted: Trial,
    problem: Problem,
    tell: Tell,
    known: Sequence[Trial] = (),
) -> Found:
    """Every candidate fitted, those far behind only so far, also behind what is `known` already."""
    own = own_part(found_in(refitted)) if refitted.evidence > given.evidence else None
    lots = [_Lot(beginnings, problem, _ALONE.ladder) for beginnings in groups(tried, own, problem)]
    most = sorted((candidate.share or 0.0 for candidate in tried), reverse=True)[:_PROMISING]
    kept = [lot for lot in lots if lot.share > 0 and lot.share >= most[-1]]
    return _climbed(lots, _ALONE, kept, min([refitted, *known], key=lambda t: t.value), tell)


def search_akin(
    close: Sequence[Trial],
    every: Sequence[Candidate],
    known: Found,
    problem: Problem,
    tell: Tell,
) -> Found:
    """What is akin to laws that come close, special cases and others, what may stand for the likeliest, and late
    channels instead of early ones, fitted from their numbers too.

    From elsewhere they may have stopped on the way, as a law has that is less probable than a special case of it; where
    nothing leaves noise only, than any.
    """
    effects, tried = [effect for c in every for effect in c.effects], list[Candidate]()
    for t in close:
        begin = found_in(t)
        for law in t.laws:
            tried += special_cases(law, begin, every)
            tried += beside_a_spring(law, begin, every, problem.model)
            tried += resting(t.structure, law, begin, every, problem.model, problem.first)
        for part in t.parts:
            tried += late_instead(part, begin, effects, problem.model)
    if problem.limit.over:
        return known
    evidence, wider = {t.effects: t.evidence for t in known.trials}, list[Candidate]()
    ranked = sorted(close if any(map(is_noise_only, close)) else known.trials, key=lambda t: -t.evidence)
    for t in ranked:
        done = {c.effects for c in wider}
        behind = [c for c in every if c.effects not in done and evidence.get(c.effects, -math.inf) < t.evidence]
        near = _close_to(t, known.trials) if t is ranked[0] else {}
        wider += [c for law in t.laws for c in instead_of(t, law, behind, near, problem)]
    return _from_there(tried + wider, known, problem, tell)


def _close_to(leader: Trial, trials: Sequence[Trial]) -> dict[Effect, float]:
    """Single effects that come closest to a trial, and their evidence."""
    close = [t for t in trials if len(t.effects) == 1 and 0 < leader.evidence - t.evidence < _CLOSE]
    return {t.effects[0]: t.evidence for t in sorted(close, key=lambda t: -t.evidence)[:_AGAIN]}


def search_again(told: Sequence[Trial], refitted: Trial, problem: Problem, tell: Tell) -> Found:
    """The best that another problem told, as pieces of long records, fitted from there.

    These are, of single effects and of pairs, the most probable and those that predict best, and the effects of such
    pairs one by one. Once the most probable leaves noise only, those far behind it are not among them.
    """
    ways = (lambda t: -t.evidence, lambda t: float(np.sum(t.prediction.error)))
    leader = max(told, key=lambda t: t.evidence, default=None)
    if leader is not None and is_noise_only(leader):
        told = [t for t in told if leader.evidence - t.evidence < _CLOSE]
    alike = [[t for t in told if (len(t.effects) > 1) is many] for many in (False, True)]
    best = {t.effects: t for these in alike for way in ways for t in sorted(these, key=way)[:_AGAIN]}
    parts = {(effect,) for effects in best if len(effects) > 1 for effect in effects}
    best |= {t.effects: t for t in told if t.effects in parts}
    tried = [_as_candidate(t, problem.model) for t in best.values()]
    lots = [_Lot(beginnings, problem, _FROM_THERE.ladder) for beginnings in groups(tried, None, problem)]
    return _climbed(lots, _FROM_THERE._replace(to_the_end=True), lots, refitted, tell)


def search_known(found: Trial, others: Found, problem: Problem, tell: Tell) -> Found:
    """What another part of the records told, fitted from there too."""
    return _from_there([_as_candidate(found, problem.model)], others, problem, tell)


def search_beside(
    alone: Trial, other: Effect, part: AbstractTerm | AbstractSensor, problem: Problem, tell: Tell
) -> Found:
    """A single effect, and the same beside another one that begins with these numbers."""
    pair = joined(problem.model, alone.effects[0], alone.parts[0], other, [part], found_in(alone))
    return _from_there([pair], Found([alone], []), problem, tell)


def _as_candidate(t: Trial, model: Structure) -> Candidate:
    """A trial of another problem, to begin from its numbers; what one record had to itself is not known there."""
    return Candidate(t.effects, (t.effects_on(model),), begin=own_part(found_in(t)))


def _from_there(tried: Sequence[Candidate], known: Found, problem: Problem, tell: Tell) -> Found:
    """What is known already, and candidates that begin from numbers that were found."""
    if not tried or problem.limit.over:
        return known
    lots = [_Lot(beginnings, problem, _FROM_THERE.ladder) for beginnings in groups(tried, None, problem)]
    best = min(known.trials, key=lambda t: t.value)
    return known.and_then(_climbed(lots, _FROM_THERE, [], best, tell))


def search_pairs(
    effects: Sequence[Effect],
    singles: Sequence[Trial],
    known: Trial | None,
    refitted: Trial,
    problem: Problem,
    tell: Tell,
) -> Found:
    """Pairs of good single causes fitted, then those that share one with the best pair, as long as that changes.

    What is `known` to act is one of the good ones. At last either effect of the best pair is fitted by itself again.
    """
    best = min([refitted, *singles], key=lambda t: t.value)

    def climbed(tried: Sequence[Candidate], way: _Way, kept: list[str] | None = None) -> Found:
        lots = [_Lot(beginnings, problem, way.ladder) for beginnings in groups(tried, None, problem)]
        return _climbed(lots, way, [lot for lot in lots if lot.families == kept], best, tell)

    def leading(found: Found) -> Trial:
        possible = [t for t in found.trials if is_itself(t) and at_bounds(t) <= at_bounds(refitted)]
        return max(possible, key=lambda t: t.evidence, default=best)

    found, before = climbed(pairs(singles, known, effects, problem), _TOGETHER), best
    for _ in range(_ROUNDS):
        leader = leading(found)
        gained = leader.evidence - before.evidence
        if (
            problem.limit.over
            or gained < THRESHOLDS.significant
            and (before is not best or explained(leader, best) < THRESHOLDS.half)
        ):
            break
        # From the leader's numbers some may arrive that stopped on their way from elsewhere. Those of its own families
        # are seen off at their tops only: laws alike tell apart late. Once it leaves noise only, others are no use.
        kin, done = families(leader.effects), {t.effects for t in found.trials}
        others = before is best or not is_noise_only(leader)
        near = instead(leader, effects, problem)
        near = [c for c in near if families(c.effects) == kin or (others and c.effects not in done)]
        found, before = found.and_then(climbed(near, _INSTEAD, kept=kin)), leader
    leader = leading(found)
    if leader is best or problem.limit.over:
        return found
    kin = families(leader.effects)
    alike = [t for t in found.trials if families(t.effects) == kin and abs(leader.evidence - t.evidence) < _ALIKE]
    alone = [t for t in singles if t.effects and best.evidence - t.evidence < _ALIKE]
    tried = crossed(alike, alone, problem.model) + _each_alone(leader, problem.model)
    return _from_there(tried, found, problem, tell)


def _each_alone(pair: Trial, model: Structure) -> list[Candidate]:
    """Its effects one by one, from its numbers: by itself either may have stopped on its way, and be enough."""
    parts = zip(pair.effects, pair.parts, strict=True)
    return [Candidate((effect,), (model + part,), begin=found_in(pair)) for effect, part in parts]


def _climbed(lots: Sequence[_Lot], way: _Way, kept: Sequence[_Lot], best: Trial, tell: Tell) -> Found:
    """All lots on their way up, the hopeless ones that are not `kept` only so far; `best` is known already.

    Once the time is over they stay where they are, and those that are not at their tops are left behind.
    """
    height = len(way.ladder)
    on_the_first = chain.from_iterable(side_by_side(_Lot.step, together) for together in compiled_once(lots))
    for done, lot in enumerate(on_the_first, start=1):
        tell(lot.label, _foreseen(len(lots), way, height) - done)
    pursued = [lot for lot in lots if lot.begun]
    for rung in range(1, height):
        near = _near(pursued, max(way.least, int(way.share * len(pursued))))
        pursued = [lot for lot in pursued if lot in near or lot in kept]
        for done, lot in enumerate(side_by_side(_Lot.step, pursued), start=1):
            tell(lot.label, _foreseen(len(pursued), way, height - rung) - done)
    near = _near(pursued, _ALWAYS_PURSUED, best.rung)
    pursued = [lot for lot in pursued if lot in near or (way.to_the_end and lot in kept)]

    # The leaders go first: beside their tops the others may be left where they are.
    trials, leader, done = [], best.value, 0
    ranked = sorted(pursued, key=lambda lot: lot.behind)
    for together in (ranked[:_FIRST], ranked[_FIRST:]):
        for found in side_by_side(partial(_Lot.top, best=leader), together):
            done += 1
            tell("the best candidates", len(ranked) - done)
            trials += found
        leader = min([leader, *(t.value for t in trials)])
    trials = best_of_each(trials)
    fitted, behind = {t.effects for t in trials}, dict[tuple[Effect, ...], LeftBehind]()
    for lot in lots:
        cut = not lot.begun or lot in ranked
        for one in (LeftBehind(candidate.effects, lot.behind, cut) for candidate in lot.candidates):
            if one.effects not in fitted:
                behind[one.effects] = min(one, behind.get(one.effects, one), key=lambda one: one.nats)
    return Found(trials, list(behind.values()))


def _foreseen(count: int, way: _Way, rungs_left: int) -> int:
    """Steps to the tops that so many lots will take, as far as can be foreseen."""
    steps = 0
    for _ in range(rungs_left):
        steps += count
        count = min(count, max(way.least, int(way.share * count)))
    return steps + count


def _near(lots: Sequence[_Lot], least: int, leader: float = math.inf) -> list[_Lot]:
    """Those that are not hopelessly behind after the same rung, or among the `least` best."""
    leader = min([leader, *(lot.best for lot in lots)])
    for lot in lots:
        lot.behind = lot.best - leader
    ranked = sorted(lots, key=lambda lot: lot.behind)
    return [lot for rank, lot in enumerate(ranked) if rank < least or lot.behind < FAR_BEHIND]


def best_of_each(trials: Sequence[Trial]) -> list[Trial]:
    """The most probable start of every cause at every place."""
    best: dict[tuple, Trial] = {}
    for t in trials:
        other = best.get(t.effects, t)
        better = t if t.evidence > other.evidence else other
        best[t.effects] = replace(better, rung=min(t.rung, other.rung))
    return list(best.values())
