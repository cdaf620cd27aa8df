"""A structure that stands for a simulation of which only runs are known."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import numpy as np

from .._limit import Limit
from ..dynamics import simulate
from ..identification import Fit, fit, rough_model
from ..plant import Reconstruction
from ..records import Record
from ..structures import Structure, causes
from ._conduct import conduct
from .search.steps import Progress, Steps
from .thresholds import THRESHOLDS

_ENOUGH, _EXACT = 0.25, 0.02
"""Error of a linear stand-in, in negligible ones, below which no law is looked for, and none follows better."""
_HARDLY_KNOWN = 2.0
"""Trust in the values of a linear stand-in of a simulation that is not linear, as a logarithm."""
_WITHIN = 7.0
"""Ratio of the ends of an interval from which a dashpot where no spring is is no part of the simulation."""
_WORTH_SAYING = 1e-3
"""Error of a stand-in that is said in numbers."""
_WAYS: tuple[Reconstruction, ...] = ("band-limited", "linear", "hold")
_BETWEEN = {
    "linear": " It takes the force for straight between samples.",
    "hold": " It holds the force between samples, half a step late.",
}


class StandIn(NamedTuple):
    """A structure that moves as a simulation does, and the error of its free runs, as a share of the motion."""

    structure: Structure
    error: float
    drive: Reconstruction = "band-limited"
    """What the simulation makes of a force between its samples."""

    @property
    def words(self) -> str:
        """What is said of it beside a verdict."""
        parts = ", ".join(f"{path} = {value:.4g}" for path, value in self.structure.values().items())
        error = f"{self.error:.1%}" if self.error > _WORTH_SAYING else f"better than {_WORTH_SAYING:.1%}"
        between = _BETWEEN.get(self.drive, "")
        return (
            "Of the simulation only its runs are known. A structure stands for it and follows them to "
            f"{error} of the motion: {parts}.{between} Values are those of this structure."
        )


def stand_in(
    simulated: Sequence[Record],
    model: Structure | None,
    key: jax.Array,
    limit: Limit,
    progress: Progress | None = None,
) -> StandIn:
    """A structure that moves as these runs of a simulation do.

    Its linear part is fitted to them, and what that lacks is found as the cause of any other record is.

    Parameters
    ----------
    simulated : sequence of Record
        Runs of the simulation, with what drove them.
    model : Structure, optional
        Masses and links that the simulation has; by default those that the runs show between all that moves.

    Raises
    ------
    ValueError
        If no structure is found that follows the runs so well that what the simulation gets wrong could be seen beside
        it.
    """
    form = rough_model(simulated) if model is None else model
    found = _linear(form, simulated)
    if found.error > _ENOUGH * THRESHOLDS.negligible:
        found = min(found, _with_laws(found, simulated, key, limit, progress), key=lambda one: one.error)
    if found.error > THRESHOLDS.negligible and not limit.over:
        raise ValueError(
            f"`simulated` is followed by no structure of the catalogue better than to {found.error:.1%} of its motion; "
            f"{THRESHOLDS.negligible:.0%} at most may be left, or what is missing in the simulation could not be told "
            "from what is missing in its stand-in. Give a `model` with the masses, links and laws that the simulation "
            "has, or the simulation itself: jfsm.Simulation(acceleration, dof=...)."
        )
    return found


def _linear(form: Structure, simulated: Sequence[Record]) -> StandIn:
    """The form with the values of the runs, the force between its samples taken as it follows them best."""
    found: list[StandIn] = []
    for way in _WAYS:
        structure = _fitted(form, simulated, way)
        found.append(StandIn(structure, max(_strays(structure, run, way) for run in simulated), way))
        if found[-1].error <= _EXACT * THRESHOLDS.negligible or not _forced(simulated):
            break
    return min(found, key=lambda one: one.error)


def _forced(simulated: Sequence[Record]) -> bool:
    """Whether the forces drive these runs, so that it matters what they do between samples."""
    return any(run.drive == "force" and run.driven for run in simulated)


def _fitted(form: Structure, simulated: Sequence[Record], way: Reconstruction) -> Structure:
    """The form with the values of the runs, without dashpots that the runs do not show where no spring is.

    Where no force is known that could set the scale, its first mass does.
    """
    found = fit(form, simulated, fixed=() if _measures_force(simulated) else ("mass@1",), reconstruction=way)
    springs = {term.at for term in form.terms if term.kind == "stiffness"}
    kept = [
        term
        for term in found.structure.terms
        if term.kind != "damping" or term.at in springs or _is_sure(found, f"damping@{term.place}.c")
    ]
    structure = found.structure.having(terms=kept, sensors=form.sensors)
    return structure if len(kept) == len(form.terms) else _fitted(structure, simulated, way)


def _measures_force(simulated: Sequence[Record]) -> bool:
    return any(kind == "force" for run in simulated for kind, _ in run.channels)


def _is_sure(found: Fit, path: str) -> bool:
    low, high = found.intervals.get(path, (1.0, 1.0))
    return low > 0 and high < _WITHIN * low


def _strays(structure: Structure, run: Record, way: Reconstruction) -> float:
    """Error of a free run of the structure, as a share of the simulation's motion."""
    response = simulate(structure, run, reconstruction=way)
    if not response.result.ok:
        return np.inf
    ours = response.readings(run)
    errors = [(np.asarray(y) - ours[channel], y) for channel, y in run.answers.items()]
    return max(float(np.std(left) / max(float(np.std(y)), 1e-300)) for left, y in errors)


def _with_laws(
    linear: StandIn, simulated: Sequence[Record], key: jax.Array, limit: Limit, progress: Progress | None
) -> StandIn:
    """The structure with what it lacks of the simulation."""
    fitted = linear.structure
    way = None if linear.drive == _WAYS[0] else linear.drive  # else it is asked what the force does there
    laws = [name for name, cause in causes().items() if not cause.is_sensor]
    hardly = {name: _HARDLY_KNOWN for name in ("mass", "stiffness", "damping") if fitted.select(name)}
    steps = Steps(progress, 4)
    d = conduct(simulated, fitted.uncertain(**hardly), 0.3, laws, 2, key, None, way, limit, steps)
    error = np.inf if d.gain is None else d.gain.after
    return StandIn(d.extended.having(sensors=fitted.sensors, trust=fitted.trust), error, linear.drive)


def driven_alike(simulated: Record, record: Record) -> Record:
    """A run with the forces of the record that it was made for, where its file does not hold them.

    Raises
    ------
    ValueError
        If their clocks differ, or they are in units of different kinds.
    """
    _check_units(simulated, record)
    if simulated.driven or not record.driven:
        return simulated
    if not on_one_clock(simulated, record):
        raise ValueError(
            "`simulated` holds nothing that drives it, and its clock is not that of the record, whose force could be "
            "taken: give it a force channel, or the same instants as the record."
        )
    columns: dict[str, Any] = {}
    for (kind, dof), samples in (*_forces(record), *simulated.responses.items()):
        columns.setdefault(kind, {})[dof] = np.asarray(samples)
    units = {kind: (record if kind == "force" else simulated).units[kind] for kind in columns}
    made = Record(
        record.time, base_acceleration=record.base_acceleration, units=units, at_rest=simulated.at_rest,
        drive=record.drive, name=simulated.name, **columns,
    )  # fmt: skip
    return made.noted(*simulated.notes)


def _forces(record: Record) -> list[tuple[tuple[str, int], Any]]:
    return [(channel, samples) for channel, samples in record.channels.items() if channel[0] == "force"]


def _check_units(simulated: Record, record: Record) -> None:
    """Refuse a run in other units than the record, where both hold a kind of channel."""
    for kind in sorted({kind for kind, _ in simulated.channels} & {kind for kind, _ in record.channels}):
        if simulated.units[kind] != record.units[kind]:
            raise ValueError(
                f"`simulated` must be in the units of the record; its {kind} is in {simulated.units[kind]}, that of "
                f"the record in {record.units[kind]}. State the units of both."
            )


def on_one_clock(one: Record, other: Record) -> bool:
    """Whether two records were sampled at the same instants."""
    return len(one) == len(other) and bool(np.max(np.abs(one.time - other.time)) < 0.01 * one.dt)


def departure(simulated: Record, record: Record) -> str:
    """How far a run is from the record, in words; empty where they have no clock or no channel in common."""
    if not on_one_clock(simulated, record):
        return ""
    ours, apart = simulated.answers, list[str]()
    for (kind, j), y in record.answers.items():
        if (kind, j) in ours:
            apart.append(f"{kind} {j} by {np.std(y - ours[kind, j]) / np.std(y):.1%}")
    return f"The simulation's own run departs from the record: {', '.join(apart)} of its spread." if apart else ""
