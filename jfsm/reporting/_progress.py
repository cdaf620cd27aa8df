"""Progress of long work: a bar on a terminal and in a notebook, a line for every stage on a pipe."""

import sys
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn

Told = Callable[[str, int, int], None]
"""Told of every step: what, steps done, steps in all. What is before a colon is the stage."""
_STEPS = 40
"""Steps whose pace tells the time left: some compile for seconds, and the next ones find that done."""


class TimeLeft:
    """The time left by the pace of the last steps, and of the one that is under way."""

    def __init__(self, clock: Callable[[], float] = time.monotonic):
        self._clock, self._left = clock, 0
        self._met = deque([(clock(), 0)], maxlen=_STEPS)

    def told(self, done: int, total: int) -> None:
        """So many steps of so many are done."""
        self._left = total - done
        if done > self._met[-1][1]:
            self._met.append((self._clock(), done))

    @property
    def seconds(self) -> float | None:
        """None before any step is done, or where none is left."""
        (begin, first), (end, last) = self._met[0], self._met[-1]
        if last == first or not self._left:
            return None
        pace, since = (end - begin) / (last - first), self._clock() - end
        if since > pace:  # the one under way takes longer than those before: the others may do, too
            pace = (self._clock() - begin) / (last - first + 1)
            return self._left * pace
        return self._left * pace - since

    def __str__(self) -> str:
        seconds = self.seconds
        if seconds is None:
            return ""
        return f"about {seconds / 60:.0f} min left" if seconds >= 90 else f"about {seconds:.0f} s left"


@contextmanager
def bar(console: Console) -> Iterator[Told]:
    """A function that moves a bar, and is silent where the console is neither a terminal nor a notebook."""
    left = TimeLeft()
    with Progress(
        SpinnerColumn(),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[left]}"),
        TextColumn("{task.description}"),
        console=console,
        transient=True,
        disable=not (console.is_terminal or console.is_jupyter),
        redirect_stdout=sys.stdout.isatty(),  # what is printed for a file or a pipe is no part of the display
    ) as shown:
        task = shown.add_task("", total=None, left="")

        def told(what: str, done: int, total: int) -> None:
            left.told(done, total)
            shown.update(task, description=what, completed=done, total=total, left=left)

        yield told


def stages(say: Callable[[str], None]) -> Told:
    """A function that says every stage, and when it began; nothing of what has one step only."""
    begin, before = time.monotonic(), ""

    def told(what: str, done: int, total: int) -> None:
        nonlocal before
        stage = what.partition(":")[0]
        if stage != before and total > 1:
            before = stage
            say(f"{time.monotonic() - begin:.0f} s: {stage}")

    return told


@contextmanager
def shown_by_default(progress: Told | bool | None) -> Iterator[Told | None]:
    """What is told of progress: a bar where somebody looks at a terminal or a notebook, unless that is said otherwise.

    Parameters
    ----------
    progress : callable, bool or None
        Told itself; False for nothing, True for a bar wherever there is room for one.
    """
    if callable(progress):
        yield progress
        return
    console = Console(stderr=True)
    shown = find_spec("ipywidgets") is not None if console.is_jupyter else sys.stderr.isatty()
    if progress is False or not shown:
        yield None
        return
    with bar(console) as told:
        yield told
