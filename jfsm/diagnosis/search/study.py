"""How records are looked into: what they tell beside the model, and what was tried for it."""

from collections.abc import Sequence
from dataclasses import dataclass

import jax
import numpy as np

from ..._limit import Limit
from ...dynamics import Reconstruction
from ...identification import prepare_all
from ...records import Record
from ...structures import Cause, ChannelDelay, Structure
from ..channels.coloured_noise import coloured
from ..channels.delays import gain_of_delay, seems_late, slightly_late
from ..channels.drift import PLAINLY, SLOWLY, steadied, wandering
from ..evidence.between_records import differ
from ..evidence.excess import explained, white
from ..evidence.fitted import Trial
from ..evidence.identifiable import in_step
from ..evidence.lack_of_fit import LackOfFit
from ..evidence.noise_draws import beside_chance, noise_beyond
from ..evidence.setup import Problem
from ..hypotheses.candidate import Candidate, as_promising, contained, elsewhere, promising
from ..hypotheses.candidates import candidates
from ..hypotheses.effect import Effect
from ..hypotheses.parametrisation import Apart
from ..thresholds import THRESHOLDS
from .searches import (
    FAR_BEHIND,
    Found,
    LeftBehind,
    best_of_each,
    fit_model,
    refit_from,
    search,
    search_again,
    search_akin,
    search_beside,
    search_known,
    search_pairs,
)
from .segments import pieces
from .steps import Steps
from .stopping import hidden, settled, something_left

_AS_LIKELY = 3.0
"""Nats by which trials are apart, at most, of which none is likelier than the other."""
_STIFF = 8
"""Times the steps of the model that a law needs from which it is asked late: it costs as many times more."""
_HEAVIER = 0.03
"""Change of a mass, as a share of it, from which its noise is another."""


@dataclass(frozen=True)
class Searched:
    """Every trial, the candidates that were not pursued to their tops, and those that were not tried."""

    given: Trial
    refitted: Trial
    trials: list[Trial]
    behind: list[LeftBehind]
    left_out: list[Candidate]
    lack: LackOfFit

    @property
    def every(self) -> list[Trial]:
        return [self.given, self.refitted, *self.trials]

    def judged_in(self, problem: Problem, given: Trial, refitted: Trial, trials: list[Trial]) -> "Searched":
        """What was found, with these trials of another problem; those that were not fitted there are left behind."""
        done, best = {t.effects for t in trials}, min((t.rung for t in self.trials), default=0.0)
        dropped = [LeftBehind(t.effects, t.rung - best) for t in self.trials if t.effects not in done]
        return Searched(given, refitted, trials, [*self.behind, *dropped], self.left_out, LackOfFit(problem))


@dataclass(frozen=True)
class Study:
    """How records are looked into."""

    model: Structure
    chosen: dict[str, Cause]
    places: Sequence[tuple[int, int]] | None
    reconstruction: Reconstruction
    key: jax.Array
    steps: Steps
    limit: Limit
    pairs: bool

    def of(
        self, training: Sequence[tuple[Record, int]], *, unless_later: bool = False, known: Trial | None = None
    ) -> tuple[Problem, list[Candidate], Searched] | Trial:
        """What is fitted to, what could be tried, what was found.

        Where what is lacking shows in what was kept back, which then has to be fitted, the best single trial beside
        which it does, `unless_later`; that is `known` then.
        """
        problem = self._problem(training)
        parts = pieces(training, [n.period for n in problem.records])
        if parts is None:
            problem, given, refitted = _believed(problem)
            if unless_later and not self.limit.over and _later(refitted, THRESHOLDS.negligible):
                return refitted
            problem, every, found = self._sought(problem, given, refitted, known)
        else:
            part, given, refitted = _believed(self._problem(parts))
            part, every, ahead = self._sought(part, given, refitted, known)
            if not self.limit.over:
                problem, given, refitted = _believed(problem.knowing(part), near=ahead.refitted)
                found = self._fitted_again(ahead, given, refitted, problem)
            if self.limit.over:
                return part, every, ahead
            if unless_later and _later(found.refitted, THRESHOLDS.negligible):
                return found.refitted
        if unless_later and not self.limit.over and shows_later(found.every):
            return max((t for t in found.every if len(t.effects) < 2), key=lambda t: t.evidence)
        problem, found = self._unless_apart(found, problem)
        return problem, every, found

    def _problem(self, training: Sequence[tuple[Record, int]]) -> Problem:
        """Records, and how much of each is fitted, as the likelihood sees them."""
        records, until = [whole for whole, _ in training], [fit for _, fit in training]
        prepared = prepare_all(records, self.model, self.reconstruction)
        return Problem(self.model, prepared, until, limit=self.limit)

    def _sought(
        self, problem: Problem, given: Trial, refitted: Trial, known: Trial | None
    ) -> tuple[Problem, list[Candidate], Searched]:
        """What could be tried, and what was found; the zeros of channels may turn out to wander, or their noise to
        have a memory.

        What the model lacks may have looked like that: then what was found holds as well without. Where the time is
        over before that is known, what was found first is all that is told.
        """
        self.limit.found()
        if self.limit.over:
            return problem, [], Searched(given, refitted, [], [], [], LackOfFit(problem))
        channel, first = wandering(refitted, problem, PLAINLY), None
        other = None if channel is None else problem.with_wandering(channel)
        if other is None:
            every = candidates(self.model, [steadied(n) for n in problem.records], self.chosen, self.places)
            first, other = self._searched(every, given, refitted, known, problem)
            if other is None or self.limit.over:
                return problem, every, first
        other, every_other, found = self._sought(*_believed(other, near=refitted), known)
        best = max(found.every, key=lambda t: t.evidence)
        if best.effects and not self.limit.over:
            again = search_again([best], refitted, problem, self.steps.of("the best without that"))
            if again.trials and again.trials[0].evidence >= best.evidence:
                found_again = self._fitted_again(found, given, refitted, problem)
                if not self.limit.over:
                    return problem, every_other, found_again
        if self.limit.over and first is not None:
            return problem, every, first
        return other, every_other, found

    def _fitted_again(self, ahead: Searched, given: Trial, refitted: Trial, problem: Problem) -> Searched:
        """The best of what was found in another problem, as in pieces of long records, fitted from there."""
        found = search_again(ahead.trials, refitted, problem, self.steps.of("the best again"))
        refitted = refit_from(found.trials, refitted, problem)
        _, (given, refitted, *trials) = self._amid_noise(given, refitted, found.trials, problem)
        return ahead.judged_in(problem, given, refitted, trials)

    def _unless_apart(self, found: Searched, problem: Problem) -> tuple[Problem, Searched]:
        """What was found, or the best of it with numbers that each record has to itself, where records differ in them.

        These have to do so beside the best explanation, not make up for one that is missing.
        """
        for apart in (Apart.own, Apart.all) if len(problem.records) > 1 else ():
            other, best = problem._replace(apart=apart), max(found.every, key=lambda t: t.evidence)
            if best.effects:
                tried = search_again([best], best, other, self.steps.of("each record by itself")).trials
            else:
                tried = [refit_from([best], best, other)]
            if self.limit.over:
                break
            [alone] = tried
            if differ(alone.beside(best), best):
                another, given, refitted = _believed(other, near=found.refitted)
                again = self._fitted_again(found, given, refitted, another)
                if self.limit.over:
                    break
                problem, found = another, again
        return problem, found

    def _searched(
        self,
        every: list[Candidate],
        given: Trial,
        refitted: Trial,
        known: Trial | None,
        problem: Problem,
    ) -> tuple[Searched, Problem | None]:
        """Single effects fitted, the promising ones first, and pairs of them where that leaves something.

        Beside them the problem to look into instead, where a channel's zero turns out to wander, or its noise to have a
        memory.
        """
        stands_for_the_drive = in_step(problem.records)

        def told(trials: Sequence[Trial]) -> list[Trial]:
            return [t for t in trials if not stands_for_the_drive(t)]

        def close(trials: Sequence[Trial]) -> list[Trial]:
            best = max(told([given, refitted, *trials]), key=lambda t: t.evidence)
            return [t for t in trials if t is best or explained(t, refitted) >= THRESHOLDS.half]

        tried, left_out = promising(every)
        steps = problem.first.steps_for([self.model])
        late = [c for c in tried if c.effects[0].cause.effect is ChannelDelay]  # they have a slow program of their own
        stiff = [c for c in tried if c not in late and problem.first.steps_for(c.starts) >= _STIFF * steps]
        now = [c for c in tried if c not in late and c not in stiff] or tried
        found = search(now, given, refitted, problem, self.steps.of("single causes"))
        slow = [c for c in (*late, *stiff) if c not in now]
        if self.limit.over:
            more = []
        elif settled(told([given, refitted, *found.trials])):
            best = max(found.trials, key=lambda t: t.evidence)
            late, behind = _not_far_behind(late, best, refitted, problem)
            found = found.and_then(Found([], behind))
            more = contained([law for t in close(found.trials) for law in t.laws], left_out)
            others = [*as_promising(best.effects, every, left_out), *elsewhere(best.effects, left_out)]
            more += [c for c in dict.fromkeys(others) if c not in more]
            likely = [*late, *as_promising(best.effects, every, stiff, least=1.0)]
            more += [c for c in slow if c in likely]
        else:  # of a missing force that is ill seen regression may put the right law last
            more = [c for c in left_out if c.starts] + slow
        if more:
            tell = self.steps.of("more single causes")
            found = found.and_then(search(more, given, refitted, problem, tell, known=told(found.trials)))
            left_out = [c for c in left_out if c not in more]
        left_out += [c for c in stiff if c in slow and c not in more]
        akin = self.steps.of("what is akin to the best")
        found = search_akin(close(found.trials), every, found, problem, akin)
        if known is not None and known.effects:
            found = search_known(known, found, problem, akin)
        behind, refitted = found.behind, refit_from(found.trials, refitted, problem)
        louder, (given, refitted, *trials) = self._amid_noise(given, refitted, found.trials, problem)
        lack, alone = LackOfFit(problem), told([given, refitted, *trials])
        best = max(alone, key=lambda t: t.evidence)
        if self.limit.over:
            return Searched(given, refitted, trials, behind, left_out, lack), None
        if (other := coloured(best, problem)) is not None:  # noise that remembers is in part slow as well
            return Searched(given, refitted, trials, behind, left_out, lack), other
        if (channel := wandering(best, problem, SLOWLY)) is not None:
            other = problem.with_wandering(channel)
            return Searched(given, refitted, trials, behind, left_out, lack), other
        effects = _beside(alone, refitted, every, lack, imposed=problem.imposed) if self.pairs else []
        if effects:
            found = self._slightly_late(best, effects, problem)
            tell = self.steps.of("pairs of causes")
            found = found or search_pairs(effects, trials, known, refitted, problem, tell)
            # By itself an effect of a pair may be likelier than any before: what is akin to it begins from there too.
            single = Found([t for t in found.trials if len(t.effects) == 1], [])
            if ahead := [t for t in single.trials if t.evidence > best.evidence]:
                found = found.and_then(search_akin(ahead, every, single, problem, akin))
            trials = best_of_each([*trials, *(t.beside(refitted).amid(louder) for t in found.trials)])
            trials = [given, refitted, *trials]
            given, refitted, *trials = beside_chance(trials, problem, self.key)
            best = max(told([given, refitted, *trials]), key=lambda t: t.evidence)
            done = {t.effects for t in trials}
            behind = [one for one in (*behind, *found.behind) if one.effects not in done]
            other = None if self.limit.over else coloured(best, problem)
        return Searched(given, refitted, trials, behind, left_out, lack), other

    def _slightly_late(self, best: Trial, effects: Sequence[Effect], problem: Problem) -> Found | None:
        """The best law beside a channel that is late by less than a sample, where these leave nothing but noise."""
        sensor = seems_late(best, problem) if best.laws and len(best.effects) == 1 else None
        if sensor is None:
            return None
        for other in effects:
            if other.cause.effect is type(sensor) and other.at == sensor.at:
                found = search_beside(best, other, sensor, problem, self.steps.of("what is late"))
                slight = slightly_late(found.trials, {}, problem.first.record.dt)
                return found if slight and settled(found.trials) else None
        return None

    def _amid_noise(
        self, given: Trial, refitted: Trial, found: Sequence[Trial], problem: Problem
    ) -> tuple[np.ndarray, list[Trial]]:
        """All trials, judged beside the refit and amid what noise leaves; how much of it no channel told beforehand."""
        trials = [given, refitted, *(t.beside(refitted) for t in found)]
        louder = noise_beyond(trials, problem)
        return louder, beside_chance([t.amid(louder) for t in trials], problem, self.key)


def _believed(problem: Problem, near: Trial | None = None) -> tuple[Problem, Trial, Trial]:
    """The problem, the model as given, and refitted; `near` own values that a part of the records told."""
    if near is None:
        given, refitted = fit_model(problem)
        near = refitted
        if not _outweighed(problem.model, near.structure):
            return problem, given, refitted
    if _outweighed(problem.model, near.structure):
        # The noise of the force acts through the mass, and all hypotheses share one noise: that of the likelier mass.
        problem = problem.weighed(near.structure)
    return problem, *fit_model(problem, near=near)


def _not_far_behind(
    late: Sequence[Candidate], best: Trial, refitted: Trial, problem: Problem
) -> tuple[list[Candidate], list[LeftBehind]]:
    """Which channels that may be late could come near the best trial, and the others."""
    near, behind = list[Candidate](), list[LeftBehind]()
    for candidate in late:
        nats = best.evidence - refitted.evidence - gain_of_delay(refitted, candidate.effects[0].at, problem)
        if nats < FAR_BEHIND:
            near.append(candidate)
        else:
            behind.append(LeftBehind(candidate.effects, nats))
    return near, behind


def shows_later(trials: Sequence[Trial]) -> bool:
    """Whether what is lacking shows in what was kept back, beside the best trial and beside all that are as likely."""
    best = max(t.evidence for t in trials)
    return all(_later(t, THRESHOLDS.much) for t in trials if t.evidence > best - _AS_LIKELY)


def _later(trial: Trial, much: float) -> bool:
    """Whether a trial leaves nothing of what was fitted, but `much` of what was kept back, as a share of the signal."""
    fitted, kept_back = (np.sqrt(trial.prediction.beyond()[first::2]) for first in (0, 1))
    return white(trial) and bool(np.all(fitted < THRESHOLDS.negligible) and np.any(kept_back > much))


def _beside(
    alone: list[Trial], refitted: Trial, every: list[Candidate], lack: LackOfFit, *, imposed: bool
) -> list[Effect]:
    """Effects that are worth a try beside others, after what single ones leave."""
    effects = [effect for candidate in every for effect in candidate.effects]
    if something_left(alone, refitted, lack, imposed=imposed):
        return effects
    return [e for e in effects if e.cause.effect in hidden(alone)]


def _outweighed(model: Structure, refitted: Structure) -> bool:
    """Whether a refit moves any mass by more than some per cent."""
    stated, found = (np.asarray(s.mass) for s in (model, refitted))
    return bool(np.any(np.abs(found - stated) > _HEAVIER * np.abs(stated)))
