"""What a force does between the samples of a record: known finely, and as samples that do the same."""

import numpy as np
from jaxtyping import Float
from scipy.integrate import trapezoid
from scipy.linalg import solveh_banded

from ...plant import Reconstruction, excitation
from ...records import Record

_FINER = 8
"""Instants in a sample at which the force of what was found is known: friction turns between samples."""

States = Float[np.ndarray, "n dof"]


def between_samples(record: Record, force: States, way: Reconstruction) -> tuple[Record, States]:
    """The clock of a record, finer, with its base, and a force (n, dof) on it."""
    input = excitation(record, force.shape[1], _FINER // 2, way, force=force)
    driving, base = (_joined(np.asarray(each)) for each in (input.force, np.asarray(input.base)[..., None]))
    time = record.time[0] + record.dt / _FINER * np.arange(len(driving))
    moving = None if record.base_acceleration is None else base[:, 0]
    return Record(time, force=driving, base_acceleration=moving, at_rest=record.at_rest), driving


def _joined(nodes: Float[np.ndarray, "n nodes columns"]) -> Float[np.ndarray, "fine columns"]:
    """Values between samples, one interval after the other, up to the last sample."""
    return np.concatenate([nodes[:-1, :-1].reshape(-1, nodes.shape[-1]), nodes[-1:, 0]])


def as_samples(fine: Float[np.ndarray, "fine dof"], *, held: bool) -> States:
    """Samples (n, dof) whose force, held or straight in between, comes closest to one that is known between them."""
    inside = fine[:-1].reshape(-1, _FINER, fine.shape[1])
    ends = np.concatenate([inside[1:, 0], fine[-1:]])
    after = np.concatenate([inside, ends[:, None]], 1)  # every interval with both of its ends
    share = np.linspace(0.0, 1.0, _FINER + 1)[None, :, None]
    if held:
        mean = trapezoid(after, dx=1 / _FINER, axis=1)
        return np.concatenate([mean, mean[-1:]])
    load = np.zeros((len(inside) + 1, fine.shape[1]))
    load[:-1] += trapezoid((1 - share) * after, dx=1 / _FINER, axis=1)
    load[1:] += trapezoid(share * after, dx=1 / _FINER, axis=1)
    bands = np.full((2, len(load)), 1 / 6)
    bands[1] = 2 / 3
    bands[1, [0, -1]] = 1 / 3
    return solveh_banded(bands, load)
