"""Sensor faults in records of plants that the library does not know; `benchmarks/inspection.py` has all of them."""

import numpy as np
import pytest

from benchmarks.inspection import FAULTS, Truth, judged, measured, truth


@pytest.fixture(scope="module", params=[("none", "multisine"), ("coulomb", "sweep"), ("cubic_hardening", "multisine")])
def plant(request) -> Truth:
    return truth(7, *request.param)


def test_a_sound_record_raises_no_warning(plant):
    for seed, level in enumerate((0.001, 0.005, 0.02)):
        record, _ = measured(plant, np.random.default_rng(seed), level)
        assert judged(record.inspect(), plant, "none", "") == {"false": False}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_found_on_its_channel_and_on_no_other(plant, fault):
    for seed, on in enumerate(FAULTS[fault]):
        record, _ = measured(plant, np.random.default_rng(seed), 0.005, fault, on)
        assert judged(record.inspect(), plant, fault, on) == {"found": True, "blamed": False}, on


def test_noise_is_known_within_its_error(plant):
    for seed, level in enumerate((0.001, 0.01, 0.05)):
        record, noise = measured(plant, np.random.default_rng(seed), level)
        for channel in record.inspect().channels:
            assert channel.noise is not None and channel.noise_error is not None
            true = noise[channel.channel.split()[0]]
            assert channel.noise == pytest.approx(true, rel=0.15 if plant.cause == "none" else 0.25)
            assert channel.noise == pytest.approx(true, abs=4.0 * channel.noise_error)
