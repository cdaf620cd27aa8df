"""A record: what it accepts, what it refuses, and how it is cut and resampled."""

from typing import Any

import numpy as np
import pytest

from jfsm.records import Record, read

T = np.arange(200) * 0.01
X = np.sin(2 * np.pi * 3.0 * T)


def test_arrays_matrices_and_dictionaries_become_columns_by_ascending_dof():
    record = Record(T, force={3: X, 1: 2 * X}, displacement=np.stack([X, 3 * X], 1), velocity=X)
    assert record.force is not None and record.displacement is not None and record.velocity is not None
    np.testing.assert_array_equal(record.force, np.stack([2 * X, X], 1))
    np.testing.assert_array_equal(record.displacement, np.stack([X, 3 * X], 1))
    assert record.velocity.shape == (200, 1)
    assert record.acceleration is None
    assert record.dofs == 3


def test_channels_list_kinds_in_order_and_responses_leave_the_force_out():
    record = Record(T, acceleration=X, force={2: X}, displacement={2: X, 1: X})
    assert list(record.channels) == [("force", 2), ("displacement", 1), ("displacement", 2), ("acceleration", 1)]
    assert list(record.responses) == [("displacement", 1), ("displacement", 2), ("acceleration", 1)]


def test_a_record_without_channels_has_no_dofs_and_a_clock():
    record = Record(T)
    assert (record.dofs, len(record), record.responses) == (0, 200, {})
    assert record.duration == pytest.approx(1.99)


def test_a_record_keeps_its_own_copy_and_cannot_be_changed():
    mine = X.copy()
    record = Record(T, displacement=mine, base_acceleration=mine)
    mine[:] = 0.0
    np.testing.assert_array_equal(record.channels["displacement", 1], X)
    for array in (record.time, record.displacement, record.channels["displacement", 1], record.base_acceleration):
        assert array is not None
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
    with pytest.raises(TypeError):
        record.channels["force", 1] = X  # pyright: ignore[reportIndexIssue]
    with pytest.raises(AttributeError):
        record.time = T  # pyright: ignore[reportAttributeAccessIssue]


def test_single_precision_and_integers_become_doubles():
    record = Record(T, force=np.arange(200, dtype=np.int16), displacement=X.astype(np.float32))
    assert all(samples.dtype == np.float64 for samples in record.channels.values())


@pytest.mark.parametrize(
    ("kind", "unit", "factor", "coherent"),
    [
        ("displacement", "mm", 1e-3, "m"),
        ("displacement", "in", 0.0254, "m"),
        ("displacement", "deg", np.pi / 180, "rad"),
        ("velocity", "ft/s", 0.3048, "m/s"),
        ("velocity", "rpm", 2 * np.pi / 60, "rad/s"),
        ("acceleration", "g", 9.80665, "m/s²"),
        ("acceleration", "mm/s^2", 1e-3, "m/s²"),
        ("force", "kip", 4448.2216152605, "N"),
        ("force", "lbf", 4.4482216152605, "N"),
        ("force", "kN·m", 1e3, "N m"),
        ("force", "lbf ft", 1.3558179483314, "N m"),
        ("displacement", "mV", 1e-3, "V"),
        ("force", "V", 1.0, "V"),
    ],
)
def test_units_are_converted_to_coherent_ones(kind, unit, factor, coherent):
    arguments: dict[str, Any] = {kind: X}
    record = Record(T, **arguments, units={kind: unit})
    np.testing.assert_allclose(record.channels[kind, 1], factor * X, rtol=1e-14)
    assert record.units[kind] == coherent


def test_time_and_base_acceleration_have_units_too():
    record = Record(1e3 * T, base_acceleration=X, units={"time": "ms", "base_acceleration": "g"})
    assert record.base_acceleration is not None
    np.testing.assert_allclose(record.time, T, rtol=1e-14)
    np.testing.assert_allclose(record.base_acceleration, 9.80665 * X, rtol=1e-14)


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({}, ("N", "m", "m/s", "m/s²")),
        ({"velocity": "deg/s"}, ("N m", "rad", "rad/s", "rad/s²")),
        ({"displacement": "mV"}, ("N", "V", "V/s", "V/s²")),
        ({"acceleration": "V"}, ("N", "V s²", "V s", "V")),
        ({"displacement": "rad", "force": "V"}, ("V", "rad", "rad/s", "rad/s²")),
    ],
)
def test_kinds_without_a_unit_take_the_one_that_goes_with_the_others(given, expected):
    units = Record(T, displacement=X, units=given).units
    assert (units["force"], units["displacement"], units["velocity"], units["acceleration"]) == expected


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        (dict(time=T, force=X[:-1]), ValueError, r"`force` must have as many samples.*\(199,\).*Cut or resample"),
        (dict(time=T, force=np.ones((2, 200))), ValueError, r"it has shape \(2, 200\)\. Pass the transpose"),
        (dict(time=T, force={1: X[:5]}), ValueError, r"`force` must have as many .*\(200,\); .*\(5,\)"),
        (dict(time=T, base_acceleration=np.ones((200, 2))), ValueError, "`base_acceleration` must have as many"),
        (
            dict(time=T, force=np.where(T > 1.0, np.nan, X)),
            ValueError,
            r"`force dof 1` must be finite; 99 of .*t = 1\.01",
        ),
        (dict(time=T, force=np.ma.masked_greater(X, 0.9)), ValueError, "`force dof 1` must be finite"),
        (dict(time=np.where(T > 1, np.inf, T)), ValueError, "`time` must be finite"),
        (dict(time=T[::-1]), ValueError, r"`time` must increase.*goes back at sample 1 \(1\.99 s, then 1\.98 s; 199"),
        (dict(time=np.repeat(T, 2)), ValueError, "`time` must increase.*repeats at sample 1"),
        (dict(time=[]), ValueError, "`time` must be one column of at least 2 samples"),
        (dict(time=np.ones((5, 2))), ValueError, r"`time` must be one column.*\(5, 2\)"),
        (dict(time=T, force=X + 0j), TypeError, "`force` must hold real numbers; it holds complex128"),
        (dict(time=T, force=["a"] * 200), TypeError, "`force` must hold real numbers; it holds <U1"),
        (dict(time=T.astype("datetime64[s]")), TypeError, "`time` must hold real numbers; it holds datetime64"),
        (dict(time=T, force=[[1.0], [1.0, 2.0]]), ValueError, "`force` must be a rectangular array"),
        (dict(time=T, force={0: X}), ValueError, r"`force` given by dof counts from 1 \(0 is ground\); one key is 0"),
        (dict(time=T, force={"a": X}), TypeError, "`force` given by dof must have integers as keys; one is 'a'"),
        (dict(time=T, force={}), ValueError, "`force` must hold at least one channel; it is empty"),
        (dict(time=T, units={"strain": "1"}), ValueError, "`units` must be given by kind, .*; it names 'strain'"),
        (dict(time=T, units={"force": "stone"}), ValueError, "`units` of force must be a unit of force or .*'stone'"),
        (dict(time=T, units={"velocity": "mm"}), ValueError, "`units` of velocity must be a unit of speed.*'mm'"),
        (dict(time=T, units={"displacement": "V/s"}), ValueError, "`units` of displacement must be .*'V/s'"),
        (
            dict(time=T, units={"displacement": "mm", "velocity": "rpm"}),
            ValueError,
            "`units` must give .* one motion .*it gave displacement in m, velocity in rad/s",
        ),
        (dict(time=T, drive="shaker"), ValueError, '`drive` must be "force" or "motion"; it was \'shaker\''),
    ],
)
def test_what_is_no_record_is_refused_with_the_reason(arguments, error, message):
    with pytest.raises(error, match=message):
        Record(**arguments)


def test_a_slice_keeps_the_clock_and_rest_only_from_the_first_sample():
    record = Record(T, displacement=X, base_acceleration=X, at_rest=True, drive="motion", name="run 7")
    part = record[50:150]
    assert (part.time[0], len(part), part.name, part.drive) == (T[50], 100, "run 7", "motion")
    assert part.displacement is not None and part.base_acceleration is not None
    np.testing.assert_array_equal(part.displacement[:, 0], X[50:150])
    np.testing.assert_array_equal(part.base_acceleration, X[50:150])
    assert record[:100].at_rest and not part.at_rest
    assert record[-50:].time[0] == T[150]


def test_until_keeps_the_sample_at_that_instant():
    assert Record(T).until(T[100]).time[-1] == T[100]
    assert Record(T).until(1e9).time[-1] == T[-1]


def test_since_begins_with_the_sample_at_that_instant():
    assert Record(T).since(T[100]).time[0] == T[100]
    assert Record(T).since(-1.0).time[0] == T[0]
    assert not Record(T, at_rest=True).since(T[1]).at_rest


def test_what_is_cut_off_is_noted():
    record = Record(T, displacement=X)
    assert record[50:150].notes == ("Samples 50 to 149 of 200 are kept, t = 0.5 to 1.49 s.",)
    assert record.until(1.0).notes == ("Samples 0 to 100 of 200 are kept, t = 0 to 1 s.",)
    assert record.since(1.0).notes == ("Samples 100 to 199 of 200 are kept, t = 1 to 1.99 s.",)
    assert record[:].notes == record.until(9.0).notes == ()


def test_a_late_channel_is_put_in_time_and_the_others_stay():
    late, at = np.sin(2 * np.pi * 3.0 * (T - 0.004)), ("displacement", 2)
    torn = late.copy()
    torn[70] = 5.0
    record = Record(T, force=X, displacement={1: X, 2: torn}, at_rest=True)
    other = record.aligned({at: 0.004})
    elsewhere = np.arange(T.size) != 70
    np.testing.assert_allclose(other.channels[at][elsewhere], X[elsewhere], atol=5e-3)
    assert other.channels[at][70] == 5.0, "what is torn stays torn"
    np.testing.assert_array_equal(other.channels["displacement", 1], X)
    assert other.at_rest and other.notes == ("displacement 2 is read 0.004 s later.",)
    np.testing.assert_array_equal(record.channels[at], torn)


def test_what_cannot_be_put_in_time_is_refused():
    record = Record(T, displacement=X)
    with pytest.raises(ValueError, match="`late` names .*velocity.*the record has .*displacement"):
        record.aligned({("velocity", 1): 0.01})
    for seconds in (np.nan, 5.0):
        with pytest.raises(ValueError, match="`late` must be shorter than the record"):
            record.aligned({("displacement", 1): seconds})


def test_a_clock_is_shifted_and_says_so():
    record = Record(T, displacement=X, at_rest=True).shifted(-0.25)
    np.testing.assert_array_equal(record.time, T - 0.25)
    np.testing.assert_array_equal(record.channels["displacement", 1], X)
    assert (record.at_rest, record.notes) == (True, ("The clock was put back by 0.25 s.",))
    assert not record.time.flags.writeable
    with pytest.raises(ValueError, match="`seconds` must be a finite time; it was inf"):
        record.shifted(np.inf)


def test_slices_that_are_no_records_are_refused():
    record = Record(T, displacement=X)
    with pytest.raises(TypeError, match=r"A record is sliced, record\[a:b\]; the index was 3"):
        record[3]  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match=r"sliced with step 1; it was 2\..*record.resample\(rate\)"):
        record[::2]
    with pytest.raises(ValueError, match=r"must keep at least 2 of the 200 samples; record\[5:6\] does not"):
        record[5:6]


def test_steps_that_differ_by_up_to_five_percent_are_uniform_and_noted():
    steps = np.where(np.arange(200) % 2, 0.01045, 0.00955)
    record = Record(np.cumsum(steps), displacement=X)
    assert record.dt == pytest.approx(0.01, rel=1e-3)
    assert record.sample_rate == pytest.approx(100, rel=1e-3)
    assert len(record.notes) == 1 and "Time steps differ by up to" in record.notes[0]
    assert Record(T).notes == ()


def test_more_uneven_steps_are_refused_with_the_remedy():
    record = Record(np.delete(T, 100), displacement=np.delete(X, 100))
    with pytest.raises(ValueError, match=r"`time` must have uniform steps.*0.01 and 0.02 s.*record.resample\(100\)"):
        _ = record.dt
    with pytest.raises(ValueError, match="`time` must have uniform steps"):
        _ = Record(np.cumsum(np.where(np.arange(200) % 2, 0.01055, 0.00945))).dt


def _signal(t):
    return 2.0 + np.sin(2 * np.pi * 3.0 * t) + 0.3 * np.cos(2 * np.pi * 7.3 * t + 0.4)


@pytest.mark.parametrize("rate", [25.0, 37.0, 250.0])
def test_resampling_keeps_what_both_clocks_can_carry_up_to_the_ends(rate):
    t = np.arange(4000) * 0.01
    record = Record(t, displacement=_signal(t), acceleration=2 * _signal(t), base_acceleration=_signal(t), at_rest=True)
    other = record.resample(rate)
    assert other.displacement is not None and other.acceleration is not None and other.base_acceleration is not None
    # The stop band of the filter lies below 3e-5.
    np.testing.assert_allclose(other.displacement[:, 0], _signal(other.time), atol=3e-5)
    np.testing.assert_allclose(other.acceleration[:, 0], 2 * _signal(other.time), atol=6e-5)
    np.testing.assert_allclose(other.base_acceleration, _signal(other.time), atol=3e-5)
    assert other.dt == pytest.approx(1 / rate, rel=1e-12)
    assert other.time[0] == t[0] and t[-1] - 1 / rate < other.time[-1] <= t[-1] + 1e-9
    assert other.at_rest and f"Resampled from 100 to {rate:g} Hz." in other.notes


def test_resampling_removes_what_the_slower_clock_would_fold_back():
    t = np.arange(4000) * 0.01
    slow = Record(t, displacement=np.sin(2 * np.pi * 40.0 * t) + np.sin(2 * np.pi * 26.0 * t)).resample(50.0)
    assert slow.displacement is not None
    assert np.max(np.abs(slow.displacement)) < 1e-4


def test_resampling_makes_uneven_time_even_whatever_the_spacing():
    rng = np.random.default_rng(0)
    t = np.cumsum(rng.uniform(0.005, 0.015, 4000))
    t = np.sort(np.concatenate([t, t[100:110] + 1e-7]))  # readings that arrived twice
    record = Record(t, displacement=_signal(t) + 1e-3 * rng.standard_normal(t.size)).resample(50.0)
    assert record.displacement is not None
    assert np.max(np.abs(record.displacement[:, 0] - _signal(record.time))) < 6e-3
    assert record.sample_rate == pytest.approx(50.0)
    assert "by cubic interpolation of uneven samples" in record.notes[-1]


def test_a_gap_that_was_bridged_is_noted_even_where_the_rate_stays():
    t = np.delete(np.arange(400) * 0.01, slice(200, 203))
    other = Record(t, displacement=_signal(t)).resample(100.0)
    assert "by cubic interpolation of uneven samples with gaps of up to 0.04 s." in other.notes[-1]


def test_in_a_long_gap_nothing_is_known():
    """Of ten samples that are missing, none is made up: those between are marked; two are bridged."""
    whole = np.arange(600) * 0.01
    kept = np.ones(600, dtype=bool)
    kept[100:102] = kept[300:310] = False
    t = whole[kept]
    other = Record(t, force=_signal(t), displacement=_signal(t)).resample(100.0)
    np.testing.assert_allclose(other.time, whole, atol=1e-9)
    for key, samples in other.channels.items():
        np.testing.assert_array_equal(np.flatnonzero(other.lost[key]), np.arange(300, 310))
        np.testing.assert_allclose(samples[:299], _signal(whole[:299]), atol=3e-3)
        np.testing.assert_allclose(samples[311:], _signal(whole[311:]), atol=3e-3)
    note = other.notes[-1]
    assert "Within 1 gap of more than two samples, 0.11 s in all, the first from t = 2.99 s on, 10 samples" in note
    assert "The force is not known there either." in note
    half = Record(t, displacement=_signal(t)).resample(50.0)
    np.testing.assert_array_equal(np.flatnonzero(half.lost["displacement", 1]), np.arange(150, 155))


def test_the_date_at_which_the_clock_reads_zero_is_kept(tmp_path):
    record = Record(T, force=X).dated("2024-03-05T14:30:00.000001")
    assert record.begins == np.datetime64("2024-03-05T14:30:00.000001")
    for other in (record[5:], record.noted("a"), record.resample(50.0), record.shifted(3.0)):
        assert other.begins == record.begins
    for suffix in ("csv", "npz", "mat", "h5", "uff"):
        record.write(tmp_path / f"a.{suffix}")
        assert read(tmp_path / f"a.{suffix}").begins == record.begins
    assert record.dated(None).begins is None and Record(T).begins is None
    with pytest.raises(ValueError, match="`begins` must be a date.*it was 'today-ish'"):
        record.dated("today-ish")


def test_resampling_sees_through_time_stamps_that_were_rounded():
    clock = np.arange(4000) * 0.01003
    record = Record(np.round(clock, 3), displacement=_signal(clock))
    other = record.resample(50.0)
    assert other.displacement is not None
    # Read at their rounded stamps the samples would be off by speed times 0.3 ms, 1e-2.
    np.testing.assert_allclose(other.displacement[:, 0], _signal(other.time), atol=1e-3)
    assert "uniform clock was written to 0.001 s only" in other.notes[-1]


@pytest.mark.parametrize("rate", [0.0, -5.0, np.nan, 0.1])
def test_a_rate_that_leaves_no_record_is_refused(rate):
    with pytest.raises(ValueError, match=r"`rate` must be a positive number.*Pass at least 0\.5025"):
        Record(T, displacement=X).resample(rate)


def test_a_record_shows_its_name_length_and_channels():
    shown = repr(Record(T, force=X, displacement={2: X}, name="run 7"))
    assert shown == "<Record 'run 7': 200 samples over 1.99 s; force 1, displacement 2>"


def test_notes_are_added_once():
    assert Record(T).noted("a", "b").noted("a").notes == ("a", "b")
