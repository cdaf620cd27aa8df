"""Does `jfsm.fit` find the right values of every law, from a start that knows nothing, and are its intervals honest?

    python benchmarks/fitting.py --n 20 --seed 1 --jobs 2 --out fitting.jsonl [--causes bouc_wen jenkins ...]

For every cause, records are drawn from plants with that law (SciPy, 1 % noise on every channel). The fit begins at the
owner's model with the law at one of its natural shapes, drawn at random and of a third of the elastic force. It counts
as converged when it ends no lower than a fit that begins with the law's true numbers does, or at the same numbers (the
two may leave out different readings as spikes). One line of JSON per record is appended as it is done; the same call
goes on where it was stopped.
"""

import argparse
import concurrent.futures
import math
import multiprocessing
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np  # noqa: E402  (needs the line above when run as a script)

from benchmarks.rows import ONE_CORE, Row, keep, kept  # noqa: E402
from tests.blind import Challenge, draw  # noqa: E402

NOT_FITTED = ("none", "stiffness_value", "damping_value", "mass_value", "clipping")
BEHIND = 1.0
"""Nats that a converged fit may end below the one from the true numbers."""

APART = 0.5
"""Standard errors between the two fits up to which they are at one top."""

_COMPILING: list[float] = []
"""Seconds that this process has traced and compiled, once it counts them."""


def _count(event: str, duration_secs: float, **_: Any) -> None:
    if event.startswith("/jax/core/compile/"):
        _COMPILING[0] += duration_secs


def examine(cause: str, seed: int, noise: float, excitations: Sequence[str]) -> Row:
    """One record fitted from nowhere and from the law's true numbers."""
    import jax  # only in the workers, whose environment is settled before it is loaded

    jax.config.update("jax_enable_x64", True)
    import jax.monitoring

    import jfsm

    if not _COMPILING:
        jax.monitoring.register_event_duration_secs_listener(_count)
        _COMPILING.append(0.0)

    challenge = _draw(cause, seed, noise, excitations)
    record = jfsm.Record(time=challenge.time, **challenge.channels, units=challenge.units, at_rest=challenge.at_rest)  # pyright: ignore[reportArgumentType]
    row: Row = {"cause": cause, "seed": seed, "noise": noise, "excitation": challenge.excitation}
    row["channel_set"] = challenge.channel_set
    own = challenge.model
    believed = jfsm.Structure.sdof(own.mass, own.stiffness, own.damping)
    entry = jfsm.causes()[cause]
    numbers = {p.name: challenge.parameters[p.name] for p in entry.effect.parameters}
    start = (
        {p.name: 0.0 for p in entry.effect.parameters}
        if entry.is_sensor
        else _shape(record, believed, entry, seed, numbers)
    )
    names = [p.name for p in entry.effect.parameters if p.free]
    place = "-".join(map(str, challenge.at))
    try:
        begin, before = time.perf_counter(), _COMPILING[0]
        found = jfsm.fit(believed + entry.effect(**start, at=challenge.at), record)
        row["compile"] = _COMPILING[0] - before
        row["seconds"] = time.perf_counter() - begin - row["compile"]
        best = jfsm.fit(believed + entry.effect(**numbers, at=challenge.at), record)
    except Exception as problem:  # one failed fit must not end the examination; the table lists it
        return row | {"error": f"{type(problem).__name__}: {problem}"[:300]}
    row["behind"] = best.log_likelihood - found.log_likelihood
    row["result"] = str(found.result)
    names_of = {name: f"{entry.effect.kind}@{place}.{name}" for name in names}
    errors = {path: np.ptp(found.intervals[path]) / (2 * 1.96) for path in names_of.values()}
    row["apart"] = float(max(abs(found.values[p] - best.values[p]) / max(s, 1e-300) for p, s in errors.items()))
    row["values"] = {
        name: {
            "truth": numbers[name],
            "value": found.values[path],
            "interval": found.intervals[path],
        }
        for name, path in names_of.items()
    }
    return row


def _draw(cause: str, seed: int, noise: float, excitations: Sequence[str]) -> Challenge:
    last: Exception | None = None
    for attempt in range(20):  # some causes cannot be told from some records, or not every draw is a fair question
        try:
            return draw(seed + 100_000 * attempt, causes=cause, noise=noise, channels="xva", excitation=excitations)
        except RuntimeError as problem:
            last = problem
    raise RuntimeError(f"no fair record with {cause}: {last}")


def _shape(record: Any, model: Any, entry: Any, seed: int, numbers: dict[str, float]) -> dict[str, float]:
    """A natural shape of the law, drawn; a side, an origin of time and the sign of a size are the truth's."""
    from jfsm.identification import prepare, scale_of

    shapes = entry.effect.shapes(scale_of(prepare(record, model), model))
    shape = dict(shapes[np.random.default_rng(seed).integers(len(shapes))])
    for p in entry.effect.parameters:
        if not p.free:
            shape[p.name] = numbers[p.name]
        elif p.force:
            shape[p.name] *= 0.3
    first = entry.effect.parameters[0].name
    shape[first] = math.copysign(shape[first], numbers[first])
    return shape


def converged(row: Row) -> bool:
    return "error" not in row and (row["behind"] < BEHIND or row["apart"] < APART)


def covered(row: Row) -> list[bool]:
    found = []
    for name, value in row["values"].items():
        low, high = value["interval"]
        truth = value["truth"]
        if name == "phase":  # one turn more is the same
            truth += 2 * math.pi * round(((low + high) / 2 - truth) / (2 * math.pi))
        found.append(bool(low <= truth <= high))
    return found


def table(rows: Sequence[Row]) -> str:
    lines = [f"{'cause':22s} fits  converged  intervals that cover   run (median), compile (largest) [s]"]
    total = [0, 0, 0, 0]
    for cause in dict.fromkeys(row["cause"] for row in rows):
        mine = [row for row in rows if row["cause"] == cause]
        good = [row for row in mine if "error" not in row]
        arrived = [row for row in good if converged(row)]
        inside = [c for row in arrived for c in covered(row)]
        run = np.median([row["seconds"] for row in good]) if good else math.nan
        compiling = max((row["compile"] for row in good), default=math.nan)
        lines.append(
            f"{cause:22s} {len(mine):4d}  {len(arrived):4d} {len(arrived) / len(mine):5.0%}  "
            f"{sum(inside):5d} of {len(inside):4d}            {run:8.1f} {compiling:8.1f}"
        )
        total = [a + b for a, b in zip(total, (len(mine), len(arrived), sum(inside), len(inside)), strict=True)]
    share = total[2] / total[3] if total[3] else math.nan
    lines.append(
        f"{'all':22s} {total[0]:4d}  {total[1]:4d} {total[1] / total[0]:5.0%}  {total[2]} of {total[3]} = {share:.1%}"
    )
    lines += [f"  failed: {row['cause']} {row['seed']}: {row['error']}" for row in rows if "error" in row]
    return "\n".join(lines)


def main() -> None:
    from tests.blind import CAUSES
    from tests.blind.drives import DRIVES

    known = [cause for cause in CAUSES if cause not in NOT_FITTED]
    parser = argparse.ArgumentParser(description="Convergence and coverage of jfsm.fit for every cause.")
    parser.add_argument("--n", type=int, default=6, help="records per cause")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--noise", type=float, default=0.01)
    parser.add_argument("--causes", nargs="+", default=known, choices=known, metavar="ID")
    parser.add_argument("--excitation", nargs="+", default=list(DRIVES), choices=list(DRIVES))
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    rows = kept(given.out)
    done = {(row["cause"], row["seed"]) for row in rows}
    wanted = [(c, s) for s in range(given.seed, given.seed + given.n) for c in given.causes if (c, s) not in done]
    os.environ.update(ONE_CORE)  # spawned processes inherit it
    context = multiprocessing.get_context("spawn")
    pool = concurrent.futures.ProcessPoolExecutor(given.jobs, mp_context=context)
    try:
        waiting = [pool.submit(examine, c, s, given.noise, tuple(given.excitation)) for c, s in wanted]
        for count, future in enumerate(concurrent.futures.as_completed(waiting), 1):
            row = future.result()
            rows.append(row)
            keep(row, given.out)
            words = (
                row.get("error") or f"behind {row['behind']:.2f}, {sum(covered(row))} of {len(covered(row))} covered"
            )
            print(
                f"[{count}/{len(wanted)}] {row['cause']} {row['seed']}: {words}  {row.get('seconds', 0):.1f} s",
                flush=True,
            )
    except KeyboardInterrupt:
        print("stopped; what is done is kept")
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
    if rows:
        print("\n" + table(rows))


if __name__ == "__main__":
    main()
