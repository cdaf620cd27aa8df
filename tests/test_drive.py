"""The force between its samples."""

import numpy as np
import pytest

import jfsm
from jfsm.plant import bucket, excitation
from jfsm.plant._drive import reconstruct

METHODS = ("band-limited", "linear", "hold")
EDGE = 32  # half width of the band-limited reconstruction: within it of an end the signal has to be guessed


def fine_grid(n: int, factor: int) -> np.ndarray:
    return np.arange((n - 1) * factor + 1) / factor


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("factor", [1, 2, 8])
@pytest.mark.parametrize("n", [2, 3, 50])
def test_the_samples_themselves_are_kept(method, factor, n):
    samples = np.random.default_rng(1).standard_normal((n, 2))
    fine = reconstruct(samples, factor, method)
    assert fine.shape == ((n - 1) * factor + 1, 2)
    assert np.array_equal(fine[::factor], samples)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("n", [2, 5, 200])
def test_a_constant_stays_constant(method, n):
    np.testing.assert_allclose(reconstruct(np.full((n, 1), 3.7), 8, method), 3.7, rtol=1e-14)


@pytest.mark.parametrize("method", ["band-limited", "linear"])
def test_a_straight_line_stays_straight_up_to_both_ends(method):
    samples = 2.0 + 0.5 * np.arange(100.0)[:, None]
    # The taps are normalised for constants; what they leave of a slope is their stop band.
    np.testing.assert_allclose(reconstruct(samples, 4, method)[:, 0], 2.0 + 0.5 * fine_grid(100, 4), atol=2e-4)


@pytest.mark.parametrize("samples_per_period", [3.0, 4.5, 9.0, 40.0])
def test_a_band_limited_force_is_found_again_between_its_samples(samples_per_period):
    n, factor = 400, 8
    signal = lambda k: np.cos(2 * np.pi * k / samples_per_period + 0.3)  # noqa: E731
    error = reconstruct(signal(np.arange(n))[:, None], factor)[:, 0] - signal(fine_grid(n, factor))
    inside = slice(EDGE * factor, -EDGE * factor)
    assert np.max(np.abs(error[inside])) < 1e-4, "the stop band is at -90 dB"


def test_a_band_limited_force_is_linear_in_its_samples():
    samples = np.random.default_rng(2).standard_normal((90, 2))
    both = reconstruct(samples[:, :1] + 3.0 * samples[:, 1:], 4)
    apart = reconstruct(samples, 4)
    np.testing.assert_allclose(both[:, 0], apart[:, 0] + 3.0 * apart[:, 1], atol=1e-13)


def test_reversing_time_reverses_a_band_limited_force():
    samples = np.random.default_rng(3).standard_normal((90, 1))
    np.testing.assert_allclose(reconstruct(samples[::-1], 4), reconstruct(samples, 4)[::-1], atol=1e-13)


def test_the_error_of_a_linear_force_falls_with_the_square_of_the_step():
    errors = []
    for n in (101, 201, 401):
        t = np.linspace(0.0, 10.0, n)
        fine = np.linspace(0.0, 10.0, (n - 1) * 4 + 1)
        errors.append(np.max(np.abs(reconstruct(np.sin(t)[:, None], 4, "linear")[:, 0] - np.sin(fine))))
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx([2.0, 2.0], abs=0.05)


def test_a_held_force_keeps_each_sample_until_the_next():
    assert reconstruct(np.array([[1.0], [5.0], [2.0]]), 3, "hold")[:, 0].tolist() == [1, 1, 1, 5, 5, 5, 2]


def record(n: int = 90, **channels) -> jfsm.Record:
    samples = np.random.default_rng(4).standard_normal(n)
    return jfsm.Record(time=5.0 + 0.1 * np.arange(n), **(channels or {"force": samples}))


@pytest.mark.parametrize("method", ["band-limited", "linear"])
def test_each_interval_of_a_drive_begins_where_the_one_before_it_ends(method):
    inputs = excitation(record(), 1, 4, method)
    assert inputs.substeps == 4
    np.testing.assert_array_equal(inputs.force[1:, 0], inputs.force[:-1, -1])
    np.testing.assert_array_equal(inputs.force[:, 0, 0], record().channels["force", 1])


def test_a_held_drive_is_constant_in_every_interval_and_jumps_between_them():
    inputs = excitation(record(), 1, 2, "hold")
    np.testing.assert_array_equal(inputs.force[..., 0], np.repeat(record().channels["force", 1][:, None], 5, axis=1))


def test_a_drive_does_not_depend_on_what_comes_after_the_record_ends():
    ramp = jfsm.Record(time=np.arange(90.0), force=np.arange(90.0))
    inputs = excitation(ramp, 1, 1)
    np.testing.assert_allclose(inputs.force[:-1, 1, 0], np.arange(89) + 0.5, atol=2e-4)


def test_a_drive_runs_on_the_clock_of_the_record_and_is_padded_with_its_last_value():
    inputs = excitation(record(), 2, 2, length=112)
    assert inputs.force.shape == (112, 5, 2)
    assert np.all(inputs.force[89:, :, 0] == inputs.force[88, -1, 0]), "what a late sensor would have shown next"
    assert not np.any(inputs.force[:, :, 1]), "no force is applied where none is measured"
    np.testing.assert_allclose(inputs.time, 5.0 + 0.1 * np.arange(112), rtol=1e-13)


def test_the_motion_of_the_base_is_part_of_the_drive():
    base = np.sin(np.arange(90.0))
    inputs = excitation(record(base_acceleration=base), 1, 2)
    np.testing.assert_array_equal(inputs.base[:90, 0], base)
    assert not np.any(inputs.force)


@pytest.mark.parametrize("n", [2, 64, 65, 80, 81, 128, 129, 160, 161, 1000, 5001])
def test_padding_takes_at_most_a_quarter_more_and_a_padded_length_stays(n):
    padded = bucket(n)
    assert padded >= n
    assert padded == 64 or padded <= 1.25 * n
    assert bucket(padded) == padded
