"""The rows of a text as columns of doubles, and what stands between them."""

import re
from dataclasses import dataclass, field

import numpy as np

from jfsm.records.formats.numbers import is_gap, is_number, is_summary
from jfsm.records.formats.text.layout import Layout, fields_of, is_comment, values_of
from jfsm.records.formats.text.lines import Line, TextFile

_DOUBTFUL = {mark: re.compile(rf"[-+]?\d{{1,3}}[{mark}]\d{{3}}") for mark in ".,"}
"""A number with the mark that stands between thousands elsewhere in the file, and nothing that tells whether here."""


@dataclass
class Segment:
    """Rows of data that follow one another, and the lines above them.

    Attributes
    ----------
    above : list of Line
        What stands above, without blank lines.
    opening : Line
        The first row.
    last : int
        The line of the last row.
    start, count : int
        Where they lie in the table, and how many they are.
    skipped : set of int
        Lines in between that are no rows.
    text : dict of int to Line
        Of columns of numbers the first field that is none.
    comments, extra : list of Line
        Remarks between rows; rows with one field too many.
    doubtful : dict of int to (line, field, number)
        Of columns of numbers the first field whose mark may be that of a fraction or stand between thousands.
    grouped : set of int
        Columns with fields of both marks, which show that theirs stand between thousands.
    below : list of Line
        What follows the last row of the file.
    """

    above: list[Line]
    opening: Line
    start: int
    last: int = 0
    count: int = 0
    skipped: set[int] = field(default_factory=set)
    text: dict[int, Line] = field(default_factory=dict)
    comments: list[Line] = field(default_factory=list)
    extra: list[Line] = field(default_factory=list)
    doubtful: dict[int, tuple[int, str, float]] = field(default_factory=dict)
    grouped: set[int] = field(default_factory=set)
    below: list[Line] = field(default_factory=list)

    @property
    def first(self) -> int:
        """The line of the first row."""
        return self.opening[0]


class Table:
    """All rows of a text file, read block by block so that only one block is text at a time."""

    def __init__(self, file: TextFile, layout: Layout):
        self._file, self._layout = file, layout
        self._numeric = [place for place, used in enumerate(layout.numeric) if used]
        self.values = np.empty((layout.lines, layout.width), order="C")
        self.segments: list[Segment] = []
        self._mixed = layout.delimiter != "," and not layout.plain
        comma = any(mark == "," for mark, used in zip(layout.marks, layout.numeric, strict=True) if used)
        self._thousands = ["." if comma else "," for _ in layout.marks]
        self._rows = 0
        self._waiting: list[Line] = []  # lines since the last row
        self._broken: Line | None = None  # a row with a wrong number of fields, which may be the last
        for first, block in file.blocks():
            place = 0
            while place < len(block):
                if self._inside and self._take_all(first + place, block[place:]):
                    break
                stop = len(block) if self._inside else place + 1
                for number, line in enumerate(block[place:stop], start=first + place):
                    self._take(number, line)
                place = stop
        if self.segments:
            self.segments[-1].below = self._waiting + ([self._broken] if self._broken else [])
        self.values = self.values[: self._rows]

    @property
    def _inside(self) -> bool:
        return bool(self.segments) and not self._waiting and self._broken is None

    def column(self, segment: Segment, place: int) -> np.ndarray:
        """(rows,) numbers."""
        return self.values[segment.start : segment.start + segment.count, place]

    def texts(self, segment: Segment, place: int) -> np.ndarray:
        """(rows,) fields as written."""
        found: list[str] = []
        for number, line in self._file.lines():
            if segment.first <= number <= segment.last and number not in segment.skipped and line.strip():
                fields = fields_of(line, self._layout.delimiter)
                found.append(fields[place] if place < len(fields) else "")
        return np.array(found)

    def _take_all(self, first: int, lines: list[str]) -> bool:
        """Take up lines at once; False if one of them is no plain row."""
        layout = self._layout
        if not layout.plain:
            return False
        mark = next((mark for mark, used in zip(layout.marks, layout.numeric, strict=True) if used), ".")
        given = [line.replace(",", ".") for line in lines] if mark == "," else lines
        some = None if all(layout.numeric) else self._numeric
        if some and not self._have_width(lines):
            return False
        try:
            values = np.loadtxt(given, delimiter=layout.delimiter, comments=None, quotechar='"', ndmin=2, usecols=some)
        except ValueError:  # gaps, text or a wrong number of fields: looked at one by one
            return False
        if not values.size or values.shape[1] != len(self._numeric):
            return False
        rows = slice(self._rows, self._rows + values.shape[0])
        if some:
            self.values[rows] = np.nan
            self.values[rows, some] = values
        else:
            self.values[rows] = values
        self._grow(first + len(lines) - 1, values.shape[0])
        return True

    def _have_width(self, lines: list[str]) -> bool:
        delimiter, width = self._layout.delimiter, self._layout.width
        if delimiter is None:
            return all(len(line.split()) in (0, width) for line in lines)
        return all(line.count(delimiter) == width - 1 or not line.strip() for line in lines)

    def _take(self, number: int, line: str) -> None:
        """Take up one line.

        Raises
        ------
        ValueError
            If a row with a wrong number of fields is followed by another one.
        """
        if not line.strip():
            return
        if is_comment(line):
            if self._inside:
                self.segments[-1].comments.append((number, line))
                self.segments[-1].skipped.add(number)
            else:
                self._waiting.append((number, line))
            return
        fields = fields_of(line, self._layout.delimiter)
        begins = not self.segments or any(not is_comment(text) for _, text in self._waiting)
        if not self._is_row(fields, begins):
            if not begins and self._broken is None and self._is_broken(fields):
                self._broken = number, line
            else:
                self._waiting.append((number, line))
            return
        if self._broken is not None:
            if not self._waiting:
                raise self._wrong_width(*self._broken)
            self._waiting.insert(0, self._broken)
            self._broken, begins = None, True
        if begins:
            self.segments.append(Segment(self._waiting, (number, line), self._rows))
        else:
            self.segments[-1].comments += self._waiting
            self.segments[-1].skipped |= {at for at, _ in self._waiting}
        self._waiting = []
        segment, width = self.segments[-1], self._layout.width
        if any(fields[width:]):
            segment.extra.append((number, line))
        row = np.full(width, np.nan)
        for place, value in enumerate(values_of(fields[:width], self._layout)):
            if value is not None:
                row[place] = value
                if "." in fields[place] and "," in fields[place]:
                    segment.grouped.add(place)
                elif self._mixed and _DOUBTFUL[self._thousands[place]].fullmatch(fields[place]):
                    segment.doubtful.setdefault(place, (number, fields[place], value))
            elif self._layout.numeric[place]:
                segment.text.setdefault(place, (number, fields[place]))
        self.values[self._rows] = row
        self._grow(number, 1)

    def _grow(self, last: int, rows: int) -> None:
        self._rows += rows
        self.segments[-1].count += rows
        self.segments[-1].last = last

    def _is_row(self, fields: list[str], begins: bool) -> bool:
        """Whether fields are a row of data; the first row of a segment has numbers wherever others have."""
        numeric, width = self._layout.numeric, self._layout.width
        if len(fields) > width and any(is_number(text) for text in fields[width:]):
            return False
        if len(fields) < width and any(numeric[len(fields) :]):
            return False
        said = [fields[place] for place in self._numeric]
        numbers = [is_number(text) for text in said]
        text = [not here and not is_gap(field) for here, field in zip(numbers, said, strict=True)]
        if not any(numbers):
            return False
        return not any(text) if begins else not text[0]

    def _is_broken(self, fields: list[str]) -> bool:
        """Whether fields are rather a damaged row than a title or a summary."""
        numbers = sum(map(is_number, fields))
        if is_summary(fields[0]):
            return False
        if len(fields) == self._layout.width:
            return bool(numbers) and not fields[0][:1].isalpha()
        return 2 * numbers > len([text for text in fields if text]) and not fields[0][:1].isalpha()

    def _wrong_width(self, number: int, line: str) -> ValueError:
        fields, width = fields_of(line, self._layout.delimiter), self._layout.width
        if len(fields) == width:
            return ValueError(
                f"{self._file.path.name} must hold numbers in its rows of data; line {number} is "
                f"{line.strip()[:60]!r}. Repair or remove that line."
            )
        return ValueError(
            f"{self._file.path.name} must have {width} columns in every row of data; line {number} has {len(fields)}. "
            f"Repair or remove that line."
        )
