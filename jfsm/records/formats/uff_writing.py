"""Universal files (UFF): how they are written.

pyuff, which reads them, is not used to write them: it reads the whole file anew after every dataset, and announces half
the bytes of a binary dataset with an uneven abscissa.
"""

import json
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from jfsm._files import parsed_json
from jfsm.records.formats.base import ABOUT, Contents

# specific data types, and what they are here; a reaction force (9) is read as a force
KINDS = {8: "displacement", 9: "force", 11: "velocity", 12: "acceleration", 13: "force"}
_TYPES = {kind: number for number, kind in KINDS.items()} | {"base_acceleration": 12, "time": 17}
_EVEN = 1e-4  # relative deviation of a step up to which an abscissa is written as even
_TRANSLATION_X = 1


def save_uff(path: Path, contents: Contents) -> None:
    """Write datasets 151 and 164, then a dataset 58b in double precision for each channel.

    A dof is a node, measured along X. The header of a dataset gives its step to six digits, so the exact instants are a
    channel too; what the record says of itself is one more, of character codes. Both are read by `UffFormat`.
    """
    instants = np.asarray(contents.arrays["time"], dtype=np.float64)
    remarks = np.frombuffer(json.dumps(dict(contents.about)).encode("ascii"), dtype=np.uint8)
    with path.open("wb") as stream:
        _write_lines(stream, _header(contents.about))
        _write_lines(stream, _units())
        for name, array in contents.arrays.items():
            kind, _, dof = name.rpartition("_")
            kind, node = (kind, int(dof)) if dof.isdigit() else (name, 0)
            _write_function(stream, name, kind, node, contents.units.get(name, "1"), instants, np.asarray(array))
        _write_function(stream, ABOUT, "", 0, "", np.arange(float(remarks.size)), remarks)


def about_from(codes: np.ndarray, path: Path) -> Mapping[str, Any]:
    """What a record said of itself, from the channel of character codes.

    Raises
    ------
    ValueError
        If they are damaged.
    """
    try:
        return parsed_json("".join(chr(round(code)) for code in codes.tolist()))
    except (ValueError, OverflowError) as error:
        raise ValueError(
            f"{path.name} must hold the remarks of the record that was written to it; they are damaged ({error}). Copy "
            f"the file again."
        ) from error


def _header(about: Mapping[str, Any]) -> list[str]:
    """Dataset 151."""
    date = time.strftime("%d-%b-%y %H:%M:%S  ").upper()
    title = str(about.get("name") or "NONE")
    return [f"{151:6d}", title, "Record written by jfsm", "jfsm", f"{date}{0:10d}{0:10d}{0:10d}", date, "jfsm", date]


def _units() -> list[str]:
    """Dataset 164: SI, to which the factors are 1."""
    factors = [f"{value:25.17E}".replace("E", "D") for value in (1.0, 1.0, 1.0, 273.15)]
    return [f"{164:6d}", f"{1:10d}{'SI: Meter (newton)':<20}{2:10d}", "".join(factors[:3]), factors[3]]


def _write_function(
    stream: BinaryIO, name: str, kind: str, node: int, unit: str, abscissa: np.ndarray, ordinate: np.ndarray
) -> None:
    """Dataset 58b of one channel; the character codes, which are of no kind, have no abscissa of time."""
    steps = np.diff(abscissa)
    step = float(steps.mean())
    even = bool(np.allclose(steps, step, rtol=_EVEN, atol=0.0))
    values = np.ascontiguousarray(ordinate if even else np.stack([abscissa, ordinate], axis=1), dtype="<f8")
    start, step = (float(abscissa[0]), step) if even else (0.0, 0.0)
    direction = _TRANSLATION_X if node else 0
    lines = [
        f"{58:6d}b{1:6d}{2:6d}{11:12d}{values.nbytes:12d}{0:6d}{0:6d}{0:12d}{0:12d}",  # little endian, IEEE 754
        *(name, "NONE", "NONE", "NONE", "NONE"),
        f"{int(bool(kind)):5d}{0:10d}{0:5d}{0:10d} {'NONE':<10}{node:10d}{direction:4d} {'NONE':<10}{0:10d}{0:4d}",
        f"{4:10d}{ordinate.size:10d}{even:10d}{start:13.5E}{step:13.5E}{0:13.5E}",
        _axis(_TYPES["time"], "time", "s") if kind else _axis(1, "", ""),
        _axis(_TYPES.get(kind, 1), kind, unit.replace("²", "^2")),
        *(_axis(0, "", ""), _axis(0, "", "")),
    ]
    _write_lines(stream, lines, values.tobytes())


def _axis(number: int, label: str, unit: str) -> str:
    return f"{number:10d}{0:5d}{0:5d}{0:5d} {label or 'NONE':<20} {unit or 'NONE':<20}"


def _write_lines(stream: BinaryIO, lines: list[str], binary: bytes = b"") -> None:
    """One dataset between its marks, in lines of 80 characters."""
    for line in ("    -1", *lines):
        stream.write(f"{line[:80]:<80}\n".encode("ascii", "replace"))
    stream.write(binary + b"    -1\n")
