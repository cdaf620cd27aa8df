"""Why a verdict came out as it did: the checks that decided, from the log of a decision."""

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console, Group, RenderableType
from rich.table import Table as RichTable
from rich.text import Text

from jfsm.reporting._checks import (
    OPEN,
    became,
    checks_of,
    decision_of,
    decisive_checks,
    failed,
    hypothesis_name,
    nearest,
    nearest_lines,
    probability_line,
    stopping_line,
    typeset,
)
from jfsm.reporting._text import plain_text, terminal

Dictionary = Mapping[str, Any]

MOST_SHOWN = 4
"""Hypotheses with one cause that are shown in words; the JSON has all."""


def print_why(d: Dictionary, cause: str | None = None, console: Console | None = None) -> None:
    """Show in the terminal why the verdict came out, or what became of a cause."""
    (console or terminal()).print(_why(d, cause))


def why_text(d: Dictionary, cause: str | None = None, width: int = 100) -> str:
    """The same as `print_why` shows, as plain text."""
    return plain_text(_why(d, cause), width)


def why_lines(d: Dictionary) -> list[str]:
    """What stopped a verdict, the nearest law where none is named, and how the probability came about."""
    decision = decision_of(d)
    about = nearest(d) if d["verdict"] in OPEN else decision.get("winner", "")
    return [*filter(None, (stopping_line(decision), *nearest_lines(d), probability_line(d, about)))]


def _why(d: Dictionary, cause: str | None) -> RenderableType:
    if cause is None:
        return Group(*map(Text, (f"Verdict: {d['verdict']}.", *why_lines(d))), *_in_groups(d, decisive_checks(d)))
    found = checks_of(d, cause)
    shown: list[RenderableType] = []
    for key, rows in list(found.items())[:MOST_SHOWN]:
        head = ": ".join(filter(None, (hypothesis_name(key), became(d, key))))
        shown += [Text(f"\n{head}", style="bold"), *map(Text, filter(None, [probability_line(d, key)]))]
        shown.append(_list(rows, decision_of(d)) if rows else Text("  No check was made of it alone.", style="dim"))
    if len(found) > MOST_SHOWN:
        shown.append(Text(f"\n{len(found) - MOST_SHOWN} more with another effect beside it are in the JSON."))
    return Group(*shown)


def _in_groups(d: Dictionary, rows: Sequence[Dictionary]) -> list[RenderableType]:
    """Checks under the name of what they are of."""
    shown: list[RenderableType] = []
    for of, group in itertools.groupby(rows, key=lambda row: row["of"]):
        shown += [Text(f"\n{hypothesis_name(of)}", style="bold"), _list(list(group), decision_of(d))]
    return shown


def _list(rows: Sequence[Dictionary], decision: Dictionary) -> RenderableType:
    """Checks as lines: outcome, name, finding."""
    grid = RichTable.grid(padding=(0, 1))
    for row in rows:
        mark, style = ("✗", "bold yellow") if failed(row, decision) else ("✓" if row["passed"] else "·", "")
        grid.add_row(
            Text(f"  {mark}", style=style), Text(row["name"], style="dim"), Text(typeset(row["says"]), style=style)
        )
    return grid
