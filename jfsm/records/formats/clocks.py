"""When the samples of a file were taken."""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jfsm.records._channels import as_instant
from jfsm.records._units import find_unit
from jfsm.records.formats.base import Contents
from jfsm.records.formats.lookup import Choice, choose, listed, samples_of
from jfsm.records.formats.stamps import Instants, instants_of_numbers, instants_of_texts, was_unwrapped
from jfsm.records.formats.ticks import mended

Seconds = NDArray[np.float64]

RATE_NAMES = ("fs", "sample_rate", "samplerate", "sampling_rate", "sampling_frequency")  # Hz
STEP_NAMES = ("dt", "ts", "delta_t", "sampling_interval")  # s
DATE_NAMES = ("date", "datum", "fecha")
_WORDS = "time|zeit|temps|tiempo|tempo|tid|tijd|uhrzeit"
_UNIT = "(?P<unit>s|sec|seconds|ms|us|µs|ns|min)"
# In order: the name alone, then with what goes with it, then absolute times.
_TIME_NAMES = tuple(
    re.compile(pattern, re.IGNORECASE)
    for pattern in (
        rf"%?(?:{_WORDS}|t)",
        rf"(?:(?:running|elapsed|relative|test|total|rel)[ ._-]*)?(?:{_WORDS}|t)(?:[ ._-]*{_UNIT})?",
        rf"millis|micros|x[ _-]?value|x[ _-]?axis|seconds|sekunden|abtastzeit|messzeit|(?:{_WORDS})\s+\d.*",
        r"(?:date[ _/-]*time|time[ _-]*stamp|zeitstempel|datum[ _/-]*(?:zeit|uhrzeit)?|date)"
        rf"(?:[ ._-]*{_UNIT})?",
    )
)
_FREQUENCY = re.compile(r"(?:freq|frequency|frequenz|fr[ée]quence)(?:[ _]*hz)?|hz", re.IGNORECASE)
_COUNTS = {"millis": "ms", "micros": "us"}  # functions of Arduino, and the units of what they give
_NS = 1_000_000_000
AGREES = 0.005  # relative difference of two statements of one rate that is worth no word


class Clock(NamedTuple):
    """Instants [s] of the channels, the columns they were read from, when they read zero, and what was assumed."""

    seconds: Seconds
    columns: tuple[Choice, ...]
    begins: np.datetime64 | None = None
    notes: tuple[str, ...] = ()
    rows: NDArray[np.int64] | None = None  # of the table, in which a slower channel has readings

    def of_samples(self, samples: NDArray) -> NDArray:
        """The samples that belong to the instants."""
        return samples if self.rows is None else samples[self.rows]


def clock_of(
    contents: Contents,
    source: str,
    chosen: Sequence[Choice],
    time: str | None,
    rate: float | None,
    units: Mapping[str, str],
) -> Clock:
    """The clock that all chosen channels share.

    It is the one that is asked for; else that of the channels themselves, else a column or array of instants, a single
    number for rate or step (each looked for beside the channel first, then in the structs and groups around it), else
    the rate that the file states.

    Raises
    ------
    ValueError
        If nothing says when the samples were taken, the channels have clocks that differ, or `rate` is not positive.
    """
    if time is not None and rate is not None:
        raise ValueError(f"`time` and `rate` cannot both be given; they were {time!r} and {rate}. Leave one out.")
    if time is not None:
        return _of_column(contents, source, choose(contents, source, "time", time), units)
    if rate is not None:
        return Clock(_counted(contents, source, chosen[:1], rate), ())
    finder = _Finder(contents, source, units)
    clocks = [(choice, finder.of_rows(choice)) for choice in chosen]
    if not clocks:
        return finder.of(None)
    first, common = clocks[0]
    for choice, clock in clocks[1:]:
        if not _are_one(common, clock):
            raise ValueError(
                f"{source} must have channels of one clock to make one record; {first.array!r} "
                f"{_described(common.seconds)}, {choice.array!r} {_described(clock.seconds)}. "
                f"{_apart(common, clock)}Read them into a record each, and bring these to one clock by "
                f"jfsm.align(records); or pass rate=... [Hz] if the file is wrong."
            )
    return common._replace(notes=(*common.notes, *finder.doubts(common)))


class _Finder:
    """Finds the clock of one channel after another; each column is read once."""

    def __init__(self, contents: Contents, source: str, units: Mapping[str, str]):
        self._contents, self._source, self._units = contents, source, units
        self._known: dict[object, Clock] = {}

    def of(self, choice: Choice | None) -> Clock:
        """The clock of a channel; without one, the first column of instants of the file."""
        contents = self._contents
        if choice is not None and choice.array in contents.clocks:
            return self._once(
                ("own", choice.array), lambda: Clock(np.asarray(contents.clocks[choice.array]), (), contents.begins)
            )
        for around in _around(choice):
            named = self._column(around, choice)
            if named is not None:
                column = choose(contents, self._source, "time", named)
                return self._once(named, lambda column=column: _of_column(contents, self._source, column, self._units))
            number = _number(contents, around)
            if number is not None and choice is not None:
                size = samples_of(contents, self._source, choice).shape[0]
                return self._once(
                    (number, size),
                    lambda number=number: Clock(_counted(contents, self._source, [choice], number), ()),
                )
        if contents.rate is not None and choice is not None:
            stated, size = contents.rate, samples_of(contents, self._source, choice).shape[0]
            note = f"Counted by the rate that the file states: {stated.words} ({stated.hertz:.9g} Hz)."
            return self._once(
                (stated, size),
                lambda: Clock(_counted(contents, self._source, [choice], stated.hertz), (), contents.begins, (note,)),
            )
        over = next((name for name in contents.arrays if _FREQUENCY.fullmatch(name.strip())), None)
        if over is not None:
            raise ValueError(
                f"{self._source} holds a spectrum over {over!r} and no instants; a record holds samples over time. "
                f'Export the samples over time, or pass time="..." or rate=... [Hz] if it is none.'
            )
        raise ValueError(
            f"{self._source} must say when its samples were taken; it holds {listed(contents.arrays)}. "
            f'Pass time="..." or rate=... [Hz].'
        )

    def of_rows(self, choice: Choice) -> Clock:
        """The clock of a channel over the rows of a table in which it has readings, if others have more of them."""
        clock = self.of(choice)
        if choice.array not in self._contents.texts:
            return clock
        rows = _own_rows(samples_of(self._contents, self._source, choice))
        if rows is None or clock.seconds.size <= int(rows[-1]):
            return clock
        return clock._replace(seconds=clock.seconds[rows], rows=rows)

    def doubts(self, clock: Clock) -> Iterator[str]:
        """Other statements of the file about its rate that contradict the clock."""
        contents, columns = self._contents, clock.columns
        steps = np.diff(clock.seconds)
        if steps.size < 2 or not columns:
            return
        step = float(np.median(steps))
        if not step > 0:
            return
        if contents.rate is not None and abs(contents.rate.hertz * step - 1) > AGREES:
            yield (
                f"The file states {contents.rate.words} ({contents.rate.hertz:.6g} Hz); its instants give "
                f"{1 / step:.6g} Hz, which counts."
            )
        for name in contents.texts:  # only tables of text have several columns for one clock
            if name == columns[0].array or _rank(self._words(name)) is None:
                continue
            try:
                other = _of_column(contents, self._source, choose(contents, self._source, "time", name), {})
            except ValueError:
                continue
            other_step = float(np.median(np.diff(other.seconds))) if other.seconds.size == steps.size + 1 else 0.0
            if other_step > 0 and abs(other_step / step - 1) > AGREES:
                yield (
                    f"Warning: the columns {columns[0].array!r} and {name!r} disagree by a factor of "
                    f"{max(step / other_step, other_step / step):.6g}; the first is used. Pass time={name!r} if the "
                    f"other one is right."
                )

    def _once(self, key: object, make: Callable[[], Clock]) -> Clock:
        if key not in self._known:
            self._known[key] = make()
        return self._known[key]

    def _words(self, name: str) -> tuple[str, ...]:
        """What a column is called: its name and whatever else stands for it."""
        return (name, *(text for text, names in self._contents.aliases.items() if name in names))

    def _column(self, around: str, choice: Choice | None) -> str | None:
        """The array of instants in one group or struct: by name, else the only one with a unit of time."""
        inside = [
            name
            for name in self._contents.arrays
            if name.startswith(around) and not re.search(r"[./]", name[len(around) :])
            if choice is None or name != choice.array
        ]
        ranked = [
            (rank, name)
            for name in inside
            if (rank := _rank(word[len(around) :] if word.startswith(around) else word for word in self._words(name)))
            is not None
        ]
        found = [name for rank, name in ranked if rank == min(rank for rank, _ in ranked)]
        found = [name for name in found if self._is_column(name)]
        if not found:
            found = [name for name in inside if self._contents.units.get(name) and _seconds(self._contents.units[name])]
            return found[0] if len(found) == 1 and self._is_column(found[0]) else None
        if choice is not None and len(found) > 1 and self._are_twins(found):
            order = list(self._contents.arrays)
            before = [name for name in found if order.index(name) < order.index(choice.array)]
            return (before or found[:1])[-1]
        return found[0]

    def _are_twins(self, names: Sequence[str]) -> bool:
        """Whether these are columns of one heading, each with channels of its own behind it."""
        return any(set(names) <= set(several) for several in self._contents.aliases.values())

    def _is_column(self, name: str) -> bool:
        try:
            return np.size(self._contents.arrays[name]) > 1
        except ValueError:  # text, such as dates
            return True


def _own_rows(samples: NDArray) -> NDArray[np.int64] | None:
    """Rows of a channel that ends before the table or stands in every second, third row; None where it has all.

    Other gaps are gaps.
    """
    if samples.dtype.kind != "f" or samples.ndim != 1 or not np.isnan(samples).any():
        return None
    rows = np.flatnonzero(~np.isnan(samples))
    if rows.size < 2 or np.ptp(np.diff(rows)) > 0:
        return None
    stride = int(rows[1] - rows[0])
    return rows if stride > 1 or rows[0] == 0 else None


def _around(choice: Choice | None) -> Iterator[str]:
    """The struct or group of a channel and those around it, ending in the separator; the top at last."""
    name = choice.array if choice is not None else ""
    while name:
        place = max(name.rfind("/"), name.rfind("."))
        if place < 0:
            break
        yield name[: place + 1]
        name = name[:place]
    yield ""


def _rank(words: Iterable[str]) -> int | None:
    """How much like a clock a name sounds, 0 most; None if it does not."""
    ranks = [place for word in words for place, pattern in enumerate(_TIME_NAMES) if pattern.fullmatch(word.strip())]
    return min(ranks, default=None)


def _of_column(contents: Contents, source: str, column: Choice, units: Mapping[str, str]) -> Clock:
    unit = _unit(contents, source, column, units)
    if unit is None:
        match = next((m for p in _TIME_NAMES if (m := p.fullmatch(column.array.rpartition("/")[2].strip()))), None)
        unit = match.groupdict().get("unit") if match else None
        unit = unit or _COUNTS.get(column.array.lower())
    factor = _seconds(unit) if unit else None
    instants = _instants(contents, source, column, factor)
    seconds, notes = mended(instants.seconds)
    if unit is None and instants.begins is None and not instants.notes and not contents.about:
        notes.append(f"The unit of time is not stated; {column.array!r} is taken to be in seconds.")
    return Clock(seconds, (column,), instants.begins, (*instants.notes, *notes))


def _instants(contents: Contents, source: str, column: Choice, factor: float | None) -> Instants:
    try:
        values = samples_of(contents, source, column)
    except ValueError:
        if column.array not in contents.texts:
            raise
        texts = contents.texts[column.array]
        dates = next(
            (contents.texts[name] for name in contents.texts if name.lower() in DATE_NAMES and name != column.array),
            None,
        )
        found = instants_of_texts(texts, dates)
        if found is None:
            raise
        return found
    if values.dtype.kind not in "iufmM":
        return Instants(values, None, ())
    found = instants_of_numbers(values, factor, lambda: _integers(contents, column, values))
    if values.dtype.kind in "iuf" and values.size > 1 and found.begins is None:
        if was_unwrapped(np.asarray(values, dtype=np.float64)):
            return found._replace(notes=(*found.notes, "The counter of the clock began anew; it is made to go on."))
    return found


def _integers(contents: Contents, column: Choice, values: NDArray) -> NDArray:
    """Numbers beyond what a double holds, as they are written."""
    if column.array not in contents.texts:
        return values.astype(np.int64)
    return np.array(
        [int(float(text)) if "e" in text.lower() else int(text.split(".")[0]) for text in contents.texts[column.array]]
    )


def _unit(contents: Contents, source: str, column: Choice, units: Mapping[str, str]) -> str | None:
    """The unit of a column of instants: what the caller says, else what the file states."""
    for key in (column.name, column.array, "time"):
        if key in units:
            find_unit(units[key], "time")
            return units[key]
    stated = contents.units.get(column.array)
    if stated is not None and _seconds(stated) is None:
        raise ValueError(
            f"{source} must state a unit of time for {column.array!r}; it states {stated!r}. Say which is meant by "
            f"units={{{column.array!r}: ...}}, or read the channel as what it is."
        )
    return stated


def _seconds(unit: str) -> float | None:
    try:
        return find_unit(unit, "time").factor
    except ValueError:
        return None


def _number(contents: Contents, around: str) -> float | None:
    """The rate that a single number gives in one group or struct."""
    lower = {name.lower(): name for name in reversed(list(contents.arrays))}
    for names, inverse in ((RATE_NAMES, False), (STEP_NAMES, True)):
        for name in names:
            key = lower.get((around + name).lower())
            if key is not None and np.size(contents.arrays[key]) == 1:
                value = float(np.asarray(contents.arrays[key]).item())
                if value > 0:
                    return 1.0 / value if inverse else value
    return None


def _counted(contents: Contents, source: str, chosen: Sequence[Choice], rate: float) -> Seconds:
    if not (np.isfinite(as_instant("rate", rate)) and rate > 0):
        raise ValueError(f"`rate` must be a positive number of samples per second; it was {rate}. Pass rate=... [Hz].")
    size = samples_of(contents, source, chosen[0]).shape[0] if chosen else 0
    return np.arange(size) / rate


def _are_one(one: Clock, other: Clock) -> bool:
    """Whether two clocks tick at the same instants."""
    if one.seconds is not other.seconds and not np.array_equal(one.seconds, other.seconds):
        return False
    return one.begins is None or other.begins is None or one.begins == other.begins


def _apart(one: Clock, other: Clock) -> str:
    """How far apart two clocks begin, if the file states from when they count."""
    if one.begins is None or other.begins is None or not one.seconds.size or not other.seconds.size:
        return ""
    starts = [
        begins + np.timedelta64(round(float(clock.seconds[0]) * _NS), "ns")
        for clock, begins in ((one, one.begins), (other, other.begins))
    ]
    begun = " and ".join(str(start).replace("T", " ") for start in starts)
    return f"They begin at {begun}, {abs((starts[1] - starts[0]) / np.timedelta64(1, 'ns')) / _NS:.9g} s apart. "


def _described(clock: Seconds) -> str:
    if clock.size < 2:
        return f"has {clock.size} samples"
    return f"has {clock.size} samples from {clock[0]:.9g} to {clock[-1]:.9g} s"
