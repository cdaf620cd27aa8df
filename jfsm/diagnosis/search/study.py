"""How records are searched: as they are or in pieces, and again where their noise or their numbers differ."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import jax
import numpy as np

from ..._limit import Limit
from ...estimation import Latent
from ...identification import missing_force, prepare_all
from ...plant import Reconstruction, Swing
from ...records import Record
from ...structures import AttachedOscillator, Cause, DelayedForce, ForceDelay, Maxwell, Structure
from ..channels.clock import WAYS, in_its_time
from ..channels.drift import PLAINLY, steadied, wandering
from ..evidence.between_records import differ
from ..evidence.excess import white
from ..evidence.fitted import Trial
from ..evidence.lack_of_fit import LackOfFit
from ..evidence.setup import Problem
from ..hypotheses.candidate import Candidate
from ..hypotheses.candidates import candidates
from ..hypotheses.parametrisation import Apart
from ..thresholds import THRESHOLDS
from .baseline import believed, refit_from
from .rounds import Rounds, Searched, amid_noise
from .searches import search, search_again
from .segments import pieces
from .steps import Steps

_AS_LIKELY = 3.0
"""Nats by which trials are apart, at most, of which none is likelier than the other."""
_LAGGING = AttachedOscillator, DelayedForce, Maxwell
"""Laws that are linear but for their memory: in some motions they look like a force that is late."""

Studied = tuple[Problem, list[Candidate], Searched]
"""What was fitted to, what could be tried, and what was found."""


@dataclass(frozen=True)
class Study:
    """How records are looked into."""

    model: Structure
    chosen: dict[str, Cause]
    places: Sequence[tuple[int, int]] | None
    reconstruction: Reconstruction | None
    key: jax.Array
    steps: Steps
    limit: Limit
    pairs: bool

    @property
    def ways(self) -> tuple[Reconstruction, ...]:
        """Those in which a force may go between its samples, what is assumed first."""
        return WAYS if self.reconstruction is None else (self.reconstruction,)

    def of(
        self, training: Sequence[tuple[Record, int]], *, unless_later: bool = False, known: Trial | None = None
    ) -> Studied | Trial:
        """What is fitted to, what could be tried, what was found.

        Where what the model lacks shows in what was kept back, which then has to be fitted, the best single trial by
        which it does, `unless_later`; that is `known` then.
        """
        problem = self._problem(training)
        parts = pieces(training, [n.period for n in problem.records])
        look = self._in_whole if parts is None else partial(self._in_pieces, parts)
        studied = look(problem, known, unless_later)
        if isinstance(studied, Trial) or self.limit.over:
            return studied
        problem, every, found = studied
        if unless_later and shows_later(found.every):
            return max((t for t in found.every if len(t.effects) < 2), key=lambda t: t.evidence)
        problem, found = self._unless_apart(found, problem)
        return problem, every, found

    def _in_whole(self, problem: Problem, known: Trial | None, unless_later: bool) -> Studied | Trial:
        """A search over records as they are."""
        problem, given, refitted = believed(problem)
        if unless_later and not self.limit.over and _later(refitted, THRESHOLDS.negligible):
            return refitted
        return self._sought(problem, given, refitted, known)

    def _in_pieces(
        self, parts: Sequence[tuple[Record, int]], problem: Problem, known: Trial | None, unless_later: bool
    ) -> Studied | Trial:
        """A search over parts of long records; its best fitted to all of them."""
        part, every, ahead = self._sought(*believed(self._problem(parts)), known)
        if self.limit.over:
            return part, every, ahead
        problem, given, refitted = believed(problem.as_timed(part).knowing(part), near=ahead.refitted)
        found = self._fitted_again(ahead, given, refitted, problem)
        if self.limit.over:
            return part, every, ahead
        if unless_later and _later(found.refitted, THRESHOLDS.negligible):
            return found.refitted
        return problem, every, found

    def _problem(self, training: Sequence[tuple[Record, int]]) -> Problem:
        """Records, and how much of each is fitted, as the likelihood sees them."""
        records, until = [whole for whole, _ in training], [fit for _, fit in training]
        prepared = prepare_all(records, self.model, self.ways[0])
        return Problem(self.model, prepared, until, limit=self.limit, ways=self.ways)

    def _sought(self, problem: Problem, given: Trial, refitted: Trial, known: Trial | None) -> Studied:
        """What could be tried, and what was found; the force may turn out to act late, channels to drift, or their
        noise to be coloured.

        Where the time is over before that is known, what was found first is the answer.
        """
        self.limit.found()
        if self.limit.over:
            return problem, [], Searched(given, refitted, [], [], [], LackOfFit(problem))
        other = in_its_time(refitted, problem, to_noise=True)
        if other is not None:
            late = self._sought_with(other, problem, given, refitted, known)
            if not self._lags(late, problem, given, refitted):
                return late
            return self._sought(problem._replace(ways=()), given, refitted, known)
        other = wandering(refitted, problem, PLAINLY)
        if other is not None:
            return self._sought_with(other, problem, given, refitted, known)
        problem, missing = self._moving(problem)
        every = self._candidates(problem, missing)
        rounds = Rounds(every, given, refitted, known, problem, self.steps, self.key, self.pairs)
        found, other = rounds.run()
        if other is None or self.limit.over:
            return problem, every, found
        studied = self._sought_with(other, problem, given, refitted, known)
        return (problem, every, found) if self.limit.over else studied

    def _moving(self, problem: Problem) -> tuple[Problem, Latent | None]:
        """The problem, knowing how several masses move, and the force that the model lacks; None where not asked."""
        if self.model.dof == 1 or problem.imposed or all(cause.is_sensor for cause in self.chosen.values()):
            return problem, None
        missing = missing_force(self.model, steadied(problem.first))
        return problem.moving(Swing(missing.displacement, missing.velocity)), missing

    def _candidates(self, problem: Problem, missing: Latent | None = None) -> list[Candidate]:
        """What could be tried: not the delay of a force of which it is known."""
        possible, known = self._possible(problem, self.chosen, missing), problem.first.late
        return [c for c in possible if not (_delays_force(c) and c.effects[0].at in known)]

    def _delays(self, problem: Problem, other: Problem) -> list[Candidate]:
        """The delays of forces that could be tried in a problem, and not in another one that knows them."""
        delays = {name: cause for name, cause in self.chosen.items() if issubclass(cause.effect, ForceDelay)}
        known = other.first.late.keys() - problem.first.late.keys()
        return [c for c in self._possible(problem, delays) if c.effects[0].at in known] if known and delays else []

    def _possible(self, problem: Problem, chosen: dict[str, Cause], missing: Latent | None = None) -> list[Candidate]:
        return candidates(self.model, [steadied(n) for n in problem.records], chosen, self.places, missing)

    def _lags(self, late: Studied, problem: Problem, given: Trial, refitted: Trial) -> bool:
        """Whether a law by which the structure lags is likelier than a late force beside the model, whatever was found
        beside that: it leaves noise alone already."""
        best = max(late[2].given, late[2].refitted, key=lambda t: t.evidence)
        if self.limit.over:
            return False
        lagging = [c for c in self._candidates(problem) if c.starts and c.effects[0].cause.effect in _LAGGING]
        if not lagging:
            return False
        tried = search(lagging, given, refitted, problem, self.steps.of("laws that lag like a late force"))
        return any(t.evidence > best.evidence for t in tried.trials)

    def _sought_with(
        self, other: Problem, problem: Problem, given: Trial, refitted: Trial, known: Trial | None
    ) -> Studied:
        """What is found with another noise of the channels, or the force at another time. What the model lacks may have
        looked like that: then it holds as well without."""
        other, every, found = self._sought(*believed(other, near=refitted), known)
        best = max(found.every, key=lambda t: t.evidence)
        if best.effects and not self.limit.over:
            again = search_again([best], refitted, problem, self.steps.of("the best without that")).trials
            if again and again[0].evidence >= best.evidence:
                untried = self._delays(problem, other)
                found_again = self._fitted_again(found, given, refitted, problem, untried)
                if not self.limit.over:
                    return problem, every + untried, found_again
        return other, every, found

    def _fitted_again(
        self, ahead: Searched, given: Trial, refitted: Trial, problem: Problem, untried: Sequence[Candidate] = ()
    ) -> Searched:
        """The best of what was found in another problem, as in pieces of long records, fitted from there; and what was
        no candidate there."""
        found = search_again(ahead.trials, refitted, problem, self.steps.of("the best again"))
        if untried:
            found = found.and_then(search(untried, given, refitted, problem, self.steps.of("the force's delay")))
        refitted = refit_from(found.trials, refitted, problem)
        _, (given, refitted, *trials) = amid_noise(given, refitted, found.trials, problem, self.key)
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
                another, given, refitted = believed(other, near=found.refitted)
                again = self._fitted_again(found, given, refitted, another)
                if self.limit.over:
                    break
                problem, found = another, again
        return problem, found


def _delays_force(candidate: Candidate) -> bool:
    return issubclass(candidate.effects[0].cause.effect, ForceDelay)


def shows_later(trials: Sequence[Trial]) -> bool:
    """Whether what is lacking shows in what was kept back, beside the best trial and beside all that are as likely."""
    best = max(t.evidence for t in trials)
    return all(_later(t, THRESHOLDS.much) for t in trials if t.evidence > best - _AS_LIKELY)


def _later(trial: Trial, much: float) -> bool:
    """Whether a trial leaves nothing of what was fitted, but `much` of what was kept back, as a share of the signal."""
    fitted, kept_back = (np.sqrt(trial.prediction.beyond()[first::2]) for first in (0, 1))
    return white(trial) and bool(np.all(fitted < THRESHOLDS.negligible) and np.any(kept_back > much))
