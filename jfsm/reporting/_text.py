"""Terminal text of a diagnosis and of an inspection."""

import io
import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, TextIO, cast

from rich.box import SIMPLE_HEAD
from rich.console import Console, Group, RenderableType
from rich.padding import Padding
from rich.panel import Panel
from rich.table import Table as RichTable
from rich.text import Text

from jfsm._terminal import Spelling
from jfsm.reporting._inspection_tables import consistency_table, inspected_channels_table, periods_table
from jfsm.reporting._shown_units import in_shown_words
from jfsm.reporting._summary import Answer, key_answers
from jfsm.reporting._tables import (
    Table,
    candidates_table,
    findings_table,
    gain_table,
    modes_table,
    refitted_table,
    rivals_table,
)
from jfsm.reporting._wording import checked_verdict, extent

LONGEST_WORD = 16
"""Characters of a name's word that are not cut to make room for a number."""
WORD = re.compile(r"\S+(?: \d+$)?")
"""A word of a name; the number of a channel stays with it."""
TONES = {"good": "green", "change": "cyan", "open": "yellow"}
MOST_CANDIDATES = 8
WIDE = 100
"""Characters in a line from which a candidate's errors and the reason against it are shown; the page has them too."""
WIDER = 115
"""The same for some figures of an inspection."""
FIGURES = ("channel", "unit", "minimum", "maximum", "s.d.", "noise ± error")
AGREEMENT = ("channel", "against", "gain", "late by [samples]")
ESSENTIAL = ("cause", "place", "evidence [nats]", "explains", "probability")


def terminal() -> Console:
    """Standard output; signs that it cannot show are spelt."""
    return Console(file=cast(TextIO, Spelling(sys.stdout)))


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
    console = console or terminal()
    console.print(_diagnosis(d, console.width))


def print_inspection(d: Mapping[str, Any], console: Console | None = None) -> None:
    """Show in the terminal what ``Inspection.to_dict`` returns: channels, and what is odd about them."""
    console = console or terminal()
    console.print(_inspection(d, console.width))


def diagnosis_text(d: Mapping[str, Any], width: int = 100) -> str:
    """The same as `print_diagnosis` shows, as plain text in lines of `width` characters."""
    return plain_text(_diagnosis(d, width), width)


def inspection_text(d: Mapping[str, Any], width: int = 100) -> str:
    """The same as `print_inspection` shows, as plain text in lines of `width` characters."""
    return plain_text(_inspection(d, width), width)


def plain_text(renderable: RenderableType, width: int) -> str:
    """What the terminal would show, without colours, in lines of `width` characters."""
    stream = io.StringIO()
    Console(file=stream, width=width, color_system=None, force_terminal=False).print(renderable)
    return "\n".join(line.rstrip() for line in stream.getvalue().splitlines()) + "\n"


def _diagnosis(d: Mapping[str, Any], width: int) -> Group:
    verdict = checked_verdict(d)
    d = in_shown_words(d)
    colour = TONES[verdict.tone]
    headline = Text.assemble((d.get("sentence") or verdict.meaning, "bold"))
    if d.get("advice"):
        headline.append(f"\n{d['advice']}", style="italic")
    title = Text(f" {verdict.label} ", style=f"bold {colour}")
    return Group(
        Panel(headline, title=title, title_align="left", border_style=colour, padding=(1, 2)),
        answer_grid(key_answers(d)),
        *(rich_table(table) for table in _tables(d, width) if table.rows),
        *bullets("Notes", d.get("notes") or ()),
    )


def _tables(d: Mapping[str, Any], width: int) -> Iterator[Table]:
    findings = d.get("findings") or ()
    yield findings_table(findings)
    yield rivals_table(findings)
    yield gain_table((d.get("gain") or {}).get("channels") or {})
    yield refitted_table(d.get("refitted") or {})
    yield modes_table(d.get("modes") or ())
    candidates = candidates_table((d.get("candidates") or ())[:MOST_CANDIDATES])
    yield candidates if width >= WIDE else candidates.only(*ESSENTIAL)


def answer_grid(answers: Iterable[Answer]) -> RenderableType:
    """Answers under one another, each with what qualifies it."""
    grid = RichTable.grid(padding=(0, 2))
    grid.add_column(style="dim", no_wrap=True)
    grid.add_column()
    for question, answer, details, _ in answers:
        grid.add_row(question, Text.assemble((answer, "bold"), *(f"\n{line}" for line in details)))
    return Padding(grid, (0, 0, 1, 3))


def _inspection(d: Mapping[str, Any], width: int) -> Group:
    d = in_shown_words(d)
    head = Text.assemble((d.get("name") or "Record", "bold"), ("  " + ", ".join(extent(d)), "dim"))
    channels, findings = d.get("channels") or (), d.get("findings") or ()
    figures = inspected_channels_table(channels)
    consistency = consistency_table(d.get("comparisons") or (), channels, d.get("sample_rate"))
    tables = (
        figures if width >= WIDER else figures.only(*FIGURES),
        consistency if width >= WIDER else consistency.only(*AGREEMENT),
        periods_table(d.get("periods") or {}, channels),
    )
    remarks = [f"{found['channel']}: {found['message']}" for found in findings]
    styles = ["yellow" if found["severity"] == "warning" else "" for found in findings]
    return Group(
        head,
        *(rich_table(table) for table in tables if table.rows),
        *(bullets("Remarks", remarks, styles) or [Text("Nothing odd was found.")]),
    )


def rich_table(table: Table) -> RenderableType:
    """A table in the terminal."""
    # Cells are Text: brackets in a name are not markup.
    shown = RichTable(title=Text(table.title, style="bold"), title_justify="left", box=SIMPLE_HEAD)
    for column, heading in enumerate(table.headings):
        cells = [row[column] for row in table.rows] if column in table.text_columns else []
        words = [word for cell in cells for word in WORD.findall(cell)]
        shown.add_column(
            Text(heading),
            justify="left" if column in table.text_columns else "right",
            min_width=min(max(map(len, words), default=0), LONGEST_WORD),
        )
    for row, cells in enumerate(table.rows):
        shown.add_row(*map(Text, cells), style="bold" if row in table.strong else None)
    return shown


def bullets(title: str, lines: Any, styles: Any = ()) -> list[RenderableType]:
    """Lines under a title; nothing where there are none."""
    if not lines:
        return []
    grid = RichTable.grid(padding=(0, 1))
    for row, line in enumerate(lines):
        grid.add_row("•", Text(line, style=styles[row] if styles else ""))
    return [Text(title, style="bold"), Padding(grid, (0, 0, 1, 1))]
