"""LabVIEW measurement files (.lvm), after National Instruments' specification of the text format, version 2."""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import ClassVar

import numpy as np

from jfsm.records.formats.base import AbstractFormat, Contents, Lazy, unique_names
from jfsm.records.formats.numbers import Mark, number
from jfsm.records.formats.text.lines import TextFile

MARK = "LabVIEW Measurement"
END = "***End_of_Header***"
_SEPARATORS = {"tab": "\t", "comma": ",", "semicolon": ";", "space": " "}


class LvmFormat(AbstractFormat):
    """Channels by name, with the unit and the start and step of the clock that each segment states. Read only.

    A segment is a run. Absolute dates stand in a note; the clock is that of `X0` and `Delta_X`, or of the X columns.
    """

    name: ClassVar[str] = "LabVIEW measurement (lvm)"
    suffixes: ClassVar[tuple[str, ...]] = (".lvm",)

    def recognises(self, begins_with: bytes, path: Path) -> bool:
        return MARK.encode() in begins_with[:64] or MARK.encode("utf-16-le") in begins_with[:64]

    def load(self, path: Path) -> Contents:
        lines = [line for _, line in TextFile(path).lines()]
        separator = _separator(lines, path)
        rows = [[field.strip() for field in line.split(separator)] for line in lines]
        top = next((place for place, row in enumerate(rows) if row[0] == END), None)
        if top is None:
            raise ValueError(f"{path.name} must be a LabVIEW measurement file; its header has no end. Write it again.")
        head = {row[0]: row[1] for row in rows[1:top] if len(row) > 1 and row[0]}
        mark: Mark = "," if head.get("Decimal_Separator", ".") == "," else "."
        segments = [_Segment(part, first, head, mark, path) for first, part in _segments(rows[top + 1 :], top + 2)]
        if not segments:
            raise ValueError(f"{path.name} must hold a segment of samples; it holds none. Write or copy it again.")
        begun = " ".join(head[key] for key in ("Date", "Time") if head.get(key))
        note = [f"Measured from {begun} on, by the head of the file."] if begun else []
        runs = [segment.contents(note) for segment in segments]
        return runs[0] if len(runs) == 1 else Contents({}, runs=tuple(runs))


class _Segment:
    """One segment: its header, the row of names, and the rows of samples."""

    def __init__(self, rows: list[list[str]], first: int, head: dict[str, str], mark: Mark, path: Path):
        self._path = path
        self._mark: Mark = mark
        end = next((place for place, row in enumerate(rows) if row[0] == END), -1)
        self._head = {row[0]: row[1:] for row in rows[: end + 1] if row[0]}
        self._places = {place: row for place, row in enumerate(rows[end + 1 :]) if any(row)}
        self._names_row = next(iter(self._places.values()), [])
        self._data = list(self._places.items())[1:]
        self._offset = first + end + 1
        self._columns = self._head.get("X_Columns", [head.get("X_Columns", "One")])[0].lower()

    def contents(self, notes: Sequence[str]) -> Contents:
        names_row = self._names_row
        comment = [place for place, name in enumerate(names_row) if name == "Comment"]
        clocks_at = [place for place, name in enumerate(names_row) if name.startswith("X_Value")]
        at = [place for place, name in enumerate(names_row) if name and place not in (*comment, *clocks_at)]
        names = unique_names(names_row[place] for place in at)
        where = dict(zip(names, at, strict=True))
        order = {name: place for place, name in enumerate(names)}
        said = [*notes]
        remarks = [row[comment[0]] for _, row in self._data if comment and len(row) > comment[0] and row[comment[0]]]
        if remarks:
            said.append(f"{len(remarks)} comments stand beside the samples: {', '.join(map(repr, remarks[:3]))}.")
        if self._head.get("Notes") and any(self._head["Notes"]):
            said.append(f"The file notes: {' '.join(self._head['Notes']).strip()!r}.")
        announced = self._numbers("Samples")
        for name, place in order.items():
            found = sum(1 for _, row in self._data if len(row) > where[name] and row[where[name]])
            if place < len(announced) and announced[place] != found:
                said.append(f"{name!r} announces {announced[place]:.0f} samples; {found} stand in the file.")

        def samples(name: str) -> np.ndarray:
            return np.array(
                [self._number(place, row, where[name]) for place, row in self._data if self._has(row, where[name])]
            )

        def clock(name: str) -> np.ndarray:
            place, size = order[name], len([1 for _, row in self._data if self._has(row, where[name])])
            starts, steps = self._numbers("X0"), self._numbers("Delta_X")
            before = [x for x in clocks_at if x < where[name]]
            if self._columns != "no" and before:
                return np.array(
                    [self._number(at, row, before[-1]) for at, row in self._data if self._has(row, where[name])]
                )
            if place >= len(steps):
                raise ValueError(
                    f"{self._path.name} must state Delta_X for {name!r}; it states {len(steps)} of them. "
                    f"Pass rate=... [Hz]."
                )
            return (starts[place] if place < len(starts) else 0.0) + steps[place] * np.arange(size)

        units = self._head.get("Y_Unit_Label", [])
        return Contents(
            Lazy(names, samples),
            {name: units[place] for name, place in order.items() if place < len(units) and units[place]},
            clocks=Lazy(names, clock),
            notes=tuple(said),
            title=f"{len(self._data)} rows from line {self._offset + (self._data[0][0] if self._data else 0)} on",
        )

    def _has(self, row: list[str], column: int) -> bool:
        return column < len(row) and bool(row[column])

    def _numbers(self, key: str) -> list[float]:
        values: list[float] = []
        for text in self._head.get(key, []):
            try:
                values.append(number(text, self._mark))
            except ValueError:
                break
        return values[: len([text for text in self._head.get(key, []) if text])]

    def _number(self, place: int, row: list[str], column: int) -> float:
        try:
            return number(row[column], self._mark)
        except ValueError as error:
            raise ValueError(
                f"{self._path.name} must hold numbers in its columns of samples; line {self._offset + place} holds "
                f"{row[column]!r}. Repair or remove that line."
            ) from error


def _separator(lines: Sequence[str], path: Path) -> str:
    """What the head says stands between fields; it is written with that itself."""
    for line in lines[:40]:
        if line.startswith("Separator"):
            said = line[len("Separator") :].strip(" \t,;").lower()
            if said in _SEPARATORS:
                return _SEPARATORS[said]
            return line[len("Separator")]
    raise ValueError(f"{path.name} must state its Separator, as LabVIEW measurement files do. Write it again.")


def _segments(rows: list[list[str]], first: int) -> Iterator[tuple[int, list[list[str]]]]:
    """Segments with the number of their first line: each begins with a header of its own."""
    starts = [place for place, row in enumerate(rows) if row[0] == "Channels"]
    for start, end in pairwise([*starts, len(rows)]):
        yield first + start, rows[start:end]
