"""A simulation that can only be run: what it makes of a record, and nothing of what it is made of."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ..records import Record

_MOTIONS = ("displacement", "velocity", "acceleration")
_LAST = 0.9
"""Share of a run that must stay the same when the force changes after it."""
_SAME = 1e-9
"""Difference between two runs of one record, in their spread, that is rounding."""


class Runs:
    """A black box: remote code, a co-simulation, a spreadsheet; see `Simulation.from_runs`.

    Parameters
    ----------
    run : callable
        ``run(record)`` gives the motion under what drives the record: a `Record`, a `Response`, or a mapping of
        ``"displacement"``, ``"velocity"`` or ``"acceleration"`` to (n,) or (n, dof) arrays on the record's clock.
    """

    def __init__(self, run: Callable[[Record], Any]):
        if not callable(run):
            raise TypeError(
                "`run` must be a function of a record that gives the motion which the simulation makes of it; got "
                f"{run!r}. The output of one run, as a record, goes into diagnose(record, simulated=...)."
            )
        self._run = run

    def __repr__(self) -> str:
        return f"Runs({getattr(self._run, '__name__', self._run)!s})"

    def of(self, record: Record) -> Record:
        """The motion under what drives a record.

        Raises
        ------
        TypeError
            If it is none of what a run may be.
        ValueError
            If it has another length, or is not finite.
        """
        made = self._run(record)
        if isinstance(made, Record):
            return made
        columns = made if isinstance(made, Mapping) else {kind: getattr(made, kind, None) for kind in _MOTIONS}
        motion: dict[str, Any] = {kind: columns[kind] for kind in _MOTIONS if columns.get(kind) is not None}
        if not motion:
            raise TypeError(
                "`run` must give a record, or a mapping such as {'displacement': x}; it gives "
                f"{type(made).__name__}{f' with {list(columns)}' if isinstance(made, Mapping) else ''}."
            )
        units = {kind: record.units[kind] for kind in motion}
        try:
            return Record(record.time, at_rest=record.at_rest, units=units, **motion)
        except ValueError as error:
            raise ValueError(f"`run` must give samples on the record's own clock: {error}") from error

    def tried_on(self, record: Record) -> Record:
        """The run under what drives a record, after a look whether it repeats itself and does not see ahead.

        Raises
        ------
        ValueError
            If two runs of the same record differ, or one changes before the force does.
        """
        run, again = self.of(record), self.of(record)
        if _apart(run, again, len(run)) > _SAME:
            raise ValueError("`run` must give the same whenever it is given the same record; it does not.")
        begin = int(_LAST * len(record))
        changed = self.of(_without_drive(record, begin))
        if _apart(run, changed, begin) > _SAME:
            raise ValueError(
                "`run` must not know the force before it acts: without the last tenth of the force its motion differs "
                "before that, too."
            )
        return run


def _apart(one: Record, other: Record, end: int) -> float:
    """The largest difference between two runs up to a sample, in the spread of its channel."""
    pairs = [(samples, other.responses[channel]) for channel, samples in one.responses.items()]
    return max(float(np.max(np.abs(a[:end] - b[:end])) / max(float(np.std(a)), 1e-300)) for a, b in pairs)


def _without_drive(record: Record, begin: int) -> Record:
    """The record without a force, or a base that moves, from a sample on."""

    def before(samples) -> np.ndarray:
        return np.where(np.arange(len(record)) < begin, samples, 0.0)

    columns: dict[str, Any] = {}
    for (kind, dof), samples in record.channels.items():
        columns.setdefault(kind, {})[dof] = before(samples) if kind == "force" else np.asarray(samples)
    base = None if record.base_acceleration is None else before(record.base_acceleration)
    units = {kind: record.units[kind] for kind in columns}
    return Record(record.time, base_acceleration=base, units=units, at_rest=record.at_rest, **columns)
