"""One run out of a file that holds several."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from jfsm.records.formats.base import Contents

SHORTEST = 2  # samples of a run
SHOWN = 12  # runs that a message lists

Run = int | str | None


def chosen_run(contents: Contents, source: str, run: Run, sheet: Run) -> tuple[Contents, Run]:
    """The contents of the run and sheet that are asked for, and the run if it is still to be found by the clock.

    Raises
    ------
    ValueError
        If there are several and none is asked for, or there is none of that number or name.
    """
    wanted = {"run": run, "sheet": sheet}
    left = dict(wanted)
    while contents.runs:
        which = contents.runs_are
        place = _place(source, which, wanted[which], [each.title for each in contents.runs])
        contents, left[which] = contents.runs[place], None
    if left["sheet"] is not None and not contents.about.get("sheet"):
        raise ValueError(f"`sheet` is for files with several sheets; {source} has none to choose from. Leave it out.")
    return contents, left["run"]


def run_of_clock(source: str, seconds: NDArray[np.float64], begin: Sequence[int], run: Run) -> slice:
    """The samples of one run where the clock goes back from one to the next; all where it does not.

    Raises
    ------
    ValueError
        As `chosen_run`.
    """
    ends = [*begin[1:], seconds.size]
    if len(begin) == 1 and run is None:
        return slice(None)
    if any(end - start < SHORTEST for start, end in zip(begin, ends, strict=True)):
        return slice(None)  # rows in disorder rather than runs
    titles = [
        f"{end - start} samples, t = {seconds[start]:.6g} to {seconds[end - 1]:.6g} s, from row {start + 1} on"
        for start, end in zip(begin, ends, strict=True)
    ]
    place = _place(source, "run", run, titles)
    return slice(begin[place], ends[place])


def _place(source: str, which: str, wanted: Run, titles: Sequence[str]) -> int:
    """Place of what is wanted, by number from 1 or by title."""
    if wanted in titles:
        return titles.index(str(wanted))
    number = int(wanted) if isinstance(wanted, int) or (isinstance(wanted, str) and wanted.isdigit()) else 0
    if 1 <= number <= len(titles):
        return number - 1
    shown = "; ".join(f"{number} ({title})" for number, title in enumerate(titles[:SHOWN], start=1))
    more = f" and {len(titles) - SHOWN} more" if len(titles) > SHOWN else ""
    asked = "none was asked for" if wanted is None else f"{which} {wanted!r} was asked for"
    raise ValueError(
        f"`{which}` must name one of the {len(titles)} {which}s of {source}, which are {shown}{more}; {asked}. "
        f"Pass {which}=1 or another."
    )
