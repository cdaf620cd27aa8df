"""Points per second of `jfsm.RKPM`, beside SciPy's local radial basis functions, at equal accuracy.

    python benchmarks/rkpm.py [--nodes 1000 10000 100000 1000000] [--queries 10000] [--out rkpm.json]

Nodes and queries are scattered over a square; the truth is no polynomial. SciPy is
`RBFInterpolator(neighbors=50, kernel="quintic")`. Of several orders and numbers of neighbours ours is the fastest whose
error is no larger. Two tasks: the force alone; force, all first and second derivatives, of two outputs (SciPy: one
call for both outputs at each of the 9 points of central differences). A time is the smallest of `--repeats`, after one
call that compiles; the neighbour search is in it, the fit is not. The map is also timed on one node count against the
next: n log n shows as rates that fall slowly.

The first row is what a user gets who states nothing: `RKPM.fit(states, force, order=3)` of 20 000 nodes and
`evaluate` of the queries, warm after one call, beside `RBFInterpolator(neighbors=40, kernel="cubic", degree=3)` in the
same run. It gives the ratio by the clock and that by CPU seconds (SciPy keeps one core, ours takes all there are), and
what the first call costs.
"""

import argparse
import json
import os
import platform
import sys
import time
from pathlib import Path
from typing import Any

import jax
import numpy as np
import scipy
from scipy.interpolate import RBFInterpolator

jax.config.update("jax_enable_x64", True)
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import jfsm  # noqa: E402  (after double precision is on)

SETTINGS = ((3, 20), (3, 40), (4, 30), (4, 45), (5, 42), (5, 63), (6, 56))
"""Orders and neighbours that are tried."""
VALUE = ((0, 0),)
TWICE = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))


def truth(states: np.ndarray) -> np.ndarray:
    x, v = states.T
    return np.stack([np.tanh(4.0 * x) * np.cos(2.0 * v), np.sin(5.0 * x * v) + v], axis=1)


def seconds(call: Any, repeats: int) -> tuple[float, np.ndarray]:
    """Shortest of several runs, and what the call returns."""
    result = np.asarray(call())
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        np.asarray(call())
        times.append(time.perf_counter() - start)
    return min(times), result


def differences(interpolator: Any, queries: np.ndarray, h: float = 1e-4) -> np.ndarray:
    """Value and derivatives up to the second by central differences, 9 evaluations."""
    at = {(i, j): interpolator(queries + h * np.array([i, j])) for i in (-1, 0, 1) for j in (-1, 0, 1)}
    dx, dv = (at[1, 0] - at[-1, 0]) / (2 * h), (at[0, 1] - at[0, -1]) / (2 * h)
    dxx, dvv = (at[1, 0] - 2 * at[0, 0] + at[-1, 0]) / h**2, (at[0, 1] - 2 * at[0, 0] + at[0, -1]) / h**2
    dxv = (at[1, 1] - at[1, -1] - at[-1, 1] + at[-1, -1]) / (4 * h**2)
    return np.stack([at[0, 0], dx, dv, dxx, dxv, dvv], axis=1)


def rms(error: np.ndarray) -> float:
    return float(np.sqrt(np.mean(error**2)))


def compare(count: int, queries: np.ndarray, repeats: int) -> dict[str, Any]:
    rng = np.random.default_rng(count)
    states = rng.uniform(-1.0, 1.0, (count, 2))
    force, exact = truth(states), truth(queries)
    peer = RBFInterpolator(states, force[:, 0], neighbors=50, kernel="quintic")
    peer_time, found = seconds(lambda: peer(queries), repeats)
    peer_error = rms(found - exact[:, 0])
    peers = RBFInterpolator(states, force, neighbors=50, kernel="quintic")
    peer_all, _ = seconds(lambda: differences(peers, queries), 1)
    ours = []
    for order, neighbours in SETTINGS:
        one = jfsm.RKPM.fit(states, force[:, 0], order, neighbours)
        spent, found = seconds(lambda one=one: one.evaluate_derivatives(queries, VALUE), repeats)
        ours.append((spent, rms(found[:, 0] - exact[:, 0]), order, neighbours))
    equal = [row for row in ours if row[1] <= peer_error] or [min(ours, key=lambda row: row[1])]
    spent, error, order, neighbours = min(equal)
    two = jfsm.RKPM.fit(states, force, order, neighbours)
    all_spent, _ = seconds(lambda: two.evaluate_derivatives(queries, TWICE), repeats)
    return {
        "nodes": count,
        "scipy": {"rate": len(queries) / peer_time, "error": peer_error, "rate_derivatives": len(queries) / peer_all},
        "rkpm": {
            "rate": len(queries) / spent,
            "error": error,
            "order": order,
            "neighbours": neighbours,
            "rate_derivatives": len(queries) / all_spent,
        },
        "as_accurate": error <= peer_error,
        "ratio": peer_time / spent,
        "ratio_derivatives": peer_all / all_spent,
    }


def as_called(queries: np.ndarray, repeats: int, count: int = 20_000) -> dict[str, Any]:
    """Both with their usual settings: rate, CPU seconds and error of each."""
    states = np.random.default_rng(1).uniform(-1.0, 1.0, (count, 2))
    force, exact = truth(states)[:, 0], truth(queries)[:, 0]
    peer = RBFInterpolator(states, force, neighbors=40, kernel="cubic", degree=3)
    ours = jfsm.RKPM.fit(states, force, order=3)
    start = time.perf_counter()
    np.asarray(ours.evaluate(queries))
    row: dict[str, Any] = {"nodes": count, "first_call": time.perf_counter() - start}
    for name, call in (("scipy", lambda: peer(queries)), ("rkpm", lambda: ours.evaluate(queries))):
        spent, found = seconds(call, repeats)
        cpu = min(cpu_seconds(call) for _ in range(repeats))
        row[name] = {"rate": len(queries) / spent, "cpu": cpu, "error": rms(found - exact)}
    row["ratio"] = row["rkpm"]["rate"] / row["scipy"]["rate"]
    row["ratio_cpu"] = row["scipy"]["cpu"] / row["rkpm"]["cpu"]
    row["neighbours"] = ours.rule.neighbours
    return row


def cpu_seconds(call: Any) -> float:
    """CPU seconds of one run on all cores."""
    start = time.process_time()
    np.asarray(call())
    return time.process_time() - start


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--nodes", type=int, nargs="+", default=[1000, 10_000, 100_000, 1_000_000])
    parser.add_argument("--queries", type=int, default=10_000)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    queries = 0.95 * np.random.default_rng(0).uniform(-1.0, 1.0, (options.queries, 2))
    usual = as_called(queries, options.repeats)
    peer, ours = usual["scipy"], usual["rkpm"]
    print(
        f"as called, {usual['nodes']} nodes: scipy {peer['rate']:.0f}/s, error {peer['error']:.1e}; "
        f"rkpm of {usual['neighbours']} neighbours {ours['rate']:.0f}/s, error {ours['error']:.1e}; "
        f"ratio {usual['ratio']:.1f}, by CPU {usual['ratio_cpu']:.1f}; first call {usual['first_call']:.1f} s",
        flush=True,
    )
    print("   nodes   scipy/s    error    rkpm/s    error    p, k  ratio derivatives")
    rows = []
    for count in options.nodes:
        row = compare(count, queries, options.repeats)
        rows.append(row)
        peer, ours = row["scipy"], row["rkpm"]
        print(
            f"{count:8d} {peer['rate']:9.0f} {peer['error']:8.1e} {ours['rate']:9.0f} {ours['error']:8.1e} "
            f"{ours['order']:3d},{ours['neighbours']:3d} {row['ratio']:6.1f} {row['ratio_derivatives']:11.1f}"
            + ("" if row["as_accurate"] else "  less accurate"),
            flush=True,
        )
    if options.out:
        versions = {"python": platform.python_version(), "jax": jax.__version__, "scipy": scipy.__version__}
        machine = {"cpu": platform.processor() or platform.machine(), "cores": os.cpu_count()}
        options.out.write_text(
            json.dumps({"as_called": usual, "rows": rows, "versions": versions, "machine": machine}, indent=1)
        )


if __name__ == "__main__":
    main()
