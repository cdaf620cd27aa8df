"""The mean period of a record of periodic excitation."""

import numpy as np
import pytest

from jfsm.records import Record

LENGTH, COUNT, DT = 200, 8, 0.01
T = np.arange(COUNT * LENGTH) * DT
PHASE = 2 * np.pi * np.arange(LENGTH) / LENGTH
FORCE = np.tile(np.cos(3 * PHASE) + np.sin(7 * PHASE + 1), COUNT)
MOTION = np.tile(np.cos(3 * PHASE + 0.4) + np.sin(7 * PHASE + 2), COUNT)


def noisy(seed, std=0.01):
    return std * np.random.default_rng(seed).standard_normal(T.size)


def test_periods_are_found_and_averaged_on_the_clock_of_the_first():
    base = np.tile(np.sin(PHASE), COUNT)
    record = Record(T + 5, FORCE + noisy(0), {1: MOTION + noisy(1), 3: MOTION}, base_acceleration=base, at_rest=True)
    folded = record.folded(transient=2)
    np.testing.assert_array_equal(folded.time, T[2 * LENGTH : 3 * LENGTH] + 5)
    assert list(folded.channels) == list(record.channels)
    expected = (MOTION + noisy(1)).reshape(COUNT, LENGTH)[2:].mean(axis=0)
    np.testing.assert_allclose(folded.channels["displacement", 1], expected, rtol=1e-14)
    np.testing.assert_allclose(folded.channels["displacement", 3], MOTION[:LENGTH], rtol=1e-13)
    assert folded.base_acceleration is not None
    np.testing.assert_allclose(folded.base_acceleration, base[:LENGTH], atol=1e-15)
    assert not folded.at_rest


def test_notes_say_what_was_averaged_and_how_much_changed():
    record = Record(T, FORCE + noisy(0), MOTION + noisy(1, 0.02), units={"displacement": "mm"}, name="run")
    words = record.noted("as found").folded(transient=4).notes
    assert words[0] == "as found"
    assert words[1] == (
        "Mean of 4 periods of 200 samples (2 s), the first from t = 8 s; 800 samples before them are left out."
    )
    # Four periods of 200 samples tell a standard deviation to 3 %.
    assert words[2].startswith("From period to period changed (standard deviation) force 1 by 0.0")
    force, motion = (float(part.split(" by ")[1].split()[0]) for part in words[2].split(";")[0].split(", "))
    assert (force, motion) == (pytest.approx(0.01, rel=0.12), pytest.approx(0.02e-3, rel=0.12))
    assert words[2].endswith("noise of their mean is 2 times less.")
    assert len(words) == 3


def test_samples_beyond_whole_periods_are_left_out_at_the_beginning():
    record = Record(T, FORCE, MOTION)[50:]
    folded = record.folded(LENGTH)
    np.testing.assert_array_equal(folded.time, T[LENGTH : 2 * LENGTH])
    assert "Mean of 7 periods" in folded.notes[-2] and "150 samples before them" in folded.notes[-2]


def test_a_transient_that_is_left_in_is_told_with_the_remedy():
    decay = np.exp(-T / 1.0) * np.cos(17 * T)
    record = Record(T, FORCE, MOTION + decay + noisy(2, 1e-3))
    told = record.folded().notes[-1]
    # From the fourth period on the decay is less than the noise.
    assert told == "The first 3 of these periods had not settled: folded(transient=3)."
    assert record.folded(transient=1).notes[-1] == told.replace("3 of", "2 of")
    assert not any("settled" in note for note in record.folded(transient=3).notes)


def test_under_imposed_motion_the_period_is_that_of_the_motion():
    record = Record(T, force=np.random.default_rng(1).standard_normal(T.size), displacement=MOTION, drive="motion")
    assert len(record.folded()) == LENGTH


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        (
            dict(period=200.0),
            TypeError,
            r"`period` must be a whole number of samples; it was 200\.0\. If no .*resample",
        ),
        (dict(period=True), TypeError, "`period` must be a whole number of samples; it was True"),
        (dict(period=801), ValueError, "`period` must be between 2 and 800 samples, .*1600.* it was 801"),
        (dict(period=200, transient=7), ValueError, "`transient` must be between 0 and 6, .*8 whole periods.*it was 7"),
        (dict(period=200, transient=-1), ValueError, "`transient` must be between 0 and 6.*it was -1"),
    ],
)
def test_what_leaves_no_two_periods_is_refused(arguments, error, message):
    with pytest.raises(error, match=message):
        Record(T, FORCE, MOTION).folded(**arguments)


@pytest.mark.parametrize("force", [None, np.random.default_rng(3).standard_normal(T.size)])
def test_a_period_that_no_driving_channel_has_must_be_given(force):
    record = Record(T, force, MOTION)
    with pytest.raises(ValueError, match=r"`period` must be given where the driving.*record\.folded\(period=\.\.\.\)"):
        record.folded()
    assert len(record.folded(LENGTH)) == LENGTH


def test_uneven_time_is_refused():
    record = Record(np.delete(T, 100), displacement=np.delete(MOTION, 100))
    with pytest.raises(ValueError, match=r"`time` must have uniform steps.*record\.resample"):
        record.folded(LENGTH)
