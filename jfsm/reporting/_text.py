"""Terminal text of a diagnosis and of an inspection."""

import io
from collections.abc import Iterator, Mapping
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console, Group, RenderableType
from rich.padding import Padding
from rich.panel import Panel
from rich.table import Table as RichTable
from rich.text import Text

from jfsm.reporting._quantities import number
from jfsm.reporting._summary import key_answers
from jfsm.reporting._tables import (
    Table,
    candidates_table,
    findings_table,
    gain_table,
    inspection_table,
    refitted_table,
    rivals_table,
)
from jfsm.reporting._wording import checked_verdict

LONGEST_WORD = 16
"""Characters of a name's word that are not cut to make room for a number."""
TONES = {"good": "green", "change": "cyan", "open": "yellow"}
MOST_CANDIDATES = 8
WIDE = 100
"""Characters in a line from which a candidate's errors and the reason against it are shown; the page has them too."""
ESSENTIAL = ("cause", "place", "evidence [nats]", "explains", "probability")


def print_diagnosis(d: Mapping[str, Any], console: Console | None = None) -> None:
    """Show a diagnosis in the terminal, in colour where it has any.

    Parameters
    ----------
    d : mapping
        What ``Diagnosis.to_json`` writes; parts may be None or missing, except the verdict.
    console : rich.console.Console, optional
        Where to; standard output by default.

    Raises
    ------
    ValueError
        If `d` is not the dictionary of a diagnosis.
    """
    console = console or Console()
    console.print(_diagnosis(d, console.width))


def print_inspection(d: Mapping[str, Any], console: Console | None = None) -> None:
    """Show in the terminal what ``Inspection.to_dict`` returns: channels, and what is odd about them."""
    (console or Console()).print(_inspection(d))


def diagnosis_text(d: Mapping[str, Any], width: int = 100) -> str:
    """The same as `print_diagnosis` shows, as plain text in lines of `width` characters."""
    return _plain(_diagnosis(d, width), width)


def inspection_text(d: Mapping[str, Any], width: int = 100) -> str:
    """The same as `print_inspection` shows, as plain text in lines of `width` characters."""
    return _plain(_inspection(d), width)


def _plain(renderable: RenderableType, width: int) -> str:
    stream = io.StringIO()
    Console(file=stream, width=width, color_system=None, force_terminal=False).print(renderable)
    return "\n".join(line.rstrip() for line in stream.getvalue().splitlines()) + "\n"


def _diagnosis(d: Mapping[str, Any], width: int) -> Group:
    verdict = checked_verdict(d)
    colour = TONES[verdict.tone]
    headline = Text.assemble((d.get("sentence") or verdict.meaning, "bold"))
    if d.get("advice"):
        headline.append(f"\n{d['advice']}", style="italic")
    title = Text(f" {verdict.label} ", style=f"bold {colour}")
    return Group(
        Panel(headline, title=title, title_align="left", border_style=colour, padding=(1, 2)),
        _answers(d),
        *(_rich_table(table) for table in _tables(d, width) if table.rows),
        *_bullets("Notes", d.get("notes") or ()),
    )


def _tables(d: Mapping[str, Any], width: int) -> Iterator[Table]:
    findings = d.get("findings") or ()
    yield findings_table(findings)
    yield rivals_table(findings)
    yield gain_table((d.get("gain") or {}).get("channels") or {})
    yield refitted_table(d.get("refitted") or {})
    candidates = candidates_table((d.get("candidates") or ())[:MOST_CANDIDATES], findings)
    yield candidates if width >= WIDE else candidates.only(*ESSENTIAL)


def _answers(d: Mapping[str, Any]) -> RenderableType:
    grid = RichTable.grid(padding=(0, 2))
    grid.add_column(style="dim", no_wrap=True)
    grid.add_column()
    for question, answer, details, _ in key_answers(d):
        grid.add_row(question, Text.assemble((answer, "bold"), *(f"\n{line}" for line in details)))
    return Padding(grid, (0, 0, 1, 3))


def _inspection(d: Mapping[str, Any]) -> Group:
    figures = [
        f"{d['samples']} samples" if d.get("samples") is not None else "",
        f"{number(d['duration'], 4)} s" if d.get("duration") is not None else "",
        f"{number(d['sample_rate'], 5)} Hz" if d.get("sample_rate") is not None else "",
    ]
    head = Text.assemble((d.get("name") or "Record", "bold"), ("  " + ", ".join(filter(None, figures)), "dim"))
    findings = d.get("findings") or ()
    remarks = [f"{found['channel']}: {found['message']}" for found in findings]
    styles = ["yellow" if found["severity"] == "warning" else "" for found in findings]
    return Group(
        head,
        *(_rich_table(table) for table in (inspection_table(d.get("channels") or ()),) if table.rows),
        *(_bullets("Remarks", remarks, styles) or [Text("Nothing odd was found.")]),
    )


def _rich_table(table: Table) -> RenderableType:
    # Cells are Text: brackets in a name are not markup.
    shown = RichTable(title=Text(table.title, style="bold"), title_justify="left", box=SIMPLE_HEAD)
    for column, heading in enumerate(table.headings):
        words = " ".join(row[column] for row in table.rows).split() if column in table.text_columns else []
        shown.add_column(
            Text(heading),
            justify="left" if column in table.text_columns else "right",
            min_width=min(max(map(len, words), default=0), LONGEST_WORD),
        )
    for row, cells in enumerate(table.rows):
        shown.add_row(*map(Text, cells), style="bold" if row in table.strong else None)
    return shown


def _bullets(title: str, lines: Any, styles: Any = ()) -> list[RenderableType]:
    if not lines:
        return []
    grid = RichTable.grid(padding=(0, 1))
    for row, line in enumerate(lines):
        grid.add_row("•", Text(line, style=styles[row] if styles else ""))
    return [Text(title, style="bold"), Padding(grid, (0, 0, 1, 1))]
