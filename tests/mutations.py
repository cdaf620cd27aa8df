"""Random edits of valid files, and what becomes of reading them.

python tests/mutations.py 3000          edits in all, spread over the kinds of file
python tests/mutations.py 200 wav h5    of these kinds alone
"""

import collections
import io
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from recorders import CatmanChannel, ImcChannel, catman_file, imc_file, write_mat73

import jfsm

N, RATE = 120, 200.0
T = np.arange(N) / RATE
F = 20 * np.sin(2 * np.pi * 3 * T) + 0.123
X = 4e-3 * np.sin(2 * np.pi * 3 * T - 0.7) + 1e-4
STEP = 1 / RATE
ASKED = {"force": "F", "displacement": "x"}
Writer = Callable[[Path], dict[str, Any]]


def _csv(path: Path) -> dict[str, Any]:
    rows = "".join(f"{t:.3f},{f:.6f},{1e3 * x:.6f}\n" for t, f, x in zip(T, F, X, strict=True))
    path.write_text("time [s],F [N],x [mm]\n" + rows)
    return ASKED


def _german(path: Path) -> dict[str, Any]:
    rows = "".join(f"{t:.3f};{f:.6f};{1e3 * x:.6f}\n".replace(".", ",") for t, f, x in zip(T, F, X, strict=True))
    path.write_text("# Logger 7\n# Sample rate: 200 Hz\nZeit;F;x\ns;N;mm\n" + rows)
    return ASKED


def _lvm(path: Path) -> dict[str, Any]:
    rows = "".join(f"\t{f:.6f}\t{1e3 * x:.6f}\t\n" for f, x in zip(F, X, strict=True))
    path.write_text(
        "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\n"
        "X_Columns\tNo\nTime_Pref\tAbsolute\n***End_of_Header***\t\n\t\nChannels\t2\t\t\n"
        f"Samples\t{N}\t{N}\t\nY_Unit_Label\tN\tmm\t\nX0\t0.0\t0.0\t\nDelta_X\t{STEP}\t{STEP}\t\n"
        "***End_of_Header***\t\t\t\nX_Value\tF\tx\tComment\n" + rows
    )
    return ASKED


def _wav(path: Path) -> dict[str, Any]:
    from scipy.io import wavfile

    wavfile.write(path, int(RATE), np.stack([F / 100, X], 1).astype("<f4"))
    raw = {"channel 1": "0.01/N", "channel 2": "1/m"}
    return {"force": "channel 1", "displacement": "channel 2", "sensitivity": raw}


def _npy(path: Path) -> dict[str, Any]:
    columns = np.zeros(N, dtype=[("time", float), ("F", float), ("x", float)])
    columns["time"], columns["F"], columns["x"] = T, F, X
    with path.open("wb") as stream:
        np.save(stream, columns)
    return ASKED


def _npz(path: Path) -> dict[str, Any]:
    with path.open("wb") as stream:
        np.savez(stream, time=T, F=F, x=X)
    return ASKED


def _mat(path: Path) -> dict[str, Any]:
    from scipy.io import savemat

    with path.open("wb") as stream:
        savemat(stream, {"time": T, "F": F, "x": X})
    return ASKED


def _h5(path: Path) -> dict[str, Any]:
    import h5py

    with h5py.File(path, "w") as file:
        for name, values, unit in (("time", T, "s"), ("F", F, "N"), ("x", 1e3 * X, "mm")):
            file[name] = values
            file[name].attrs["units"] = unit
    return ASKED


def _mat73(path: Path) -> dict[str, Any]:
    write_mat73(path, {"time": T, "F": F, "x": X})
    return {"force": "run.F", "displacement": "run.x"}


def _uff(path: Path) -> dict[str, Any]:
    jfsm.Record(T, F, X).write(path.with_suffix(".uff"))
    path.with_suffix(".uff").rename(path)
    return {}


def _json(path: Path) -> dict[str, Any]:
    import json

    path.write_text(json.dumps({"time": T.tolist(), "F": F.tolist(), "x": X.tolist(), "units": {"F": "N", "x": "m"}}))
    return ASKED


def _tdms(path: Path) -> dict[str, Any]:
    import nptdms

    clock = {"wf_increment": STEP, "wf_start_offset": 0.0}
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject("g", name, values, properties={**clock, "unit_string": unit})
                for name, values, unit in (("F", F, "N"), ("x", X, "m"))
            ]
        )
    return {"force": "g/F", "displacement": "g/x"}


def _xlsx(path: Path) -> dict[str, Any]:
    import openpyxl

    book = openpyxl.Workbook()
    sheet: Any = book.active
    sheet.append(["time [s]", "F [N]", "x [mm]"])
    for row in zip(T.tolist(), F.tolist(), (1e3 * X).tolist(), strict=True):
        sheet.append(row)
    stream = io.BytesIO()
    book.save(stream)
    path.write_bytes(stream.getvalue())
    return ASKED


def _parquet(path: Path) -> dict[str, Any]:
    import pyarrow
    import pyarrow.parquet

    pyarrow.parquet.write_table(pyarrow.table({"time [s]": T, "F [N]": F, "x [m]": X}), path, compression="none")
    return ASKED


def _feather(path: Path) -> dict[str, Any]:
    import pyarrow
    import pyarrow.feather

    table = pyarrow.table({"time [s]": T, "F [N]": F, "x [m]": X})
    pyarrow.feather.write_feather(table, str(path), compression="uncompressed")
    return ASKED


def _at2(path: Path) -> dict[str, Any]:
    rows = "".join("".join(f"{value:15.7E}" for value in F[i : i + 5]) + "\n" for i in range(0, N, 5))
    path.write_text(f"PEER NGA\nQUAKE\nACCELERATION TIME SERIES IN UNITS OF G\nNPTS= {N}, DT= .0050 SEC\n" + rows)
    return {"base_acceleration": "ground acceleration"}


def _sto(path: Path) -> dict[str, Any]:
    rows = "".join(f"{t:.6f}\t{f:.6f}\t{x:.8f}\n" for t, f, x in zip(T, F, X, strict=True))
    path.write_text(f"run\nversion=1\nnRows={N}\nnColumns=3\ninDegrees=no\nendheader\ntime\tF\tx\n" + rows)
    return {**ASKED, "units": {"F": "N", "x": "m"}}


def _c3d(path: Path) -> dict[str, Any]:
    import ezc3d

    file = ezc3d.c3d()
    for group, rate, labels, units in (("POINT", RATE, ("toe",), ["m"]), ("ANALOG", RATE, ("Fz",), ["N"])):
        file["parameters"][group]["RATE"]["value"] = [rate]
        file["parameters"][group]["LABELS"]["value"] = labels
        file["parameters"][group]["UNITS"]["value"] = units
    points = np.ones((4, 1, N))
    points[2, 0] = X
    file["data"]["points"], file["data"]["analogs"] = points, F.reshape(1, 1, N)
    file.write(str(path.with_suffix(".c3d")))
    path.with_suffix(".c3d").rename(path)
    return {"force": "Fz", "displacement": "toe.Z"}


def _ulog(path: Path) -> dict[str, Any]:
    import struct

    def message(kind: bytes, body: bytes) -> bytes:
        return struct.pack("<HB", len(body), ord(kind)) + body

    log = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 1_000_000) + message(b"B", bytes(40))
    log += message(b"F", b"rig:uint64_t timestamp;double F;double x;")
    log += message(b"A", struct.pack("<BH", 0, 0) + b"rig")
    for i, (f, x) in enumerate(zip(F, X, strict=True)):
        log += message(b"D", struct.pack("<HQdd", 0, 1_000_000 + 5000 * i, f, x))
    path.write_bytes(log)
    return {"force": "rig.F", "displacement": "rig.x"}


def _bag(path: Path) -> dict[str, Any]:
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    path.unlink(missing_ok=True)
    with Writer(path) as writer:
        _send(store, writer, store.serialize_ros1)
    return {"force": "/rig.x", "displacement": "/rig.y", "units": {"/rig.x": "N", "/rig.y": "m"}}


def _mcap(path: Path) -> dict[str, Any]:
    import shutil

    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store, folder = get_typestore(Stores.ROS2_HUMBLE), path.with_suffix("")
    shutil.rmtree(folder, ignore_errors=True)
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        _send(store, writer, store.serialize_cdr)
    next(folder.glob("*.mcap")).rename(path)
    return {"force": "/rig.x", "displacement": "/rig.y", "units": {"/rig.x": "N", "/rig.y": "m"}}


def _send(store: Any, writer: Any, serialized: Callable[[Any, str], Any]) -> None:
    kind = "geometry_msgs/msg/Vector3"
    rig = writer.add_connection("/rig", kind, typestore=store)
    for i, (f, x) in enumerate(zip(F, X, strict=True)):
        writer.write(rig, 10**18 + 5_000_000 * i, serialized(store.types[kind](float(f), float(x), 0.0), kind))


def _imc(path: Path) -> dict[str, Any]:
    path.write_bytes(imc_file([ImcChannel("F", F), ImcChannel("x", X, unit="m")]))
    return ASKED


def _catman(path: Path) -> dict[str, Any]:
    times = CatmanChannel("Time  1", T, "s")
    path.write_bytes(catman_file([times, CatmanChannel("F", F), CatmanChannel("x", X, "m")]))
    return ASKED


def _ardupilot(path: Path) -> dict[str, Any]:
    import struct

    def message(kind: int, body: bytes) -> bytes:
        return b"\xa3\x95" + bytes([kind]) + body

    log = b"".join(
        message(128, struct.pack("<BB4s16s64s", number, size, name, letters, fields))
        for number, size, name, letters, fields in (
            (128, 89, b"FMT", b"BBnNZ", b"Type,Length,Name,Format,Columns"),
            (10, 27, b"RIG", b"Qdd", b"TimeUS,F,x"),
        )
    )
    for i, (f, x) in enumerate(zip(F, X, strict=True)):
        log += message(10, struct.pack("<Qdd", 5000 * i, f, x))
    path.write_bytes(log)
    return {"force": "RIG.F", "displacement": "RIG.x", "units": {"RIG.F": "N", "RIG.x": "m"}}


WRITERS: dict[str, Writer] = {
    writer.__name__[1:]: writer
    for writer in (
        _csv, _german, _lvm, _json, _at2, _sto, _wav, _npy, _npz, _mat, _mat73, _h5, _uff, _tdms, _xlsx, _parquet,
        _feather, _c3d, _ulog, _bag, _mcap, _imc, _catman, _ardupilot,
    )
}  # fmt: skip
TEXT = ("csv", "german", "lvm", "json", "at2", "sto")


def edits(name: str, original: bytes, rng: np.random.Generator) -> tuple[str, bytes]:
    """A kind of edit, and the edited file."""
    kinds = ["cut", "flip", "flips", "drop", "zeros", "twice"] + (["line", "word", "digit"] if name in TEXT else [])
    kind, size = str(rng.choice(kinds)), len(original)
    at = int(rng.integers(0, size))
    if kind == "cut":
        return kind, original[:at]
    if kind in ("flip", "flips"):
        edited = bytearray(original)
        for place in rng.integers(0, size, 1 if kind == "flip" else 20):
            edited[place] = int(rng.integers(0, 256))
        return kind, bytes(edited)
    if kind in ("drop", "zeros", "twice"):
        length = int(rng.integers(1, max(2, size // 10)))
        filling = {"drop": b"", "zeros": bytes(length), "twice": 2 * original[at : at + length]}[kind]
        return kind, original[:at] + filling + original[at + length :]
    lines = original.split(b"\n")
    place = int(rng.integers(0, len(lines)))
    if kind == "line":
        lines[place : place + 1] = [] if rng.random() < 0.5 else [lines[place]] * 2
    elif kind == "word":
        marks = [b",", b";", b"\t", b" ", b".", b"nan", b"--", b"x", b'"', b"1e3", b"\xff", b"-", b"[", b"="]
        column = int(rng.integers(0, len(lines[place]) + 1))
        lines[place] = lines[place][:column] + marks[int(rng.integers(0, len(marks)))] + lines[place][column:]
    else:
        lines[place] = lines[place].replace(b"%d" % rng.integers(0, 10), b"%d" % rng.integers(0, 10))
    return kind, b"\n".join(lines)


def outcome(path: Path, asked: dict[str, Any], usual: tuple[str, ...]) -> tuple[str, str]:
    """What becomes of reading a file: right, as stated, noted, refused, silent or trace; and the words for it."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            record = jfsm.read(path, **asked)
    except (ValueError, TypeError, ModuleNotFoundError, OSError) as error:
        *_, (frame, _) = traceback.walk_tb(error.__traceback__)
        inside = str(frame.f_globals.get("__name__", "")).startswith("jfsm.")
        if inside or isinstance(error, OSError):
            return "refused", str(error)
        return "trace", "".join(traceback.format_exception(error)[-6:])
    except Exception as error:
        return "trace", "".join(traceback.format_exception(error)[-6:])
    new = [note for note in record.notes if note not in usual]
    lost = len(record) < N
    off = 0
    for kind, truth in (("force", F), ("displacement", X), ("base_acceleration", 9.80665 * F)):
        found = record.base_acceleration if kind == "base_acceleration" else record.channels.get((kind, 1))
        if found is None:
            continue
        size = min(found.size, N)
        off = max(off, int(np.sum(~np.isclose(found[:size], truth[:size], rtol=1e-5, atol=1e-6 * np.ptp(truth)))))
    late = len(record) >= N and not np.allclose(record.time[:N] - record.time[0], T, atol=1e-7)
    if not lost and not off and not late and len(record) == N:
        return "right", ""
    words = f"{len(record)} samples, {off} differ{', other clock' if late else ''}"
    if new:
        return "noted", f"{words}: {new}"
    last = abs(float(record.time[-1] - record.time[0]) - T[-1])
    if (lost and last > STEP / 2) or len(record) > N:  # gaps that the clock shows are no loss
        return "silent", words
    return "as stated", words


def tried(count: int, names: tuple[str, ...], seed: int = 0) -> Iterator[tuple[str, str, str, str]]:
    """Kind of file, kind of edit, outcome and words, of so many edits."""
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            path = Path(folder) / f"run_{name}{f'.{name}' if name in ('bag', 'mcap') else ''}"
            asked = WRITERS[name](path)
            original, usual = path.read_bytes(), jfsm.read(path, **asked).notes
            rng = np.random.default_rng([seed, *name.encode()])
            for _ in range(max(1, count // len(names))):
                kind, edited = edits(name, original, rng)
                path.write_bytes(edited)
                what, words = outcome(path, asked, usual)
                if what == "silent" and kind == "cut" and " 0 differ" in words and name in (*TEXT, "ulog", "ardupilot"):
                    what = "as stated"  # between two rows or messages: nothing shows that there were more
                yield name, kind, what, words


if __name__ == "__main__":
    tally: collections.Counter[tuple[str, str]] = collections.Counter()
    shown: collections.Counter[tuple[str, str]] = collections.Counter()
    for name, kind, what, words in tried(int(sys.argv[1]), tuple(sys.argv[2:]) or tuple(WRITERS)):
        tally[name, what] += 1
        if what in ("trace", "silent") and shown[name, what] < 4:
            shown[name, what] += 1
            print(name, kind, what.upper(), words, flush=True)
    for name in dict.fromkeys(name for name, _ in tally):
        print(f"{name:8}", {what: count for (of, what), count in tally.items() if of == name})
