"""Records as people bring them, each with its trouble, made by code that knows nothing of the library."""

from collections.abc import Callable
from typing import Any

import jax
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import butter, sosfilt

import jfsm

Brought = tuple[jfsm.Record, jfsm.Structure]
Rates = Callable[[np.ndarray, float], np.ndarray]


def band(rng: np.random.Generator, count: int, rate: float, upto: float, rms: float) -> np.ndarray:
    """Noise up to a frequency."""
    noise: Any = sosfilt(butter(4, upto, fs=rate, output="sos"), rng.standard_normal(count))
    return rms * noise / np.std(noise)


def driven(rates: Rates, size: int, time: np.ndarray, force: np.ndarray, held: bool = False, steps: int = 16):
    """States (n, size) by the classical Runge-Kutta method; the force is held over a sample, or goes straight."""
    y, found, h = np.zeros(size), [], (time[1] - time[0]) / steps
    for now, then in zip(force, [*force[1:], force[-1]], strict=True):
        found.append(y)
        for begin in np.arange(steps) / steps:
            first, middle, last = (
                now if held else now + s * (then - now) for s in begin + np.array([0, 0.5, 1]) / steps
            )
            k1 = rates(y, first)
            k2 = rates(y + h / 2 * k1, middle)
            k3 = rates(y + h / 2 * k2, middle)
            k4 = rates(y + h * k3, last)
            y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return np.array(found)


def one_mass(mass: float, resisting: Callable[[float, float], float]) -> Rates:
    return lambda y, force: np.array([y[1], (force - resisting(y[0], y[1])) / mass])


def accelerations(rates: Rates, states: np.ndarray, force: np.ndarray) -> np.ndarray:
    return np.array([rates(y, f)[len(y) // 2 :] for y, f in zip(states, force, strict=True)])


def read(rng: np.random.Generator, values: np.ndarray, share: float = 0.01) -> np.ndarray:
    return values + share * np.std(values) * rng.standard_normal(len(values))


def turned_shaker() -> Brought:
    rng, time = np.random.default_rng(11), np.arange(2000) / 200.0
    force, rates = band(rng, 2000, 200.0, 12.0, 9.0), one_mass(0.8, lambda x, v: 1.4 * v + 620 * x)
    states = driven(rates, 2, time, force)
    shown: Any = {
        "displacement": read(rng, states[:, 0]),
        "acceleration": read(rng, accelerations(rates, states, force)[:, 0]),
    }
    return jfsm.Record(time, force=-force, at_rest=True, **shown), jfsm.Structure.sdof(0.8, 600.0, 1.5)


def held_cubic() -> Brought:
    rng, time = np.random.default_rng(12), np.arange(2500) / 250.0
    force, rates = band(rng, 2500, 250.0, 14.0, 30.0), one_mass(1.1, lambda x, v: 2.2 * v + 900 * x + 4e5 * x**3)
    states = driven(rates, 2, time, force, held=True)
    shown: Any = {
        "displacement": read(rng, states[:, 0]),
        "acceleration": read(rng, accelerations(rates, states, force)[:, 0]),
    }
    return jfsm.Record(time, force=force, at_rest=True, **shown), jfsm.Structure.sdof(1.1, 900.0, 2.2)


def late_drive() -> Brought:
    rng, time = np.random.default_rng(13), np.arange(2500) * 0.004
    rates, phases = rng.uniform(2, 60, 25), rng.uniform(0, 6.28, 25)

    def force(s):
        sets_in = (1 - np.exp(-np.maximum(s, 0) / 0.1)) * (s > 0)
        return 2.0 * np.cos(np.multiply.outer(s, rates) + phases).sum(-1) * sets_in

    def motion(s, y):
        return [y[1], (force(s - 0.0062) - 1.8 * y[1] - 700 * y[0]) / 0.5]

    x, v = solve_ivp(motion, (0, time[-1]), [0, 0], t_eval=time, rtol=1e-8, atol=1e-11, max_step=0.004).y
    shown: Any = {"displacement": read(rng, x, 0.005), "velocity": read(rng, v, 0.005)}
    return jfsm.Record(time, force=force(time), at_rest=True, **shown), jfsm.Structure.sdof(0.5, 690.0, 1.9)


def pendulum() -> Brought:
    rng, time = np.random.default_rng(14), np.linspace(0, 12, 240)
    angle = solve_ivp(
        lambda s, y: [y[1], -6.2 * np.sin(y[0]) - 0.08 * y[1]], (0, 12), [1.0, 0], t_eval=time, rtol=1e-9, atol=1e-10
    ).y[0]
    record = jfsm.Record(
        time, displacement=angle + 1e-3 * rng.standard_normal(time.size), units={"displacement": "rad"}
    )
    return record, jfsm.Structure.sdof(1.0, 6.0, 0.1)


def decay_then_rest() -> Brought:
    rng, time = np.random.default_rng(15), np.arange(5000) / 500.0

    def motion(s, y):
        return [y[1], (-5000 * y[0] - y[1] - 2.4 * np.tanh(y[1] / 1e-4)) / 1.6]

    x = solve_ivp(motion, (0, time[-1]), [0.012, 0], t_eval=time, method="Radau", rtol=1e-7, atol=1e-11).y[0]
    record = jfsm.Record(time, displacement=x + 3e-6 * rng.standard_normal(time.size))
    return record, jfsm.Structure.sdof(1.6, 5000.0, 1.0)


def kilonewtons() -> Brought:
    rng, time = np.random.default_rng(16), np.arange(2000) / 100.0
    force = band(rng, 2000, 100.0, 6.0, 4000.0)
    x = driven(one_mass(700.0, lambda x, v: 900 * v + 3e5 * x), 2, time, force)[:, 0]
    record = jfsm.Record(time, force=force / 1e3, displacement=read(rng, x), at_rest=True)
    return record, jfsm.Structure.sdof(700.0, 3e5, 900.0)


def dead_beside_alive() -> Brought:
    rng, time = np.random.default_rng(17), np.arange(1500) / 300.0
    force = band(rng, 1500, 300.0, 20.0, 5.0)
    x = driven(one_mass(1.0, lambda x, v: 1.5 * v + 800 * x), 2, time, force)[:, 0]
    record = jfsm.Record(time, force=force, displacement=read(rng, x), velocity=np.zeros(1500))
    return record, jfsm.Structure.sdof(1.0, 800.0, 1.5)


def overloads_and_friction() -> Brought:
    rng, time = np.random.default_rng(18), np.arange(2500) / 250.0
    force = band(rng, 2500, 250.0, 12.0, 25.0)
    rates = one_mass(1.2, lambda x, v: 2 * v + 1500 * x + 6.0 * np.tanh(v / 2e-3))
    states = driven(rates, 2, time, force, steps=40)
    shown = read(rng, accelerations(rates, states, force)[:, 0])
    shown[[411, 1203]] = -9999.0
    record = jfsm.Record(time, force=force, displacement=read(rng, states[:, 0]), acceleration=shown, at_rest=True)
    return record, jfsm.Structure.sdof(1.2, 1500.0, 2.0)


def two_masses() -> Brought:
    rng, time = np.random.default_rng(19), np.arange(2500) / 200.0
    force, mass = band(rng, 2500, 200.0, 8.0, 60.0), np.array([1.0, 0.7])
    stiffness, damping = np.array([900.0, 500.0]), np.array([1.2, 0.8])

    def rates(y, force):
        d, w = np.diff([0, *y[:2]]), np.diff([0, *y[2:]])
        pull = stiffness * d + damping * w + [0.0, 4e5 * d[1] ** 3]
        return np.array([*y[2:], *((np.array([force, 0.0]) - pull + [pull[1], 0.0]) / mass)])

    states = driven(rates, 4, time, force, steps=24)
    record = jfsm.Record(
        time,
        force={1: force},
        displacement={1: read(rng, states[:, 0])},
        acceleration={2: read(rng, accelerations(rates, states, force)[:, 1])},
        at_rest=True,
    )
    return record, jfsm.Structure.chain(mass=mass, stiffness=stiffness * [1.01, 0.99], damping=damping * 1.1)


def torn_but_sound() -> Brought:
    rng, time = np.random.default_rng(20), np.arange(2000) / 200.0
    force = band(rng, 2000, 200.0, 12.0, 9.0)
    x = read(rng, driven(one_mass(0.8, lambda x, v: 1.4 * v + 620 * x), 2, time, force)[:, 0])
    x[900] = 1e30
    return jfsm.Record(time, force=force, displacement=x, at_rest=True), jfsm.Structure.sdof(0.8, 622.0, 1.45)


def told(brought: Callable[[], Brought]) -> jfsm.Diagnosis:
    return jfsm.diagnose(*brought(), key=jax.random.key(0), progress=False)


@pytest.mark.parametrize(
    ("brought", "words"),
    [(kilonewtons, "displacement 1 is 1e\\+03 times .* kN for N"), (dead_beside_alive, "velocity 1 is constant")],
)
def test_a_record_that_nothing_can_be_read_from_is_refused(brought: Callable[[], Brought], words: str):
    with pytest.raises(ValueError, match=words):
        told(brought)


def test_one_torn_sample_is_no_cause():
    found = told(torn_but_sound)
    assert found.verdict in ("consistent", "parameters") and not found.findings
    assert any("1e+30" in note or "displacement 1" in note for note in found.notes)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("brought", "cause", "name", "size"),
    [
        (turned_shaker, "force_gain", "eps", -2.0),
        (held_cubic, "cubic_hardening", "k3", 4e5),
        (late_drive, "force_delay", "tau", -0.0062),
        (overloads_and_friction, "coulomb", "F", 6.0),
        (two_masses, "cubic_hardening", "k3", 4e5),
    ],
)
def test_a_cause_is_named_for_all_that(brought: Callable[[], Brought], cause: str, name: str, size: float):
    finding = told(brought).findings[0]
    assert finding.cause == cause
    assert float(finding.parameters[name].value) == pytest.approx(size, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("brought", "kind", "size"), [(pendulum, "a softening spring", None), (decay_then_rest, "dry friction", 2.4)]
)
def test_the_class_is_right_where_the_law_is_not_sure(brought: Callable[[], Brought], kind: str, size: float | None):
    finding = told(brought).findings[0]
    assert finding.kind == kind and finding.kind_probability > 0.95
    if size is not None:
        assert finding.size is not None and float(finding.size.value) == pytest.approx(size, rel=0.05)
