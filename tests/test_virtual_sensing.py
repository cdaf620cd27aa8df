"""What a model tells that nothing measured: motion and force at other places, against chains run by SciPy."""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import jfsm
from jfsm import LinearDamping, LinearStiffness

DT = 0.05
TIME = DT * np.arange(500)


def push(t):
    return 3 * np.sin(0.8 * t + 0.3) + 2 * np.sin(2.1 * t + 1.1) + np.sin(3.7 * t)


def chain(mass, stiffness, damping, load):
    """True x, v, a, each (n, dof), of a chain pushed at 1; `load` (dof,) stands on the left-hand side."""
    mass, dof = np.array(mass), len(mass)

    def rate(t, y):
        x, v = y[:dof], y[dof:]
        links = stiffness * np.diff(x, prepend=0.0) + damping * np.diff(v, prepend=0.0)
        force = links - np.append(links[1:], 0.0) + load(x, v, t) - push(t) * (np.arange(dof) == 0)
        return np.concatenate([v, -force / mass])

    run = solve_ivp(rate, (0, TIME[-1]), np.zeros(2 * dof), t_eval=TIME, rtol=1e-9, atol=1e-9, method="DOP853")
    a = np.array([rate(t, y)[dof:] for t, y in zip(TIME, run.y.T, strict=True)])
    return run.y[:dof].T, run.y[dof:].T, a


def noisy(y, seed):
    return y + 0.01 * np.std(y) * np.random.default_rng(seed).standard_normal(y.shape)


def share_inside(miss, std):
    return float(np.mean(np.abs(miss) < 1.96 * std))


TWO = {"mass": [1.0, 0.7], "stiffness": [9.0, 6.0], "damping": [0.2, 0.1]}


def bands(found, truth, dof):
    """Shares inside the bands for x, v and a of a degree of freedom, and errors relative to the truth."""
    shown = (found.displacement, found.velocity, found.acceleration)
    miss = [q[:, dof - 1] - z[:, dof - 1] for q, z in zip(shown, truth, strict=True)]
    inside = [share_inside(e, found.std[:, dof - 1, i]) for i, e in enumerate(miss)]
    return inside, [float(np.std(e) / np.std(z[:, dof - 1])) for e, z in zip(miss, truth, strict=True)]


@pytest.mark.slow
def test_a_load_on_a_mass_that_nothing_measures_is_told_with_the_motion_there():
    truth = x, _, a = chain(**TWO, load=lambda x, v, t: np.array([0.0, np.sign(np.sin(0.7 * t))]))
    channels: dict[str, Any] = {"displacement": {1: noisy(x[:, 0], 1)}, "acceleration": {1: noisy(a[:, 0], 2)}}
    record = jfsm.Record(TIME, noisy(push(TIME), 3), **channels)
    found = jfsm.estimate_motion(record, jfsm.Structure.chain(**TWO), places=[(0, 2)])
    inside, errors = bands(found, truth, 2)
    assert np.all(np.array(errors) < (0.006, 0.012, 0.08))
    assert found.places == ((0, 2),) and found.latent_force is not None and found.latent_force_std is not None
    miss = found.latent_force[:, 0] - np.sign(np.sin(0.7 * TIME))
    inside.append(share_inside(miss, found.latent_force_std[:, 0]))
    assert all(0.90 <= share <= 0.98 for share in inside), inside
    assert 0.8 < np.sqrt(np.mean((miss / found.latent_force_std[:, 0]) ** 2)) < 1.25


def test_a_mass_between_two_measured_ones_is_told_under_a_force_that_the_model_lacks():
    rng = np.random.default_rng(0)
    rate, phase = rng.uniform(0.3, 6, 40), rng.uniform(0, 6.28, 40)

    def load(t):
        return np.sum(0.25 * np.cos(np.multiply.outer(t, rate) + phase), -1)

    three = {"mass": [1.0, 0.8, 0.6], "stiffness": [12.0, 9.0, 7.0], "damping": [0.2, 0.1, 0.1]}
    truth = x, _, _ = chain(**three, load=lambda x, v, t: np.array([0.0, 0.0, load(t)]))
    record = jfsm.Record(TIME, noisy(push(TIME), 3), displacement={1: noisy(x[:, 0], 1), 3: noisy(x[:, 2], 2)})
    found = jfsm.estimate_motion(record, jfsm.Structure.chain(**three), places=[(0, 3)])
    inside, errors = bands(found, truth, 2)
    assert np.all(np.array(errors) < (0.004, 0.01, 0.03))
    assert all(0.90 <= share <= 0.98 for share in inside), inside
    assert found.latent_force is not None
    assert np.std(found.latent_force[:, 0] - load(TIME)) < 0.15 * np.std(load(TIME))


def uncoupled():
    return jfsm.Structure([1.0, 1.0], [LinearStiffness(9.0, at=(0, 1)), LinearStiffness(9.0, at=(0, 2))])


def free():
    return jfsm.Structure([1.0, 2.0], [LinearStiffness(9.0, at=(1, 2)), LinearDamping(0.1, at=(1, 2))])


def ring():
    return jfsm.Structure([1.0] * 3, [LinearStiffness(9.0, at=at) for at in ((0, 1), (1, 2), (2, 3), (0, 3))])


@pytest.mark.parametrize(
    ("model", "channel", "message"),
    [
        (uncoupled, "displacement 1", r"the one of 0\.4775 Hz, in which 2 moves, leaves no trace in displacement 1\. "
         r"Measure also displacement 2\."),
        (free, "acceleration 1", "the one that nothing pulls back, in which 1 and 2 move, leaves no trace in accelerat"
         r"ion 1\. Measure also displacement 1 or displacement 2\."),
        (ring, "displacement 2", r"the one of .* Hz, in which 1 and 3 move, leaves no trace in displacement 2\. "
         r"Measure also displacement 1 or displacement 3\."),
    ],
)  # fmt: skip
def test_a_natural_motion_that_no_channel_shows_is_named_with_the_channel_that_would(model, channel, message):
    kind, dof = channel.split()
    channels: dict[str, Any] = {kind: {int(dof): noisy(push(TIME), 1)}}
    record = jfsm.Record(TIME, **channels)
    with pytest.raises(ValueError, match="`record` must show every natural motion of the model; " + message):
        jfsm.estimate_motion(record, model())


@pytest.mark.parametrize(
    ("places", "message"),
    [
        ([(0, 1), (0, 2)], r"must be such that .*; those at \(0, 1\) and \(0, 2\) may stand for one another in disp"
         r"lacement 1\. Measure also displacement 2\. Or name fewer places\."),
        ([(0, 3)], r"must be links \(i, j\) .* 1 to 2; one is \(0, 3\)\. A load on degree of freedom j is at \(0, j\)"),
        ([(1, 1)], r"must be links \(i, j\) .*; one is \(1, 1\)"),
        ([], r"must name at least one link; it is empty\. Leave it out"),
    ],
)  # fmt: skip
def test_places_whose_forces_cannot_be_told_are_refused(places, message):
    record = jfsm.Record(TIME, push(TIME), displacement=push(TIME))
    with pytest.raises(ValueError, match="`places` " + message):
        jfsm.estimate_motion(record, jfsm.Structure.chain(**TWO), places)


def test_places_need_a_model():
    with pytest.raises(ValueError, match="`places` must be left out where no model is given; pass the model"):
        jfsm.estimate_motion(jfsm.Record(TIME, displacement=push(TIME)), places=[(0, 1)])
