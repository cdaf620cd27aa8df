"""The data of a map: checked, merged and scaled."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._types import is_traced
from .._readings import check_rank, check_shapes, check_varied, reach_of
from .basis import basis_size, chebyshev_polynomials

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
    states, force = check_shapes(states, force)
    distinct, inverse, counts = np.unique(states, axis=0, return_inverse=True, return_counts=True)
    check_enough(distinct, order)
    scale = states.std(axis=0)
    check_varied(states)
    check_determined(distinct, order)
    total, multiplicity = np.zeros((len(counts), *force.shape[1:])), counts.astype(float)
    if is_traced(force):
        total = jnp.asarray(total).at[inverse.reshape(-1)].add(force)
    else:
        np.add.at(total, inverse.reshape(-1), np.asarray(force))
    mean = jnp.asarray(total / multiplicity.reshape(-1, *[1] * (force.ndim - 1)))
    reach = reach_of(distinct / scale, basis_size(states.shape[1], min(order, REACH_ORDER)))
    return Nodes(jnp.asarray(distinct), mean, jnp.asarray(multiplicity), jnp.asarray(scale), jnp.asarray(reach))


def check_enough(distinct: np.ndarray, order: int) -> None:
    count, dim = distinct.shape
    least = basis_size(dim, order)
    if count < least:
        raise ValueError(
            f"`states` must hold at least {least} distinct points for order {order} in {dim} dimensions (n*, eq. 72); "
            f"got {count}. Add data or lower `order`."
        )


def check_determined(distinct: np.ndarray, order: int) -> None:
    """Polynomials that are dependent over all nodes are so in every neighbourhood."""
    low, high = distinct.min(axis=0), distinct.max(axis=0)
    basis = chebyshev_polynomials((2.0 * distinct - high - low) / (high - low), order)
    check_rank(
        np.asarray(np.linalg.qr(basis, mode="r")),
        f"monomials of order {order}",
        f"{len(distinct)} distinct points",
        "Add data of another amplitude or lower `order`.",
    )
