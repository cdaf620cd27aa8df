"""The data of a map: checked, merged and scaled."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float
from scipy.spatial import KDTree

from ..._types import as_array
from .basis import basis_size, chebyshev_polynomials

RANK_TOLERANCE = 1e-11
"""Singular values below this share of the largest count as zero; the polynomials are Chebyshev's over the box."""

CONSTANT_TOLERANCE = 1e-12
"""A column that varies by less than this share of its size is constant to rounding."""

REACH_ORDER = 3
"""Order whose n* measures the visited region of maps of higher order too."""


class Nodes(eqx.Module):
    """Distinct states, and the mean of the force that was read at each."""

    states: Float[Array, "nodes dim"]
    force: Float[Array, "nodes *outputs"]
    multiplicity: Float[Array, " nodes"]
    """How many readings each node stands for; less where they are doubted."""
    scale: Float[Array, " dim"]
    """Standard deviation of each column."""
    reach: Float[Array, ""]
    """Distance to the nearest node, in standard deviations, within which a state counts as visited: that of 95 in 100
    nodes to their n*-th neighbour."""

    def __len__(self) -> int:
        return self.states.shape[0]

    @property
    def dim(self) -> int:
        return self.states.shape[1]


def prepare_nodes(states: Any, force: Any, order: int) -> Nodes:
    """Nodes of a map from readings.

    Parameters
    ----------
    states : (n, dim) array
    force : (n,) or (n, outputs) array
        May be traced, so that a map can be differentiated by the readings.
    order : int
        Highest order of the polynomials that the states must determine.

    Raises
    ------
    TypeError, ValueError
        If shapes disagree, values are not finite, a column is constant, or the states are too few or in degenerate
        position for the polynomials of this order.
    """
    states = as_array(states, "states", 2)
    force = force if isinstance(force, Tracer) else jnp.asarray(as_array(force, "force", (1, 2)))
    if states.shape[1] == 0:
        raise ValueError(f"`states` must have at least one column; got shape {states.shape}.")
    if force.ndim not in (1, 2) or force.shape[0] != states.shape[0]:
        raise ValueError(
            f"`force` must have one row per state, shape ({states.shape[0]},) or ({states.shape[0]}, outputs); "
            f"got shape {force.shape}."
        )
    distinct, inverse, counts = np.unique(states, axis=0, return_inverse=True, return_counts=True)
    check_enough(distinct, order)
    scale = states.std(axis=0)
    for column in np.flatnonzero(scale <= CONSTANT_TOLERANCE * np.abs(states).max(axis=0)):
        raise ValueError(
            f"Column {column} of `states` is constant ({states[0, column]:g}): the force cannot depend on it. "
            "Leave it out."
        )
    check_rank(distinct, order)
    total = jnp.zeros((len(counts), *force.shape[1:])).at[inverse.reshape(-1)].add(force)
    multiplicity = jnp.asarray(counts, dtype=float)
    mean = total / multiplicity.reshape(-1, *[1] * (force.ndim - 1))
    neighbours = min(basis_size(states.shape[1], min(order, REACH_ORDER)), len(counts) - 1)
    distance = np.asarray(KDTree(distinct / scale).query(distinct / scale, k=neighbours + 1)[0])
    reach = np.quantile(distance[:, -1], 0.95)
    return Nodes(jnp.asarray(distinct), mean, multiplicity, jnp.asarray(scale), jnp.asarray(reach))


def check_enough(distinct: np.ndarray, order: int) -> None:
    count, dim = distinct.shape
    least = basis_size(dim, order)
    if count < least:
        raise ValueError(
            f"`states` must hold at least {least} distinct points for order {order} in {dim} dimensions (n*, eq. 72); "
            f"got {count}. Add data or lower `order`."
        )


def check_rank(distinct: np.ndarray, order: int) -> None:
    """Polynomials that are dependent over all nodes are so in every neighbourhood."""
    low, high = distinct.min(axis=0), distinct.max(axis=0)
    basis = chebyshev_polynomials((2.0 * distinct - high - low) / (high - low), order)
    singular_values = np.linalg.svd(np.linalg.qr(basis, mode="r"), compute_uv=False)
    rank = int(np.sum(singular_values > RANK_TOLERANCE * singular_values[0]))
    if rank < basis.shape[1]:
        raise ValueError(
            f"`states` must determine all {basis.shape[1]} monomials of order {order}; the {len(distinct)} distinct "
            f"points have rank {rank}: they lie on a line or curve, as a steady sinusoidal motion does. "
            "Add data of another amplitude or lower `order`."
        )
