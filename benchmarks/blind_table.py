"""What the rows of the blind examination add up to. A row is the dictionary that `benchmarks/blind.py` writes.

Where two effects were hidden, the second stands under "beside". Where there were two masses it says "chain", and the
place counts by itself.
"""

import collections
import dataclasses
import itertools
import math
import statistics
from collections.abc import Callable, Iterable, Sequence
from typing import TypeVar

from benchmarks.rows import Row

Counted = TypeVar("Counted")

CONFIDENT = 0.9
TWINS = (
    frozenset({"quadratic_damping", "cubic_damping", "power_damping"}),
    frozenset({"cubic_hardening", "cubic_softening", "sine_stiffness", "square_stiffness"}),
    frozenset({"coulomb", "smooth_coulomb"}),
    frozenset({"position_damping", "van_der_pol"}),
    frozenset({"force_delay", "channel_delay"}),
)
"""Causes that narrow-band motion does not separate; delays have no other meaning than that between two channels."""
_SETS_OF_MANY = ("xva", "xx", "aa")
"""Channel sets in which a delay of the force and one of a channel are told apart by the other channels."""
BINS = 10


@dataclasses.dataclass(frozen=True)
class Share:
    """`hits` of `count`, with the interval of Wilson's score for the true share."""

    hits: int
    count: int

    @classmethod
    def of(cls, counted: Iterable[Counted], hit: Callable[[Counted], bool]) -> "Share":
        answers = [bool(hit(one)) for one in counted]
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


def spot(row: Row) -> tuple[str, str]:
    """Where the cause is in a chain, and where the first finding has it, in words; nothing to be said of one mass."""
    if not row.get("chain"):
        return "", ""
    return _spot(row["at"]), _spot(row["findings"][0]["at"]) if row["findings"] else ""


def _spot(at: Sequence[int | str]) -> str:
    return "at " + "-".join(map(str, at)) if at else ""


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


def placed(row: Row) -> bool:
    """Whether the first finding is at the cause's place, or one of the findings at that of a wrong value."""
    if kind(row) == "parameters":
        return any(finding["cause"] == row["cause"] and finding["at"] == row["at"] for finding in row["findings"])
    return bool(row["findings"]) and row["findings"][0]["at"] == row["at"]


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

    Of two hidden effects, under the names "cause.number". In a chain a finding elsewhere has no such numbers.
    """
    findings = [finding for finding in row["findings"] if not row.get("chain") or finding["at"] == row["at"]]
    estimates = {finding["cause"]: finding["parameters"] for finding in reversed(findings)}
    return {
        f"{truth['cause']}.{name}" if "beside" in row else name: estimate["low"] <= value <= estimate["high"]
        for truth in truths(row)
        for name, value in truth["parameters"].items()
        # a sensor's channel is a place, not a number
        if isinstance(value, int | float) and (estimate := estimates.get(truth["cause"], {}).get(name))
    }


def twins(row: Row) -> frozenset[str]:
    """The hidden cause and those that such records need not separate from it; none where it has no twin."""
    found = next((twins for twins in TWINS if row["cause"] in twins), frozenset())
    return frozenset() if "force_delay" in found and row["channel_set"] in _SETS_OF_MANY else found


def right_class(row: Row) -> bool:
    """Whether the hidden cause or a twin of it was named first."""
    return row["verdict"] == "cause" and named(row)[:1] != [] and named(row)[0] in twins(row) | {row["cause"]}


def right_family(row: Row) -> bool:
    """Whether what was named first is of the hidden cause's family."""
    import jfsm  # not where rows are only counted

    causes = jfsm.causes()
    return row["verdict"] == "cause" and causes[named(row)[0]].family == causes[row["cause"]].family


def group(row: Row) -> int:
    """How many causes the verdict leaves: the first one and its rivals."""
    return 1 + len(row["findings"][0]["rivals"])


def calibration(rows: Iterable[Row]) -> list[tuple[float, Share]]:
    """Mean probability of the first findings and how many of them were right, by tenths of the probability."""
    bins: dict[int, list[Row]] = collections.defaultdict(list)
    for row in rows:
        if row["findings"]:
            bins[min(int(row["findings"][0]["probability"] * BINS), BINS - 1)].append(row)
    return [
        (statistics.fmean(row["findings"][0]["probability"] for row in bins[k]), Share.of(bins[k], exact))
        for k in sorted(bins)
    ]


def calibration_error(rows: Iterable[Row]) -> float:
    """Expected calibration error: mean distance of the shares from the probabilities, weighted by their counts."""
    points = calibration(rows)
    count = sum(share.count for _, share in points)
    return sum(abs(share.hits - p * share.count) for p, share in points) / count if count else math.nan


def confusions(rows: Iterable[Row]) -> list[tuple[str, str, int]]:
    """(truth, said instead, how often), the commonest first."""
    pairs = collections.Counter((hidden(row), said(row)) for row in rows if not exact(row))
    return [(truth, answer, count) for (truth, answer), count in pairs.most_common()]


def figures(rows: Sequence[Row]) -> dict[str, Share | float]:
    """Every figure by its name: counts with their intervals, or numbers, NaN where there is nothing to count."""
    return _figures_of_two(rows) if all("beside" in row for row in rows) else _figures_of_one(rows)


def _figures_of_one(rows: Sequence[Row]) -> dict[str, Share | float]:
    answered = [row for row in rows if row["error"] is None]
    causes = [row for row in rows if kind(row) == "cause"]
    quiet = [row for row in rows if kind(row) in ("none", "parameters")]
    outside = [row for row in rows if kind(row) == "outside"]
    unnamed = [row for row in outside if row["verdict"] == "unnamed" and row["closed"] is not None]
    inside = [covered for row in answered for covered in covers(row).values()]
    closed = [row["closed"] for row in answered if kind(row) == "cause" and row["closed"] is not None]
    alike = [row for row in causes if twins(row)]
    return {
        "challenges": len(rows),
        "cause named exactly": Share.of(causes, exact),
        "  of those without twin": Share.of([row for row in causes if not twins(row)], exact),
        "  twins: one of them": Share.of(alike, right_class),
        "  twins: first or a rival": Share.of(alike, in_class),
        "  twins: mean group": _mean([group(row) for row in alike if row["verdict"] == "cause"]),
        "cause first or a rival": Share.of(causes, in_class),
        "family named": Share.of(causes, right_family),
        **_figures_of_places([row for row in rows if row.get("chain")]),
        "wrong value named": Share.of([row for row in rows if kind(row) == "parameters"], exact),
        "silent where no law is": Share.of(quiet, silent),
        "  with nothing wrong": Share.of([row for row in quiet if kind(row) == "none"], silent),
        "outside: none named": Share.of(outside, exact),
        "  a map half closes it": Share.of(unnamed, lambda row: row["closed"] >= 0.5),
        "intervals that cover": Share(sum(inside), len(inside)),
        f"right where p > {CONFIDENT}": Share.of([row for row in answered if confident(row)], exact),
        "calibration error": calibration_error(answered),
        "closed share, median": _median(closed),
        "  above 0.9": Share.of(closed, lambda share: share > 0.9),
        "seconds, median": _median([row["seconds"] for row in answered]),
    }


def _figures_of_places(rows: Sequence[Row]) -> dict[str, Share | float]:
    """Where there were two masses: whether the place is right; nothing where there were none."""
    if not rows:
        return {}
    causes, values = ([row for row in rows if kind(row) == one] for one in ("cause", "parameters"))
    return {
        "cause named at its place": Share.of(causes, lambda row: exact(row) and placed(row)),
        "  place, cause right": Share.of([row for row in causes if exact(row)], placed),
        "  place, family right": Share.of([row for row in causes if right_family(row)], placed),
        "  place, value right": Share.of([row for row in values if exact(row)], placed),
    }


def _figures_of_two(rows: Sequence[Row]) -> dict[str, Share | float]:
    answered = [row for row in rows if row["error"] is None]
    inside = [covered for row in answered for covered in covers(row).values()]
    sure = sum(finding["probability"] > CONFIDENT for row in answered for finding in row["findings"])
    verdicts = {
        "undecided": "undecided", "left unnamed": "unnamed", "called consistent": "consistent",
        "own values blamed alone": "parameters",
    }  # fmt: skip
    return {
        "pairs": len(rows),
        "both named exactly": Share.of(rows, exact),
        "both named or rivals": Share.of(rows, in_class),
        "one named, nothing wrong": Share.of(rows, half),
        "any wrong name": Share.of(rows, lambda row: bool(wrong(row))),
        **{
            name: Share.of(rows, lambda row, verdict=verdict: row["verdict"] == verdict)
            for name, verdict in verdicts.items()
        },
        "intervals that cover": Share(sum(inside), len(inside)),
        f"names right where p > {CONFIDENT}": Share(sure - len(_surely_wrong(answered)), sure),
        "closed share, median": _median([row["closed"] for row in answered if row["closed"] is not None]),
        "seconds, median": _median([row["seconds"] for row in answered]),
    }


def _surely_wrong(answered: Sequence[Row]) -> list[tuple[Row, Row]]:
    """Rows with those of their findings that are wrong and confident."""
    return [(row, finding) for row in answered for finding in wrong(row) if finding["probability"] > CONFIDENT]


def table(rows: Sequence[Row]) -> str:
    """The closing table as text. Rows of diagnoses that failed count as wrong answers, and are listed."""
    of_two = all("beside" in row for row in rows)
    summary = [f"{name:<26}{_said_of(figure)}" for name, figure in figures(rows).items()]
    return _text(summary, _lists_of_two(rows) if of_two else _lists_of_one(rows))


def _lists_of_one(rows: Sequence[Row]) -> dict[str, list[str]]:
    answered = [row for row in rows if row["error"] is None]
    failed = [row for row in rows if row["error"] is not None]
    sure = [row for row in answered if confident(row)]
    lists = {
        "taken for another": [f"{count} x {truth} -> {answer}" for truth, answer, count in confusions(answered)],
        f"wrong with p > {CONFIDENT}": [_line(row, row["findings"][0]) for row in sure if not exact(row)],
        "no answer": [f"seed {row['seed']}: {row['cause']}: {row['error']}" for row in failed],
    }
    return lists | _right_by(rows, "cause", "excitation", "channel_set", "noise")


def _lists_of_two(rows: Sequence[Row]) -> dict[str, list[str]]:
    answered = [row for row in rows if row["error"] is None]
    failed = [row for row in rows if row["error"] is not None]
    causes = sorted({truth["cause"] for row in rows for truth in truths(row)})
    of_cause = {cause: [row for row in rows if cause in {truth["cause"] for truth in truths(row)}] for cause in causes}
    lists = {
        "said instead": [f"{count} x {truth} -> {answer}" for truth, answer, count in confusions(answered)],
        f"wrong with p > {CONFIDENT}": [_line(row, finding) for row, finding in _surely_wrong(answered)],
        "no answer": [f"seed {row['seed']}: {hidden(row)}: {row['error']}" for row in failed],
        "named, by cause": [
            f"{cause:<24}{Share.of(of, lambda row, cause=cause: cause in named(row))}" for cause, of in of_cause.items()
        ],
    }
    return lists | _right_by(rows, "excitation", "channel_set", "noise")


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


def _median(values: Sequence[float]) -> float:
    return statistics.median(values) if values else math.nan


def _mean(values: Sequence[float]) -> float:
    return statistics.fmean(values) if values else math.nan


def _said_of(figure: Share | float) -> str:
    if isinstance(figure, Share):
        return str(figure)
    return "none" if math.isnan(figure) else f"{figure:.3g}"


def _line(row: Row, finding: Row) -> str:
    truth, answer = (f"{words} {at}".rstrip() for words, at in zip((hidden(row), said(row)), spot(row), strict=True))
    answer = f"{truth} -> {answer}, p = {finding['probability']:.3f}"
    return f"seed {row['seed']}: {answer}, {row['excitation']}, {row['channel_set']}, noise {row['noise']:g}"
