"""What a file holds, before anyone has said what its channels mean: names, units, clocks, and what they may be."""

import contextlib
import itertools
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from jfsm.records._out_units import OutUnits, out_units
from jfsm.records._sources import opened
from jfsm.records._unit_words import dimension_and_size
from jfsm.records._units import KINDS, coherent_unit, find_unit, seconds_in
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

STRETCHES = 500  # of a small picture


@dataclass(frozen=True)
class ListedChannel:
    """One channel of a file.

    Attributes
    ----------
    name : str
        As it must be given.
    number : int or None
        That may be given instead, from 1; None of a column of a matrix.
    unit : str
        As the file states it; empty if it does not.
    kind : str
        What it may be by its unit, else by its name; empty if neither says.
    samples : int
    lowest, highest : float
        Extremes of its numbers as they stand in the file, gaps aside.
    rate, duration : float or None
        Samples per second [Hz] and time from the first to the last [s]; None without a clock.
    outline : (m, 2) float array
        Instants [s], or sample numbers without a clock, and numbers of the samples that a small picture shows: the
        lowest and the highest of each of so many stretches.
    """

    name: str
    number: int | None
    unit: str
    kind: str
    samples: int
    lowest: float
    highest: float
    rate: float | None
    duration: float | None
    outline: NDArray[np.float64]


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
        """Names by kind, of the channels of which the unit tells the kind; where none does, of those whose name may."""
        found = dict[str, tuple[str, ...]]()
        for kind in KINDS:
            alike = [channel for channel in self.channels if channel.kind == kind]
            told = [channel for channel in alike if _is_of(kind, channel.unit)]
            if alike:
                found[kind] = tuple(channel.name for channel in told or alike)
        return found

    def in_units(self, asked: OutUnits) -> Self:
        """The same with numbers in the units that are asked for, of channels whose unit is one of their quantities.

        Raises
        ------
        ValueError
            As of `out_units`.
        """
        from jfsm.reporting import in_shown_unit, shown_in

        with shown_in(out_units(asked)):
            return replace(self, channels=tuple(_in_unit(channel, in_shown_unit) for channel in self.channels))

    def report(self, path: str | Path, proposal: str = "") -> None:
        """Write a self-contained HTML page: the channels with a small picture each, and a command line to go on with.

        The file appears under its name only when it is complete.

        Raises
        ------
        OSError
            If `path` is not a file in a folder that can be written to; what stood there is still there.
        """
        from jfsm.reporting import render_listing, write_text_atomically

        write_text_atomically(path, render_listing({**vars(self), "channels": map(vars, self.channels)}, proposal))


def _in_unit(channel: ListedChannel, shown: Callable[[str], tuple[float, str]]) -> ListedChannel:
    """A channel in the unit that is shown for its own, as it is where no other is."""
    known = dimension_and_size(channel.unit)
    coherent = None if known is None else coherent_unit(known[0])
    if known is None or coherent is None:
        return channel
    size, word = shown(coherent)
    if word == coherent:
        return channel
    factor = known[1] / size
    outline = channel.outline * [1.0, factor]
    return replace(
        channel, unit=word, lowest=factor * channel.lowest, highest=factor * channel.highest, outline=outline
    )


def listing(
    source: Any, *, time: str | None = None, rate: float | None = None, run: Run = None, sheet: Run = None
) -> Listing:
    """What a file or a table in memory holds; arguments and errors as of `read`, but that no channel need be named."""
    contents, called, _ = opened(source)
    contents, _ = chosen_run(contents, called, run, sheet)
    channels, notes = list[ListedChannel](), dict.fromkeys(contents.notes)
    clocks, without = set[str](), dict[str, str]()
    for name, array, samples in _series(contents):
        seconds = np.empty(0)
        try:
            clock = clock_of(contents, called, [Choice("force", name, array, None, 1.0)], time, rate, {})
            seconds = clock.seconds
            clocks.update(column.array for column in clock.columns)
            notes |= dict.fromkeys(clock.notes)
        except ValueError as error:
            without[name] = str(error)
        channels.append(_listed(contents, name, array, samples, seconds))
    listed = tuple(channel for channel in channels if channel.name not in clocks)
    why = next((without[channel.name] for channel in listed if channel.name in without), "")
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
        number=next((place for place, other in enumerate(contents.arrays, start=1) if other == name), None),
        unit=unit,
        kind=(contents.kinds.get(array) or _kind(array, unit)) if finite.size else "",
        samples=samples.size,
        lowest=float(np.min(finite, initial=np.inf)),
        highest=float(np.max(finite, initial=-np.inf)),
        rate=(seconds.size - 1) / duration if duration else None,
        duration=duration,
        outline=_outline(seconds if seconds.size == samples.size else np.arange(samples.size), samples),
    )


def _outline(place: NDArray[Any], samples: NDArray[Any]) -> NDArray[np.float64]:
    """Places and values (m, 2) of the lowest and the highest sample of each stretch, or of all if they are few."""
    kept = np.arange(samples.size)
    if samples.size > 2 * STRETCHES:
        edges = np.linspace(0, samples.size, STRETCHES + 1).astype(int)
        shown = (np.where(np.isfinite(samples), samples, gap) for gap in (np.inf, -np.inf))
        below, above = (
            [first + find(y[first:last]) for first, last in itertools.pairwise(edges)]
            for y, find in zip(shown, (np.argmin, np.argmax), strict=True)
        )
        kept = np.unique(np.concatenate([below, above]))
    return np.column_stack([place[kept], samples[kept]]).astype(np.float64)


def _kind(name: str, unit: str) -> str:
    """What a channel may be: by its unit; by its name where that says nothing, or says volts."""
    if seconds_in(unit) is not None:
        return ""
    for kind in _QUANTITIES:
        if _is_of(kind, unit):
            return kind
    last = re.split(r"[./]", name)[-1]
    return next((kind for kind, pattern in _NAMES.items() if pattern.search(last)), "")


def _is_of(kind: str, unit: str) -> bool:
    """Whether a unit is one of a kind of channel."""
    with contextlib.suppress(ValueError):
        return bool(unit) and find_unit(unit, kind).quantity in _QUANTITIES.get(kind, ())
    return False


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
