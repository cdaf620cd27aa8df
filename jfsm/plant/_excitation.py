"""Excitation of a run, from a record, and the steps per sample that a structure needs."""

import math
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._traced import jit_kept
from .._types import Array, is_traced
from ..records import Record, declipped, silent_forces
from ..structures import Clipping, EvaluatedMotion, LinearDamping, LinearStiffness, Structure
from ._drive import Reconstruction, reconstruct
from ._forces import State, hidden_start
from ._grid import InterpolatedInput
from ._own_motion import linear_part
from ._plant import Plant, direction, numbers_of
from ._stepper import inverse_mass, linearised
from ._tabulated import about_a_state

_STEP_ANGLE = 0.22
"""Largest angle of the fastest mode per step [rad]: Runge-Kutta of order four then shifts a frequency by 2e-5."""
_MOST_SUBSTEPS = 16
_MOST_STIFF_SUBSTEPS = 64
_FINER = 4
"""Times the steps of the linear part, and powers of that, for laws that are faster: every number has its programs."""


class Probe(NamedTuple):
    """A state, in typical sizes, at which the fastest rate is computed; the largest angle per step there."""

    displacement: float
    velocity: float
    angle: float


_PROBES = (
    # A rate that is fast at some speed follows a slow motion, and needs less accuracy; at the largest speeds it is over
    # so soon that stability is enough.
    Probe(0.0, 0.0, 1.0),
    *(Probe(0.0, share, 1.0) for share in (1.0, -1.0)),
    *(Probe(0.0, share, 2.0) for share in (3.0, -3.0)),
    # A spring that hardens is the motion itself, for a part of each swing.
    *(Probe(share, 0.0, 0.3) for share in (2.0, -2.0)),
)


class Size(NamedTuple):
    """Usual displacement [m] and velocity [m/s] of a motion."""

    displacement: float
    velocity: float


class Swing(NamedTuple):
    """Displacement and velocity (n, dof) of a motion that is known, if roughly: links move less than their ends."""

    displacement: Float[np.ndarray, "n dof"]
    velocity: Float[np.ndarray, "n dof"]


_KINKED_SUBSTEPS = 2
"""Steps per sample at least for hidden states, which yield and slide at instants of their own."""
_CREST = 4.0
"""Largest peak of a persistent motion, in root mean squares."""
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
    plant = linear_part(plant)
    eigenvalues = np.linalg.eigvals(np.linalg.solve(np.asarray(plant.mass), np.asarray(plant.stiffness)))
    return float(np.sqrt(np.max(np.abs(eigenvalues))))


def probes(dof: int, size: Size) -> Iterator[tuple[Float[np.ndarray, " dof"], Float[np.ndarray, " dof"], float]]:
    """Displacements and velocities (dof,) at which fast rates are sought, and the largest angle per step there.

    Masses move together, and neighbours against each other.
    """
    for pattern in (np.ones(dof), 0.5 * (-1.0) ** np.arange(dof))[: min(dof, 2)]:
        for x, v, angle in _PROBES:
            yield x * size.displacement * pattern, v * size.velocity * pattern, angle


def probes_along(
    swing: Swing, structure: Structure
) -> Iterator[tuple[Float[np.ndarray, " dof"], Float[np.ndarray, " dof"], float]]:
    """As `probes`, from a motion that is known: where the link of each nonlinear law is as stretched, or as fast."""
    places = {term.at for term in structure.terms if not isinstance(term, LinearStiffness | LinearDamping)}
    for row in (direction(at, structure.dof) for at in sorted(places)):
        for x, v, angle in _PROBES:
            yield _where(swing.displacement, row, x), _where(swing.velocity, row, v), angle


def _where(states: Float[np.ndarray, "n dof"], row: Float[np.ndarray, " dof"], share: float) -> Any:
    """State in which what a row selects is closest to so many root mean squares of it; the opposite one of those below
    zero."""
    along = states @ row
    sample = np.argmin(np.abs(np.abs(along) - abs(share) * np.sqrt(np.mean(along**2))))
    return states[sample] * np.sign(along[sample] * share)


def substeps_for(structure: Structure, dt: float, size: Size | Swing | None = None) -> int:
    """Steps per sample, a power of two, that keep the angle per step of the fastest mode or decay small.

    Nonlinear laws may be faster, at rest or in motions of about this `size`, or as they are: bristles, steep
    regularised friction, a hardening spring. For these the steps may be longer.

    Raises
    ------
    ValueError
        If the largest number of steps would still be unstable: the result would look like a motion that diverges.
    """
    plant = numbers_of(structure)
    into, zero, eye = np.linalg.inv(plant.mass), np.zeros((plant.dof,) * 2), np.eye(plant.dof)
    fastest = _fastest(np.block([[zero, eye], [-into @ plant.stiffness, -into @ plant.damping]]))
    if fastest * dt / _MOST_SUBSTEPS > _STABLE_ANGLE:
        raise ValueError(
            f"`model` must move slowly enough for the record's steps of {dt:.6g} s; its fastest mode or decay has "
            f"{fastest:.6g} rad/s, the record shows at most {math.pi / dt:.6g}. "
            "Leave that spring, dashpot or small mass out of the model, or use a record of a higher rate."
        )
    own = 2 ** math.ceil(math.log2(max(1.0, fastest * dt / _STEP_ANGLE)))
    if not len(plant.smooth) + len(plant.memory) and plant.own is None:
        return min(_MOST_SUBSTEPS, own)
    own = max(own, _KINKED_SUBSTEPS if len(plant.memory) else 1)
    known = isinstance(size, Swing)
    states = probes_along(size, structure) if known else probes(structure.dof, size or Size(0.0, 0.0))
    rates = ((_fastest(relaxed_jacobian(_there(plant, x, v, dt), x, v)), angle) for x, v, angle in states)
    faster = max([1.0, *(rate * dt / angle / own for rate, angle in rates)])
    return min(_MOST_STIFF_SUBSTEPS, own * _FINER ** math.ceil(math.log(faster, _FINER)))


def _there(plant: Plant, x: Any, v: Any, dt: float) -> Plant:
    """The plant, as it is near a state where its function is no program of JAX."""
    return about_a_state(plant, x, v, 0.0, dt) if isinstance(plant.own, EvaluatedMotion) else plant


def _fastest(rate: Any) -> float:
    """Largest eigenvalue [rad/s] of how a state changes."""
    return float(np.max(np.abs(np.linalg.eigvals(np.asarray(rate)))))


@jit_kept
def relaxed_jacobian(plant: Plant, x: State, v: State) -> Float[Array, "state state"]:
    """Derivative of the rate of the state by the state, hidden states relaxed and friction left out."""
    return linearised(plant, inverse_mass(plant), x, v, hidden_start(plant, x, v), jnp.zeros_like(x), jnp.zeros(()))[1]


def typical_size(record: Record) -> Size:
    """Size of the motion, from the measured response; 0 without one.

    A decay has the size of its beginning.
    """
    found = [Size(0.0, 0.0)]
    for (kind, _), y in record.responses.items():
        spread, change = _size(y), _size(np.diff(y)) / record.dt
        time = spread / change if change > 0 else 0.0
        by_kind = {
            "displacement": Size(spread, change),
            "velocity": Size(spread * time, spread),
            "acceleration": Size(spread * time**2, spread * time),
        }
        found.append(by_kind[kind])
    return Size(*(max(sizes) for sizes in zip(*found, strict=True)))


def _size(y: np.ndarray) -> float:
    """Root mean square about the mean, or a share of the peak where that is far above it."""
    return max(float(np.std(y)), float(np.max(np.abs(y - np.mean(y)))) / _CREST)


def measured_force(
    record: Record, dof: int, clipped_at: Mapping[tuple[str, int], float] | None = None
) -> Float[np.ndarray, "n dof"]:
    """Force samples (n, dof), zero where no force is applied; a channel of noise alone counts as zero.

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
    """Clipping limits of the force channels, as the structure states them."""
    return {s.at: s.value for s in structure.sensors if isinstance(s, Clipping) and s.at[0] == "force"}


def excitation(
    record: Record,
    dof: int,
    substeps: int,
    method: Reconstruction = "band-limited",
    *,
    length: int | None = None,
    force: Float[Array, "n dof"] | Float[np.ndarray, "n dof"] | None = None,
    base: Float[np.ndarray, " n"] | None = None,
) -> InterpolatedInput:
    """Input of a record on half steps, padded to `length` samples with its last value, which a delayed sensor reads.

    `force` (n, dof) and `base` (n,) replace the record's own samples where they were smoothed or restored beforehand;
    the force may be traced.
    """
    samples = measured_force(record, dof) if force is None else force
    if base is None:
        base = np.zeros(len(record)) if record.base_acceleration is None else record.base_acceleration
    n, factor = len(record), 2 * substeps
    padded = n if length is None else length
    xp = jnp if is_traced(samples) else np
    both = xp.column_stack([samples, base])
    if method == "hold":  # up to the end of its interval: the jump belongs to the next
        known = xp.broadcast_to(both[:, None], (n, factor + 1, dof + 1))
    else:
        take = np.arange(n - 1)[:, None] * factor + np.arange(factor + 1)
        known = reconstruct(both, factor, method)[take]
    ahead = xp.broadcast_to(both[-1], (padded - len(known), factor + 1, dof + 1))  # the last leads to no sample
    intervals: Any = xp.concatenate([known, ahead])
    step: Any = np.asarray(record.dt)
    time = record.time[0] + record.dt * np.arange(padded)
    return InterpolatedInput(intervals[..., :dof], intervals[..., dof], time, step)
