"""LabVIEW measurement files (.lvm), after National Instruments' specification of the text format, version 2."""

from collections.abc import Iterator, Mapping, Sequence
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
        segments = [_Segment(part, first, head, path) for first, part in _segments(rows[top + 1 :], top + 2)]
        if not segments:
            raise ValueError(f"{path.name} must hold a segment of samples; it holds none. Write or copy it again.")
        runs = [segment.contents(_of_the_date(head)) for segment in segments]
        return runs[0] if len(runs) == 1 else Contents({}, runs=tuple(runs))


def _of_the_date(head: Mapping[str, str]) -> list[str]:
    begun = " ".join(head[key] for key in ("Date", "Time") if head.get(key))
    return [f"Measured from {begun} on, by the head of the file."] if begun else []


class _Segment:
    """One segment: its header, the row of names, and the rows of samples."""

    def __init__(self, rows: list[list[str]], first: int, head: Mapping[str, str], path: Path):
        self._path = path
        self._mark: Mark = "," if head.get("Decimal_Separator", ".") == "," else "."
        end = next((place for place, row in enumerate(rows) if row[0] == END), -1)
        self._head = {row[0]: row[1:] for row in rows[: end + 1] if row[0]}
        table = [(place, row) for place, row in enumerate(rows[end + 1 :]) if any(row)]
        names, self._data = (table[0][1], table[1:]) if table else ([], [])
        self._offset = first + end + 1
        self._columns = self._head.get("X_Columns", [head.get("X_Columns", "One")])[0].lower()
        self._comment = names.index("Comment") if "Comment" in names else None
        self._clocks = [place for place, name in enumerate(names) if name.startswith("X_Value")]
        at = [place for place, name in enumerate(names) if name and place not in (self._comment, *self._clocks)]
        self._where = dict(zip(unique_names(names[place] for place in at), at, strict=True))
        self._order = {name: place for place, name in enumerate(self._where)}

    def contents(self, notes: Sequence[str]) -> Contents:
        """Channels with their clocks, after these notes of the file."""
        units = self._head.get("Y_Unit_Label", [])
        return Contents(
            Lazy(self._where, lambda name: self._column(name, self._where[name])),
            {name: units[place] for name, place in self._order.items() if place < len(units) and units[place]},
            clocks=Lazy(self._where, self._clock),
            notes=(*notes, *self._said()),
            title=f"{len(self._data)} rows from line {self._offset + (self._data[0][0] if self._data else 0)} on",
        )

    def _said(self) -> Iterator[str]:
        """Comments, notes, and numbers of samples that are not those announced."""
        remarks = [] if self._comment is None else [row[self._comment] for _, row in self._rows(self._comment)]
        if remarks:
            yield f"{len(remarks)} comments stand beside the samples: {', '.join(map(repr, remarks[:3]))}."
        if any(self._head.get("Notes", ())):
            yield f"The file notes: {' '.join(self._head['Notes']).strip()!r}."
        for (name, at), announced in zip(self._where.items(), self._numbers("Samples"), strict=False):
            if announced != (found := len(self._rows(at))):
                yield f"{name!r} announces {announced:.0f} samples; {found} stand in the file."

    def _clock(self, name: str) -> np.ndarray:
        """Instants of a channel: the X column ahead of it, else its start and step."""
        before = [place for place in self._clocks if place < self._where[name]]
        if self._columns != "no" and before:
            return self._column(name, before[-1])
        place, starts, steps = self._order[name], self._numbers("X0"), self._numbers("Delta_X")
        if place >= len(steps):
            raise ValueError(
                f"{self._path.name} must state Delta_X for {name!r}; it states {len(steps)} of them. "
                f"Pass rate=... [Hz]."
            )
        start = starts[place] if place < len(starts) else 0.0
        return start + steps[place] * np.arange(len(self._rows(self._where[name])))

    def _column(self, name: str, at: int) -> np.ndarray:
        """Numbers of a column in the rows in which a channel has samples."""
        return np.array([self._number(place, row, at) for place, row in self._rows(self._where[name])])

    def _rows(self, column: int) -> list[tuple[int, list[str]]]:
        """Rows in which a column holds something, with their places."""
        return [(place, row) for place, row in self._data if column < len(row) and row[column]]

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
