"""Motion capture (.c3d), through ezc3d (an optional extra)."""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from jfsm.records.formats.base import AbstractFormat, Contents, Lazy, optional_package

_BLOCK, _KEY, _PROCESSORS = 512, 0x50, (84, 85, 86)  # Intel, DEC, MIPS
_AXES = "XYZ"


class C3dFormat(AbstractFormat):
    """Markers as ``LABEL.X``, analogue channels by label, on clocks of their own that begin with the first frame.

    Read only. What a marker's residual calls invalid is a gap.
    """

    name: ClassVar[str] = "C3D"
    suffixes: ClassVar[tuple[str, ...]] = (".c3d",)

    def recognises(self, begins_with: bytes, path: Path) -> bool:
        if len(begins_with) < 2 * _BLOCK or begins_with[1] != _KEY or begins_with[0] < 2:
            return False
        processor = (begins_with[0] - 1) * _BLOCK + 3
        return processor < len(begins_with) and begins_with[processor] in _PROCESSORS

    def load(self, path: Path) -> Contents:
        ezc3d: Any = optional_package("ezc3d", "c3d", path)
        try:
            file = ezc3d.c3d(str(path))
        except Exception as error:  # whatever the reader stumbles over in bytes that are no such file
            raise ValueError(
                f"{path.name} must be a C3D file; it cannot be opened as one ({error}), and may be cut short. Write or "
                f"copy it again."
            ) from error
        parameters, header = file["parameters"], file["header"]
        points, analogs = file["data"]["points"], file["data"]["analogs"][0]
        announced = _announced(path)
        if points.shape[2] < announced:  # the reader drops what is missing
            raise ValueError(
                f"{path.name} is cut short: it holds {points.shape[2]} of the {announced} frames that it announces. "
                f"Copy it again."
            )
        frames = float(header["points"]["first_frame"])
        clocks, arrays, units = dict[str, np.ndarray](), dict[str, np.ndarray](), dict[str, str]()
        rate = _single(parameters, "POINT", "RATE")
        for place, label in enumerate(_labels(parameters, "POINT", points.shape[1])):
            for axis, letter in enumerate(_AXES):
                name = f"{label}.{letter}"
                arrays[name] = points[axis, place]
                units[name] = str(_single(parameters, "POINT", "UNITS") or "")
                clocks[name] = (frames + np.arange(points.shape[2])) / rate
        fast = _single(parameters, "ANALOG", "RATE")
        stated = _all(parameters, "ANALOG", "UNITS")
        for place, label in enumerate(_labels(parameters, "ANALOG", analogs.shape[0])):
            arrays[label] = analogs[place]
            units[label] = str(stated[place]) if place < len(stated) else ""
            clocks[label] = frames / rate + np.arange(analogs.shape[1]) / fast
        return Contents(
            Lazy(arrays, lambda name: arrays[name]),
            {name: _spelt(unit) for name, unit in units.items() if unit.strip()},
            clocks=Lazy(arrays, lambda name: clocks[name]),
            notes=tuple(_notes(parameters, frames)),
        )


def _announced(path: Path) -> int:
    """How many frames the header says that there are; no more than 65535 can stand there."""
    with path.open("rb") as stream:
        begins_with = stream.read(256 * _BLOCK)
    order = ">" if begins_with[(begins_with[0] - 1) * _BLOCK + 3] == _PROCESSORS[-1] else "<"
    first, last = struct.unpack_from(f"{order}HH", begins_with, 6)
    return last - first + 1


def _labels(parameters: Any, group: str, count: int) -> list[str]:
    """As many labels as there are channels, each its own; those beyond 255 stand in LABELS2 and so on."""
    found = [label for more in ("", "2", "3", "4") for label in _all(parameters, group, f"LABELS{more}")]
    names: dict[str, None] = {}
    for place in range(count):
        label = str(found[place]).strip() if place < len(found) else ""
        label = label or f"{group.lower()} {place + 1}"
        names[label if label not in names else f"{label} ({place + 1})"] = None
    return list(names)


def _all(parameters: Any, group: str, name: str) -> list[Any]:
    return list(parameters[group][name]["value"]) if group in parameters and name in parameters[group] else []


def _single(parameters: Any, group: str, name: str) -> Any:
    return next(iter(_all(parameters, group, name)), None)


def _spelt(unit: str) -> str:
    return {"Nmm": "N mm", "uV": "µV"}.get(unit.strip(), unit.strip())


def _notes(parameters: Any, frames: float) -> Iterator[str]:
    if frames:
        yield f"The clock reads zero at frame 1; the first frame of the file is number {frames + 1:.0f}."
    zero = [int(frame) for frame in _all(parameters, "FORCE_PLATFORM", "ZERO")]
    if any(zero):
        yield f"Frames {zero} are stated for the zero of the force plates; it is not taken off."
