"""Strong-motion records in text: PEER (AT2, VT2, DT2), CSMIP/CGS/COSMOS (V1, V2) and K-NET/KiK-net."""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from jfsm.records.formats.base import AbstractFormat, Contents, unique_names
from jfsm.records.formats.text.lines import TextFile, encoding_of

_NUMBER = r"[-+]?\d*\.?\d+(?:[eEdD][-+]?\d+)?"
_NPTS = re.compile(rf"NPTS\s*=\s*(\d+)\s*,?\s*DT\s*=\s*({_NUMBER})", re.IGNORECASE)
_NPTS_OLD = re.compile(rf"^\s*(\d+)\s+({_NUMBER})\s+NPTS\s*,\s*DT", re.IGNORECASE)
_QUANTITIES = {"acceleration": "base_acceleration", "velocity": "velocity", "displacement": "displacement"}


class PeerFormat(AbstractFormat):
    """The one channel of a PEER file, on the clock that its fourth line states. Read only.

    An acceleration is that of the base.
    """

    name: ClassVar[str] = "PEER strong-motion (AT2)"
    suffixes: ClassVar[tuple[str, ...]] = (".at2", ".vt2", ".dt2")

    def recognises(self, begins_with: bytes, path: Path) -> bool:
        return _announced(_text(begins_with).splitlines()[:6]) is not None

    def load(self, path: Path) -> Contents:
        lines = [line for _, line in TextFile(path).lines()]
        announced = _announced(lines[:6])
        assert announced is not None
        place, count, step = announced
        words = " ".join(lines[:place])
        quantity = next((word for word in _QUANTITIES if word in words.lower()), "acceleration")
        unit = re.search(r"UNITS?\s+(?:OF|IN)\s+(\S+)", words, re.IGNORECASE)
        values = _numbers(lines, place + 1, path)
        if values.size != count:
            raise ValueError(
                f"{path.name} must hold the {count} samples that it announces; it holds {values.size}. Copy it again."
            )
        name = f"ground {quantity}"
        return Contents(
            {name: values},
            {name: unit[1].strip(".,")} if unit else {},
            clocks={name: _counted(step, count)},
            kinds={name: "base_acceleration"} if quantity == "acceleration" else {},
            notes=tuple(f"The file says: {line.strip()!r}." for line in lines[1:2] if line.strip()),
        )


class CosmosFormat(AbstractFormat):
    """The channels of CSMIP, CGS and COSMOS volume 1 and 2 files, by place and direction. Read only.

    Blocks begin with a line that gives count, unit, step and format of the samples, which are cut by their width:
    numbers may touch.
    """

    name: ClassVar[str] = "strong-motion (V1, V2)"
    suffixes: ClassVar[tuple[str, ...]] = (".v1", ".v2")
    _BLOCK = re.compile(
        r"^\s*(?P<count>\d+)\s+(?:points\s+of\s+)?(?P<quantity>accel\w*|veloc\w*|displ\w*)\s+(?:data|pts)\b(?P<rest>.*)$",
        re.IGNORECASE,
    )
    _STEP = re.compile(rf"(?:equally\s+spaced\s+at|at|dt\s*=?)\s*({_NUMBER})\s*sec", re.IGNORECASE)
    _RATE = re.compile(rf"at\s+({_NUMBER})\s*(?:samples?\s*/\s*sec|sps|hz)", re.IGNORECASE)
    _UNIT = re.compile(r"\bin\s+([A-Za-z/^0-9*]+)", re.IGNORECASE)
    _LAYOUT = re.compile(r"(\d+)[FEG](\d+)\.\d+", re.IGNORECASE)

    def recognises(self, begins_with: bytes, path: Path) -> bool:
        text = _text(begins_with)
        words = re.search(r"(corrected|uncorrected|raw)\s+accel|strong.motion", text[:800], re.IGNORECASE)
        return bool(words) and any(map(self._BLOCK.match, _text(_some(path)).splitlines()))

    def load(self, path: Path) -> Contents:
        lines = [line for _, line in TextFile(path).lines()]
        arrays: dict[str, np.ndarray] = {}
        units: dict[str, str] = {}
        steps: dict[str, float] = {}
        kinds: dict[str, str] = {}
        names: list[str] = []
        blocks: list[tuple[str, np.ndarray, str, float]] = []
        channel = ""
        for place, line in enumerate(lines):
            found = re.search(r"\bChan(?:nel)?\.?\s*(\d+)\s*:?\s*([^:]{0,20})", line, re.IGNORECASE)
            if found and not self._BLOCK.match(line):
                channel = f"channel {found[1]} {found[2].strip()}".strip()
            block = self._BLOCK.match(line)
            if block is None:
                continue
            step, rate = self._STEP.search(line), self._RATE.search(line)
            unit = self._UNIT.search(block["rest"])
            layout = next((m for text in lines[place : place + 2] if (m := self._LAYOUT.search(text))), None)
            if not (step or rate):
                raise ValueError(
                    f"{path.name} must give the step of its samples in line {place + 1}, which is "
                    f"{line.strip()[:60]!r}. Write it as text with a column of time."
                )
            seconds = float(step[1]) if step else 1.0 / float(rate[1])  # pyright: ignore[reportOptionalSubscript]
            values = _cut(lines[place + 1 :], int(block["count"]), int(layout[2]) if layout else None)
            if values.size != int(block["count"]):
                raise ValueError(
                    f"{path.name} must hold the {block['count']} samples that line {place + 1} announces; "
                    f"{values.size} follow. Copy it again."
                )
            quantity = next(word for word in _QUANTITIES if word[:5] == block["quantity"].lower()[:5])
            names.append(f"{channel} {quantity}".strip())
            blocks.append((quantity, values, unit[1].rstrip(".") if unit else "", seconds))
        for name, (quantity, values, unit, seconds) in zip(unique_names(names), blocks, strict=True):
            arrays[name], steps[name], kinds[name] = values, seconds, _QUANTITIES[quantity]
            if unit:
                units[name] = unit
        if not arrays:
            raise ValueError(f"{path.name} must hold a block of samples; it holds none. Copy it again.")
        accelerations = [name for name, kind in kinds.items() if kind == "base_acceleration"]
        kinds = {} if len(accelerations) > 1 else {name: "base_acceleration" for name in accelerations}
        return Contents(
            arrays,
            units,
            clocks={name: _counted(steps[name], array.size) for name, array in arrays.items()},
            kinds=kinds,
        )


class KnetFormat(AbstractFormat):
    """The channel of a K-NET or KiK-net file, its counts multiplied by the scale that the file states. Read only."""

    name: ClassVar[str] = "K-NET strong-motion"
    suffixes: ClassVar[tuple[str, ...]] = (".ew", ".ns", ".ud")
    _SCALE = re.compile(rf"({_NUMBER})\s*\(?\s*([A-Za-z/0-9^]+)\s*\)?\s*/\s*({_NUMBER})")

    def recognises(self, begins_with: bytes, path: Path) -> bool:
        return begins_with.startswith(b"Origin Time") and b"Scale Factor" in begins_with

    def load(self, path: Path) -> Contents:
        lines = [line for _, line in TextFile(path).lines()]
        start = next((place for place, line in enumerate(lines) if line.startswith("Memo")), None)
        head = {line[:17].strip(): line[17:].strip() for line in lines[: start or 0]}
        scale = self._SCALE.search(head.get("Scale Factor", ""))
        rate = re.search(_NUMBER, head.get("Sampling Freq(Hz)", ""))
        if start is None or scale is None or rate is None:
            raise ValueError(
                f"{path.name} must state Scale Factor, Sampling Freq(Hz) and Memo, as K-NET files do. Copy it again."
            )
        counts = _numbers(lines, start + 1, path)
        values = counts * float(scale[1]) / float(scale[3])
        name = head.get("Dir.", "acceleration").replace("-", "") or "acceleration"
        begun = head.get("Record Time", "")
        notes = [
            f"Counts are multiplied by {head['Scale Factor']}.",
            *(
                [f"The record says it begins at {begun} (of Japan, and 15 s late by the recorder's delay)."]
                if begun
                else []
            ),
        ]
        return Contents(
            {name: values},
            {name: scale[2]},
            clocks={name: np.arange(counts.size) / float(rate.group())},
            kinds={name: "base_acceleration"},
            notes=tuple(notes),
        )


def _counted(step: float, count: int) -> NDArray[np.float64]:
    return np.arange(count, dtype=np.float64) * step


def _text(begins_with: bytes) -> str:
    return begins_with.decode("latin-1") if encoding_of(begins_with) else ""


def _some(path: Path) -> bytes:
    with path.open("rb") as stream:
        return stream.read(1 << 15)


def _announced(lines: Sequence[str]) -> tuple[int, int, float] | None:
    """The line that gives count and step of a PEER file: its place, and both."""
    for place, line in enumerate(lines):
        match = _NPTS.search(line) or _NPTS_OLD.search(line)
        if match:
            return place, int(match[1]), float(match[2])
    return None


def _numbers(lines: Sequence[str], first: int, path: Path) -> NDArray[np.float64]:
    """All numbers of the lines from one on.

    Raises
    ------
    ValueError
        If something else stands among them.
    """
    values: list[float] = []
    for number, line in enumerate(lines[first:], start=first + 1):
        try:
            values += [float(text) for text in line.split()]
        except ValueError as error:
            raise ValueError(
                f"{path.name} must hold numbers alone below its header; line {number} is {line.strip()[:60]!r}. Repair "
                f"or remove that line."
            ) from error
    return np.array(values)


def _cut(lines: Sequence[str], count: int, width: int | None) -> np.ndarray:
    """The first `count` numbers of lines, cut by their width where it is known."""

    def numbers() -> Iterator[float]:
        for line in lines:
            fields = (
                line.split() if width is None else [line[at : at + width] for at in range(0, len(line.rstrip()), width)]
            )
            try:
                yield from [float(field) for field in fields if field.strip()]
            except ValueError:
                return

    values: list[float] = []
    for value in numbers():
        if len(values) == count:
            break
        values.append(value)
    return np.array(values)
