"""Why a verdict came out as it did: the checks that decided, from the log of a decision."""

import difflib
import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console, Group, RenderableType
from rich.table import Table as RichTable
from rich.text import Text

from jfsm.reporting._quantities import number, percent
from jfsm.reporting._tables import Table
from jfsm.reporting._text import plain_text
from jfsm.reporting._wording import cause_name, place_name

Dictionary = Mapping[str, Any]

MODEL, GIVEN, REFITTED = "model", "given", "refitted"
MAP = " with a map"
MOST_SHOWN = 4
"""Hypotheses with one cause that are shown in words; the JSON has all."""
STAGES = {
    "searched": "searched", "sensors": "sensors", "detected": "something is wrong", "admissible": "admissible",
    "named": "named", "sufficient": "sufficient", "confirmed": "held-out readings",
}  # fmt: skip


def decisive_checks(d: Dictionary) -> list[Dictionary]:
    """The checks that the verdict rests on, in the order of the stages.

    Those of the model and of the hypothesis that the verdict rests on; where nothing is decided, those of the one that
    was stopped, the check that stopped it last.
    """
    decision = d.get("decision") or {}
    stopped = decision.get("stopped_by")
    about = {MODEL, decision.get("winner", "").removesuffix(MAP), *_looked_at(decision)}
    if stopped is not None:
        about.add(stopped["of"])
    last = {(row["name"], row["of"]): row for row in decision.get("checks") or () if row["of"] in about}
    rows = [row for row in last.values() if row != stopped and not (row["stage"] == "sensors" and row["passed"])]
    rows.sort(key=lambda row: (row["of"] != MODEL, row["of"]))
    return [*rows, *([stopped] if stopped is not None else [])]


def checks_of(d: Dictionary, cause: str) -> dict[str, list[Dictionary]]:
    """The checks of every hypothesis with a cause, by its key, the likeliest first; single effects before pairs.

    `cause` is an id, or the key of a hypothesis: ``given``, ``refitted``, ``coulomb@0-1``.

    Raises
    ------
    LookupError
        If no hypothesis has it; the message names those that come close.
    """
    decision = d.get("decision") or {}
    reasons, factors = decision.get("reasons") or {}, decision.get("factors") or {}
    keys = dict.fromkeys([*(row["of"] for row in decision.get("checks") or ()), *reasons, *factors])
    chosen = [key for key in keys if key == cause or cause in _causes(key)]
    if not chosen:
        known = sorted({one for key in keys for one in _causes(key)} | {GIVEN, REFITTED})
        close = difflib.get_close_matches(cause, known, 3) or known
        raise LookupError(f"No hypothesis with `{cause}` is in this verdict. There are {', '.join(close)}.")
    chosen.sort(key=lambda key: (key.count("+"), -_probability(factors.get(key) or ())))
    return {key: [row for row in decision.get("checks") or () if row["of"] == key] for key in chosen}


def checks_table(rows: Sequence[Dictionary], title: str) -> Table:
    """Checks as a table: stage, of which hypothesis, what was found, the limit, and the outcome."""
    cells = tuple(
        (
            STAGES[row["stage"]],
            hypothesis_name(row["of"]),
            row["says"],
            _measured(row),
            "passed" if row["passed"] else "failed",
        )
        for row in rows
    )
    failed = frozenset(k for k, row in enumerate(rows) if not row["passed"])
    return Table(title, ("stage", "of", "finding", "measured", "outcome"), cells, frozenset({0, 1, 2, 4}), failed)


def probability_line(d: Dictionary, key: str) -> str:
    """The probability of a hypothesis as the product of its factors; empty for one that is no alternative."""
    factors = ((d.get("decision") or {}).get("factors") or {}).get(key) or ()
    if not factors:
        return ""
    product = " × ".join(f"{_share(factor)} ({factor['name']})" for factor in factors)
    return f"Probability {percent(_probability(factors))} = {product}"


def hypothesis_name(key: str) -> str:
    """A key in words."""
    if key in (MODEL, GIVEN, REFITTED):
        return {MODEL: "the model", GIVEN: "the model as given", REFITTED: "the model refitted"}[key]
    if key.endswith(MAP):
        return f"{hypothesis_name(key.removesuffix(MAP))}, with a map"
    return " and ".join(_effect_name(part) for part in key.split("+"))


def print_why(d: Dictionary, cause: str | None = None, console: Console | None = None) -> None:
    """Show in the terminal why the verdict came out, or what became of a cause."""
    (console or Console()).print(_why(d, cause))


def why_text(d: Dictionary, cause: str | None = None, width: int = 100) -> str:
    """The same as `print_why` shows, as plain text."""
    return plain_text(_why(d, cause), width)


def stopping_line(decision: Dictionary) -> str:
    """The check that left a decision open, and what would have let it pass; empty for any other."""
    stopped = decision.get("stopped_by")
    if stopped is None:
        return ""
    return f"Stopped by the check `{stopped['name']}` of {hypothesis_name(stopped['of'])}: {stopped['says']}."


def _why(d: Dictionary, cause: str | None) -> RenderableType:
    if cause is None:
        decision = d.get("decision") or {}
        lines = [f"Verdict: {d['verdict']}.", stopping_line(decision), probability_line(d, decision.get("winner", ""))]
        return Group(*map(Text, filter(None, lines)), *_in_groups(decisive_checks(d)))
    found, reasons = checks_of(d, cause), (d.get("decision") or {}).get("reasons") or {}
    shown: list[RenderableType] = []
    for key, rows in list(found.items())[:MOST_SHOWN]:
        named = key == (d.get("decision") or {}).get("winner")
        became = "named" if named and d["verdict"] == "cause" else reasons.get(key) or "the verdict rests on it"
        shown += [
            Text(f"\n{hypothesis_name(key)}: {became}", style="bold"),
            Text(probability_line(d, key)),
            _list(rows),
        ]
    if len(found) > MOST_SHOWN:
        shown.append(Text(f"\n{len(found) - MOST_SHOWN} more with another effect beside it are in the JSON."))
    return Group(*shown)


def _in_groups(rows: Sequence[Dictionary]) -> list[RenderableType]:
    """Checks under the name of what they are of."""
    shown: list[RenderableType] = []
    for of, group in itertools.groupby(rows, key=lambda row: row["of"]):
        shown += [Text(f"\n{hypothesis_name(of)}", style="bold"), _list(list(group))]
    return shown


def _list(rows: Sequence[Dictionary]) -> RenderableType:
    """Checks as lines: outcome, name, finding."""
    grid = RichTable.grid(padding=(0, 1))
    for row in rows:
        mark, style = ("✓", "") if row["passed"] else ("✗", "bold yellow")
        grid.add_row(Text(f"  {mark}", style=style), Text(row["name"], style="dim"), Text(row["says"], style=style))
    return grid


def _causes(key: str) -> list[str]:
    return [part.split("@")[0] for part in key.removesuffix(MAP).split("+") if "@" in part]


def _looked_at(decision: Dictionary) -> set[str]:
    """Channels that a look showed something of."""
    return {row["of"] for row in decision.get("checks") or () if row["stage"] == "sensors" and not row["passed"]}


def _effect_name(part: str) -> str:
    if "@" not in part:  # a channel, or the record
        return part
    cause, _, place = part.partition("@")
    if ":" in place:
        kind, j = place.split(":")
        return f"{cause_name(cause)} of {kind} {j}"
    return f"{cause_name(cause)} at {place_name(tuple(int(end) for end in place.split('-')))}"


def _measured(row: Dictionary) -> str:
    return f"{number(float(row['measured']), 4)} {row['relation']} {number(float(row['threshold']), 4)}"


def _probability(factors: Sequence[Dictionary]) -> float:
    return math.prod(float(factor["size"]) for factor in factors) if factors else 0.0


def _share(factor: Dictionary) -> str:
    return number(float(factor["size"]), 3)
