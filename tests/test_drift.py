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


def found_beside_the_model(k2: float, drift: float):
    """Which channel wanders beside the model with its values refitted, mostly, slowly and plainly."""

    def rate(t, y):
        return [y[1], push(t) - 9.0 * y[0] - 0.3 * y[1] - k2 * y[0] ** 2]

    y = solve_ivp(rate, (0, TIME[-1]), [0.0, 0.0], t_eval=TIME, rtol=1e-8, atol=1e-10, max_step=0.05).y
    rng, a = np.random.default_rng(3), np.array([rate(t, q)[1] for t, q in zip(TIME, y.T, strict=True)])
    read = [q + 0.02 * np.std(q) * rng.standard_normal(q.size) for q in (push(TIME), y[0], a)]
    slow = drift * np.std(y[0]) * np.sin(2.5 * TIME / TIME[-1])
    record = jfsm.Record(TIME, read[0], displacement=read[1] + slow, acceleration=read[2], at_rest=True)
    problem, _, refitted = believed(Problem(MODEL, [prepare(record, MODEL)], [1200]))
    asked = (SLOWLY, True), (SLOWLY, False), (PLAINLY, False)
    return tuple(wandering(refitted, problem, least, mostly=mostly) for least, mostly in asked)


@pytest.mark.parametrize(
    ("k2", "drift", "expected"), [(0.0, 0.3, (0, 0, 0)), (0.0, 0.0, (None, None, None)), (2.0, 0.0, (None, 0, None))]
)
def test_a_zero_wanders_where_that_is_most_of_what_is_left(k2: float, drift: float, expected: tuple):
    assert found_beside_the_model(k2, drift) == expected
