"""Channels as dictionaries, after the SDyPy enhancement proposal 5 (unified time series)."""

from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from typing import Any

import numpy as np

from jfsm.records.formats.base import Contents

QUANTITIES = {"f": "force", "d": "displacement", "v": "velocity", "a": "acceleration"}
NEEDED = ("name", "data", "unit_str")
ROUNDING = 1e-6  # of a step: instants as close as this to those of a rate are not listed
_LETTERS = {kind: letter for letter, kind in QUANTITIES.items()} | {"base_acceleration": "a"}


def contents_of_channels(channels: Mapping[str, Any] | Iterable[Mapping[str, Any]]) -> Contents:
    """What a list of channels holds; a single channel may come without a list.

    Raises
    ------
    TypeError
        If a channel is not a dictionary.
    ValueError
        If a channel lacks a key or two have one name.
    """
    given = _checked([channels] if isinstance(channels, Mapping) else list(channels))
    begins = min(filter(None, map(_start, given.values())), default=None)
    begun = sorted({str(channel["start_timestamp"]) for channel in given.values() if channel.get("start_timestamp")})
    return Contents(
        {name: np.asarray(channel["data"]) for name, channel in given.items()},
        {name: str(channel["unit_str"]) for name, channel in given.items() if channel["unit_str"]},
        clocks={name: _clock(channel) + _late(channel, begins) for name, channel in given.items()},
        kinds={
            name: QUANTITIES[channel["quantity"]]
            for name, channel in given.items()
            if channel.get("quantity") in QUANTITIES
        },
        notes=(f"Measured from {', '.join(begun)}.",) if begun and begins is None else (),
        begins=begins,
    )


def _checked(given: list[Any]) -> dict[str, Mapping[str, Any]]:
    """The channels by name, each with what it needs and a name of its own."""
    for place, channel in enumerate(given):
        if not isinstance(channel, Mapping):
            raise TypeError(
                f"`channels` must hold dictionaries; number {place} is {type(channel).__name__}. See SEP 5 of SDyPy."
            )
        missing = [key for key in NEEDED if key not in channel]
        if "time" not in channel and "fs" not in channel:
            missing.append("time or fs")
        if missing:
            raise ValueError(
                f"`channels` must hold dictionaries with name, data, unit_str, and time or fs; number {place} "
                f"({channel.get('name')!r}) lacks {', '.join(missing)}. Add it."
            )
    names = [str(channel["name"]) for channel in given]
    twins = sorted({name for name in names if names.count(name) > 1})
    if twins:
        raise ValueError(f"`channels` must have names of their own; {twins} occur more than once. Rename them.")
    return dict(zip(names, given, strict=True))


def channels_of(contents: Contents) -> list[dict[str, Any]]:
    """One dictionary for each channel of the contents of a record."""
    instants = np.asarray(contents.arrays["time"])
    step = float(instants[-1] - instants[0]) / (instants.size - 1)
    counted = np.arange(instants.size) * step
    even = bool(np.all(np.abs(instants - instants[0] - counted) < ROUNDING * step))
    clock: dict[str, Any] = {"fs": 1.0 / step} if even else {}
    if not even or abs(instants[0]) > ROUNDING * step:
        clock["time"] = instants
    return [
        {
            "name": name,
            "data": np.array(array),
            "unit_str": contents.units[name],
            "quantity": _LETTERS[name.rstrip("0123456789").rstrip("_")],
            **clock,
        }
        for name, array in contents.arrays.items()
        if name != "time"
    ]


def _start(channel: Mapping[str, Any]) -> np.datetime64 | None:
    """When a channel began, in UTC where it states a zone; None if it does not say so as a date."""
    try:
        stamp = datetime.fromisoformat(str(channel.get("start_timestamp") or ""))
    except ValueError:
        return None
    stamp = stamp.astimezone(UTC).replace(tzinfo=None) if stamp.tzinfo else stamp
    return np.datetime64(stamp, "ns")


def _late(channel: Mapping[str, Any], begins: np.datetime64 | None) -> float:
    """Seconds by which a channel began after the first of all."""
    start = _start(channel)
    return 0.0 if start is None or begins is None else float((start - begins) / np.timedelta64(1, "ns")) * 1e-9


def _clock(channel: Mapping[str, Any]) -> np.ndarray:
    if channel.get("time") is not None:
        return np.asarray(channel["time"], dtype=np.float64)
    return np.arange(len(channel["data"])) / float(channel["fs"])
