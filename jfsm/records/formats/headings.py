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
    rows = _readable(above, width)
    texts, units, used, notes = _names_and_units(rows, width)
    bare = list(texts)
    for place, text in enumerate(texts):
        name, unit = split_unit(text)
        if not unit or (units[place] and units[place] == text):
            continue
        if units[place] and units[place] != unit:
            notes.append(f"The heading {text!r} and the row of units ({units[place]!r}) differ; the heading counts.")
        bare[place], units[place] = name, unit
    names = _distinct(bare, texts)
    stated = {name: unit for name, unit in zip(names, units, strict=True) if unit}
    return Headings(names, stated, _aliases(names, texts, bare), used, notes)


_Placed = tuple[int, list[str]]  # a row and where it stands among those above the table


def _readable(above: Sequence[Sequence[str]], width: int) -> list[_Placed]:
    """The rows of that width that hold no values; of those before the last, names may do so above a row of units."""
    fitting = ((place, _fitted(row, width)) for place, row in enumerate(above))
    rows = [(place, row) for place, row in fitting if row is not None]

    def is_readable(at: int) -> bool:
        values = [bool(_VALUE.match(field)) for field in rows[at][1]]
        return not any(values) or (at + 2 == len(rows) and are_units(rows[at + 1][1]) and not all(values))

    return [row for at, row in enumerate(rows) if is_readable(at)]


def _names_and_units(rows: Sequence[_Placed], width: int) -> tuple[list[str], list[str], set[int], list[str]]:
    """The row of names, that of units, their places, and notes: units stand below or above the names."""
    if not rows:
        return [""] * width, [""] * width, set(), []
    last, before = rows[-1], rows[-2] if len(rows) > 1 else None
    if before is not None and are_units(last[1]) != are_units(before[1]):
        names, units = (before, last) if are_units(last[1]) else (last, before)
        return list(names[1]), [field.strip("[](){}<> ") for field in units[1]], {names[0], units[0]}, []
    texts = list(last[1])
    if not all(is_unit(text) for text in texts if text):
        return texts, [""] * width, {last[0]}, []
    note = f"The only heading reads like units ({', '.join(texts)}); it is taken for names and units."
    return texts, list(texts), {last[0]}, [note]


def _aliases(names: Sequence[str], texts: Sequence[str], bare: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """What else columns are called: their whole headings, their bare names, their numbers."""
    aliases: dict[str, dict[str, None]] = {}
    for place, name in enumerate(names):
        for text in (texts[place], bare[place], f"column {place + 1}"):
            if text and text != name:
                aliases.setdefault(text, {})[name] = None
    return {text: tuple(found) for text, found in aliases.items()}


def split_unit(text: str) -> tuple[str, str]:
    """Name and unit of a heading, the unit empty where it has none: ``Force (kN)``, ``Time/s``, ``Weg, mm``."""
    groups = [group for group in _GROUP.finditer(text) if not _inside(group).isdigit()]  # as in time[0]
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
