"""Columns of numbers in JSON."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from jfsm._files import parsed_json
from jfsm.records.formats.base import AbstractFormat, Contents, Lazy
from jfsm.records.formats.headings import headings_of

_NAMES, _SAMPLES = ("name", "label", "channel", "id", "key"), ("data", "values", "samples", "value", "y")
FEW = 3  # entries from which on an object of numbered ones is a column


class JsonFormat(AbstractFormat):
    """Lists of numbers by name, an object in an object as ``run.force``; or rows, each an object. Read only.

    Rows may be a list, or stand in lines of their own; what pandas writes is read in each of its shapes, and so is a
    list of channels, objects with a name and their samples. Lists of text may be instants. Single numbers such as
    ``fs`` are arrays, too; ``units`` beside the columns, or farther out, gives the unit of each.
    """

    name: ClassVar[str] = "JSON"
    suffixes: ClassVar[tuple[str, ...]] = (".json",)

    def recognises(self, begins_with: bytes, path: Path) -> bool:
        text = begins_with.removeprefix(b"\xef\xbb\xbf").lstrip()
        return text.startswith(b"{") or (text.startswith(b"[") and text[1:].lstrip()[:1] in (b"{", b"["))

    def load(self, path: Path) -> Contents:
        given = _as_columns(_parsed(path), path)
        units = dict(_units("", given))
        arrays: dict[str, np.ndarray] = {}
        texts: dict[str, np.ndarray] = {}
        skipped: list[str] = []
        for name, value in _leaves("", given):
            found = _numbers(value)
            if found is not None:
                arrays[name] = found
            elif isinstance(value, list) and value and all(isinstance(item, str) for item in value):
                texts[name] = np.array(value)
            elif not any(name.startswith(f"{place}units.") for place in units):
                skipped.append(name)
        if not arrays:
            raise ValueError(
                f'{path.name} must hold lists of numbers by name, as {{"time": [...], "force": [...]}}; it holds none.'
            )
        names = [*arrays, *texts]
        headings = headings_of([names], len(names))
        originals = dict(zip(headings.names, names, strict=True))
        stated = {name: _stated(units, original) for name, original in originals.items()}
        beside = dict(_beside("", given))
        skipped = [name for name in skipped if name.rpartition(".")[2] not in ("unit", "units", *_NAMES)]
        aliases = {**headings.aliases, **_places(originals)}

        def array(name: str) -> np.ndarray:
            if originals[name] in texts:
                raise ValueError(
                    f"{path.name} must hold numbers in {name!r} to be a channel; it holds text. Name another."
                )
            return arrays[originals[name]]

        return Contents(
            Lazy(originals, array),
            {
                name: unit
                for name, original in originals.items()
                if (unit := stated[name] or beside.get(original) or headings.units.get(name))
            },
            notes=(f"Not numbers, and left out: {', '.join(skipped[:6])}.",) if skipped else (),
            texts={name: texts[original] for name, original in originals.items() if original in texts},
            aliases=aliases,
        )


def _places(originals: Mapping[str, str]) -> dict[str, tuple[str, ...]]:
    """Names of channels by that of the object that holds their samples, and by its end."""
    found: dict[str, tuple[str, ...]] = {}
    for name, original in originals.items():
        place, _, last = original.rpartition(".")
        if place and last in _SAMPLES:
            for text in dict.fromkeys((place, place.rpartition(".")[2])):
                found[text] = (*found.get(text, ()), name)
    return {text: names for text, names in found.items() if text not in originals}


def _parsed(path: Path) -> Any:
    """What a file holds: one value, or one in each line.

    Raises
    ------
    ValueError
        If it is no JSON.
    """
    given = path.read_bytes()
    try:
        return parsed_json(given)
    except ValueError as error:
        try:
            lines = [parsed_json(line) for line in given.splitlines() if line.strip()]
        except ValueError:
            lines = []
        if len(lines) > 1:
            return lines
        raise ValueError(f"{path.name} must be JSON; {error}. Write or copy it again.") from error


def _as_columns(given: Any, path: Path) -> Any:
    """Columns by name, from any of the shapes in which tables and channels are written."""
    if isinstance(given, list):
        channels = _channels(given)
        return _columns_of_rows(given, path) if channels is None else channels
    if not isinstance(given, Mapping):
        return given
    names, rows = given.get("columns"), given.get("data")
    if isinstance(names, list) and isinstance(rows, list) and all(isinstance(row, list) for row in rows):
        return {str(name): [row[place] for row in rows] for place, name in enumerate(names)}
    if all(isinstance(value, Mapping) for value in given.values()) and _are_numbers(given):
        return _columns_of_rows(list(given.values()), path)
    return {key: _inner(value, path) for key, value in given.items()}


def _inner(value: Any, path: Path) -> Any:
    """A value inside an object: lists of objects become columns, and so do objects of numbered entries."""
    if isinstance(value, list) and value and all(isinstance(item, Mapping) for item in value):
        return _as_columns(value, path)
    if isinstance(value, Mapping):
        if _are_numbers(value) and not any(isinstance(item, list | Mapping) for item in value.values()):
            return list(value.values())
        return {key: _inner(item, path) for key, item in value.items()}
    return value


def _are_numbers(given: Mapping[str, Any]) -> bool:
    """Whether the keys of an object count its entries, or are stamps in whole numbers."""
    return len(given) >= FEW and all(key.isdigit() for key in given)


def _channels(given: list[Any]) -> dict[str, Any] | None:
    """Objects with a name and samples by that name; None if they are none."""
    found: dict[str, Any] = {}
    for item in given:
        name = next((item[key] for key in _NAMES if key in item), None) if isinstance(item, Mapping) else None
        if not isinstance(name, str) or not any(isinstance(item.get(key), list) for key in _SAMPLES):
            return None
        found[name if name not in found else f"{name} ({len(found) + 1})"] = item
    return found or None


def _beside(place: str, value: Any) -> Iterator[tuple[str, str]]:
    """Samples and the unit that stands beside them in the same object."""
    if isinstance(value, Mapping):
        unit = value.get("unit", value.get("units"))
        for key, item in value.items():
            if key in _SAMPLES and isinstance(item, list) and isinstance(unit, str):
                yield place + key, unit
            yield from _beside(f"{place}{key}.", item)


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
