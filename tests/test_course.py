"""What a missing force does over time, frequency and past, for the report."""

import numpy as np
import pytest

import jfsm
from jfsm.diagnosis.evidence.missing_force import Residual, agreement
from jfsm.diagnosis.report.residual_signals import course
from jfsm.surrogates import RKPM

STEP, PERIOD = 0.02, 1.5
TIME = np.arange(3000) * STEP


def missing(extra: np.ndarray) -> Residual:
    """A cubic force with white noise, and something beside it."""
    rng = np.random.default_rng(4)
    x = np.sin(2 * np.pi * TIME / PERIOD) * (1 + 0.5 * np.sin(0.7 * TIME))
    v = np.gradient(x, STEP)
    std = np.full(TIME.size, 0.05)
    force = x**3 + 0.05 * rng.standard_normal(TIME.size) + extra
    force_map = RKPM.fit(np.column_stack([x, v])[::2], force[::2], order=3, neighbours=160)
    return Residual((0, 1), x, v, force, std, force_map)


def of(extra: np.ndarray) -> dict:
    return course(missing(extra), 10.0, STEP, PERIOD)


def test_a_force_of_the_state_owes_nothing_to_its_past():
    shown = of(np.zeros(TIME.size))
    assert np.mean(np.abs(shown["correlation"]) > shown["chance"]) < 0.15
    assert shown["time"][0] == 10.0 and len(shown["time"]) == len(shown["force"]) == len(shown["error"])
    assert shown["lag"][-1] == pytest.approx(4.0, rel=0.02)


def test_a_force_that_follows_time_shows_in_its_past_and_at_its_frequency():
    shown = of(0.5 * np.sin(2 * np.pi * 5.0 * TIME))
    assert max(np.abs(shown["correlation"])) > 0.7 > 10 * shown["chance"]
    above = np.array(shown["frequency"]) > 3.0
    loudest = np.array(shown["frequency"])[above][np.argmax(np.array(shown["density"])[above])]
    assert loudest == pytest.approx(5.0, abs=0.1)


def test_the_right_law_lies_in_the_band_of_the_map_and_another_does_not():
    found = missing(np.zeros(TIME.size))
    right, wrong = jfsm.CubicStiffness(1.0, at=(0, 1)), jfsm.QuinticStiffness(1.0, at=(0, 1))
    shares = [agreement(found, law) for law in (right, wrong)]
    assert shares[0] is not None and shares[0] > 0.95
    assert shares[1] is not None and shares[1] < 0.6
    assert agreement(found, jfsm.BoucWen(1.0, 1.0, 0.5, 1.0, at=(0, 1))) is None and agreement(found, None) is None
