"""Motion capture (.c3d), after the public description of the format (c3d.org)."""

import os
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np

from jfsm.records.formats.base import AbstractFormat, Contents, Lazy

_BLOCK, _KEY, _DEC = 512, 0x50, 85
_ORDERS = {84: "<", _DEC: "<", 86: ">"}  # Intel, DEC, MIPS
_AXES = "XYZ"
_SPELT = {"Nmm": "N mm", "uV": "µV"}

Parameters = Mapping[tuple[str, str], list[Any]]


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
        return processor < len(begins_with) and begins_with[processor] in _ORDERS

    def load(self, path: Path) -> Contents:
        try:
            with path.open("rb") as stream:
                data = stream.read(256 * _BLOCK)
            parameters, layout = _parameters(data), _layout(data, path)
        except (struct.error, IndexError, UnicodeDecodeError) as error:
            raise ValueError(
                f"{path.name} must be a C3D file; its header and parameters cannot be made out ({error}). Copy it "
                f"again."
            ) from error
        return _contents(path, parameters, layout, _more(layout, path))


class _Layout(NamedTuple):
    """Where the numbers lie: markers, analogue channels and how often they are sampled in a frame, and the frames."""

    order: str
    markers: int
    channels: int
    often: int
    first: int
    frames: int
    start: int
    scale: float  # of integers; negative where numbers are real
    rate: float

    @property
    def width(self) -> int:
        """Numbers of a frame."""
        return 4 * self.markers + self.channels * self.often

    @property
    def number(self) -> np.dtype:
        """How they are kept."""
        return np.dtype(f"{self.order}{'f4' if self.scale < 0 else 'i2'}")


def _order(data: bytes) -> str:
    return _ORDERS[data[(data[0] - 1) * _BLOCK + 3]]


def _layout(data: bytes, path: Path) -> _Layout:
    order = _order(data)
    if data[(data[0] - 1) * _BLOCK + 3] == _DEC:
        raise ValueError(f"{path.name} was written on a DEC, whose numbers are not read. Convert it by Mokka or BTK.")
    markers, samples, first, last, _, scale, start, often, rate = struct.unpack_from(f"{order}5Hf2Hf", data, 2)
    often = max(often, 1)
    layout = _Layout(order, markers, samples // often, often, first, last - first + 1, start, scale, rate)
    if not (layout.width and layout.start >= 2 and np.isfinite(scale) and scale and np.isfinite(rate) and rate > 0):
        raise ValueError(
            f"{path.name} must announce markers or channels, their place, scale and frame rate; it announces {markers} "
            f"markers, {layout.channels} channels, block {start}, scale {scale:g} and {rate:g} Hz. Copy it again."
        )
    if last == 0xFFFF or last < first:  # more than the header can say
        size = path.stat().st_size - (start - 1) * _BLOCK
        layout = layout._replace(frames=max(size, 0) // (layout.width * layout.number.itemsize))
    return layout


def _more(layout: _Layout, path: Path) -> int:
    """Bytes behind the frames, beyond the rest of the last block.

    Raises
    ------
    ValueError
        If the file ends before its frames do.
    """
    size = os.path.getsize(path) - (layout.start - 1) * _BLOCK
    held = max(size, 0) // (layout.width * layout.number.itemsize)
    if held < layout.frames or layout.frames < 2:
        raise ValueError(
            f"{path.name} is cut short: it holds {held} of the {layout.frames} frames that it announces. Copy it again."
        )
    return max(0, size - -(-layout.frames * layout.width * layout.number.itemsize // _BLOCK) * _BLOCK)


def _parameters(data: bytes) -> Parameters:
    """Values by group and name, in capitals."""
    order, place = _order(data), (data[0] - 1) * _BLOCK + 4
    groups: dict[int, str] = {}
    found: list[tuple[int, str, list[Any]]] = []
    while place < len(data):
        length, number = struct.unpack_from("bb", data, place)
        if length == 0:
            break
        after = place + 2 + abs(length)
        name = data[place + 2 : after].decode("latin-1").upper()
        step = struct.unpack_from(f"{order}h", data, after)[0]
        if number < 0:
            groups[-number] = name
        else:
            found.append((number, name, _values(data, after + 2, order)))
        if step <= 0:
            break
        place = after + step
    return {(groups.get(number, ""), name): values for number, name, values in found}


def _values(data: bytes, place: int, order: str) -> list[Any]:
    """What a parameter holds: texts, or numbers."""
    kind, dimensions = struct.unpack_from("bB", data, place)
    sizes = list(data[place + 2 : place + 2 + dimensions])
    count, place = int(np.prod(sizes, dtype=np.int64)), place + 2 + dimensions
    if kind == -1:
        length = sizes[0] if sizes else 1
        text = data[place : place + count].decode("latin-1")
        return [text[at : at + length].strip(" \0") for at in range(0, count, max(length, 1))]
    letter = {1: "b", 2: "H", 4: "f"}.get(kind)
    return list(struct.unpack_from(f"{order}{count}{letter}", data, place)) if letter else []


def _contents(path: Path, parameters: Parameters, layout: _Layout, more: int) -> Contents:
    markers = {
        f"{label}.{letter}": (place, axis)
        for place, label in enumerate(_labels(parameters, "POINT", layout.markers))
        for axis, letter in enumerate(_AXES)
    }
    labels = _labels(parameters, "ANALOG", layout.channels)
    channels = {label: place for place, label in enumerate(labels) if label not in markers}
    length, stated = "".join(parameters.get(("POINT", "UNITS"), [""])[:1]), parameters.get(("ANALOG", "UNITS"), [])
    units = dict.fromkeys(markers, length)
    units |= {name: stated[place] for name, place in channels.items() if place < len(stated)}
    begins = (layout.first - 1) / layout.rate

    def array(name: str) -> np.ndarray:
        shape = (layout.frames, layout.width)
        frames = np.memmap(path, layout.number, "r", (layout.start - 1) * _BLOCK, shape)
        with np.errstate(invalid="ignore"):  # what is no number becomes one that is refused
            if name in markers:
                return _of_marker(frames, layout, *markers[name])
            return _of_channel(frames, layout, parameters, channels[name])

    def clock(name: str) -> np.ndarray:
        often = 1 if name in markers else layout.often
        return begins + np.arange(layout.frames * often) / (layout.rate * often)

    return Contents(
        Lazy([*markers, *channels], array),
        {name: _SPELT.get(unit, unit) for name, unit in units.items() if unit},
        clocks=Lazy([*markers, *channels], clock),
        notes=tuple(_notes(parameters, layout, more)),
    )


def _of_marker(frames: np.ndarray, layout: _Layout, place: int, axis: int) -> np.ndarray:
    values = np.asarray(frames[:, 4 * place + axis], dtype=np.float64) * (1.0 if layout.scale < 0 else layout.scale)
    values[np.asarray(frames[:, 4 * place + 3], dtype=np.float64) < 0] = np.nan
    return values


def _of_channel(frames: np.ndarray, layout: _Layout, parameters: Parameters, place: int) -> np.ndarray:
    def stated(name: str, otherwise: float, at: int = 0) -> float:
        values = parameters.get(("ANALOG", name), [])
        return float(values[at]) if at < len(values) else otherwise

    raw = frames[:, 4 * layout.markers + place :: layout.channels][:, : layout.often].reshape(-1)
    unsigned = parameters.get(("ANALOG", "FORMAT"), [""])[:1] == ["UNSIGNED"]
    if layout.scale > 0 and unsigned:
        raw = raw.view(f"{layout.order}u2")
    offset = stated("OFFSET", 0.0, place)
    offset -= 65536.0 if offset >= 32768 and not unsigned else 0.0
    return (np.asarray(raw, dtype=np.float64) - offset) * stated("SCALE", 1.0, place) * stated("GEN_SCALE", 1.0)


def _labels(parameters: Parameters, group: str, count: int) -> list[str]:
    """As many labels as there are channels, each its own; those beyond 255 stand in LABELS2 and so on."""
    found = [label for more in ("", "2", "3", "4") for label in parameters.get((group, f"LABELS{more}"), [])]
    names: dict[str, None] = {}
    for place in range(count):
        label = found[place] if place < len(found) else ""
        label = label or f"{group.lower()} {place + 1}"
        names[label if label not in names else f"{label} ({place + 1})"] = None
    return list(names)


def _notes(parameters: Parameters, layout: _Layout, more: int) -> Iterator[str]:
    if more:
        yield f"The file goes on for {more} bytes behind its frames: if bytes came into it, numbers are wrong."
    if layout.first != 1:
        yield f"The clock reads zero at frame 1; the first frame of the file is number {layout.first}."
    zero = parameters.get(("FORCE_PLATFORM", "ZERO"), [])
    if any(zero):
        yield f"Frames {zero} are stated for the zero of the force plates; it is not taken off."
    rate = parameters.get(("POINT", "RATE"), [layout.rate])[0]
    if abs(rate / layout.rate - 1.0) > 1e-6:
        yield f"The parameters state {rate:g} frames per second, the header {layout.rate:g}, which counts."
