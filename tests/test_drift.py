"""Zeros that wander, and what looks like them where a law is missing."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import jfsm
from jfsm.diagnosis.channels.drift import PLAINLY, SLOWLY, wandering
from jfsm.diagnosis.evidence.setup import Problem
from jfsm.diagnosis.search.baseline import believed
from jfsm.identification import prepare

TIME = 0.1 * np.arange(1500)
MODEL = jfsm.Structure.sdof(1.0, 9.0, 0.3)


def push(t):
    """Beats slowly, so that what a one-sided spring makes of the mean is slow, too."""
    return (2.0 + 1.5 * np.sin(0.08 * t)) * (np.sin(2.2 * t) + np.sin(4.1 * t + 1.0))


def found_beside_the_model(k2: float, *drift: float):
    """Channels that wander beside the model with its values refitted, mostly, slowly and plainly; `drift` is that of
    the displacement and of the acceleration."""

    def rate(t, y):
        return [y[1], push(t) - 9.0 * y[0] - 0.3 * y[1] - k2 * y[0] ** 2]

    y = solve_ivp(rate, (0, TIME[-1]), [0.0, 0.0], t_eval=TIME, rtol=1e-8, atol=1e-10, max_step=0.05).y
    rng, a = np.random.default_rng(3), np.array([rate(t, q)[1] for t, q in zip(TIME, y.T, strict=True)])
    read = [q + 0.02 * np.std(q) * rng.standard_normal(q.size) for q in (push(TIME), y[0], a)]
    x, a = (q + size * np.std(q) * np.sin(2.5 * TIME / TIME[-1]) for size, q in zip(drift, read[1:], strict=True))
    record = jfsm.Record(TIME, read[0], displacement=x, acceleration=a, at_rest=True)
    problem, _, refitted = believed(Problem(MODEL, [prepare(record, MODEL)], [1200]))
    asked = (SLOWLY, True), (SLOWLY, False), (PLAINLY, False)
    found = [wandering(refitted, problem, least, mostly=mostly) for least, mostly in asked]
    return tuple(() if other is None else other.first.readings.wandering for other in found)


@pytest.mark.parametrize(
    ("k2", "drift", "expected"),
    [
        pytest.param(0.0, (0.3, 0.0), ((0,), (0,), (0,)), id="one zero"),
        pytest.param(0.0, (0.3, 0.3), ((0, 1), (0, 1), (0, 1)), id="both zeros at once"),
        pytest.param(0.0, (0.0, 0.0), ((), (), ()), id="none"),
        pytest.param(2.0, (0.0, 0.0), ((), (0,), ()), id="a law that looks slow"),
    ],
)
def test_a_zero_wanders_where_that_is_most_of_what_is_left(k2: float, drift: tuple, expected: tuple):
    assert found_beside_the_model(k2, *drift) == expected
