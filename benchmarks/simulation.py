"""How close `jfsm.simulate` comes to the exact motion under every law, and how fast many runs go at once.

    python benchmarks/simulation.py [--causes ID ...] [--out table.json] [--no-accuracy] [--no-throughput]

Accuracy: one mass with 2 % of critical damping, a hundred periods of 50 samples each, driven from rest by twelve lines
between 0.3 and 2.2 times its frequency. The force comes and goes within ten periods at either end, so that what a
reconstruction must guess beyond the record is nothing. The truth is the integrator of `tests/blind`, which locates
every event; for laws that it does not know, SciPy's DOP853 in steps of half a sample. Errors are the largest of
displacement over its rms:

    exact     the truth's own, by a second run at ten times its tolerance; a chaotic motion would show here
    simulate  as called by default, from the force's samples
    known     the same with the force known between its samples: the solver's share of the error
    grid      fixed steps, so many per sample, with the force known; the rate is log2 of the ratio of neighbours

Throughput: Duffing oscillators under one harmonic force, against `solve_ivp` at equal error.
"""

import argparse
import dataclasses
import functools
import inspect
import json
import math
import os
import platform
import sys
import time
from collections.abc import Callable, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple, Self
from unittest import mock

import jax
import jax.numpy as jnp
import numpy as np
from scipy.integrate import solve_ivp

jax.config.update("jax_enable_x64", True)
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import jfsm  # noqa: E402  (after double precision is on)
from jfsm.dynamics import _simulate  # noqa: E402
from jfsm.plant import Grid, InterpolatedInput, bucket, lower, run_grid  # noqa: E402
from tests.blind.arrays import FloatArray, rms  # noqa: E402
from tests.blind.drives import Drive, Silence, SumOfSines  # noqa: E402
from tests.blind.exact import RELATIVE_TOLERANCE, integrate  # noqa: E402
from tests.blind.laws import LAWS, Law, NoLaw, Scene  # noqa: E402
from tests.blind.laws.stiffness import DoubleWell  # noqa: E402
from tests.blind.plants import Plant, State  # noqa: E402

OMEGA, MASS, DAMPING_RATIO = 40.0, 1.3, 0.02
PLANT = Plant(MASS, MASS * OMEGA**2, 2 * DAMPING_RATIO * MASS * OMEGA)
MODEL = jfsm.Structure.sdof(PLANT.mass, PLANT.stiffness, PLANT.damping)
LINK = (0, 1)
SAMPLES_PER_PERIOD, PERIODS, TAPER = 50, 100, 10
STEPS = (1, 2, 4, 8)
SHARE = 0.15
DRAWN = {
    "cubic_hardening": (0.3, 0), "cubic_softening": (0.02, 0), "quadratic_stiffness": (0.1, 0),
    "quintic_stiffness": (0.3, 0), "saturation": (0.15, 1), "coulomb": (0.06, 0), "coulomb_asymmetric": (0.06, 0),
    "stribeck": (0.05, 0), "smooth_coulomb": (0.06, 0), "bouc_wen": (0.1, 0), "lugre": (0.05, 0),
    "delayed_force": (0.15, 1),
}  # fmt: skip
"""Size of a law's force along the linear motion, in spring forces, and seed of its shape: (SHARE, 0) for the others.

Chosen for a share of about a tenth to a fifth of the spring's force in the motion that comes about (of a few per cent
for the softening spring, which cannot have more), stable and not chaotic.
"""
NOT_SMOOTH = {
    "bilinear_stiffness", "dead_zone", "end_stop", "saturation", "square_stiffness", "coulomb", "coulomb_asymmetric",
    "stribeck", "quadratic_damping", "power_damping", "bilinear_damping", "bouc_wen", "jenkins", "lugre", "free_play",
    "stiffness_drop", "damped_stop", "iwan",
}  # fmt: skip
SMOOTH_TARGET, OTHER_TARGET = 1e-6, 1e-4


@dataclasses.dataclass(frozen=True)
class Tapered:
    """A force that rises within the first `length` [s] of a duration and falls within the last."""

    inner: SumOfSines
    duration: float
    length: float

    def __call__(self, t: Any) -> Any:
        u = np.clip(np.minimum(t, self.duration - t) / self.length, 0.0, 1.0)
        return u**4 * (35 - 84 * u + 70 * u**2 - 20 * u**3) * self.inner(t)

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, inner=self.inner.scaled(factor))


class Question(NamedTuple):
    """A model, its drive and start, its true displacement (n,) [m], and how well that is known."""

    model: jfsm.Structure
    drive: Drive
    start: State
    truth: FloatArray
    exact: float


def clock_of(samples: int) -> FloatArray:
    """Sample times (samples,) [s]."""
    return 2 * math.pi / OMEGA / SAMPLES_PER_PERIOD * np.arange(samples, dtype=np.float64)


@functools.cache
def scene() -> Scene:
    """The linear plant under the drive."""
    period, clock = 2 * math.pi / OMEGA, clock_of(SAMPLES_PER_PERIOD * PERIODS + 1)
    rng = np.random.default_rng(3)
    lines = OMEGA * np.linspace(0.3, 2.2, 12) * (1 + 0.03 * rng.uniform(-1, 1, 12))
    sines = SumOfSines(np.ones(12), lines, rng.uniform(0, 2 * np.pi, 12))
    drive = Tapered(sines, float(clock[-1]), TAPER * period)
    return Scene(PLANT, drive, integrate(PLANT, NoLaw(), drive, (0.0, 0.0), clock, 1e-3))


def catalogue(cause: str) -> Question:
    """The question that a law of the catalogue asks."""
    at = scene()
    share, seed = DRAWN.get(cause, (SHARE, 0))
    law = LAWS[cause].draw(np.random.default_rng(seed), at, share * rms(PLANT.stiffness * at.motion.x))
    return asked(law, at.drive, law.start(0.0, 0.0, PLANT.stiffness))


def double_well() -> Question:
    """A free decay over the hill, as often as it gets there: driven, it would be chaotic."""
    well = scene().x_rms
    law = DoubleWell(k_neg=1.5 * PLANT.stiffness, k3=0.5 * PLANT.stiffness / well**2)
    return asked(law, Silence(), (3.0 * well, 0.0))


def asked(law: Law, drive: Drive, start: State) -> Question:
    """A question of `tests/blind`."""
    at = scene()
    motion, again = (
        integrate(PLANT, law, drive, start, at.motion.time, at.x_rms, rtol)
        for rtol in (RELATIVE_TOLERANCE, 10 * RELATIVE_TOLERANCE)
    )
    model = jfsm.causes()[law.cause].apply(MODEL, at=LINK, **dataclasses.asdict(law))
    return Question(model, drive, start, motion.x, relative(again.x, motion.x))


def formula(term: Any, force: Callable[..., Any], rates: Callable[..., Any], hidden: int) -> Question:
    """The question of a law stated here once more: force(x, v, z), and the rates of its `hidden` states z."""
    at = scene()
    clock, drive = at.motion.time, at.drive

    def slope(t, y):
        x, v, z = y[0], y[1], y[2:]
        load = drive(float(t)) - PLANT.stiffness * x - PLANT.damping * v - force(x, v, z)
        return np.concatenate([[v, load / PLANT.mass], rates(v, z)])

    def motion(tolerance):
        atol = tolerance * np.array([at.x_rms, at.v_rms] + [at.x_rms] * hidden)
        step = (clock[1] - clock[0]) / 2
        return solve_ivp(
            slope, clock[[0, -1]], np.zeros(2 + hidden), "DOP853", clock, rtol=tolerance, atol=atol, max_step=step
        ).y[0]

    truth = motion(1e-11)
    return Question(MODEL + term, drive, (0.0, 0.0), truth, relative(motion(1e-9), truth))


def damped_stop() -> Question:
    k, gap, chi = 0.4 * PLANT.stiffness, 1.2 * scene().x_rms, 0.3 / scene().v_rms

    def force(x, v, z):
        beyond = max(abs(x) - gap, 0.0) * np.sign(x)
        return k * beyond * max(1 + chi * v * np.sign(x), 0.0)

    return formula(jfsm.DampedStop(k, gap, chi, at=LINK), force, lambda v, z: [], 0)


def cosine_stiffness() -> Question:
    k, s = 0.3 * PLANT.stiffness, 1 / scene().peak
    return formula(jfsm.CosineStiffness(k, s, at=LINK), lambda x, v, z: k / s * np.cos(s * x), lambda v, z: [], 0)


def iwan() -> Question:
    k, slip, chi = 0.3 * PLANT.stiffness, 1.5 * scene().x_rms, -0.3
    slips = slip * ((np.arange(16) + 0.5) / 16) ** (1 / (1 + chi))

    def rates(v, z):
        return np.where((np.abs(z) >= slips) & (z * v > 0), 0.0, v)

    return formula(jfsm.Iwan(k, slip, chi, at=LINK), lambda x, v, z: k * np.mean(np.clip(z, -slips, slips)), rates, 16)


QUESTIONS: dict[str, Callable[[], Question]] = {
    **{cause: functools.partial(catalogue, cause) for cause in jfsm.causes() if cause in LAWS},
    "double_well": double_well,
    "damped_stop": damped_stop,
    "cosine_stiffness": cosine_stiffness,
    "iwan": iwan,
}


def relative(found: FloatArray, truth: FloatArray) -> float:
    """Largest difference over the rms of the truth; infinite for a run that ended early."""
    return float(np.max(np.abs(found - truth))) / rms(truth) if found.shape == truth.shape else math.inf


def known_force(
    drive: Drive, record: jfsm.Record, dof: int, substeps: int, *_: Any, length: int, **__: Any
) -> InterpolatedInput:
    """In place of the library's `excitation`: the drive itself on half steps."""
    n, halves = len(record), 2 * substeps + 1
    inner = record.time[:, None] + record.dt / (2 * substeps) * np.arange(halves)
    force = np.zeros((length, halves, dof))
    force[:n, :, 0] = drive(np.minimum(inner, record.time[-1]))
    clock = record.time[0] + record.dt * np.arange(length)
    at_rest, step = np.zeros((length, halves)), np.asarray(record.dt)
    return InterpolatedInput(jnp.asarray(force), jnp.asarray(at_rest), jnp.asarray(clock), jnp.asarray(step))


def best_of(repeats: int, call: Callable[[], Any]) -> tuple[Any, float]:
    """What a call returns, and the shortest time it took [s]."""
    took = []
    for _ in range(repeats):
        begun = time.perf_counter()
        found = jax.block_until_ready(call())
        took.append(time.perf_counter() - begun)
    return found, min(took)


def accuracy(name: str) -> dict[str, Any]:
    """One row of the table."""
    q, clock = QUESTIONS[name](), scene().motion.time
    record = jfsm.Record(clock, q.drive(clock))
    run = functools.partial(jfsm.simulate, q.model, record, q.start)
    run()
    response, seconds = best_of(3, run)
    known_drive = functools.partial(known_force, q.drive)
    with mock.patch.object(_simulate, "excitation", known_drive):
        known = run()
    x0, v0 = (jnp.asarray([value]) for value in q.start)
    grid = []
    for substeps in STEPS:
        inputs = known_drive(record, 1, substeps, length=bucket(len(record)))
        x = run_grid(lower(q.model, grid=Grid(record.dt, substeps)), inputs, x0, v0)[0]
        grid.append(relative(np.asarray(x)[: len(record), 0], q.truth))
    smooth = name not in NOT_SMOOTH
    return {
        "law": name,
        "target": SMOOTH_TARGET if smooth else OTHER_TARGET,
        "exact": q.exact,
        "simulate": relative(response.displacement[:, 0], q.truth),
        "known": relative(known.displacement[:, 0], q.truth),
        "solver": response.solver,
        "milliseconds": 1e3 * seconds,
        "grid": grid,
        "rates": [math.log2(coarse / fine) for coarse, fine in zip(grid[:-1], grid[1:], strict=True)],
    }


HEADING = (
    f"{'law':<21}{'exact':>8}{'simulate':>10}{'known':>9}  {'solver':<9}{'ms':>5}   grid {STEPS}" + " " * 20 + "rate"
)


def line(row: dict[str, Any]) -> str:
    """A row of the accuracy table; * where the target is missed."""
    errors = "".join(f"{row[key]:>9.1e}{'*' if row[key] > row['target'] else ' '}" for key in ("simulate", "known"))
    grid = " ".join(f"{error:.1e}" for error in row["grid"])
    rates = " ".join(f"{rate:4.1f}" for rate in row["rates"])
    return (
        f"{row['law']:<21}{row['exact']:>8.0e}{errors}  {row['solver']:<9}{row['milliseconds']:>5.0f}   {grid}  {rates}"
    )


FORCE, FORCE_OMEGA, K3 = 60.0, 0.93 * OMEGA, 2e6
"""Harmonic force [N], its frequency [rad/s], cubic stiffness [N/m^3]; the motion is some 20 mm."""
AMPLITUDE = 0.02
THROUGHPUT = ((1, 3000), (100, 3000), (1000, 3000), (10_000, 1000))
"""Runs at once, and samples: ten thousand runs of 3000 would fill 0.7 GB."""
TRIED = 5


def by_scipy(clock: FloatArray, x0: float, method: Any, rtol: float) -> FloatArray:
    """Displacement (n,) [m] of the Duffing oscillator from rest at `x0`, as fast as Python's right-hand side is."""

    def slope(t, y):
        x, v = y.tolist()
        load = FORCE * math.sin(FORCE_OMEGA * t) - PLANT.damping * v - (PLANT.stiffness + K3 * x * x) * x
        return v, load / PLANT.mass

    atol = rtol * AMPLITUDE * np.array([1.0, OMEGA])
    return solve_ivp(slope, clock[[0, -1]], [x0, 0.0], method, clock, rtol=rtol, atol=atol).y[0]


def scipy_at(error: float, clock: FloatArray, starts: Sequence[float], truths: Sequence[FloatArray]) -> dict[str, Any]:
    """The fastest of SciPy's two at no more than three times an error."""
    found = []
    for method in ("RK45", "DOP853"):
        for rtol in (10.0 ** -np.arange(2.0, 12.0, 0.25)).tolist():
            runs = [by_scipy(clock, x0, method, rtol) for x0 in starts]
            its = max(map(relative, runs, truths))
            if its < 3 * error:
                seconds = best_of(3, lambda m=method, r=rtol: [by_scipy(clock, x0, m, r) for x0 in starts])[1]
                found.append({"method": method, "rtol": rtol, "error": its, "runs_per_second": len(starts) / seconds})
                break
    return max(found, key=lambda entry: entry["runs_per_second"])


def throughput(runs: int, samples: int, kind: str, substeps: int | None = None) -> dict[str, Any]:
    """Runs a second of `simulate_many`, and of SciPy at an error that is no better than three times worse.

    `kind` is "starts" for one structure from many initial states, "structures" for as many structures from rest.
    """
    clock = clock_of(samples)
    record = jfsm.Record(clock, FORCE * np.sin(FORCE_OMEGA * clock))
    duffing = MODEL + jfsm.CubicStiffness(K3, at=LINK)
    starts = np.linspace(-AMPLITUDE, AMPLITUDE, TRIED)
    truths = [by_scipy(clock, x0, "DOP853", 1e-12) for x0 in starts.tolist()]
    tried = jfsm.simulate_many(duffing, record, (starts[:, None], np.zeros((TRIED, 1))), substeps=substeps)
    error = max(map(relative, tried.displacement[:, :, 0], truths))
    x0 = np.linspace(-AMPLITUDE, AMPLITUDE, runs)[:, None] if kind == "starts" else np.zeros((1, 1))
    models = duffing
    if kind == "structures":
        models = [MODEL + jfsm.CubicStiffness(K3 * (0.5 + k / runs), at=LINK) for k in range(runs)]

    def call():
        return jfsm.simulate_many(models, record, (x0, 0 * x0), substeps=substeps).displacement

    first = best_of(1, call)[1]
    seconds = best_of(3, call)[1]
    scipy = scipy_at(error, clock, starts.tolist(), truths)
    return {
        "runs": runs,
        "samples": samples,
        "kind": kind,
        "substeps": substeps,
        "error": error,
        "compile_seconds": first - seconds,
        "runs_per_second": runs / seconds,
        "scipy": scipy,
        "ratio": runs / seconds / scipy["runs_per_second"],
    }


def main() -> None:
    """Run, print the tables, write them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--causes", nargs="+", choices=list(QUESTIONS), default=list(QUESTIONS), metavar="ID")
    parser.add_argument("--out", type=Path, help="write the tables as JSON")
    parser.add_argument("--no-accuracy", action="store_true")
    parser.add_argument("--no-throughput", action="store_true")
    arguments = parser.parse_args()

    accuracies, throughputs = [], []
    if not arguments.no_accuracy:
        tolerance = inspect.signature(jfsm.simulate).parameters["tolerance"].default
        print(f"largest error of displacement over its rms; tolerance {tolerance:g}; * misses its target")
        print(HEADING)
        for name in arguments.causes:
            accuracies.append(accuracy(name))
            print(line(accuracies[-1]), flush=True)
    if not arguments.no_throughput:
        print(
            "\n  runs samples kind       steps  error     runs/s   SciPy at about the same error        ratio  compile"
        )
        cases = [(*case, "starts", None) for case in THROUGHPUT]
        for case in [*cases, (1000, 3000, "structures", None), (1000, 3000, "starts", 1)]:
            row = throughput(*case)
            throughputs.append(row)
            scipy = row["scipy"]
            said = f"{scipy['method']:<7}{scipy['rtol']:.0e} {scipy['error']:.1e} {scipy['runs_per_second']:7.1f}/s"
            print(
                f"{row['runs']:>6} {row['samples']:>7} {row['kind']:<11}{row['substeps'] or '-':>5} {row['error']:.1e} "
                f"{row['runs_per_second']:>9.1f}   {said:<36} {row['ratio']:>6.0f} {row['compile_seconds']:>6.1f} s",
                flush=True,
            )
    if arguments.out:
        about = {
            "machine": f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores",
            "python": platform.python_version(),
            **{package: version(package) for package in ("jax", "diffrax", "numpy", "scipy")},
        }
        arguments.out.write_text(json.dumps(about | {"accuracy": accuracies, "throughput": throughputs}, indent=1))


if __name__ == "__main__":
    main()
