"""A diagnosis, assembled from a decision and what was measured for it."""

from collections.abc import Callable, Iterator
from typing import NamedTuple

from ..._format import FORMAT
from ...plant import Reconstruction
from ...structures import AbstractTerm, Clipping, Structure
from .._diagnosis import Diagnosis
from .._finding import CandidateResult
from ..advice.detection_limits import Smallest
from ..advice.next_test import Leading
from ..channels.clock import Lateness
from ..channels.coloured_noise import memories
from ..channels.drift import zeros
from ..channels.stationarity import unsteady
from ..evidence.between_records import differences
from ..evidence.evidence import Evidence
from ..evidence.fitted import Trial
from ..evidence.free_runs import Gain, how_run
from ..evidence.missing_force import Residual
from ..evidence.plain import as_plain
from ..evidence.scorecard import GIVEN
from ..evidence.setup import Problem
from ..hypotheses.candidate import Candidate
from ..look.in_verdict import in_words, with_signs
from ..look.looked import Looked
from ..search.climbing import LeftBehind
from ..verdict.decision import Decision
from ..verdict.judge import after_looks, evidence_behind
from .estimates import Units, modes_of_trial, noise_by_channel, plain_modes, refitted_values, smallest_effects, unit_of
from .findings import Ranked, findings_of, fitted_candidate, unfitted_candidate
from .force_shape import Shape, shape_of
from .late_forces import beside_late_forces, late_forces, times_of_forces
from .plain_data import Drawn, jfsm_version, plain_gain, plain_record, written_model
from .sentences import difference_sentence, verdict_advice, verdict_sentence
from .unfinished import Unfinished


class Tested(NamedTuple):
    """All candidates, and what else was looked into.

    These are candidates that were fitted, those that were fitted in part, those that were not, the smallest effects
    that would have been seen, the nats that other shapes would gain beside a trial, and what was not done.
    """

    trials: list[Trial]
    behind: list[LeftBehind]
    left_out: list[Candidate]
    seen: list[Smallest]
    unfit: Callable[[Trial], float | None]
    unfinished: Unfinished


class Reached(NamedTuple):
    """The decision, the trial that it rests on, the law that was named, if one was, all the evidence, the force that
    the named causes leave, if that is not negligible, how a force was assumed to go between its samples, and how late
    forces are, by channel, with the 95 % interval [s]."""

    decision: Decision
    winner: Trial
    term: AbstractTerm | None
    evidence: Evidence
    rest: Residual | None
    assumed: Reconstruction
    late: Lateness

    def ranked(self, trials: list[Trial]) -> Ranked:
        """The decision with the hypotheses behind it."""
        cards = evidence_behind(self.decision, self.evidence).cards
        return Ranked(self.decision, {t.key: t for t in trials}, cards)


def assemble(
    reached: Reached,
    clipped: list[Clipping],
    refitted: Trial,
    tested: Tested,
    problem: Problem,
    extended: Structure,
    missing: Residual,
    gain: Gain | None,
    runs: list[dict],
    leading: Leading | None,
    looked: Looked,
    on_gain: str = "",
) -> Diagnosis:
    """The diagnosis, with everything that the report needs; `on_gain` is a note on whose the gain is."""
    decision, unfinished, model, records = reached.decision, tested.unfinished, problem.model, problem.records
    first, verdict = records[0], decision.verdict
    units, imposed = first.record.units, first.path is not None
    late = late_forces(reached.late, first, reached.evidence.setting)
    findings = (*findings_of(reached.ranked(tested.trials), reached.winner, clipped, model, missing, first), *late)
    candidates = tuple(_candidates(tested, decision, refitted, model, units))
    winner = reached.winner if decision.winner != GIVEN else refitted
    refit, modes = refitted_values(winner, model, units), modes_of_trial(winner)
    between = [] if verdict == "consistent" else differences(winner)
    differ = [difference_sentence(one, unit_of(winner.structure, one.path, units)) for one in between]
    said = times_of_forces(reached.late, first, reached.assumed)
    notes = tuple(dict.fromkeys([*_notes(unfinished, problem, differ, winner, gain), *said, *filter(None, [on_gain])]))
    smallest = smallest_effects(tested.seen, units)
    shape = _shape(missing if verdict in ("undecided", "unnamed") else reached.rest)
    drawn = Drawn(missing, runs, reached.term, first.record, first.period, with_shape=verdict != "consistent")
    sentence = verdict_sentence(decision, reached.winner, findings, gain, shape, differ, imposed=imposed)
    sentence = beside_late_forces(sentence, verdict, late)
    sentence, advice = in_words(sentence, looked, verdict_advice(decision, gain, reached.evidence))
    decision = after_looks(decision, reached.evidence)
    findings = with_signs(findings, verdict, looked)
    data = {
        "jfsm": jfsm_version(),
        "format": FORMAT,
        "verdict": decision.verdict,
        "finished": not unfinished.notes,
        "untried": list(unfinished.untried),
        "sentence": sentence,
        "advice": advice,
        "record": plain_record(records),
        "model": model.describe(units),
        "extended": extended.describe(units),
        "extended_toml": written_model(extended),
        "findings": as_plain(findings, lossless=False),
        "candidates": as_plain(candidates, lossless=False),
        "refitted": {p: {"given": model.values()[p], **as_plain(e, lossless=False)} for p, e in refit.items()},
        "modes": plain_modes(model, modes),
        "between_records": {one.path: [list(interval) for interval in one.intervals] for one in between},
        "gain": plain_gain(gain),
        "notes": list(notes),
        "detectable": {c: s.plain for c, s in smallest.items()},
        "decision": decision.plain,
        "evidence": reached.evidence.plain,
    }
    return Diagnosis(
        verdict=decision.verdict, findings=findings, candidates=candidates, extended=extended, refitted=refit,
        gain=gain, detectable={c: s.size for c, s in smallest.items()}, noise=noise_by_channel(first), notes=notes,
        sentence=sentence, advice=advice, told=data, drawn=drawn, leading=leading,
        modes=modes, decision=decision, finished=not unfinished.notes, untried=unfinished.untried,
    )  # fmt: skip


def _shape(found: Residual | None) -> Shape | None:
    return None if found is None else shape_of(found)


def _candidates(
    tested: Tested, decision: Decision, refitted: Trial, model: Structure, units: Units
) -> Iterator[CandidateResult]:
    """The fitted candidates, those that were fitted in part and those that were not, the best of each first."""
    for t in sorted(tested.trials, key=lambda t: -t.evidence):
        yield fitted_candidate(t, decision, refitted, tested.unfit(t), model, units)
    for behind in sorted(tested.behind, key=lambda b: b.nats):
        yield unfitted_candidate(behind.effects, decision)
    for candidate in sorted(tested.left_out, key=lambda c: -(c.share or 0.0)):
        yield unfitted_candidate(candidate.effects, decision, candidate.share or 0.0)


def _notes(
    unfinished: Unfinished, problem: Problem, differ: list[str], winner: Trial, gain: Gain | None
) -> Iterator[str]:
    """What was not done, and what a reader has to know about the records and the runs."""
    first = problem.first
    yield from unfinished.notes
    for nuisances in problem.records:
        yield from nuisances.notes
    yield from how_run(first, gain)
    yield from zeros(first)
    yield from memories(first)
    yield from differ
    yield from unsteady(winner, problem)
