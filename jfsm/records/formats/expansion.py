"""How large what a file holds becomes in memory: asked before it is unpacked, so that a small file cannot fill it."""

import math
import os
import re
import zipfile
from pathlib import Path
from typing import IO

LIMIT = "JFSM_LARGEST_GB"
"""Variable of the environment that raises, or lowers, the limit."""
_DEFAULT_GB = 4.0
_PIECE = 1 << 22
_CELL = re.compile(rb'<(?:\w+:)?c\s(?:[^>]*?\s)?r="([A-Z]{1,3})(\d{1,7})"')
_LONGEST_CELL = 200
"""Bytes in which a cell's place is said, for those at the edge of a piece."""
_OF_SHEET = 4
"""Bytes in memory for a byte of a sheet."""
_OF_CELL = 24
"""Bytes in memory for every place up to the farthest cell, filled or not."""


class OversizeError(ValueError):
    """A file that holds more than the limit."""


def require_room(size: float, path: Path) -> None:
    """Refuse what would take more than so many bytes of memory.

    Raises
    ------
    OversizeError
        If `size` is above the limit, with the way to raise it; or if the limit is no number.
    """
    limit = _limit()
    if size > 1e9 * limit:
        raise OversizeError(
            f"{path.name} must take at most {limit:g} GB of memory once it is unpacked; it takes {size / 1e9:.3g} GB. "
            f"If it should, set {LIMIT}={math.ceil(1.1 * size / 1e9)} in the environment; else copy it again."
        )


def unpacked_size(path: Path) -> int:
    """Bytes that the members of a zip archive take when they are unpacked; more is not read of them."""
    with zipfile.ZipFile(path) as archive:
        return sum(member.file_size for member in archive.infolist())


def require_room_in_workbook(path: Path) -> None:
    """Refuse a workbook of zipped sheets that takes more memory than the limit; errors as of `require_room`.

    Readers make room for every place up to the farthest cell of a sheet.
    """
    require_room(_OF_SHEET * unpacked_size(path), path)
    with zipfile.ZipFile(path) as archive:
        for name in archive.namelist():
            if name.startswith("xl/worksheets/") and name.endswith(".xml"):
                with archive.open(name) as sheet:
                    require_room(_OF_CELL * _places(sheet), path)


def _limit() -> float:
    """The limit in GB."""
    given = os.environ.get(LIMIT)
    try:
        limit = _DEFAULT_GB if given is None else float(given)
    except ValueError:
        limit = -1.0
    if not limit > 0:
        raise OversizeError(f"The variable {LIMIT} must be a positive number of GB, as 16; it was {given!r}.")
    return limit


def _places(sheet: IO[bytes]) -> int:
    """Rows times columns up to the farthest cell that a sheet names."""
    rows, columns, rest = 0, 0, b""
    while piece := sheet.read(_PIECE):
        text = rest + piece
        for letters, digits in set(_CELL.findall(text)):
            rows = max(rows, int(digits))
            columns = max(columns, _number(letters))
        rest = text[-_LONGEST_CELL:]
    return rows * columns


def _number(letters: bytes) -> int:
    """A column by its letters: A is 1, AA is 27."""
    number = 0
    for letter in letters:
        number = 26 * number + letter - ord("A") + 1
    return number
