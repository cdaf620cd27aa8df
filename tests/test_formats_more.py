"""LabVIEW, sound, NumPy, JSON, spreadsheet and Parquet files, written as their programs write them."""

import datetime
import importlib
import json
import struct
import wave

import numpy as np
import pytest

from jfsm.records import read

N, RATE = 60, 200.0
T = np.arange(N) / RATE
F = 20 * np.sin(2 * np.pi * 3 * T)
X = 0.004 * np.cos(2 * np.pi * 3 * T)


def folder_of(path):
    return {entry.name: entry.read_bytes() for entry in path.parent.iterdir()}


# LabVIEW

TRAP_LVM = (
    "LabVIEW Measurement,\nWriter_Version,2\nReader_Version,2\nSeparator,Comma\nDecimal_Separator,.\n"
    "X_Columns,No\nTime_Pref,Relative\nDate,2024/03/05\nTime,14:30:00.5\n***End_of_Header***,\n\n"
    + "".join(
        "Channels,2,,\nNotes,hammer test,,\nSamples,4,4,\nY_Unit_Label,N,g,\nX_Dimension,Time,Time,\nX0,0.5,0.5,\n"
        "Delta_X,0.001,0.001,\n***End_of_Header***,,,\nX_Value,Force,Accel,Comment\n"
        + "".join(f",{run + i},{run + 2 * i},{'bang' if i == 1 else ''}\n" for i in range(4))
        for run in (10, 20)
    )
)


def test_segments_of_a_labview_file_are_runs_with_their_units_and_clock(tmp_path):
    path = tmp_path / "impact.lvm"
    path.write_text(TRAP_LVM)
    before = folder_of(path)
    with pytest.raises(ValueError, match=r"`run` must name one of the 2 runs of impact\.lvm, .*Pass run=1 or another"):
        read(path, force="Force", acceleration="Accel")
    for run in (1, 2):
        record = read(path, force="Force", acceleration="Accel", run=run)
        np.testing.assert_allclose(record.time, [0.5, 0.501, 0.502, 0.503], rtol=1e-12)
        np.testing.assert_array_equal(record.channels["force", 1], 10 * run + np.arange(4))
        np.testing.assert_allclose(record.channels["acceleration", 1], 9.80665 * (10 * run + 2 * np.arange(4)))
        assert any("'bang'" in note for note in record.notes) and any("hammer test" in note for note in record.notes)
        assert any("2024/03/05 14:30:00.5" in note for note in record.notes)
    assert folder_of(path) == before


@pytest.mark.parametrize("columns", ["One", "Multi"])
def test_a_labview_file_with_tabs_decimal_commas_and_columns_of_instants(tmp_path, columns):
    x = "X_Value\t" if columns == "Multi" else ""
    head = (
        f"LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t,\nX_Columns\t{columns}\n"
        "***End_of_Header***\t\n\t\nChannels\t2\t\t\nSamples\t60\t60\t\nY_Unit_Label\tNewtons\tmm\t\nX0\t0,0E+0\t0,0E+0\nDelta_X\t0,005\t0,005\n"
        f"***End_of_Header***\t\t\nX_Value\tForce\t{x}Weg\tComment\n"
    )
    rows = [
        f"{t:.6f}\t{f:.6f}\t{f'{t:.6f}' + chr(9) if x else ''}{1e3 * y:.6f}\n" for t, f, y in zip(T, F, X, strict=True)
    ]
    (tmp_path / "a.lvm").write_text(head + "".join(rows).replace(".", ","))
    record = read(tmp_path / "a.lvm", force="Force", displacement="Weg")
    np.testing.assert_allclose(record.time, T, atol=1e-9)
    np.testing.assert_allclose(record.channels["force", 1], F, atol=1e-6)
    np.testing.assert_allclose(record.channels["displacement", 1], X, atol=1e-9)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: text.replace("***End_of_Header***", "end"), r"a\.lvm must be .*; its header has no end"),
        (lambda text: text.replace("Separator,Comma\n", ""), r"a\.lvm must state its Separator"),
        (lambda text: text[: text.index("Channels")], r"a\.lvm must hold a segment of samples; it holds none"),
        (lambda text: text.replace(",12,14,", ",12,14x,"), r"columns of samples; line \d+ holds '14x'"),
        (
            lambda text: text.replace("Delta_X,0.001,0.001,\n", ""),
            r"must state Delta_X for 'Force'; it states 0 of them",
        ),
    ],
)
def test_a_damaged_labview_file_is_refused_in_words(tmp_path, change, message):
    (tmp_path / "a.lvm").write_text(change(TRAP_LVM))
    with pytest.raises(ValueError, match=message):
        read(tmp_path / "a.lvm", force="Force", acceleration="Accel", run=1)


def test_missing_samples_of_a_labview_file_are_said(tmp_path):
    (tmp_path / "a.lvm").write_text(TRAP_LVM.replace(",13,16,\n", "").replace(",23,26,\n", ""))
    record = read(tmp_path / "a.lvm", force="Force", run=1)
    assert "'Force' announces 4 samples; 3 stand in the file." in record.notes


# Sound


def _wav(path, width, tone, rate=8000):
    """PCM written bit by bit: 1, 2, 3 or 4 bytes, the tone in parts of full scale."""
    with wave.open(str(path), "wb") as stream:
        stream.setnchannels(1)
        stream.setsampwidth(width)
        stream.setframerate(rate)
        full = 2 ** (8 * width - 1)
        counts = np.round(tone * full).astype(int)
        if width == 1:
            stream.writeframes(bytes((counts + 128).tolist()))
        else:
            stream.writeframes(b"".join(int(c).to_bytes(width, "little", signed=True) for c in counts))


@pytest.mark.parametrize("width", [1, 2, 3, 4])
def test_sound_is_read_in_parts_of_full_scale_whatever_its_width(tmp_path, width):
    tone = 0.5 * np.sin(0.3 * np.arange(400))
    _wav(tmp_path / "a.wav", width, tone)
    record = read(tmp_path / "a.wav", acceleration="channel 1")
    np.testing.assert_allclose(record.channels["acceleration", 1], tone, atol=1.01 * 2.0 ** (-8 * width))
    assert record.sample_rate == pytest.approx(8000) and record.units["acceleration"] == "1"
    assert any("parts of full scale" in note and "sensitivity" in note for note in record.notes)
    record = read(tmp_path / "a.wav", acceleration="channel 1", sensitivity={"channel 1": "0.2/g"})
    np.testing.assert_allclose(record.channels["acceleration", 1], 9.80665 * tone / 0.2, atol=51 * 2.0 ** (-8 * width))
    assert record.units["acceleration"] == "m/s²"


def test_damaged_sound_is_refused(tmp_path):
    _wav(tmp_path / "a.wav", 2, 0.5 * np.sin(np.arange(400.0)))
    whole = (tmp_path / "a.wav").read_bytes()
    for kept in (20, 40):
        (tmp_path / "a.wav").write_bytes(whole[:kept])
        with pytest.raises(ValueError, match=r"a\.wav must .*(copy it again|Copy it again)"):
            read(tmp_path / "a.wav", acceleration="channel 1")


# NumPy


def test_the_columns_of_one_array_are_numbered_and_its_fields_are_names(tmp_path):
    np.save(tmp_path / "a.npy", np.column_stack([T, F, X]))
    for force in ("column 2", "2"):
        record = read(tmp_path / "a.npy", time="column 1", force=force, displacement="column 3")
        np.testing.assert_array_equal(record.channels["force", 1], F)
    fields = np.zeros(N, dtype=[("time", float), ("force", float)])
    fields["time"], fields["force"] = T, F
    np.save(tmp_path / "b.npy", fields)
    np.testing.assert_array_equal(read(tmp_path / "b.npy").channels["force", 1], F)


@pytest.mark.parametrize("array", [np.array([{}], dtype=object), np.zeros((2, 2, 2)), np.array(["a", "b"])])
def test_an_array_that_holds_no_columns_is_refused(tmp_path, array):
    np.save(tmp_path / "a.npy", array)
    with pytest.raises(ValueError, match=r"a\.npy must (be an array|hold columns) of .*Save the"):
        read(tmp_path / "a.npy", force="column 1")


# JSON


@pytest.mark.parametrize("shape", ["columns", "nested", "rows", "units"])
def test_columns_of_json_have_names_and_units(tmp_path, shape):
    columns = {"time": T.tolist(), "F (kN)": (F / 1e3).tolist(), "x": (1e3 * X).tolist(), "who": "K"}
    given, force, displacement = columns, "F", "x"
    units = {"x": "mm"}
    if shape == "nested":
        given, force, displacement = {"run": {**columns}}, "run.F (kN)", "run.x"
        units = {"run.x": "mm"}
    elif shape == "rows":
        given = [
            dict(zip(("time", "F (kN)", "x"), row, strict=True))
            for row in zip(*list(columns.values())[:3], strict=True)
        ]
    elif shape == "units":
        given, units = {**columns, "units": {"x": "mm"}}, {}
    (tmp_path / "a.json").write_text(json.dumps(given))
    record = read(tmp_path / "a.json", force=force, displacement=displacement, units=units)
    np.testing.assert_allclose(record.time, T)
    np.testing.assert_allclose(record.channels["force", 1], F)
    np.testing.assert_allclose(record.channels["displacement", 1], X)
    if shape == "nested":
        assert read(tmp_path / "a.json", force="F", displacement="x", units={"x": "mm"}).notes == record.notes
    if shape == "columns":
        assert "Not numbers, and left out: who." in record.notes


def test_units_of_json_may_stand_farther_out_and_the_end_of_a_name_does_where_it_is_the_only_one(tmp_path):
    columns = {"F": (F / 1e3).tolist(), "x": (1e3 * X).tolist()}
    given = {"rate": 200, "units": {"F": "kN"}, "a": {**columns, "units": {"x": "mm"}}, "b": {"x": [1.0, 2.0, 3.0]}}
    (tmp_path / "a.json").write_text(json.dumps(given))
    record = read(tmp_path / "a.json", force="F", displacement="a.x", rate=200)
    np.testing.assert_allclose(record.channels["force", 1], F)
    np.testing.assert_allclose(record.channels["displacement", 1], X)
    assert not any("left out" in note or "not stated" in note for note in record.notes)
    with pytest.raises(ValueError, match=r"'x' may be 'a\.x' or 'b\.x'"):
        read(tmp_path / "a.json", force="F", displacement="x", rate=200)


@pytest.mark.parametrize("text", ['{"time": [0, 1', '{"a": "b"}', '[{"a": 1}, [2]]'])
def test_json_without_columns_is_refused(tmp_path, text):
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(ValueError, match=r"a\.json must "):
        read(tmp_path / "a.json", force="a")


# Spreadsheets


def _book(path, sheets):
    openpyxl = pytest.importorskip("openpyxl")
    pytest.importorskip("python_calamine")
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append(row)
    book.save(path)
    return path


TABLE = [["Zug 7", None, None], [], ["Zeit", "Kraft", "Weg (mm)"], ["s", "kN", None]]
TABLE += [[t, f / 1e3, 1e3 * x] for t, f, x in zip(T.tolist(), F.tolist(), X.tolist(), strict=True)]


@pytest.mark.parametrize("called", ["a.xlsx", "a.csv", "a"])
def test_the_table_of_a_sheet_is_found_below_whatever_stands_above_it(tmp_path, called):
    _book(tmp_path / "a.xlsx", {"Info": [["Operator", "K"], ["Rate", 200, "Hz"]], "Data": TABLE}).rename(
        tmp_path / called
    )
    record = read(tmp_path / called, force="Kraft", displacement="Weg")
    np.testing.assert_allclose(record.time, T, atol=1e-12)
    np.testing.assert_allclose(record.channels["force", 1], F, atol=1e-12)
    np.testing.assert_allclose(record.channels["displacement", 1], X, atol=1e-15)
    assert record.notes == ("Not understood above the table: row 1 'Zug 7'.",)


def test_several_sheets_are_offered_by_name(tmp_path):
    path = _book(tmp_path / "a.xlsx", {"First": TABLE, "Second": [["t", "F [N]"], [0, 1], [1, 2], [2, 4]]})
    with pytest.raises(
        ValueError, match=r"`sheet` must name one of the 2 sheets of a\.xlsx, .*1 \(First\); 2 \(Second\)"
    ):
        read(path, force="F")
    for sheet in ("Second", 2):
        np.testing.assert_array_equal(read(path, force="F", sheet=sheet).channels["force", 1], [1, 2, 4])
    with pytest.raises(ValueError, match=r"sheet 'Third' was asked for"):
        read(path, force="F", sheet="Third")


def test_dates_numbers_kept_as_text_and_a_stated_rate_of_a_sheet_are_read(tmp_path):
    begin = datetime.datetime(2024, 3, 5, 14, 30)
    rows = [[begin + datetime.timedelta(seconds=0.25 * i), str(0.5 * i)] for i in range(20)]
    record = read(_book(tmp_path / "a.xlsx", {"A": [["Time", "F [N]"], *rows]}), force="F")
    np.testing.assert_allclose(record.time, 0.25 * np.arange(20), atol=1e-6)
    np.testing.assert_array_equal(record.channels["force", 1], 0.5 * np.arange(20))
    assert any("kept as text in 'F'" in note for note in record.notes)
    assert any("reads zero at 2024-03-05 14:30:00" in note for note in record.notes)
    rows = [
        ["Sample rate", "200 Hz"],
        ["F [N]", "x [mm]"],
        *([f, x] for f, x in zip(F.tolist(), X.tolist(), strict=True)),
    ]
    record = read(_book(tmp_path / "b.xlsx", {"A": rows}), force="F")
    assert record.sample_rate == pytest.approx(200)


def test_tables_below_one_another_in_a_sheet_are_runs(tmp_path):
    rows = [["t", "F [N]"], [0, 1], [1, 2], ["second run"], ["t", "F [N]"], [0, 5], [1, 6], [2, 7]]
    path = _book(tmp_path / "a.xlsx", {"A": rows})
    np.testing.assert_array_equal(read(path, force="F", run=2).channels["force", 1], [5, 6, 7])
    with pytest.raises(ValueError, match=r"`run` must name one of the 2 runs of a\.xlsx"):
        read(path, force="F")


def test_a_sheet_without_numbers_and_a_damaged_spreadsheet_are_refused(tmp_path):
    path = _book(tmp_path / "a.xlsx", {"A": [["no", "numbers"]]})
    with pytest.raises(ValueError, match=r"a\.xlsx must hold columns of numbers in a sheet; none of 'A' does"):
        read(path, force="F")
    path.write_bytes(path.read_bytes()[:600])
    with pytest.raises(ValueError, match=r"a\.xlsx must be a spreadsheet; it cannot be opened"):
        read(path, force="F")


@pytest.mark.parametrize(
    ("name", "begins_with", "package", "extra"),
    [
        (
            "a.csv",
            b"PK\x03\x04" + struct.pack("<5H3L2H", *[0] * 10) + b"[Content_Types].xml",
            "python_calamine",
            "excel",
        ),
        ("a.bin", b"PAR1", "pyarrow", "parquet"),
    ],
)
def test_a_missing_package_is_named_with_the_line_that_installs_it(
    tmp_path, monkeypatch, name, begins_with, package, extra
):
    def missing(module):
        raise ModuleNotFoundError(module)

    monkeypatch.setattr(importlib, "import_module", missing)
    (tmp_path / name).write_bytes(begins_with)
    with pytest.raises(
        ModuleNotFoundError, match=rf"{name} is read by the package {package}, .*`pip install jfsm\[{extra}\]`"
    ):
        read(tmp_path / name, force="F")


# Parquet and Feather


@pytest.mark.parametrize("suffix", ["parquet", "feather"])
def test_columns_of_parquet_and_feather_keep_their_instants(tmp_path, suffix):
    arrow, kept = pytest.importorskip("pyarrow"), pytest.importorskip(f"pyarrow.{suffix}")
    stamps = 1_593_335_798_138_876_361 + 2_532_500 * np.arange(N)
    table = arrow.table({"time": arrow.array(stamps, arrow.timestamp("ns")), "F (kN)": F / 1e3, "who": ["K"] * N})
    path = tmp_path / f"a.{suffix}"
    (kept.write_table if suffix == "parquet" else kept.write_feather)(table, str(path))
    record = read(path, force="F")
    np.testing.assert_allclose(record.time, 0.0025325 * np.arange(N), atol=1e-12)
    np.testing.assert_allclose(record.channels["force", 1], F)
    assert record.notes[0] == "Not numbers, and left out: who."
    path.write_bytes(path.read_bytes()[:200])
    with pytest.raises(ValueError, match=rf"a\.{suffix} must be a Parquet or Feather file"):
        read(path, force="F")
