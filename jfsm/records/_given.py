"""What is given in the place of a record, or of several: refused unless it is one, or goes with the others."""

from collections.abc import Iterable, Mapping, Sequence
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jfsm.records._record import Record

_WINDOW, _DISTINCT = 32, 16
"""Readings that are compared, and how many of them must differ: rest is the same in all records."""


def as_record(given: Any, name: str = "record") -> Record:
    """What is given, if it is a record.

    Raises
    ------
    TypeError
        If it is none, with the way to one.
    """
    if isinstance(given, Record):
        return given
    remedy = f"Read the file first: jfsm.read({str(given)!r}, ...)." if isinstance(given, str | PathLike) else (
        "Make one of arrays by jfsm.Record(time, force=...), or of a file by jfsm.read(path, ...)."
    )  # fmt: skip
    raise TypeError(f"`{name}` must be a jfsm.Record; got {_word(given)}. {remedy}")


def records_of(given: Any, name: str = "record") -> list[Record]:
    """The records that are given, one or several.

    Raises
    ------
    ValueError, TypeError
        If there are none, or one is no record.
    """
    if isinstance(given, Record):
        return [given]
    no_list = isinstance(given, str | bytes | PathLike | Mapping) or hasattr(given, "dtype")  # nor an array
    if no_list or not isinstance(given, Iterable):
        return [as_record(given, name)]
    found = [as_record(item, name) for item in given]
    if not found:
        raise ValueError(f"`{name}` must hold at least one record; the sequence is empty.")
    return found


def require_one_unit(records: Sequence[Record], others: Sequence[Record] = (), name: str = "record") -> None:
    """Refuse records of which one kind of channel has several units, as metres and volts.

    Raises
    ------
    ValueError
        With the first kind whose units differ; it names the argument that holds the `others`, or the records.
    """
    first = records[0]
    for record in [*records[1:], *others]:
        for kind in {kind for kind, _ in record.channels} & {kind for kind, _ in first.channels}:
            if record.units[kind] != first.units[kind]:
                raise ValueError(
                    f"`{name}` must hold records of one set of units; {kind} is in {first.units[kind]} in one and in "
                    f"{record.units[kind]} in another. Say what the numbers are where they are read: "
                    f"units={{{kind!r}: ...}}, or sensitivity={{...}} of raw readings."
                )


def shared_readings(records: Sequence[Record], others: Sequence[Record] = ()) -> tuple[int, int] | None:
    """The first pair of records, counted through both, of which one holds readings of the other; None without any.

    What drives may be the same in two runs of one test, what answers never is to the last bit. Without `others` all are
    compared among themselves; else each of these with each record.
    """
    every = [*records, *others]
    for later in range(len(records) if others else 1, len(every)):
        for earlier in range(len(records) if others else later):
            if _share(every[earlier], every[later]):
                return earlier, later
    return None


def check_together(records: Sequence[Record]) -> None:
    """Refuse records that cannot be judged together: of several units, or that hold the same readings.

    Raises
    ------
    ValueError
        It says which.
    """
    require_one_unit(records)
    if (pair := shared_readings(records)) is not None:
        raise ValueError(
            f"`record` must hold runs that differ; record {pair[1] + 1} holds readings of record {pair[0] + 1}, which "
            "would count twice. Leave one of them out."
        )


def _share(one: Record, other: Record) -> bool:
    both = [channel for channel in one.answers if channel in other.answers]
    return bool(both) and all(_overlap(one.answers[c], other.answers[c]) for c in both)


def _overlap(one: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
    """Whether the beginning, the middle or the end of the shorter one stands in the longer one, to the last bit."""
    short, long = sorted((one, other), key=len)
    if short.size < _WINDOW:
        return short.size == long.size and np.array_equal(short, long) and np.unique(short).size > short.size // 2
    for begin in (0, (short.size - _WINDOW) // 2, short.size - _WINDOW):
        window = short[begin : begin + _WINDOW]
        if np.unique(window).size < _DISTINCT:
            continue
        for place in np.flatnonzero(long[: long.size - _WINDOW + 1] == window[0]):
            if np.array_equal(long[place : place + _WINDOW], window):
                return True
    return False


def _word(given: Any) -> str:
    return "nothing" if given is None else type(given).__name__
