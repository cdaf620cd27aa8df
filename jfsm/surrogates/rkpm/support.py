"""How far the window reaches: to the nearest nodes, and farther where these cannot carry the basis."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from .shape_functions import moment_matrix, safe_root, window_weights
from .windows import AbstractWindow

GROWTH = (1, 2, 4)
"""Supports that are tried, in multiples of the wanted number of neighbours."""

BEYOND = 1.1
"""Support over the distance to the farthest node when every node there is lies inside."""

SINGULAR_PIVOT_RATIO = 1e-7
"""Ratio of Cholesky pivots below which M, of condition 1e14, is singular to double precision."""


def gathered_nodes(neighbours: int, count: int) -> int:
    """How many of `count` nodes are fetched around a point: enough for the largest support and one beyond it."""
    return min(GROWTH[-1] * neighbours + 1, count)


def support_radius(distance: Float[Array, "*points near"], neighbours: int) -> Float[Array, "*points"]:
    """Support that holds `neighbours` nodes, from their sorted distances.

    It ends at the next node, which thus weighs nothing: the map stays continuous where one node takes another's place.
    """
    if neighbours < distance.shape[-1]:
        return distance[..., neighbours]
    return BEYOND * distance[..., -1]


def pivot_ratio(pivots: Float[Array, "basis *points"]) -> Float[Array, "*points"]:
    """Smallest over largest pivot of a Cholesky factor, about 1/√cond(M); 0 where it broke down."""
    ratio = jnp.min(pivots, axis=0) / jnp.max(pivots, axis=0)
    return jnp.where(jnp.isfinite(ratio), ratio, 0.0)


def choose_dilation(
    offsets: Float[Array, "near dim"],
    multiplicity: Float[Array, " near"],
    *,
    neighbours: int,
    order: int,
    window: AbstractWindow,
    factor: Float[Array, ""],
) -> Float[Array, ""]:
    """Dilation a at one point, in the coordinates of `offsets`.

    Parameters
    ----------
    offsets : (near, dim) float array
        Point minus nodes, nearest first, in coordinates of comparable scale.
    multiplicity : (near,) float array
        How many readings each node stands for.
    neighbours : int
        Number of nodes wanted inside the support.
    factor : () float array
        Share of that support which is used.

    Notes
    -----
    The paper's remedy for a singular moment matrix is a larger n*. Here the support doubles at most twice. The choice
    is piecewise constant, so derivatives pass through the chosen distance only.
    """
    distance = safe_root(jnp.sum(offsets**2, axis=-1))
    radii = jnp.stack([support_radius(distance, growth * neighbours) for growth in GROWTH])
    dilations = factor * radii / window.radius

    def sound(dilation: Float[Array, ""]) -> Bool[Array, ""]:
        z = offsets / dilation
        weight = window_weights(z, window) * multiplicity
        factor = jnp.linalg.cholesky(moment_matrix(z, weight, order))
        return pivot_ratio(jnp.diagonal(factor)) > SINGULAR_PIVOT_RATIO

    enough = jax.vmap(sound)(jax.lax.stop_gradient(dilations))
    chosen = jnp.where(jnp.any(enough), jnp.argmax(enough), len(GROWTH) - 1)
    return dilations[chosen]
