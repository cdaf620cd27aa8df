"""Numbers as recorders and spreadsheets write them."""

import re
from collections.abc import Iterable
from typing import Literal

Mark = Literal[".", ","]

GAPS = frozenset(
    "- -- --- ---- nan +nan -nan n/a na n.a. #n/a #na null none nil ovf ovl ovfl ol over overflow overload overrange "
    "invalid error err #value! #div/0! #num! #ref! 1.#qnan -1.#qnan 1.#ind -1.#ind 1.#inf -1.#inf 1.#snan ? * *** "
    "missing".split()
)
"""What stands in a field that holds no reading, in lower case."""

_STRANGE = str.maketrans({"−": "-", "–": "-", "\u00a0": " ", "\u202f": " ", "\u2009": " ", "’": "'"})
_PLAIN = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eEdD][-+]?\d+)?")
_GROUPED = {
    ".": re.compile(r"[-+]?\d{1,3}(?:,\d{3})+(\.\d*)?([eE][-+]?\d+)?"),
    ",": re.compile(r"[-+]?\d{1,3}(?:\.\d{3})+(,\d*)?([eE][-+]?\d+)?"),
}
_SPACED = re.compile(r"[-+]?\d{1,3}(?:[ ']\d{3})+([.,]\d*)?")
_FRACTION = re.compile(r"[-+]?\d*,\d*([eE][-+]?\d+)?")


_SUMMARY = re.compile(
    r"(min|max|mean|average|avg|std|stdev|rms|sum|median|range|count|minimum|maximum|mittelwert|summe|end|eof)\b", re.I
)


def number(field: str, mark: Mark = ".") -> float:
    """The number a field stands for, NaN where it says that there is none.

    Parameters
    ----------
    field : str
        Quotes and blanks around it do no harm.
    mark : "." or ","
        Between whole and fraction. The other one stands between thousands; so may blanks and apostrophes.

    Raises
    ------
    ValueError
        If it is text.
    """
    text = field.strip()
    if _PLAIN.fullmatch(text) and (mark == "." or not _GROUPED[","].fullmatch(text)):
        return float(text.replace("d", "e").replace("D", "e"))
    text = text.translate(_STRANGE).strip(" '\"")
    if not text or text.lower() in GAPS or set(text) == {"#"}:
        return float("nan")
    if _SPACED.fullmatch(text):
        text = text.replace(" ", "").replace("'", "")
    if _GROUPED[mark].fullmatch(text):
        text = text.replace("," if mark == "." else ".", "")
    if mark == "," and _FRACTION.fullmatch(text):
        text = text.replace(",", ".")
    if _PLAIN.fullmatch(text):
        return float(text.replace("d", "e").replace("D", "e"))
    if text.lower().lstrip("+-") in ("inf", "infinity"):
        return float("nan")
    raise ValueError(f"{field!r} is no number")


def is_number(field: str) -> bool:
    """Whether a field is a number by either mark, and not a gap."""
    for mark in (".", ","):
        try:
            value = number(field, mark)
        except ValueError:
            continue
        return value == value
    return False


def is_gap(field: str) -> bool:
    """Whether a field says that there is no reading."""
    text = field.translate(_STRANGE).strip(" '\"").lower()
    return not text or text in GAPS or set(text) == {"#"}


def decimal_mark(fields: Iterable[str], by_default: Mark) -> Mark:
    """The decimal mark of a column: the one that stands last where both occur, or that groups no thousands.

    ``1.234`` alone stays what it is by default; so does ``1,234``.
    """
    for field in fields:
        if "," not in field and "." not in field:
            continue
        text = field.translate(_STRANGE).strip(" '\"").replace(" ", "").replace("'", "")
        point, comma = text.rfind("."), text.rfind(",")
        if point >= 0 and comma >= 0:
            last: Mark = "," if comma > point else "."
            if _GROUPED[last].fullmatch(text):
                return last
        elif text.count(",") > 1 and _GROUPED["."].fullmatch(text):
            return "."
        elif text.count(".") > 1 and _GROUPED[","].fullmatch(text):
            return ","
        elif comma >= 0 and _FRACTION.fullmatch(text) and not _GROUPED["."].fullmatch(text):
            return ","
        elif point >= 0 and _PLAIN.fullmatch(text) and not _GROUPED[","].fullmatch(text):
            return "."
    return by_default


def is_summary(field: str) -> bool:
    """Whether a field begins a row that sums up those above it, or marks the end of a file."""
    return _SUMMARY.match(field.strip()) is not None
