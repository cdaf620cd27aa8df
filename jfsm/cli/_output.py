"""What a command shows in the terminal: progress, tables, words on standard error."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import typer


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
    Console().print(table)


def say(message: str) -> None:
    """One paragraph on standard error."""
    typer.echo(f"jfsm: {' '.join(message.split())}", err=True)
