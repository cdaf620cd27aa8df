"""Binary files of HBM catman (.bin), after the maker's description of versions 5006 to 5012."""

import re
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np

from jfsm.records._units import seconds_in
from jfsm.records.formats.base import AbstractFormat, Contents, Lazy, left_out, told_apart

VERSIONS = range(5006, 5013)
STRINGS = 32  # reserved; the first tells where the samples end
NUMBERS, REALS = 0, 4  # formats of channels; others are texts and objects
_LONG_COMMENT = 3000  # bytes, of which the first of a file may not show the end
OVERFLOW = -1e6  # what catman writes where it could not measure
_EPOCH = np.datetime64("1899-12-30", "us")
_DAY = 86_400 * 1_000_000  # µs
_PLACE_OF_EXPORT, _PLACE_OF_CONTENT = 140, 144  # in the extended header of a channel
_WIDTHS = {0: ("<f8", 0), 1: ("<f4", 0), 2: ("<u2", 16)}  # by export: numbers, and bytes of limits ahead of them
_FULL = 32767
_TIME = re.compile(r"(time|zeit)\b", re.IGNORECASE)
_AGREES = 1e-3  # of a step
_SINGLE = 2.0**-23  # rounding of times that were kept in single precision


class CatmanFormat(AbstractFormat):
    """Channels by name, with the unit, rate and start that each of them states. Read only.

    The clock is made from the step in the header of a channel, for exports in 2 bytes round their column of times. That
    column counts where it says something else. What catman marks as overflow is a gap.
    """

    name: ClassVar[str] = "catman"
    suffixes: ClassVar[tuple[str, ...]] = ()

    def recognises(self, begins_with: bytes, path: Path) -> bool:
        if len(begins_with) < 8:
            return False
        version, start, comment = struct.unpack_from("<hih", begins_with)
        if version not in VERSIONS or start <= 8 or comment < 0:
            return False
        cursor = _Cursor(begins_with[6:])
        try:
            return comment > _LONG_COMMENT or _reserved(cursor)[1] > 0
        except struct.error:
            return False

    def load(self, path: Path) -> Contents:
        try:
            with path.open("rb") as stream:
                channels = _channels(path, stream.read(struct.unpack_from("<hi", stream.read(6))[1] - 6))
        except (struct.error, OverflowError) as error:
            raise ValueError(
                f"{path.name} must be a catman file; its headers cannot be made out ({error}). It was cut short or is "
                f"damaged: copy it again."
            ) from error
        read = [channel for channel in channels if not channel.left_out]
        left = [f"{channel.name} ({channel.left_out})" for channel in channels if channel.left_out]
        names, aliases = told_apart([channel.name for channel in read])
        by_name = dict(zip(names, read, strict=True))
        clocks = {name: one for name, channel in by_name.items() if (one := _clock(path, channel, read)) is not None}
        begun = {name: start for name in clocks if (start := by_name[name].begins) is not None}
        begins = min(begun.values(), default=None)

        def clock(name: str) -> np.ndarray:
            late = 0.0 if begins is None or name not in begun else float((begun[name] - begins).astype(np.int64)) * 1e-6
            return late + clocks[name].seconds(path)

        behind = path.stat().st_size - max(channel.start + channel.size for channel in channels)
        more = [f"The file goes on for {behind} bytes behind its samples: if bytes came into it, numbers are wrong."]
        notes = (
            *left_out(left),
            *(more if behind else []),
            *dict.fromkeys(one.note for one in clocks.values() if one.note),
        )
        return Contents(
            Lazy(names, lambda name: _values(path, by_name[name])),
            {name: channel.unit for name, channel in by_name.items() if channel.unit},
            clocks=Lazy(clocks, clock),
            notes=notes,
            aliases=aliases,
            begins=None if begins is None else begins.astype("datetime64[ns]"),
        )


class _Channel(NamedTuple):
    """What the header of a channel says, and where its numbers lie."""

    name: str
    unit: str
    count: int
    number: str
    limits: int
    begins: np.datetime64 | None
    step: float  # s
    left_out: str
    start: int = 0

    @property
    def size(self) -> int:
        """Bytes in the file."""
        return self.limits + self.count * np.dtype(self.number).itemsize


class _Clock(NamedTuple):
    """Even instants, or those of a column of times."""

    count: int
    step: float
    column: _Channel | None = None
    factor: float = 1.0  # seconds in the unit of the column
    note: str = ""
    doubt: str = ""  # why there is none

    def seconds(self, path: Path) -> np.ndarray:
        """Instants [s]."""
        if self.doubt:
            raise ValueError(f"{path.name} {self.doubt}")
        if self.column is None:
            return np.arange(self.count) * self.step
        return self.factor * _values(path, self.column)


class _Cursor:
    """Reads one thing after another."""

    def __init__(self, data: bytes):
        self._data, self.place = data, 0

    def take(self, kind: str) -> Any:
        """A number."""
        (value,) = struct.unpack_from(f"<{kind}", self._data, self.place)
        self.place += struct.calcsize(f"<{kind}")
        return value

    def bytes(self, length: int) -> bytes:
        """So many bytes, all of which are there."""
        if length < 0 or self.place + length > len(self._data):
            raise struct.error(f"{length} bytes from byte {self.place} on, of {len(self._data)}")
        self.place += length
        return self._data[self.place - length : self.place]

    def text(self, kind: str = "h") -> str:
        """A length and a text."""
        return self.bytes(self.take(kind)).decode("cp1252", "replace").strip(" \0")


def _channels(path: Path, head: bytes) -> list[_Channel]:
    """The channels in the order of their numbers in the file, which they fill without a rest.

    Raises
    ------
    ValueError
        If the numbers end elsewhere than the file states, or the file ends before.
    struct.error
        If the headers are no headers.
    """
    cursor = _Cursor(head)
    reserved, count = _reserved(cursor)
    cursor.take("i")
    cursor.bytes(4 * count)
    if cursor.take("i"):
        raise ValueError(f"{path.name} holds samples that catman has compressed, which is not read. Export it as text.")
    start = place = len(head) + 6
    found = []
    for _ in range(count):
        channel = _channel(cursor)
        if channel.count < 0 or channel.step < 0:
            raise struct.error(f"{channel.count} samples {channel.step} s apart in {channel.name!r}")
        found.append(channel._replace(start=place))
        place += channel.size
    size, end = path.stat().st_size, int(reserved) if reserved.isdecimal() else place
    if not found or place > size or end != place:
        raise ValueError(
            f"{path.name} must be a whole catman file; its {count} channels take the bytes from {start} to {place}, "
            f"and it states {end} and has {size}. It was cut short or is damaged: copy it again."
        )
    return found


def _reserved(cursor: _Cursor) -> tuple[str, int]:
    """The text that tells where the samples end, and the number of channels."""
    cursor.text()
    texts = [cursor.text() for _ in range(STRINGS)]
    return texts[0], cursor.take("h")


def _channel(cursor: _Cursor) -> _Channel:
    cursor.take("h")
    count, name, unit, _ = cursor.take("i"), cursor.text(), cursor.text(), cursor.text()
    kind, width, _ = cursor.take("h"), cursor.take("h"), cursor.take("d")
    more = cursor.bytes(cursor.take("i"))
    cursor.take("h")  # linearisation and its kind
    cursor.bytes(8 * cursor.take("B"))
    cursor.take("h")
    cursor.text()
    cursor.text("i")
    days, step = struct.unpack_from("<2d", more.ljust(16, b"\0"))
    if kind not in (NUMBERS, REALS):
        return _Channel(name, unit, count, f"V{max(width, 1)}", 0, None, 0.0, "texts")
    export = more[_PLACE_OF_EXPORT] if len(more) > _PLACE_OF_EXPORT else 0
    if export not in _WIDTHS:
        raise struct.error(f"numbers of {name!r} exported as {export}")
    content = more[_PLACE_OF_CONTENT] if len(more) > _PLACE_OF_CONTENT else 0
    left_out = "" if content in (0, ord(" ")) else "no samples over time"
    usual = np.isfinite(step) and np.isfinite(days) and abs(days) < 1e6
    begins = _EPOCH + np.timedelta64(round(days * _DAY), "us") if usual and days > 0 else None
    return _Channel(name, unit, count, *_WIDTHS[export], begins, step * 1e-3 if usual else 0.0, left_out)


def _values(path: Path, channel: _Channel) -> np.ndarray:
    """The numbers of a channel; those that catman marks as overflow are gaps."""
    if not channel.count:
        return np.empty(0)
    raw = np.memmap(path, channel.number, "r", channel.start + channel.limits, (channel.count,))
    values = np.asarray(raw, dtype=np.float64)
    if channel.limits:
        low, high = np.memmap(path, "<f8", "r", channel.start, (2,))
        values = values / _FULL * (high - low) + low
    return np.where(values == OVERFLOW, np.nan, values)


def _clock(path: Path, channel: _Channel, channels: Sequence[_Channel]) -> _Clock | None:
    """The clock of a channel: its step, or the one column of as many times where that says something else."""
    columns = [each for each in channels if _seconds(each) and each.count == channel.count]
    columns = [each for each in columns if not each.step or abs(each.step / (channel.step or each.step) - 1) < 1e-6]
    even = _Clock(channel.count, channel.step)
    if channel.step and any(_agrees(path, even, column) for column in columns):
        return even
    if channel.step and len(columns) != 1:
        return even
    if len(columns) > 1:
        several = " or ".join(repr(column.name) for column in columns)
        doubt = f"must be told which times belong to {channel.name!r}, which states no step: {several}. Pass time=..."
        return even._replace(doubt=doubt)
    if not columns:
        return None
    (column,) = columns
    note = f"The clock of channels with {channel.count} samples is {column.name!r}"
    note += f", which does not run in the steps of {channel.step:.9g} s that they state." if channel.step else "."
    return _Clock(channel.count, 0.0, column, _seconds(column), note)


def _agrees(path: Path, even: _Clock, column: _Channel) -> bool:
    """Whether a column of times, rounded as it is kept, may be the even instants."""
    times, seconds = _seconds(column) * _values(path, column), even.seconds(path)
    rounded = np.abs(times).max(initial=0.0) * (1 / _FULL if column.limits else _SINGLE)
    return bool(np.all(np.abs(times - seconds) <= _AGREES * even.step + rounded))


def _seconds(channel: _Channel) -> float:
    """Seconds in the unit of a channel that holds the times of others; 0 of any other."""
    return (seconds_in(channel.unit) or 0.0) if _TIME.match(channel.name) else 0.0
