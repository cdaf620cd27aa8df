"""What the rows of the blind examination add up to. A row is the dictionary that `benchmarks/blind.py` writes.

Where two effects were hidden, the second stands under "beside".
"""

import collections
import dataclasses
import itertools
import math
import statistics
from collections.abc import Callable, Iterable, Sequence
from typing import Any

Row = dict[str, Any]

CONFIDENT = 0.9


@dataclasses.dataclass(frozen=True)
class Share:
    """`hits` of `count`, with the interval of Wilson's score for the true share."""

    hits: int
    count: int

    @classmethod
    def of(cls, rows: Iterable[Row], hit: Callable[[Row], bool]) -> "Share":
        answers = [bool(hit(row)) for row in rows]
        return cls(sum(answers), len(answers))

    def interval(self, z: float = 1.96) -> tuple[float, float]:
        """Lower and upper end; (0, 1) when nothing was counted.

        References
        ----------
        E. B. Wilson, J. Am. Stat. Assoc. 22 (1927) 209-212.
        """
        if not self.count:
            return 0.0, 1.0
        n, p = self.count, self.hits / self.count
        middle = (p + z * z / (2 * n)) / (1 + z * z / n)
        half = z / (1 + z * z / n) * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
        return max(middle - half, 0.0), min(middle + half, 1.0)

    def __str__(self) -> str:
        if not self.count:
            return "none drawn"
        low, high = self.interval()
        return f"{self.hits} of {self.count} = {self.hits / self.count:.0%} (95 %: {low:.0%} to {high:.0%})"


def truths(row: Row) -> list[Row]:
    """What was hidden, (1,) or (2,): each with its cause and parameters."""
    return [row, row["beside"]] if "beside" in row else [row]


def hidden(row: Row) -> str:
    """The hidden causes in words."""
    return " + ".join(truth["cause"] for truth in truths(row))


def kind(row: Row) -> str:
    """ "none", "parameters" (a wrong value of the model's own), "outside" (of the catalogue) or "cause"."""
    if row["cause"] == "none":
        return "none"
    if row.get("outside"):
        return "outside"
    return "parameters" if row["cause"].endswith("_value") else "cause"


def named(row: Row) -> list[str]:
    return [finding["cause"] for finding in row["findings"]]


def said(row: Row) -> str:
    """What the verdict comes down to in a word: the first cause named, the values called wrong, or the verdict.

    Of two hidden effects, all causes named.
    """
    if row["verdict"] == "cause" and row["findings"]:
        return " + ".join(named(row) if "beside" in row else named(row)[:1])
    if row["verdict"] == "parameters" and row["findings"]:
        return "+".join(sorted(named(row)))
    return row["verdict"]


def exact(row: Row) -> bool:
    """Whether the verdict is right; for nothing wrong, or nothing that has a name, an undecided verdict is no error.

    Of two hidden effects, both must be named, in any order, and nothing else.
    """
    if "beside" in row:
        return row["verdict"] == "cause" and sorted(named(row)) == sorted(truth["cause"] for truth in truths(row))
    if kind(row) == "none":
        return row["verdict"] in ("consistent", "undecided")
    if kind(row) == "outside":
        return row["verdict"] in ("unnamed", "undecided")
    if kind(row) == "parameters":
        return row["verdict"] == "parameters" and row["cause"] in named(row)
    return row["verdict"] == "cause" and named(row)[:1] == [row["cause"]]


def in_class(row: Row) -> bool:
    """Whether a cause was named, with the truth first or among the rivals of the first.

    Of two hidden effects, whether two were named, each of them or among its rivals another one of the truths.
    """
    findings = row["findings"][: None if "beside" in row else 1]
    if row["verdict"] != "cause" or len(findings) != len(truths(row)):
        return False
    meant = [{finding["cause"], *(rival["cause"] for rival in finding["rivals"])} for finding in findings]
    causes = [truth["cause"] for truth in truths(row)]
    return any(
        all(cause in one for cause, one in zip(causes, order, strict=True)) for order in itertools.permutations(meant)
    )


def wrong(row: Row) -> list[Row]:
    """Findings that are none of what was hidden."""
    causes = {truth["cause"] for truth in truths(row)}
    return [finding for finding in row["findings"] if finding["cause"] not in causes]


def half(row: Row) -> bool:
    """Whether one of two hidden effects was named, and nothing beside it."""
    return row["verdict"] == "cause" and len(row["findings"]) == 1 and not wrong(row)


def silent(row: Row) -> bool:
    """Whether no effect beyond the model's own values is claimed, with or without a name."""
    return row["verdict"] in ("consistent", "parameters", "undecided")


def confident(row: Row) -> bool:
    return bool(row["findings"]) and row["findings"][0]["probability"] > CONFIDENT


def covers(row: Row) -> dict[str, bool]:
    """For each true number of a rightly named finding, whether its interval holds the truth.

    Of two hidden effects, under the names "cause.number".
    """
    estimates = {finding["cause"]: finding["parameters"] for finding in reversed(row["findings"])}
    return {
        f"{truth['cause']}.{name}" if "beside" in row else name: estimate["low"] <= value <= estimate["high"]
        for truth in truths(row)
        for name, value in truth["parameters"].items()
        # a sensor's channel is a place, not a number
        if isinstance(value, int | float) and (estimate := estimates.get(truth["cause"], {}).get(name))
    }


def confusions(rows: Iterable[Row]) -> list[tuple[str, str, int]]:
    """(truth, said instead, how often), the commonest first."""
    pairs = collections.Counter((hidden(row), said(row)) for row in rows if not exact(row))
    return [(truth, answer, count) for (truth, answer), count in pairs.most_common()]


def table(rows: Sequence[Row]) -> str:
    """The closing table as text. Rows of diagnoses that failed count as wrong answers, and are listed."""
    return _table_of_two(rows) if all("beside" in row for row in rows) else _table_of_one(rows)


def _table_of_one(rows: Sequence[Row]) -> str:
    answered = [row for row in rows if row["error"] is None]
    failed = [row for row in rows if row["error"] is not None]
    causes = [row for row in rows if kind(row) == "cause"]
    quiet = [row for row in rows if kind(row) in ("none", "parameters")]
    outside = [row for row in rows if kind(row) == "outside"]
    unnamed = [row for row in outside if row["verdict"] == "unnamed"]
    inside = [covered for row in answered for covered in covers(row).values()]
    closed = [row["closed"] for row in answered if kind(row) != "none" and row["closed"] is not None]
    sure = [row for row in answered if confident(row)]
    summary = [
        f"challenges                {len(rows)}",
        f"cause named exactly       {Share.of(causes, exact)}",
        f"cause first or a rival    {Share.of(causes, in_class)}",
        f"wrong value named         {Share.of([row for row in rows if kind(row) == 'parameters'], exact)}",
        f"silent where no law is    {Share.of(quiet, silent)}",
        f"  with nothing wrong      {Share.of([row for row in quiet if kind(row) == 'none'], silent)}",
        f"outside: none named       {Share.of(outside, exact)}",
        f"  a map half closes it    {Share.of(unnamed, lambda row: (row['closed'] or 0.0) >= 0.5)}",
        f"intervals that cover      {Share(sum(inside), len(inside))}",
        f"right where p > {CONFIDENT}       {Share.of(sure, exact)}",
        f"closed share, median      {_median(closed)}",
        f"seconds, median           {_median([row['seconds'] for row in answered])}",
    ]
    lists = {
        "taken for another": [f"{count} x {truth} -> {answer}" for truth, answer, count in confusions(answered)],
        f"wrong with p > {CONFIDENT}": [_line(row, row["findings"][0]) for row in sure if not exact(row)],
        "no answer": [f"seed {row['seed']}: {row['cause']}: {row['error']}" for row in failed],
    }
    return _text(summary, lists | _right_by(rows, "cause", "excitation", "channel_set", "noise"))


def _table_of_two(rows: Sequence[Row]) -> str:
    answered = [row for row in rows if row["error"] is None]
    failed = [row for row in rows if row["error"] is not None]
    inside = [covered for row in answered for covered in covers(row).values()]
    closed = [row["closed"] for row in answered if row["closed"] is not None]
    sure = [finding for row in answered for finding in row["findings"] if finding["probability"] > CONFIDENT]
    surely_wrong = [(row, f) for row in answered for f in wrong(row) if f["probability"] > CONFIDENT]
    verdicts = {
        "undecided": "undecided", "left unnamed": "unnamed", "called consistent": "consistent",
        "own values blamed alone": "parameters",
    }  # fmt: skip
    summary = [
        f"pairs                     {len(rows)}",
        f"both named exactly        {Share.of(rows, exact)}",
        f"both named or rivals      {Share.of(rows, in_class)}",
        f"one named, nothing wrong  {Share.of(rows, half)}",
        f"any wrong name            {Share.of(rows, lambda row: bool(wrong(row)))}",
        *(
            f"{name:<26}{Share.of(rows, lambda row, verdict=verdict: row['verdict'] == verdict)}"
            for name, verdict in verdicts.items()
        ),
        f"intervals that cover      {Share(sum(inside), len(inside))}",
        f"names right where p > {CONFIDENT} {Share(len(sure) - len(surely_wrong), len(sure))}",
        f"closed share, median      {_median(closed)}",
        f"seconds, median           {_median([row['seconds'] for row in answered])}",
    ]
    causes = sorted({truth["cause"] for row in rows for truth in truths(row)})
    of_cause = {cause: [row for row in rows if cause in {truth["cause"] for truth in truths(row)}] for cause in causes}
    lists = {
        "said instead": [f"{count} x {truth} -> {answer}" for truth, answer, count in confusions(answered)],
        f"wrong with p > {CONFIDENT}": [_line(row, finding) for row, finding in surely_wrong],
        "no answer": [f"seed {row['seed']}: {hidden(row)}: {row['error']}" for row in failed],
        "named, by cause": [
            f"{cause:<24}{Share.of(of, lambda row, cause=cause: cause in named(row))}" for cause, of in of_cause.items()
        ],
    }
    return _text(summary, lists | _right_by(rows, "excitation", "channel_set", "noise"))


def _right_by(rows: Sequence[Row], *fields: str) -> dict[str, list[str]]:
    lists = {}
    for field in fields:
        values = sorted({row[field] for row in rows})
        shares = [(value, Share.of([row for row in rows if row[field] == value], exact)) for value in values]
        lists[f"right, by {field}"] = [f"{value!s:<24}{share}" for value, share in shares]
    return lists


def _text(summary: Sequence[str], lists: dict[str, list[str]]) -> str:
    blocks = [summary, *([title, *(f"  {entry}" for entry in entries)] for title, entries in lists.items() if entries)]
    return "\n\n".join("\n".join(block) for block in blocks)


def _median(values: Sequence[float]) -> str:
    return f"{statistics.median(values):.3g} (of {len(values)})" if values else "none"


def _line(row: Row, finding: Row) -> str:
    answer = f"{hidden(row)} -> {said(row)}, p = {finding['probability']:.3f}"
    return f"seed {row['seed']}: {answer}, {row['excitation']}, {row['channel_set']}, noise {row['noise']:g}"
