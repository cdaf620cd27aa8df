"""Component tests: the motion is imposed, the force judged. Are the verdicts right?

    python benchmarks/component.py

A spring and a dashpot with one hidden law or fault, or none, along three kinds of motion, made by NumPy and SciPy.
"""

import argparse
from collections.abc import Callable
from itertools import product
from typing import Any, NamedTuple

import jax
import numpy as np
from scipy.integrate import solve_ivp

jax.config.update("jax_enable_x64", True)

import jfsm  # noqa: E402  (after double precision is on)

T = 0.02 * np.arange(1500)
K, C = 4.0, 1.0
SIZE = 0.4
"""Standard deviation of the hidden force, as a share of the linear one's."""
STEP = 1e-4
EVERY = ("nothing", "value", "quadratic_damping", "coulomb", "smooth_coulomb", "cubic_hardening", "bouc_wen")
EVERY += ("jenkins", "maxwell", "force_delay", "bilinear_damping", "end_stop", "stribeck")


class Imposed(NamedTuple):
    """An imposed motion: displacement and velocity at any instants."""

    x: Callable[[Any], Any]
    v: Callable[[Any], Any]


def motion(kind: str, rng: np.random.Generator) -> Imposed:
    """Three tones, a tone in steps of amplitude, or a sweep."""
    omega, phase = np.array([2.0, 5.0, 9.0]) * rng.uniform(0.9, 1.1, 3), rng.uniform(0.0, 2 * np.pi, 3)
    tones = list(zip((1.0, 0.5, 0.3), omega, phase, strict=True))

    def x(t):
        if kind == "tones":
            return sum(a * np.cos(w * t + p) for a, w, p in tones)
        if kind == "steps":
            return (0.3 + 0.25 * sum(1 / (1 + np.exp((c - t) / 0.3)) for c in (7.0, 14.0, 21.0))) * np.sin(4 * t + 0.3)
        return 0.8 * np.sin(t + 0.1 * t**2)

    return Imposed(x, lambda t: (x(t + STEP) - x(t - STEP)) / (2 * STEP))


def hidden(law: str, path: Imposed) -> np.ndarray:
    """The force of a law along a motion, of any size."""
    x, v = path.x(T), path.v(T)

    def along(rate: Callable[[float, float], float]) -> np.ndarray:
        run = solve_ivp(
            lambda t, z: rate(path.v(t), z), T[[0, -1]], [0.0], t_eval=T, rtol=1e-9, atol=1e-11, max_step=0.01
        )
        return run.y[0]

    def slider(limit: float) -> np.ndarray:
        z, found = 0.0, [0.0]
        for step in np.diff(path.x(np.linspace(T[0], T[-1], (T.size - 1) * 50 + 1))):
            z = min(max(z + step, -limit), limit)
            found.append(z)
        return np.array(found)[::50]

    gap, slow, yields = 0.56 * np.max(np.abs(x)), 0.2 * v.std(), 0.5 * x.std()
    laws: dict[str, Callable[[], np.ndarray]] = {
        "quadratic_damping": lambda: v * np.abs(v),
        "coulomb": lambda: np.sign(v),
        "smooth_coulomb": lambda: np.tanh(v / slow),
        "stribeck": lambda: np.sign(v) * (1 + 0.8 * np.exp(-((v / slow) ** 2))),
        "cubic_hardening": lambda: x**3,
        "bilinear_damping": lambda: np.maximum(v, 0.0),
        "bouc_wen": lambda: along(lambda v, z: v - 0.6 / yields * abs(v) * z - 0.4 / yields * v * abs(z)),
        "jenkins": lambda: slider(yields),
        "maxwell": lambda: along(lambda v, z: v - z / 0.3),
        "end_stop": lambda: np.sign(x) * np.maximum(np.abs(x) - gap, 0.0),
    }
    return laws[law]()


def record_of(law: str, kind: str, noise: float, velocity: bool, seed: int) -> jfsm.Record:
    """A record of the component with the law, noise on every channel and an offset of the force."""
    rng = np.random.default_rng(seed)
    path = motion(kind, rng)
    late = 0.015 if law == "force_delay" else 0.0
    x, v = path.x(T - late), path.v(T - late)
    force = K * x + C * v
    if law == "value":
        force = force + 0.35 * v
    elif law not in ("nothing", "force_delay"):
        extra = hidden(law, path)
        force = force + SIZE * force.std() / extra.std() * extra

    def seen(y):
        return y + noise * y.std() * rng.standard_normal(y.size)

    measured = {"displacement": seen(path.x(T))} | ({"velocity": seen(path.v(T))} if velocity else {})
    return jfsm.Record(T, force=seen(force) + 0.2, drive="motion", **measured)


def main() -> None:
    argparse.ArgumentParser(description="Verdicts on component tests that are made up.").parse_args()
    model = jfsm.Structure([0.0], [jfsm.LinearStiffness(K, at=(0, 1)), jfsm.LinearDamping(C, at=(0, 1))])
    tests = [*product(EVERY, ["tones"], [0.01], [False, True])]
    tests += product(EVERY[:10], ["steps", "sweep"], [0.001, 0.02], [False])
    expected = {"nothing": ("consistent", ""), "value": ("parameters", "damping_value")}
    right, closed = 0, []
    for seed, (law, kind, noise, velocity) in enumerate(tests):
        d = jfsm.diagnose(record_of(law, kind, noise, velocity, seed), model, key=jax.random.key(seed))
        named = d.findings[0].cause if d.findings else ""
        exact = (d.verdict, named) == expected.get(law, ("cause", law))
        right += exact
        assert d.gain is not None
        closed += [d.gain.closed] if law != "nothing" else []
        chance = f"{d.findings[0].probability:.2f}" if d.findings else ""
        rivals = ", ".join(f"{r.cause} {r.probability:.2f}" for r in d.findings[0].rivals) if d.findings else ""
        channels = "x, v" if velocity else "x"
        print(f"{'' if exact else '!':1s} {law:18s} {kind:6s} {noise:6.1%} {channels:5s}", end=" ")
        print(f"{d.verdict:11s} {named:18s} {chance:5s} closed {d.gain.closed:.2f}  {rivals}", flush=True)
    print(f"{right} of {len(tests)} exact, median share of the closable error closed {np.median(closed):.2f}")


if __name__ == "__main__":
    main()
