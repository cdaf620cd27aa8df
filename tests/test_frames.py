"""Tables and labelled arrays in memory: into a record and back."""

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest
import xarray as xr

from jfsm.records import Record, read

N = 50
T = np.arange(N) * 0.005
F, X = np.cos(30 * T), np.sin(30 * T)
BEGAN = pd.Timestamp("2024-03-05 14:30:00")


def _frame(index=None, **columns):
    return pd.DataFrame(columns or {"F [kN]": F, "x [mm]": X}, index=index)


def _is_right(record):
    np.testing.assert_allclose(record.time - record.time[0], T, atol=2e-9)
    np.testing.assert_allclose(record.channels["force", 1], 1e3 * F)
    np.testing.assert_allclose(record.channels["displacement", 1], 1e-3 * X)


@pytest.mark.parametrize(
    "index",
    [
        pd.Index(T, name="time"),
        pd.Index(T),
        pd.DatetimeIndex(BEGAN + pd.to_timedelta(T, unit="s"), name="logged"),
        pd.DatetimeIndex(BEGAN + pd.to_timedelta(T, unit="s")).tz_localize("Europe/Vienna"),
        pd.to_timedelta(T, unit="s"),
    ],
    ids=["named", "numbers", "dates", "zone", "timedelta"],
)
def test_an_index_of_instants_is_the_clock(index):
    _is_right(read(_frame(index), force="F", displacement="x"))


def test_the_date_at_which_an_index_begins_stands_in_a_note():
    record = read(_frame(pd.DatetimeIndex(BEGAN + pd.to_timedelta(T, unit="s"))), force="F")
    assert "The clock reads zero at 2024-03-05 14:30:00.000000000." in record.notes


def test_a_column_is_the_clock_where_the_index_numbers_rows():
    frame = _frame(**{"Time (ms)": 1e3 * T, "F [kN]": F, "x [mm]": X})
    _is_right(read(frame, force="F", displacement="x"))
    _is_right(Record.from_dataframe(frame.iloc[:, 1:], force="F", displacement="2", rate=200))


def test_rows_that_were_dropped_are_told_of():
    frame = _frame().drop(index=[7, 8])
    record = read(frame, force="F", rate=200)
    assert any("goes from 6 to 9" in note for note in record.notes)


def test_units_stand_below_the_names_or_in_attrs():
    below = pd.DataFrame(
        {("time", "s"): T, ("F", "kN"): F, ("x", "mm"): X},
    )
    _is_right(read(below, force="F", displacement="x"))
    beside = _frame(pd.Index(T), F=F, x=X)
    beside.attrs["units"] = {"F": "kN", "x": "mm"}
    _is_right(read(beside, force="F", displacement="x"))


def test_levels_of_headings_and_of_the_index_are_names():
    frame = pd.concat({"A": _frame(pd.Index(T, name="time")), "B": 2 * _frame(pd.Index(T, name="time"))}, names=["run"])
    _is_right(read(frame, force="F", displacement="x", where={"run": "A"}))
    wide = pd.DataFrame({("rig", "F (kN)"): F, ("rig", "x (mm)"): X}, index=pd.Index(T))
    _is_right(read(wide, force="rig/F", displacement="rig/x"))


def test_whole_numbers_with_missing_ones_are_gaps():
    whole = pd.array([1, None, *range(N - 2)], dtype="Int64")
    with pytest.raises(ValueError, match="must be finite; 1 of 50"):
        read(_frame(pd.Index(T), F=whole), force="F")


def test_a_date_that_is_missing_is_refused():
    index = pd.DatetimeIndex([BEGAN, pd.NaT, *(BEGAN + pd.to_timedelta(T[2:], unit="s"))])
    with pytest.raises(ValueError, match="`time` must be finite; 1 of 50"):
        read(_frame(index), force="F")


def test_text_in_a_frame_is_no_channel_but_may_be_a_clock():
    frame = _frame(**{"when": [str(BEGAN + pd.Timedelta(seconds=t)) for t in T], "F [kN]": F, "x [mm]": X})
    _is_right(read(frame, force="F", displacement="x", time="when"))
    with pytest.raises(ValueError, match="'when' must hold numbers"):
        read(frame, force="when", rate=200)


@pytest.mark.parametrize("make", [pl.DataFrame, pa.table, lambda c: pl.DataFrame(c).lazy()], ids=["pl", "pa", "lazy"])
def test_other_tables_are_read_alike(make):
    _is_right(read(make({"Time (s)": T, "F [kN]": F, "x [mm]": X}), force="F", displacement="x"))
    stamps = np.datetime64("2024-03-05") + (T * 1e9).astype("timedelta64[ns]")
    _is_right(read(make({"logged": stamps, "F [kN]": F, "x [mm]": X}), time="logged", force="F", displacement="x"))


def test_a_series_is_a_channel():
    record = read(pd.Series(F, index=pd.Index(T), name="F [kN]"), force="F")
    np.testing.assert_allclose(record.channels["force", 1], 1e3 * F)


def test_a_dataset_has_clocks_and_units_in_its_coordinates():
    stamps = np.datetime64("2024-03-05") + (T * 1e9).astype("timedelta64[ns]")
    for clock in (T, stamps):
        held = xr.Dataset(
            {"F": ("time", F, {"units": "kN"}), "x": (("dof", "time"), [X, 2 * X], {"units": "mm"})}, {"time": clock}
        )
        record = read(held, force="F", displacement="x")
        _is_right(record)
        np.testing.assert_allclose(record.channels["displacement", 2], 2e-3 * X)


def test_variables_over_different_instants_are_refused_together():
    held = xr.Dataset(
        {"F": ("fast", F), "x": ("slow", X)},
        {"fast": np.datetime64("2024-03-05T00:00:00") + (T * 1e9).astype("timedelta64[ns]"),
         "slow": np.datetime64("2024-03-05T00:00:03") + (T * 1e9).astype("timedelta64[ns]")},
    )  # fmt: skip
    with pytest.raises(ValueError, match=r"3 s apart"):
        read(held, force="F", displacement="x")


def test_columns_of_dates_that_begin_apart_are_not_put_side_by_side(tmp_path):
    """Both count from their own first instant, so that their seconds are the same."""
    rows = "".join(
        f"2024-03-05 14:30:{0.1 * i:06.3f},{i},2024-03-05 14:30:{3 + 0.1 * i:06.3f},{-i}\n" for i in range(N)
    )
    (tmp_path / "two.csv").write_text("DateTime,a [g],DateTime,b [g]\n" + rows)
    with pytest.raises(ValueError, match=r"3 s apart"):
        read(tmp_path / "two.csv", acceleration={1: "a", 2: "b"})


def test_a_data_array_is_a_channel():
    record = read(xr.DataArray(F, {"t": T}, name="F", attrs={"units": "kN"}), force="F")
    np.testing.assert_allclose(record.channels["force", 1], 1e3 * F)
    np.testing.assert_allclose(record.time, T)


@pytest.mark.parametrize("time", [T, T + 3.0, T**1.1])
def test_a_frame_given_out_is_taken_back(time):
    record = Record(time, {3: F}, np.stack([X, F], 1), base_acceleration=F, units={"displacement": "mm"})
    frame = record.to_dataframe()
    assert list(frame.columns) == ["force_3", "displacement_1", "displacement_2", "base_acceleration"]
    assert frame.attrs["units"]["displacement_1"] == "m"
    again = read(frame)
    np.testing.assert_array_equal(again.time, record.time)
    assert dict(again.channels).keys() == dict(record.channels).keys()
    for key, samples in record.channels.items():
        np.testing.assert_array_equal(again.channels[key], samples)
    assert dict(again.units) == dict(record.units)


def test_a_list_of_channels_is_read_as_such():
    record = read([{"name": "F", "data": F, "unit_str": "kN", "fs": 200}], force="F")
    np.testing.assert_allclose(record.channels["force", 1], 1e3 * F)


def test_what_is_no_source_is_refused():
    with pytest.raises(TypeError, match="`source` must be the path of a file, a DataFrame"):
        read(3)
    with pytest.raises(TypeError, match="`frame` must be a DataFrame"):
        Record.from_dataframe({"F": F}, force="F")
