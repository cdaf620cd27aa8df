"""A decision put into values, words and plain data."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import Any, NamedTuple

import numpy as np

from ...identification import Nuisances
from ...records import Record
from ...reporting import stopping_line
from ...structures import PARAMETER_CAUSES, AbstractTerm, Cause, Clipping, Structure, causes, is_offset
from .._diagnosis import CandidateResult, Diagnosis, Estimate, Finding, Rival
from ..advice.detection_limits import Smallest
from ..advice.next_test import RIVAL, Leading
from ..channels.clipping import finding
from ..channels.coloured_noise import memories
from ..channels.drift import zeros
from ..channels.stationarity import unsteady
from ..evidence.between_records import Difference, differences
from ..evidence.evidence import Evidence
from ..evidence.fitted import Trial
from ..evidence.free_runs import Gain, how_run
from ..evidence.missing_force import Residual, curves
from ..evidence.plain import as_plain
from ..evidence.scorecard import GIVEN
from ..evidence.setup import Problem
from ..hypotheses.candidates import Candidate
from ..hypotheses.effect import Effect, key_of, names, places
from ..search.batches import LeftBehind
from ..thresholds import THRESHOLDS
from ..verdict.decision import Decision
from .force_shape import Shape, shape_of
from .law_class import WIDER, class_of
from .residual_signals import course
from .unfinished import Unfinished

_SHOWN = 2000
"""Points of a curve in the report."""
_SURE = 0.9
"""Probability of a cause from which its name is not open."""
_GO_ON = "Let the search go on to its end before the model is changed."
_NO_GAIN = "Do not change the model for the sake of its predictions: on held-out readings it gains no more than chance."


class Tested(NamedTuple):
    """Candidates that were fitted, those that were only so far, those that were not, what would have been seen of which
    size, what other shapes would gain beside a trial, where that was asked, and what had not been done."""

    trials: list[Trial]
    behind: list[LeftBehind]
    left_out: list[Candidate]
    seen: list[Smallest]
    unfit: Callable[[Trial], float | None]
    unfinished: Unfinished


class Reached(NamedTuple):
    """What was decided, the trial that it rests on, the law that was named, if one was, and all the evidence."""

    decision: Decision
    winner: Trial
    term: AbstractTerm | None
    evidence: Evidence


@dataclass(frozen=True)
class Drawn:
    """The missing force of a record of some `period` beside the law that stands for it, runs over what is held out, and
    the force's shape in words, where that is asked for; made when it is called."""

    missing: Residual
    runs: list[dict]
    term: AbstractTerm | None
    record: Record
    period: float
    with_shape: bool

    def __call__(self) -> dict[str, Any]:
        shape, start = shape_of(self.missing) if self.with_shape else None, float(self.record.time[0])
        return {
            "shape": None if shape is None else {**as_plain(shape._asdict(), lossless=False), "words": shape.words},
            "curves": {
                "holdout": _holdout(self.runs),
                **curves(self.missing, self.record.units, self.term),
                "course": course(self.missing, start, self.record.dt, self.period),
            },
        }


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
) -> Diagnosis:
    """The diagnosis, with everything that the report needs."""
    decision = reached.decision
    trials, model, records = tested.trials, problem.model, problem.records
    units = records[0].record.units
    findings = _findings(reached, trials, model, records[0])
    if decision.verdict == "cause":
        findings += tuple(finding(sensor, units[sensor.at[0]]) for sensor in clipped)
    left_out = sorted(tested.left_out, key=lambda c: -(c.share or 0.0))
    candidates = (
        *(
            _candidate(t, decision, refitted, tested.unfit(t), model, units)
            for t in sorted(trials, key=lambda t: -t.evidence)
        ),
        *(_not_fitted(b.effects, decision) for b in sorted(tested.behind, key=lambda b: b.nats)),
        *(_not_fitted(c.effects, decision, c.share or 0.0) for c in left_out),
    )
    winner = reached.winner if decision.winner != GIVEN else refitted
    refit = {
        p: _estimate(winner, p, model, units) for p in model.entries() if any(u.path == p for u in winner.unknowns)
    }
    between = [] if decision.verdict == "consistent" else differences(winner)
    differ = [_in_each(one, _unit(winner.structure, one.path, units)) for one in between]
    said = [
        *tested.unfinished.notes,
        *(note for n in records for note in n.notes),
        *how_run(records[0]),
        *zeros(records[0]),
        *memories(records[0]),
        *differ,
        *unsteady(winner, problem),
    ]
    notes = tuple(dict.fromkeys(said))
    noise = {f"{kind} {j}": float(s) for n in records[:1] for (kind, j), s in zip(n.channels, n.floor, strict=True)}
    smallest = _detectable(tested.seen, units)
    shape = shape_of(missing) if decision.verdict in ("undecided", "unnamed") else None
    record, period, shaped = records[0].record, records[0].period, decision.verdict != "consistent"
    drawn = Drawn(missing, runs, reached.term, record, period, with_shape=shaped)
    sentence, advice = _words(reached, findings, gain, shape, differ, imposed=records[0].path is not None)
    told = {
        "jfsm": _version(),
        "verdict": decision.verdict,
        "finished": not tested.unfinished.notes,
        "untried": list(tested.unfinished.untried),
        "sentence": sentence,
        "advice": advice,
        "record": _record(records),
        "model": model.describe(units),
        "extended": extended.describe(units),
        "findings": [as_plain(f, lossless=False) for f in findings],
        "candidates": [as_plain(c, lossless=False) for c in candidates],
        "refitted": {p: {"given": model.values()[p], **as_plain(e, lossless=False)} for p, e in refit.items()},
        "between_records": {one.path: [list(interval) for interval in one.intervals] for one in between},
        "gain": None if gain is None else _gain(gain),
        "notes": list(notes),
        "detectable": {c: s.plain for c, s in smallest.items()},
        "decision": decision.plain,
        "evidence": reached.evidence.plain,
    }
    return Diagnosis(
        verdict=decision.verdict, findings=findings, candidates=candidates, extended=extended, refitted=refit,
        gain=gain, detectable={c: s.size for c, s in smallest.items()}, noise=noise, notes=notes,
        sentence=sentence, advice=advice, told=told, drawn=drawn, leading=leading,
        decision=decision, finished=not tested.unfinished.notes, untried=tested.unfinished.untried,
    )  # fmt: skip


def _version() -> str:
    try:
        return version("jfsm")
    except PackageNotFoundError:  # run from a source tree that is not installed
        return "unknown"


def _unit(structure: Structure, path: str, units) -> str:
    return structure.entries()[path][0].unit(units["force"], units["displacement"])


class _Shown(NamedTuple):
    """An effect of the smallest size: its place, the name of the number that is its size, and all its numbers."""

    at: tuple
    name: str
    effect: dict[str, Estimate]

    @property
    def size(self) -> Estimate:
        size = abs(self.effect[self.name].value)
        return Estimate(size, size, size, self.effect[self.name].unit)

    @property
    def plain(self) -> dict[str, Any]:
        effect = {name: {"value": e.value, "unit": e.unit} for name, e in self.effect.items()}
        size = {"parameter": self.name, "value": self.size.value, "unit": self.size.unit}
        return size | {"at": list(self.at), "effect": effect}


def _detectable(seen: list[Smallest], units) -> dict[str, _Shown]:
    """The smallest size of every cause, at the place where it would have shown first."""
    found: dict[str, Smallest] = {}
    for smallest in seen:
        cause = names(smallest.effects)
        if cause not in found or smallest.size < found[cause].size:
            found[cause] = smallest
    return {cause: _shown(smallest, units) for cause, smallest in found.items()}


def _shown(smallest: Smallest, units) -> _Shown:
    effect = {
        _name(path): Estimate(value, value, value, _unit(smallest.structure, path, units))
        for path, value in smallest.numbers.items()
    }
    return _Shown(places(smallest.effects), _name(smallest.path), effect)


def _name(path: str) -> str:
    """The number's own name, of a second term of one law as well."""
    return path.split(".")[-1].split("#")[0]


def _estimate(t: Trial, path: str, model: Structure, units) -> Estimate:
    value, low, high = t.interval(path)
    return Estimate(value, low, high, _unit(t.structure, path, units))


def _values(t: Trial, which: int, model: Structure, units) -> dict[str, Estimate]:
    """Values of one of a trial's effects, by name."""
    own, part = set(model.entries()), t.parts[which]
    paths = [u.path for u in t.unknowns if u.path.startswith(f"{part.kind}@{part.place}.") and u.path not in own]
    return {_name(p): _estimate(t, p, model, units) for p in paths}


def _all_values(t: Trial, model: Structure, units) -> dict[str, Estimate]:
    """Values of all effects of a trial; of several, each with its cause before its name."""
    if len(t.effects) == 1:
        return _values(t, 0, model, units)
    named = [(effect.cause.id, _values(t, i, model, units)) for i, effect in enumerate(t.effects)]
    return {f"{cause}.{name}": estimate for cause, values in named for name, estimate in values.items()}


def _findings(reached: Reached, trials: list[Trial], model: Structure, nuisances: Nuisances) -> tuple[Finding, ...]:
    decision, winner, units = reached.decision, reached.winner, nuisances.record.units
    if decision.verdict == "cause" and winner.effects:
        found = [_finding(which, reached, trials, model, nuisances) for which in range(len(winner.effects))]
        return tuple(sorted(found, key=lambda f: -f.probability))
    if decision.verdict == "parameters":
        return _wrong_values(winner, decision.probability(winner.key), model, units)
    return ()


def _finding(which: int, reached: Reached, trials: list[Trial], model: Structure, nuisances: Nuisances) -> Finding:
    """One effect of the winner; its rivals are what it may be instead, the winner's other effects aside."""
    winner = reached.winner
    effect = winner.effects[which]
    peak = nuisances.crest * nuisances.length

    def kind_of(t: Trial, which: int) -> str:
        return class_of(t.effects[which].cause, t.parts[which], peak, peak * nuisances.omega)

    kind, probability, alike, akin, instead = kind_of(winner, which), 0.0, 0.0, 0.0, dict[Effect, float]()
    for t in trials:
        share = reached.decision.probability(t.key)
        rest = set(t.effects) - set(winner.effects)
        if effect in t.effects:
            probability += share
        elif len(rest) == 1:
            rival = rest.pop()
            instead[rival] = instead.get(rival, 0.0) + share
            if share > 0 and rival.at == effect.at:
                alike += share if kind_of(t, t.effects.index(rival)) == kind else 0.0
                akin += share if rival.cause.family == effect.cause.family else 0.0
    ranked = sorted(instead.items(), key=lambda item: -item[1])
    rivals = tuple(Rival(r.cause.id, r.at, share) for r, share in ranked if share > RIVAL)
    cause, values = effect.cause, _values(winner, which, model, nuisances.record.units)
    if probability + alike < 0.5 and akin > alike + RIVAL and cause.family in WIDER:
        kind, alike = WIDER[cause.family], akin
    return Finding(
        cause.id, cause.family, effect.at, probability, values, rivals, cause.sentence, kind, probability + alike
    )


def _wrong_values(t: Trial, probability: float, model: Structure, units) -> tuple[Finding, ...]:
    """Own values that moved by more than their error and than a third of what they are trusted to."""
    found = []
    apart = {one.path for one in differences(t)}
    for k, u in enumerate(t.unknowns):
        if u.path not in model.entries() or is_offset(u.path) or u.record not in (None, 0):
            continue
        moved, sd = abs(t.theta[k] - u.center), math.sqrt(max(t.covariance[k, k], 0.0))
        kind, place = u.path.split(".")[0].split("@")
        if kind in PARAMETER_CAUSES and (u.path in apart or (moved > 3 * sd and moved > u.width / 3)):
            at = tuple(int(p) for p in place.split("-"))
            name = u.path.split(".")[-1] if "." in u.path else "mass"
            sentence = f"{kind} is off: stated {model.values()[u.path]:.6g}, found {t.interval(u.path)[0]:.6g}"
            found.append(
                (
                    moved / u.width,
                    Finding(
                        PARAMETER_CAUSES[kind],
                        "parameters",
                        at,
                        probability,
                        {name: _estimate(t, u.path, model, units)},
                        (),
                        sentence,
                        "a wrong value",
                        probability,
                    ),
                )
            )
    return tuple(f for _, f in sorted(found, key=lambda item: -item[0]))


def _candidate(
    t: Trial, decision: Decision, refitted: Trial, unfit: float | None, model: Structure, units
) -> CandidateResult:
    error = np.sqrt(t.prediction.error)
    names = ["training", "holdout"] if error.size == 2 else [f"set {i + 1}" for i in range(error.size)]
    why = decision.reasons.get(t.key, "") or ("named" if t.key == decision.winner else "")
    return CandidateResult(
        t.name, t.at, t.evidence - refitted.evidence, {n: float(e) for n, e in zip(names, error, strict=True)},
        decision.explained.get(t.key, 0.0), decision.probability(t.key), _all_values(t, model, units), why,
        t.prediction.left(), t.whiteness, unfit,
    )  # fmt: skip


def _not_fitted(effects: Sequence[Effect], decision: Decision, share: float = 0.0) -> CandidateResult:
    """A candidate that was not fitted to its end; the `share` of the missing force that it explains stands for κ."""
    why = decision.reasons[key_of(effects)]
    return CandidateResult(names(effects), places(effects), -math.inf, {}, share, 0.0, {}, why)


def _words(
    reached: Reached,
    findings: tuple[Finding, ...],
    gain: Gain | None,
    shape: Shape | None,
    differ: list[str],
    *,
    imposed: bool,
) -> tuple[str, str]:
    decision, winner = reached.decision, reached.winner
    error = "error of the predicted force" if imposed else "free-run error"
    share = (
        ""
        if gain is None
        else f" The {error} on held-out readings goes from {gain.before:.2%} to {gain.after:.2%} of the signal."
    )
    pays = gain is None or gain.significant
    if decision.verdict == "consistent":
        return "The record shows nothing beyond noise that the model lacks.", "Keep the model as it is."
    if decision.verdict == "parameters":
        what = "; ".join(f.sentence for f in findings) or "its own values moved together"
        use = "Use the refitted values." if pays else _NO_GAIN
        return " ".join([f"The form of the model is right, its values are off: {what}.", *differ]) + share, use
    if decision.verdict == "cause":
        known = dict(causes()) | {e.cause.id: e.cause for e in winner.effects}
        said = " ".join(_said(f, known) for f in findings) + _remainder(winner)
        if decision.near == decision.winner:
            said += " Its shape is not quite that of any law that was tried."
        if not decision.finished:
            said += " The search was not finished: what was not tried may explain it as well."
        use = _GO_ON if not decision.finished else "Use the extended model." if pays else _NO_GAIN
        return " ".join([said, *differ]) + share, use
    if decision.verdict == "unnamed":
        looks = "" if shape is None else f" {shape.words}"
        return (
            f"A real effect is there that no catalogue entry explains; a map stands in.{looks}{share}",
            "Look at the map's shape; record a second run with another amplitude.",
        )
    if not decision.finished:
        return "The search was ended before it was finished, and nothing that was tried until then is found.", _GO_ON
    more = "measure the velocity beside the displacement" if imposed else "measure the missing channels"
    return (
        f"Something is wrong beyond noise, and this record cannot tell what. {stopping_line(decision.plain)}".strip(),
        f"Record a second run with another amplitude, or {more}.",
    )


def _in_each(difference: Difference, unit: str) -> str:
    """What differs between records, and what it is in each."""
    told = enumerate(difference.intervals, start=1)
    each = [f"{value:.4g} [{low:.4g}, {high:.4g}] in record {i}" for i, (value, low, high) in told]
    return f"Records differ: {difference.path} [{unit}] is {', '.join(each)}."


def _remainder(winner: Trial) -> str:
    """That what was named does not explain everything, where so."""
    left = winner.prediction.left()
    if left < THRESHOLDS.negligible:
        return ""
    return f" Something is left beyond {'them' if len(winner.effects) > 1 else 'it'}: {left:.1%} of the signal."


def _said(finding: Finding, known: Mapping[str, Cause]) -> str:
    """A finding as a sentence; where its name is open, its class comes first, and then the names that it may have."""
    cause, where = known[finding.cause], "-".join(map(str, finding.at))
    lacks = "The record shows" if cause.is_sensor else "The model lacks"
    others = [(known[r.cause].label, r.probability) for r in finding.rivals if r.cause in known]
    if finding.probability < _SURE and finding.kind_probability - finding.probability > RIVAL:
        listed = ", ".join(f"{name} ({chance:.0%})" for name, chance in [(cause.label, finding.probability), *others])
        return f"{lacks} {finding.kind} at {where} ({finding.kind_probability:.0%}); its law is open: {listed}."
    said = f"{lacks} {cause.label} at {where}: {finding.sentence}."
    if finding.probability >= 0.5 or not finding.rivals:
        return said
    return f"{said} By this record it may as well be {' or '.join(dict(others))}."


def _record(records: Sequence[Nuisances]) -> dict[str, Any]:
    first = records[0]
    record = first.record
    channels = [
        {"name": f"{kind} {j}", "unit": record.units[kind], "rms": float(s), "noise": float(f)}
        for (kind, j), s, f in zip(first.channels, first.spread, first.floor, strict=True)
    ]
    return {
        "name": record.name,
        "samples": sum(n.samples for n in records),
        "sample_rate": 1 / record.dt,
        "duration": record.duration,
        "channels": channels,
    }


def _gain(gain: Gain) -> dict[str, Any]:
    channels = {}
    for name, c in gain.channels.items():
        row = {"unit": c.unit, "closed": c.closed}
        for key in ("before", "refitted", "after", "floor"):
            row[key], row[f"{key}_nrmse"] = getattr(c, key), getattr(c, key) / c.spread
        channels[name] = row
    return {
        "closed": gain.closed,
        "interval": list(gain.interval),
        "significant": gain.significant,
        "before": gain.before,
        "refitted": gain.refitted,
        "after": gain.after,
        "floor": gain.floor,
        "channels": channels,
    }


def _holdout(runs: list[dict]) -> dict[str, Any] | None:
    if not runs:
        return None
    record, before, after = (runs[0][k] for k in ("record", "before", "after"))
    take = slice(0, _SHOWN)
    channels = {
        f"{c[0]} {c[1]}": {
            "unit": record.units[c[0]],
            "measured": _list(y[take]),
            "before": _list(before[c][take]),
            "after": _list(after[c][take]),
        }
        for c, y in record.answers.items()
    }
    return {"time": _list(record.time[take]), "channels": channels}


def _list(values) -> list:
    return [float(v) if math.isfinite(v) else None for v in np.asarray(values).ravel()]
