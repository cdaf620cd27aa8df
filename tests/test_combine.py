"""Records made into one: pieces one after another, and channels of several clocks side by side."""

import numpy as np
import pytest

import jfsm
from jfsm.records import Record

T = np.arange(3000) * 0.01
LOW = 2.0


def wave(t, frequency=LOW):
    return 1.5 + np.sin(2 * np.pi * frequency * t) + 0.3 * np.cos(2 * np.pi * 0.37 * frequency * t + 1)


def whole(**options):
    channels = {"force": wave(T), "displacement": {2: 2 * wave(T)}, "base_acceleration": 3 * wave(T)}
    return Record(T, **channels, at_rest=True, name="run 7", **options)


def test_pieces_of_a_run_are_joined_to_what_it_was():
    record = whole(drive="motion", units={"displacement": "V"})
    joined = jfsm.join([record[:700], record[700:2100], record[2100:]])
    np.testing.assert_array_equal(joined.time, record.time)
    assert list(joined.channels) == list(record.channels)
    for key, samples in record.channels.items():
        np.testing.assert_array_equal(joined.channels[key], samples)
    np.testing.assert_array_equal(joined.base_acceleration, record.base_acceleration)
    assert (joined.at_rest, joined.drive, joined.name) == (True, "motion", "run 7")
    assert joined.units["displacement"] == "V"
    assert "Samples 700 to 2099 of 3000 are kept, t = 7 to 20.99 s." in joined.notes
    assert joined.notes[-1].startswith("Joined from 3 pieces: 'run 7' to t = 6.99 s, 'run 7' to t = 20.99 s, ")


def test_a_clock_that_began_anew_is_put_right_first():
    record = whole()
    again = Record(T[:1000], wave(T[2000:]), {2: wave(T[2000:])}, base_acceleration=wave(T[2000:]))
    joined = jfsm.join([record[:2000], again.shifted(20.0)])
    np.testing.assert_allclose(joined.time, T, atol=1e-12)
    assert "The clock was put forward by 20 s." in joined.notes


def test_a_jittering_clock_is_joined():
    jitter = T + 2e-4 * np.random.default_rng(0).uniform(-1, 1, T.size)
    record = Record(jitter, displacement=wave(jitter))
    assert len(jfsm.join([record[:40], record[40:]])) == 3000


def other(**changes):
    given = {"time": T[:500] + 10.0, "force": wave(T[:500]), **changes}
    return Record(**given)


@pytest.mark.parametrize(
    ("after", "message"),
    [
        (
            other(time=T[:500]),
            r"must follow one another on one clock; number 2 begins at 0 s, number 1 ends at 9\.99 s",
        ),
        (other(time=T[:500] + 9.99), r"begins at 9\.99 s, .*record\.shifted\(seconds\)\. .*fit or diagnose the list"),
        (
            other(time=T[:500] + 10.5),
            r"without a gap; number 2 begins at 10\.5 s, 0\.51 s after.*fit or diagnose the l",
        ),
        (other(velocity=wave(T[:500])), "must agree in channels; number 2 has force 1, velocity 1, not force 1. Read"),
        (other(units={"force": "V"}), "must agree in unit of force; number 2 has V, not N"),
        (other(drive="motion"), "must agree in drive; number 2 has motion, not force"),
        (
            other(time=10 + 0.9 * T[:500]),
            r"must agree in rate; number 2 has 111\.111 Hz, not 100 Hz\. .*record\.resample",
        ),
    ],
)
def test_what_is_no_run_in_pieces_is_refused_with_what_to_do(after, message):
    with pytest.raises(ValueError, match=f"`records` .*{message}"):
        jfsm.join([Record(T[:1000], wave(T[:1000])), after])


@pytest.mark.parametrize("together", [jfsm.join, jfsm.align])
def test_what_are_no_records_is_refused(together):
    with pytest.raises(TypeError, match="`records` must hold records; one is str"):
        together(["run7.csv"])
    with pytest.raises(ValueError, match="`records` must hold at least one record; it is empty"):
        together([])


FAST, SLOW = np.arange(20_000) * 1e-3, 0.4 + np.arange(1500) / 90.0


@pytest.mark.parametrize("rate", [None, 90.0, 200.0, 1000.0, 1500.0])
def test_channels_of_several_clocks_come_to_one_time_base(rate):
    fast = Record(FAST, force=wave(FAST), base_acceleration=-wave(FAST), at_rest=True, name="fast")
    slow = Record(SLOW, displacement={2: wave(SLOW)}, velocity={2: 4 * wave(SLOW)}, units={"velocity": "mm/s"})
    record = jfsm.align([fast, slow], rate)
    assert list(record.channels) == [("force", 1), ("displacement", 2), ("velocity", 2)]
    assert record.sample_rate == pytest.approx(rate or 1000.0, rel=1e-9)
    assert record.time[0] == SLOW[0] and SLOW[-1] - 1 / 90 < record.time[-1] <= SLOW[-1] + 1e-9
    # The stop band of the filter lies below 3e-5; the slow channel continues beyond its ends by prediction.
    inside = slice(40, -40)
    np.testing.assert_allclose(record.channels["force", 1], wave(record.time), atol=1e-4)
    assert record.base_acceleration is not None
    np.testing.assert_allclose(record.base_acceleration, -wave(record.time), atol=1e-4)
    np.testing.assert_allclose(record.channels["displacement", 2][inside], wave(record.time)[inside], atol=1e-4)
    np.testing.assert_allclose(record.channels["velocity", 2][inside], 4e-3 * wave(record.time)[inside], atol=4e-7)
    assert (record.units["velocity"], record.name, record.at_rest) == ("m/s", "fast", False)
    told = {note.split(":")[0]: note for note in record.notes}
    assert set(told) >= {"force 1", "displacement 2", "velocity 2", "base_acceleration"}
    kept = "displacement 2" if rate == 90.0 else "force 1" if rate in (None, 1000.0) else None
    for channel, native in (("force 1", 1000), ("displacement 2", 90)):
        done = (
            f"Kept as sampled, at {native} Hz" if channel == kept else f"Resampled from {native} to {rate or 1000:g} Hz"
        )
        assert told[channel] == f"{channel}: {done}."
    assert record.notes[-1].startswith("2 records are aligned over the time they share, t = 0.4 to 17.0")


def test_what_the_common_clock_cannot_carry_does_not_fold_back():
    fast = Record(FAST, force=np.sin(2 * np.pi * 70.0 * FAST))
    record = jfsm.align([Record(SLOW, displacement=wave(SLOW)), fast])
    assert record.sample_rate == pytest.approx(90.0)
    assert np.max(np.abs(record.channels["force", 1])) < 1e-4


def test_samples_that_lie_on_the_common_clock_are_kept_to_the_bit():
    force, motion = Record(T + 3, wave(T)), Record(T[100:] + 3, displacement=wave(T[100:]), at_rest=True)
    record = jfsm.align([force, motion])
    np.testing.assert_array_equal(record.channels["force", 1], wave(T)[100:])
    np.testing.assert_array_equal(record.channels["displacement", 1], wave(T)[100:])
    assert record.at_rest  # the record that begins last is


def test_a_known_offset_of_a_clock_is_put_right_and_told():
    late = Record(SLOW + 0.0317, displacement=wave(SLOW))
    record = jfsm.align([Record(FAST, force=wave(FAST)), late.shifted(-0.0317)])
    inside = slice(400, -400)
    np.testing.assert_allclose(record.channels["displacement", 1][inside], wave(record.time)[inside], atol=1e-4)
    assert "The clock was put back by 0.0317 s." in record.notes


def test_uneven_samples_come_to_the_common_clock():
    uneven = np.cumsum(np.random.default_rng(0).uniform(0.005, 0.015, 1500))
    record = jfsm.align([Record(FAST, force=wave(FAST)), Record(uneven, displacement=wave(uneven))], rate=100.0)
    np.testing.assert_allclose(record.channels["displacement", 1], wave(record.time), atol=2e-3)
    assert any("displacement 1: Resampled" in note and "cubic interpolation of uneven" in note for note in record.notes)


@pytest.mark.parametrize(
    ("second", "message"),
    [
        (
            Record(T + 50, displacement=wave(T)),
            r"must share a stretch of time; they are number 1 from 0 to 29\.99 s, nu",
        ),
        (Record(T, force=wave(T)), "must measure every channel once; number 2 has force 1 again"),
        (Record(T, base_acceleration=wave(T)), "must measure every channel once; number 2 has base_acceleration again"),
        (Record(T, {2: wave(T)}, units={"force": "V"}), "must agree in unit of force; number 2 has V, not N"),
        (Record(T, displacement=wave(T), drive="motion"), "must agree in drive; number 2 has motion, not force"),
    ],
)
def test_what_makes_no_one_record_is_refused(second, message):
    with pytest.raises(ValueError, match="`records` " + message):
        jfsm.align([Record(T, wave(T), base_acceleration=wave(T)), second])


@pytest.mark.parametrize("rate", [0.0, -1.0, np.nan])
def test_a_rate_that_is_none_is_refused(rate):
    with pytest.raises(ValueError, match="`rate` must be a positive number of samples per second"):
        jfsm.align([whole()], rate)


DAY = "2024-03-05T14:30:0"


def test_clocks_with_dates_are_put_together_by_them():
    """Both read zero at their own first sample, three seconds apart."""
    force = Record(T[:2000], force=wave(T[:2000]), name="A").dated(DAY + "0.5")
    motion = Record(T[:2000], displacement=wave(T[300:2300]), name="B").dated(DAY + "3.5")
    both = jfsm.align([force, motion])
    assert (both.time[0], both.time[-1]) == pytest.approx((3.0, T[1999]), abs=1e-9)
    np.testing.assert_allclose(both.channels["force", 1], both.channels["displacement", 1], atol=1e-9)
    assert both.begins == force.begins
    told = "The clock of 'B' reads zero 3 s after that of 'A', by the dates of both; it is put forward."
    assert told in both.notes
    other = jfsm.align([motion, force])
    np.testing.assert_allclose(other.channels["force", 1], other.channels["displacement", 1], atol=1e-9)
    assert any("3 s before" in note for note in other.notes)
    as_read = jfsm.align([force, motion.dated(None)])
    assert as_read.time[0] == 0 and any("Only 'A' says when" in note for note in as_read.notes)


def test_clocks_whose_dates_share_no_time_are_refused_with_the_difference():
    force = Record(T, force=wave(T), name="A").dated("2024-03-05T14:30")
    motion = Record(T, displacement=wave(T), name="B").dated("2024-03-05T15:30:00.25")
    with pytest.raises(ValueError, match=r"zero 3600\.25 s after that of 'A'.*record\.dated\(None\)"):
        jfsm.align([force, motion])


def test_pieces_with_dates_are_joined_by_them():
    record = Record(T, force=wave(T)).dated(DAY + "0")
    second = Record(T[:1000], force=wave(T[2000:])).dated("2024-03-05T14:30:20")
    np.testing.assert_allclose(jfsm.join([record[:2000], second]).time, T, atol=1e-9)
