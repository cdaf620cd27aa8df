"""The tables of a diagnosis, once, for the terminal and the page."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from jfsm.reporting._quantities import (
    ABSENT,
    digits_for,
    interval,
    number,
    percent,
    probability,
    quantity,
    scale_for,
)
from jfsm.reporting._wording import cause_name, place_name

Dictionary = Mapping[str, Any]

SETS = {"training": "fitted", "holdout": "held out"}  # sets of data in a reader's words


@dataclass(frozen=True)
class Table:
    """Cells of text under headings.

    Attributes
    ----------
    title : str
    headings : tuple of str
    rows : tuple of tuple of str
        As many cells as there are headings.
    text_columns : frozenset of int
        Columns of words, set flush left; the others hold numbers.
    strong : frozenset of int
        Rows to stand out.
    """

    title: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    text_columns: frozenset[int] = frozenset({0})
    strong: frozenset[int] = frozenset()

    def only(self, *headings: str) -> "Table":
        """The same table with these columns alone."""
        kept = [column for column, heading in enumerate(self.headings) if heading in headings]
        return replace(
            self,
            headings=tuple(self.headings[column] for column in kept),
            rows=tuple(tuple(row[column] for column in kept) for row in self.rows),
            text_columns=frozenset(place for place, column in enumerate(kept) if column in self.text_columns),
        )


def findings_table(findings: Sequence[Dictionary]) -> Table:
    """One row a parameter: what was found, where, how sure, how large."""
    rows = []
    for finding in findings:
        head = (cause_name(finding["cause"]), place_name(finding.get("at")), probability(finding.get("probability")))
        for name, estimate in (finding.get("parameters") or {"": {}}).items():
            rows.append((*head, name, *_estimate_cells(estimate)))
            head = ("", "", "")
        if finding.get("law_open") and finding.get("size"):
            name, chance = f"{finding['kind']}, law open", probability(finding["kind_probability"])
            rows.append((name, place_name(finding.get("at")), chance, "size", *_estimate_cells(finding["size"])))
    return Table(
        "Found", ("cause", "place", "probability", "parameter", "value", "95 % interval"), tuple(rows), _words(0, 1, 3)
    )


def rivals_table(findings: Sequence[Dictionary]) -> Table:
    """What else would explain a finding, and with what probability."""
    rows = tuple(
        (
            cause_name(finding["cause"]),
            cause_name(rival["cause"]),
            place_name(rival.get("at")),
            probability(rival.get("probability")),
        )
        for finding in findings
        for rival in finding.get("rivals") or ()
    )
    return Table("Rivals", ("instead of", "it may be", "place", "probability"), rows, _words(0, 1, 2))


def gain_table(channels: Mapping[str, Dictionary]) -> Table:
    """Free-run error on held-out data, a row a channel, in its unit and as a share of the signal."""
    rows = []
    for name, gain in channels.items():
        scale = scale_for(gain.get("before"), gain.get("unit"))
        cells = [
            _with_share(gain.get(stage), scale.factor, gain.get(f"{stage}_nrmse"))
            for stage in ("before", "refitted", "after", "floor")
        ]
        rows.append((name, scale.unit or ABSENT, *cells, percent(gain.get("closed"))))
    headings = ("channel", "unit", "as given", "refitted", "extended", "floor", "closed")
    return Table("Error on held-out data", headings, tuple(rows), _words(0, 1))


def candidates_table(candidates: Sequence[Dictionary]) -> Table:
    """Every hypothesis that was tried, in the order given; the named one stands out."""
    sets = list(dict.fromkeys(name for candidate in candidates for name in candidate.get("error") or ()))
    rows = tuple(
        (
            cause_name(candidate["cause"]),
            place_name(candidate.get("at")),
            number(candidate.get("evidence"), 4),
            *(percent((candidate.get("error") or {}).get(name)) for name in sets),
            _explained(candidate.get("kappa")),
            probability(candidate.get("probability")),
            candidate.get("why") or "",
        )
        for candidate in candidates
    )
    errors = (f"error, {SETS.get(name, name)}" for name in sets)
    headings = ("cause", "place", "evidence [nats]", *errors, "explains", "probability", "why")
    strong = frozenset(row for row, candidate in enumerate(candidates) if candidate.get("why") == "named")
    return Table("Candidates", headings, rows, _words(0, 1, len(headings) - 1), strong)


def _explained(share: float | None) -> str:
    """A share of the error that is explained; what predicts worse than without explains none of it."""
    return percent(None if share is None else max(share, 0.0))


def refitted_table(refitted: Mapping[str, Dictionary]) -> Table:
    """The model's own values: as given, and as the record has them beside the finding."""
    rows = []
    for name, estimate in refitted.items():
        given, value = estimate.get("given"), estimate.get("value")
        change = percent(value / given - 1.0) if given and value is not None else ABSENT
        change = f"+{change}" if change[0].isdigit() and change != "0 %" else change
        shown, bounds = _estimate_cells(estimate)
        digits = digits_for(value, estimate.get("low"), estimate.get("high"))
        rows.append((name, quantity(given, estimate.get("unit"), digits), shown, bounds, change))
    return Table("The model's own values", ("parameter", "given", "refitted", "95 % interval", "change"), tuple(rows))


def modes_table(modes: Sequence[Dictionary]) -> Table:
    """Frequency and damping ratio of the linear part, a row each: as given, and as the record has them."""
    rows = []
    for number_of_mode, mode in enumerate(modes, start=1):
        for name, words in (("frequency", "frequency"), ("damping_ratio", "damping ratio")):
            estimate = _in_percent(mode[name])
            shown, bounds = _estimate_cells(estimate)
            digits = digits_for(estimate["value"], estimate["low"], estimate["high"])
            given = quantity(estimate["given"], estimate["unit"], digits)
            rows.append((f"mode {number_of_mode}, {words}", given, shown, bounds))
    headings = ("linear part", "given", "refitted", "95 % interval")
    return Table("Frequency and damping", headings, tuple(rows))


def _in_percent(estimate: Dictionary) -> dict[str, Any]:
    """A number without unit in per cent; others as they are."""
    if estimate["unit"] != "1":
        return dict(estimate)
    return {
        "unit": "%",
        **{key: None if (value := estimate[key]) is None else 100 * value for key in ("given", "value", "low", "high")},
    }


def channels_table(channels: Sequence[Dictionary]) -> Table:
    """What was measured: size and noise floor of each channel."""
    rows = []
    for channel in channels:
        rms, noise, unit = channel.get("rms"), channel.get("noise"), channel.get("unit")
        share = percent(noise / rms) if rms and noise is not None else ABSENT
        rows.append((channel["name"], quantity(rms, unit), quantity(noise, unit), share))
    return Table("The record", ("channel", "rms", "noise floor", "noise / rms"), tuple(rows))


def detectable_table(detectable: Mapping[str, Dictionary]) -> Table:
    """The smallest size of each cause that this record would have shown."""
    rows = tuple(
        (cause_name(cause), size.get("parameter") or "", quantity(size.get("value"), size.get("unit")))
        for cause, size in detectable.items()
    )
    return Table("What this record would have shown", ("cause", "parameter", "from"), rows, _words(0, 1))


def _estimate_cells(estimate: Dictionary) -> tuple[str, str]:
    value, low, high, unit = (estimate.get(key) for key in ("value", "low", "high", "unit"))
    return quantity(value, unit, digits_for(value, low, high)), interval(low, high, unit, value)


def _with_share(value: float | None, factor: float, share: float | None) -> str:
    if value is None:
        return ABSENT
    return f"{number(value / factor)} ({percent(share)})" if share is not None else number(value / factor)


def _words(*columns: int) -> frozenset[int]:
    return frozenset(columns)
