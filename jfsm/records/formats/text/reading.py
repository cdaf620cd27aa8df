"""What a table of text and the lines around it say."""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from jfsm._files import parsed_json
from jfsm.records._units import is_unit
from jfsm.records.formats.base import Contents, Lazy
from jfsm.records.formats.headings import Headings, headings_of
from jfsm.records.formats.numbers import is_number
from jfsm.records.formats.preambles import stated_rate
from jfsm.records.formats.text.layout import Layout, fields_of, is_comment, layout_of
from jfsm.records.formats.text.lines import Line, TextFile
from jfsm.records.formats.text.table import Segment, Table

MARK = "# jfsm record "  # opens the line on which a written record keeps what is no column
_LISTED = re.compile(
    r"^(?:units?(?: of)? )?(?P<name>.+?)(?:[ _]units?)?\s*[:=;\t]\s*[\[(]?(?P<unit>[^\s\])]+)[\])]?$", re.I
)
_LISTED_TOGETHER = re.compile(r"^units?\s*[:=]\s*(?P<pairs>[^=:]+[=:].+)$", re.I)
_PAIR = re.compile(r"(?P<name>[^,;=:]+?)\s*[=:]\s*(?P<unit>[^,;]+?)\s*(?:[,;]|$)")
_CALLED = re.compile(
    r"^(?:channels?(?: names?)?|columns?(?: names?)?|names?|fields?|headers?|labels?|units?)\s*[:=]\s*", re.I
)
_NUMBERED = re.compile(
    r"^(?:channel|column|col|ch|kanal|spalte|voie|canal)[ _.#]*(?P<number>\d+)(?: name)?\s*[:=;,\t]\s*(?P<text>.+)$",
    re.I,
)
SHOWN = 3  # lines that a note quotes
FEW = 2  # rows that a table at least has; fewer among more rows are a remark


def text_contents(path: Path) -> Contents:
    """The columns of a text file, or its runs where titles or headings stand between rows.

    Raises
    ------
    ValueError
        If it holds no table of numbers, or a row has a wrong number of fields.
    """
    file = TextFile(path)
    layout = layout_of(file)
    table = Table(file, layout)
    segments, notes = _worthy(table.segments)
    if not segments:
        raise ValueError(f"{path.name} must hold columns of numbers; it holds no two rows of them. Export numbers.")
    notes += _around(segments, file)
    described = _Described(table, layout, path)
    if len(segments) == 1:
        return described.contents(segments[0], segments[0], notes)
    return Contents({}, runs=tuple(described.contents(segment, segments[0], notes) for segment in segments))


class _Described:
    """Segments of a table with names."""

    def __init__(self, table: Table, layout: Layout, path: Path):
        self._table, self._layout, self._path = table, layout, path

    def contents(self, segment: Segment, first: Segment, notes: Sequence[str]) -> Contents:
        """What one segment holds; one without headings has those of the first."""
        layout, table = self._layout, self._table
        last_is_empty = not layout.numeric[-1] and not any(table.texts(segment, layout.width - 1)[:100])
        width = layout.width - int(layout.width > 1 and last_is_empty)
        headings, understood = self._headings(segment, width)
        if not understood and segment is not first:
            headings, understood = self._headings(first, width)
        names = headings.names
        units = {**self._listed_units(segment, headings, understood), **headings.units}
        about = next((_about(line, self._path) for _, line in segment.above if line.startswith(MARK)), {})
        rate = stated_rate(line for _, line in segment.above if not line.startswith(MARK))
        said = [*notes, *headings.notes, *self._unread(segment, headings, understood, rate and rate.words, width)]

        def column(name: str) -> np.ndarray:
            place = names.index(name)
            if place in segment.text or not layout.numeric[place]:
                number, found = segment.text.get(place, (segment.first, str(table.texts(segment, place)[0])))
                raise ValueError(
                    f"{self._path.name} must hold numbers in column {name!r}; line {number} holds {found!r}. "
                    f"Repair or remove that line, or read another column."
                )
            return table.column(segment, place)

        return Contents(
            Lazy(names, column),
            units,
            about,
            notes=tuple(said),
            texts=Lazy(names, lambda name: table.texts(segment, names.index(name))),
            aliases=headings.aliases,
            rate=rate,
            title=f"{segment.count} rows from line {segment.first} on",
        )

    def _headings(self, segment: Segment, width: int) -> tuple[Headings, dict[int, str]]:
        """Headings, and the lines that they were read from."""
        plain = [(number, line) for number, line in segment.above if not is_comment(line)]
        hidden = [
            (number, line.strip().lstrip("#%/!; "))
            for number, line in segment.above
            if is_comment(line) and not line.startswith(MARK)
        ]
        for lines in (plain, hidden):
            above = [self._divided(_CALLED.sub("", line), width) for _, line in lines]
            if segment.extra:  # the heading of a field that few rows have
                above = [fields[:width] if len(fields) == width + 1 else fields for fields in above]
            headings = headings_of(above, width)
            if headings.used:
                return headings, {lines[place][0]: lines[place][1] for place in headings.used}
        numbered = {int(match["number"]): (at, match["text"]) for at, match in _matched(_NUMBERED, [*plain, *hidden])}
        if set(numbered) == set(range(1, width + 1)):
            headings = headings_of([[numbered[place][1].strip(' ";,') for place in sorted(numbered)]], width)
            return headings, {at: text for at, text in numbered.values()}
        self._require_unambiguous(plain or hidden, width)
        return headings_of([], width), {}

    def _listed_units(self, segment: Segment, headings: Headings, understood: dict[int, str]) -> dict[str, str]:
        """Units in lines of their own, as ``# force: kN``; the lines are then understood."""
        found: dict[str, str] = {}
        for number, line in segment.above:
            text = line.strip().lstrip("#%/! ")
            together = _LISTED_TOGETHER.match(text)
            matches = _PAIR.finditer(together["pairs"]) if together else filter(None, [_LISTED.match(text)])
            for match in matches:
                name, unit = match["name"].strip(" \"'{"), match["unit"].strip(" \"'}")
                meant = (name,) if name in headings.names else headings.aliases.get(name, ())
                if is_unit(unit) and len(meant) == 1 and (number not in understood or together):
                    found[meant[0]], understood[number] = unit, line
        return found

    def _divided(self, line: str, width: int) -> list[str]:
        """The fields of a heading; where blanks divide the rows, they may stand within a name, too."""
        if self._layout.delimiter is not None:
            fields = fields_of(line, self._layout.delimiter)
            return [*fields, ""] if len(fields) == width - 1 and not self._layout.numeric[width - 1] else fields
        for pattern in (r"\s+", r"\t+|\s{2,}", r"\s+(?![\[(])", r"\s*[,;]\s*"):
            fields = [field for field in re.split(pattern, line.strip()) if field]
            if len(fields) == width:
                return [field.strip('"') for field in fields]
        return line.split()

    def _require_unambiguous(self, above: Sequence[Line], width: int) -> None:
        """Refuse rows of twice as many fields as there are names: their commas may be decimal ones."""
        if self._layout.delimiter != "," or not self._layout.integers or not above:
            return
        names = [field for field in fields_of(above[-1][1], ",") if field]
        if (
            0 < len(names) < width <= 2 * len(names)
            and (len(names) > 1 or width == 2)
            and not any(map(is_number, names))
        ):
            raise ValueError(
                f"{self._path.name} has {len(names)} names ({', '.join(names)}) above rows of {width} fields; its "
                f"commas may stand between fields and within numbers. Write it with semicolons between the fields, or "
                f"with decimal points."
            )

    def _unread(
        self, segment: Segment, headings: Headings, understood: dict[int, str], rate: str | None, width: int
    ) -> list[str]:
        """What stands above the table and is not used."""
        left = [
            (number, line)
            for number, line in segment.above
            if number not in understood
            and not line.startswith(MARK)
            and not line.lower().startswith("sep=")
            and not (rate and rate in " ".join(line.split()))
        ]
        notes: list[str] = []
        rows = [
            (number, line)
            for number, line in left
            if not is_comment(line) and 2 * sum(map(is_number, fields_of(line, self._layout.delimiter))) > width
        ]
        if rows:
            notes.append(f"Rows above the table hold numbers and are left out: {_quoted(rows)}.")
        words = [line for line in left if line not in rows]
        if words:
            notes.append(f"Not understood above the table: {_quoted(words)}.")
        if width > 1 and not headings.used:
            notes.append("No row of names was found above the table; its columns are numbered.")
        return notes


def _matched(pattern: re.Pattern[str], lines: Sequence[Line]) -> Iterator[tuple[int, re.Match[str]]]:
    """Lines that a pattern fits, remarks without their marks."""
    for number, line in lines:
        if match := pattern.match(line.strip().lstrip("#%/! ")):
            yield number, match


def _worthy(segments: Sequence[Segment]) -> tuple[list[Segment], list[str]]:
    """Segments that are tables; single rows stand above the next one, or are said aloud."""
    kept = [segment for segment in segments if segment.count >= FEW]
    waiting, notes = list[Segment](), list[str]()
    for segment in segments:
        if segment.count < FEW:
            waiting.append(segment)
            continue
        alone = [line for single in waiting for line in (*single.above, single.opening)]
        segment.above, waiting = [*alone, *segment.above], []
    if kept:
        notes = [f"Line {single.first} holds numbers but stands alone, and is left out." for single in waiting]
    return kept, notes


def _around(segments: Sequence[Segment], file: TextFile) -> list[str]:
    """What stands in and below the tables and is no row of them."""
    notes: list[str] = []
    below = segments[-1].below
    if below:
        notes.append(f"Left out below the table: {_quoted(below)}.")
    elif not file.ends_in_a_line:
        notes.append("The last line has no end: its last number may be cut short.")
    comments = [line for segment in segments for line in segment.comments]
    if comments:
        notes.append(f"{len(comments)} remarks between the rows are left out: {_quoted(comments)}.")
    for segment in segments:
        for place, (number, text, value) in segment.doubtful.items():
            if place not in segment.grouped:
                notes.append(
                    f"Warning: line {number} holds {text!r} in column {place + 1}, which is read as {value:g}; its "
                    "mark stands between whole and fraction, or between thousands. Write it as the others are."
                )
    extra = [line for segment in segments for line in segment.extra]
    if extra:
        notes.append(f"{len(extra)} rows have a field too many, which is left out: {_quoted(extra)}.")
    return notes


def _quoted(lines: Sequence[Line]) -> str:
    shown = ", ".join(f"line {number} {line.strip()[:50]!r}" for number, line in lines[:SHOWN])
    return shown + (f" and {len(lines) - SHOWN} more" if len(lines) > SHOWN else "")


def _about(line: str, path: Path) -> dict:
    try:
        return parsed_json(line.removeprefix(MARK))
    except ValueError as error:
        raise ValueError(
            f"{path.name} must hold JSON after {MARK!r}; {error}. Repair that line, or remove it."
        ) from error
