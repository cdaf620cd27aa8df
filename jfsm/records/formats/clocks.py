"""When the samples of a file were taken."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from jfsm.records.formats.base import Contents
from jfsm.records.formats.lookup import Choice, choose, listed, samples_of

TIME_NAMES = ("time", "t")
RATE_NAMES = ("fs", "sample_rate")  # Hz
STEP_NAMES = ("dt",)  # s


def clock_of(
    contents: Contents, source: str, chosen: Sequence[Choice], time: str | None, rate: float | None
) -> tuple[NDArray[np.float64], Choice | None]:
    """Instants, and the column they come from (None when they are counted or a channel's own).

    A name is first looked for beside the channels, in their group or struct, then at the top.

    Raises
    ------
    ValueError
        If nothing says when the samples were taken, the channels have clocks that differ, or `rate` is not positive.
    """
    if time is not None and rate is not None:
        raise ValueError(f"`time` and `rate` cannot both be given; they were {time!r} and {rate}. Leave one out.")
    if time is not None:
        column = choose(contents, source, "time", time)
        return samples_of(contents, source, column), column
    if rate is None:
        common = _common(contents, source, chosen)
        if common is not None:
            return common, None
        for name in _found(contents, chosen, TIME_NAMES, single=False):
            column = choose(contents, source, "time", name)
            return samples_of(contents, source, column), column
        for name in _found(contents, chosen, RATE_NAMES, single=True)[:1]:
            rate = float(np.asarray(contents.arrays[name]).item())
        for name in _found(contents, chosen, STEP_NAMES, single=True)[:1] if rate is None else ():
            rate = 1.0 / float(np.asarray(contents.arrays[name]).item())
    if rate is None:
        raise ValueError(
            f"{source} must say when its samples were taken; it holds {listed(contents.arrays)}. "
            f'Pass time="..." or rate=... [Hz].'
        )
    if not (np.isfinite(rate) and rate > 0):
        raise ValueError(f"`rate` must be a positive number of samples per second; it was {rate}. Pass rate=... [Hz].")
    size = samples_of(contents, source, chosen[0]).shape[0] if chosen else 0
    return np.arange(size) / rate, None


def _common(contents: Contents, source: str, chosen: Sequence[Choice]) -> NDArray[np.float64] | None:
    """The clock that all channels share, None if they have none of their own."""
    first: tuple[str, NDArray[np.float64]] | None = None
    for choice in chosen:
        if choice.array not in contents.clocks:
            continue
        clock = contents.clocks[choice.array]
        if first is None:
            first = choice.array, clock
        elif not np.array_equal(first[1], clock):
            raise ValueError(
                f"{source} must have channels of one clock to make one record; {first[0]!r} {_described(first[1])}, "
                f"{choice.array!r} {_described(clock)}. Read them into a record each, and bring these to one clock by "
                f"jfsm.align(records); or pass rate=... [Hz] if the file is wrong."
            )
    return None if first is None else first[1]


def _described(clock: NDArray[np.float64]) -> str:
    if clock.size < 2:
        return f"has {clock.size} samples"
    return f"has {clock.size} samples from {clock[0]:.9g} to {clock[-1]:.9g} s"


def _found(contents: Contents, chosen: Sequence[Choice], names: Iterable[str], single: bool) -> list[str]:
    """Names of arrays called so, in any case of letters: single numbers, or columns."""
    lower = {name.lower(): name for name in reversed(list(contents.arrays))}
    beside = [
        choice.array[: max(choice.array.rfind("/"), choice.array.rfind(".")) + 1].lower() for choice in chosen[:1]
    ]
    present = [lower[before + name] for before in (*beside, "") for name in names if before + name in lower]
    return [name for name in dict.fromkeys(present) if (np.size(contents.arrays[name]) == 1) == single]
