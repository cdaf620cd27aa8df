"""Several records of one structure that differs between them: SciPy is the rig."""

from collections.abc import Callable

import jax
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import jfsm

N, DT = 1500, 0.04
T = np.arange(N) * DT
FEW = ["cubic_hardening", "coulomb", "quadratic_damping", "stiffness_drift"]
MODEL = jfsm.Structure.sdof(mass=1.0, stiffness=9.1, damping=0.28)


def rig(seed: int, level: float, stiffness: float, law: Callable[[float, float], float]) -> jfsm.Record:
    rng = np.random.default_rng(seed)
    omega, phase = rng.uniform(0.8, 5.0, 15), rng.uniform(0, 2 * np.pi, 15)

    def g(t):
        return level * np.sum(np.cos(np.multiply.outer(t, omega) + phase), -1)

    def rate(t, y):
        return [y[1], g(t) - stiffness * y[0] - 0.3 * y[1] - law(*y)]

    x = solve_ivp(rate, (0, T[-1]), [0, 0], t_eval=T, rtol=1e-8, atol=1e-9, max_step=DT).y[0]
    force, noise = g(T), 0.01 * rng.standard_normal((2, N))
    return jfsm.Record(T, force + force.std() * noise[0], x + x.std() * noise[1], at_rest=True)


def diagnosed(records: list[jfsm.Record]) -> jfsm.Diagnosis:
    return jfsm.diagnose(records, MODEL, causes=FEW, max_causes=1, key=jax.random.key(0))


@pytest.mark.slow
def test_a_stiffness_that_differs_between_records_is_no_law_that_is_missing():
    d = diagnosed([rig(1, 1.0, 9.0, lambda x, v: 0.0), rig(2, 1.6, 8.6, lambda x, v: 0.0)])
    assert d.verdict == "parameters" and "stiffness_value" in [f.cause for f in d.findings]
    assert "Records differ: stiffness@0-1.k" in d.sentence
    for (value, low, high), truth in zip(d.data["between_records"]["stiffness@0-1.k"], (9.0, 8.6), strict=True):
        assert low < truth < high and high - low < 0.01 * value


@pytest.mark.slow
def test_of_a_law_at_two_levels_no_number_differs():
    d = diagnosed([rig(3, 0.6, 9.0, lambda x, v: 0.5 * x**3), rig(4, 1.5, 9.0, lambda x, v: 0.5 * x**3)])
    assert d.verdict == "cause" and d.findings[0].cause == "cubic_hardening" and d.findings[0].probability > 0.9
    assert d.data["between_records"] == {}


@pytest.mark.slow
def test_a_law_that_is_not_the_same_in_all_records_is_open():
    sizes = (0.4, 0.8)
    d = diagnosed([rig(5 + i, 1.0, 9.0, lambda x, v, F=F: F * np.tanh(v / 1e-3)) for i, F in enumerate(sizes)])
    assert d.verdict == "cause" and d.findings[0].cause == "coulomb" and d.findings[0].probability <= 0.5
    found = d.data["between_records"]["coulomb@0-1.F"]
    assert [value for value, _, _ in found] == pytest.approx(sizes, rel=0.05)
