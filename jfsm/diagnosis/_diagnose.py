"""From a record and a model to a verdict."""

import secrets
from collections.abc import Sequence
from functools import partial

import jax

from .._limit import Limit, ended_by_interrupt
from .._programs import programs_kept
from .._types import require_x64
from ..dynamics import Reconstruction
from ..identification import Nuisances
from ..records import Record
from ..reporting import shown_by_default
from ..structures import Cause, Clipping, Structure
from ._adequacy import ALMOST_ALL, GATE, NEGLIGIBLE, adequate
from ._between import differences
from ._candidates import Candidate, chosen_causes
from ._chance import noise_levels
from ._clipped import beside_clipping, limited
from ._decide import Decision, decide, first_alone
from ._detectable import Silence, detectable, naturally_detectable
from ._diagnosis import Diagnosis
from ._forgiving import forgiving
from ._gain import Gain, StructureOf, measure_gain
from ._holdout import HeldOut, split
from ._late import Late, in_time, showing_late, slightly_late
from ._next import Leading
from ._problem import Problem
from ._report import Tested, assemble
from ._residual import residual, stand_in
from ._standing import UNPREDICTED
from ._steps import Progress, Steps
from ._study import Searched, Study
from ._trial import Trial
from ._unfinished import Unfinished
from ._untold import in_step, untold
from ._wandering import steadied

_WORSE = 1.5
"""Error on held-out readings, in errors of the model as given and in those that noise leaves, from which a cause makes
the model worse, though it leaves noise only over some periods."""
_SURELY = 2 * UNPREDICTED
"""Nats by which a law that leaves noise only is ahead of its absence, so that no prediction has to show it."""
_ROUNDS = 3
"""Times that a record is looked into, at most, in which channels turn out to be late by less than a sample."""


@programs_kept()
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
    time_limit: float | None = None,
    progress: Progress | bool | None = None,
) -> Diagnosis:
    """What `model` gets wrong about `record`, the name of the cause, and the gain of mending it.

    Where the motion is imposed (``drive="motion"``) it is judged by the force that was measured. Of the sensors' faults
    only a late force is looked for then: a gain of the force is that of all own values. A channel that is late by less
    than a sample is no finding: it is put in time, and the verdict is that of the rest.

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
        Where laws and loads are tried; by default laws on the model's links, loads on every mass.
    reconstruction : "band-limited", "linear" or "hold"
        The force between its samples: band-limited for whatever was filtered before it was sampled.
    time_limit : float, optional
        Seconds after which the best verdict so far is given, marked as unfinished. The first interrupt (Ctrl-C) does
        the same; a second one stops everything.
    progress : callable or bool, optional
        Told of every step: what, steps done, steps in all. By default a bar shows them on a terminal and in a notebook,
        and nothing elsewhere; False shows nothing.

    Returns
    -------
    Diagnosis
        Half as sure of a cause where it is not `finished`, and undecided without one.

    Raises
    ------
    ValueError
        If the record cannot be used, does not fit the model, or an argument is out of its range.
    KeyboardInterrupt
        If it is interrupted before the model itself was fitted, or for the second time.

    Notes
    -----
    Most of the time of a first diagnosis is compilation. Programs are therefore kept on disk, up to 500 MB in the
    user's cache folder, or in the folder that ``jax_compilation_cache_dir`` names; none are if JAX is told so
    (``jax.config.update("jax_enable_compilation_cache", False)``).
    """
    require_x64()
    if max_causes < 1:
        raise ValueError(f"`max_causes` must be at least 1; got {max_causes}.")
    if time_limit is not None and not time_limit > 0:
        raise ValueError(f"`time_limit` must be positive, in seconds; got {time_limit:g}. Without it there is none.")
    limit = Limit(time_limit)
    with shown_by_default(progress) as told, ended_by_interrupt(limit):
        arguments = record, model, holdout, causes, max_causes, key, places, reconstruction
        return _diagnosed(*arguments, limit, Steps(told, 4))


def _diagnosed(
    record: Record | Sequence[Record],
    model: Structure,
    holdout: float | Record | Sequence[Record] | None,
    causes: Sequence[str | Cause] | None,
    max_causes: int,
    key: jax.Array | None,
    places: Sequence[tuple[int, int]] | None,
    reconstruction: Reconstruction,
    limit: Limit,
    steps: Steps,
) -> Diagnosis:
    """What `diagnose` returns, within the limit."""
    key = jax.random.key(secrets.randbits(32)) if key is None else key
    training, _ = split(record, holdout)
    chosen = chosen_causes(causes)
    whole = [whole for whole, _ in training]
    clipped = limited(whole, model) if "clipping" in chosen else []
    stated = model
    for sensor in clipped:
        model = model + sensor

    steps.next("the model as given and refitted")
    study = Study(model, chosen, places, reconstruction, key, steps, limit, pairs=max_causes > 1)
    problem, every, found, held, late = _looked_into(record, holdout, study)
    steps.next("the verdict, and its gain on held-out readings")
    judged, tried, decision, extended, gain, runs = _concluded(found, problem, clipped, model, stated, held, key)
    first, fitted, refitted = judged.first, judged.until[0], tried.refitted
    steps.next("the missing force")
    term = decision.named_term
    # Shown beside a law is the force that it stands for, with the own values that go with it.
    lacking = refitted.structure if term is None else decision.winner.structure.without(term)
    at = term.at if term is not None and term.at in lacking.links else None
    missing = residual(lacking, steadied(first), fitted, at)
    silence = Silence(tried.given, refitted, judged)
    steps.next("what would have been seen")
    if decision.verdict in ("consistent", "undecided"):  # silence is worth what would have been heard
        seen = naturally_detectable(every, silence)
    else:
        seen = detectable(tried.trials, silence)
    if decision.verdict != "consistent":
        extended = showing_late(extended, late)
    unfinished = Unfinished.of(chosen, tried, limit, cut=decision.cut, pairs=study.pairs)
    tested = Tested(tried.trials, tried.behind, tried.left_out, seen, tried.lack.known, unfinished)
    leading = Leading.of(model, [refitted, *tried.trials], decision.share, first, fitted)
    steps.end()
    return assemble(decision, clipped, refitted, tested, judged, extended, missing, gain, runs, leading)


def _looked_into(
    record: Record | Sequence[Record], holdout: float | Record | Sequence[Record] | None, study: Study
) -> tuple[Problem, list[Candidate], Searched, list[HeldOut], Late]:
    """What a study makes of the records, and what is held out, with channels in time that are late by less than a
    sample."""
    late: Late = {}
    reached = None
    for _ in range(_ROUNDS):
        training, held = in_time(*split(record, holdout), late)
        studied = study.of(training, unless_later=isinstance(holdout, float))
        if isinstance(studied, Trial):  # as much is kept back of the first part
            training, held = in_time(*split(record, holdout, first=True), late)
            studied = study.of(training, known=studied)
            assert not isinstance(studied, Trial)
        if reached is not None and study.limit.over:  # what was found before is not worth less
            break
        problem, every, found = studied
        reached = problem, every, found, held, late
        late = slightly_late(found.every, late, problem.first.record.dt)
        if late == reached[-1] or study.limit.over:
            break
    assert reached is not None
    return reached


def _decided(found: Searched, problem: Problem, *, lasting: bool) -> tuple[Problem, Searched, Decision]:
    """The verdict; where no cause is named, that of records of which a share of the force is forgiven to all.

    Where the model is wrong in a `lasting` run its predictions over some periods do not make it consistent.
    """
    periods, limit = sum(n.record.duration / n.period for n in problem.records), problem.limit

    def decision_of(found: Searched, problem: Problem, **how) -> Decision:
        mapped = (lambda t: None) if limit.over else partial(stand_in, problem=problem)

        def decided(trials: Sequence[Trial]) -> Decision:
            return decide(found.given, found.refitted, trials, mapped, found.lack, periods, **how)

        decision = first_alone(decided(found.trials), found.trials, found.refitted, decided)
        # What a law depends on is open where its numbers are not the same in all records.
        varies = any(d.wide and d.path not in problem.model.entries() for d in differences(decision.winner))
        return decision.open() if decision.verdict == "cause" and varies else decision

    told = {"untold": untold(problem.records), "in_step": in_step(problem.records), "lasting": lasting}
    cut = limit.over
    decision = decision_of(found, problem, imposed=problem.imposed, **told)
    again = None if decision.winner.effects or cut else forgiving(found.every, problem)
    if cut or (again is not None and limit.over):
        return problem, found, decision.cut_short(found.refitted)
    if again is None:
        return problem, found, decision
    problem, (given, refitted, *trials) = again
    found = found.judged_in(problem, given, refitted, trials)
    return problem, found, decision_of(found, problem, forgiven=True, lasting=lasting)


def _concluded(
    found: Searched,
    problem: Problem,
    clipped: Sequence[Clipping],
    model: Structure,
    stated: Structure,
    held: Sequence[HeldOut],
    key: jax.Array,
) -> tuple[Problem, Searched, Decision, Structure, Gain | None, list[dict]]:
    """The verdict as held-out readings leave it, what it rests on, and what `_confirmed` tells beside.

    It is reached anew where predictions over some periods make the model consistent and the whole run does not.
    """

    def concluded(*, lasting: bool):
        judged, tried, decision = _decided(found, problem, lasting=lasting)
        if clipped:
            decision = beside_clipping(decision, clipped, tried.refitted)
        confirmed = _confirmed(decision, tried, model, stated, held, judged.first, key, lasting=lasting)
        return judged, tried, *confirmed

    reached = concluded(lasting=False)
    _, _, decision, _, gain, _ = reached
    out_of_step = decision.verdict == "consistent" and gain is not None and _falls_out_of_step(gain)
    return concluded(lasting=True) if out_of_step else reached


def _confirmed(
    decision: Decision,
    tried: Searched,
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

    refitted, ahead = tried.refitted, decision.winner.evidence - max(tried.given.evidence, tried.refitted.evidence)

    def gained(extended: StructureOf) -> tuple[Gain | None, list[dict]]:
        if not held:
            return None, []
        noise = noise_levels(decision.winner, first)
        return measure_gain(stated, refitted.extended, extended, held, noise, first, key)

    extended = (lambda record: model) if decision.verdict == "consistent" else decision.winner.extended
    gain, runs = gained(extended)
    if gain is not None and (against := _speaks_against(gain, decision, ahead, lasting=lasting)):
        decision = decision.refused(against, refitted)
        extended = refitted.extended
        gain, runs = gained(extended)
    elif gain is not None and _closes_too_little(gain, decision):
        decision = decision.open()
    if gain is not None and (by_class := decision.by_class()) is not None:
        confirmed, runs_of_it = gained(by_class.winner.extended)
        if confirmed is not None and confirmed.closed >= ALMOST_ALL:
            return by_class, by_class.winner.extended(), confirmed, runs_of_it
    return decision, extended(None), gain, runs


def _falls_out_of_step(gain: Gain) -> bool:
    """Whether the model, right over some periods, is wrong in the whole run over held-out readings, refitted or not."""
    return min(gain.before, gain.refitted) > _WORSE * max(gain.floor, NEGLIGIBLE)


def _closes_too_little(gain: Gain, decision: Decision) -> bool:
    """Whether a cause that leaves more than noise closes less than half of the error of a run over held-out readings.

    Where it leaves noise only, it is the motion that no run follows for long.
    """
    unsettled = decision.verdict == "cause" and bool(decision.winner.effects) and not adequate(decision.winner)
    return unsettled and gain.closable and gain.interval[1] < GATE


def _speaks_against(gain: Gain, decision: Decision, ahead: float, *, lasting: bool = False) -> str:
    """Why runs on held-out readings speak against what was found, so many nats `ahead` of no effect; or nothing."""
    leaves_something = decision.verdict == "cause" and not adequate(decision.winner)
    worse = gain.after > _WORSE * max(gain.before, gain.floor)
    if decision.verdict in ("cause", "unnamed") and (worse or (leaves_something and gain.harmful)):
        return "runs worse on held-out readings than the model as given"
    unsure = leaves_something and decision.share(decision.winner) < 0.5
    if unsure and not (gain.closable and gain.significant):
        return "is not likely, leaves something, and is not confirmed by held-out readings"
    unpredicted = decision.verdict == "cause" and decision.winner.laws and decision.kappa[id(decision.winner)] == 0.0
    sure = ahead > _SURELY and adequate(decision.winner)
    if unpredicted and not sure and not (gain.closable and gain.significant):
        return "explains nothing that predictions leave, and is not confirmed by held-out readings"
    if (decision.verdict == "unnamed" or lasting) and gain.closable and gain.closed < GATE:
        return "closes less than half of the error on held-out readings"
    return ""
