"""What every map asks of the readings it is learned from, and which states lie among them."""

from typing import Any

import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Bool, Float
from numpy.typing import NDArray
from scipy.spatial import KDTree

from .._types import as_array

RANK_TOLERANCE = 1e-11
"""Singular values below this share of the largest count as zero; the functions are in scaled coordinates."""

CONSTANT_TOLERANCE = 1e-12
"""A column that varies by less than this share of its size is constant to rounding."""


def check_shapes(states: Any, force: Any) -> tuple[NDArray[np.float64], Float[Array, "n *outputs"]]:
    """States (n, dim) and force (n,) or (n, outputs); the force may be traced.

    Raises
    ------
    TypeError, ValueError
        If shapes disagree or values are not finite.
    """
    states = as_array(states, "states", 2)
    force = force if isinstance(force, Tracer) else jnp.asarray(as_array(force, "force", (1, 2)))
    if states.shape[1] == 0:
        raise ValueError(f"`states` must have at least one column; got shape {states.shape}.")
    if force.ndim not in (1, 2) or force.shape[0] != states.shape[0] or 0 in force.shape[1:]:
        raise ValueError(
            f"`force` must have one row per state, shape ({states.shape[0]},) or ({states.shape[0]}, outputs); "
            f"got shape {force.shape}."
        )
    return states, force


def check_varied(states: NDArray[np.float64]) -> None:
    """Refuse a column that is constant."""
    for column in np.flatnonzero(states.std(axis=0) <= CONSTANT_TOLERANCE * np.abs(states).max(axis=0)):
        raise ValueError(
            f"Column {column} of `states` is constant ({states[0, column]:g}): the force cannot depend on it. "
            "Leave it out."
        )


def check_rank(triangle: np.ndarray, monomials: str, points: str, remedy: str) -> None:
    """Refuse states on which the monomials, of which `triangle` is the R of a QR factorisation, are dependent."""
    singular_values = np.linalg.svd(triangle, compute_uv=False)
    rank = int(np.sum(singular_values > RANK_TOLERANCE * singular_values[0]))
    if rank < triangle.shape[1]:
        raise ValueError(
            f"`states` must determine all {triangle.shape[1]} {monomials}; the {points} have rank {rank}: they lie "
            f"on a line or curve, as a steady sinusoidal motion does. {remedy}"
        )


def reach_of(points: NDArray[np.float64], neighbours: int) -> float:
    """Distance within which a state counts as visited: that of 95 in 100 points to their so many-th neighbour."""
    distance = KDTree(points).query(points, k=min(neighbours, len(points) - 1) + 1)[0]
    return float(np.quantile(np.asarray(distance)[:, -1], 0.95))


def within(points: NDArray[np.float64], reach: float, states: NDArray[np.float64]) -> Bool[NDArray[np.bool_], " q"]:
    """Whether each state has a point within `reach`, all in the same units."""
    return np.asarray(KDTree(points).query(states)[0]) <= reach
