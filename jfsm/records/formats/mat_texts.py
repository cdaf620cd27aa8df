"""What texts beside the numbers of a MATLAB file say: units, labels, rates, names of the columns of a matrix."""

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from jfsm.records.formats.mat73 import Late

_OF_FIELD = re.compile(r"(?P<place>.*?)units?\.(?P<field>[^.]+)")  # run.units.F
_BESIDE = re.compile(r"(?P<holder>.+?)_?units?", re.IGNORECASE)  # F_unit
_INPUT_OUTPUT = re.compile(r"(?P<place>.*?)(?P<way>Input|Output)Unit")  # of iddata
_HEADER = re.compile(
    r"(?P<channel>.*Channel_\d+)_Header\.(?P<key>SignalName|Name|Unit|SampleFrequency)"
)  # Channel_2_Data
_NAMES = re.compile(
    r"(?:channel|column|var|variable|signal)?_?(?:names?|labels?|headers?|channels?|columns?)", re.IGNORECASE
)
_UNITS = re.compile(r"(?:channel|column)?_?units?", re.IGNORECASE)

Array = np.ndarray | Late


class Column:
    """One column of a matrix, taken when NumPy asks for it."""

    def __init__(self, matrix: Array, place: int):
        self._matrix, self._place = matrix, place

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        values = np.asarray(self._matrix)[:, self._place]
        return values if dtype is None else values.astype(dtype)


class Described(NamedTuple):
    """Units and labels of arrays, rates [Hz], and the columns of matrices whose names are given."""

    units: dict[str, str]
    labels: dict[str, str]
    rates: dict[str, float]
    columns: dict[str, Column]


def described(texts: Mapping[str, Sequence[str]], arrays: Mapping[str, Array]) -> Described:
    """What texts say of arrays: `texts` has one or several under each dotted name."""
    found = Described({}, {}, {}, {})
    for name, (text, *others) in texts.items():
        if others:
            continue
        for holder in _holders(name):
            if holder in arrays and text:
                found.units[holder] = text
        if (match := _HEADER.fullmatch(name)) and (holder := f"{match['channel']}_Data") in arrays:
            _of_header(found, holder, match["key"], text)
    for name, array in arrays.items():
        if (match := _HEADER.fullmatch(name)) and match["key"] == "SampleFrequency" and np.size(array) == 1:
            found.rates[f"{match['channel']}_Data"] = float(np.asarray(array).item())
    for name, array in arrays.items():
        for column, unit, place in _columns(name, np.shape(array), texts):
            found.columns[column] = Column(array, place)
            if unit:
                found.units[column] = unit
    return found


def _holders(name: str) -> Iterator[str]:
    """The arrays whose unit a text of that name may be."""
    if match := _OF_FIELD.fullmatch(name):
        yield match["place"] + match["field"]
    elif match := _INPUT_OUTPUT.fullmatch(name):
        yield from (
            match["place"] + field for field in (f"{match['way']}Data", "u" if match["way"] == "Input" else "y")
        )
    elif match := _BESIDE.fullmatch(name):
        yield match["holder"]


def _of_header(found: Described, holder: str, key: str, text: str) -> None:
    if key == "Unit":
        found.units[holder] = text
    elif key == "SampleFrequency" and re.fullmatch(r"\d+(\.\d*)?", text):
        found.rates[holder] = float(text)
    elif key != "SampleFrequency":
        found.labels[holder] = text


def _columns(name: str, shape: tuple[int, ...], texts: Mapping[str, Sequence[str]]) -> Iterator[tuple[str, str, int]]:
    """Names and units of the columns of a matrix, from texts beside it that are as many."""
    if len(shape) != 2:
        return
    around = name[: name.rfind(".") + 1]
    beside = {key.removeprefix(around): each for key, each in texts.items() if key.startswith(around)}
    several = {key: each for key, each in beside.items() if len(each) == shape[1] and len(set(each)) > 1}
    names = next((each for key, each in several.items() if _NAMES.fullmatch(key)), ())
    units = next((each for key, each in beside.items() if len(each) == shape[1] and _UNITS.fullmatch(key)), ())
    for place, text in enumerate(names):
        yield around + text, units[place] if units else "", place
