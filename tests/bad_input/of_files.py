"""Files that are damaged, renamed, hostile or ambiguous."""

# pyright: reportArgumentType=false, reportCallIssue=false
# Wrong types are what is tried.

import io
import json
import zipfile
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd
import scipy.io

import jfsm

from .rows import FORCE, MOTION, Row, Stage, T, csv_text, refused, right

CHANNELS = {"time": T, "F": FORCE, "x": MOTION}


def _npz(stage: Stage, **other: Any) -> Path:
    path = stage.folder / "a.npz"
    np.savez(path, **{**CHANNELS, **other})
    return path


def _h5(stage: Stage, units: Any = None, make: Any = None) -> Path:
    """An HDF5 file in order, but for its units, or for a force that `make` puts there."""
    path = stage.folder / "a.h5"
    with h5py.File(path, "w") as file:
        for name, values in CHANNELS.items():
            if name != "F" or make is None:
                file[name] = values
                if units is not None and name != "time":
                    file[name].attrs["units"] = units(name)
        if make is not None:
            make(file)
    return path


def _matrix(stage: Stage) -> jfsm.Record:
    path = stage.folder / "m.h5"
    with h5py.File(path, "w") as file:
        file["time"], file["data"] = T, np.stack([FORCE, MOTION], 1)
        file["data"].attrs["units"] = ["kN", "mm"]
    return jfsm.read(path, force="data[0]", displacement="data[1]")


def _outside(file: Any) -> None:
    (Path(file.filename).parent / "secret").write_bytes(np.arange(400.0).tobytes())
    file.create_dataset(
        "F", (400,), "f8", external=[(str(Path(file.filename).parent / "secret"), 0, h5py.h5f.UNLIMITED)]
    )


def _virtual(file: Any) -> None:
    other = Path(file.filename).parent / "other.h5"
    with h5py.File(other, "w") as source:
        source["F"] = FORCE
    layout = h5py.VirtualLayout((400,), "f8")
    layout[:] = h5py.VirtualSource(str(other), "F", (400,))
    file.create_virtual_dataset("F", layout)


def _linked(file: Any) -> None:
    file["F"] = h5py.ExternalLink("other.h5", "/F")


def _endless(file: Any) -> None:
    file["F"] = h5py.SoftLink("/F")


def _enormous(file: Any) -> None:
    file.create_dataset("F", (10**11,), "f8", chunks=(10**6,), compression="gzip")


def _bomb(stage: Stage) -> Path:
    """An archive of 6 GB of zeros, none of which was written: its directory says so, and that is what is asked."""
    path = stage.folder / "bomb.npz"
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (750_000_000,)})
    with zipfile.ZipFile(path, "w") as archive:
        for name, values in CHANNELS.items():
            stream = io.BytesIO()
            np.save(stream, values)
            archive.writestr(f"{name}.npy", header.getvalue() if name == "F" else stream.getvalue())
        archive.getinfo("F.npy").file_size = 6_000_000_000
    return path


def _book(stage: Stage, far: str = "") -> Path:
    """A workbook in order, or with one cell far away."""
    import openpyxl

    path = stage.folder / "a.xlsx"
    book = openpyxl.Workbook()
    sheet: Any = book.active
    sheet.append(["time", "F", "x"])
    for row in zip(*(values.tolist() for values in CHANNELS.values()), strict=True):
        sheet.append(row)
    if far:
        sheet[far] = 1.0
    book.save(path)
    return path


def _decimal_comma(stage: Stage, field: str) -> jfsm.Record:
    """A file with decimal commas, one force of which is written so."""
    rows = csv_text("time;F;x", delimiter=";").replace(".", ",").splitlines()
    time, _, motion = rows[50].split(";")
    rows[50] = f"{time};{field};{motion}"
    return stage.read(stage.file("a.csv", "\n".join(rows) + "\n"))


def _frame(**columns: Any) -> pd.DataFrame:
    return pd.DataFrame({**CHANNELS, **columns})


def _in_kn(record: jfsm.Record) -> bool:
    return bool(
        np.allclose(record.channels["force", 1], 1e3 * FORCE)
        and np.allclose(record.channels["displacement", 1], 1e-3 * MOTION)
    )


def _json(**given: Any) -> str:
    return json.dumps({**{name: values.tolist() for name, values in CHANNELS.items()}, **given})


def _file(name: str, file: str, content: str | bytes, says: str) -> Row:
    return refused(name, lambda s: s.read(s.file(file, content)), says)


HOSTILE = "<img src=x onerror=alert(1)>F"

ROWS: list[Row] = [
    refused("no such file", lambda s: s.read(s.folder / "gone.csv"), r"gone\.csv", FileNotFoundError),
    refused("a folder", lambda s: s.read(s.folder), r"Is a directory", OSError),
    _file("nothing in it", "a.csv", "", r"a\.csv is empty\. Write or copy it again"),
    _file("text alone", "a.csv", "hello\nworld\n", r"a\.csv must hold columns of numbers.*Export numbers"),
    _file("bytes", "a.bin", bytes(range(256)) * 8, r"a\.bin"),
    _file("a pickle", "a.npy", b"\x80\x04\x95" + bytes(100), r"a Python pickle, which could run anything.*Save the arrays"),
    _file("a program", "a.csv", b"\x7fELF" + bytes(100), r"a\.csv"),
    _file("a zip of something else", "a.npz", b"PK\x03\x04" + bytes(100), r"a\.npz"),
    _file("JSON that is cut short", "a.json", '{"time": [1, 2', r"a\.json must be JSON; .*Write or copy it again"),
    _file("JSON nested deeply", "a.json", "[" * 100_000 + "]" * 100_000, r"a\.json must be JSON; it is nested too deeply"),
    _file("JSON objects nested deeply", "a.json", '{"a":' * 5000 + "1" + "}" * 5000, r"it is nested too deeply"),
    _file("JSON with a number of 10000 digits", "a.json", _json(F=[1])[:-1] + f', "b": {"9" * 10000}}}', r"a\.json must be JSON; "),
    _file("JSON with NaN", "a.json", _json(F=[float("nan")] * 400), r"`force dof 1` must be finite; 400 of 400"),
    _file("JSON of texts", "a.json", '{"time": ["a"], "F": ["b"]}', r"must hold lists of numbers by name"),
    _file("remarks that are no JSON", "a.csv", "# jfsm record {\n" + csv_text(), r"a\.csv must hold JSON after '# jfsm record '; .*Repair"),
    _file("remarks nested deeply", "a.csv", f"# jfsm record {'[' * 9000}\n" + csv_text(), r"must hold JSON after .*nested too deeply"),
    _file("time backwards", "a.csv", csv_text(columns=(T[::-1], FORCE, MOTION)), r"`time`"),
    _file("a lost reading", "a.csv", csv_text().replace(csv_text().splitlines()[9].split(",")[1], "nan", 1), r"must be finite"),
    _file("a name that is not there", "a.csv", csv_text(header="time,G,x"), r"`force` must name a channel of a\.csv, which holds 'time', 'G', 'x'; it was 'F'"),
    _file("two columns of one name", "a.csv", csv_text("time,F,F,x", (T, FORCE, 2 * FORCE, MOTION)), r"`force` must name one channel of a\.csv; 'F' may be 'F \(2\)' or 'F \(3\)'"),
    right("a name of markup", lambda s: jfsm.read(s.file("a.csv", csv_text(f"time,{HOSTILE},x")), force=HOSTILE, displacement="x", units={HOSTILE: "N"}), len),
    right("decimal commas, and 6.234", lambda s: _decimal_comma(s, "6.234").notes, lambda notes: any("line 51 holds '6.234' in column 2, which is read as 6234" in note for note in notes)),
    right("decimal commas, and thousands", lambda s: _decimal_comma(s, "1.006,234").notes, lambda notes: not any("Warning" in note for note in notes)),
    right("a BOM", lambda s: s.read(s.file("a.csv", b"\xef\xbb\xbf" + csv_text().encode())), len),
    right("UTF-16", lambda s: s.read(s.file("a.csv", csv_text().encode("utf-16"))), len),
    refused("objects in an archive", lambda s: s.read(_npz(s, F=FORCE.astype(object))), r"`force` must name .*Left out: F \(Python objects, which are not opened\)"),
    refused("objects in an array", lambda s: s.read(_saved(s, np.array([{}], dtype=object))), r"a\.npy must be an array of numbers .*Save the numbers alone"),
    refused("texts in an archive", lambda s: s.read(_npz(s, F=np.array(["a"] * 400))), r"`force` must hold real numbers; it holds <U1", TypeError),
    refused("an archive that is cut short", lambda s: s.read(_cut(_npz(s))), r"a\.npz must be an archive of numpy\.savez.*cut short\. Write"),
    right("a member that would leave its folder", lambda s: jfsm.read(_npz(s, **{"../../F": FORCE}), force="../../F", displacement="x"), len),
    refused("an archive of 6 GB", lambda s: s.read(_bomb(s)), r"bomb\.npz must take at most 4 GB of memory .*it takes 6 GB\. If it should, set JFSM_LARGEST_GB=7"),
    refused("a workbook with one cell far away", lambda s: s.read(_book(s, "XFD1048576")), r"a\.xlsx must take at most 4 GB .*it takes 412 GB\. If it should, set JFSM_LARGEST_GB="),
    right("a workbook with a cell not so far away", lambda s: s.read(_book(s, "H300")), len),
    refused("a dataset of 800 GB", lambda s: s.read(_h5(s, make=_enormous)), r"a\.h5 must take at most 4 GB .*it takes 800 GB.*JFSM_LARGEST_GB=881"),
    refused("HDF5 cut short", lambda s: s.read(_cut(_h5(s))), r"a\.h5 must be an HDF5 file.*cut short"),
    refused("numbers outside the file", lambda s: s.read(_h5(s, make=_outside)), r"`force` must name .*Left out: F \(stored outside the file\)"),
    refused("numbers of another file", lambda s: s.read(_h5(s, make=_virtual)), r"`force` must name .*Left out: F \(stored outside the file\)"),
    refused("a link to another file", lambda s: s.read(_h5(s, make=_linked)), r"`force` must name a channel of a\.h5, which holds 'time', 'x'"),
    refused("a link to itself", lambda s: s.read(_h5(s, make=_endless)), r"`force` must name a channel of a\.h5"),
    right("units as a list of one", lambda s: s.read(_h5(s, units=lambda name: [{"F": "kN", "x": "mm"}[name]])), _in_kn),
    right("units as a list of equal texts", lambda s: s.read(_h5(s, units=lambda name: [{"F": "kN", "x": "mm"}[name]] * 2)), _in_kn),
    right("units as bytes of a fixed length", lambda s: s.read(_h5(s, units=lambda name: np.array([{"F": "kN", "x": "mm"}[name]] * 2, "S2"))), _in_kn),
    right("units of each column of a matrix", _matrix, _in_kn),
    right("units that are numbers", lambda s: s.read(_h5(s, units=lambda name: 3.0)).notes, lambda notes: "The units of 'F' are no text, and are not used." in notes),
    right("units that differ", lambda s: s.read(_h5(s, units=lambda name: ["N", "m"])).notes, lambda notes: "The units of 'F' are a list of 2, 'N', 'm', and are not used." in notes),
    refused("MATLAB cut short", lambda s: s.read(_cut(_mat(s))), r"a\.mat must be a MATLAB file.*cut short"),
    refused("a cell of objects", lambda s: s.read(_mat(s, F=FORCE.astype(object))), r"`force` must name a channel of a\.mat, which holds .*F\{1\}"),
    refused("MATLAB remarks that are no JSON", lambda s: s.read(_mat(s, jfsm_record="{")), r"a\.mat must hold JSON in jfsm_record; .*Write or copy"),
    right("a DataFrame with objects that are numbers", lambda s: jfsm.read(_frame(F=pd.Series(FORCE, dtype=object)), force="F", displacement="x"), len),
    refused("a DataFrame with one text", lambda s: jfsm.read(_frame(F=[*FORCE[:-1], "a"]), force="F", displacement="x"), r"The column 'F' must hold numbers to be a channel; 'a' is no number\. Mend it"),
    right("a DataFrame of texts that are numbers", lambda s: jfsm.read(_frame(F=FORCE.astype(str)), force="F", displacement="x"), lambda record: np.allclose(record.force[:, 0], FORCE) and any("kept as text in 'F'" in note for note in record.notes)),
    refused("a DataFrame with two columns of one name", lambda s: jfsm.read(pd.concat([_frame(), _frame()[["x"]]], axis=1), force="F", displacement="x"), r"`displacement` must name one channel of the DataFrame; 'x' may be"),
    refused("a number", lambda s: jfsm.read(3), r"`source` must be the path of a file, .*it was int\. For arrays", TypeError),
    refused("nothing", lambda s: jfsm.read(None), r"`source` must be the path of a file, .*it was NoneType", TypeError),
    refused("a number for a channel", lambda s: jfsm.read(s.file("a.csv", csv_text()), force=3), r"`force` must be the name of a channel, .*got 3", TypeError),
    refused("a rate of nothing", lambda s: s.read(s.file("a.csv", csv_text("a,F,x")), rate=0.0), r"`rate`"),
    refused("a rate as text", lambda s: s.read(s.file("a.csv", csv_text("a,F,x")), rate="fast"), r"`rate` must be one number; it was 'fast'", TypeError),
    refused("units as text", lambda s: s.read(s.file("a.csv", csv_text()), units="N"), r"`units` must be given by name, as .*it was 'N'", TypeError),
    refused("a run as a list", lambda s: s.read(s.file("a.csv", csv_text()), run=[1]), r"`run` must be a number from 1 on, or a title; got \[1\]", TypeError),
    refused("rest as text", lambda s: s.read(s.file("a.csv", csv_text()), at_rest="no"), r"`at_rest` must be True or False", TypeError),
]  # fmt: skip


def _saved(stage: Stage, array: np.ndarray) -> Path:
    path = stage.folder / "a.npy"
    np.save(path, array)
    return path


def _mat(stage: Stage, **other: Any) -> Path:
    path = stage.folder / "a.mat"
    scipy.io.savemat(path, {**CHANNELS, **other}, do_compression=True)
    return path


def _cut(path: Path) -> Path:
    """The first two thirds of a file."""
    content = path.read_bytes()
    path.write_bytes(content[: 2 * len(content) // 3])
    return path
