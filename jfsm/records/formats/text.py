"""Columns of numbers in a text file, with whatever stands above them."""

import csv
import itertools
import json
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import ClassVar

import numpy as np

from jfsm.records._units import is_unit
from jfsm.records.formats.base import AbstractFormat, Contents, Lazy, unique_names

MARK = "# jfsm record "  # opens the line on which a written record keeps what is no column
COMMENTS = ("#", "%", "//")
DELIMITERS = (";", "\t", ",", None)  # None: any run of blanks. A semicolon first, for it goes with decimal commas
BLOCK = 20_000  # rows that are text at one time
_BRACKETED = re.compile(r"^(?P<name>.*?)\s*[\[(](?P<unit>[^\])]*)[\])]$")

Line = tuple[int, str]  # number in the file, from 1, and text


class TextFormat(AbstractFormat):
    """CSV, tab- or blank-separated columns; delimiter, decimal comma, header and row of units are found."""

    suffixes: ClassVar[tuple[str, ...]] = (".csv", ".txt", ".dat", ".tsv")

    def load(self, path: Path) -> Contents:
        encoding, count = _encoding_and_rows(path)
        middle = next((line for _, line in itertools.islice(_rows(path, encoding), count // 2, None)), "")
        delimiter, pattern = _layout(path, middle)
        head = _head(_rows(path, encoding), delimiter, pattern)
        table = _Table(path, delimiter, (count - len(head), len(pattern)))
        rows = itertools.islice(_rows(path, encoding), len(head), None)
        while block := list(itertools.islice(rows, BLOCK)):
            table.append(block)
        about, comments = _remarks(_lines(path, encoding), len(head))
        width = table.width
        above = [fields[:width] for fields in head if len(fields) >= width and not any(fields[width:])]
        if not above:  # the names may be hidden in comments
            hidden = [_fields(comment, delimiter) for comment in comments]
            above = [fields for fields in hidden if len(fields) == width] or [[""] * width]
        labels, units = _names_and_units(above)
        names = unique_names(labels)
        stated = {name: unit for name, unit in zip(names, units, strict=True) if unit}

        def texts(name: str) -> np.ndarray:
            data = itertools.islice(_rows(path, encoding), len(head), None)
            return np.array([_fields(line, delimiter)[names.index(name)] for _, line in data])

        numbers = Lazy(names, lambda name: table.column(names.index(name), name))
        return Contents(numbers, stated, about, texts=Lazy(names, texts))

    def save(self, path: Path, contents: Contents) -> None:
        columns = [np.asarray(array, dtype=np.float64) for array in contents.arrays.values()]
        with path.open("w", encoding="utf-8", newline="") as stream:
            stream.write(MARK + json.dumps(dict(contents.about)) + "\n")
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(contents.arrays)
            writer.writerow(f"[{contents.units.get(name, '1')}]" for name in contents.arrays)
            for begin in range(0, columns[0].size, BLOCK):
                block = np.stack([column[begin : begin + BLOCK] for column in columns], axis=1)
                writer.writerows(map(repr, row) for row in block.tolist())


class _Table:
    """The rows of data as columns of doubles, filled block by block so that only one block is text at a time."""

    def __init__(self, path: Path, delimiter: str | None, shape: tuple[int, int]):
        self._path, self._delimiter, self._width = path, delimiter, shape[1]
        self._values = np.empty(shape)
        self._filled = 0  # rows so far
        self._text: dict[int, tuple[int, str]] = {}  # column -> line and field that is no number
        self._last_is_empty = True  # as when every row ends in a delimiter

    @property
    def width(self) -> int:
        """Number of columns."""
        return self._width - int(self._last_is_empty)

    def append(self, block: list[Line]) -> None:
        """Take up further rows.

        Raises
        ------
        ValueError
            If a row has more or fewer fields than the others.
        """
        lines = [line for _, line in block]
        if self._delimiter != ",":
            lines = [line.replace(",", ".") for line in lines]
        try:
            values = np.loadtxt(lines, delimiter=self._delimiter, comments=None, quotechar='"', ndmin=2)
        except ValueError:  # gaps, text or a wrong number of fields: looked at one by one
            values = self._by_field(block)
        else:
            self._last_is_empty = False
            if values.shape[1] != self._width:
                values = self._by_field(block)
        self._values[self._filled : self._filled + len(block)] = values
        self._filled += len(block)

    def column(self, place: int, name: str) -> np.ndarray:
        """(rows,) numbers of one column.

        Raises
        ------
        ValueError
            If one of its fields is no number.
        """
        if place in self._text:
            number, found = self._text[place]
            raise ValueError(
                f"{self._path.name} must hold numbers in column {name!r}; line {number} holds {found!r}. "
                f"Repair or remove that line, or read another column."
            )
        return self._values[:, place]

    def _by_field(self, block: list[Line]) -> np.ndarray:
        values = np.full((len(block), self._width), np.nan)
        for row, (number, line) in enumerate(block):
            fields = _fields(line, self._delimiter)
            if len(fields) != self._width:
                raise ValueError(
                    f"{self._path.name} must have {self._width} columns in every row of data; line {number} has "
                    f"{len(fields)}. Repair or remove that line."
                )
            self._last_is_empty = self._last_is_empty and not fields[-1]
            for place, text in enumerate(fields):
                try:
                    values[row, place] = _number(text)
                except ValueError:
                    self._text.setdefault(place, (number, text))
        return values


def _encoding_and_rows(path: Path) -> tuple[str, int]:
    """How the text is encoded, and the number of its lines that are neither blank nor comment."""
    with path.open("rb") as stream:
        begins_with = stream.read(2)
    likely = "utf-16" if begins_with in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    try:
        return likely, sum(1 for _ in _rows(path, likely))
    except UnicodeError:
        return "latin-1", sum(1 for _ in _rows(path, "latin-1"))  # degrees and squares as older recorders write them


def _lines(path: Path, encoding: str) -> Iterator[Line]:
    with path.open(encoding=encoding) as stream:
        for number, line in enumerate(stream, start=1):
            yield number, line.rstrip("\n")


def _rows(path: Path, encoding: str) -> Iterator[Line]:
    """Lines that are neither blank nor comment."""
    for number, line in _lines(path, encoding):
        stripped = line.lstrip()
        if stripped and not stripped.startswith(COMMENTS):
            yield number, line


def _remarks(lines: Iterator[Line], head: int) -> tuple[dict, list[str]]:
    """What `save` noted, and the comments above the data (which follow `head` rows), their marks taken off."""
    about, comments, rows = {}, [], 0
    for _, line in lines:
        if line.startswith(MARK):
            about = json.loads(line.removeprefix(MARK))
        elif line.strip().startswith(COMMENTS):
            comments.append(line.strip().lstrip("#%/ "))
        elif line.strip():
            rows += 1
            if rows > head:
                break
    return about, comments


def _head(rows: Iterator[Line], delimiter: str | None, pattern: tuple[bool, ...]) -> list[list[str]]:
    """The rows above the data, which begin with the first row that has numbers wherever `pattern` has."""
    head: list[list[str]] = []
    for _, line in rows:
        fields = _fields(line, delimiter)
        found = _pattern(fields)
        numbers = [field for field, is_number in zip(fields, pattern, strict=False) if is_number]
        if len(fields) == len(pattern) and all(here or not there for here, there in zip(found, pattern, strict=True)):
            if any(numbers):  # a row of gaps belongs to the head
                break
        head.append(fields)
    return head


def _fields(line: str, delimiter: str | None) -> list[str]:
    if delimiter is None:
        return line.split()
    try:
        return [field.strip() for field in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))]
    except csv.Error:  # bytes that are no text
        return [line]


def _number(field: str) -> float:
    """The number a field stands for, NaN when it is empty; ValueError when it is text."""
    return float(field.replace(",", ".")) if field else float("nan")


def _pattern(fields: Sequence[str]) -> tuple[bool, ...]:
    """Which fields are numbers."""

    def numeric(field: str) -> bool:
        try:
            _number(field)
        except ValueError:
            return False
        return True

    return tuple(map(numeric, fields))


def _layout(path: Path, line: str) -> tuple[str | None, tuple[bool, ...]]:
    """Delimiter of a row of data, and which of its fields are numbers: several numbers if it can be read so."""
    readings = [(delimiter, _pattern(_fields(line, delimiter))) for delimiter in DELIMITERS]
    for delimiter, pattern in readings:
        if len(pattern) > 1 and all(pattern):
            return delimiter, pattern
    for delimiter, pattern in readings:
        if any(pattern) and (len(pattern) > 1 or delimiter is None):
            return delimiter, pattern
    raise ValueError(f"{path.name} must hold columns of numbers; its middle line is {line[:60]!r}. Export numbers.")


def _names_and_units(above: list[list[str]]) -> tuple[list[str], list[str]]:
    """Names and units of the columns from the rows above them: ``x``, ``x [mm]``, or a row of units below the names."""
    names, units = list(above[-1]), [""] * len(above[-1])
    if len(above) > 1 and _are_units(above[-1]):
        names, units = list(above[-2]), [field.strip("[]() ") for field in above[-1]]
    for place, name in enumerate(names):
        match = _BRACKETED.match(name)
        if match and match["name"]:
            names[place], units[place] = match["name"], units[place] or match["unit"].strip()
    return names, units


def _are_units(fields: list[str]) -> bool:
    """Whether a row reads like units: all in brackets, or most of them known."""
    stated = [field for field in fields if field]
    if all(field[0] in "[(" and field[-1] in "])" for field in stated):
        return bool(stated)
    return 2 * sum(is_unit(field) for field in stated) > len(stated)
