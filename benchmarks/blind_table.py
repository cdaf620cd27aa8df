"""What the rows of the blind examination add up to. A row is the dictionary that `benchmarks/blind.py` writes."""

import collections
import dataclasses
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


def kind(row: Row) -> str:
    """ "none", "parameters" (a wrong value of the model's own) or "cause"."""
    if row["cause"] == "none":
        return "none"
    return "parameters" if row["cause"].endswith("_value") else "cause"


def named(row: Row) -> list[str]:
    return [finding["cause"] for finding in row["findings"]]


def said(row: Row) -> str:
    """What the verdict comes down to in a word: the first cause named, the values called wrong, or the verdict."""
    if row["verdict"] == "cause" and row["findings"]:
        return named(row)[0]
    if row["verdict"] == "parameters" and row["findings"]:
        return "+".join(sorted(named(row)))
    return row["verdict"]


def exact(row: Row) -> bool:
    """Whether the verdict is right; for nothing wrong, an undecided verdict is no error."""
    if kind(row) == "none":
        return row["verdict"] in ("consistent", "undecided")
    if kind(row) == "parameters":
        return row["verdict"] == "parameters" and row["cause"] in named(row)
    return row["verdict"] == "cause" and named(row)[:1] == [row["cause"]]


def in_class(row: Row) -> bool:
    """Whether a cause was named, with the truth first or among the rivals of the first."""
    if row["verdict"] != "cause" or not row["findings"]:
        return False
    first = row["findings"][0]
    return row["cause"] in (first["cause"], *(rival["cause"] for rival in first["rivals"]))


def silent(row: Row) -> bool:
    """Whether no effect beyond the model's own values is claimed, with or without a name."""
    return row["verdict"] in ("consistent", "parameters", "undecided")


def confident(row: Row) -> bool:
    return bool(row["findings"]) and row["findings"][0]["probability"] > CONFIDENT


def covers(row: Row) -> dict[str, bool]:
    """For each true number of a rightly named finding, whether its interval holds the truth."""
    finding = next((finding for finding in row["findings"] if finding["cause"] == row["cause"]), None)
    if finding is None:
        return {}
    estimates = finding["parameters"]
    return {
        name: estimates[name]["low"] <= value <= estimates[name]["high"]
        for name, value in row["parameters"].items()
        if name in estimates and isinstance(value, int | float)  # a sensor's channel is a place, not a number
    }


def confusions(rows: Iterable[Row]) -> list[tuple[str, str, int]]:
    """(truth, said instead, how often), the commonest first."""
    pairs = collections.Counter((row["cause"], said(row)) for row in rows if not exact(row))
    return [(truth, answer, count) for (truth, answer), count in pairs.most_common()]


def table(rows: Sequence[Row]) -> str:
    """The closing table as text. Rows of diagnoses that failed count as wrong answers, and are listed."""
    answered = [row for row in rows if row["error"] is None]
    failed = [row for row in rows if row["error"] is not None]
    causes = [row for row in rows if kind(row) == "cause"]
    quiet = [row for row in rows if kind(row) != "cause"]
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
        f"intervals that cover      {Share(sum(inside), len(inside))}",
        f"right where p > {CONFIDENT}       {Share.of(sure, exact)}",
        f"closed share, median      {_median(closed)}",
        f"seconds, median           {_median([row['seconds'] for row in answered])}",
    ]
    lists = {
        "taken for another": [f"{count} x {truth} -> {answer}" for truth, answer, count in confusions(answered)],
        f"wrong with p > {CONFIDENT}": [_line(row) for row in sure if not exact(row)],
        "no answer": [f"seed {row['seed']}: {row['cause']}: {row['error']}" for row in failed],
    }
    for field in ("cause", "excitation", "channel_set", "noise"):
        values = sorted({row[field] for row in rows})
        shares = [(value, Share.of([row for row in rows if row[field] == value], exact)) for value in values]
        lists[f"right, by {field}"] = [f"{value!s:<24}{share}" for value, share in shares]
    blocks = [summary, *([title, *(f"  {entry}" for entry in entries)] for title, entries in lists.items() if entries)]
    return "\n\n".join("\n".join(block) for block in blocks)


def _median(values: Sequence[float]) -> str:
    return f"{statistics.median(values):.3g} (of {len(values)})" if values else "none"


def _line(row: Row) -> str:
    answer = f"{row['cause']} -> {said(row)}, p = {row['findings'][0]['probability']:.3f}"
    return f"seed {row['seed']}: {answer}, {row['excitation']}, {row['channel_set']}, noise {row['noise']:g}"
