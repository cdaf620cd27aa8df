"""The demonstration's record is true to its equations, and its beliefs come from the data."""

import math

import jax
import numpy as np
import pytest
from numpy.lib.stride_tricks import sliding_window_view
from typer.testing import CliRunner

from jfsm import Record, diagnose
from jfsm.cli import app
from jfsm.demo import (
    DAMPING,
    FORCE,
    FRICTION,
    MASS,
    NOISE,
    RATE,
    STIFFNESS,
    Multisine,
    _rub,
    first_guess,
    hidden_friction,
    measured,
)
from jfsm.records import noise_floor, read

DRIVE = Multisine(8.0, 2 * math.pi * np.array([2.0, 5.0, 6.4, 9.0]), np.array([0.3, 1.9, 4.0, 5.5]))
TIME = np.arange(1200) / RATE


@pytest.fixture(scope="module")
def motion() -> dict[str, np.ndarray]:
    return _rub(DRIVE, TIME)


def linear_record(samples: int = 2000, mass: float = 3.0, frequency: float = 8.0, ratio: float = 0.03) -> Record:
    """A linear oscillator under noise of limited band, by its transfer function; 1 % noise on both channels."""
    rng = np.random.default_rng(5)
    rate, omega = 20 * frequency, 2 * math.pi * frequency
    lines = 2 * math.pi * np.fft.rfftfreq(samples, 1 / rate)
    spectrum = np.where((lines > 0) & (lines < 3 * omega), np.exp(2j * math.pi * rng.random(lines.size)), 0.0)
    g = np.fft.irfft(spectrum, samples)
    x = np.fft.irfft(spectrum / (mass * (omega**2 - lines**2 + 2j * ratio * omega * lines)), samples)
    noisy = [y + 0.01 * np.std(y) * rng.standard_normal(samples) for y in (g / np.std(g), x / np.std(g))]
    return Record(np.arange(samples) / rate, force=noisy[0], displacement=noisy[1])


def test_the_made_up_motion_slides_by_its_equation_and_sticks_only_while_friction_can_hold(motion):
    x, v, a, g = (motion[kind] for kind in ("displacement", "velocity", "acceleration", "force"))
    held = v == 0
    assert 10 < np.sum(held) < TIME.size / 2
    balance = MASS * a + DAMPING * v + STIFFNESS * x + FRICTION * np.sign(v) - g
    np.testing.assert_allclose(balance[~held], 0.0, atol=1e-9 * FORCE)
    assert np.all(np.abs(g - STIFFNESS * x)[held] <= FRICTION * (1 + 1e-9))
    assert np.all(a[held] == 0)


def test_the_made_up_velocity_is_the_rate_of_the_displacement_and_the_acceleration_that_of_the_velocity(motion):
    way = np.sign(motion["velocity"])
    smooth = np.all(sliding_window_view(way, 5) == way[2:-2, None], axis=1)  # no reversal among five samples
    assert np.sum(smooth) > TIME.size / 2
    for of, rate in (("displacement", "velocity"), ("velocity", "acceleration")):
        slope = np.convolve(motion[of], np.array([-1, 8, 0, -8, 1]) * RATE / 12, mode="valid")
        error = np.max(np.abs(slope - motion[rate][2:-2])[smooth])
        assert error < 1e-3 * np.max(np.abs(motion[rate]))  # the formula's own: (omega dt)^4 / 30 at the highest line


def test_every_channel_of_the_made_up_record_carries_its_noise():
    record = hidden_friction(3).record
    assert set(record.channels) == {(kind, 1) for kind in ("force", "displacement", "velocity", "acceleration")}
    for y in record.channels.values():
        # 15 %: the scatter of a level that is estimated beside a motion with kinks.
        assert noise_floor(y, record.dt).std == pytest.approx(NOISE * np.std(y), rel=0.15)


def test_the_same_seed_makes_the_same_record():
    first, second = hidden_friction(3, samples=64).record, hidden_friction(3, samples=64).record
    for channel, y in first.channels.items():
        np.testing.assert_array_equal(y, second.channels[channel])


def test_another_seed_makes_another_record():
    first, second = hidden_friction(0, samples=64).record, hidden_friction(1, samples=64).record
    assert first.force is not None and second.force is not None
    assert not np.allclose(first.force, second.force)


def test_a_first_guess_is_close_where_the_truth_is_linear():
    values = first_guess(linear_record()).values()
    omega = 2 * math.pi * 8.0
    assert values["mass@1"] == pytest.approx(3.0, rel=0.05)
    assert values["stiffness@0-1.k"] == pytest.approx(3.0 * omega**2, rel=0.05)
    assert values["damping@0-1.c"] == pytest.approx(2 * 3.0 * 0.03 * omega, rel=0.3)  # leakage widens the resonance


def test_a_first_guess_does_not_depend_on_units():
    record = linear_record()
    assert record.force is not None and record.displacement is not None
    scaled = Record(10 * record.time, force=5 * record.force, displacement=1e3 * record.displacement)
    factors = {"mass@1": 5e-3 * 100, "stiffness@0-1.k": 5e-3, "damping@0-1.c": 5e-3 * 10}
    for path, value in first_guess(record).values().items():
        assert first_guess(scaled).values()[path] == pytest.approx(factors[path] * value, rel=1e-6)


def test_channels_that_are_the_wrong_way_round_show_no_resonance():
    record = linear_record()
    swapped = Record(record.time, force=record.displacement, displacement=record.force)
    with pytest.raises(ValueError, match="must show a resonance.*Check which channel is which"):
        first_guess(swapped)


def test_a_record_without_a_displacement_allows_no_first_guess():
    record = linear_record()
    with pytest.raises(ValueError, match="`record` must hold displacement 1; it holds force 1"):
        first_guess(Record(record.time, force=record.force))


def test_a_measured_record_is_diagnosed_at_its_beginning_and_judged_on_its_last_quarter(tmp_path):
    record = linear_record(801)
    record.write(tmp_path / "run.npz")
    shown = measured(read(tmp_path / "run.npz", force="force_1", displacement="displacement_1"), most=500)
    assert isinstance(shown.holdout, Record)
    assert (len(shown.record), len(shown.holdout)) == (500, 201)
    assert shown.holdout.time[-1] == record.time[-1]
    assert "first 500 samples" in shown.introduction and "last 201" in shown.introduction
    assert shown.model.values()["mass@1"] == pytest.approx(3.0, rel=0.02)
    whole = measured(read(tmp_path / "run.npz", force="force_1", displacement="displacement_1"))
    assert len(whole.record) == 600  # what is held out is never fitted


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_the_demonstration_finds_the_friction_that_it_hid(seed, tmp_path):
    page = tmp_path / "page.html"
    run = CliRunner().invoke(app, ["demo", "--report", str(page), "--key", str(seed)])
    assert run.exit_code == 0, run.output
    assert "lacks Coulomb friction at link ground–1" in " ".join(run.stdout.split())
    assert f"Coulomb friction of {FRICTION:g} N" in run.stdout
    assert page.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")


@pytest.mark.slow
def test_a_measured_circuit_hardens_with_the_cube_of_its_displacement(shared_data):
    path = shared_data / "silverbox" / "silverbox_multisine.npz"
    shown = measured(read(path, force="u", displacement="y", units={"u": "V", "y": "V"}), most=3000)
    d = diagnose(shown.record, shown.model, shown.holdout, key=jax.random.key(0))
    assert [finding.cause for finding in d.findings] == ["cubic_hardening"]
    assert d.gain is not None and d.gain.closed > 0.9
