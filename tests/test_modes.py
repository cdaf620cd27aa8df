"""Frequency and damping ratio of what was fitted: against roots by hand, and how often the interval is right."""

import json

import numpy as np
import pytest

import jfsm
from jfsm.diagnosis.evidence.setup import Problem
from jfsm.diagnosis.report.estimates import modes_of_trial, plain_modes
from jfsm.diagnosis.search.baseline import fit_model
from jfsm.identification import fit, modes_of, oscillations, prepare_all
from jfsm.identification._unknowns import Unknown

T = np.arange(1500) * 0.01


def _decay(frequency, ratio, noise, seed):
    omega = 2 * np.pi * frequency
    rate, turn = ratio * omega, omega * np.sqrt(1 - ratio**2)
    x = np.exp(-rate * T) * (np.cos(turn * T) + rate / turn * np.sin(turn * T))
    return x + noise * np.random.default_rng(seed).normal(size=T.size)


def test_a_decay_gives_its_frequency_and_damping_ratio_within_their_intervals():
    frequency, ratio = 1.7, 0.015
    record = jfsm.Record(T, displacement=_decay(frequency, ratio, 0.02, 1))
    model = jfsm.Structure.sdof(mass=1.0, stiffness=120.0, damping=0.2)
    (mode,) = fit(model, record).modes
    assert mode.frequency.low < frequency < mode.frequency.high
    assert mode.damping_ratio.low < ratio < mode.damping_ratio.high
    assert mode.frequency.high - mode.frequency.low < 0.01 and mode.damping_ratio.high < 0.02
    assert (mode.frequency.unit, mode.damping_ratio.unit) == ("Hz", "1")


def test_modes_of_a_chain_are_the_roots_of_its_matrices():
    model = jfsm.Structure.chain(mass=[1.0, 2.0], stiffness=[120.0, 240.0], damping=[0.4, 0.3])
    mass, stiffness = np.diag([1.0, 2.0]), np.array([[360.0, -240.0], [-240.0, 240.0]])
    damping = np.array([[0.7, -0.3], [-0.3, 0.3]])
    zero = np.zeros((2, 2))
    pair = (np.block([[zero, np.eye(2)], [-stiffness, -damping]]), np.block([[np.eye(2), zero], [zero, mass]]))
    roots = np.linalg.eigvals(np.linalg.solve(pair[1], pair[0]))
    roots = roots[roots.imag > 0]
    np.testing.assert_allclose(oscillations(model), roots[np.argsort(np.abs(roots))], rtol=1e-12)


@pytest.mark.parametrize("width, count", [(0.01, 1), (0.6, 0)])
def test_a_mode_is_told_only_where_its_frequency_is_known(width, count):
    """Of the spring alone: half its relative error is that of the frequency."""
    model = jfsm.Structure.sdof(mass=1.0, stiffness=100.0, damping=0.2)
    unknowns = [Unknown("stiffness@0-1.k", np.log(100.0), 1.0, True, np.log(100.0), 1.0)]
    modes = modes_of(model, unknowns, np.array([np.log(100.0)]), np.array([[width**2]]))
    assert len(modes) == count
    for mode in modes:
        error = np.log(mode.frequency.high / mode.frequency.value)
        assert error == pytest.approx(1.96 * width / 2, rel=1e-6)
        # ratio = c / (2 sqrt(k m)), which falls as the frequency grows
        assert mode.damping_ratio.value == pytest.approx(0.01)
        assert mode.damping_ratio.high - 0.01 == pytest.approx(0.01 * 1.96 * width / 2, rel=1e-6)


def test_what_does_not_oscillate_has_no_mode():
    assert oscillations(jfsm.Structure.sdof(mass=1.0, stiffness=1.0, damping=5.0)).size == 0
    rig = jfsm.Structure(mass=[0.0], terms=[jfsm.LinearStiffness(9.0, at=(0, 1))])
    assert oscillations(rig).size == 0


def test_modes_of_a_refitted_model_stand_beside_those_that_were_given():
    record = jfsm.Record(T, displacement=_decay(1.7, 0.015, 0.02, 2))
    model = jfsm.Structure.sdof(mass=1.0, stiffness=110.0, damping=0.4)
    _, refitted = fit_model(Problem(model, prepare_all([record], model), [1000]))
    (mode,) = plain_modes(model, modes_of_trial(refitted))
    assert mode["frequency"]["given"] == pytest.approx(np.sqrt(110.0) / (2 * np.pi))
    assert mode["frequency"]["low"] < 1.7 < mode["frequency"]["high"] and mode["frequency"]["unit"] == "Hz"
    assert mode["damping_ratio"]["low"] < 0.015 < mode["damping_ratio"]["high"]
    json.dumps(mode)
    damped = jfsm.Structure.sdof(mass=1.0, stiffness=1.0, damping=5.0)
    (mode,) = plain_modes(damped, modes_of_trial(refitted))
    assert mode["frequency"]["given"] is None
