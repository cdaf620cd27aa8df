"""Columns of numbers in a text file, with whatever stands above them."""

import csv
import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar

import numpy as np

from jfsm.records._units import is_unit
from jfsm.records.formats.base import AbstractFormat, Contents, column_names

MARK = "# jfsm record "  # opens the line on which a written record keeps what is no column
COMMENTS = ("#", "%", "//")
DELIMITERS = (";", "\t", ",", None)  # None: any run of blanks. A semicolon first, for it goes with decimal commas
_BRACKETED = re.compile(r"^(?P<name>.*?)\s*[\[(](?P<unit>[^\])]*)[\])]$")

Row = tuple[int, list[str]]  # line number, fields


class TextFormat(AbstractFormat):
    """CSV, tab- or blank-separated columns; delimiter, decimal comma, header and row of units are found."""

    suffixes: ClassVar[tuple[str, ...]] = (".csv", ".txt", ".dat", ".tsv")

    def load(self, path: Path) -> Contents:
        text = _decoded(path.read_bytes())
        about = {}
        comments: list[str] = []
        lines: list[tuple[int, str]] = []
        for number, line in enumerate(text.splitlines(), start=1):
            if line.startswith(MARK):
                about = json.loads(line.removeprefix(MARK))
            elif line.strip().startswith(COMMENTS):
                comments.append(line.strip().lstrip("#%/ "))
            elif line.strip():
                lines.append((number, line))
        head, body, delimiter = _split(path, lines)
        width = len(body[0][1])
        above = [fields[:width] for _, fields in head if len(fields) >= width and not any(fields[width:])]
        if not above:  # the names may be hidden in a comment
            hidden = (_fields(comment, delimiter) for comment in reversed(comments))
            above = [next((fields for fields in hidden if len(fields) == width), [""] * width)]
        names, units = _names_and_units(above)
        columns = [_numbers(column) for column in zip(*(fields for _, fields in body), strict=True)]
        arrays = column_names(names, columns)
        stated = {name: unit for name, unit in zip(arrays, units, strict=True) if unit}
        return Contents(arrays, stated, about)

    def save(self, path: Path, contents: Contents) -> None:
        columns = [np.asarray(array, dtype=np.float64) for array in contents.arrays.values()]
        with path.open("w", encoding="utf-8", newline="") as stream:
            stream.write(MARK + json.dumps(dict(contents.about)) + "\n")
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(contents.arrays)
            writer.writerow(f"[{contents.units.get(name, '1')}]" for name in contents.arrays)
            writer.writerows(map(repr, row) for row in np.stack(columns, axis=1).tolist())


def _decoded(raw: bytes) -> str:
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("latin-1")  # degrees and squares as older recorders write them


def _fields(line: str, delimiter: str | None) -> list[str]:
    if delimiter is None:
        return line.split()
    return [field.strip() for field in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))]


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


def _split(path: Path, lines: list[tuple[int, str]]) -> tuple[list[Row], list[Row], str | None]:
    """The rows above the data, the data and the delimiter.

    Data begin with the first row whose fields are numbers and text as in the middle of the file.
    """
    middle = lines[len(lines) // 2][1] if lines else ""
    delimiter, pattern = _layout(path, middle)
    rows = [(number, _fields(line, delimiter)) for number, line in lines]
    first = next(place for place, (_, fields) in enumerate(rows) if _pattern(fields) == pattern)
    head, body = rows[:first], rows[first:]
    for number, fields in body:
        if len(fields) != len(pattern):
            raise ValueError(
                f"{path.name} must have {len(pattern)} columns in every row of data; line {number} has {len(fields)}. "
                f"Repair or remove that line."
            )
    if all(not fields[-1] for _, fields in body):  # every row ends in a delimiter
        body = [(number, fields[:-1]) for number, fields in body]
    return head, body, delimiter


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


def _numbers(column: tuple[str, ...]) -> np.ndarray:
    """The column as doubles, or as text if any field is not a number."""
    try:
        return np.array([_number(field) for field in column])
    except ValueError:
        return np.array(column)


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
