"""Which candidates are fitted after which, and from which values."""

import math
from collections.abc import Sequence
from itertools import chain

from ...structures import AbstractSensor, AbstractTerm, Structure
from ..evidence.excess import explained, is_noise_only
from ..evidence.fitted import Trial
from ..evidence.own_values import at_bounds
from ..evidence.setup import Problem
from ..hypotheses.candidate import Candidate
from ..hypotheses.effect import Effect, families
from ..hypotheses.initial_values import found_in, own_part
from ..thresholds import THRESHOLDS
from .batches import FROM_THERE, Schedule, batches_of
from .climbing import Found, Tell, climbed
from .pairs import crossed, instead, joined, pairs, twins
from .related_laws import beside_a_spring, instead_of, late_instead, resting, special_cases
from .stopping import is_itself

_PROMISING = 4
"""Laws that explain most of the missing force: no early stage ends them, nor causes of which it shows nothing. What
they are worth, a few steps may not show."""
_ALONE = Schedule((0.3, 0.03, 0.01), 10, 0.5)
"""Of single effects: the refit has been at the top already."""
_TOGETHER = Schedule((0.03, 0.01), 6, 0.25)
"""Of pairs: one of the two has been fitted already."""
_INSTEAD = _TOGETHER._replace(to_the_end=True)
"""Of those that share an effect with the best pair,"""
_TWINS = 4
"""Pairs with a law that is not itself, at most, of which what they really are is tried."""
_ROUNDS = 3
"""which are looked for so many times, at most."""
_ALIKE = 20.0
"""Nats behind the best pair up to which effects of others of its families are tried together, too."""
_CLOSE = 100.0
"""Nats behind a law up to which another one may have stopped on its way, and is tried again."""
_AGAIN = 4
"""Single effects, and pairs, of one problem that are fitted in another: the first in evidence, and in prediction; and
single effects close to the likeliest that are tried in its place."""


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
    batches = batches_of(tried, own, problem, _ALONE)
    most = sorted((candidate.share or 0.0 for candidate in tried), reverse=True)[:_PROMISING]
    kept = [batch for batch in batches if batch.share > 0 and batch.share >= most[-1]]
    return climbed(batches, _ALONE, kept, min([refitted, *known], key=lambda t: t.value), tell)


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
    tried = list(chain.from_iterable(_akin_to(t, every, problem) for t in close))
    if problem.limit.over:
        return known
    return _from_there(tried + _in_place_of(close, every, known, problem), known, problem, tell)


def _akin_to(t: Trial, every: Sequence[Candidate], problem: Problem) -> list[Candidate]:
    """What the laws and the early channels of a trial may be instead, from its numbers."""
    effects, begin, model = [effect for c in every for effect in c.effects], found_in(t), problem.model
    tried = list[Candidate]()
    for law in t.laws:
        tried += special_cases(law, begin, every)
        tried += beside_a_spring(law, begin, every, model)
        tried += resting(t.structure, law, begin, every, model, problem.first)
    for part in t.parts:
        tried += late_instead(part, begin, effects, model)
    return tried


def _in_place_of(close: Sequence[Trial], every: Sequence[Candidate], known: Found, problem: Problem) -> list[Candidate]:
    """What is less probable so far than a law that it may take the place of."""
    evidence = {c.effects: -math.inf for c in every} | {t.effects: t.evidence for t in known.trials}
    tried = list[Candidate]()
    ranked = _ranked(close if any(map(is_noise_only, close)) else known.trials)
    near = _close_to(ranked[0], known.trials) if ranked else {}
    for t in ranked:
        behind = [c for c in every if evidence[c.effects] < t.evidence]
        new = list(chain.from_iterable(instead_of(t, law, behind, near, problem) for law in t.laws))
        evidence |= {c.effects: math.inf for c in new}  # tried once
        tried, near = tried + new, {}
    return tried


def _ranked(trials: Sequence[Trial]) -> list[Trial]:
    """The most probable first."""
    return sorted(trials, key=lambda t: -t.evidence)


def _close_to(leader: Trial, trials: Sequence[Trial]) -> dict[Effect, float]:
    """Single effects that come closest to a trial, and their evidence."""
    close = [t for t in trials if len(t.effects) == 1 and 0 < leader.evidence - t.evidence < _CLOSE]
    return {t.effects[0]: t.evidence for t in _ranked(close)[:_AGAIN]}


def search_again(found: Sequence[Trial], refitted: Trial, problem: Problem, tell: Tell) -> Found:
    """The best of what was found in another problem, as in pieces of long records, fitted from there."""
    tried = [_as_candidate(t, problem.model) for t in _worth_a_second_fit(found)]
    batches = batches_of(tried, None, problem, FROM_THERE)
    return climbed(batches, FROM_THERE._replace(to_the_end=True), batches, refitted, tell)


def _worth_a_second_fit(found: Sequence[Trial]) -> list[Trial]:
    """Of single effects and of pairs the most probable and those that predict best, and the effects of such pairs one
    by one. Once the most probable leaves noise only, those far behind it are not among them."""
    ranked = _in_the_running(found)
    singles, both = ([t for t in ranked if len(t.effects) == count] for count in (1, 2))
    best = {t.effects: t for t in (*_leaders(singles), *_leaders(both))}
    parts = {(effect,) for effects in best for effect in effects}
    return [*best.values(), *(t for t in singles if t.effects in parts and t.effects not in best)]


def _in_the_running(found: Sequence[Trial]) -> list[Trial]:
    """The most probable first, without those far behind one that leaves noise only."""
    ranked = _ranked(found)
    if not ranked or not is_noise_only(ranked[0]):
        return ranked
    return [t for t in ranked if ranked[0].evidence - t.evidence < _CLOSE]


def _leaders(found: Sequence[Trial]) -> list[Trial]:
    """Of trials in the order of their evidence the most probable, and those that predict best."""
    return [*found[:_AGAIN], *sorted(found, key=lambda t: t.prediction.power)[:_AGAIN]]


def search_known(found: Trial, others: Found, problem: Problem, tell: Tell) -> Found:
    """What was found in another part of the records, fitted from there too."""
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
    batches = batches_of(tried, None, problem, FROM_THERE)
    best = min(known.trials, key=lambda t: t.value)
    return known.and_then(climbed(batches, FROM_THERE, [], best, tell))


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
    hunt = _PairSearch(effects, singles, refitted, problem, tell)
    found = hunt.rounds(hunt.climbed(pairs(singles, known, effects, problem), _TOGETHER))
    leader = hunt.leader(found)
    if leader is hunt.best or problem.limit.over:
        return found
    return _from_there(hunt.about(leader, found), found, problem, tell)


class _PairSearch:
    """Rounds over pairs, each about the best pair so far."""

    def __init__(
        self, effects: Sequence[Effect], singles: Sequence[Trial], refitted: Trial, problem: Problem, tell: Tell
    ):
        self.effects, self.singles, self.refitted, self.problem, self.tell = effects, singles, refitted, problem, tell
        self.best = min([refitted, *singles], key=lambda t: t.value)

    def climbed(self, tried: Sequence[Candidate], schedule: Schedule, kept: list[str] | None = None) -> Found:
        """These pairs fitted; those of the families that are kept go on to the end."""
        batches = batches_of(tried, None, self.problem, schedule)
        return climbed(batches, schedule, [b for b in batches if b.families == kept], self.best, self.tell)

    def leader(self, found: Found) -> Trial:
        """The most probable pair that could be the answer; the best single effect where there is none."""
        bounds = at_bounds(self.refitted)
        possible = [t for t in found.trials if is_itself(t) and at_bounds(t) <= bounds]
        return max(possible, key=lambda t: t.evidence, default=self.best)

    def rounds(self, found: Found) -> Found:
        """What is found about the leader, as long as that changes."""
        before = self.best
        for _ in range(_ROUNDS):
            leader = self.leader(found)
            if self.problem.limit.over or not self._goes_on(leader, before):
                break
            tried = self._neighbours(leader, found, first=before is self.best)
            found = found.and_then(self.climbed(tried, _INSTEAD, kept=families(leader.effects)))
            before = leader
        return found if self.problem.limit.over else found.and_then(self.climbed(self._twins(found), _INSTEAD))

    def _twins(self, found: Found) -> list[Candidate]:
        """What the likeliest pairs really are that have a law that is not itself."""
        done = {t.effects for t in found.trials}
        others = sorted((t for t in found.trials if not is_itself(t)), key=lambda t: -t.evidence)[:_TWINS]
        tried = {c.effects: c for t in others for c in twins(t, self.effects, self.problem.model)}
        return [c for effects, c in tried.items() if effects not in done]

    def _goes_on(self, leader: Trial, before: Trial) -> bool:
        """Whether the last round gained enough for another one."""
        if leader.evidence - before.evidence >= THRESHOLDS.significant:
            return True
        return before is self.best and explained(leader, self.best) >= THRESHOLDS.half

    def _neighbours(self, leader: Trial, found: Found, *, first: bool) -> list[Candidate]:
        """Pairs that share an effect with the leader, to begin from its numbers.

        From there some may arrive that stopped on their way from elsewhere. Those of its own families are seen off at
        their tops only: laws alike tell apart late. Once it leaves noise only, others are no use.
        """
        kin, done = families(leader.effects), {t.effects for t in found.trials}
        others = first or not is_noise_only(leader)
        near = instead(leader, self.effects, self.problem)
        return [c for c in near if families(c.effects) == kin or (others and c.effects not in done)]

    def about(self, leader: Trial, found: Found) -> list[Candidate]:
        """Effects of pairs that are about as probable as the leader, combined; and its effects one by one, since either
        may have stopped on its way by itself, and be enough."""
        model, kin = self.problem.model, families(leader.effects)
        alike = [t for t in found.trials if families(t.effects) == kin and abs(leader.evidence - t.evidence) < _ALIKE]
        alone = [t for t in self.singles if t.effects and self.best.evidence - t.evidence < _ALIKE]
        parts = zip(leader.effects, leader.parts, strict=True)
        by_one = [Candidate((effect,), (model + part,), begin=found_in(leader)) for effect, part in parts]
        return crossed(alike, alone, model) + by_one
