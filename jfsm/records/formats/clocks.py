"""When the samples of a file were taken."""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import islice
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jfsm.records._channels import as_instant
from jfsm.records._units import find_unit
from jfsm.records.formats.base import Contents
from jfsm.records.formats.lookup import Choice, choose, listed, samples_of
from jfsm.records.formats.preambles import names_rate, rate_by_name
from jfsm.records.formats.stamps import (
    PACKED_DATE,
    Instants,
    instants_of_numbers,
    instants_of_texts,
    seconds_that_were_meant,
    was_unwrapped,
)
from jfsm.records.formats.ticks import mended

Seconds = NDArray[np.float64]

DATE_NAMES = ("date", "datum", "fecha")
_WORDS = "time|zeit|temps|tiempo|tempo|tid|tijd|uhrzeit|laufzeit|čas|czas|время|时间|時間|elapsed|tout"
_AHEAD = "running|elapsed|relative|test|total|rel|sample|sampling|sensor|system|measurement"
_UNIT = "(?P<unit>s|sec|seconds|ms|us|µs|ns|min)"
# In order: the name alone, then with what goes with it, then absolute times.
_TIME_NAMES = tuple(
    re.compile(pattern, re.IGNORECASE)
    for pattern in (
        rf"%?(?:{_WORDS}|t)",
        rf"(?:(?:{_AHEAD})[ ._-]*)?(?:(?:{_WORDS})(?:[ ._-]*{_UNIT})?|t[ ._-]+{_UNIT.replace('unit', 'unit_of_t')})",
        r"millis|micros|x[ _-]?value|x[ _-]?axis|secs?|seconds(?:[ _-]elapsed)?|elapsed[ _-]seconds|sekunden"
        rf"|abtastzeit|messzeit|(?:{_WORDS})(?:\s+\d.*|\[\d+\])",
        r"(?:date[ _/-]*time|(?:rosbag[ _-]*)?time[ _-]*stamp|ts|zeitstempel|datum[ _/-]*(?:zeit|uhrzeit)?|date)"
        rf"(?:[ ._-]*{_UNIT})?",
    )
)
_FREQUENCY = re.compile(r"(?:freq|frequency|frequenz|fr[ée]quence)(?:[ _]*hz)?|hz", re.IGNORECASE)
_COUNTS = {"millis": "ms", "micros": "us"}  # functions of Arduino, and the units of what they give
_NS = 1_000_000_000
LIKELY = 8  # arrays among which a clock without a name is looked for
_WHOLE_WORD = re.compile(rf"(?:^|[^a-z])(?:{_WORDS}|timestamp|clock)(?:$|[^a-z])", re.IGNORECASE)
_SINCE = re.compile(r"(?P<unit>\S+) since (?P<date>\d{4}-\d{1,2}-\d{1,2}.*)")  # as netCDF states units of time
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
        if choice is not None and (guessed := self._guessed(choice)) is not None:
            return guessed
        over = next((name for name in contents.arrays if _FREQUENCY.fullmatch(name.strip())), None)
        if over is not None:
            raise ValueError(
                f"{self._source} holds a spectrum over {over!r} and no instants; a record holds samples over time. "
                f'Export the samples over time, or pass time="..." or rate=... [Hz] if it is none.'
            )
        even = next((name for name in islice(contents.arrays, LIKELY) if self._is_ramp(name)), None)
        hint = f" {even!r} grows evenly, and may be the clock." if even is not None else ""
        if choice is not None and choice.column is None and self._has_instants(choice):
            hint = (
                f" The first column of {choice.array!r} grows evenly: ask for '{choice.array}[1]' if it holds instants."
            )
        raise ValueError(
            f"{self._source} must say when its samples were taken; it holds {listed(contents.arrays)}.{hint} "
            f'Pass time="..." or rate=... [Hz].'
        )

    def _guessed(self, choice: Choice) -> Clock | None:
        """What may be the clock, with a note: the first column of the channel's matrix, the only array that grows and
        has a word for time in its name, the only rate in the file.
        """
        contents = self._contents
        if (instants := self._first_column(choice)) is not None:
            return instants
        called = [
            name
            for name in contents.arrays
            if name != choice.array and _WHOLE_WORD.search(name) and self._is_ramp(name, evenly=False)
        ]
        if len(called) == 1:
            column = choose(contents, self._source, "time", called[0])
            clock = self._once(called[0], lambda: _of_column(contents, self._source, column, self._units))
            return clock._replace(notes=(f"{called[0]!r} is taken for the clock.", *clock.notes))
        if choice.column is None and self._has_instants(choice):
            return None
        stated = ((name, _stated_by(contents, name)) for name in contents.arrays)
        rates = [(name, rate) for name, rate in stated if rate is not None]
        if len(rates) != 1:
            return None
        name, rate = rates[0]
        size = samples_of(contents, self._source, choice).shape[0]
        note = f"Counted by the only rate that the file states: {name!r}, {rate:.9g} Hz."
        return self._once(
            ("only", size), lambda: Clock(_counted(contents, self._source, [choice], rate), (), None, (note,))
        )

    def _is_ramp(self, name: str, *, evenly: bool = True) -> bool:
        """Whether an array grows from sample to sample, by equal steps if that is asked for."""
        try:
            return _grows(np.asarray(self._contents.arrays[name]), evenly)
        except ValueError:  # text
            return False

    def _has_instants(self, choice: Choice) -> bool:
        is_matrix = samples_of(self._contents, self._source, choice).ndim == 2
        return is_matrix and self._first_column(choice._replace(column=1)) is not None

    def _first_column(self, choice: Choice) -> Clock | None:
        """The first column of the matrix of a channel, as Simulink saves arrays with time, if it grows evenly."""
        if not choice.column:
            return None
        instants = samples_of(self._contents, self._source, choice._replace(column=0, sign=1.0))
        note = f"The first column of {choice.array!r} grows evenly and is taken for the instants, in seconds."
        if not _grows(instants, evenly=True):
            return None
        return self._once(("matrix", choice.array), lambda: Clock(instants.astype(np.float64), (), None, (note,)))

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
            if name.startswith(around)
            and (name in self._contents.texts or not re.search(r"[./]", name[len(around) :]))  # tables have no groups
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


def _grows(values: NDArray, evenly: bool) -> bool:
    """Whether numbers grow from one to the next; evenly by steps that are alike and do not number rows."""
    if values.ndim != 1 or values.size < 3 or values.dtype.kind not in "iuf":
        return False
    steps = np.diff(values.astype(np.float64))
    if not evenly or not np.all(steps > 0):
        return bool(np.all(steps > 0))
    return not bool(np.all(steps == 1.0)) and float(np.ptp(steps)) <= 1e-3 * float(steps.mean())


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
        unit = _unit_in_name(column.array)
    since = _SINCE.fullmatch(unit or "")
    factor = _seconds(since["unit"] if since else unit) if unit else None
    instants = _instants(contents, source, column, factor)
    if since and instants.begins is None:
        dated = instants_of_texts(np.array(2 * [since["date"] if ":" in since["date"] else f"{since['date']} 00:00"]))
        instants = instants._replace(begins=dated.begins if dated else None)
    seconds, notes = mended(instants.seconds)
    if factor is not None and instants.begins is None and seconds.size > 2:
        step = float(np.median(np.diff(seconds[:1000])))
        if words := seconds_that_were_meant(float(seconds[0]) / factor, step / factor, factor):
            notes.append(
                f"Warning: {column.array!r} is read in {unit}, as stated; its numbers look like {words}. Say so by "
                f"units={{{column.name!r}: ...}} if they are."
            )
    if unit is None and instants.begins is None and not instants.notes and not contents.about:
        notes.append(f"The unit of time is not stated; {column.array!r} is taken to be in seconds.")
    return Clock(seconds, (column,), instants.begins, (*instants.notes, *notes))


def _unit_in_name(name: str) -> str | None:
    """The unit of time that a name ends in, as ``time_ms``, or stands for, as ``micros``."""
    match = next((m for p in _TIME_NAMES if (m := p.fullmatch(name.rpartition("/")[2].strip()))), None)
    groups = match.groupdict() if match else {}
    return groups.get("unit") or groups.get("unit_of_t") or _COUNTS.get(name.lower())


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
    if factor is None and values.dtype.kind == "f" and values.size and 1.9e13 < values[0] < 2.2e13:
        texts = contents.texts.get(column.array)
        if texts is not None and all(map(PACKED_DATE.fullmatch, texts[:2])):
            if (found := instants_of_texts(texts)) is not None:
                return found
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
    if stated is not None and _seconds(stated) is None and not _SINCE.fullmatch(stated):
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
    inside = (
        name for name in contents.arrays if name.startswith(around) and not re.search(r"[./]", name[len(around) :])
    )
    return next((rate for name in inside if (rate := _stated_by(contents, name)) is not None), None)


def _stated_by(contents: Contents, name: str) -> float | None:
    """The rate that an array gives by its name, if it is one number."""
    if not names_rate(name):
        return None
    given = np.asarray(contents.arrays[name])
    return rate_by_name(name, float(given.item())) if given.size == 1 and given.dtype.kind in "iuf" else None


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
