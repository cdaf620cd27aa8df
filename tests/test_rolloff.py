"""Spectra above the signal: of white noise, of noise with a memory, and of what bends slowly."""

import numpy as np
import pytest
from scipy.signal import lfilter

from jfsm.records import rolloff

N = 3000


def remembering(memory: float, seed: int, n: int = N) -> np.ndarray:
    """Noise of unit variance."""
    white = np.random.default_rng(seed).standard_normal(n + 300)
    return np.sqrt(1 - memory**2) * np.asarray(lfilter([1.0], [1.0, -memory], white))[300:]


@pytest.mark.parametrize("memory", [0.8, 0.9, 0.97])
def test_noise_with_a_memory_falls_like_a_random_walk_and_its_density_is_told(memory):
    found = [rolloff(remembering(memory, seed)) for seed in range(20)]
    assert min(one.nats for one in found) > 20
    phase = 3 * (1 - memory)  # [rad] above the corner
    density = (1 - memory**2) / (1 + memory**2 - 2 * memory * np.cos(phase))
    assert np.mean([one.density(phase) for one in found]) == pytest.approx(density, rel=0.25)


def test_white_noise_does_not_fall_and_a_slow_signal_in_it_neither():
    slow = np.sin(np.linspace(0.0, 60.0, N)) ** 3
    for seed in range(20):
        white = np.random.default_rng(seed).standard_normal(N)
        assert rolloff(white).nats < -20
        assert rolloff(slow + 0.01 * white).nats < -20


def test_a_channel_that_is_dead_tells_nothing():
    assert rolloff(np.zeros(N)).nats < 3 and rolloff(np.zeros(N)).density(0.1) == 0
