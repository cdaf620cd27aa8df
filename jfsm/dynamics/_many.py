"""Many free runs in one call: other numbers, other starts, the same laws."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._programs import programs_kept
from .._threads import side_by_side
from .._types import as_array, require_x64
from ..plant import (
    Grid,
    InterpolatedInput,
    Plant,
    Reconstruction,
    alone,
    bucket,
    check_pair,
    check_reconstruction,
    excitation,
    force_limits,
    free_run,
    lower,
    measured_force,
    probes,
    relaxed_jacobian,
    state_matrix,
    substeps_for,
    typical_size,
)
from ..records import Record, as_record
from ..structures import MapTerm, Structure, as_model, check_order
from ._simulate import escapes, finer, motion_bound, with_tables

_LANES = (1, 8, 64)
"""Runs that go side by side in one call of the program; beyond 64 their states leave the processor's cache."""


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

    time: Float[np.ndarray, " n"]
    displacement: Float[np.ndarray, "runs n dof"]
    velocity: Float[np.ndarray, "runs n dof"]
    acceleration: Float[np.ndarray, "runs n dof"]
    escape_time: Float[np.ndarray, " runs"]


@programs_kept()
def simulate_many(
    models: Structure | Sequence[Structure],
    record: Record,
    initial_states: tuple[Any, Any] | None = None,
    *,
    substeps: int | None = None,
    reconstruction: Reconstruction = "band-limited",
) -> Responses:
    """Free runs of many parameter sets, from many initial states, or both in pairs, under one record's force.

    The runs go side by side on the sample grid, as ``simulate(..., solver="grid")`` would take each by itself.

    Parameters
    ----------
    models : Structure or sequence of them
        Of the same laws at the same places; their numbers may differ.
    record : Record
        What drives; its response, if any, is not used.
    initial_states : pair of (runs, dof) arrays, optional
        Displacement and velocity at the first sample; rest by default.
    substeps : int, optional
        Runge-Kutta steps per sample; by default as many as `simulate` takes for the fastest structure among them.
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
    check_order("jfsm.simulate_many(models, record)", models, record)
    as_record(record)
    check_reconstruction(reconstruction)
    given = [models] if isinstance(models, Structure | str | PathLike) or not isinstance(models, Iterable) else models
    structures = [as_model(model, "models") for model in given]
    if not structures:
        raise ValueError("`models` must hold at least one structure; the sequence is empty.")
    for structure in structures:
        check_pair(structure, record)
    if any(_laws(structure) != _laws(structures[0]) for structure in structures):
        raise ValueError(
            "`models` must differ in their numbers only: the same laws and sensor effects at the same places, in the "
            "same order, with the same maps and the same limits of a clipped force."
        )
    if substeps is not None and not (isinstance(substeps, int) and substeps >= 1):
        raise ValueError(f"`substeps` must be at least 1, a whole number; got {substeps!r}.")
    dof = structures[0].dof
    x0, v0 = (np.zeros((1, dof)), np.zeros((1, dof))) if initial_states is None else _states(initial_states, dof)
    runs = max(len(structures), len(x0))
    if len({len(structures), len(x0)} - {1}) > 1:
        raise ValueError(
            f"`initial_states` must hold one state, or one for each of the {len(structures)} structures; got {len(x0)}."
        )
    size, asked = typical_size(record), structures if len(structures) == 1 else _fastest(structures, record)
    steps = substeps or finer(max(substeps_for(structure, record.dt, size) for structure in asked))
    plants = _lowered(structures, Grid(record.dt, steps))
    force = measured_force(record, dof, force_limits(structures[0]))
    inputs = excitation(record, dof, steps, reconstruction, length=bucket(len(record)), force=force)
    x, v, a = (np.empty((runs, len(record), dof)) for _ in range(3))

    def together(begin: int) -> None:
        index = np.arange(begin, min(begin + _LANES[-1], runs))
        lanes = np.resize(index, next(size for size in _LANES if size >= index.size))
        plant = _taken(plants, lanes % len(structures))
        start = (jnp.asarray(q[lanes % len(q)]) for q in (x0, v0))
        for out, values in zip((x, v, a), _runs(plant, inputs, *start), strict=True):
            out[index] = np.asarray(values)[: index.size, : len(record)]

    list(side_by_side(together, range(0, runs, _LANES[-1])))
    escaped = escapes(motion_bound(plants, inputs, record, x0, x), x, v)
    for k in np.flatnonzero(escaped < len(record)):
        for out in (x, v, a):
            out[k, escaped[k] :] = out[k, max(escaped[k] - 1, 0)]
    return Responses(record.time, x, v, a, np.append(record.time, np.inf)[escaped])


def _states(initial_states: tuple[Any, Any], dof: int) -> tuple[np.ndarray, np.ndarray]:
    x0, v0 = (as_array(q, "initial_states", 2) for q in initial_states)
    if x0.shape != v0.shape or x0.shape[1] != dof:
        raise ValueError(f"`initial_states` must be two arrays (runs, {dof}); got {x0.shape} and {v0.shape}.")
    return x0, v0


def _laws(structure: Structure) -> tuple:
    """What must be the same in all structures: everything but their numbers."""
    maps = [id(term.force_map) for term in structure.terms if isinstance(term, MapTerm)]
    parts = [(type(part), part.at) for part in (*structure.terms, *structure.sensors)]
    return structure.mass.shape, parts, maps, force_limits(structure)


def _numbers(structure: Structure) -> np.ndarray:
    """Every number of the terms and sensors, in their order."""
    parts = (*structure.terms, *structure.sensors)
    return np.array([float(getattr(part, p.name)) for part in parts for p in part.parameters])


def _with_number(structure: Structure, place: int, value: float) -> Structure:
    """The structure with one of its `_numbers` replaced."""
    parts = [*structure.terms, *structure.sensors]
    owner, name = [(i, p.name) for i, part in enumerate(parts) for p in part.parameters][place]
    parts[owner] = replace(parts[owner], **{name: value})
    n = len(structure.terms)
    return structure.having(terms=parts[:n], sensors=parts[n:])


def _lowered(structures: Sequence[Structure], grid: Grid) -> Plant:
    """Plants of the structures, with the runs as a leading axis of every array of numbers.

    Lowering a thousand structures one by one would take longer than their runs. A plant is linear in each number, so
    one more plant per number that varies tells them all.
    """
    first = with_tables(structures[0])
    numbers = np.array([_numbers(structure) for structure in structures])
    change = numbers - numbers[0]
    base = lower(first, grid=grid)
    floating, rest = eqx.partition(base, _is_number)
    leaves, tree = jax.tree.flatten(floating)
    stacked = [np.repeat(np.asarray(leaf)[None], len(structures), axis=0) for leaf in leaves]
    for place in np.flatnonzero(np.any(change != 0, axis=0)):
        widest = int(np.argmax(np.abs(change[:, place])))
        other = lower(_with_number(first, int(place), numbers[widest, place]), grid=grid)
        share = change[:, place] / change[widest, place]
        for out, leaf, moved in zip(stacked, leaves, jax.tree.leaves(eqx.filter(other, _is_number)), strict=True):
            out += share.reshape((-1,) + (1,) * leaf.ndim) * np.asarray(moved - leaf)
    plants = eqx.combine(jax.tree.unflatten(tree, [jnp.asarray(leaf) for leaf in stacked]), rest)
    masses = np.array([np.asarray(structure.mass) for structure in structures])
    mass = jnp.asarray(masses[:, :, None] * np.eye(masses.shape[1]) if masses.ndim == 2 else masses)
    reach = grid.reach([term for structure in structures for term in structure.terms if term.delay is not None])
    return alone(replace(plants, mass=mass, reach=reach))


def _fastest(structures: Sequence[Structure], record: Record) -> list[Structure]:
    """Of each measure that the number of steps goes by, the structure that needs most; the rest need not be asked."""
    plants, size = _lowered(structures, Grid(record.dt, 1)), typical_size(record)
    mass, damping, stiffness = (np.asarray(q) for q in (plants.mass, plants.damping, plants.stiffness))
    slopes = [state_matrix(np.linalg.solve(mass, stiffness), np.linalg.solve(mass, damping))]
    if len(plants.smooth) or len(plants.memory):
        slopes += [np.asarray(_jacobians(plants, x, v)) for x, v, _ in probes(mass.shape[-1], size)]
    return [structures[int(np.argmax(np.max(np.abs(np.linalg.eigvals(slope)), axis=-1)))] for slope in slopes]


def _is_number(leaf: Any) -> bool:
    return eqx.is_inexact_array(leaf)


def _taken(plants: Plant, index: np.ndarray) -> Plant:
    return jax.tree.map(lambda leaf: jnp.asarray(np.asarray(leaf)[index]) if _is_number(leaf) else leaf, plants)


def _axes(plants: Plant) -> Any:
    return jax.tree.map(lambda leaf: 0 if _is_number(leaf) else None, plants)


@eqx.filter_jit
def _jacobians(plants: Plant, x, v):
    return jax.vmap(lambda plant: relaxed_jacobian(plant, x, v), in_axes=(_axes(plants),))(plants)


@eqx.filter_jit
def _runs(plants: Plant, inputs: InterpolatedInput, x0, v0):
    axes = _axes(plants)
    return jax.vmap(lambda plant, x0, v0: free_run(plant, inputs, x0, v0), in_axes=(axes, 0, 0))(plants, x0, v0)
