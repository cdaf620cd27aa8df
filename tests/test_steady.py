"""A record that is not the work of one structure throughout."""

import re

import numpy as np
import pytest
from references import between_wells
from scipy.integrate import solve_ivp

import jfsm
from jfsm.diagnosis.channels.stationarity import unsteady
from jfsm.diagnosis.evidence.setup import Problem
from jfsm.diagnosis.search.baseline import fit_model
from jfsm.identification import prepare_all

N, DT = 3000, 0.05
T = np.arange(N) * DT
MODEL = jfsm.Structure.sdof(mass=1.0, stiffness=9.1, damping=0.28)


@pytest.fixture(scope="module")
def response() -> tuple[np.ndarray, np.ndarray]:
    """Force and displacement of the structure itself, twice as loud in the second half."""
    rng = np.random.default_rng(4)
    omega, phase = rng.uniform(0.8, 5.0, 15), rng.uniform(0, 2 * np.pi, 15)

    def g(t):
        loud = 1.5 + 0.5 * np.tanh(t - T[-1] / 2)
        return loud * np.sum(np.cos(np.multiply.outer(t, omega) + phase), -1)

    run = solve_ivp(lambda t, y: [y[1], g(t) - 9 * y[0] - 0.3 * y[1]], (0, T[-1]), [0, 0], t_eval=T, max_step=DT)
    return g(T), run.y[0]


def changes(force: np.ndarray, x: np.ndarray) -> list[str]:
    noise = 0.01 * np.random.default_rng(5).standard_normal((2, N))
    record = jfsm.Record(T, force + force.std() * noise[0], x + x.std() * noise[1], at_rest=True)
    problem = Problem(MODEL, prepare_all([record], MODEL), [N])
    _, refitted = fit_model(problem)
    return unsteady(refitted, problem)


def test_a_structure_that_stays_the_same_is_steady(response):
    assert changes(*response) == []


@pytest.mark.parametrize(
    ("fails", "said"),
    [((2400, N), r"from ([\d.]+) s on"), ((1000, 1200), r"between ([\d.]+) and ([\d.]+) s")],
)
def test_when_a_sensor_fails_is_said(response, fails: tuple[int, int], said: str):
    force, x = response
    [words] = changes(force, np.where((np.arange(N) >= fails[0]) & (np.arange(N) < fails[1]), 0.4 * x, x))
    found = re.search(said, words)
    assert found is not None and words.startswith("Displacement 1 is predicted far worse")
    block, wanted = T[-1] / 20, [DT * n for n in fails[: len(found.groups())]]
    assert [float(t) for t in found.groups()] == pytest.approx(wanted, abs=block)


def test_where_small_errors_grow_by_themselves_nothing_has_changed():
    """A mass that now and then goes over the hill between two wells, predicted by the right structure."""
    slope, curvature = 1.1, 0.6
    time, rng = np.arange(4000) * 0.14, np.random.default_rng(9)
    force, x, a = between_wells(slope, curvature, 0.05, time, 0.14, np.linspace(0.1, 2.5, 25), seed=8)
    x, a = (q + 0.02 * q.std() * rng.standard_normal(time.size) for q in (x, a))
    record = jfsm.Record(time, force, x, acceleration=a)
    right = jfsm.Structure.sdof(1.0, 2 * slope, 0.05) + jfsm.DoubleWell(3 * slope, curvature, at=(0, 1))
    problem = Problem(right, prepare_all([record], right), [4000])
    given, _ = fit_model(problem)
    assert unsteady(given, problem) == []
