"""Spreadsheets of Excel and OpenDocument, through python-calamine (an optional extra)."""

import datetime
import io
import zipfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from jfsm.records._runs_of import runs_of
from jfsm.records.formats.base import AbstractFormat, Contents, Lazy, optional_package
from jfsm.records.formats.expansion import OversizeError, require_room_in_workbook
from jfsm.records.formats.headings import headings_of
from jfsm.records.formats.numbers import decimal_mark, is_gap, is_number, is_summary, number
from jfsm.records.formats.preambles import stated_rate

SHORTEST = 2  # rows of a table
SHOWN = 3  # rows that a note quotes
_OLE, _ZIP = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", b"PK\x03\x04"

Row = Sequence[Any]


class SpreadsheetFormat(AbstractFormat):
    """The tables of xlsx, xlsm, xlsb, xls and ods files: headings, units and first row are found. Read only.

    Sheets with numbers are the file's `sheet`s, tables below one another in a sheet its `run`s. Cells of dates are a
    clock.
    """

    name: ClassVar[str] = "spreadsheet"
    suffixes: ClassVar[tuple[str, ...]] = (".xlsx", ".xls", ".xlsm", ".xlsb", ".ods")

    def recognises(self, begins_with: bytes, path: Path) -> bool:
        if begins_with.startswith(_ZIP):
            office = b"[Content_Types].xml" in begins_with or b"xl/" in begins_with
            return office or b"mimetypeapplication/vnd.oasis.opendocument.spreadsheet" in begins_with
        return begins_with.startswith(_OLE)

    def load(self, path: Path) -> Contents:
        calamine: Any = optional_package("python_calamine", "excel", path)
        try:
            if zipfile.is_zipfile(path):
                require_room_in_workbook(path)
            book = calamine.CalamineWorkbook.from_filelike(io.BytesIO(path.read_bytes()))  # whatever its ending
            sheets = {name: book.get_sheet_by_name(name).to_python(skip_empty_area=False) for name in book.sheet_names}
        except OversizeError:
            raise
        except Exception as error:  # whatever the reader stumbles over in bytes that are no such file
            raise ValueError(
                f"{path.name} must be a spreadsheet; it cannot be opened as one ({error}), and may be cut short or of "
                f"another program. Write or copy it again, or export the sheet as csv."
            ) from error
        found = {name: tables for name, rows in sheets.items() if (tables := _tables(rows, path))}
        if not found:
            raise ValueError(
                f"{path.name} must hold columns of numbers in a sheet; none of {', '.join(map(repr, sheets))} does. If "
                f"Excel shows some, let it calculate and save them, or export the sheet as csv."
            )
        each = tuple(
            replace(tables[0], title=name) if len(tables) == 1 else Contents({}, runs=tuple(tables), title=name)
            for name, tables in found.items()
        )
        return each[0] if len(each) == 1 else Contents({}, runs=each, runs_are="sheet")


def _tables(rows: Sequence[Row], path: Path) -> list[Contents]:
    """The tables of a sheet: stretches of rows with numbers where most rows have them."""
    filled = [[_is_value(cell) for cell in row] for row in rows]
    counts = [sum(row) for row in filled]
    if not any(counts):
        return []
    usual = float(np.median([count for count in counts if count]))
    is_data = [count and count >= 0.5 * usual and not _is_heading(row) for count, row in zip(counts, rows, strict=True)]
    found: list[Contents] = []
    behind = 0
    for first, end in zip(*(edge.tolist() for edge in runs_of(np.array(is_data, dtype=bool))), strict=True):
        if end - first >= SHORTEST:
            above = [(place + 1, row) for place, row in enumerate(rows[behind:first], start=behind) if _is_filled(row)]
            found.append(_table(rows[first:end], above, first, path))
            behind = end
    rest = [(place + 1, row) for place, row in enumerate(rows[behind:], start=behind) if _is_filled(row)]
    if rest and len(found) == 1:
        found = [replace(found[0], notes=(*found[0].notes, f"Left out below the table: {_quoted(rest)}."))]
    return found


def _table(rows: Sequence[Row], above: Sequence[tuple[int, Row]], first: int, path: Path) -> Contents:
    used = [place for place in range(max(map(len, rows))) if any(_is_filled(row[place : place + 1]) for row in rows)]
    titles = [[_text(row[place]) if place < len(row) else "" for place in used] for _, row in above]
    headings = headings_of(titles, len(used))
    places = dict(zip(headings.names, used, strict=True))
    cells = {name: [row[place] if place < len(row) else "" for row in rows] for name, place in places.items()}
    left = [row for place, row in enumerate(above) if place not in headings.used]
    rate = stated_rate(";".join(_text(cell) for cell in row if _text(cell)) for _, row in left)
    notes = [*headings.notes]
    texts = [name for name, column in cells.items() if any(isinstance(c, str) and is_number(c) for c in column)]
    if texts:
        notes.append(f"Numbers are kept as text in {', '.join(map(repr, texts))}; they are read as numbers.")
    if left:
        notes.append(f"Not understood above the table: {_quoted(left)}.")
    return Contents(
        Lazy(places, lambda name: _column(cells[name], name, first, path)),
        headings.units,
        notes=tuple(notes),
        texts=Lazy(places, lambda name: np.array([_text(cell) for cell in cells[name]])),
        aliases=headings.aliases,
        rate=rate,
        title=f"{len(rows)} rows from row {first + 1} on",
    )


def _column(cells: Sequence[Any], name: str, first: int, path: Path) -> np.ndarray:
    """Numbers, or instants where cells are dates."""
    if all(isinstance(cell, datetime.datetime) for cell in cells):
        return np.array(cells, dtype="datetime64[ns]")
    if all(isinstance(cell, datetime.timedelta) for cell in cells):
        return np.array(cells, dtype="timedelta64[ns]")
    mark = decimal_mark((cell for cell in cells if isinstance(cell, str) and is_number(cell)), ".")
    values = np.full(len(cells), np.nan)
    for place, cell in enumerate(cells):
        if isinstance(cell, str):
            try:
                values[place] = number(cell, mark)
                continue
            except ValueError:
                pass
        elif isinstance(cell, int | float):
            values[place] = cell
            continue
        raise ValueError(
            f"{path.name} must hold numbers in column {name!r}; row {first + place + 1} holds {_text(cell)!r}. Repair "
            f"or remove that row, or read another column."
        )
    return values


def _is_value(cell: Any) -> bool:
    if isinstance(cell, bool):
        return False
    return isinstance(cell, int | float | datetime.datetime | datetime.time | datetime.timedelta) or (
        isinstance(cell, str) and is_number(cell)
    )


def _is_heading(row: Row) -> bool:
    """Whether words outnumber the numbers of a row, as in ``Rate, 200, Hz``, or it sums up others, as ``Mean, 3.2``."""
    if any(isinstance(cell, str) and is_summary(cell) for cell in row[:1]):
        return True
    words = sum(isinstance(cell, str) and not is_gap(cell) and not is_number(cell) for cell in row)
    return words > sum(map(_is_value, row))


def _is_filled(row: Row) -> bool:
    return any(cell is not None and cell != "" for cell in row)


def _text(cell: Any) -> str:
    if isinstance(cell, datetime.datetime):
        return str(cell)
    return "" if cell is None else str(cell).strip()


def _quoted(rows: Sequence[tuple[int, Row]]) -> str:
    shown = ", ".join(
        f"row {place} {' '.join(_text(cell) for cell in row if _text(cell))[:50]!r}" for place, row in rows[:SHOWN]
    )
    return shown + (f" and {len(rows) - SHOWN} more" if len(rows) > SHOWN else "")
