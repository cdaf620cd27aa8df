"""How the rows of a table of text are divided: told by a vote of rows from all over the file."""

import csv
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from jfsm.records.formats.numbers import Mark, decimal_mark, is_gap, is_number, number
from jfsm.records.formats.text.lines import TextFile

COMMENTS = ("#", "%", "//", "!")
DELIMITERS = (";", "\t", ",", "|", None)  # None: any run of blanks. A semicolon first, for it goes with decimal commas
_RULED = re.compile(r"[\s|+:]*[-=_]{3,}[-=_\s|+:]*")
FIRST, PER_BLOCK, MOST = 1500, 40, 6000  # lines that vote: of the beginning, of every block, and at most
MOSTLY = 0.6  # share of the fields of a column that makes it numeric


class Layout(NamedTuple):
    """How the rows are divided.

    Attributes
    ----------
    delimiter : str or None
        None for any run of blanks.
    numeric : tuple of bool
        Which of a row's fields are numbers.
    marks : tuple of "." or ","
        The decimal mark of each column.
    plain : bool
        Whether the library's fast reader may read it, once decimal commas are replaced.
    lines : int
        Number of lines of the file.
    integers : bool
        Whether no field has a fraction.
    """

    delimiter: str | None
    numeric: tuple[bool, ...]
    marks: tuple[Mark, ...]
    plain: bool
    lines: int
    integers: bool

    @property
    def width(self) -> int:
        """Number of fields of a row."""
        return len(self.numeric)


def fields_of(line: str, delimiter: str | None) -> list[str]:
    """The fields of a line, blanks and quotes around them taken off."""
    if delimiter is None:
        return line.split()
    if '"' not in line:
        return [field.strip() for field in line.split(delimiter)]
    try:
        return [field.strip() for field in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))]
    except (csv.Error, StopIteration):
        return [line]


def is_comment(line: str) -> bool:
    """Whether a line is a remark, or a ruled line as under the heads of printed tables."""
    return line.lstrip().startswith(COMMENTS) or _RULED.fullmatch(line) is not None


def layout_of(file: TextFile) -> Layout:
    """The layout that most rows have.

    Raises
    ------
    ValueError
        If no line looks like a row of numbers.
    """
    seen = _seen(file)
    delimiter, rows = _vote(seen.sample, file.path)
    numeric = _numeric(rows)
    mixed = seen.has_quote if delimiter == "," else seen.has_comma and seen.has_point
    if mixed or seen.has_quote:
        marks = _marks_by_column(file, delimiter, len(numeric))
    else:
        marks = (_mark_by_default(seen, delimiter),) * len(numeric)
    integers = not any(mark in field for row in rows for field in row for mark in ".,")
    one_mark = len({mark for mark, used in zip(marks, numeric, strict=True) if used}) < 2
    return Layout(delimiter, numeric, marks, one_mark and not mixed, seen.lines, integers)


class _Seen(NamedTuple):
    """Lines from all over a file, remarks and blank ones left out, how many it has, and what stands in any of them."""

    sample: list[str]
    lines: int
    has_comma: bool
    has_point: bool
    has_quote: bool


def _seen(file: TextFile) -> _Seen:
    sample, lines, marks = list[str](), 0, set[str]()
    for _, block in file.blocks():
        lines += len(block)
        wanted = FIRST if not sample else PER_BLOCK
        step = max(1, len(block) // wanted) if sample else 1
        if len(sample) < MOST:
            sample += [line for line in block[: wanted * step : step] if line.strip() and not is_comment(line)]
        text = "".join(block)
        marks |= {mark for mark in ',."' if mark not in marks and mark in text}
    return _Seen(sample, lines, "," in marks, "." in marks, '"' in marks)


def _vote(sample: Sequence[str], path: Path) -> tuple[str | None, list[list[str]]]:
    """The delimiter and width of most rows, and those rows."""
    votes: Counter[tuple[str | None, int]] = Counter()
    kept: dict[tuple[str | None, int], list[list[str]]] = {}
    for line in sample:
        readings = [(delimiter, fields_of(line, delimiter)) for delimiter in DELIMITERS]
        chosen = next(
            (reading for reading in readings if len(reading[1]) > 1 and all(map(is_number, reading[1]))),
            None,
        ) or next(
            (
                (delimiter, fields)
                for delimiter, fields in readings
                if any(map(is_number, fields)) and (len(fields) > 1 or delimiter is None)
            ),
            None,
        )
        if chosen is not None:
            key = chosen[0], len(chosen[1])
            votes[key] += 1
            kept.setdefault(key, []).append(chosen[1])
    if not votes:
        shown = next((line for line in sample if line.strip()), "")
        raise ValueError(
            f"{path.name} must hold columns of numbers; no line of it looks like a row of them, the first is "
            f"{shown[:60]!r}. Export numbers."
        )
    # A row whose last fields are gaps may read as narrower by another delimiter; the wider table is meant.
    winner = max(votes, key=lambda key: votes[key] * (1 + 0.01 * sum(map(is_number, kept[key][-1]))))
    return winner[0], kept[winner]


def _numeric(rows: list[list[str]]) -> tuple[bool, ...]:
    def numeric(column: Sequence[str]) -> bool:
        said = [field for field in column if not is_gap(field)]
        return bool(said) and sum(map(is_number, said)) > MOSTLY * len(said)

    columns = list(zip(*rows, strict=True))
    found = [numeric(column) for column in columns]
    empty = [all(is_gap(field) for field in column) for column in columns]
    if empty[-1] and not any(field for field in columns[-1]):
        found[-1] = False  # as when every row ends in a delimiter
        return tuple(found)
    return tuple(is_one or is_empty for is_one, is_empty in zip(found, empty, strict=True))


def _fields_by_column(file: TextFile, delimiter: str | None, width: int) -> list[dict[str, None]]:
    """Fields of each column that could tell its decimal mark, from all over the file."""
    telling: list[dict[str, None]] = [{} for _ in range(width)]
    settled = [False] * width
    for _, line in file.lines():
        fields = fields_of(line, delimiter)
        if len(fields) != width:
            continue
        for place, field in enumerate(fields):
            if settled[place] or ("." not in field and "," not in field):
                continue
            known = telling[place]
            if len(known) < 1000:
                known[field] = None
            if "," in field and "." in field and is_number(field):
                known.clear()
                known[field], settled[place] = None, True  # both marks in one field leave no question
    return telling


def _marks_by_column(file: TextFile, delimiter: str | None, width: int) -> tuple[Mark, ...]:
    """The decimal mark of each column, by its fields from all over the file."""

    def mark(telling: dict[str, None]) -> Mark:
        fields = [field for field in telling if is_number(field)]
        by_default: Mark = "," if delimiter != "," and fields and all("," in field for field in fields) else "."
        return decimal_mark(fields, by_default)

    return tuple(mark(telling) for telling in _fields_by_column(file, delimiter, width))


def _mark_by_default(seen: _Seen, delimiter: str | None) -> Mark:
    """The decimal mark of a file without quotes in which commas and points do not meet."""
    return "," if delimiter != "," and seen.has_comma and not seen.has_point else "."


def values_of(fields: Sequence[str], layout: Layout) -> Iterator[float | None]:
    """The numbers of a row, None for text."""
    for field, mark in zip(fields, layout.marks, strict=False):
        try:
            yield number(field, mark)
        except ValueError:
            yield None
