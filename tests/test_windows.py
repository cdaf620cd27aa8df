"""Over how much time a hypothesis is asked to predict, and what its error is a share of."""

import numpy as np
import pytest

import jfsm
from jfsm.diagnosis.evidence.fitted import extent, windows
from jfsm.identification import Nuisances, prepare

MASS, DAMPING = 2.0, 8.0


def prepared(stiffness: float) -> Nuisances:
    """An axis that goes slowly to and fro."""
    time = np.arange(4000) * 0.01
    terms: list = [jfsm.LinearDamping(DAMPING, at=(0, 1))]
    if stiffness:
        terms.append(jfsm.LinearStiffness(stiffness, at=(0, 1)))
    force = 5.0 * np.cos(0.3 * time) + 0.01 * np.random.default_rng(3).standard_normal(time.size)
    rng = np.random.default_rng(4)
    x = np.sin(0.3 * time) + 1e-4 * rng.standard_normal(time.size)
    return prepare(jfsm.Record(time, force, x), jfsm.Structure([MASS], terms))


def test_what_a_spring_holds_is_predicted_for_some_periods_and_its_error_is_a_share_of_all_motion():
    n = prepared(stiffness=50.0)
    assert n.period == pytest.approx(2 * np.pi * np.sqrt(MASS / 50.0), rel=1e-6)
    assert extent(n) == pytest.approx(n.spread)


def test_what_nothing_holds_is_predicted_until_damping_stops_it_and_its_error_is_a_share_of_that_motion():
    n = prepared(stiffness=0.0)
    assert 3 * n.period == pytest.approx(MASS / DAMPING, rel=1e-6)
    used, free = windows(n)
    lengths = np.diff(np.flatnonzero(np.diff(free.astype(int))))[::2]
    assert np.all(np.abs(lengths[:-1] - MASS / DAMPING / 0.01) <= 2) and not np.any(used[free])
    # A sine of unit size moves by 0.3/√2 in a second; evenly spread over a window of T seconds by T/√12 times as much.
    assert extent(n)[0] == pytest.approx(0.3 / np.sqrt(2) * 0.25 / np.sqrt(12), rel=0.1)


def test_steps_of_a_decay_are_short_enough_for_its_beginning():
    time = np.arange(4000) * 0.01
    envelope = np.exp(-2.0 * time)
    x, v = envelope * np.sin(5.0 * time), envelope * (5.0 * np.cos(5.0 * time) - 2.0 * np.sin(5.0 * time))
    model = jfsm.Structure.sdof(mass=MASS, stiffness=58.0, damping=DAMPING)
    bristles = model + jfsm.LuGre(0.1, 0.1, 1.0, 20.0, 1.0, at=(0, 1))  # 20/0.1·5 = 1000 rad/s at first
    n = prepare(jfsm.Record(time, None, x, v), model).resolving([bristles])
    assert 1000.0 * n.record.dt / n.inputs.substeps < 2.8  # where Runge-Kutta of order four is stable
