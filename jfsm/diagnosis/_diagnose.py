"""From a record and a model to a verdict."""

import secrets
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import jax
import numpy as np

from .._types import require_x64
from ..dynamics import Reconstruction
from ..identification import Nuisances, prepare_all
from ..records import Record
from ..structures import Cause, Clipping, Structure
from ._adequacy import ALMOST_ALL, GATE, MUCH, NEGLIGIBLE, adequate, explained, white
from ._candidates import Candidate, as_promising, candidates, chosen_causes, contained, promising
from ._chance import beside_chance, noise_beyond, noise_levels
from ._clipped import beside_clipping, limited
from ._decide import Decision, decide, first_alone
from ._detectable import Silence, detectable, naturally_detectable
from ._diagnosis import Diagnosis
from ._effect import Effect
from ._enough import hidden, settled, something_left
from ._forgiving import forgiving
from ._gain import Gain, measure_gain
from ._holdout import HeldOut, split
from ._lack_of_fit import LackOfFit
from ._next import Leading
from ._problem import Problem
from ._report import Tested, assemble
from ._residual import residual, stand_in
from ._search import LeftBehind, best_of_each, fit_model, refit_from, search, search_akin, search_known, search_pairs
from ._trial import Trial
from ._untold import in_step, untold

_HEAVIER = 0.03
_WORSE = 1.5
"""Error on held-out readings, in errors of the model as given and in those that noise leaves, from which a cause makes
the model worse."""
Progress = Callable[[str, int, int], None]


def diagnose(
    record: Record | Sequence[Record],
    model: Structure,
    holdout: float | Record | Sequence[Record] | None = 0.3,
    causes: Sequence[str | Cause] | None = None,
    max_causes: int = 2,
    key: jax.Array | None = None,
    *,
    places: Sequence[tuple[int, int]] | None = None,
    reconstruction: Reconstruction = "band-limited",
    progress: Progress | None = None,
) -> Diagnosis:
    """What `model` gets wrong about `record`, the name of the cause, and the gain of mending it.

    Where the motion is imposed (``drive="motion"``) it is judged by the force that was measured. Of the sensors' faults
    only a late force is looked for then: a gain of the force is that of all own values.

    Parameters
    ----------
    record : Record or sequence of them
        One verdict that must hold on all.
    model : Structure
        The simulation that its owner believes in. Its own values are refitted within its trust (`Structure.uncertain`).
    holdout : float, Record, sequence of Records, or None
        A share is the last part in time, unless what the model lacks shows only there: then it is the first. Where
        nothing drives the structure it is the last part of what is more than noise, run from the release. Records are
        never fitted; None decides on the whole record and gives no gain.
    causes : sequence of ids or causes, optional
        What to look for; the whole catalogue by default. Wrong own values always. Of many laws, those are fitted that
        explain most of the force that the model lacks.
    max_causes : int
        Effects that may act at once, at most. Two are looked for where any single one leaves more than noise; more than
        two are not.
    key : jax.random.key, optional
        Source of the few draws (the floor of the gain); made at the call when None.
    places : sequence of links, optional
        Where link laws are tried; the model's links by default.
    reconstruction : "band-limited", "linear" or "hold"
        The force between its samples: band-limited for whatever was filtered before it was sampled.
    progress : callable, optional
        Told of every step: what, steps done, steps in all.

    Returns
    -------
    Diagnosis

    Raises
    ------
    ValueError
        If the record cannot be used, does not fit the model, or an argument is out of its range.
    """
    require_x64()
    if max_causes < 1:
        raise ValueError(f"`max_causes` must be at least 1; got {max_causes}.")
    key = jax.random.key(secrets.randbits(32)) if key is None else key
    training, held = split(record, holdout)
    chosen = chosen_causes(causes)
    whole = [whole for whole, _ in training]
    clipped = limited(whole, model) if "clipping" in chosen else []
    stated = model
    for sensor in clipped:
        model = model + sensor
    steps = _Steps(progress, 4)

    steps.next("the model as given and refitted")
    study = _Study(model, chosen, places, reconstruction, key, steps.next, pairs=max_causes > 1)
    studied = study.of(training, unless_later=isinstance(holdout, float))
    if isinstance(studied, Trial):  # as much is kept back of the first part
        training, held = split(record, holdout, first=True)
        studied = study.of(training, known=studied)
        assert not isinstance(studied, Trial)
    problem, every, found = studied
    steps.next("the verdict, and its gain on held-out readings")
    judged, tried, decision, extended, gain, runs = _concluded(found, problem, clipped, model, stated, held, key)
    first, fitted, refitted = judged.first, judged.until[0], tried.refitted
    steps.next("the missing force")
    term = decision.named_term
    # Shown beside a law is the force that it stands for, with the own values that go with it.
    lacking = refitted.structure if term is None else decision.winner.structure.without(term)
    at = term.at if term is not None and term.at in lacking.links else None
    missing = residual(lacking, first, fitted, at)
    silence = Silence(tried.given, refitted, judged)
    steps.next("what would have been seen")
    if decision.verdict in ("consistent", "undecided"):  # silence is worth what would have been heard
        seen = naturally_detectable(every, silence)
    else:
        seen = detectable(tried.trials, silence)
    tested = Tested(tried.trials, tried.behind, tried.left_out, seen, tried.lack.known)
    leading = Leading.of(model, [refitted, *tried.trials], decision.share, first, fitted)
    return assemble(decision, clipped, refitted, tested, model, extended, judged.records, missing, gain, runs, leading)


@dataclass(frozen=True)
class _Searched:
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


@dataclass(frozen=True)
class _Study:
    """How records are looked into."""

    model: Structure
    chosen: dict[str, Cause]
    places: Sequence[tuple[int, int]] | None
    reconstruction: Reconstruction
    key: jax.Array
    tell: Callable[[str, int], None]
    pairs: bool

    def of(
        self, training: Sequence[tuple[Record, int]], *, unless_later: bool = False, known: Trial | None = None
    ) -> tuple[Problem, list[Candidate], _Searched] | Trial:
        """What is fitted to, what could be tried, what was found.

        Where what is lacking shows in what was kept back, which then has to be fitted, the best single trial beside
        which it does, `unless_later`; that is `known` then.
        """
        problem, given, refitted = _believed(training, self.model, self.reconstruction)
        if unless_later and _later(refitted, NEGLIGIBLE):
            return refitted
        every = candidates(self.model, problem.records, self.chosen, self.places)
        found = self._searched(every, given, refitted, known, problem)
        best = max(found.every, key=lambda t: t.evidence)
        if unless_later and _later(best, MUCH):
            return max((t for t in found.every if len(t.effects) < 2), key=lambda t: t.evidence)
        return problem, every, found

    def _searched(
        self,
        every: list[Candidate],
        given: Trial,
        refitted: Trial,
        known: Trial | None,
        problem: Problem,
    ) -> _Searched:
        """Single effects fitted, the promising ones first, and pairs of them where that leaves something."""
        stands_for_the_drive = in_step(problem.records)

        def told(trials: Sequence[Trial]) -> list[Trial]:
            return [t for t in trials if not stands_for_the_drive(t)]

        def close(trials: Sequence[Trial]) -> list[Trial]:
            best = max(told([given, refitted, *trials]), key=lambda t: t.evidence)
            return [t for t in trials if t is best or explained(t, refitted) >= GATE]

        tried, left_out = promising(every)
        found = search(tried, given, refitted, problem, self.tell)
        if settled(told([given, refitted, *found.trials])):
            best = max(found.trials, key=lambda t: t.evidence)
            more = contained([law for t in close(found.trials) for law in t.laws], left_out)
            more += [c for c in as_promising(best.effects, every, left_out) if c not in more]
        else:  # of a missing force that is ill seen regression may put the right law last
            more = [c for c in left_out if c.starts]
        if more:
            found = found.and_then(search(more, given, refitted, problem, self.tell))
            left_out = [c for c in left_out if c not in more]
        found = search_akin(close(found.trials), every, found, problem, self.tell)
        if known is not None and known.effects:
            found = search_known(known, found, problem, self.tell)
        refitted = refit_from(found.trials, refitted, problem)
        trials, behind = [t.beside(refitted) for t in found.trials], found.behind
        louder = noise_beyond([given, refitted, *trials], problem)
        trials = [t.amid(louder) for t in (given, refitted, *trials)]
        given, refitted, *trials = beside_chance(trials, problem, self.key)
        lack, alone = LackOfFit(problem), told([given, refitted, *trials])
        effects = _beside(alone, refitted, every, lack, imposed=problem.imposed) if self.pairs else []
        if effects:
            found = search_pairs(effects, trials, known, refitted, problem, self.tell)
            trials = best_of_each([*trials, *(t.beside(refitted).amid(louder) for t in found.trials)])
            trials = [given, refitted, *trials]
            given, refitted, *trials = beside_chance(trials, problem, self.key)
            done = {t.effects for t in trials}
            behind = [one for one in (*behind, *found.behind) if one.effects not in done]
        return _Searched(given, refitted, trials, behind, left_out, lack)


def _decided(found: _Searched, problem: Problem, *, lasting: bool) -> tuple[Problem, _Searched, Decision]:
    """The verdict; where no cause is named, that of records of which a share of the force is forgiven to all.

    Where the model is wrong in a `lasting` run its predictions over some periods do not make it consistent.
    """
    periods = sum(n.record.duration / n.period for n in problem.records)

    def decision_of(found: _Searched, problem: Problem, **how) -> Decision:
        mapped = partial(stand_in, problem=problem)

        def decided(trials: Sequence[Trial]) -> Decision:
            return decide(found.given, found.refitted, trials, mapped, found.lack, periods, **how)

        return first_alone(decided(found.trials), found.trials, found.refitted, decided)

    told = {"untold": untold(problem.records), "in_step": in_step(problem.records), "lasting": lasting}
    decision = decision_of(found, problem, imposed=problem.imposed, **told)
    again = None if decision.winner.effects else forgiving(found.every, problem)
    if again is None:
        return problem, found, decision
    problem, (given, refitted, *trials) = again
    compared, best = {t.effects for t in trials}, min(t.rung for t in found.trials)
    dropped = [LeftBehind(t.effects, t.rung - best) for t in found.trials if t.effects not in compared]
    found = _Searched(given, refitted, trials, [*found.behind, *dropped], found.left_out, LackOfFit(problem))
    return problem, found, decision_of(found, problem, forgiven=True, lasting=lasting)


def _believed(
    training: Sequence[tuple[Record, int]], model: Structure, reconstruction: Reconstruction
) -> tuple[Problem, Trial, Trial]:
    """The problem, the model as given, and refitted."""
    whole, until = [whole for whole, _ in training], [fit for _, fit in training]
    problem = Problem(model, prepare_all(whole, model, reconstruction), until)
    given, refitted = fit_model(problem)
    if _outweighed(model, refitted.structure):
        # The noise of the force acts through the mass, and all hypotheses share one noise: that of the likelier mass.
        problem = problem._replace(records=prepare_all(whole, model, reconstruction, weighed=refitted.structure))
        given, refitted = fit_model(problem, near=refitted)
    return problem, given, refitted


def _concluded(
    found: _Searched,
    problem: Problem,
    clipped: Sequence[Clipping],
    model: Structure,
    stated: Structure,
    held: Sequence[HeldOut],
    key: jax.Array,
) -> tuple[Problem, _Searched, Decision, Structure, Gain | None, list[dict]]:
    """The verdict as held-out readings leave it, what it rests on, and what `_confirmed` tells beside.

    It is reached anew where predictions over some periods make the model consistent and the whole run does not.
    """

    def concluded(*, lasting: bool):
        judged, tried, decision = _decided(found, problem, lasting=lasting)
        if clipped:
            decision = beside_clipping(decision, clipped, tried.refitted)
        confirmed = _confirmed(decision, tried.refitted, model, stated, held, judged.first, key, lasting=lasting)
        return judged, tried, *confirmed

    reached = concluded(lasting=False)
    _, _, decision, _, gain, _ = reached
    out_of_step = decision.verdict == "consistent" and gain is not None and _falls_out_of_step(gain)
    return concluded(lasting=True) if out_of_step else reached


def _confirmed(
    decision: Decision,
    refitted: Trial,
    model: Structure,
    stated: Structure,
    held: Sequence[HeldOut],
    first: Nuisances,
    key: jax.Array,
    *,
    lasting: bool,
) -> tuple[Decision, Structure, Gain | None, list[dict]]:
    """The decision as held-out readings leave it, the structure to go on with, its gain, and the runs behind that.

    The gain is that over the model as it was `stated`; where the model is wrong in a `lasting` run alone, that run
    decides.
    """

    def gained(extended: Structure) -> tuple[Gain | None, list[dict]]:
        if not held:
            return None, []
        noise = noise_levels(decision.winner, first)
        return measure_gain(stated, refitted.extended(), extended, held, noise, first, key)

    extended = model if decision.verdict == "consistent" else decision.winner.extended()
    gain, runs = gained(extended)
    if gain is not None and (against := _speaks_against(gain, decision, lasting=lasting)):
        decision = decision.refused(against, refitted)
        extended = refitted.extended()
        gain, runs = gained(extended)
    if gain is not None and (by_class := decision.by_class()) is not None:
        near = by_class.winner.extended()
        confirmed, runs_of_it = gained(near)
        if confirmed is not None and confirmed.closed >= ALMOST_ALL:
            return by_class, near, confirmed, runs_of_it
    return decision, extended, gain, runs


def _falls_out_of_step(gain: Gain) -> bool:
    """Whether the model, right over some periods, is wrong in the whole run over held-out readings, refitted or not."""
    return min(gain.before, gain.refitted) > _WORSE * max(gain.floor, NEGLIGIBLE)


def _speaks_against(gain: Gain, decision: Decision, *, lasting: bool = False) -> str:
    """Why runs on held-out readings speak against what was found, or nothing."""
    if decision.verdict in ("cause", "unnamed") and gain.after > _WORSE * max(gain.before, gain.floor):
        return "runs worse on held-out readings than the model as given"
    unsure = decision.verdict == "cause" and decision.share(decision.winner) < 0.5 and not adequate(decision.winner)
    if unsure and not (gain.closable and gain.significant):
        return "is not likely, leaves something, and is not confirmed by held-out readings"
    unpredicted = decision.verdict == "cause" and decision.winner.laws and decision.kappa[id(decision.winner)] == 0.0
    if unpredicted and not (gain.closable and gain.significant):
        return "explains nothing that predictions leave, and is not confirmed by held-out readings"
    if (decision.verdict == "unnamed" or lasting) and gain.closable and gain.closed < GATE:
        return "closes less than half of the error on held-out readings"
    return ""


def _later(trial: Trial, much: float) -> bool:
    """Whether a trial leaves nothing of what was fitted, but `much` of what was kept back, as a share of the signal."""
    fitted, kept_back = (np.sqrt(trial.prediction.beyond[first::2]) for first in (0, 1))
    return white(trial) and bool(np.all(fitted < NEGLIGIBLE) and np.any(kept_back > much))


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


class _Steps:
    """Counts steps for a progress display; `more` of them may turn up on the way."""

    def __init__(self, progress: Progress | None, least: int):
        self.progress, self.done, self.least, self.total = progress, 0, least, least

    def next(self, what: str, more: int = 0) -> None:
        self.total = max(self.total, self.least + more)
        if self.progress is not None:
            self.progress(what, self.done, self.total)
        self.done += 1
