"""What a file holds, before anyone has said what its channels mean: names, units, clocks, and what they may be."""

import contextlib
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from jfsm.records._sources import opened
from jfsm.records._units import KINDS, find_unit
from jfsm.records.formats.base import Contents
from jfsm.records.formats.clocks import clock_of
from jfsm.records.formats.lookup import Choice, own_names
from jfsm.records.formats.runs import Run, chosen_run

_WORDS = {
    "force": r"force|load|kraft|last|hammer|impulse|f|u",
    "displacement": r"disp\w*|weg|lvdt|position|pos|stroke|deflection|x|y",
    "velocity": r"vel\w*|geschw\w*|speed|v",
    "acceleration": r"acc\w*|beschl\w*|imu|a",
}
_NAMES = {kind: re.compile(rf"(?:^|[^a-z])(?:{words})\d*(?:$|[^a-z])", re.IGNORECASE) for kind, words in _WORDS.items()}
_QUANTITIES = {
    "force": ("force", "torque"),
    "displacement": ("length", "angle"),
    "velocity": ("speed", "rotation_rate"),
    "acceleration": ("acceleration", "rotation_acceleration"),
}


@dataclass(frozen=True)
class ListedChannel:
    """One channel of a file.

    Attributes
    ----------
    name : str
        As it must be given.
    unit : str
        As the file states it; empty if it does not.
    kind : str
        What it may be by its unit, else by its name; empty if neither says.
    samples : int
    lowest, highest : float
        Extremes of its numbers as they stand in the file, gaps aside.
    rate, duration : float or None
        Samples per second [Hz] and time from the first to the last [s]; None without a clock.
    """

    name: str
    unit: str
    kind: str
    samples: int
    lowest: float
    highest: float
    rate: float | None
    duration: float | None


@dataclass(frozen=True)
class Listing:
    """The channels of a file, and what else it says.

    `told` is whether the file says itself which channel is what, and `clock` why it has none, empty where it has one.
    """

    source: str
    channels: tuple[ListedChannel, ...]
    notes: tuple[str, ...]
    told: bool
    clock: str = ""

    @property
    def proposed(self) -> dict[str, tuple[str, ...]]:
        """Names by kind, of the channels of which unit or name tells the kind."""
        kinds = (kind for kind in KINDS if any(channel.kind == kind for channel in self.channels))
        return {kind: tuple(channel.name for channel in self.channels if channel.kind == kind) for kind in kinds}


def listing(
    source: Any, *, time: str | None = None, rate: float | None = None, run: Run = None, sheet: Run = None
) -> Listing:
    """What a file or a table in memory holds; arguments and errors as of `read`, but that no channel need be named."""
    contents, called, _ = opened(source)
    contents, _ = chosen_run(contents, called, run, sheet)
    channels, notes, why, clocks = list[ListedChannel](), dict.fromkeys(contents.notes), "", set[str]()
    for name, array, samples in _series(contents):
        seconds = np.empty(0)
        try:
            clock = clock_of(contents, called, [Choice("force", name, array, None, 1.0)], time, rate, {})
            seconds = clock.seconds
            clocks.update(column.array for column in clock.columns)
            notes |= dict.fromkeys(clock.notes)
        except ValueError as error:
            why = why or str(error)
        channels.append(_listed(contents, name, array, samples, seconds))
    listed = tuple(channel for channel in channels if channel.name not in clocks)
    return Listing(called, listed, tuple(notes), _is_told(contents, called), why)


def _is_told(contents: Contents, source: str) -> bool:
    try:
        return bool(own_names(contents, source))
    except ValueError:
        return False


def _listed(contents: Contents, name: str, array: str, samples: np.ndarray, seconds: np.ndarray) -> ListedChannel:
    finite, unit = samples[np.isfinite(samples)], contents.units.get(array, "")
    duration = float(seconds[-1] - seconds[0]) if seconds.size > 1 else None
    return ListedChannel(
        name=name,
        unit=unit,
        kind=contents.kinds.get(array) or _kind(array, unit),
        samples=samples.size,
        lowest=float(np.min(finite, initial=np.inf)),
        highest=float(np.max(finite, initial=-np.inf)),
        rate=(seconds.size - 1) / duration if duration else None,
        duration=duration,
    )


def _kind(name: str, unit: str) -> str:
    """What a channel may be: by its unit; by its name where that says nothing, or says volts."""
    for kind, quantities in _QUANTITIES.items():
        with contextlib.suppress(ValueError):
            if unit and find_unit(unit, kind).quantity in quantities:
                return kind
    last = re.split(r"[./]", name)[-1]
    return next((kind for kind, pattern in _NAMES.items() if pattern.search(last)), "")


def _series(contents: Contents) -> Iterator[tuple[str, str, np.ndarray]]:
    """Arrays of numbers over samples: as they must be named, columns of a matrix one by one, and their own names."""
    for name in contents.arrays:
        try:
            array = np.asarray(contents.arrays[name])
        except ValueError:  # text
            continue
        if array.dtype.kind not in "iuf" or array.ndim not in (1, 2) or array.size < 3:
            continue
        array = array.T if array.ndim == 2 and array.shape[0] < array.shape[1] else array
        if array.ndim == 2 and array.shape[1] > 1:
            yield from ((f"{name}[{column}]", name, array[:, column]) for column in range(array.shape[1]))
        else:
            yield name, name, array.ravel()
