"""The force that the refitted model leaves, as points, as a map, and as a term that stands in for a law."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..._types import evenly_taken
from ...identification import Nuisances, missing_force
from ...mapping.plot_data import GRID, shown_map, shown_points
from ...plant import direction, force_at
from ...structures import AbstractTerm, Structure
from ...surrogates import RKPM, HermiteTable, tabulate
from ..channels.drift import steadied
from .fitted import Trial, predict
from .setup import Problem

_NODES = 2000
"""Points that a map is made of; more of a trajectory are near duplicates."""
_NEIGHBOURS = 160
"""Points that support a map at one state: sixteen per monomial of a cubic, as noisy points need."""


@dataclass(frozen=True)
class Residual:
    """Missing force of one link against its motion, with the standard deviation of its noise."""

    at: tuple[int, int]
    displacement: np.ndarray
    velocity: np.ndarray
    force: np.ndarray
    std: np.ndarray
    force_map: RKPM | None


def residual(structure: Structure, nuisances: Nuisances, until: int, at: tuple[int, int] | None = None) -> Residual:
    """Force that `structure` lacks on the link `at`, and its map over the first `until` samples.

    Without `at` it is the link that carries most of it.
    """
    n = nuisances.samples
    found = missing_force(structure, nuisances, n)
    links = list(structure.links)
    rows = np.array([direction(link, structure.dof) for link in links])
    # Forces on degrees of freedom as forces on links: exact for a chain, least squares otherwise.
    shared = np.linalg.pinv(rows.T)
    forces, std = shared @ found.force.T, np.sqrt(shared**2 @ found.std.T**2)
    link = int(np.argmax(np.std(forces, axis=1))) if at is None else links.index(at)
    d, w, f = found.displacement @ rows[link], found.velocity @ rows[link], forces[link]
    count = min(until, n)
    take = evenly_taken(count, _NODES)
    try:
        force_map = RKPM.fit(
            np.column_stack([d, w])[take], f[take], order=3, neighbours=min(_NEIGHBOURS, take.size // 2)
        )
    except (ValueError, RuntimeError):  # one orbit only, or too few points: there is no surface to draw
        force_map = None
    return Residual(links[link], d, w, f, std[link], force_map)


def stand_in(trial: Trial, problem: Problem) -> Trial | None:
    """A trial with the map of what it leaves, judged like any other hypothesis.

    Its values stay, and the map is fixed. Held-out samples are its guard against freedom.
    """
    found = residual(trial.structure, steadied(problem.first), problem.until[0])
    table = table_of(found)
    if table is None:
        return None
    structure = trial.structure + table.on(found.at)
    posterior = problem.posterior_of(replace(trial, structure=structure))
    return replace(
        trial,
        label="map",
        effects=(),
        structure=structure,
        evidence=-math.inf,
        prediction=predict(posterior, trial.theta),
    )


def table_of(found: Residual) -> HermiteTable | None:
    """The map frozen for simulation."""
    return None if found.force_map is None else tabulate(found.force_map)


def agreement(found: Residual, term: AbstractTerm | None) -> float | None:
    """Share of readings at which a law of displacement and velocity lies within twice their error of the map.

    Constants and straight lines do not count, as offsets and own values take them. None where there is no such law, or
    no map.
    """
    if found.force_map is None or term is None or term.states or term.delay is not None or term.timed:
        return None
    take = evenly_taken(found.force.size, _NODES)
    d, w = found.displacement[take], found.velocity[take]
    apart = force_at(term, d, w) - np.asarray(found.force_map.evaluate(np.column_stack([d, w])))
    lines = np.column_stack([np.ones_like(d), d, w])
    apart -= lines @ np.linalg.lstsq(lines, apart, rcond=None)[0]
    return float(np.mean(np.abs(apart) <= 2 * found.std[take]))


def curves(found: Residual, units, term: AbstractTerm | None) -> dict[str, Any]:
    """Points, map and law for the report, as plain lists."""
    points = shown_points(found.at, found.displacement, found.velocity, found.force, units)
    points["agreement"] = agreement(found, term)
    x = np.linspace(found.displacement.min(), found.displacement.max(), GRID)
    v = np.linspace(found.velocity.min(), found.velocity.max(), GRID)
    drawn: dict[str, Any] = {"residual": points, "map": None, "law": None}
    if found.force_map is not None:
        drawn["map"] = shown_map(found.force_map, x, v)
    if term is not None and not term.states and term.delay is None:
        along_x, along_v = force_at(term, x, np.zeros_like(x)).tolist(), force_at(term, np.zeros_like(v), v).tolist()
        drawn["law"] = {
            "displacement": x.tolist(), "force_of_displacement": along_x,
            "velocity": v.tolist(), "force_of_velocity": along_v,
        }  # fmt: skip
    return drawn
