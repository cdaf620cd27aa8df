"""Columns of numbers in JSON."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from jfsm._files import parsed_json
from jfsm.records.formats.base import AbstractFormat, Contents
from jfsm.records.formats.headings import headings_of


class JsonFormat(AbstractFormat):
    """Lists of numbers by name, an object in an object as ``run.force``; or a list of rows, each an object. Read only.

    Single numbers such as ``fs`` are arrays, too; ``units`` beside the columns, or farther out, gives the unit of each.
    """

    name: ClassVar[str] = "JSON"
    suffixes: ClassVar[tuple[str, ...]] = (".json",)

    def recognises(self, begins_with: bytes, path: Path) -> bool:
        text = begins_with.removeprefix(b"\xef\xbb\xbf").lstrip()
        return text.startswith(b"{") or (text.startswith(b"[") and text[1:].lstrip()[:1] in (b"{", b"["))

    def load(self, path: Path) -> Contents:
        try:
            given = parsed_json(path.read_bytes())
        except ValueError as error:
            raise ValueError(f"{path.name} must be JSON; {error}. Write or copy it again.") from error
        if isinstance(given, list):
            given = _columns_of_rows(given, path)
        units = dict(_units("", given))
        arrays: dict[str, np.ndarray] = {}
        skipped: list[str] = []
        for name, value in _leaves("", given):
            array = _numbers(value)
            if array is not None:
                arrays[name] = array
            elif not any(name.startswith(f"{place}units.") for place in units):
                skipped.append(name)
        if not arrays:
            raise ValueError(
                f'{path.name} must hold lists of numbers by name, as {{"time": [...], "force": [...]}}; it holds none.'
            )
        names = list(arrays)
        headings = headings_of([names], len(names))
        stated = {name: unit for name in names if (unit := _stated(units, name))}
        notes = [f"Not numbers, and left out: {', '.join(skipped[:6])}."] if skipped else []
        return Contents(
            dict(zip(headings.names, arrays.values(), strict=True)),
            {
                name: unit
                for name, original in zip(headings.names, names, strict=True)
                if (unit := stated.get(original, headings.units.get(name)))
            },
            notes=tuple(notes),
            aliases=headings.aliases,
        )


def _units(place: str, value: Any) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """What stands under ``units``, with the place where it does: "" or ``run.``."""
    if isinstance(value, Mapping):
        for key, item in value.items():
            if key == "units" and isinstance(item, Mapping):
                yield place, item
            else:
                yield from _units(f"{place}{key}.", item)


def _stated(units: Mapping[str, Mapping[str, Any]], name: str) -> str:
    """The unit of a column: by its whole name or the end of it, beside it or farther out."""
    for place in sorted(filter(name.startswith, units), key=len, reverse=True):
        for key in (name.removeprefix(place), name.rpartition(".")[2]):
            if isinstance(unit := units[place].get(key), str):
                return unit
    return ""


def _columns_of_rows(rows: list[Any], path: Path) -> dict[str, list[Any]]:
    """Columns from a list of objects with the same keys, or of lists of one length."""
    if rows and all(isinstance(row, Mapping) for row in rows):
        keys = dict.fromkeys(key for row in rows for key in row)
        return {str(key): [row.get(key) for row in rows] for key in keys}
    if rows and all(isinstance(row, list) and len(row) == len(rows[0]) for row in rows):
        return {f"column {place}": [row[place - 1] for row in rows] for place in range(1, len(rows[0]) + 1)}
    raise ValueError(f"{path.name} must hold columns by name, or rows that are alike. Write it so.")


def _leaves(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(value, Mapping):
        for key, item in value.items():
            yield from _leaves(f"{name}.{key}" if name else str(key), item)
    else:
        yield name, value


def _numbers(value: Any) -> np.ndarray | None:
    """An array of numbers, in which null is a gap; None if it is something else."""
    if isinstance(value, bool) or value is None or isinstance(value, str):
        return None
    try:
        array = np.array(value, dtype=np.float64) if not _has_text(value) else None
    except (ValueError, TypeError):
        return None
    return array if array is not None and array.size else None


def _has_text(value: Any) -> bool:
    return isinstance(value, list) and any(isinstance(item, str | Mapping) for item in value)
