"""A simulation that can only be run: what it makes of a record, and nothing of what it is made of."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
from jaxtyping import Float

from ..records import Record
from ._parameter import as_link
from ._structure import Structure

_MOTIONS = ("displacement", "velocity", "acceleration")
_LAST = 0.9
"""Share of a run that must stay the same when the force changes after it."""
_SAME = 1e-9
"""Difference between two runs of one record, in their spread, that is rounding;"""
_AHEAD = 1e-2
"""between runs whose force is another one later, which a force that is interpolated over its samples may show;"""
_ALIKE = 0.1
"""and between what a force does at a place and in its channel, in that: between samples it may go another way."""
_PART = 0.1
"""Size of the force by which a place is tried, in that of its channel."""

Extra = Mapping[tuple[int, int], Float[np.ndarray, " n"]]
"""Forces [N] on links, each pushing its second end and pulling its first."""


class Runs:
    """A black box: remote code, a co-simulation, a spreadsheet; see `Simulation.from_runs`.

    Parameters
    ----------
    run : callable
        ``run(record)``, or ``run(record, extra)`` where there are places, gives the motion under what drives the
        record: a `Record`, a `Response`, or a mapping of ``"displacement"``, ``"velocity"`` or ``"acceleration"`` to
        (n,) or (n, dof) arrays, or to ``{dof: (n,)}``, on the record's clock.
    places : links, optional
        Where it takes forces beside those of the record.
    form : Structure, optional
        Masses and links that it has.
    """

    def __init__(self, run: Callable[..., Any], places: Iterable[tuple[int, int]] = (), form: Structure | None = None):
        if not callable(run):
            raise TypeError(
                "`run` must be a function of a record that gives the motion which the simulation makes of it; got "
                f"{run!r}. The output of one run, as a record, goes into diagnose(record, simulated=...)."
            )
        self._run, self.places, self.form = run, tuple(as_link(place) for place in places), form

    def __repr__(self) -> str:
        return f"Runs({getattr(self._run, '__name__', self._run)!s})"

    def of(self, record: Record, extra: Extra | None = None) -> Record:
        """The motion under what drives a record, and under forces at places.

        Raises
        ------
        TypeError
            If it is none of what a run may be.
        ValueError
            If it has another length, or is not finite.
        """
        made = self._run(record) if extra is None else self._run(record, dict(extra))
        if isinstance(made, Record):
            return made
        columns = made if isinstance(made, Mapping) else {kind: getattr(made, kind, None) for kind in _MOTIONS}
        motion: dict[str, Any] = {kind: columns[kind] for kind in _MOTIONS if columns.get(kind) is not None}
        if not motion:
            raise TypeError(
                "`run` must give a record, or a mapping such as {'displacement': x}; it gives "
                f"{type(made).__name__}{f' with {list(columns)}' if isinstance(made, Mapping) else ''}."
            )
        units = {kind: record.units[kind] for kind in motion if kind in record.units}
        try:
            return Record(record.time, at_rest=record.at_rest, units=units, **motion)
        except ValueError as error:
            raise ValueError(f"`run` must give samples on the record's own clock: {error}") from error

    def tried_on(self, record: Record) -> Record:
        """The run under what drives a record, after a look whether it repeats itself and does not see ahead, and
        whether a force at a place does what it does in its channel.

        Raises
        ------
        ValueError
            If two runs of the same record differ, one changes before the force does, or a place is another one.
        """
        run, again = self.of(record), self.of(record)
        if _apart(run, again, len(run)) > _SAME:
            raise ValueError("`run` must give the same whenever it is given the same record; it does not.")
        begin = int(_LAST * len(record))
        changed = self.of(_without_drive(record, begin))
        if _apart(run, changed, begin) > _AHEAD:
            raise ValueError(
                "`run` must not know the force before it acts: without the last tenth of the force its motion differs "
                "before that, too."
            )
        self._try_places(record, run)
        return run

    def _try_places(self, record: Record, run: Record) -> None:
        """Refuse a box whose forces at places are not those that it says."""
        if self.places:
            nothing = self.of(record, {place: np.zeros(len(record)) for place in self.places})
            if _apart(run, nothing, len(run)) > _SAME:
                raise ValueError("`run` must give the same under extra forces of zero as without any; it does not.")
        for place in self.places:
            channel = ("force", max(place))
            if min(place) or channel not in record.channels:
                continue
            force = _PART * np.asarray(record.channels[channel])
            more, at_place = self.of(_scaled(record, channel, 1 + _PART)), self.of(record, {place: force})
            if _apart(more, at_place, len(run)) > _ALIKE * max(_apart(run, more, len(run)), _SAME):
                raise ValueError(
                    f"`run` must do the same under an extra force at {place} as under the same force in channel "
                    f"{channel[0]} {channel[1]}; it does not. A force at (i, j) pushes j and pulls i."
                )


def _apart(one: Record, other: Record, end: int) -> float:
    """The largest difference between two runs up to a sample, in the spread of its channel."""
    pairs = [(samples, other.responses[channel]) for channel, samples in one.responses.items()]
    return max(float(np.max(np.abs(a[:end] - b[:end])) / max(float(np.std(a)), 1e-300)) for a, b in pairs)


def _scaled(record: Record, channel: tuple[str, int], factor: float) -> Record:
    """The record with more of one force."""
    return _driven_by(record, lambda one, samples: samples * (factor if one == channel else 1.0))


def _without_drive(record: Record, begin: int) -> Record:
    """The record without a force, or a base that moves, from a sample on."""
    return _driven_by(record, lambda one, samples: np.where(np.arange(len(record)) < begin, samples, 0.0))


def _driven_by(record: Record, changed: Callable[[tuple[str, int], Any], np.ndarray]) -> Record:
    """The record with what drives it changed, by channel; the base is channel ("base_acceleration", 0)."""
    columns: dict[str, Any] = {}
    for (kind, dof), samples in record.channels.items():
        one = np.asarray(samples)
        columns.setdefault(kind, {})[dof] = changed((kind, dof), one) if kind == "force" else one
    moving = record.base_acceleration
    base = None if moving is None else changed(("base_acceleration", 0), np.asarray(moving))
    units = {kind: record.units[kind] for kind in columns}
    return Record(record.time, base_acceleration=base, units=units, at_rest=record.at_rest, **columns)
