"""Two diagnoses, or two records, side by side."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from .._result import Estimate
from ..records import Record
from ._diagnosis import Diagnosis

Cell = Estimate | float | str | None
"""What stands in a column: a value with its interval, a number, a word, or nothing."""


class Row(NamedTuple):
    """One quantity in both: its section, name and unit, and what the first and the second have."""

    section: str
    name: str
    unit: str
    first: Cell
    second: Cell

    @property
    def apart(self) -> bool:
        """Whether both have an interval, and these do not overlap; of words, whether they differ."""
        one, other = self.first, self.second
        if isinstance(one, Estimate) and isinstance(other, Estimate):
            return one.high < other.low or other.high < one.low
        return isinstance(one, str) and isinstance(other, str) and one != other


@dataclass(frozen=True, repr=False)
class Sides:
    """Values of two diagnoses or two records, side by side.

    Attributes
    ----------
    names : (str, str)
        What the two columns are called.
    rows : tuple of Row
        (section, name, unit, first, second), with `apart` where 95 % intervals do not overlap or words differ.
    """

    names: tuple[str, str]
    rows: tuple[Row, ...]

    def __repr__(self) -> str:
        apart = sum(row.apart for row in self.rows)
        return f"<Sides, {self.names[0]} and {self.names[1]}: {len(self.rows)} quantities, {apart} apart>"

    def __str__(self) -> str:
        headings = ("", *self.names, "unit", "")
        lines = [headings, *self.cells()]
        widths = [max(len(line[i]) for line in lines) for i in range(len(headings))]
        return "\n".join("  ".join(map(str.ljust, line, widths)).rstrip() for line in lines)

    def cells(self) -> list[tuple[str, str, str, str, str]]:
        """The rows as they are printed."""
        return [
            (row.name, _word(row.first), _word(row.second), row.unit, "apart" if row.apart else "") for row in self.rows
        ]

    def print(self) -> None:
        """Show them as a table."""
        print(self)

    def to_dataframe(self) -> Any:
        """The rows as a DataFrame of pandas, which must be installed; intervals in columns of their own."""
        import pandas as pd

        return pd.DataFrame([dict(_columns(row)) for row in self.rows])

    def _repr_html_(self) -> str:
        from ..reporting import notebook_table

        return notebook_table("", ("", *self.names, "unit", ""), self.cells())


def compare(first: Diagnosis | Record, second: Diagnosis | Record) -> Sides:
    """Values of two diagnoses, or of two records, side by side.

    Parameters
    ----------
    first, second : Diagnosis or Record
        Two of the same kind.

    Returns
    -------
    Sides
        Of diagnoses: verdict, causes with probabilities and sizes, own values, modes, errors on held-out readings. Of
        records: samples, rate, duration, and each channel's unit, standard deviation and noise.

    Raises
    ------
    TypeError
        If they are not two diagnoses or two records.

    Examples
    --------
    >>> print(jfsm.compare(jfsm.Diagnosis.load("monday.json"), jfsm.Diagnosis.load("friday.json")))
    """
    if isinstance(first, Diagnosis) and isinstance(second, Diagnosis):
        return compare_numbers(first.told, second.told)
    if isinstance(first, Record) and isinstance(second, Record):
        sides = [dict(_of_record(each)) for each in (first, second)]
        return Sides(_named(first.name, second.name), tuple(_rows(*sides)))
    raise TypeError(
        "`first` and `second` must be two diagnoses or two records; got "
        f"{type(first).__name__} and {type(second).__name__}."
    )


def compare_numbers(first: Mapping[str, Any], second: Mapping[str, Any], names: tuple[str, str] | None = None) -> Sides:
    """The same of what `Diagnosis.to_json` wrote."""
    named = names or _named(first["record"]["name"], second["record"]["name"])
    return Sides(named, tuple(_rows(dict(_of_diagnosis(first)), dict(_of_diagnosis(second)))))


Key = tuple[str, str, str]
"""Section, name and unit of a quantity."""


def _rows(first: Mapping[Key, Cell], second: Mapping[Key, Cell]) -> Iterator[Row]:
    """The quantities of either, section by section."""
    keys = dict.fromkeys([*first, *second])
    for section in dict.fromkeys(key[0] for key in keys):
        for key in keys:
            if key[0] == section:
                yield Row(*key, first.get(key), second.get(key))


def _of_diagnosis(d: Mapping[str, Any]) -> Iterator[tuple[Key, Cell]]:
    yield ("verdict", "verdict", ""), str(d["verdict"])
    yield from _causes(d)
    for path, value in d["refitted"].items():
        yield ("own values", path, value["unit"]), _estimate(value)
    for number, mode in enumerate(d["modes"], 1):
        yield ("modes", f"mode {number}, frequency", mode["frequency"]["unit"]), _estimate(mode["frequency"])
        yield ("modes", f"mode {number}, damping ratio", ""), _estimate(mode["damping_ratio"])
    yield from _errors(d["gain"] or {})
    for channel in d["record"]["channels"]:
        yield ("noise", f"noise of {channel['name']}", channel["unit"]), channel["noise"]


def _causes(d: Mapping[str, Any]) -> Iterator[tuple[Key, Cell]]:
    for finding in d["findings"]:
        at = "-".join(map(str, finding["at"]))
        name = f"{finding['cause']}@{at}"
        yield ("causes", f"{name}, probability", ""), float(finding["probability"])
        for parameter, value in finding["parameters"].items():
            yield ("causes", f"{name}.{parameter}", value["unit"]), _estimate(value)
        if finding["size"]:
            yield ("causes", f"{finding['kind']}, size", finding["size"]["unit"]), _estimate(finding["size"])


def _errors(gain: Mapping[str, Any]) -> Iterator[tuple[Key, Cell]]:
    for channel, row in (gain.get("channels") or {}).items():
        for error in ("before", "refitted", "after", "floor"):
            yield ("errors", f"error of {channel}, {error}", row["unit"]), row[error]
    if gain.get("closed") is not None:
        low, high = gain["interval"]
        yield ("errors", "closed share of the error", ""), Estimate(gain["closed"], low, high, "")


def _estimate(value: Mapping[str, Any]) -> Estimate:
    return Estimate(value["value"], value["low"], value["high"], value["unit"])


def _of_record(record: Record) -> Iterator[tuple[Key, Cell]]:
    found = record.inspect()
    yield ("record", "samples", ""), float(found.samples)
    yield ("record", "rate", "Hz"), found.sample_rate
    yield ("record", "duration", "s"), found.duration
    yield ("record", "driven by", ""), ", ".join(found.drives) or "nothing"
    for channel in found.channels:
        yield ("channels", f"{channel.channel}, standard deviation", channel.unit), channel.std
        yield ("channels", f"{channel.channel}, noise", channel.unit), channel.noise


def _named(first: str | None, second: str | None) -> tuple[str, str]:
    if first and second and first != second:
        return first, second
    return "first", "second"


def _word(cell: Cell) -> str:
    match cell:
        case None:
            return "-"
        case str():
            return cell
        case Estimate(value, low, high):
            bounds = "" if low is None or high is None or low == high else f" [{low:.4g}, {high:.4g}]"
            return f"{value:.4g}{bounds}"
        case value:
            return f"{value:.5g}"


def _columns(row: Row) -> Iterator[tuple[str, Any]]:
    yield from (("section", row.section), ("name", row.name), ("unit", row.unit))
    for side, cell in (("first", row.first), ("second", row.second)):
        known = isinstance(cell, Estimate)
        yield side, cell.value if isinstance(cell, Estimate) else cell
        yield f"{side}_low", cell.low if known else None
        yield f"{side}_high", cell.high if known else None
    yield "apart", row.apart
