"""What drives a run, taken from a record."""

import math
from collections.abc import Mapping

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from ..records import Record, declipped, silent_forces
from ..structures import Clipping, LinearDamping, LinearStiffness, Structure
from ._drive import Reconstruction, reconstruct
from ._forces import hidden_start
from ._grid import Fine
from ._plant import Plant, numbers_of
from ._stepper import inverse_mass, linearised

_STEP_ANGLE = 0.22
"""Largest angle of the fastest mode per step [rad]: Runge-Kutta of order four then shifts a frequency by 2e-5."""
_MOST_SUBSTEPS = 16
_MOST_STIFF_SUBSTEPS = 64
PROBES = ((0.0, 1.0), (1.0, 1.0), (-1.0, 1.0), (3.0, 2.0), (-3.0, 2.0))
"""Velocities, in usual speeds, at which to ask what is faster than the linear part, and its largest angle per step.

It follows something slow, and need not be followed closely; at the largest speeds it is over so soon that it need only
stay stable.
"""
_KINKED_SUBSTEPS = 2
"""Steps per sample at least for hidden states, which yield and slide at instants of their own."""
_CREST = 4.0
"""Peak of what goes on all the time, in root mean squares, at most."""
_STABLE_ANGLE = 2.6
"""Largest angle per step at which Runge-Kutta of order four does not blow up by itself."""


def bucket(n: int) -> int:
    """Padded sample count: four sizes per octave, so that records of similar length share a program."""
    if n <= 64:
        return 64
    octave = 2 ** math.floor(math.log2(n - 1))
    return octave + math.ceil((n - octave) / (octave / 4)) * (octave // 4)


def fastest_mode(plant: Plant) -> float:
    """Largest natural frequency of the linear part [rad/s]; 0 where nothing is elastic."""
    eigenvalues = np.linalg.eigvals(np.linalg.solve(np.asarray(plant.mass), np.asarray(plant.stiffness)))
    return float(np.sqrt(np.max(np.abs(eigenvalues))))


def substeps_for(structure: Structure, dt: float, speed: float = 0.0) -> int:
    """Steps per sample, a power of two, that keep the angle per step of the fastest mode or decay small.

    Laws beside the linear ones may be faster, at rest or at about `speed`: bristles, a friction that turns over
    steeply. For these the steps may be longer.

    Raises
    ------
    ValueError
        If the largest number of steps would still be unstable, which would pass for a motion that runs away.
    """
    plant, zero = numbers_of(structure), np.zeros(structure.dof)
    linear = [term for term in structure.terms if isinstance(term, LinearStiffness | LinearDamping)]
    fastest = _fastest_rate(numbers_of(Structure(structure.mass, linear)), zero)
    if fastest * dt / _MOST_SUBSTEPS > _STABLE_ANGLE:
        raise ValueError(
            f"`model` must move slowly enough for the record's steps of {dt:.6g} s; its fastest mode or decay has "
            f"{fastest:.6g} rad/s, the record shows at most {math.pi / dt:.6g}. "
            "Leave that spring, dashpot or small mass out of the model, or use a record of a higher rate."
        )
    need = max(1.0, fastest * dt / _STEP_ANGLE)
    most = _MOST_SUBSTEPS
    if len(plant.smooth) or len(plant.memory):
        need = max(need, _KINKED_SUBSTEPS if len(plant.memory) else 1)
        for share, angle in PROBES:
            need = max(need, _fastest_rate(plant, zero + share * speed) * dt / angle)
        most = _MOST_STIFF_SUBSTEPS
    return min(most, 2 ** math.ceil(math.log2(need)))


def _fastest_rate(plant: Plant, v: np.ndarray) -> float:
    """Largest eigenvalue [rad/s] of a plant's motion about x = 0 at velocity `v`; friction that sticks is left out."""
    dof = plant.dof
    return float(np.max(np.abs(np.linalg.eigvals(np.asarray(relaxed_jacobian(plant, np.zeros(dof), v))))))


@eqx.filter_jit
def relaxed_jacobian(plant: Plant, x, v):
    """Derivative of the rate of the state by the state, hidden states relaxed and friction left out."""
    return linearised(plant, inverse_mass(plant), x, v, hidden_start(plant, x, v), jnp.zeros_like(x), jnp.zeros(()))[1]


def typical_speed(record: Record) -> float:
    """Size of the velocity, from whatever response there is; 0 where there is none.

    Of a decay it is that of its beginning.
    """
    speeds = []
    for (kind, _), y in record.responses.items():
        change, spread = _size(np.diff(y)) / record.dt, _size(y)
        if kind == "velocity":
            speeds.append(spread)
        elif kind == "displacement":
            speeds.append(change)
        elif change > 0:
            speeds.append(spread**2 / change)
    return float(max(speeds, default=0.0))


def _size(y: np.ndarray) -> float:
    """Root mean square about the mean, or a share of the peak where that is far above it."""
    return max(float(np.std(y)), float(np.max(np.abs(y - np.mean(y)))) / _CREST)


def measured_force(record: Record, dof: int, clipped_at: Mapping[tuple[str, int], float] | None = None) -> np.ndarray:
    """Force samples (n, dof), zero where no force is applied; a channel that is noise only counts as zero.

    Arcs beyond the limits `clipped_at`, by channel, are reconstructed.
    """
    force = np.zeros((len(record), dof))
    silent = silent_forces(record)
    limits = clipped_at or {}
    for (kind, j), samples in record.channels.items():
        if kind == "force":
            if j > dof:
                raise ValueError(f"`record` has a force at degree of freedom {j}; the structure has {dof}.")
            if j not in silent:
                limit = limits.get((kind, j))
                force[:, j - 1] = samples if limit is None else declipped(samples, limit)
    return force


def force_limits(structure: Structure) -> dict[tuple[str, int], float]:
    """Limits beyond which the structure says that a force channel shows nothing."""
    return {s.at: s.value for s in structure.sensors if isinstance(s, Clipping) and s.at[0] == "force"}


def excitation(
    record: Record,
    dof: int,
    substeps: int,
    method: Reconstruction = "band-limited",
    *,
    length: int | None = None,
    force: np.ndarray | None = None,
) -> Fine:
    """Drive of a record on half steps, padded to `length` samples with its last value, which a late sensor asks for.

    `force` (n, dof) replaces the record's own samples where they were smoothed or restored beforehand.
    """
    samples = measured_force(record, dof) if force is None else force
    base = np.zeros(len(record)) if record.base_acceleration is None else record.base_acceleration
    n, factor = len(record), 2 * substeps
    padded = n if length is None else length
    both = np.column_stack([samples, base])
    intervals = np.zeros((padded, factor + 1, dof + 1))
    if method == "hold":  # up to the end of its interval: the jump belongs to the next
        intervals[:n] = both[:, None]
        intervals[n:] = both[-1]
    else:
        take = np.arange(n - 1)[:, None] * factor + np.arange(factor + 1)
        intervals[: n - 1] = reconstruct(both, factor, method)[take]
        intervals[n - 1 :] = both[-1]  # leads to no sample
    time = record.time[0] + record.dt * np.arange(padded)
    return Fine(
        jnp.asarray(intervals[..., :dof]), jnp.asarray(intervals[..., dof]), jnp.asarray(time), jnp.asarray(record.dt)
    )
