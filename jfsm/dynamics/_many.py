"""Many free runs in one call: other numbers, other starts, the same laws."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from .._types import as_array, require_x64
from ..records import Record
from ..structures import Structure
from ._drive import Reconstruction
from ._excitation import bucket, excitation, force_limits, measured_force, substeps_for, typical_speed
from ._grid import free_run
from ._plant import Grid, lower
from ._simulate import check_pair, motion_bound, with_tables

_TOGETHER = 256
"""Runs in one call of the program."""


@dataclass(frozen=True)
class Responses:
    """Motions of many free runs.

    Attributes
    ----------
    time : (n,) array
        Instants [s] on the record's clock.
    displacement, velocity, acceleration : (runs, n, dof) arrays
        Relative to the base, as the masses move; nothing of the sensors. After its escape a run stays where it was.
    escape_time : (runs,) array
        Instant [s] at which a run left every bound; infinite for one that did not.
    """

    time: np.ndarray
    displacement: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    escape_time: np.ndarray


def simulate_many(
    models: Structure | Sequence[Structure],
    record: Record,
    initial_states: tuple[Any, Any] | None = None,
    *,
    substeps: int | None = None,
    reconstruction: Reconstruction = "band-limited",
) -> Responses:
    """Free runs of many parameter sets, from many initial states, or both in pairs, under one record's force.

    The runs go side by side on the sample grid, so that a thousand cost little more than ten.

    Parameters
    ----------
    models : Structure or sequence of them
        Of the same laws at the same places; their numbers may differ.
    record : Record
    initial_states : pair of (runs, dof) arrays, optional
        Displacement and velocity at the first sample; rest by default.
    substeps : int, optional
        Runge-Kutta steps per sample; by default as many as the fastest structure among them needs.
    reconstruction : "band-limited", "linear" or "hold"
        The force between its samples.

    Returns
    -------
    Responses

    Raises
    ------
    ValueError
        If the structures differ in more than their numbers, or their number and that of the initial states differ.
    """
    require_x64()
    structures = [models] if isinstance(models, Structure) else list(models)
    if not structures:
        raise ValueError("`models` must hold at least one structure; the sequence is empty.")
    for structure in structures:
        check_pair(structure, record)
    dof = structures[0].dof
    x0, v0 = (np.zeros((1, dof)), np.zeros((1, dof))) if initial_states is None else _states(initial_states, dof)
    runs = max(len(structures), len(x0))
    if len({len(structures), len(x0)} - {1}) > 1:
        raise ValueError(
            f"`initial_states` must hold one state, or one for each of the {len(structures)} structures; got {len(x0)}."
        )
    speed = typical_speed(record)
    steps = substeps or max(substeps_for(s, record.dt, speed) for s in structures)
    plants = [lower(with_tables(s), grid=Grid(record.dt, steps)) for s in structures]
    if len({jax.tree.structure(p) for p in plants}) > 1 or any(_shape(p) != _shape(plants[0]) for p in plants):
        raise ValueError("`models` must differ in their numbers only: the same laws, at the same places.")
    force = measured_force(record, dof, force_limits(structures[0]))
    fine = excitation(record, dof, steps, reconstruction, length=bucket(len(record)), force=force)
    stacked = jax.tree.map(
        lambda *leaves: jnp.stack(leaves) if jnp.issubdtype(leaves[0].dtype, jnp.floating) else leaves[0], *plants
    )
    found = [np.zeros((runs, len(record), dof)) for _ in range(3)]
    for begin in range(0, runs, _TOGETHER):
        index = np.arange(begin, min(begin + _TOGETHER, runs))
        lanes = np.resize(index, next(size for size in (1, 16, _TOGETHER) if size >= index.size))
        plant = _taken(stacked, lanes % len(plants))
        start = (jnp.asarray(q[lanes % len(q)]) for q in (x0, v0))
        for out, values in zip(found, _runs(plant, fine, *start), strict=True):
            out[index] = np.asarray(values)[: index.size, : len(record)]
    escape = np.full(runs, np.inf)
    for k in range(runs):
        bound = motion_bound(plants[k % len(plants)], fine, record, x0[k % len(x0)], found[0][k])
        bad = ~np.all(np.isfinite(found[0][k]) & np.isfinite(found[1][k]) & (np.abs(found[0][k]) < bound), axis=1)
        if np.any(bad):
            stop = int(np.argmax(bad))
            escape[k] = record.time[stop]
            for out in found:
                out[k, stop:] = out[k, max(stop - 1, 0)]
    x, v, a = found
    return Responses(record.time, x, v, a, escape)


def _states(initial_states: tuple[Any, Any], dof: int) -> tuple[np.ndarray, np.ndarray]:
    x0, v0 = (as_array(q, "initial_states", 2) for q in initial_states)
    if x0.shape != v0.shape or x0.shape[1] != dof:
        raise ValueError(f"`initial_states` must be two arrays (runs, {dof}); got {x0.shape} and {v0.shape}.")
    return x0, v0


def _shape(plant) -> tuple:
    """What must be the same in all: the laws in the slots, and where they act."""
    slots = (plant.smooth, plant.friction, plant.memory, plant.delayed)
    return tuple((s.kind.tolist(), np.asarray(s.direction).tolist()) for s in slots)


def _many(leaf) -> bool:
    return jnp.issubdtype(leaf.dtype, jnp.floating)


def _taken(stacked, index):
    return jax.tree.map(lambda leaf: leaf[index] if _many(leaf) else leaf, stacked)


@eqx.filter_jit
def _runs(plant, fine, x0, v0):
    axes = jax.tree.map(lambda leaf: 0 if _many(leaf) else None, plant)
    return jax.vmap(lambda plant, x0, v0: free_run(plant, fine, x0, v0), in_axes=(axes, 0, 0))(plant, x0, v0)
