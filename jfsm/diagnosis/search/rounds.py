"""One search in one problem: single effects, what is related to the best, and pairs where that leaves something."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain

import jax
import numpy as np

from ..._limit import Limit
from ...structures import Cause, ChannelDelay, ForceDelay
from ..channels.clock import in_its_time
from ..channels.coloured_noise import coloured
from ..channels.delays import gain_of_delay, seems_late, slightly_late
from ..channels.drift import SLOWLY, wandering
from ..evidence.excess import explained, is_noise_only
from ..evidence.fitted import Trial
from ..evidence.identifiable import in_step
from ..evidence.lack_of_fit import LackOfFit
from ..evidence.noise_draws import beside_chance, noise_beyond
from ..evidence.setup import Problem
from ..hypotheses.candidate import Candidate, as_promising, contained, elsewhere, promising
from ..hypotheses.effect import Effect
from ..thresholds import THRESHOLDS
from .baseline import refit_from
from .climbing import FAR_BEHIND, Found, LeftBehind, best_of_each
from .searches import search, search_akin, search_beside, search_known, search_pairs
from .steps import Steps
from .stopping import hidden, settled, something_left

_TIMELY = 4
"""Trials beside which a force is asked whether it acts at another time, the likeliest."""
_STIFF = 8
"""Times the steps of the model that a law needs from which it is asked late: it costs as many times more."""


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

    @property
    def causes(self) -> dict[str, Cause]:
        """Every cause that was looked for, by its id."""
        looked = chain(self.trials, self.behind, self.left_out)
        return {effect.cause.id: effect.cause for one in looked for effect in one.effects}

    def judged_in(self, problem: Problem, given: Trial, refitted: Trial, trials: list[Trial]) -> "Searched":
        """What was found, with these trials of another problem; those that were not fitted there are left behind."""
        done, best = {t.effects for t in trials}, min((t.rung for t in self.trials), default=0.0)
        dropped = [LeftBehind(t.effects, t.rung - best) for t in self.trials if t.effects not in done]
        return Searched(given, refitted, trials, [*self.behind, *dropped], self.left_out, LackOfFit(problem))


@dataclass(frozen=True)
class Rounds:
    """The rounds of one search among `every` candidate, what is `known` to act included."""

    every: list[Candidate]
    given: Trial
    refitted: Trial
    known: Trial | None
    problem: Problem
    steps: Steps
    key: jax.Array
    pairs: bool

    def run(self) -> tuple[Searched, Problem | None]:
        """What was found; and the problem to search in instead, where the force acts late, a channel drifts or its
        noise is coloured."""
        found, left_out = self._single_effects()
        found = self._related(found)
        refitted = refit_from(found.trials, self.refitted, self.problem)
        louder, (given, refitted, *trials) = amid_noise(self.given, refitted, found.trials, self.problem, self.key)
        singles = Searched(given, refitted, trials, found.behind, left_out, self._lack)
        if self._limit.over:
            return singles, None
        other = self._with_other_times(singles.every) or self._coloured(singles) or self._drifting(singles, mostly=True)
        if other is not None:
            return singles, other
        effects = self._second_effects(singles) if self.pairs else []
        both = self._pairs(effects, self._likeliest(singles.every), singles, louder) if effects else singles
        if self._limit.over:
            return both, None
        other = self._with_other_times(both.every) if effects else None
        return both, other or self._with_other_noise(singles, both)

    def _with_other_noise(self, singles: Searched, both: Searched) -> Problem | None:
        """The problem with other noise, unless the best hypothesis leaves only noise: judged by pairs first, then by
        single effects, of which the colour is known."""
        if is_noise_only(self._likeliest(both.every)):
            return None
        by_pairs = None if both is singles else self._coloured(both) or self._drifting(both)
        return by_pairs or self._drifting(singles)

    @property
    def _limit(self) -> Limit:
        return self.problem.limit

    @cached_property
    def _lack(self) -> LackOfFit:
        return LackOfFit(self.problem)

    @cached_property
    def _takes_the_drives_place(self) -> Callable[[Trial], bool]:
        return in_step(self.problem.records)

    def _apart_from_the_drive(self, trials: Sequence[Trial]) -> list[Trial]:
        """Those that do not take the place of the drive."""
        return [t for t in trials if not self._takes_the_drives_place(t)]

    def _likeliest(self, trials: Sequence[Trial]) -> Trial:
        return max(self._apart_from_the_drive(trials), key=lambda t: t.evidence)

    # Single effects

    def _single_effects(self) -> tuple[Found, list[Candidate]]:
        """The promising ones fitted, then others that may be as good; and those that are left out."""
        tried, others = promising(self.every)
        late, stiff, now = self._by_cost(tried)
        found = search(now, self.given, self.refitted, self.problem, self.steps.of("single causes"))
        slow = [c for c in (*late, *stiff) if c not in now]
        more = list[Candidate]()
        if found.trials and not self._limit.over:
            found, more = self._worth_a_second_round(found, late, stiff, slow, others)
        if more:
            tell, known = self.steps.of("more single causes"), self._apart_from_the_drive(found.trials)
            found = found.and_then(search(more, self.given, self.refitted, self.problem, tell, known=known))
        others += [c for c in stiff if c in slow]
        return found, [c for c in others if c not in more]

    def _by_cost(self, tried: list[Candidate]) -> tuple[list[Candidate], list[Candidate], list[Candidate]]:
        """Late channels, which have a slow program of their own; laws that need many steps; and what is tried first."""
        steps = self.problem.first.steps_for([self.problem.model])
        late = [c for c in tried if c.effects[0].cause.effect is ChannelDelay]
        stiff = [c for c in tried if c not in late and self.problem.first.steps_for(c.starts) >= _STIFF * steps]
        return late, stiff, [c for c in tried if c not in late and c not in stiff] or tried

    def _worth_a_second_round(
        self,
        found: Found,
        late: list[Candidate],
        stiff: list[Candidate],
        slow: list[Candidate],
        others: list[Candidate],
    ) -> tuple[Found, list[Candidate]]:
        """What else is fitted. Once the best leaves only noise, that is what may be as good; else all of it that may be
        where the best is, since regression may put the right law last if the missing force is poorly seen."""
        amid = amid_noise(self.given, self.refitted, found.trials, self.problem, self.key)[1]
        if not settled(self._apart_from_the_drive(amid), self._lack):
            return found, self._there(found.trials, [*(c for c in others if c.starts), *slow])
        best = max(found.trials, key=lambda t: t.evidence)
        late, behind = self._not_far_behind(late, best)
        found = found.and_then(Found([], behind))
        more = contained([law for t in self._close(found.trials) for law in t.laws], others)
        alike = [*as_promising(best.effects, self.every, others), *elsewhere(best.effects, others)]
        more += [c for c in dict.fromkeys(alike) if c not in more]
        likely = [*late, *as_promising(best.effects, self.every, stiff, least=1.0)]
        return found, more + [c for c in slow if c in likely]

    def _there(self, trials: Sequence[Trial], others: list[Candidate]) -> list[Candidate]:
        """Where the likeliest law explains half, no other law elsewhere."""
        best = max(trials, key=lambda t: t.evidence)
        if not best.laws or explained(best, self.refitted) < THRESHOLDS.half:
            return others
        places = {law.at for law in best.laws}
        same = elsewhere(best.effects, others)
        return [c for c in others if c in same or c.effects[0].cause.is_sensor or c.effects[0].at in places]

    def _not_far_behind(self, late: Sequence[Candidate], best: Trial) -> tuple[list[Candidate], list[LeftBehind]]:
        """Which channels that may be late could come near the best trial, and the others."""
        near, behind = list[Candidate](), list[LeftBehind]()
        for candidate in late:
            gain = gain_of_delay(self.refitted, candidate.effects[0].at, self.problem)
            nats = best.evidence - self.refitted.evidence - gain
            if nats < FAR_BEHIND:
                near.append(candidate)
            else:
                behind.append(LeftBehind(candidate.effects, nats))
        return near, behind

    def _close(self, trials: Sequence[Trial]) -> list[Trial]:
        """The likeliest, and those that explain half of what the refitted model leaves."""
        best = self._likeliest([self.given, self.refitted, *trials])
        return [t for t in trials if t is best or explained(t, self.refitted) >= THRESHOLDS.half]

    def _related(self, found: Found) -> Found:
        """What is akin to those that come close, and what is known to act."""
        tell = self.steps.of("what is akin to the best")
        found = search_akin(self._close(found.trials), self.every, found, self.problem, tell)
        if self.known is not None and self.known.effects:
            found = search_known(self.known, found, self.problem, tell)
        return found

    def _with_other_times(self, trials: Sequence[Trial]) -> Problem | None:
        """The problem with the force at the times at which it turns out to act beside the best that has no delay, or
        beside another one of the best where that leaves more than noise: what makes up for a late force comes first."""
        known = self._apart_from_the_drive(trials)
        timely = [t for t in known if not any(isinstance(part, ForceDelay | ChannelDelay) for part in t.parts)]
        best, *others = sorted(timely, key=lambda t: -t.evidence)[:_TIMELY]
        for t in (best, *(() if is_noise_only(best) else others)):
            found = in_its_time(t, self.problem, to_noise=False, likeliest=best.evidence)
            if found is not None or self._limit.over:
                return found
        return None

    def _coloured(self, found: Searched) -> Problem | None:
        """The problem with the autocorrelated noise that channels turn out to have; None where none has."""
        return coloured(self._explaining(found), self.problem)

    def _drifting(self, found: Searched, *, mostly: bool = False) -> Problem | None:
        """The problem with the zeros that turn out to wander, or None. Noise that remembers is in part slow as well: it
        is looked for before."""
        return wandering(self._explaining(found), self.problem, SLOWLY, mostly=mostly)

    def _explaining(self, found: Searched) -> Trial:
        """The likeliest hypothesis, where it explains half of what the refitted model leaves; else that model."""
        best = self._likeliest(found.every)
        return best if explained(best, found.refitted) >= THRESHOLDS.half else found.refitted

    # Pairs

    def _second_effects(self, singles: Searched) -> list[Effect]:
        """Effects that are worth a try beside others, after what single ones leave."""
        alone = self._apart_from_the_drive(singles.every)
        effects = [effect for candidate in self.every for effect in candidate.effects]
        if something_left(alone, singles.refitted, singles.lack, imposed=self.problem.imposed):
            return effects
        in_own_values = hidden(alone)
        return [effect for effect in effects if effect.cause.effect in in_own_values]

    def _pairs(self, effects: list[Effect], best: Trial, singles: Searched, louder: np.ndarray) -> Searched:
        """Single effects and pairs, judged together."""
        refitted, problem = singles.refitted, self.problem
        found = self._slightly_late(best, effects)
        if found is None:
            tell = self.steps.of("pairs of causes")
            found = search_pairs(effects, singles.trials, self.known, refitted, problem, tell)
        found = self._related_to_better(found, best)
        trials = best_of_each([*singles.trials, *(t.beside(refitted).amid(louder) for t in found.trials)])
        given, refitted, *trials = beside_chance([singles.given, refitted, *trials], problem, self.key)
        done = {t.effects for t in trials}
        behind = [one for one in (*singles.behind, *found.behind) if one.effects not in done]
        return replace(singles, given=given, refitted=refitted, trials=trials, behind=behind)

    def _related_to_better(self, found: Found, best: Trial) -> Found:
        """With what is related to an effect of a pair that by itself is likelier than any before."""
        alone = [t for t in found.trials if len(t.effects) == 1]
        ahead = [t for t in alone if t.evidence > best.evidence]
        if not ahead:
            return found
        tell = self.steps.of("what is akin to the best")
        return found.and_then(search_akin(ahead, self.every, Found(alone, []), self.problem, tell))

    def _slightly_late(self, best: Trial, effects: Sequence[Effect]) -> Found | None:
        """The best law beside a channel that is late by less than a sample, where these leave nothing but noise."""
        sensor = seems_late(best, self.problem) if best.laws and len(best.effects) == 1 else None
        if sensor is None:
            return None
        other = next((e for e in effects if e.cause.effect is type(sensor) and e.at == sensor.at), None)
        if other is None:
            return None
        found = search_beside(best, other, sensor, self.problem, self.steps.of("what is late"))
        slight = slightly_late(found.trials, {}, self.problem.first.record)
        return found if slight and settled(found.trials, self._lack) else None


def amid_noise(
    given: Trial, refitted: Trial, found: Sequence[Trial], problem: Problem, key: jax.Array
) -> tuple[np.ndarray, list[Trial]]:
    """All trials, judged beside the refit and amid what noise leaves; and by how much noise exceeds the levels stated
    of the channels."""
    trials = [given, refitted, *(t.beside(refitted) for t in found)]
    louder = noise_beyond(trials, problem)
    return louder, beside_chance([t.amid(louder) for t in trials], problem, key)
