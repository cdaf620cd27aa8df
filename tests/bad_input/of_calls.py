"""Arguments of the public functions that are of the wrong type, out of range, swapped, or do not go together."""

# pyright: reportArgumentType=false, reportCallIssue=false
# Wrong types are what is tried.

from typing import Any

import jax
import numpy as np

import jfsm

from .rows import FORCE, MOTION, NAN, READINGS, STATES, Row, Stage, T, passes, record, refused, right, spoilt

VOLTS = {"force": "V", "displacement": "V"}


def _diagnose(s: Stage, record: Any = ..., model: Any = ..., **given: Any) -> Any:
    return jfsm.diagnose(s.record if record is ... else record, s.model if model is ... else model, **given)


def _fit(s: Stage, model: Any = ..., record: Any = ..., **given: Any) -> Any:
    return jfsm.fit(s.model if model is ... else model, s.record if record is ... else record, **given)


def _run(s: Stage, model: Any = ..., record: Any = ..., **given: Any) -> Any:
    return jfsm.simulate(s.model if model is ... else model, s.record if record is ... else record, **given)


def _many(s: Stage, records: Any = ..., model: Any = ..., **given: Any) -> Any:
    given = {"out": s.folder / "out", "holdout": 0.3, **given}
    return jfsm.diagnose_many([s.record] if records is ... else records, s.model if model is ... else model, **given)


def _other(**given: Any) -> jfsm.Record:
    """Another run of the test."""
    return record(**{"force": 1.1 * FORCE + 0.01, "displacement": 0.9 * MOTION[::-1].copy(), **given})


NO_RECORD, NO_MODEL = (
    r"`record` must be a jfsm\.Record; got {}\.",
    r"`model` must be a structure, such as .*, or a simulation; got {}\.",
)
LOAD, READ = (
    r" Load the file first: jfsm\.Structure\.load\('m\.toml'\)",
    r" Read the file first: jfsm\.read\('r\.csv', \.\.\.\)",
)

# Of the functions that take a record and a model: (name, call with both).
PAIRS: dict[str, Any] = {
    "diagnose": lambda s, record=..., model=...: _diagnose(s, record, model),
    "fit": lambda s, record=..., model=...: _fit(s, model, record),
    "simulate": lambda s, record=..., model=...: _run(s, model, record),
    "estimate_motion": lambda s, record=..., model=...: jfsm.estimate_motion(s.record if record is ... else record, s.model if model is ... else model),
    "map_force": lambda s, record=..., model=...: jfsm.map_force(s.record if record is ... else record, s.model if model is ... else model),
    "restoring_force": lambda s, record=..., model=...: jfsm.restoring_force(s.record if record is ... else record, s.model if model is ... else model),
}  # fmt: skip


def _of_pair(name: str, call: Any) -> list[Row]:
    """What every function refuses that takes a record and a model."""
    rows = [
        refused(f"{name}: a path for the record", lambda s: call(s, record="r.csv"), NO_RECORD.format("str") + READ, TypeError),
        refused(f"{name}: nothing for the record", lambda s: call(s, record=None), NO_RECORD.format("nothing") + " Make one of arrays", TypeError),
        refused(f"{name}: an array for the record", lambda s: call(s, record=3.0), NO_RECORD.format("float"), TypeError),
        refused(f"{name}: a path for the model", lambda s: call(s, model="m.toml"), NO_MODEL.format("'m.toml'") + LOAD, TypeError),
        refused(f"{name}: a number for the model", lambda s: call(s, model=9.0), NO_MODEL.format("9.0"), TypeError),
        refused(f"{name}: another degree of freedom", lambda s: call(s, record=record(force={2: FORCE}, displacement={2: MOTION})), r"`record` names degree of freedom 2; the structure has 1"),
    ]  # fmt: skip
    if name != "restoring_force":
        rows.append(refused(f"{name}: swapped", lambda s: call(s, record=s.model, model=s.record), r"The arguments are the wrong way round: write jfsm\.", TypeError))  # fmt: skip
    return rows


HELD = r"`holdout` must"

ROWS: list[Row] = [
    *(row for name, call in PAIRS.items() for row in _of_pair(name, call)),
    # diagnose
    passes("diagnose: all in order", _diagnose),
    passes("diagnose: a cause without a list", lambda s: _diagnose(s, causes="coulomb")),
    passes("diagnose: a key of the old kind", lambda s: _diagnose(s, key=jax.random.PRNGKey(0))),
    passes("diagnose: another run held out", lambda s: _diagnose(s, holdout=_other())),
    passes("diagnose: another rate held out", lambda s: _diagnose(s, holdout=_other(time=2 * T))),
    refused("diagnose: no records", lambda s: _diagnose(s, []), r"`record` must hold at least one record; the sequence is empty"),
    refused("diagnose: a number among records", lambda s: _diagnose(s, [s.record, 3]), NO_RECORD.format("int"), TypeError),
    refused("diagnose: a record twice", lambda s: _diagnose(s, [s.record, s.record]), r"`record` must hold runs that differ; record 2 holds readings of record 1, which would count twice\. Leave one"),
    refused("diagnose: parts that overlap", lambda s: _diagnose(s, [s.record[:300], s.record[200:]]), r"record 2 holds readings of record 1"),
    refused("diagnose: several units", lambda s: _diagnose(s, [s.record, _other(units=VOLTS)]), r"`record` must hold records of one set of units; (force|displacement) is in (N|m) in one and in V in another\. Say"),
    refused("diagnose: no model", lambda s: _diagnose(s, model=None), r"`model` must be the simulation that you believe in"),
    refused("diagnose: masses alone", lambda s: _diagnose(s, model=jfsm.Structure(mass=[1.0])), r"`model` must have a term, such as a spring or a dashpot; it has masses alone\. Add"),
    refused("diagnose: a dead channel", lambda s: _diagnose(s, record(displacement=0 * MOTION)), r"`record` cannot be used: .*displacement 1"),
    refused("diagnose: key=0", lambda s: _diagnose(s, key=0), r"`key` must be a key of jax\.random; got 0\. Write key=jax\.random\.key\(0\)", TypeError),
    refused("diagnose: a text for the key", lambda s: _diagnose(s, key="a"), r"`key` must be a key .*got 'a'", TypeError),
    refused("diagnose: several keys", lambda s: _diagnose(s, key=jax.random.split(jax.random.key(0))), r"`key` must be a key", TypeError),
    refused("diagnose: an unknown cause", lambda s: _diagnose(s, causes=["kulomb"]), r"`causes` must name causes .*got 'kulomb'\. Did you mean coulomb"),
    refused("diagnose: a number for causes", lambda s: _diagnose(s, causes=3), r"`causes` must be a list.*got 3", TypeError),
    refused("diagnose: a number among causes", lambda s: _diagnose(s, causes=[3]), r"`causes` must name causes .*got 3"),
    refused("diagnose: no effects", lambda s: _diagnose(s, max_causes=0), r"`max_causes` must be at least 1, a whole number; got 0"),
    refused("diagnose: a text of effects", lambda s: _diagnose(s, max_causes="2"), r"`max_causes` must be at least 1, a whole number; got '2'"),
    refused("diagnose: half an effect", lambda s: _diagnose(s, max_causes=1.5), r"`max_causes` .*got 1\.5"),
    refused("diagnose: since a text", lambda s: _diagnose(s, since="a"), r"`since` must be one number; it was 'a'", TypeError),
    refused("diagnose: a span of nothing", lambda s: _diagnose(s, since=2, until=1), r"`since` and `until` must keep at least 2"),
    refused("diagnose: places as text", lambda s: _diagnose(s, places="ab"), r"`places` must be a list of links, as \[\(0, 1\)\]; got 'ab'", TypeError),
    refused("diagnose: a place far away", lambda s: _diagnose(s, places=[(0, 5)]), r"`places` must be links .*degrees of freedom 1 to 1; one is \(0, 5\)"),
    refused("diagnose: places without a pair", lambda s: _diagnose(s, places=[0, 1]), r"`places` must be links .*one is 0"),
    refused("diagnose: a spline between samples", lambda s: _diagnose(s, reconstruction="spline"), r"`reconstruction` must be .*linear.*; got 'spline'"),
    refused("diagnose: a path for a run", lambda s: _diagnose(s, simulated="r.csv"), r"`simulated` must be a jfsm\.Record; got str\.", TypeError),
    refused("diagnose: a text for a time", lambda s: _diagnose(s, time_limit="3"), r"`time_limit` must be positive, in seconds; got '3'"),
    refused("diagnose: no time", lambda s: _diagnose(s, time_limit=0), r"`time_limit` must be positive"),
    refused("diagnose: a time of NaN", lambda s: _diagnose(s, time_limit=NAN), r"`time_limit` must be positive, in seconds; got nan"),
    refused("diagnose: progress as text", lambda s: _diagnose(s, progress="yes"), r"`progress` must be a function", TypeError),
    # what is held out
    *(refused(f"hold-out: {share}", lambda s, share=share: _diagnose(s, holdout=share), r"`holdout` as a share must lie between 0 and 1, e\.g\. 0\.3; got") for share in (0.0, 1.0, 2.0, -1, NAN)),
    refused("hold-out: a text", lambda s: _diagnose(s, holdout="0.3"), HELD + r" be a share such as 0\.3, other records, or None; got '0\.3'", TypeError),
    refused("hold-out: a truth", lambda s: _diagnose(s, holdout=True), HELD + r" be a share", TypeError),
    refused("hold-out: no records", lambda s: _diagnose(s, holdout=[]), HELD + r" hold at least one record"),
    refused("hold-out: numbers", lambda s: _diagnose(s, holdout=[3]), HELD + r" be a jfsm\.Record; got int", TypeError),
    refused("hold-out: the record itself", lambda s: _diagnose(s, holdout=s.record), HELD + r" hold readings that are not fitted; its record 1 holds readings of record 1"),
    refused("hold-out: the same readings again", lambda s: _diagnose(s, holdout=[_other(), record()]), HELD + r" hold readings that are not fitted; its record 2"),
    refused("hold-out: a part of the record", lambda s: _diagnose(s, holdout=s.record[250:]), HELD + r" hold readings that are not fitted"),
    refused("hold-out: the record on another clock", lambda s: _diagnose(s, holdout=s.record.shifted(5.0)), HELD + r" hold readings that are not fitted"),
    passes("hold-out: what was cut off", lambda s: _diagnose(s, s.record[:200], holdout=s.record[200:])),
    refused("hold-out: in volts", lambda s: _diagnose(s, holdout=_other(units=VOLTS)), HELD + r" hold records of one set of units"),
    refused("hold-out: without the force", lambda s: _diagnose(s, holdout=_other(force=None)), HELD + r" hold records of the same test; record 1 of it has no force"),
    refused("hold-out: without the response", lambda s: _diagnose(s, holdout=jfsm.Record(T, FORCE, velocity=MOTION)), HELD + r" hold records of the same channels; record 1 of it has none of displacement 1"),
    refused("hold-out: a component test", lambda s: _diagnose(s, holdout=_other(drive="motion")), HELD + r' hold records of the same test; record 1 of it has drive="motion"'),
    refused("hold-out: uneven", lambda s: _diagnose(s, holdout=_other(time=T**1.5 + T)), r"`holdout`, record 1: .*resample"),
    refused("hold-out: a dead channel", lambda s: _diagnose(s, holdout=_other(displacement=0 * MOTION)), r"`holdout` cannot be used: .*displacement 1"),
    # fit
    passes("fit: all in order", _fit),
    passes("fit: one name", lambda s: _fit(s, fixed="mass")),
    refused("fit: no records", lambda s: _fit(s, record=[]), r"`record` must hold at least one record"),
    refused("fit: a record twice", lambda s: _fit(s, record=[s.record, s.record]), r"`record` must hold runs that differ"),
    refused("fit: several units", lambda s: _fit(s, record=[s.record, _other(units=VOLTS)]), r"`record` must hold records of one set of units"),
    refused("fit: a number stays", lambda s: _fit(s, fixed=3), r"`fixed` must be names.*got 3", TypeError),
    refused("fit: nothing stays", lambda s: _fit(s, fixed=["foo"]), r"`fixed` names 'foo', which the structure does not have; it has mass@1"),
    refused("fit: bounds without names", lambda s: _fit(s, bounds=[1, 2]), r"`bounds` must be intervals by name", TypeError),
    refused("fit: bounds of nothing", lambda s: _fit(s, bounds={"foo": (0, 1)}), r"`bounds` names 'foo'"),
    refused("fit: bounds upside down", lambda s: _fit(s, bounds={"mass": (2, 1)}), r"`bounds` of 'mass' must be \(low, high\) with low < high; got \(2, 1\)"),
    refused("fit: one bound", lambda s: _fit(s, bounds={"mass": 3}), r"`bounds` of 'mass' must be .*got 3"),
    refused("fit: bounds as text", lambda s: _fit(s, bounds={"mass": ("a", "b")}), r"`bounds` of 'mass' must be .*got \(a, b\)"),
    refused("fit: a bound of NaN", lambda s: _fit(s, bounds={"mass": (NAN, 1)}), r"`bounds` of 'mass' must be .*got \(nan, 1\)"),
    refused("fit: a spline between samples", lambda s: _fit(s, reconstruction="spline"), r"`reconstruction` must be .*got 'spline'"),
    refused("fit: since a text", lambda s: _fit(s, since="a"), r"`since` must be one number", TypeError),
    # simulate
    *(refused(f"simulate: the solver {solver!r}", lambda s, solver=solver: _run(s, solver=solver), r'`solver` must be "reference" or "grid"; got .*Leave it out') for solver in ("rk45", 3, None)),
    *(refused(f"simulate: a tolerance of {tolerance!r}", lambda s, tolerance=tolerance: _run(s, tolerance=tolerance), r"`tolerance` must be a number from 1e-14 to 0\.01.*Leave it out for 1e-10") for tolerance in (0, -1, NAN, "a", 10.0)),
    refused("simulate: half a start", lambda s: _run(s, initial_state=(0,)), r"`initial_state` must be a pair \(displacement, velocity\); got \(0,\)"),
    refused("simulate: a number as start", lambda s: _run(s, initial_state=0.0), r"`initial_state` must be a pair"),
    refused("simulate: a text as start", lambda s: _run(s, initial_state="ab"), r"`initial_state displacement` must hold real numbers", TypeError),
    refused("simulate: a start of NaN", lambda s: _run(s, initial_state=(NAN, 0)), r"`initial_state displacement` must be finite"),
    refused("simulate: a start of two masses", lambda s: _run(s, initial_state=([0, 1], [0, 1])), r"`initial_state` displacement must have one value per degree of freedom \(1\); got 2"),
    *(refused(f"simulate: a window of {window!r}", lambda s, window=window: _run(s, window=window), r"`window` must be a whole number of samples from 2 on; got .*Leave it out for 50") for window in (0, -1, "a", 1.5)),
    refused("simulate: a spline between samples", lambda s: _run(s, reconstruction="spline"), r"`reconstruction` must be .*got 'spline'"),
    refused("simulate: a short force", lambda s: _run(s, force=FORCE[:-1]), r"`force` must have one row per sample .*got \(399, 1\)"),
    refused("simulate: a force as text", lambda s: _run(s, force="a"), r"`force` must hold real numbers", TypeError),
    refused("simulate: a force with NaN", lambda s: _run(s, force=spoilt(FORCE, 0, NAN)), r"`force` must be finite"),
    refused("simulate_many: no models", lambda s: jfsm.simulate_many([], s.record), r"`models` must hold at least one structure"),
    refused("simulate_many: a path", lambda s: jfsm.simulate_many("m.toml", s.record), r"`models` must be a structure.*got 'm\.toml'", TypeError),
    refused("simulate_many: half a step", lambda s: jfsm.simulate_many(s.model, s.record, substeps=0.5), r"`substeps` must be at least 1, a whole number; got 0\.5"),
    # what a model does
    *(refused(f"{name}: {given!r}", lambda s, name=name, given=given: getattr(jfsm, name)(given), NO_MODEL.format(".*"), TypeError) for name in ("fixed_points", "limit_cycles", "linearise") for given in ("m.toml", None, 3)),
    refused("linearise: another state", lambda s: jfsm.linearise(s.model, [1.0]), r"`state` must hold 1 displacements, then 1 velocities; got 1 values"),
    # motion and maps
    refused("estimate_motion: no response", lambda s: jfsm.estimate_motion(jfsm.Record(T, FORCE)), r"`record` must hold a response"),
    refused("estimate_motion: a few samples", lambda s: jfsm.estimate_motion(s.record[:20]), r"`record` must hold at least 32 samples; it has 20"),
    refused("estimate_motion: places as text", lambda s: jfsm.estimate_motion(s.record, s.model, places="ab"), r"`places` must be a list of links", TypeError),
    refused("map_force: neither model nor mass", lambda s: jfsm.map_force(s.record), r"`model` or `mass` must be given, and not both"),
    refused("map_force: an unknown method", lambda s: jfsm.map_force(s.record, s.model, method="foo"), r'`method` must be "rkpm", "kriging" or "joint"; got \'foo\''),
    refused("map_force: a negative mass", lambda s: jfsm.map_force(s.record, mass=-1), r"`mass` must be positive; got -1"),
    refused("map_force: a mass as text", lambda s: jfsm.map_force(s.record, mass="a"), r"A parameter must be a real number; got 'a'", TypeError),
    refused("map_force: an order as text", lambda s: jfsm.map_force(s.record, s.model, order="a"), r"`order` must be an integer of 1 or more; got 'a'"),
    refused("map_force: a link far away", lambda s: jfsm.map_force(s.record, s.model, at=(0, 5)), r"`places` must be links .*one is \(0, 5\)"),
    *(row for fit in (jfsm.RKPM.fit, jfsm.Kriging.fit) for row in (
        refused(f"{fit.__qualname__}: no states", lambda s, fit=fit: fit(None, READINGS), r"`states` must hold real numbers", TypeError),
        refused(f"{fit.__qualname__}: states as text", lambda s, fit=fit: fit("a", READINGS), r"`states` must hold real numbers", TypeError),
        refused(f"{fit.__qualname__}: swapped", lambda s, fit=fit: fit(READINGS, STATES), r"`states` must have 2 axes; got shape \(60,\)"),
        refused(f"{fit.__qualname__}: too few forces", lambda s, fit=fit: fit(STATES, READINGS[:-1]), r"`force` must have one row per state"),
        refused(f"{fit.__qualname__}: NaN", lambda s, fit=fit: fit(STATES * NAN, READINGS), r"`states` must be finite; 120 of 120"),
        refused(f"{fit.__qualname__}: no readings", lambda s, fit=fit: fit(np.zeros((0, 2)), np.zeros(0)), r"`states` must hold .*got 0\. Add data"),
        refused(f"{fit.__qualname__}: one reading", lambda s, fit=fit: fit(np.zeros((1, 2)), np.zeros(1)), r"`states` must hold .*got 1\. Add data"),
        refused(f"{fit.__qualname__}: no columns", lambda s, fit=fit: fit(np.zeros((60, 0)), READINGS), r"`states` must have at least one column"),
        refused(f"{fit.__qualname__}: complex", lambda s, fit=fit: fit(STATES + 1j, READINGS), r"`states` must hold real numbers", TypeError),
    )),
    *(refused(f"RKPM: order={order!r}", lambda s, order=order: jfsm.RKPM.fit(STATES, READINGS, order=order), r"`order` must be an integer of 1 or more; got") for order in ("a", -1, 1.5)),
    *(refused(f"RKPM: neighbours={count!r}", lambda s, count=count: jfsm.RKPM.fit(STATES, READINGS, neighbours=count), r"`neighbours` must be an integer from 10 .* to 60") for count in ("a", -1, 0, 10**9)),
    refused("RKPM: a window by name", lambda s: jfsm.RKPM.fit(STATES, READINGS, window="foo"), r"`window` must be a window such as CubicSplineWindow\(\); got 'foo'", TypeError),
    refused("RKPM: robust as text", lambda s: jfsm.RKPM.fit(STATES, READINGS, robust="a"), r"`robust` must be True or False; got 'a'", TypeError),
    *(refused(f"Kriging: correlation={c!r}", lambda s, c=c: jfsm.Kriging.fit(STATES, READINGS, correlation=c), r"`correlation` must be a correlation such as jfsm\.Gaussian\(\)", TypeError) for c in ("foo", 3, jfsm.Gaussian)),
    *(refused(f"Kriging: trend={t!r}", lambda s, t=t: jfsm.Kriging.fit(STATES, READINGS, trend=t), r"`trend` must be one of 'constant'") for t in ("foo", 3, None)),
    *(refused(f"Kriging: nugget={n!r}", lambda s, n=n: jfsm.Kriging.fit(STATES, READINGS, nugget=n), r"`nugget` must be") for n in ("foo", -1, NAN, [1])),
    # fleets
    refused("diagnose_many: no records", lambda s: _many(s, []), r"`records` must hold at least one record; it is empty\. Look"),
    refused("diagnose_many: nothing", lambda s: _many(s, None), r"`records` must be paths or records", TypeError),
    refused("diagnose_many: numbers", lambda s: _many(s, [3]), r"`records` must be paths or records; number 1 is 3", TypeError),
    refused("diagnose_many: swapped", lambda s: _many(s, s.model, [s.record]), r"The arguments are the wrong way round: write jfsm\.diagnose_many", TypeError),
    refused("diagnose_many: a path for the model", lambda s: _many(s, model="m.toml"), NO_MODEL.format("'m.toml'") + LOAD, TypeError),
    refused("diagnose_many: a number for the folder", lambda s: _many(s, out=3), r"`out` must be a path, .*it was 3", TypeError),
    refused("diagnose_many: a text for the executor", lambda s: _many(s, executor="a"), r"`executor` must be an executor .*got 'a'", TypeError),
    refused("diagnose_many: key=0", lambda s: _many(s, key=0), r"`key` must be a key of jax\.random; got 0", TypeError),
    refused("diagnose_many: an unknown cause", lambda s: _many(s, causes=["kulomb"]), r"Did you mean coulomb"),
    refused("diagnose_many: an option of nothing", lambda s: _many(s, holdot=0.3), r"not 'holdot'\. Did you mean holdout", TypeError),
    refused("diagnose_many: a hold-out as text", lambda s: _many(s, holdout="0.3"), HELD + r" be a share", TypeError),
    # what was written
    *(refused(f"Diagnosis.load: {name}", lambda s, text=text: jfsm.Diagnosis.load(s.file("d.json", text)), r"d\.json must be what `jfsm diagnose --json d\.json` writes; .*Write or copy it again") for name, text in {"nothing": "", "a list": "[]", "nested deeply": "[" * 100_000, "objects nested deeply": '{"a":' * 50_000, "a BOM": "\ufeff{}"}.items()),
    refused("Diagnosis.load: a number", lambda s: jfsm.Diagnosis.load(3), r"`path` must be a path", TypeError),
    right("look: one torn sample", lambda s: jfsm.records.look(record(displacement=spoilt(MOTION, 77, 9.9e37))).checks, lambda checks: any(c.name == "no_torn_samples" and not c.passed for c in checks)),
]  # fmt: skip
