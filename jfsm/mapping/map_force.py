"""The force state map of a record: the force of a link, or what a model lacks of it, over displacement and velocity."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .._programs import programs_kept
from .._result import Estimate
from .._types import evenly_taken
from ..estimation import RestoringForce, restoring_force
from ..records import OutUnits, Record, as_record, out_units
from ..structures import Parameter, Structure, check_order
from ..surrogates import RKPM, Discontinuity, Kriging, find_discontinuities
from .learned_map import LearnedMap, check_method, learn
from .plot_data import GRID, shown_map, shown_points

_READINGS = 5000
"""Readings that a map is learned from; more of a trajectory are near duplicates."""
_UNSURE = 2.0
"""Medians of the force's standard error beyond which a reading is left out: a smoother knows the ends less well."""
_BLURRED = 0.02
"""Standard error of a state, as a share of its standard deviation, from which the map is noticeably flattened."""
_SIDES = 3.0
"""Standard errors of a state within which a reading may be on either side of a jump."""
_LITTLE = 0.25
"""Share of the box below which a record says little of the force in it."""
_QUANTILE_95 = 1.959964
_COEFFICIENTS = {
    (1, 0): Parameter("stiffness", force=1, length=-1),
    (0, 1): Parameter("damping", force=1, length=-1, time=1),
    (3, 0): Parameter("cubic stiffness", force=1, length=-3),
}
_DERIVATIVES = ("dF/dx", "dF/dv", "d³F/dx³ / 6")


@dataclass(frozen=True, repr=False)
class MappedForce:
    """A force state map with its errors and its limits.

    Attributes
    ----------
    force_map : RKPM or Kriging
        ``model + force_map.on(at)`` is a structure with it; ``force_map.save(path)`` writes it.
    at : link (i, j)
    readings : RestoringForce
        What it was learned from, all samples of the record.
    discontinuities : tuple of Discontinuity
        Lines across which the force jumps or kinks; an RKPM map does not smooth across them.
    error : float
        Root mean square of the leave-one-out errors, in the unit of the force; of what is left at the readings where
        map and motion were learned together.
    centre : (2,) array
        State nearest to rest that the record visited: (0, 0) where it could be.
    coefficients : dict of str to Estimate
        Derivatives at the centre, with 95 % intervals; those that the map has.
    visited : float
        Share of the box between the lowest and the highest displacement and velocity where readings were taken.
    notes : tuple of str
        What a reader has to know about the map.
    data : dict
        Everything that the page shows, as plain types.
    """

    force_map: RKPM | Kriging
    at: tuple[int, int]
    readings: RestoringForce
    discontinuities: tuple[Discontinuity, ...]
    error: float
    centre: np.ndarray
    coefficients: dict[str, Estimate]
    visited: float
    notes: tuple[str, ...]
    data: dict[str, Any]

    def __repr__(self) -> str:
        return f"<MappedForce at {self.at}, {type(self.force_map).__name__}, error {self.error:.3g}>"

    def print(self, units: OutUnits = None) -> None:
        """The map in figures, on the terminal, in other units if they are given, as ``"in,lbf,deg"``."""
        from ..reporting import print_force_map, shown_in

        with shown_in(out_units(units)):
            print_force_map(self.data)

    def report(self, path: str | Path, units: OutUnits = None) -> None:
        """Write a self-contained HTML page; the file appears whole or not at all. `units` as of `print`."""
        from ..reporting import render_force_map, shown_in, write_text_atomically

        with shown_in(out_units(units)):
            write_text_atomically(path, render_force_map(self.data))


@programs_kept()
def map_force(
    record: Record,
    model: Structure | None = None,
    mass: float | None = None,
    at: tuple[int, int] | None = None,
    method: str = "rkpm",
    order: int | None = None,
) -> MappedForce:
    """The force state map of a record: all of a link's force, or what a model lacks of it.

    Parameters
    ----------
    record, model, mass, at
        As for `restoring_force`.
    method : "rkpm", "kriging" or "joint"
        What learns the map. "joint" is kriging together with the motion, by `estimate_force_map`: of all the force on a
        single mass, and slower, but noise in displacement and velocity does not flatten it, and its intervals know of
        all noise.
    order : int, optional
        Of an RKPM map the order of its polynomials, 2 or 3 by the readings when None (a map of order 1 cannot be
        simulated); of a kriging map that of its trend, 2 when None.

    Returns
    -------
    MappedForce

    Raises
    ------
    ValueError
        If an argument is not what it must be, or the states determine no map.

    Notes
    -----
    Readings that follow one another share the errors of the smoothed motion. Standard errors therefore count so many
    readings as one as the residuals are correlated over: they are multiplied by the root of 1 + 2 Σ ρ_k. Errors of the
    states themselves, which flatten a map, are not in them; a note says where they matter. Nor is what smoothing makes
    of a jump that was not found, as that of dry friction from displacement alone: intervals near it are too narrow.
    All this is of maps that are learned after the motion, not together with it.
    """
    check_order("jfsm.map_force(record, model)", model, record)
    as_record(record)
    check_method(method, mass, order)
    readings = restoring_force(record, model, mass, at)
    known = np.flatnonzero(readings.std <= _UNSURE * np.median(readings.std))
    taken = known[evenly_taken(known.size, _READINGS)]
    states, force = readings.states[taken], readings.force[taken]
    try:
        edges = find_discontinuities(states, force)
        sided = ~_torn(states, readings.states_std[taken], edges)
        states, force = states[sided], force[sided]
        learned = learn(method, record, mass, states, force, edges, order)
        centre, coefficients = _at_centre(learned, states, force, record.units)
        curves = _curves(learned, readings.at, states, force, centre, record.units)
    except RuntimeError as error:  # the map has no value somewhere in the box
        raise ValueError(f"`record` does not determine a map: {error}") from error
    visited = float(np.mean(curves["map"]["visited"]))
    notes = tuple(_notes(learned, readings, states, edges, visited, known.size, int(np.sum(~sided))))
    data = {
        "name": record.name,
        "samples": len(record),
        "duration": record.duration,
        "sample_rate": 1 / record.dt,
        "at": list(readings.at),
        "lacking": readings.lacking,
        "units": {kind: record.units[kind] for kind in ("displacement", "velocity", "force")},
        "learned": learned.words,
        "readings": len(force),
        "error": learned.error,
        "spread": float(np.std(force)),
        "discontinuities": [_line(edge) for edge in edges],
        "centre": centre.tolist(),
        "coefficients": [
            {"name": name, "derivative": words, "error": _half(one) / _QUANTILE_95, **vars(one)}
            for (name, one), words in zip(coefficients.items(), _DERIVATIVES, strict=False)
        ],
        "visited": visited,
        "notes": list(notes),
        "curves": curves,
    }
    return MappedForce(
        learned.force_map, readings.at, readings, edges, learned.error, centre, coefficients, visited, notes, data
    )


def _torn(states: np.ndarray, std: np.ndarray, edges: tuple[Discontinuity, ...]) -> np.ndarray:
    """Readings so near to a jump that noise may have put them on its wrong side, where they would bend the map."""
    torn = np.zeros(len(states), dtype=bool)
    for edge in edges:
        if edge.kind == "jump":
            normal = np.asarray(edge.normal)
            place, reach = states @ normal, _SIDES * np.sqrt(std**2 @ normal**2)
            torn |= (place >= float(edge.low) - reach) & (place <= float(edge.high) + reach)
    return torn


def _at_centre(
    learned: LearnedMap, states: np.ndarray, force: np.ndarray, units: Any
) -> tuple[np.ndarray, dict[str, Estimate]]:
    """The state nearest to rest, and the derivatives there."""
    rest = np.zeros(2)
    if not learned.force_map.visited(rest[None])[0]:
        rest = states[np.argmin(np.sum((states / states.std(axis=0)) ** 2, axis=1))]
    found = {}
    for orders, parameter in _COEFFICIENTS.items():
        if isinstance(learned.force_map, RKPM) and sum(orders) > learned.force_map.rule.order:
            continue
        factor = math.prod(map(math.factorial, orders))
        value = float(learned.force_map.derivative(rest, orders)) / factor
        half = _QUANTILE_95 * float(learned.std(rest[None], orders)[0]) / factor
        unit = parameter.unit(units["force"], units["displacement"])
        found[parameter.name] = Estimate(value, value - half, value + half, unit)
    return rest, found


def _curves(
    learned: LearnedMap, at: tuple[int, int], states: np.ndarray, force: np.ndarray, centre: np.ndarray, units: Any
) -> dict[str, Any]:
    """Readings, the map, and its cuts through the centre with their 95 % bands, where the record has been."""
    axes = np.linspace(states.min(axis=0), states.max(axis=0), GRID)
    cuts: dict[str, Any] = {}
    for k, kind in enumerate(("displacement", "velocity")):
        along = np.repeat(centre[None], GRID, axis=0)
        along[:, k] = axes[:, k]
        visited = learned.force_map.visited(along)
        half = _QUANTILE_95 * learned.std(along)
        cuts[kind] = axes[:, k].tolist()
        for name, values in ((f"force_of_{kind}", learned.force_map.evaluate(along)), (f"error_of_{kind}", half)):
            cuts[name] = [float(y) if there else None for y, there in zip(np.asarray(values), visited, strict=True)]
    return {
        "points": shown_points(at, states[:, 0], states[:, 1], force, units),
        "map": shown_map(learned.force_map, axes[:, 0], axes[:, 1]),
        "cuts": cuts,
    }


def _half(estimate: Estimate) -> float:
    """Half the width of an interval."""
    return (estimate.high - estimate.low) / 2


def _line(edge: Discontinuity) -> dict[str, Any]:
    """A discontinuity across one column, as plain numbers."""
    axis = ("displacement", "velocity")[int(np.argmax(np.abs(np.asarray(edge.normal))))]
    names = ("offset", "low", "high", "size", "size_error", "confidence")
    return {"kind": edge.kind, "axis": axis, **{name: float(getattr(edge, name)) for name in names}}


def _notes(
    learned: LearnedMap,
    readings: RestoringForce,
    states: np.ndarray,
    edges: tuple[Discontinuity, ...],
    visited: float,
    kept: int,
    torn: int,
) -> Iterator[str]:
    """What a reader has to know about the map, apart from its figures."""
    if visited < _LITTLE:
        yield (
            f"Only {visited:.0%} of the box was visited, as by a steady vibration: between its orbits the map does not "
            "know the force. Record a motion whose amplitude changes."
        )
    left_out = readings.force.size - kept
    if left_out:
        yield f"{left_out} of {readings.force.size} samples, where the force is known less well, are left out."
    if torn:
        yield f"{torn} readings that may be on either side of a jump are left out."
    if edges and isinstance(learned.force_map, Kriging):
        yield "Kriging smooths across discontinuities; an RKPM map does not."
    yield from learned.remarks
    if not learned.flattened:
        return
    blur = np.median(readings.states_std, axis=0) / states.std(axis=0)
    for kind, blurred in zip(("displacement", "velocity"), blur, strict=True):
        if blurred > _BLURRED:
            yield (
                f"The {kind} is known to {blurred:.0%} of its standard deviation: slopes along it come out too flat, "
                "more than their intervals say. Measure it, too."
            )
