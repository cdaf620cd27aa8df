"""What drives a record between its samples, where a sensor is late or another force acts as well; on the host."""

import numpy as np
from jaxtyping import Float

from ..plant import InterpolatedInput, cubic_weights


def between_samples(
    force: Float[np.ndarray, "*lanes n dof"], halves: int, count: int
) -> Float[np.ndarray, "*lanes samples halves dof"]:
    """Samples of a force (..., n, dof) on the half steps (..., count, halves, dof), straight in between."""
    fill = [(0, 0)] * (force.ndim - 2) + [(0, count + 1 - force.shape[-2]), (0, 0)]
    here = np.pad(force, fill, "edge") if count >= force.shape[-2] else force
    here, share = here[..., : count + 1, :], np.linspace(0.0, 1.0, halves)[:, None]
    begin, end = here[..., :-1, None, :], here[..., 1:, None, :]
    return begin + share * (end - begin)


def undelayed_force(
    force: Float[np.ndarray, "n halves dof"], delay: Float[np.ndarray, " dof"]
) -> Float[np.ndarray, "n halves dof"]:
    """Force (n, halves, dof) with the delays of its sensors undone, in samples: that of t is what is read later."""
    n, halves, dof = force.shape
    flat = _in_a_row(force)
    later = np.stack([_shifted(flat[:, j], delay[j] * (halves - 1)) for j in range(dof)], 1)
    return later[np.arange(n)[:, None] * (halves - 1) + np.arange(halves)[None, :]]


def forces_before(inputs: InterpolatedInput, tau: float) -> Float[np.ndarray, "n 5 drives"]:
    """Forces, and last the acceleration of the base, (n, 5, dof + 1), from each sample back to tau earlier."""
    force, base = np.asarray(inputs.force), np.asarray(inputs.base)
    n, halves, dof = force.shape
    flat = _in_a_row(np.concatenate([force, base[..., None]], 2))
    places = -tau / float(inputs.step) * (halves - 1) * np.linspace(0.0, 1.0, 5)
    earlier = [[_shifted(flat[:, j], place) for place in places] for j in range(dof + 1)]
    return np.array(earlier).transpose(2, 1, 0)[: n * (halves - 1) : halves - 1]


def _in_a_row(values: np.ndarray) -> np.ndarray:
    """Values (n, halves, columns) on the half steps of all samples one after the other, each instant once."""
    return np.concatenate([values[:, :-1].reshape(-1, values.shape[2]), values[-1:, -1]])


def _shifted(values: np.ndarray, places: float) -> np.ndarray:
    """Values so many places further on, by the cubic through four neighbours."""
    whole = int(np.floor(places))
    weights = cubic_weights(places - whole)
    index, last = np.arange(values.size) + whole, values.size - 1
    near = np.stack([values[np.clip(index + k, 0, last)] for k in (-1, 0, 1, 2)])
    return np.asarray(weights) @ near
