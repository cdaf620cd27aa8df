"""Flight logs of ArduPilot (DataFlash, .bin), which say themselves how their messages are laid out.

After ArduPilot's description of its logs: a message is A3 95, the number of its type, and its fields one behind the
other; messages FMT give the fields of each type, FMTU, UNIT and MULT their units and multipliers.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from jfsm.records.formats.base import AbstractFormat, Contents, Lazy

_MARK, _FMT, _FMT_SIZE = b"\xa3\x95", 128, 89
_HEAD = 3  # bytes ahead of the fields of a message
_LETTERS = {
    "a": "(32,)<i2", "b": "i1", "B": "u1", "h": "<i2", "H": "<u2", "i": "<i4", "I": "<u4", "f": "<f4", "d": "<f8",
    "n": "S4", "N": "S16", "Z": "S64", "c": "<i2", "C": "<u2", "e": "<i4", "E": "<u4", "L": "<i4", "M": "u1",
    "q": "<i8", "Q": "<u8", "g": "<f2",
}  # fmt: skip
_IMPLIED = {**dict.fromkeys("cCeE", 1e-2), "L": 1e-7}  # multipliers of letters, where the log has none of its own
_CLOCKS = {"SampleUS": 1e-6, "TimeUS": 1e-6, "TimeMS": 1e-3}  # when the sensor read, when it was logged
_SPELT: dict[str, str] = {"degheading": "deg", "UNKNOWN": "", "instance": ""}


@dataclass
class _Type:
    """One type of message: its fields, where its messages begin, and what FMTU says of each field."""

    name: str
    letters: str
    fields: list[str]
    size: int
    places: list[int] = field(default_factory=list)
    units: str = ""
    multipliers: str = ""

    @property
    def row(self) -> np.dtype:
        """A message behind its head."""
        return np.dtype([(name, _LETTERS[letter]) for name, letter in zip(self.fields, self.letters, strict=True)])


class ArduPilotFormat(AbstractFormat):
    """Fields of each message as ``IMU.AccX``, of several sensors as ``IMU[0].AccX``. Read only.

    The clock of a message is that of the sensor (SampleUS) where it has one, else of the log (TimeUS), from its start.
    """

    name: ClassVar[str] = "ArduPilot log"
    suffixes: ClassVar[tuple[str, ...]] = ()

    def recognises(self, begins_with: bytes, path: Path) -> bool:
        return begins_with.startswith(_MARK + bytes([_FMT]))

    def load(self, path: Path) -> Contents:
        data = path.read_bytes()
        types, notes = _walked(data)
        units, multipliers = _described(data, types)
        tables = dict(_tables(data, types))
        places: dict[str, tuple[str, str]] = {}
        stated: dict[str, str] = {}
        aliases: dict[str, tuple[str, ...]] = {}
        scales: dict[str, float] = {}
        for called, (each, rows) in tables.items():
            if _clock_of(rows) is None or rows.size < 2:
                continue
            for at, name in enumerate(each.fields):
                if name in _CLOCKS or rows.dtype[name].kind not in "iuf" or rows.dtype[name].shape:
                    continue
                full = f"{called}.{name}"
                places[full] = called, name
                scales[full] = multipliers.get(each.multipliers[at : at + 1]) or _IMPLIED.get(each.letters[at], 1.0)
                if unit := units.get(each.units[at : at + 1], ""):
                    stated[full] = unit
                if called != each.name:
                    bare = f"{each.name}.{name}"
                    aliases[bare] = (*aliases.get(bare, ()), full)
        if not places:
            raise ValueError(f"{path.name} must hold messages with numbers and stamps; it holds none. Copy it again.")

        def clock(name: str) -> NDArray[np.float64]:
            rows = tables[places[name][0]][1]
            stamp = _clock_of(rows)
            assert stamp is not None
            return rows[stamp].astype(np.float64) * _CLOCKS[stamp]

        return Contents(
            Lazy(places, lambda name: scales[name] * tables[places[name][0]][1][places[name][1]].astype(np.float64)),
            stated,
            clocks=Lazy(places, clock),
            notes=tuple(notes),
            aliases=aliases,
        )


def _walked(data: bytes) -> tuple[dict[int, _Type], list[str]]:
    """The types of a log with the places of their messages, and what is amiss in the chain of these."""
    types = {_FMT: _Type("FMT", "BBnNZ", ["Type", "Length", "Name", "Format", "Columns"], _FMT_SIZE)}
    place, end, lost, first = 0, len(data), 0, 0
    while place + _HEAD <= end:
        found = types.get(data[place + 2]) if data.startswith(_MARK, place) else None
        if found is None:
            after = data.find(_MARK, place + 1)
            after = end if after < 0 else after
            lost, first, place = lost + after - place, first or place, after
            continue
        if place + found.size > end:
            break
        found.places.append(place + _HEAD)
        if found.name == "FMT" and (described := _type(data[place + _HEAD : place + _FMT_SIZE])) is not None:
            number, kind = described
            if number not in types:
                types[number] = kind
        place += found.size
    notes = []
    if lost:
        notes.append(
            f"{lost} bytes, the first at byte {first}, belong to no message and are passed over: samples may miss."
        )
    if place < end:
        notes.append(f"The log ends within a message, {end - place} bytes before its end: it was cut short.")
    return types, notes


def _type(body: bytes) -> tuple[int, _Type] | None:
    """The number and the layout of a type that a message FMT describes; None if its fields do not fit its length."""
    name, letters, columns = (
        body[first:last].split(b"\0")[0].decode("latin-1") for first, last in ((2, 6), (6, 22), (22, 86))
    )
    fields = [each.strip() for each in columns.split(",") if each.strip()]
    if len(fields) != len(letters) or len(set(fields)) < len(fields) or not set(letters) <= set(_LETTERS) or not fields:
        return None
    kind = _Type(name, letters, fields, body[1])
    return (body[0], kind) if kind.row.itemsize + _HEAD == kind.size else None


def _rows(data: bytes, kind: _Type) -> np.ndarray:
    """All messages of a type, as an array with its fields."""
    if not kind.places:
        return np.empty(0, dtype=kind.row)
    content = np.frombuffer(data, dtype=np.uint8)
    starts = np.array(kind.places)[:, None] + np.arange(kind.row.itemsize)
    return content[starts].view(kind.row)[:, 0]


def _described(data: bytes, types: Mapping[int, _Type]) -> tuple[dict[str, str], dict[str, float]]:
    """Units and multipliers by the letters that stand for them, and these letters put into the types."""
    by_name = {kind.name: kind for kind in types.values()}
    units, multipliers = dict[str, str](), dict[str, float]()
    if {"UNIT", "MULT", "FMTU"} <= set(by_name):
        for row in _rows(data, by_name["UNIT"]):
            label = str(row["Label"].decode("latin-1"))
            units[chr(row["Id"])] = _SPELT.get(label, label)
        for row in _rows(data, by_name["MULT"]):
            multipliers[chr(row["Id"])] = float(row["Mult"])
        for row in _rows(data, by_name["FMTU"]):
            if (kind := types.get(int(row["FmtType"]))) is not None:
                kind.units, kind.multipliers = (row[key].decode("latin-1") for key in ("UnitIds", "MultIds"))
    return units, multipliers


def _tables(data: bytes, types: Mapping[int, _Type]) -> Iterator[tuple[str, tuple[_Type, np.ndarray]]]:
    """Messages by type, those of several sensors apart."""
    for kind in types.values():
        rows = _rows(data, kind)
        place = kind.units.find("#")
        numbers = np.unique(rows[kind.fields[place]]) if 0 <= place < len(kind.fields) and rows.size else np.empty(0)
        if numbers.size < 2:
            yield kind.name, (kind, rows)
        else:
            yield from ((f"{kind.name}[{n}]", (kind, rows[rows[kind.fields[place]] == n])) for n in numbers)


def _clock_of(rows: np.ndarray) -> str | None:
    """The field of the instants: that of the sensor, unless it is empty."""
    names = rows.dtype.names or ()
    return next((name for name in _CLOCKS if name in names and (name != "SampleUS" or np.all(rows[name] > 0))), None)
