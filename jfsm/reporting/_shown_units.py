"""Results in other units than those of the record: numbers with their units, and numbers in sentences."""

import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

Units = Mapping[str, tuple[float, str]]
"""Size in SI and word of the unit that takes the place of a coherent one, or of a symbol in it."""

_shown: ContextVar[Units | None] = ContextVar("shown", default=None)
_said: ContextVar[Callable[[str], str] | None] = ContextVar("said", default=None)

_SYMBOL = re.compile(r"(?P<word>[A-Za-zµ°]+)(?:\^(?P<power>-?\d+)|(?P<raised>[²³⁴⁵]))?")
_OPEN_POWER = re.compile(r"\^\(?-?[A-Za-z]")  # an exponent that is a number of its own: the factor is not known
_RAISED = {"²": 2, "³": 3, "⁴": 4, "⁵": 5}
_NUMBER = r"[-−]?\d+(?:\.\d+)?(?:e[-+]?\d+)?"
_ATOM = r"(?:kg|rad|N|m|s)(?:\^-?\d+|[²³⁴⁵])?"
_UNIT = (
    rf"(?:kg|rad|N|m)(?:\^-?\d+|[²³⁴⁵])?(?:[ *]{_ATOM}(?![\w^]))*(?:/(?:{_ATOM}(?![\w^])|\({_ATOM}(?: {_ATOM})*\)))*"
)
_IN_WORDS = re.compile(
    rf"(?<![\w.^])(?P<value>{_NUMBER}) (?P<unit>{_UNIT})(?![\w^/²³])"
    rf"(?: \[(?P<low>{_NUMBER}), (?P<high>{_NUMBER})\])?"
)
_NAMES = ("unit", "name", "cause", "channel", "path", "verdict")  # what these keys hold is no sentence


@contextmanager
def shown_in(units: Units) -> Iterator[None]:
    """Everything that is shown meanwhile is in these units, as `jfsm.records.out_units` gives them."""
    token = _shown.set(units)
    try:
        yield
    finally:
        _shown.reset(token)


@contextmanager
def said_as(words: Callable[[str], str]) -> Iterator[None]:
    """Every sentence that is shown meanwhile is put into these words first."""
    token = _said.set(words)
    try:
        yield
    finally:
        _said.reset(token)


def in_shown_unit(unit: str) -> tuple[float, str]:
    """What to divide a number by, and the unit that it then has: (0.0254, "in") for "m" where inches are asked for."""
    units = _shown.get()
    if not units or not unit or _OPEN_POWER.search(unit):
        return 1.0, unit
    if unit in units:
        return units[unit]
    factor, below, depth, place, words = 1.0, False, 0, 0, list[str]()
    while place < len(unit):
        match = _SYMBOL.match(unit, place)
        if match is None:
            mark = unit[place]
            depth += (mark == "(") - (mark == ")")
            # What a slash divides by ends with the next symbol, or with the bracket that follows it.
            below = True if mark == "/" else below and not (mark == ")" and depth == 0)
            words.append(mark)
            place += 1
            continue
        size, word = units.get(match["word"], (1.0, match["word"]))
        power = int(match["power"] or _RAISED.get(match["raised"], 1))
        factor *= size ** (-power if below else power)
        raised = match.group().removeprefix(match["word"])
        compound = match["word"] in units and any(mark in word for mark in " /") and len(match.group()) < len(unit)
        words.append((f"({word})" if compound else word) + raised)
        below = below and depth > 0
        place = match.end()
    return factor, "".join(words)


def in_shown_words(told: Any) -> Any:
    """A dictionary of results whose sentences have their numbers in the units that are shown; others as they are."""
    words = _said.get()
    if not _shown.get() and words is None:
        return told
    if isinstance(told, str):
        told = told if words is None else words(told)
        return _IN_WORDS.sub(_translated, told) if _shown.get() else told
    if isinstance(told, Mapping):
        return {key: value if key in _NAMES else in_shown_words(value) for key, value in told.items()}
    if isinstance(told, list | tuple) and not (told and isinstance(told[0], float)):
        return [in_shown_words(each) for each in told]
    return told


def _translated(match: re.Match[str]) -> str:
    factor, unit = in_shown_unit(match["unit"])
    if unit == match["unit"]:
        return match.group()

    def shown(text: str) -> str:
        digits = len(re.sub(r"e.*|[-−.]", "", text).lstrip("0")) or 1
        return f"{float(text.replace('−', '-')) / factor:.{max(digits, 3)}g}"

    bounds = f" [{shown(match['low'])}, {shown(match['high'])}]" if match["low"] else ""
    return f"{shown(match['value'])} {unit}{bounds}"
