"""One record, 40 samples at 200 Hz of a force in N and a displacement in mm, in spellings that recorders have."""

import datetime
import json
from typing import Any

import h5py
import numpy as np
import pytest
import scipy.io

from jfsm.records import listing, read

N = 40
I = np.arange(N)  # noqa: E741
T, F, X = I / 200, 20 * np.sin(0.3 * I), 4 * np.cos(0.3 * I)
START = datetime.datetime(2025, 11, 14, 20, 9, 0, 563811)
ASKED: dict[str, Any] = {"force": "F", "displacement": "x"}


def rows(clock=None):
    first = (f"{t:.6f}," if clock is None else clock(t) for t in T)
    return "".join(f"{at}{f:.7f},{x:.5f}\n" for at, f, x in zip(first, F, X, strict=True))


def is_right(record, begins=None):
    np.testing.assert_allclose(record.channels["force", 1], F, atol=1e-5)
    np.testing.assert_allclose(record.channels["displacement", 1], 1e-3 * X, atol=1e-7)
    np.testing.assert_allclose(record.time - record.time[0], T, atol=2e-5)
    assert begins is None or str(record.begins).startswith(begins)


def stamped(form):
    return rows(lambda t: (START + datetime.timedelta(seconds=t)).strftime(form) + ",")


HEADS = {
    "units together": "# units: time=s, F=N, x=mm\ntime,F,x\n" + rows(),
    "keys before names": "# Channels: time, F, x\n# Units: s, N, mm\n" + rows(),
    "channel by channel": "Column 1: time (s)\nColumn 2: F (N)\nColumn 3: x (mm)\n\n" + rows(),
    "place in brackets": "time[0] (s),F (N),x (mm)\n" + rows(),
    "a ruled line": "time (s)|F (N)|x (mm)\n--------+-------+------\n" + rows().replace(",", "|"),
    "key and value in lines": "channel names:\nF\tx\ndt:\n0.005\t0.005\nF (N),x (mm)\n" + rows(lambda t: ""),
    "MATLAB days": "time,F (N),x (mm)\n" + rows(lambda t: f"{739316.6 + t / 86400:.10f},"),
    "fourteen digits": "Timestamp,F (N),x (mm)\n" + stamped("%Y%m%d%H%M%S.%f"),
    "compact ISO": "Timestamp,F (N),x (mm)\n" + stamped("%Y%m%dT%H%M%S.%f"),
    "points in the time": "time,F (N),x (mm)\n" + stamped("%Y-%m-%d-%H.%M.%S.%f"),
    "month in letters": "time,F (N),x (mm)\n" + stamped("%d-%b-%Y %H:%M:%S.%f"),
    "a slash in the name": "Date/Time,F (N),x (mm)\n" + stamped("%d.%m.%Y %H:%M:%S.%f"),
    "minutes": "Elapsed,F (N),x (mm)\n" + rows(lambda t: f"59:{t:06.3f},"),
    "microseconds since 1970": "ts,F (N),x (mm)\n" + rows(lambda t: f"{1.7e15 + 1e6 * t:.0f},"),
    "rounded with ties": "time (s),F (N),x (mm)\n" + rows(lambda t: f"{t:.2f},"),
    "word in the name": "gps_time_host,F (N),x (mm)\n" + rows(),
}


@pytest.mark.parametrize("head", HEADS)
def test_heads_and_clocks_of_text(tmp_path, head):
    (tmp_path / "a.csv").write_text(HEADS[head])
    is_right(read(tmp_path / "a.csv", **ASKED))


def test_dates_in_letters_are_kept(tmp_path):
    (tmp_path / "a.csv").write_text(HEADS["month in letters"])
    is_right(read(tmp_path / "a.csv", **ASKED), "2025-11-14T20:09:00.563811")


@pytest.mark.parametrize(
    "line",
    [
        "Sample Rate (Hz):,200", "#sampling_rate_hz=200", "ODR: 200 Hz", "samples per second: 200",
        "# sample_interval_us: 5000", "Taux d'échantillonnage: 200 Hz", '#{"fs": 200, "device": "A"}',
        "Messfrequenz: 200 Hz", "rate,200 1/s", "delta t:\n0.005",
    ],
)  # fmt: skip
def test_rates_in_heads(tmp_path, line):
    (tmp_path / "a.csv").write_text(f"{line}\nF (N),x (mm)\n{rows(lambda t: '')}", encoding="utf-8")
    is_right(read(tmp_path / "a.csv", **ASKED))


def test_numbers_that_cannot_be_in_the_stated_unit_of_time_are_said(tmp_path):
    (tmp_path / "a.csv").write_text("time (s),F (N),x\n" + rows(lambda t: f"{1.7e12 + 1e3 * t:.0f},"))
    (warning,) = (note for note in read(tmp_path / "a.csv", force="F").notes if note.startswith("Warning"))
    assert "milliseconds since 1970" in warning and "units={'time': ...}" in warning


def test_what_may_be_the_clock_is_named_in_the_refusal(tmp_path):
    (tmp_path / "a.csv").write_text(rows())
    with pytest.raises(ValueError, match="'column 1' grows evenly, and may be the clock"):
        read(tmp_path / "a.csv", force="2")
    (tmp_path / "b.csv").write_text("n,F\n" + "".join(f"{i},{f:.4f}\n" for i, f in zip(I, F, strict=True)))
    with pytest.raises(ValueError, match=r"holds 'n', 'F'\. Pass time="):
        read(tmp_path / "b.csv", force="F")


def _header(name, unit):
    return {"SignalName": name, "Unit": unit, "SampleFrequency": "200"}


MATLAB = {
    "text beside": {"t": T, "F": F, "x": X, "F_unit": "N", "x_unit": "mm"},
    "units of a struct": {"run": {"F": F, "x": X, "Fs": 200.0, "units": {"F": "N", "x": "mm"}}},
    "names of columns": {
        "data": np.column_stack([T, F, X]),
        "names": np.array(["time", "F", "x"], dtype=object),
        "units": np.array(["s", "N", "mm"], dtype=object),
    },
    "catman": {
        "Channel_1_Data": F, "Channel_2_Data": X,
        "Channel_1_Header": _header("F", "N"), "Channel_2_Header": _header("x", "mm"),
    },
    "the only rate": {"meta": {"f_s": 200.0}, "run": {"F": F, "x": 1e-3 * X}},
}  # fmt: skip


@pytest.mark.parametrize("kind", MATLAB)
def test_units_names_and_rates_of_matlab(tmp_path, kind):
    scipy.io.savemat(tmp_path / "a.mat", MATLAB[kind])
    is_right(read(tmp_path / "a.mat", **ASKED))


def test_iddata_arrays_with_time_and_structs_in_round_brackets_of_matlab(tmp_path):
    iddata = {"OutputData": X[:, None], "InputData": F[:, None], "Ts": 0.005, "OutputUnit": "mm", "InputUnit": "N"}
    structs = np.zeros((1, 2), dtype=[("t", object), ("F", object), ("x", object)])
    structs[0, 0], structs[0, 1] = (T, 0 * F, 0 * X), (T, F, 1e-3 * X)
    given = {"z": iddata, "F": np.column_stack([T, F]), "x": np.column_stack([T, 1e-3 * X])}
    scipy.io.savemat(tmp_path / "a.mat", given)
    is_right(read(tmp_path / "a.mat", force="z.InputData", displacement="z.OutputData"))
    is_right(read(tmp_path / "a.mat", force="F[1]", displacement="x[1]"))
    with pytest.raises(ValueError, match=r"The first column of 'F' grows evenly: ask for 'F\[1\]'"):
        read(tmp_path / "a.mat", force="F")
    scipy.io.savemat(tmp_path / "b.mat", {"runs": structs})
    is_right(read(tmp_path / "b.mat", force="runs(2).F", displacement="runs{2}.x"))


def test_rates_in_attributes_of_hdf5_links_and_a_length_other_than_stated(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["run/F"], file["run/x"], file["run/y"] = F, X, h5py.ExternalLink("other.h5", "/y")
        file["run"].attrs["sample_rate"] = 200
        file["run/x"].attrs["unit"] = "mm"
    is_right(read(tmp_path / "a.h5", **ASKED))
    with pytest.raises(ValueError, match="run/y .a link to another file."):
        read(tmp_path / "a.h5", force="y")
    (tmp_path / "a.h5").write_bytes((tmp_path / "a.h5").read_bytes() + bytes(12))
    assert any("12 bytes longer than it states" in note for note in read(tmp_path / "a.h5", **ASKED).notes)


def test_instants_beside_the_samples_count_before_a_rate_in_an_attribute_of_hdf5(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["time"], file["F"], file["x"] = T, F, X
        file["F"].attrs["fs"], file["x"].attrs["units"] = 100.0, "mm"
        file["time"].attrs["units"] = "seconds since 2024-03-05 14:30:00"
    is_right(read(tmp_path / "a.h5", **ASKED), "2024-03-05T14:30:00")


def _pandas(orient):
    import pandas as pd

    frame: Any = pd.DataFrame({"t": T, "F": F, "x": 1e-3 * X})
    return json.loads(frame.to_json(orient=orient, double_precision=15))


@pytest.mark.parametrize("orient", ["split", "columns", "index", "records", "table"])
def test_every_shape_of_a_table_that_pandas_writes_as_json(tmp_path, orient):
    (tmp_path / "a.json").write_text(json.dumps(_pandas(orient)))
    is_right(read(tmp_path / "a.json", **ASKED))


def test_rows_in_lines_channels_and_instants_in_json(tmp_path):
    (tmp_path / "a.json").write_text("\n".join(map(json.dumps, _pandas("records"))))
    is_right(read(tmp_path / "a.json", **ASKED))
    channels = [
        {"name": name, "unit": unit, "sample_rate": 200, "data": values.tolist()}
        for name, unit, values in (("F", "N", F), ("x", "mm", X))
    ]
    (tmp_path / "a.json").write_text(json.dumps({"channels": channels}))
    is_right(read(tmp_path / "a.json", **ASKED))
    stamps = [(START + datetime.timedelta(seconds=t)).isoformat() for t in T]
    (tmp_path / "a.json").write_text(json.dumps({"time": stamps, "F": F.tolist(), "x": (1e-3 * X).tolist()}))
    is_right(read(tmp_path / "a.json", **ASKED), "2025-11-14T20:09:00.563811")


def test_a_frame_of_texts_with_a_row_of_units(tmp_path):
    pd = pytest.importorskip("pandas")
    (tmp_path / "a.csv").write_text("time,F,x\ns,N,mm\n" + rows())
    is_right(read(pd.read_csv(tmp_path / "a.csv"), **ASKED))


def test_rows_that_sum_up_a_sheet_are_left_out(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    sheet: Any = book.active
    for row in (["time (s)", "F (N)", "x (mm)"], *zip(T, F, X, strict=True), ["Mean", 1.0, 2.0], ["Max", 3.0, 4.0]):
        sheet.append(list(row))
    book.save(tmp_path / "a.xlsx")
    record = read(tmp_path / "a.xlsx", **ASKED)
    is_right(record)
    assert any("Left out below the table: row 42 'Mean" in note for note in record.notes)


def test_a_listing_in_other_units(tmp_path):
    (tmp_path / "a.csv").write_text("time (s),F (kN),x (mm),temp\n0,1,25.4,3\n1,2,50.8,4\n2,3,0,5\n")
    force, displacement, other = listing(tmp_path / "a.csv").in_units("N,in").channels
    assert (force.unit, force.lowest, force.highest) == ("kN", 1, 3)  # newtons are what there is without a wish
    assert (displacement.unit, other.unit) == ("in", "")
    np.testing.assert_allclose((displacement.highest, displacement.outline[0, 1]), (2, 1))
    assert other.highest == 5
