"""The way from a record and a model to a verdict, step by step."""

from collections.abc import Sequence

import jax

from .._limit import Limit
from ..plant import Reconstruction
from ..records import Record
from ..structures import AbstractTerm, CauseLike, Structure
from ._diagnosis import Diagnosis
from .advice.detection_limits import Silence, Smallest, detectable, naturally_detectable
from .advice.next_test import Leading
from .channels.clipping import limited
from .channels.delays import Late, in_time, slightly_late
from .channels.drift import steadied
from .evidence.box_runs import Box, NotRun
from .evidence.fitted import Trial
from .evidence.free_runs import Gain
from .evidence.measured import HeldOutRuns, Weighed
from .evidence.missing_force import Residual, residual
from .evidence.setup import Problem
from .evidence.split import HeldOut, split
from .hypotheses.candidate import Candidate
from .hypotheses.candidates import asked_for, chosen_causes
from .look.in_verdict import mended_model
from .look.looked import held_out_alike, looked_at
from .report.assemble import Reached, Tested, assemble
from .report.sentences import leaves_something
from .report.unfinished import Unfinished
from .search.rounds import Searched
from .search.steps import Steps
from .search.study import Study
from .verdict.decision import Decision
from .verdict.judge import judge_in_sign

_ROUNDS = 3
"""Times that a record is looked into, at most, in which channels turn out to be late by less than a sample."""


def conduct(
    given: Sequence[Record],
    model: Structure,
    holdout: float | Record | Sequence[Record] | None,
    causes: Sequence[CauseLike] | None,
    max_causes: int,
    key: jax.Array,
    places: Sequence[tuple[int, int]] | None,
    reconstruction: Reconstruction | None,
    limit: Limit,
    steps: Steps,
    box: Box | None = None,
) -> Diagnosis:
    """What `diagnose` returns, within the limit; the gain is that of a simulation that can only be run, if it is
    given and can be run with what was found."""
    looked = looked_at(given, model)
    record, holdout = looked.records, held_out_alike(holdout, looked)
    training, _ = split(record, holdout)
    chosen = chosen_causes(asked_for(causes, model, record))
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
    gain, runs, said = _of_the_box(box, behind, decision, held, gain, runs)
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
    reached = Reached(decision, winner, term, weighed.evidence, rest, assumed, late_forces)
    return assemble(reached, clipped, refitted, tested, judged, extended, missing, gain, runs, leading, looked, said)


def _of_the_box(
    box: Box | None, behind: Weighed, decision: Decision, held: Sequence[HeldOut], gain: Gain | None, runs: list[dict]
) -> tuple[Gain | None, list[dict], str]:
    """A gain and the runs behind it, those of a simulation that can only be run where it is one and can be run with
    what was found; and what is said of that."""
    if box is None or gain is None or decision.verdict == "consistent":
        return gain, runs, ""
    try:
        return box.gain(behind.handed_out(decision), held, gain, runs, behind.problem.first)
    except NotRun as why:
        said = f"The gain is that of this structure: the simulation was not run with what was found, since {why}."
        return gain, runs, said


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
