"""Drives of a few tones: the force without its noise, and what a filter that runs with it leaves."""

import numpy as np
import pytest

import jfsm
from jfsm.identification import Hypothesis, Posterior, prepare
from jfsm.records import noise_floor, tones

N, DT = 3000, 0.01
TIME = DT * np.arange(N)
MASS, STIFFNESS, DAMPING = 2.0, 200.0, 0.4
NOISE = 0.02


def sum_of(amplitudes, omegas):
    return sum(a * np.cos(w * TIME + 7 * w) for a, w in zip(amplitudes, omegas, strict=True))


DRIVES = {
    "one": sum_of([3.0], [5.4]) + 0.2,
    "orders": sum_of([1.0, 0.3, 0.1], [5.4, 16.2, 27.0]),
    "as many as there may be": sum_of([1.0] * 8, [2.0, 2.8, 4.4, 9.0, 11.0, 12.0, 31.0, 40.0]),
}


def with_noise(clean, share=NOISE, seed=0):
    return clean + share * np.std(clean) * np.random.default_rng(seed).standard_normal(clean.size)


@pytest.mark.parametrize("share", [1e-4, 0.01, 0.1])
@pytest.mark.parametrize("drive", DRIVES)
def test_tones_leave_less_noise_than_a_spline(drive, share):
    clean = DRIVES[drive]
    y = with_noise(clean, share)
    floor = noise_floor(y, DT)
    found = tones(y, floor)
    assert found is not None
    error = np.std(found.curve - clean)
    assert error < 2 * share * np.std(clean) * np.sqrt(found.parameters / N)
    assert error < np.std(floor.smooth - clean) / 2


@pytest.mark.parametrize(
    "clean",
    [
        np.cos((2.0 + 0.1 * TIME) * TIME),
        np.exp(-0.1 * TIME) * np.cos(9.0 * TIME),
        sum_of(np.ones(20), np.linspace(2.0, 14.0, 20)),
    ],
    ids=["sweep", "decay", "many lines"],
)
def test_what_is_no_sum_of_a_few_tones_is_left_to_the_spline(clean):
    y = with_noise(clean)
    assert tones(y, noise_floor(y, DT)) is None


def steady(omega):
    """Force and acceleration (n,) of the structure under one tone, exactly."""
    force = np.exp(1j * omega * TIME)
    x = force / (STIFFNESS + 1j * omega * DAMPING - omega**2 * MASS)
    return force.real, (-(omega**2) * x).real


@pytest.mark.parametrize("omega", [4.0, 9.0, 14.0])
def test_a_tone_leaves_the_innovations_of_the_true_structure_white(omega):
    force, acceleration = (with_noise(y, seed=seed) for seed, y in enumerate(steady(omega)))
    structure = jfsm.Structure.sdof(MASS, STIFFNESS, DAMPING)
    nuisances = prepare(jfsm.Record(TIME, force, acceleration=acceleration), structure)
    found = Posterior(Hypothesis((structure,), ((),)), [nuisances]).innovations(np.zeros(0))
    left = (np.asarray(found.error) / np.sqrt(np.asarray(found.variance)))[N // 2 :, 0]  # once the start is forgotten
    power = np.abs(np.fft.rfft(left * np.hanning(left.size))[2:]) ** 2
    assert np.std(left) == pytest.approx(1.0, abs=0.1)
    assert power.max() < 15 * power.mean()  # of white noise, beyond it in one case of several thousand
