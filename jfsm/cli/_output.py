"""What a command shows in the terminal: progress, tables, words on standard error."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import typer

_PACE = 600.0
"""Seconds over which the time left is judged: one step of a diagnosis may compile for half a minute."""


@contextmanager
def progress() -> Iterator[Callable[[str, int, int], None]]:
    """A function that moves a bar on standard error: what is done, steps done, steps in all. Silent off a terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    with Progress(
        SpinnerColumn(),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.description}"),
        console=console,
        transient=True,
        disable=not console.is_terminal,
        speed_estimate_period=_PACE,
    ) as bar:
        task = bar.add_task("", total=None)

        def tell(what: str, done: int, total: int) -> None:
            bar.update(task, description=what, completed=done, total=total)

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
    Console().print(table)


def say(message: str) -> None:
    """One paragraph on standard error."""
    typer.echo(f"jfsm: {' '.join(message.split())}", err=True)
