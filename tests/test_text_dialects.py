"""Texts of one record, 40 samples at 200 Hz of a force in kN and a displacement in mm, as recorders write them."""

import re

import numpy as np
import pytest
import scipy.io

from jfsm.records import read

N = 40
I = np.arange(N)  # noqa: E741
T, F, X = I / 200, 20 * np.sin(0.3 * I), 4 * np.cos(0.3 * I)


def rows(form, comma=False, times=1.0):
    text = "".join(form.format(t=times * t, f=f / 1e3, x=x, i=i) for i, t, f, x in zip(I, T, F, X, strict=True))
    return text.replace(".", ",") if comma else text


POINT, SEMICOLON, TAB = "{t:.3f},{f:.7f},{x:.4f}\n", "{t:.3f};{f:.7f};{x:.4f}\n", "{t:.3f}\t{f:.7f}\t{x:.4f}\n"
NO_CLOCK, COLUMNS = "{f:.7f},{x:.4f}\n", "{t:8.3f} {f:12.7f} {x:10.4f}\n"

TEXTS = {
    "units above names": "s,kN,mm\ntime,F,x\n" + rows(POINT),
    "blank rows between": "time,F,x\ns,kN,mm\n\n\n" + rows(POINT),
    "quotes": '"time","F","x"\n"s","kN","mm"\n' + rows('"{t:.3f}","{f:.7f}","{x:.4f}"\n'),
    "quotes, commas": '"time";"F";"x"\n"s";"kN";"mm"\n' + rows('"{t:.3f}";"{f:.7f}";"{x:.4f}"\n', comma=True),
    "rows of groups": "Clock,Cell,LVDT\ntime,F,x\n(s),(kN),(mm)\n" + rows(POINT),
    "ini": "[Head]\nName=Test\nSampling Interval=0.005 s\n[Data]\nF (kN)\tx (mm)\n" + rows("{f:.7f}\t{x:.4f}\n"),
    "trailing separators": "time;F;x;\ns;kN;mm;\n" + rows("{t:.3f};{f:.7f};{x:.4f};\n", comma=True),
    "comma, exponents": "time;F [kN];x [mm]\n" + rows("{t:.3E};{f:.7E};{x:.4E}\n", comma=True),
    "pipes": "time|F [kN]|x [mm]\n" + rows("{t:.3f}|{f:.7f}|{x:.4f}\n"),
    "blanks": "  time     F      x\n   (s)     (kN)      (mm)\n" + rows(COLUMNS),
    "blanks in names": "Time (s)  F (kN)  x (mm)\n" + rows(COLUMNS),
    "percent": "% time F x\n% s kN mm\n" + rows("{t:.3f} {f:.7f} {x:.4f}\n"),
    "machine": "Data Header: x\nStation: 1\nTime\tF\tx\nSec\tkN\tmm\n" + rows(TAB),
    "index": ",time,F [kN],x [mm]\n" + rows("{i},{t:.3f},{f:.7f},{x:.4f}\n"),
    "units in lines": "# time: s\n# F: kN\n# Unit of x: mm\ntime,F,x\n" + rows(POINT),
    "date and time": "Date,Time,F [kN],x [mm]\n" + rows("25/03/2024,14:30:{t:06.3f},{f:.7f},{x:.4f}\n"),
    "line ends": ("time,F [kN],x [mm]\n" + rows(POINT)).replace("\n", "\r\r\n"),
    "old line ends": ("time,F [kN],x [mm]\n" + rows(POINT)).replace("\n", "\r"),
    "braces": "time {s},F {kN},x <mm>\n" + rows(POINT),
    "commas in names": '"time, s";"F, kN";"x, mm"\n' + rows(SEMICOLON),
    "milliseconds in the name": "time_ms,F [kN],x [mm]\n" + rows("{t:.0f},{f:.7f},{x:.4f}\n", times=1e3),
    "millis": "millis,F [kN],x [mm]\n" + rows("{t:.0f},{f:.7f},{x:.4f}\n", times=1e3),
    "posix": "Timestamp,F [kN],x [mm]\n" + rows("170964800{t:.3f},{f:.7f},{x:.4f}\n"),
    **{
        f"rate: {head}": f"{head}\nF [kN],x [mm]\n" + rows(NO_CLOCK)
        for head in (
            "Sampling Interval,0.005,s", "fs = 200", "# data_rate = 200.0 Hz", "Delta_X,0.005", "Ts: 5 ms", "dt=0.005",
            "Sampling Frequency (Hz),200", "Sample Rate [kHz]: 0.2", "Sampling interval [ms]; 5", "Abtastrate: 200 Hz",
            "Samples/sec: 200", "Sample interval (µs): 5000", "Scan rate = 200 scans/sec", "Sample rate;200 Hz",
        )
    },
    **{
        f"clock: {head}": f"{head},F [kN],x [mm]\n" + rows(POINT)
        for head in (
            "Temps", "Tiempo", "t", "X_Value", "Running Time", "Elapsed Time (sec)", "TIME", "Time_s", "time(s)", "t/s",
            "Time [Sec]", "Seconds", "Test Time", "X (s)", "Zeit in s", "Time (Seconds)", "Time since start [s]",
        )
    },
}  # fmt: skip


@pytest.mark.parametrize("dialect", TEXTS)
def test_a_record_is_the_same_in_every_dialect(tmp_path, dialect):
    (tmp_path / "a.asc").write_text(TEXTS[dialect], encoding="utf-8", newline="")
    record = read(tmp_path / "a.asc", force="F", displacement="x")
    np.testing.assert_allclose(record.time - record.time[0], T, atol=2e-6)
    np.testing.assert_allclose(record.channels["force", 1], F, atol=1e-4)
    np.testing.assert_allclose(record.channels["displacement", 1], 1e-3 * X, atol=1e-7)


@pytest.mark.parametrize(
    ("text", "note"),
    [
        ("time;F [kN];x [mm]\n" + rows(SEMICOLON).replace("\n", ";P\n", 1), r"1 rows have a field too many"),
        ("time,F [kN],x [mm],event\n" + rows(POINT).replace("\n", ",start\n", 1), r"1 rows have a field too many"),
        (
            "time,F [kN],x [mm]\n# pause\n" + rows(POINT).replace("\n", "\n# on\n", 1),
            r"1 remarks between the rows.*# on",
        ),
        ("time,F [kN],x [mm]\n" + rows(POINT), r"The unit of time is not stated; 'time' is taken to be in seconds"),
        ("time [s],F,x [mm]\n" + rows(POINT), r"Units are not stated: 'F' is taken to be in N"),
        (
            "Pump 3 at 40 C\ntime,F [kN],x [mm]\n" + rows(POINT),
            r"Not understood above the table: line 1 'Pump 3 at 40 C'",
        ),
    ],
)
def test_what_is_left_out_or_assumed_is_said(tmp_path, text, note):
    (tmp_path / "a.txt").write_text(text)
    record = read(tmp_path / "a.txt", force="F", displacement="x")
    assert len(record) == N
    assert any(re.search(note, each) for each in record.notes), record.notes


def test_a_bare_name_of_two_columns_is_refused_with_both(tmp_path):
    (tmp_path / "a.csv").write_text("time,F (V),F (N)\n" + rows(POINT))
    with pytest.raises(ValueError, match=r"`force` must name one channel of a\.csv; 'F' may be 'F \(V\)' or 'F \(N\)'"):
        read(tmp_path / "a.csv", force="F")
    for name in ("F (N)", "column 3", "3"):
        np.testing.assert_allclose(read(tmp_path / "a.csv", force=name).channels["force", 1], X, atol=1e-4)


def test_a_heading_that_does_not_fit_names_no_column(tmp_path):
    (tmp_path / "a.csv").write_text("time,F,x\n" + rows("{i},{t:.3f},{f:.7f},{x:.4f}\n"))
    with pytest.raises(ValueError, match=r"holds 'column 1', 'column 2', 'column 3', 'column 4'; it was 'F'"):
        read(tmp_path / "a.csv", force="F")


def signal(values, label):
    return {"values": values[:, None], "dimensions": 1.0, "label": label, "blockName": "m/" + label}


def test_scopes_iddata_and_cells_of_matlab_are_read(tmp_path):
    two = np.zeros((1, 2), dtype=[("values", object), ("dimensions", object), ("label", object)])
    two[0, 0], two[0, 1] = (F[:, None], 1.0, "force"), (X[:, None], 1.0, "pos")
    runs = np.zeros((1, 2), dtype=object)
    runs[0, 0], runs[0, 1] = {"t": T, "F": F, "x": X}, {"t": T, "F": 2 * F, "x": 2 * X}
    scipy.io.savemat(
        tmp_path / "a.mat",
        {
            "Scope": {"time": T[:, None], "signals": two},
            "One": {"time": T[:, None], "signals": signal(F, "load")},
            "z": {"y": X[:, None], "u": F[:, None], "Ts": 0.005},
            "runs": runs,
        },
    )
    for force, displacement, factor in (
        ("force", "pos", 1), ("One.signals.values", "pos", 1), ("load", "z.y", 1), ("z.u", "z.y", 1),
        ("runs{1}.F", "runs{1}.x", 1), ("runs{2}.F", "runs{2}.x", 2),
    ):  # fmt: skip
        record = read(tmp_path / "a.mat", force=force, displacement=displacement)
        np.testing.assert_allclose(record.time, T, atol=1e-12)
        np.testing.assert_allclose(record.channels["force", 1], factor * F)
        np.testing.assert_allclose(record.channels["displacement", 1], factor * X)
