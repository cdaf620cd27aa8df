"""What soiled records hold, beside the clean ones."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from . import CAUSES, DIRT, draw, soiled
from .dirt import LATE, LEVELS, LOUD, SHORT, TAKEN_FOR, TORN

CLEAN = draw(5, causes="cubic_hardening", noise=0.01, channels="xva", excitation="multisine")


def rms(y: np.ndarray) -> float:
    return float(np.sqrt(np.mean(y**2)))


@pytest.mark.parametrize("dirt", DIRT)
def test_a_soiled_challenge_asks_the_same_and_is_the_same_again(dirt: str):
    one, other = soiled(CLEAN, dirt), soiled(CLEAN, dirt)
    assert (one.cause, one.parameters, one.model) == (CLEAN.cause, CLEAN.parameters, CLEAN.model)
    for kind, y in one.channels.items():
        np.testing.assert_array_equal(y, other.channels[kind])
        assert y.shape == one.time.shape == one.motion.x.shape == one.clean[kind].shape
    assert any(y.size != CLEAN.time.size or np.any(y != CLEAN.channels[kind]) for kind, y in one.channels.items())


def test_coloured_noise_is_as_strong_and_remembers_ten_samples():
    found = soiled(CLEAN, "coloured")
    for kind, floor in found.noise_floor.items():
        assert floor == pytest.approx(CLEAN.noise_floor[kind], rel=0.2)
        e = found.channels[kind] - found.clean[kind]
        assert np.corrcoef(e[1:], e[:-1])[0, 1] == pytest.approx(0.9, abs=0.03)


def test_a_quantised_channel_has_fifteen_steps_in_its_rms():
    for kind, y in soiled(CLEAN, "quantised").channels.items():
        steps = y * LEVELS / rms(CLEAN.clean[kind])
        np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)


def test_one_sample_in_a_hundred_is_torn_far_out_of_a_response_and_none_of_the_force():
    found = soiled(CLEAN, "outliers")
    np.testing.assert_array_equal(found.channels["force"], CLEAN.channels["force"])
    for kind in ("displacement", "velocity", "acceleration"):
        away = np.abs(found.channels[kind] - CLEAN.channels[kind]) / rms(CLEAN.clean[kind])
        assert np.mean(away > 0) == pytest.approx(TORN, abs=1e-3) and np.min(away[away > 0]) > 3.9


def test_a_short_record_is_the_beginning_of_the_long_one():
    found = soiled(CLEAN, "short")
    assert found.time.size == SHORT
    np.testing.assert_array_equal(found.channels["velocity"], CLEAN.channels["velocity"][:SHORT])


def test_a_loud_record_has_ten_per_cent_of_noise():
    found = soiled(CLEAN, "loud")
    for kind, floor in found.noise_floor.items():
        assert floor == pytest.approx(LOUD * rms(CLEAN.clean[kind]), rel=0.1) and found.noise == LOUD


def test_one_response_drifts_slowly_and_no_other():
    found = soiled(CLEAN, "drift")
    (kind,) = [kind for kind, y in found.channels.items() if np.any(y != CLEAN.channels[kind])]
    away = found.channels[kind] - CLEAN.channels[kind]
    assert kind != "force" and 0.03 < np.max(np.abs(away)) / rms(CLEAN.clean[kind]) < 0.45
    assert np.max(np.abs(np.diff(away, 2))) < 1e-4 * np.max(np.abs(away))


@pytest.mark.parametrize("cause", ["cubic_hardening", "accel_bias", "none"])
def test_one_response_is_half_a_sample_late_and_nothing_else_of_it_changes(cause: str):
    seen = set()
    for seed in range(5):
        clean = draw(seed, causes=cause, noise=0.01, channels="xva", excitation="sweep")
        found = soiled(clean, "late")
        (kind,) = [kind for kind, y in found.channels.items() if np.any(y != clean.channels[kind])]
        before = clean.time[1:] - LATE * clean.time[1]
        expected = CubicSpline(clean.time, clean.clean[kind])(before)
        # A spline through the samples is good to a few per cent of what half a sample changes.
        np.testing.assert_allclose(found.clean[kind][5:], expected[4:], atol=0.01 * rms(expected))
        seen.add(kind)
    assert len(seen) > 1 and "force" not in seen


@pytest.mark.parametrize("dirt", TAKEN_FOR)
def test_a_fault_that_the_dirt_undoes_is_not_asked_for(dirt: str):
    cause = TAKEN_FOR[dirt][0]
    assert cause in CAUSES
    with pytest.raises(ValueError, match=cause):
        soiled(draw(1, causes=cause), dirt)


def test_unknown_dirt_is_refused_by_name():
    with pytest.raises(ValueError, match="`dirt` must be one of"):
        soiled(CLEAN, "dust")
