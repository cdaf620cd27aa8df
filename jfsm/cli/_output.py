"""What a command shows in the terminal: progress, tables, words on standard error."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

import typer

from ._input import in_options

if TYPE_CHECKING:
    from ..records import Listing

PADDING, NARROWEST = 3, 16  # characters around a cell of a table, and in its last column


@contextmanager
def progress() -> Iterator[Callable[[str, int, int], None]]:
    """A function that shows on standard error what is done, steps done, steps in all.

    A bar on a terminal, a line for every stage on a pipe.
    """
    from rich.console import Console

    from ..reporting import bar, stages

    console = Console(stderr=True)
    if not console.is_terminal:
        yield stages(say)
        return
    with bar(console) as tell:
        yield tell


def show_table(title: str, headings: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """A table on standard output, whose last column may wrap."""
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(title=title, title_justify="left", box=SIMPLE_HEAD)
    for heading in headings[:-1]:
        table.add_column(heading, no_wrap=True)
    table.add_column(headings[-1])
    for row in rows:
        table.add_row(*(Text(cell) for cell in row))  # as text: a bracket in a unit or an interval is not markup
    console = Console()
    widths = (max(map(len, column)) for column in zip(headings[:-1], *(row[:-1] for row in rows), strict=True))
    needed = sum(width + PADDING for width in widths) + NARROWEST
    Console(width=max(console.width, needed)).print(table, crop=False)  # longer names are for the terminal to wrap


def say(message: str) -> None:
    """One paragraph on standard error."""
    typer.echo(f"jfsm: {' '.join(message.split())}", err=True)


@contextmanager
def said_in_options() -> Iterator[None]:
    """What is shown meanwhile names options of the command line, no arguments of Python."""
    from ..reporting import said_as

    with said_as(in_options):
        yield


def show_listing(found: "Listing", proposal: str) -> None:
    """The channels of a file of which nothing was asked for, and how to go on."""
    rows = [
        (
            f"{channel.number or '-'}",
            channel.name,
            channel.unit or "-",
            channel.kind.replace("_", " ") or "-",
            f"{channel.samples}",
            "-" if channel.rate is None else f"{channel.rate:.6g}",
            "-" if channel.duration is None else f"{channel.duration:.6g}",
            f"{channel.lowest:.4g} to {channel.highest:.4g}" if channel.lowest <= channel.highest else "gaps alone",
        )
        for channel in found.channels
    ]
    headings = ("no.", "channel", "unit", "may be", "samples", "rate [Hz]", "seconds", "range")
    show_table(f"{found.source} does not say which channel is what; it holds", headings, rows)
    for words in (*found.notes, *filter(None, [found.clock])):
        typer.echo(f"  {in_options(words)}")
    typer.echo(f"To go on: {proposal}")
    if not found.proposed:
        typer.echo("Add --force NAME, --displacement NAME and the like; channels go by number, too.")
