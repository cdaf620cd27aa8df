"""A record without the samples that cannot be readings: they are bridged, marked, counted and named."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from jfsm.records._abstract_record import AbstractRecord, AnyRecord, Channel
from jfsm.records._channels import frozen
from jfsm.records._repeats import held
from jfsm.records._torn import far_outside

SHOWN = 3  # instants that a sentence names


def mended(record: AnyRecord) -> AnyRecord:
    """The record with samples far outside, and stretches in which a response hung, bridged and marked in `lost`.

    It notes how many and when. A record without any is returned as it is; so is one that was mended.
    """
    new: dict[tuple[str, int], Channel] = {}
    lost: dict[tuple[str, int], NDArray[np.bool_]] = {}
    notes: list[str] = []
    for key, y in record.channels.items():
        if key in record.lost:
            continue
        torn, hung = torn_and_hung(key[0], y)
        if not np.any(torn | hung):
            continue
        name = f"{key[0]} {key[1]}"
        new[key], lost[key] = _bridged(y, torn | hung), frozen(torn | hung)
        notes += [f"{name}: {words}" for words in _words(record, y, torn, hung, record.units[key[0]])]
    base = record.base_acceleration
    if base is not None and np.any(torn := far_outside("base_acceleration", base)):
        notes.append(f"base_acceleration: {torn_words(record.time, base, torn, record.units['base_acceleration'])}")
        base = _bridged(base, torn)
    return record.with_lost(new, lost, base).noted(*notes) if notes else record


def torn_and_hung(kind: str, y: Channel) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which samples of a channel are far outside, and which repeat the value that a response hung at."""
    torn, hung = far_outside(kind, y), np.zeros(y.size, dtype=bool)
    if kind in ("displacement", "velocity", "acceleration"):
        for start, length in held(_bridged(y, torn)):
            hung[start + 1 : start + length] = True
    return torn, hung & ~torn


def _words(
    record: AbstractRecord, y: Channel, torn: NDArray[np.bool_], hung: NDArray[np.bool_], unit: str
) -> Iterator[str]:
    if np.any(torn):
        yield torn_words(record.time, y, torn, unit)
    if np.any(hung):
        yield hung_words(record.time, hung)


def torn_words(time: Channel, y: Channel, torn: NDArray[np.bool_], unit: str) -> str:
    """How many samples are far outside, what they show and when."""
    where = np.flatnonzero(torn)
    values = ", ".join(f"{value:.4g}" for value in dict.fromkeys(y[where[:SHOWN]].tolist()))
    instants = ", ".join(f"{instant:.6g}" for instant in time[where[:SHOWN]])
    more = f" and {where.size - SHOWN} more" if where.size > SHOWN else ""
    samples = "1 sample is" if where.size == 1 else f"{where.size} samples are"
    return f"{samples} torn, far outside of all others ({values} {unit} at t = {instants} s{more}), and left out."


def hung_words(time: Channel, hung: NDArray[np.bool_]) -> str:
    """How many samples repeat the value before them, and when."""
    where = np.flatnonzero(hung)
    return (
        f"{where.size} samples repeat the value before them (from t = {time[max(where[0] - 1, 0)]:.6g} s on): the "
        f"sensor hung; they are left out."
    )


def _bridged(y: Channel, lost: NDArray[np.bool_]) -> Channel:
    """The channel with straight lines where samples are lost: in a long gap a curve would swing."""
    if not np.any(lost):
        return y
    index = np.arange(y.size)
    return frozen(np.where(lost, np.interp(index, index[~lost], y[~lost]), y))
