"""From a record and a model to a verdict."""

import secrets
from collections.abc import Sequence

import jax

from .._limit import Limit, ended_by_interrupt
from .._programs import programs_kept
from .._threads import small_matrices
from .._types import require_x64
from ..plant import Reconstruction
from ..records import Record
from ..reporting import shown_by_default
from ..structures import AbstractTerm, Cause, Structure
from ._diagnosis import Diagnosis
from .advice.detection_limits import Silence, Smallest, detectable, naturally_detectable
from .advice.next_test import Leading
from .channels.clipping import limited
from .channels.delays import Late, in_time, slightly_late
from .channels.drift import steadied
from .evidence.fitted import Trial
from .evidence.measured import HeldOutRuns, Weighed
from .evidence.missing_force import Residual, residual
from .evidence.setup import Problem
from .evidence.split import HeldOut, records_of, split
from .hypotheses.candidate import Candidate
from .hypotheses.candidates import chosen_causes
from .look.in_verdict import mended_model
from .look.looked import held_out_alike, looked_at
from .report.assemble import Reached, Tested, assemble
from .report.sentences import leaves_something
from .report.unfinished import Unfinished
from .search.rounds import Searched
from .search.steps import Progress, Steps
from .search.study import Study
from .verdict.judge import judge_in_sign

_ROUNDS = 3
"""Times that a record is looked into, at most, in which channels turn out to be late by less than a sample."""


@programs_kept()
@small_matrices()
def diagnose(
    record: Record | Sequence[Record],
    model: Structure,
    holdout: float | Record | Sequence[Record] | None = 0.3,
    causes: Sequence[str | Cause] | None = None,
    max_causes: int = 2,
    key: jax.Array | None = None,
    *,
    since: float | None = None,
    until: float | None = None,
    places: Sequence[tuple[int, int]] | None = None,
    reconstruction: Reconstruction | None = None,
    time_limit: float | None = None,
    progress: Progress | bool | None = None,
) -> Diagnosis:
    """What `model` gets wrong about `record`, the name of the cause, and the gain of mending it.

    Where the motion is imposed (``drive="motion"``) it is judged by the force that was measured. Of the sensors' faults
    only a late force is looked for then: a gain of the force is that of all own values. A response channel that is late
    by less than a sample is no finding: it is put in time, and the verdict is that of the rest. A force that is late,
    or held between its samples, is a finding where that changes a run of `model` as given.

    Before anything is fitted the records are looked at. Torn and hung samples take no part, and neither does rest, and
    notes say so. A force or an acceleration of the wrong sign is a cause; it is turned, and the verdict on the rest
    follows. A dead channel, a displacement or a velocity of the wrong sign, and a size that is off by a factor between
    units are refused.

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
    since, until : float, optional
        Instants [s] of the records' own clocks between which they are used, held-out ones aside.
    places : sequence of links, optional
        Where laws and loads are tried; by default laws on the model's links, loads on every mass.
    reconstruction : "band-limited", "linear" or "hold", optional
        The force between its samples. By default band-limited, as whatever was filtered before it was sampled, unless
        another one turns out far likelier.
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
        If the record cannot be used, does not fit the model, or an argument is out of its range; a look before the
        first fit may refuse it.
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
    records = [part.between(since, until) for part in records_of(record)]
    with shown_by_default(progress) as told, ended_by_interrupt(limit):
        arguments = records, model, holdout, causes, max_causes, key, places, reconstruction
        return _diagnosed(*arguments, limit, Steps(told, 4))


def _diagnosed(
    given: Sequence[Record],
    model: Structure,
    holdout: float | Record | Sequence[Record] | None,
    causes: Sequence[str | Cause] | None,
    max_causes: int,
    key: jax.Array | None,
    places: Sequence[tuple[int, int]] | None,
    reconstruction: Reconstruction | None,
    limit: Limit,
    steps: Steps,
) -> Diagnosis:
    """What `diagnose` returns, within the limit."""
    key = jax.random.key(secrets.randbits(32)) if key is None else key
    looked = looked_at(given, model)
    record, holdout = looked.records, held_out_alike(holdout, looked)
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
    assumed = study.ways[0]
    weighed = Weighed(
        found, problem, clipped, HeldOutRuns(stated, model, held, key, assumed), looked.checks, looked.inverted
    )
    decision = judge_in_sign(weighed.evidence)
    behind = weighed.behind(decision)
    judged, tried, winner = behind.problem, behind.found, behind.trial(decision.winner)
    late_forces, (gain, runs) = behind.late(decision), behind.gain(decision)
    extended = behind.extended(decision, {**late, **{channel: tau[0] for channel, tau in late_forces.items()}})
    steps.next("the missing force")
    term = next(iter(winner.laws), None) if decision.verdict == "cause" else None
    first, fitted, refitted = judged.first, judged.until[0], tried.refitted
    missing = _stands_for(term, winner, refitted, judged)
    rest = residual(winner.structure, steadied(first), fitted) if leaves_something(decision, winner) else None
    steps.next("what would have been seen")
    seen = _would_have_been_seen(decision.verdict, every, tried, judged)
    extended = mended_model(extended, looked)
    unfinished = Unfinished.of(chosen, tried, limit, cut=not decision.finished, pairs=study.pairs)
    tested = Tested(tried.trials, tried.behind, tried.left_out, seen, tried.lack.known, unfinished)
    leading = Leading.of(model, [refitted, *tried.trials], lambda t: decision.probability(t.key), first, fitted)
    steps.end()
    reached = Reached(decision, winner, term, weighed.evidence, rest, assumed, late_forces)
    return assemble(reached, clipped, refitted, tested, judged, extended, missing, gain, runs, leading, looked)


def _stands_for(term: AbstractTerm | None, winner: Trial, refitted: Trial, problem: Problem) -> Residual:
    """The force that a law stands for, with the own values that go with it; without a law, what the refit lacks."""
    lacking = refitted.structure if term is None else winner.structure.without(term)
    at = term.at if term is not None and term.at in lacking.links else None
    return residual(lacking, steadied(problem.first), problem.until[0], at)


def _would_have_been_seen(verdict: str, every: list[Candidate], found: Searched, problem: Problem) -> list[Smallest]:
    """The smallest effects that would have shown: of every candidate where none was named, since silence is worth what
    would have been heard."""
    silence = Silence(found.given, found.refitted, problem)
    if verdict in ("consistent", "undecided"):
        return naturally_detectable(every, silence)
    return detectable(found.trials, silence)


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
        late = slightly_late(found.every, late, problem.first.record)
        if late == reached[-1] or study.limit.over:
            break
    assert reached is not None
    return reached
