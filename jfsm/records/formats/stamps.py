"""Instants in seconds from whatever stands in a column of time: numbers of any epoch, dates, the time of day."""

import re
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Seconds = NDArray[np.float64]

DAY = 86_400
_NS = 1_000_000_000
_LABVIEW_ZERO = np.datetime64("1904-01-01", "ns")
_POSIX_ZERO, _WINDOWS_ZERO = np.datetime64("1970-01-01", "ns"), np.datetime64("1601-01-01", "us")

_DATE = re.compile(
    r"""(?:(?P<y>\d{4})[-/.](?P<m>\d{1,2})[-/.](?P<d>\d{1,2})
        |(?P<a>\d{1,2})(?P<sep>[-/.])(?P<b>\d{1,2})[-/.](?P<year>\d{4}|\d{2}))""",
    re.VERBOSE,
)
_CLOCK = re.compile(
    r"""(?<![\d:])(?P<h>\d{1,3}):(?P<min>\d{2,3})(?::(?P<s>\d{2})(?:[.,:](?P<f>\d{1,9})\d*)?)?\s*(?P<half>[AaPp]\.?[Mm]\.?)?
        \s*(?P<zone>Z|UTC|[+-]\d{2}:?\d{2})?""",
    re.VERBOSE,
)


_MONTHS = {
    month: place
    for place, months in enumerate(
        "jan janv|feb fév fev|mar mär mrz mars|apr avr|may mai|jun juin|jul juil|aug août aou|sep sept|oct okt|nov"
        "|dec déc dez".split("|"),
        start=1,
    )
    for month in months.split()
}
_NAMED = re.compile(
    r"(?P<day>\d{1,2})[-. /](?P<month>[^\W\d_]{3,9})\.?[-. /](?P<year>\d{4})"
    r"|(?P<month_first>[^\W\d_]{3,9})\.? (?P<day_second>\d{1,2}),? (?P<year_last>\d{4})"
)
_PACKED = re.compile(r"^\s*(\d{4})(\d{2})(\d{2})[T_ -]?(\d{2})(\d{2})(\d{2})(?=[.,Z+-]|\s*$)")
_DOTTED = re.compile(r"^(\s*\d{4}-\d{2}-\d{2})[T_ -](\d{2})\.(\d{2})\.(\d{2})(?=[.,Z+-]|\s*$)")
_MINUTES = re.compile(r"^\s*(\d{1,3}):(\d{2})(?=[.,]\d+\s*$)")


class Instants(NamedTuple):
    """Instants [s] from the first one of a date, or as they are; when the clock reads zero; and what was assumed."""

    seconds: Seconds
    begins: np.datetime64 | None
    notes: tuple[str, ...]


class _Epoch(NamedTuple):
    """A count since some day: how many make a second, how large it is nowadays, and from when."""

    per_second: float
    low: float
    high: float
    zero: np.datetime64
    words: str


_EPOCHS = (
    _Epoch(1.0, 4e8, 2.6e9, _POSIX_ZERO, "seconds since 1970"),
    _Epoch(1.0, 2.6e9, 4.6e9, _LABVIEW_ZERO, "seconds since 1904 (LabVIEW)"),
    _Epoch(1e3, 4e11, 4.6e12, _POSIX_ZERO, "milliseconds since 1970"),
    _Epoch(1e6, 4e14, 4.6e15, _POSIX_ZERO, "microseconds since 1970"),
    _Epoch(1e7, 1.2e17, 1.4e17, _WINDOWS_ZERO, "steps of 100 ns since 1601"),
    _Epoch(1e9, 4e17, 4.6e18, _POSIX_ZERO, "nanoseconds since 1970"),
)


class _Days(NamedTuple):
    """A count of days: how large it is nowadays, what it is on 1970-01-01, and who counts so."""

    low: float
    high: float
    posix: int
    words: str


_DAY_COUNTS = (
    _Days(2e4, 8e4, 25_569, "days since 1900, as Excel counts them"),
    _Days(6.9e5, 7.9e5, 719_529, "days since the year 0, as MATLAB counts them"),
)
PACKED_DATE = re.compile(r"\s*(?:19|20|21)\d{12}(?:[.,]\d+)?\s*")
"""A date and time in fourteen digits, which reads like a number."""


def instants_of_numbers(values: NDArray[Any], factor: float | None, exact: Callable[[], NDArray[Any]]) -> Instants:
    """Instants of a column of numbers.

    Parameters
    ----------
    values : (n,) array
        As read; integers are subtracted before they become doubles.
    factor : float or None
        Seconds for one of the unit that is stated; None if none is.
    exact : function
        The same numbers as integers, for those that a double cannot hold.
    """
    if values.dtype.kind == "M":
        return _since(values.astype("datetime64[ns]"), "")
    if values.dtype.kind == "m":
        return Instants(_in_seconds(values), None, ())
    numbers = np.asarray(values, dtype=np.float64)
    finite = numbers[:1000][np.isfinite(numbers[:1000])]
    if finite.size < 2:
        return Instants(numbers, None, ())
    level, step = float(finite[0]), float(np.median(np.abs(np.diff(finite))))
    for days in _DAY_COUNTS:
        if factor is None and days.low < level < days.high and 0 < step < 1.2e-5:
            seconds = (numbers - np.floor(level)) * DAY
            zero = _POSIX_ZERO + np.timedelta64((int(level) - days.posix) * DAY, "s")
            return _from_first(seconds, zero, (f"The column of time holds {days.words}.",))
    for epoch in _EPOCHS:
        fits = factor is None or np.isclose(factor * epoch.per_second, 1.0)
        if epoch.low < level < epoch.high and fits and (factor is not None or _is_likely(epoch, step)):
            counts = values
            if values.dtype.kind == "f" and level > 2**53:
                counts = exact()
            first = counts[0]
            seconds = np.asarray((counts - first) / epoch.per_second, dtype=np.float64)
            zero = _instant(epoch, first)
            return _from_first(seconds, zero, (f"The column of time holds {epoch.words}.",))
    return (
        Instants(_unwrapped(numbers), None, ()) if factor is None else Instants(factor * _unwrapped(numbers), None, ())
    )


def instants_of_texts(texts: NDArray[Any], dates: NDArray[Any] | None = None) -> Instants | None:
    """Instants of a column of text, None if its fields are no dates and no times of day.

    Parameters
    ----------
    texts : (n,) array of str
        As ``2024-03-05 14:30:00.005``, ``05.03.2024 14:30:00,005``, ``3/5/2024 2:30 PM``, ``14:30:00.005``.
    dates : (n,) array of str, optional
        The dates that go with times of day.
    """
    texts = np.array([_usual(str(text)) for text in texts])
    dates = None if dates is None else np.array([_usual(str(text)) for text in dates])
    clocks = [_CLOCK.search(text) for text in texts]
    if not len(texts) or any(clock is None for clock in clocks[:2]) or clocks.count(None):
        return None
    days = np.zeros(len(texts), dtype=np.int64)
    given = texts if _DATE.search(str(texts[0])) else dates
    if given is not None:
        found = _days(given)
        if found is None:
            return None
        days = found
    of_day = np.array([_of_day(clock) for clock in clocks if clock is not None], dtype=np.int64)
    if given is None:
        back = np.diff(of_day) < -DAY * _NS // 2
        days[1:] += np.cumsum(back)
        seconds = (days * DAY * _NS + of_day - of_day[0]) / _NS
        note = f"The clock begins at {str(texts[0]).strip()} of a day that is not stated"
        return Instants(seconds, None, (note + (", and passes midnight." if back.any() else "."),))
    stamps = days.astype("datetime64[D]").astype("datetime64[ns]") + of_day.astype("timedelta64[ns]")
    result = _since(stamps, "")
    steps = np.diff(result.seconds)
    hour = np.flatnonzero(np.abs(np.abs(steps) - 3600) < 1 + 10 * np.median(np.abs(steps)))
    if hour.size == 1 and np.median(np.abs(steps)) < 600:
        seconds = result.seconds.copy()
        turn = round(float(steps[hour[0]]) / 3600) * 3600
        seconds[hour[0] + 1 :] -= turn
        at = np.datetime64(int(stamps.astype(np.int64)[hour[0] + 1]), "ns")
        note = (
            f"The local time jumps by {turn / 3600:+.0f} h at {_shown(at)}, as when clocks are changed; that is undone."
        )
        return Instants(seconds, result.begins, (*result.notes, note))
    return result


def _usual(text: str) -> str:
    """A date or time of day in the usual digits: of ``5-Mar-2024``, ``20240305T143000``, ``14.30.00``, ``01:59.5``."""
    text = _PACKED.sub(r"\1-\2-\3 \4:\5:\6", text, count=1)
    text = _DOTTED.sub(r"\1 \2:\3:\4", text, count=1)
    text = _MINUTES.sub(r"0:\1:\2", text, count=1)
    named = _NAMED.search(text)
    if named is None:
        return text
    month, day, year = (
        named[long] or named[short]
        for long, short in (("month", "month_first"), ("day", "day_second"), ("year", "year_last"))
    )
    number = next(
        (_MONTHS[word] for word in (month.lower(), month.lower()[:4], month.lower()[:3]) if word in _MONTHS), 0
    )
    return text.replace(named.group(), f"{year}-{number:02d}-{int(day):02d}") if number else text


def seconds_that_were_meant(first: float, step: float, factor: float) -> str:
    """What numbers count, where they are far beyond any date in the unit that is stated; empty where they are not."""
    if first * factor < 1e10:
        return ""
    return next((epoch.words for epoch in _EPOCHS if epoch.low < first < epoch.high and _is_likely(epoch, step)), "")


def _is_likely(epoch: _Epoch, step: float) -> bool:
    """Whether the steps of a count are such as samples have: between a microsecond and a day."""
    return 0.5e-6 <= step / epoch.per_second <= DAY


def _instant(epoch: _Epoch, count: Any) -> np.datetime64:
    whole = int(count // int(epoch.per_second))
    rest = float(count - whole * int(epoch.per_second)) / epoch.per_second
    return (epoch.zero + np.timedelta64(whole, "s")).astype("datetime64[ns]") + np.timedelta64(round(rest * _NS), "ns")


def _unwrapped(numbers: Seconds) -> Seconds:
    """Counts that begin anew at 2^32 or 2^16 made to go on."""
    if not np.any(numbers[1:] < numbers[:-1]):
        return numbers
    if not np.all(np.isfinite(numbers)) or numbers.min() < 0 or np.any(numbers % 1):
        return numbers
    for turn in (2.0**32, 2.0**16):
        falls = np.diff(numbers) < -0.9 * turn
        if numbers.max() < turn and falls.any():
            return numbers + turn * np.concatenate([[0], np.cumsum(falls)])
    return numbers


def was_unwrapped(numbers: Seconds) -> bool:
    """Whether a counter began anew."""
    return not np.array_equal(_unwrapped(numbers), numbers)


def _since(stamps: NDArray[Any], words: str) -> Instants:
    first = stamps[~np.isnat(stamps)][:1]
    if not first.size:
        return Instants(np.full(stamps.shape, np.nan), None, ())
    return _from_first(_in_seconds(stamps - first), first[0], (words,) if words else ())


def _in_seconds(spans: NDArray[Any]) -> Seconds:
    """Spans of time in seconds; those that are missing are NaN."""
    return np.where(np.isnat(spans), np.nan, spans.astype("timedelta64[ns]").astype(np.int64) / _NS)


def _from_first(seconds: Seconds, zero: np.datetime64, notes: tuple[str, ...]) -> Instants:
    first = float(seconds[0]) if np.isfinite(seconds[0]) else 0.0
    begins = zero + np.timedelta64(round(first * _NS), "ns")
    return Instants(seconds - first, begins, notes)


def _shown(stamp: np.datetime64) -> str:
    return str(stamp.astype("datetime64[us]")).replace("T", " ")


def _days(texts: NDArray[Any]) -> NDArray[np.int64] | None:
    """Days since 1970; of ``3/4/2024`` the month comes first if slashes divide, unless that cannot be."""
    cache: dict[str, int] = {}
    matches = [_DATE.search(text) for text in texts]
    if matches.count(None):
        return None
    firsts = {int(match["a"]) for match in matches if match and match["a"]}
    seconds = {int(match["b"]) for match in matches if match and match["b"]}
    american = all(match["sep"] == "/" for match in matches[:1] if match) and max(firsts, default=0) <= 12
    american = american or max(seconds, default=0) > 12
    days = np.empty(len(texts), dtype=np.int64)
    for place, match in enumerate(matches):
        assert match is not None
        key = match.group()
        if key not in cache:
            year, month, day = match["y"], match["m"], match["d"]
            if year is None:
                year, month, day = match["year"], match["b"], match["a"]
                if american:
                    month, day = day, month
                year = year if len(year) == 4 else f"20{year}"
            try:
                cache[key] = int(
                    np.datetime64(f"{int(year):04d}-{int(month):02d}-{int(day):02d}", "D").astype(np.int64)
                )
            except ValueError:
                return None
        days[place] = cache[key]
    return days


def _of_day(clock: re.Match[str]) -> int:
    """Nanoseconds since midnight; zones are taken off, so that a change of them is no jump."""
    hours = int(clock["h"])
    if clock["half"]:
        hours = hours % 12 + (12 if clock["half"][0] in "Pp" else 0)
    whole = (hours * 60 + int(clock["min"])) * 60 + int(clock["s"] or 0)
    zone = clock["zone"]
    if zone and zone[0] in "+-":
        minutes = int(zone[1:3]) * 60 + int(zone[-2:])
        whole -= (1 if zone[0] == "+" else -1) * minutes * 60
    return whole * _NS + int((clock["f"] or "0").ljust(9, "0"))
