"""Likelihood and time of kriging's search by optimistix beside SciPy's L-BFGS-B, on many kinds of readings.

    python benchmarks/kriging_search.py [--first N] [--repeats 3] [--out kriging_search.json]

Both climb the same likelihood from the same starts between the same bounds, in whole fits of `jfsm.Kriging.fit`; only
the climb differs. `worse` says by how many nats the fit by optimistix ends below the other's likelihood (negative: it
ends above it). Times are processor seconds: `cold` of the first fit, whose programs are not compiled yet, `warm` the
least of several more. The likelihood's program is forgotten before each cold fit, so that neither finds the other's.
Set OPENBLAS_NUM_THREADS=1, lest the waiting of idle threads be counted.
"""

import argparse
import json
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np
from scipy.optimize import minimize

jax.config.update("jax_enable_x64", True)

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import jfsm  # noqa: E402  (after double precision is on)
from jfsm.surrogates._minimise import Minimum, minimise_within  # noqa: E402
from jfsm.surrogates.kriging import search  # noqa: E402


def smooth(x: np.ndarray) -> np.ndarray:
    return np.tanh(3.0 * x[:, 0]) + np.sin(2.0 * x[:, 1]) * np.cos(x[:, 0])


def linear_in_velocity(x: np.ndarray) -> np.ndarray:
    """The length scale of velocity has no end."""
    return np.tanh(3.0 * x[:, 0]) + x[:, 1]


def dry_friction(x: np.ndarray) -> np.ndarray:
    return x[:, 0] + np.sign(x[:, 1])


def stop(x: np.ndarray) -> np.ndarray:
    return x[:, 0] + 5.0 * np.maximum(x[:, 0] - 0.4, 0.0) + 0.2 * x[:, 1]


def wiggly(x: np.ndarray) -> np.ndarray:
    return np.sin(12.0 * x[:, 0]) * np.cos(5.0 * x[:, 1])


def nothing(x: np.ndarray) -> np.ndarray:
    return np.zeros(len(x))


def scattered(n: int, dim: int, seed: int) -> np.ndarray:
    """Columns of unlike size, as displacement and velocity are."""
    return np.random.default_rng(seed).uniform(-1.0, 1.0, (n, dim))


def trajectory(n: int, dim: int, seed: int) -> np.ndarray:
    """Readings along a motion: neighbours in time are neighbours in the state."""
    turn = np.linspace(0.0, 40.0, n)[:, None] * np.array([0.7, 1.9, 3.1])
    turn = turn + np.random.default_rng(seed).uniform(0.0, 6.0, 3)
    position, velocity = np.sum(np.sin(turn), axis=1) / 3.0, np.sum(np.cos(turn), axis=1) / 3.0
    return np.stack([position, velocity], axis=1)[:, :dim]


ALIKE = 1e-3
"""Nats by which two ends may differ and be the same."""


class Case(NamedTuple):
    """One fit."""

    force: Callable[[np.ndarray], np.ndarray]
    noise: float
    """Share of the force's standard deviation (of one where the force is zero)."""
    n: int = 150
    dim: int = 2
    correlation: str = "Gaussian"
    trend: str = "quadratic"
    states: Callable[[int, int, int], np.ndarray] = scattered
    options: tuple[tuple[str, Any], ...] = ()

    @property
    def name(self) -> str:
        kept = " ".join(f"{key}={value}" for key, value in self.options)
        where = "" if self.states is scattered else " " + self.states.__name__
        size = f"{self.force.__name__} {self.noise:g} n={self.n} dim={self.dim}"
        return f"{size} {self.correlation} {self.trend}{where} {kept}"


FORCES = (smooth, linear_in_velocity, dry_friction, stop, wiggly, nothing)
CORRELATIONS = ("Exponential", "PowerExponential", "Matern32", "Matern52", "Linear", "Spherical", "Cubic", "Spline")


def cases() -> Iterator[Case]:
    """Every force with little and much noise, and from there what else may differ."""
    for force in FORCES:
        yield from (Case(force, noise) for noise in (0.0, 0.01, 0.05, 0.3) if noise or force is not nothing)
    for correlation in CORRELATIONS:
        yield Case(smooth, 0.05, correlation=correlation)
        yield Case(dry_friction, 0.02, correlation=correlation)
    for trend in ("constant", "linear", "pure quadratic", "cubic"):
        yield Case(smooth, 0.05, trend=trend)
    for dim in (3, 4, 6):
        yield Case(smooth, 0.02, dim=dim, trend="linear")
        yield Case(linear_in_velocity, 0.1, dim=dim, trend="linear")
    for n in (60, 400, 900):
        yield Case(smooth, 0.05, n=n)
        yield Case(linear_in_velocity, 0.05, n=n)
    for force in (smooth, stop, dry_friction):
        yield Case(force, 0.02, n=300, states=trajectory)
    yield Case(smooth, 0.05, options=(("restricted", True),))
    yield Case(smooth, 0.05, options=(("nugget", 0.01),))
    yield Case(smooth, 0.05, options=(("noise_variance", 0.0025),))
    yield Case(smooth, 0.0, n=60, options=(("nugget", 0.0),))


def by_scipy(function, start, lower, upper, *, unit: float, flat: float, steps: int, known: Any) -> Minimum:
    """The same search by L-BFGS-B."""
    del unit, known
    best = Minimum(start, np.inf)

    def guarded(point: np.ndarray) -> tuple[float, np.ndarray]:
        nonlocal best
        value, gradient = function(point)
        value, gradient = float(value), np.asarray(gradient)
        if not (np.isfinite(value) and np.all(np.isfinite(gradient))):
            return (abs(best.value) + 1.0) * 1e3 if np.isfinite(best.value) else 1e12, np.zeros(len(gradient))
        if value < best.value:
            best = Minimum(point.copy(), value)
        return value, gradient

    bounds = list(zip(lower, upper, strict=True))
    options = {"maxiter": steps, "ftol": 1e-12, "gtol": flat}
    minimize(guarded, start, jac=True, method="L-BFGS-B", bounds=bounds, options=options)
    return best


def counted(climb, evaluations: list[int]):
    """The climb, and how often it asks for the likelihood."""

    def counting(function, *rest, **options):
        def each(point):
            evaluations[0] += 1
            return function(point)

        return climb(each, *rest, **options)

    return counting


def measured(case: Case, repeats: int) -> dict[str, Any]:
    states = case.states(case.n, case.dim, 0)
    force = case.force(states)
    noise = np.random.default_rng(1).normal(size=case.n)
    readings = force + case.noise * (force.std() or 1.0) * noise
    row: dict[str, Any] = {"case": case.name}
    for name, climb in (("scipy", by_scipy), ("optimistix", minimise_within)):
        evaluations = [0]
        search.minimise_within = counted(climb, evaluations)
        jax.clear_caches()
        times = []
        for _ in range(1 + repeats):
            evaluations[0] = 0
            start = time.process_time()
            found = jfsm.Kriging.fit(
                states,
                readings,
                getattr(jfsm, case.correlation)(),
                case.trend,
                **dict(case.options),
            )
            times.append(time.process_time() - start)
        row[name] = {
            "nats": float(found.log_likelihood),
            "cold": times[0],
            "warm": min(times[1:]),
            "evaluations": evaluations[0],
        }
    row["worse"] = row["scipy"]["nats"] - row["optimistix"]["nats"]
    return row


def _ratios(rows: list[dict[str, Any]]) -> dict[str, float]:
    def total(name: str, what: str) -> float:
        return sum(row[name][what] for row in rows)

    return {what: total("optimistix", what) / total("scipy", what) for what in ("cold", "warm", "evaluations")}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, help="only so many cases")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--out", type=Path)
    arguments = parser.parse_args()
    rows = []
    for case in list(cases())[: arguments.first]:
        rows.append(row := measured(case, arguments.repeats))
        sides = [
            f"{name} {row[name]['warm']:.3f} s ({row[name]['cold']:.2f} cold, {row[name]['evaluations']})"
            for name in ("scipy", "optimistix")
        ]
        print(f"{row['worse']:+.1e} nats  {'  '.join(sides)}  {row['case']}", flush=True)
    worst = max(row["worse"] for row in rows)
    print(f"{len(rows)} fits, worst {worst:+.1e} nats")
    alike = [row for row in rows if abs(row["worse"]) < ALIKE]
    totals = {"all": _ratios(rows), f"of {len(alike)} fits that end alike": _ratios(alike)}
    for name, ratios in totals.items():
        print(f"optimistix over scipy, {name}: " + "  ".join(f"{what} {ratio:.2f}" for what, ratio in ratios.items()))
    if arguments.out:
        arguments.out.write_text(json.dumps({"rows": rows, "ratios": totals, "worst": worst}, indent=1))


if __name__ == "__main__":
    main()
