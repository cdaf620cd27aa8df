"""What drives a run, taken from a record."""

import math

import jax.numpy as jnp
import numpy as np

from ..records import Record, silent_forces
from ..structures import Structure
from ._drive import Reconstruction, reconstruct
from ._grid import Fine
from ._plant import lower

_STEP_ANGLE = 0.22
"""Largest angle of the fastest mode per step [rad]: Runge-Kutta of order four then shifts a frequency by 2e-5."""
_MOST_SUBSTEPS = 16
_STABLE_ANGLE = 2.6
"""Largest angle per step at which Runge-Kutta of order four does not blow up by itself."""


def bucket(n: int) -> int:
    """Padded sample count: four sizes per octave, so that records of similar length share a program."""
    if n <= 64:
        return 64
    octave = 2 ** math.floor(math.log2(n - 1))
    return octave + math.ceil((n - octave) / (octave / 4)) * (octave // 4)


def fastest_mode(structure: Structure) -> float:
    """Largest natural frequency of the linear part [rad/s]; 0 where nothing is elastic."""
    plant = lower(structure)
    eigenvalues = np.linalg.eigvals(np.linalg.solve(np.asarray(plant.mass), np.asarray(plant.stiffness)))
    return float(np.sqrt(np.max(np.abs(eigenvalues))))


def substeps_for(structure: Structure, dt: float) -> int:
    """Steps per sample, a power of two, that keep the angle per step of the fastest mode or decay small.

    Raises
    ------
    ValueError
        If the largest number of steps would still be unstable, which would pass for a motion that runs away.
    """
    plant = lower(structure)
    zero, eye = np.zeros((structure.dof, structure.dof)), np.eye(structure.dof)
    rates = np.linalg.solve(np.asarray(plant.mass), -np.hstack([plant.stiffness, plant.damping]))
    fastest = float(np.max(np.abs(np.linalg.eigvals(np.vstack([np.hstack([zero, eye]), rates])))))
    if fastest * dt / _MOST_SUBSTEPS > _STABLE_ANGLE:
        raise ValueError(
            f"`model` must move slowly enough for the record's steps of {dt:.6g} s; its fastest mode or decay has "
            f"{fastest:.6g} rad/s, the record shows at most {math.pi / dt:.6g}. "
            "Leave that spring, dashpot or small mass out of the model, or use a record of a higher rate."
        )
    need = max(1.0, fastest * dt / _STEP_ANGLE)
    return min(_MOST_SUBSTEPS, 2 ** math.ceil(math.log2(need)))


def measured_force(record: Record, dof: int) -> np.ndarray:
    """Force samples (n, dof), zero where no force is applied; a channel that is noise only counts as zero."""
    force = np.zeros((len(record), dof))
    silent = silent_forces(record)
    for (kind, j), samples in record.channels.items():
        if kind == "force":
            if j > dof:
                raise ValueError(f"`record` has a force at degree of freedom {j}; the structure has {dof}.")
            if j not in silent:
                force[:, j - 1] = samples
    return force


def excitation(
    record: Record,
    dof: int,
    substeps: int,
    method: Reconstruction = "band-limited",
    *,
    length: int | None = None,
    force: np.ndarray | None = None,
) -> Fine:
    """Drive of a record on half steps, padded to `length` samples with nothing.

    `force` (n, dof) replaces the record's own samples where they were smoothed beforehand.
    """
    samples = measured_force(record, dof) if force is None else force
    base = np.zeros(len(record)) if record.base_acceleration is None else record.base_acceleration
    n, factor = len(record), 2 * substeps
    padded = n if length is None else length
    both = np.column_stack([samples, base])
    intervals = np.zeros((padded, factor + 1, dof + 1))
    if method == "hold":  # up to the end of its interval: the jump belongs to the next
        intervals[:n] = both[:, None]
    else:
        take = np.arange(n - 1)[:, None] * factor + np.arange(factor + 1)
        intervals[: n - 1] = reconstruct(both, factor, method)[take]
        intervals[n - 1] = both[-1]  # leads to no sample
    time = record.time[0] + record.dt * np.arange(padded)
    return Fine(
        jnp.asarray(intervals[..., :dof]), jnp.asarray(intervals[..., dof]), jnp.asarray(time), jnp.asarray(record.dt)
    )
