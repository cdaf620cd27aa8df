"""Whether verdicts on measured rigs and on cases of a file stay what they are under harmless variations.

    python benchmarks/stability.py [RIG | CASE ...] [--variations later ...] [--cases FILE] [--data DIR] [--out FILE]

Each is diagnosed as its owner would bring it, with a linear model, and then with something changed that should not
matter: another unit, window, rate, hold-out, belief or seed. A verdict is the same if it names the same class at the
same place, and its size lies in the interval found before. One line of JSON per run is appended to the file; the same
call goes on where it was stopped. `--cards DIR` keeps what every verdict rests on, for `benchmarks/replay.py`.
"""

import argparse
import functools
import importlib.util
import os
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np

jax.config.update("jax_enable_x64", True)

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import jfsm  # noqa: E402  (after double precision is on)
from benchmarks.cards import asking_widely, keep_card  # noqa: E402  (needs the line above)
from benchmarks.rig_verdicts import RIGS, Rig  # noqa: E402
from benchmarks.rows import ONE_CORE, Row, in_processes, keep, kept  # noqa: E402

SEED = 0
CONFIDENT = 0.9
NOISIER = np.sqrt(1.1**2 - 1.0)
"""Noise to add, in noise floors, so that there is ten per cent more."""
OTHER_UNITS = {"m": "mm", "rad": "deg", "N": "kN", "N m": "kN m", "V": "mV", "m/s": "mm/s", "rad/s": "deg/s"}
OTHER_UNITS |= {"m/s²": "g", "rad/s²": "deg/s^2"}
ROWS_PER_PROCESS = 6
OTHER_BELIEFS = "stiffer", "softer", "half_the_damping", "twice_the_damping"
"""Variations in which a model that was right has a value that is wrong."""


class Setup(NamedTuple):
    """What is diagnosed: records, a model, what is held out, and a seed."""

    record: jfsm.Record | Sequence[jfsm.Record]
    model: jfsm.Structure
    holdout: float | jfsm.Record | Sequence[jfsm.Record] | None
    seed: int = SEED


class NotApplicableError(Exception):
    """A variation that this set-up has no room for."""


def single(setup: Setup) -> jfsm.Record:
    if not isinstance(setup.record, jfsm.Record):
        raise NotApplicableError
    return setup.record


def period(record: jfsm.Record) -> float:
    """Seconds of the strongest frequency of the first response."""
    y = next(iter(record.answers.values()))
    power = np.abs(np.fft.rfft((y - y.mean()) * np.hanning(y.size)))
    return y.size * record.dt / max(int(np.argmax(power[1:])) + 1, 1)


def remade(record: jfsm.Record, columns: Mapping[str, Any], units: Mapping[str, str]) -> jfsm.Record:
    base = record.base_acceleration
    return jfsm.Record(
        record.time, **columns, base_acceleration=base, units=units, at_rest=record.at_rest, drive=record.drive
    )


def columns_of(record: jfsm.Record) -> dict[str, dict[int, np.ndarray]]:
    found: dict[str, dict[int, np.ndarray]] = {}
    for (kind, dof), samples in record.channels.items():
        found.setdefault(kind, {})[dof] = np.asarray(samples)
    return found


def everywhere(change: Callable[[jfsm.Record], jfsm.Record], setup: Setup) -> Setup:
    """The change of a record made to all that are fitted or held out."""

    def of(records):
        if isinstance(records, jfsm.Record):
            return change(records)
        return records if isinstance(records, float) or records is None else [change(one) for one in records]

    return setup._replace(record=of(setup.record), holdout=of(setup.holdout))


def in_other_units(record: jfsm.Record) -> jfsm.Record:
    """The same readings, stated in other units."""
    units, columns = {}, columns_of(record)
    for kind, each in columns.items():
        unit = record.units[kind]
        other = OTHER_UNITS.get(unit, unit)
        one = jfsm.Record(record.time[:2], **{kind: np.ones(2)}, units={kind: other})  # pyright: ignore
        factor = 1.0 / float(np.ravel(getattr(one, kind))[0])
        units[kind] = other
        columns[kind] = {dof: samples * factor for dof, samples in each.items()}
    return remade(record, columns, units)


def noisier(record: jfsm.Record) -> jfsm.Record:
    rng, columns = np.random.default_rng(7), columns_of(record)
    floors = {channel.channel: channel.noise for channel in record.inspect().channels}
    for kind, each in columns.items():
        for dof, samples in each.items():
            each[dof] = samples + NOISIER * (floors[f"{kind} {dof}"] or 0.0) * rng.standard_normal(samples.size)
    return remade(record, columns, record.units)


def without_velocity(record: jfsm.Record) -> jfsm.Record:
    columns = columns_of(record)
    if "velocity" not in columns or "displacement" not in columns:
        raise NotApplicableError
    del columns["velocity"]
    return remade(record, columns, {kind: record.units[kind] for kind in columns})


def with_velocity(record: jfsm.Record) -> jfsm.Record:
    """Velocity as a user would add it: central differences of the displacement."""
    columns = columns_of(record)
    if "velocity" in columns or "displacement" not in columns or record.drive == "motion":
        raise NotApplicableError
    columns["velocity"] = {dof: np.gradient(x, record.time) for dof, x in columns["displacement"].items()}
    return remade(record, columns, record.units)


def reordered(record: jfsm.Record) -> jfsm.Record:
    columns = columns_of(record)
    if len(record.channels) < 3:
        raise NotApplicableError
    swapped = {kind: dict(reversed(each.items())) for kind, each in reversed(columns.items())}
    return remade(record, swapped, record.units)


def window(setup: Setup, begin: float, end: float) -> Setup:
    """The record from so many periods after its start to as many before its end."""
    record = single(setup)
    gap = period(record)
    first, last = record.time[0] + begin * gap, record.time[-1] - end * gap
    cut = record.since(first) if begin else record
    return setup._replace(record=cut.until(last) if end else cut)


def held(setup: Setup, share: float) -> Setup:
    if not isinstance(setup.holdout, float):
        raise NotApplicableError
    return setup._replace(holdout=share)


def first_part(setup: Setup) -> Setup:
    record = single(setup)
    if not isinstance(setup.holdout, float) or not record.driven:
        raise NotApplicableError
    at = record.time[int(setup.holdout * len(record))]
    return setup._replace(record=record.since(at), holdout=record.until(at))


def halves(setup: Setup) -> Setup:
    record = single(setup)
    middle = record.time[len(record) // 2]
    if not record.driven or isinstance(setup.holdout, float):
        raise NotApplicableError
    return setup._replace(record=[record.until(middle), record.since(middle)])


def believing(setup: Setup, kind: str, factor: float) -> Setup:
    values = {path: factor * value for path, value in setup.model.values().items() if path.startswith(f"{kind}@")}
    if not values:
        raise NotApplicableError
    return setup._replace(model=setup.model.with_values(values))


VARIATIONS: dict[str, Callable[[Setup], Setup]] = {
    "as_it_is": lambda setup: setup,
    "other_units": functools.partial(everywhere, in_other_units),
    "a_period_later": functools.partial(window, begin=1.0, end=0.0),
    "a_period_shorter": functools.partial(window, begin=0.0, end=1.0),
    "half_the_rate": functools.partial(everywhere, lambda record: record.resample(record.sample_rate / 2)),
    "holdout_0.25": functools.partial(held, share=0.25),
    "holdout_0.4": functools.partial(held, share=0.4),
    "holdout_first": first_part,
    "stiffer": functools.partial(believing, kind="stiffness", factor=1.05),
    "softer": functools.partial(believing, kind="stiffness", factor=0.95),
    "half_the_damping": functools.partial(believing, kind="damping", factor=0.5),
    "twice_the_damping": functools.partial(believing, kind="damping", factor=2.0),
    "without_velocity": functools.partial(everywhere, without_velocity),
    "with_velocity": functools.partial(everywhere, with_velocity),
    "more_noise": functools.partial(everywhere, noisier),
    "another_key": lambda setup: setup._replace(seed=SEED + 1),
    "in_two": halves,
    "other_order": functools.partial(everywhere, reordered),
}


def of_rig(rig: Rig) -> Setup:
    """What its owner believes, with values fitted to the record, and nothing but springs and dashpots."""
    plain = [term for term in rig.believed.terms if isinstance(term, jfsm.LinearStiffness | jfsm.LinearDamping)]
    loads = [term for term in rig.believed.terms if isinstance(term, jfsm.Preload)]
    model = jfsm.Structure(rig.believed.mass, [*plain, *loads], trust=rig.believed.trust)
    record = rig.record if isinstance(rig.record, jfsm.Record) else rig.record[0]
    return Setup(rig.record, jfsm.fit(model, record).structure, rig.held)


def cases_in(path: Path) -> dict[str, Callable[[], Setup]]:
    spec = importlib.util.spec_from_file_location("cases", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)

    def setup(make) -> Setup:
        case = make()
        return Setup(case.record, case.model, case.holdout)

    return {make.__name__: functools.partial(setup, make) for make in module.CASES}


def examine(name: str, variation: str, data: Path, cases: Path, cards: Path | None) -> Row:
    """The verdict on one rig or case under one variation, as a row."""
    row: Row = {"name": name, "variation": variation}
    setup = of_rig(RIGS[name](data)) if name in RIGS else cases_in(cases)[name]()
    try:
        changed = VARIATIONS[variation](setup)
    except NotApplicableError:
        return row | {"verdict": None}
    began = time.process_time()
    try:
        with asking_widely():
            key = jax.random.key(changed.seed)
            d = jfsm.diagnose(changed.record, changed.model, holdout=changed.holdout, key=key, progress=None)
    except ValueError as error:
        return row | {"verdict": "refused", "sentence": str(error), "findings": []}
    if cards is not None:
        keep_card(cards, f"{name}-{variation}", d, {})
    findings = [
        {name: finding[name] for name in ("cause", "at", "probability", "kind", "kind_probability", "members", "size")}
        for finding in d.told["findings"]
    ]
    stopped = d.decision.stopped_by
    return row | {
        "verdict": d.verdict,
        "sentence": d.sentence,
        "findings": findings,
        "stopped_by": None if stopped is None else stopped.name,
        "seconds": time.process_time() - began,
    }


def same(row: Row, base: Row) -> bool:
    """Whether a verdict is that of the set-up as it is: the same classes at the same places, and sizes as found.

    A model that was consistent has wrong own values once its owner believes another one.
    """
    if base["verdict"] == "consistent" and row["verdict"] == "parameters":
        return row["variation"] in OTHER_BELIEFS
    if row["verdict"] != base["verdict"] or len(row["findings"]) != len(base["findings"]):
        return False
    return all(any(_alike(one, other) for other in row["findings"]) for one in base["findings"])


def _alike(one: Row, other: Row) -> bool:
    together = set(one["members"]) & set(other["members"])
    return one["at"] == other["at"] and (one["kind"] == other["kind"] or bool(together))


def contradicts(row: Row, base: Row) -> bool:
    """Whether two confident names have nothing to do with each other."""
    sure = [[f for f in r["findings"] if f["kind_probability"] > CONFIDENT] for r in (row, base)]
    return bool(sure[0] and sure[1]) and not any(_alike(one, other) for one in sure[0] for other in sure[1])


def table(rows: Sequence[Row]) -> str:
    """How often the verdict stayed, by rig, and what it turned on where it did not."""
    bases = {row["name"]: row for row in rows if row["variation"] == "as_it_is"}
    lines, stayed, asked = [], 0, 0
    for name, base in bases.items():
        others = [r for r in rows if r["name"] == name and r is not base and r["verdict"] is not None]
        turned = [r for r in others if not same(r, base)]
        stayed, asked = stayed + len(others) - len(turned), asked + len(others)
        lines.append(f"{name:24s} {len(others) - len(turned):2d} of {len(others):2d}  {_words(base)}")
        for r in turned:
            mark = "  CONTRADICTS" if contradicts(r, base) else ""
            lines.append(f"    {r['variation']:20s} {_words(r)}  {r.get('stopped_by') or ''}{mark}")
    share = f" = {stayed / asked:.1%}" if asked else ""
    return "\n".join([*lines, f"{stayed} of {asked} verdicts stay{share}"])


def _words(row: Row) -> str:
    named = (f"{f['kind']} {f['kind_probability']:.2f} ({f['cause']} {f['probability']:.2f})" for f in row["findings"])
    return f"{row['verdict']} {'; '.join(named)}".strip()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    shared = Path(__file__).resolve().parents[2] / "shared"
    parser.add_argument("names", nargs="*", default=[*RIGS], metavar="NAME")
    parser.add_argument("--variations", nargs="*", default=[*VARIATIONS], choices=[*VARIATIONS], metavar="VARIATION")
    parser.add_argument("--cases", type=Path, default=shared / "field" / "cases.py")
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("JFSM_DATA", shared / "data")))
    parser.add_argument("--out", type=Path, default=Path("stability.jsonl"))
    parser.add_argument("--cards", type=Path)
    parser.add_argument("--jobs", type=int, default=1)
    given = parser.parse_args()
    rows = kept(given.out)
    done = {(row["name"], row["variation"]) for row in rows}
    asked = [(n, v) for n in given.names for v in given.variations if (n, v) not in done]
    calls = [(name, variation, given.data, given.cases, given.cards) for name, variation in asked]
    for row in in_processes(examine, calls, given.jobs, ROWS_PER_PROCESS, ONE_CORE):
        keep(row, given.out)
        rows.append(row)
        print(f"{row['name']}, {row['variation']}: {row['verdict']}", flush=True)
    print(table(rows))


if __name__ == "__main__":
    main()
