"""Several records made into one: pieces one after another, or channels side by side."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jfsm.records._abstract_record import UNEVEN
from jfsm.records._channels import frozen
from jfsm.records._record import Record

DRIFT = 0.5  # of a sample, that a rate may be off by over a piece and still be the same


def join(records: Sequence[Record]) -> Record:
    """One record of consecutive pieces of one run, in order of time on one clock, with a note.

    Parameters
    ----------
    records : sequence of Record
        Pieces with the same channels, units and rate, each beginning one step after the last instant of the one before.
        Clocks are put together by their dates where all have one (`Record.begins`); where that of a piece begins anew
        otherwise, say first when: ``piece.shifted(seconds)``.

    Returns
    -------
    Record
        As many samples as all pieces together. At rest if the first piece is; named as the first piece.

    Raises
    ------
    TypeError, ValueError
        If they are no records, none, overlap, leave a gap, or differ in channels, units, rate or drive. Separate runs
        need not be joined: `fit` and `diagnose` take a list of records.
    """
    pieces, dated = _on_one_clock(_several(records))
    for number, (before, after) in enumerate(pairwise(pieces), start=1):
        _require_alike(number, before, after)
        _require_consecutive(number, before, after)
    first = pieces[0]
    columns = {
        kind: (dofs, frozen(np.asfortranarray(np.concatenate([piece._columns[kind][1] for piece in pieces]))))
        for kind, (dofs, _) in first._columns.items()
    }
    bases = [piece.base_acceleration for piece in pieces if piece.base_acceleration is not None]
    time = frozen(np.concatenate([piece.time for piece in pieces]))
    joined = first._with(time, columns, frozen(np.concatenate(bases)) if bases else None, first.at_rest)
    told = (f"{_called(piece, i)} to t = {piece.time[-1]:.6g} s" for i, piece in enumerate(pieces, start=1))
    notes = [note for piece in pieces for note in piece._notes]
    return joined.noted(*notes, *dated, f"Joined from {len(pieces)} pieces: {', '.join(told)}.")


def align(records: Sequence[Record], rate: float | None = None) -> Record:
    """One record of channels that were sampled on clocks of their own, with a note for each channel.

    Parameters
    ----------
    records : sequence of Record
        Different channels of one run, each record on its own clock and at its own rate. Where all say at which date
        their clocks read zero (`Record.begins`), they are put on that of the first; else the clocks must read the same
        at the same instant. Where one is known to be off, put it right first: ``record.shifted(seconds)``.
    rate : float, optional
        Samples per second [Hz] of the common clock; by default that of the first record.

    Returns
    -------
    Record
        All channels over the time that all records share, on a uniform clock that begins with the record that begins
        last. Where the rate falls a linear-phase filter keeps what the new clock cannot carry from folding back; where
        it rises samples are interpolated within their band; uneven samples first pass a cubic spline. A channel whose
        samples lie on the common clock is kept as it is. At rest if the record that begins last is.

    Raises
    ------
    TypeError, ValueError
        If they are no records, none, share no time, measure one channel twice, have one kind in different units or
        differ in drive, or if `rate` is not positive.
    """
    parts, dated = _on_one_clock(_several(records))
    for number, part in enumerate(parts[1:], start=2):
        if part.drive != parts[0].drive:
            raise ValueError(_differs(number, "drive", part.drive, parts[0].drive))
    start, end = max(part.time[0] for part in parts), min(part.time[-1] for part in parts)
    if start >= end:
        told = ", ".join(f"{_called(part, i)} {_extent(part)}" for i, part in enumerate(parts, start=1))
        as_read = ", or take them as they read by record.dated(None)" if dated else ""
        raise ValueError(
            f"`records` must share a stretch of time; they are {told}. {' '.join([*dated, ''])}Put their clocks right "
            f"by record.shifted(seconds){as_read}; pieces that follow one another are put together by jfsm.join."
        )
    common = parts[0].sample_rate if rate is None else rate
    channels: dict[str, dict[int, NDArray[np.float64]]] = {}
    bases: list[NDArray[np.float64]] = []
    units: dict[str, str] = {}
    time, notes, told = np.empty(0), [], []
    for number, part in enumerate(parts, start=1):
        moved, note = part._resampled(common, (start, end))
        time = moved.time
        for (kind, dof), samples in moved.channels.items():
            if dof in channels.setdefault(kind, {}):
                raise ValueError(_twice(number, f"{kind} {dof}"))
            channels[kind][dof] = samples
            told.append(f"{kind} {dof}: {note}")
        if moved.base_acceleration is not None:
            if bases:
                raise ValueError(_twice(number, "base_acceleration"))
            bases.append(moved.base_acceleration)
            told.append(f"base_acceleration: {note}")
        for kind, unit in _units(part).items():
            if units.setdefault(kind, unit) != unit:
                raise ValueError(_differs(number, f"unit of {kind}", unit, units[kind]))
        notes.extend(moved._notes)
    arguments: dict[str, Any] = {**channels, **({"base_acceleration": bases[0]} if bases else {})}
    last = max(parts, key=lambda part: part.time[0])
    merged = Record(time, **arguments, units=units, at_rest=last.at_rest, drive=parts[0].drive, name=parts[0].name)
    extent = f"{len(parts)} records are aligned over the time they share, t = {time[0]:.6g} to {time[-1]:.6g} s."
    return merged.dated(parts[0].begins).noted(*notes, *dated, *told, extent)


def _on_one_clock(records: list[Record]) -> tuple[list[Record], list[str]]:
    """The records on the clock of the first, if all say when theirs read zero, and what was done or could not be."""
    first, notes, result = records[0].begins, list[str](), records[:1]
    dates = [record.begins for record in records]
    if first is None or None in dates:
        known = [_called(record, i) for i, record in enumerate(records, start=1) if record.begins is not None]
        if known and len(records) > 1:
            notes.append(f"Only {', '.join(known)} says when its clock read zero; all clocks are taken as they read.")
        return records, notes
    for number, record in enumerate(records[1:], start=2):
        later = float((record.begins - first) / np.timedelta64(1, "ns")) * 1e-9  # pyright: ignore[reportOptionalOperand]
        if later == 0:
            result.append(record)
            continue
        moved = frozen(record.time + later)
        result.append(record._with(moved, record._columns, record._base_acceleration, record.at_rest).dated(first))
        when, way = ("after", "forward") if later > 0 else ("before", "back")
        notes.append(
            f"The clock of {_called(record, number)} reads zero {abs(later):.9g} s {when} that of "
            f"{_called(records[0], 1)}, by the dates of both; it is put {way}."
        )
    return result, notes


def _several(records: Any) -> list[Record]:
    if not isinstance(records, Record | Iterable):
        raise TypeError(f"`records` must be a list of records; got {records!r}.")
    given = [records] if isinstance(records, Record) else list(records)
    for item in given:
        if not isinstance(item, Record):
            raise TypeError(f"`records` must hold records; one is {type(item).__name__}. Read or make a Record of it.")
    if not given:
        raise ValueError("`records` must hold at least one record; it is empty. Pass a list of records.")
    return given


def _require_alike(number: int, before: Record, after: Record) -> None:
    """Refuse a piece that differs from the one before, which is that `number`, in anything but its samples."""
    if _measured(after) != _measured(before):
        raise ValueError(_differs(number + 1, "channels", _measured(after), _measured(before)))
    if after.drive != before.drive:
        raise ValueError(_differs(number + 1, "drive", after.drive, before.drive))
    for kind, unit in _units(after).items():
        if unit != before.units[kind]:
            raise ValueError(_differs(number + 1, f"unit of {kind}", unit, before.units[kind]))
    if abs(after.dt / before.dt - 1.0) * min(len(after), len(before)) > DRIFT:
        rates = (f"{piece.sample_rate:.6g} Hz" for piece in (after, before))
        raise ValueError(_differs(number + 1, "rate", *rates, remedy="Bring both to one: record.resample(rate)."))


def _require_consecutive(number: int, before: Record, after: Record) -> None:
    step, gap = before.dt, float(after.time[0] - before.time[-1])
    if abs(gap / step - 1.0) <= UNEVEN:
        return
    begins = f"number {number + 1} begins at {after.time[0]:.6g} s"
    if gap < step:
        raise ValueError(
            f"`records` must follow one another on one clock; {begins}, number {number} ends at {before.time[-1]:.6g} "
            f"s. Put them in order and cut off what overlaps; if its clock began anew, put it right by "
            f"record.shifted(seconds). Separate runs need no joining: pass fit or diagnose the list."
        )
    raise ValueError(
        f"`records` must follow one another without a gap; {begins}, {gap:.6g} s after number {number} ended, with "
        f"steps of {step:.6g} s. Do not join across it: pass fit or diagnose the list of records."
    )


def _units(record: Record) -> Mapping[str, str]:
    """Unit of every kind that was measured."""
    measured = [*dict.fromkeys(kind for kind, _ in record.channels), *_base(record)]
    return {kind: record.units[kind] for kind in measured}


def _measured(record: Record) -> str:
    return ", ".join([*(f"{kind} {dof}" for kind, dof in record.channels), *_base(record)]) or "none"


def _base(record: Record) -> list[str]:
    return [] if record.base_acceleration is None else ["base_acceleration"]


def _called(record: Record, number: int) -> str:
    return repr(record.name) if record.name else f"number {number}"


def _extent(record: Record) -> str:
    return f"from {record.time[0]:.6g} to {record.time[-1]:.6g} s"


def _twice(number: int, channel: str) -> str:
    return (
        f"`records` must measure every channel once; number {number} has {channel} again. Leave one of them out, or "
        f"give it another dof; pieces that follow one another are put together by jfsm.join."
    )


def _differs(number: int, what: str, here: str, there: str, remedy: str = "Read them alike.") -> str:
    return f"`records` must agree in {what}; number {number} has {here}, not {there}. {remedy}"
