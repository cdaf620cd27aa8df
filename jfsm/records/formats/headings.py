"""Names and units of columns from the rows above them."""

import re
from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

from jfsm.records._units import is_unit

_GROUP = re.compile(r"\s*(?:\[([^\[\]]*)\]|\(((?:[^()]|\([^()]*\))*)\)|\{([^{}]*)\}|<([^<>]*)>)\s*")
_SEPARATED = re.compile(r"^(?P<name>.+?)\s*(?:/|,|\bin\b)\s*(?P<unit>\S.*)$")
_LAST_WORD = re.compile(r"^(?P<name>.+\S)\s+(?P<unit>\S{2,})$")
_VALUE = re.compile(r"^[-+]?[\d.,:]+\s*\S{0,8}$")  # "200 Hz": what a key stands before, not a name
_NO_UNITS = ("in", "min")  # as last word of a heading rather a word than a unit


class Headings(NamedTuple):
    """What the rows above a table say of its columns.

    Attributes
    ----------
    names : list of str
        One of its own for each column: without the unit where that is enough to tell it from the others.
    units : dict of name to str
        Where stated.
    aliases : dict of text to names
        Whole headings, bare names and ``column 3``, with the names that each may stand for.
    used : set of int
        Places of the rows that were understood.
    notes : list of str
    """

    names: list[str]
    units: dict[str, str]
    aliases: dict[str, tuple[str, ...]]
    used: set[int]
    notes: list[str]


def headings_of(above: Sequence[Sequence[str]], width: int) -> Headings:
    """Names and units from the rows above a table of that width, those nearest to it last.

    The row of units may stand below or above the names; a row that holds values is neither.
    """
    fitting = {place: _fitted(row, width) for place, row in enumerate(above)}
    rows = [(place, row) for place, row in fitting.items() if row is not None]
    rows = [
        (place, row)
        for at, (place, row) in enumerate(rows)
        if not any(_VALUE.match(field) for field in row)
        or (at + 2 == len(rows) and are_units(rows[at + 1][1]) and not all(_VALUE.match(field) for field in row))
    ]
    texts, units, used, notes = [""] * width, [""] * width, set(), list[str]()
    if rows:
        last = len(rows) - 1
        if are_units(rows[last][1]) and last and not are_units(rows[last - 1][1]):
            names_at, units_at = last - 1, last
        elif last and not are_units(rows[last][1]) and are_units(rows[last - 1][1]):
            names_at, units_at = last, last - 1
        else:
            names_at, units_at = last, None
        used, texts = {rows[names_at][0]}, list(rows[names_at][1])
        if units_at is not None:
            used.add(rows[units_at][0])
            units = [field.strip("[](){}<> ") for field in rows[units_at][1]]
        elif all(is_unit(text) for text in texts if text):
            units = list(texts)
            notes.append(f"The only heading reads like units ({', '.join(texts)}); it is taken for names and units.")
    bare = list(texts)
    for place, text in enumerate(texts):
        name, unit = split_unit(text)
        if unit and not (units[place] and units[place] == text):
            bare[place] = name
            if units[place] and units[place] != unit:
                notes.append(
                    f"The heading {text!r} and the row of units ({units[place]!r}) differ; the heading counts."
                )
            units[place] = unit
    names = _distinct(bare, texts)
    aliases: dict[str, dict[str, None]] = {}
    for place, name in enumerate(names):
        for text in (texts[place], bare[place], f"column {place + 1}"):
            if text and text != name:
                aliases.setdefault(text, {})[name] = None
    return Headings(
        names,
        {name: unit for name, unit in zip(names, units, strict=True) if unit},
        {text: tuple(found) for text, found in aliases.items()},
        used,
        notes,
    )


def split_unit(text: str) -> tuple[str, str]:
    """Name and unit of a heading, the unit empty where it has none: ``Force (kN)``, ``Time/s``, ``Weg, mm``."""
    groups = list(_GROUP.finditer(text))
    if groups:
        known = [group for group in groups if is_unit(_inside(group))]
        group = (known or groups)[-1]
        name = " ".join(part for part in (text[: group.start()].strip(), text[group.end() :].strip()) if part)
        return (name, _inside(group)) if name and _inside(group) else (text, "")
    for pattern in (_SEPARATED, _LAST_WORD):
        match = pattern.match(text)
        if match and is_unit(match["unit"]) and match["unit"].lower() not in _NO_UNITS:
            return match["name"], match["unit"]
    return text, ""


def are_units(fields: Sequence[str]) -> bool:
    """Whether a row reads like units: all in brackets, or most of them known."""
    stated = [field for field in fields if field]
    if stated and all(field[0] in "[({<" and field[-1] in "])}>" for field in stated):
        return True
    return 2 * sum(is_unit(field) for field in stated) > len(stated)


def _inside(group: re.Match[str]) -> str:
    return next((part for part in group.groups() if part is not None), "").strip()


def _fitted(row: Sequence[str], width: int) -> list[str] | None:
    """A row cut to the width, None if it cannot be a heading of such a table."""
    fields = [field.strip() for field in row]
    if any(fields[width:]) or not any(fields) or len(fields) < width:
        return None
    return fields[:width]


def _distinct(bare: Sequence[str], texts: Sequence[str]) -> list[str]:
    bares, wholes = Counter(bare), Counter(texts)
    names: list[str] = []
    for place, (name, text) in enumerate(zip(bare, texts, strict=True), start=1):
        if not name:
            names.append(f"column {place}")
        elif bares[name] == 1:
            names.append(name)
        else:
            names.append(text if wholes[text] == 1 and text != name else f"{name} ({place})")
    return names
