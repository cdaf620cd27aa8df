"""What each reading would have been called by the others, in closed form."""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.linalg import solve_triangular
from jaxtyping import Array, Float, Int
from numpy.typing import NDArray

from .basis import basis_size, monomials
from .estimates import Neighbourhood, Rule, nearest_nodes
from .many import apart, neighbourhoods, search_tree
from .nodes import Nodes
from .shape_functions import moment_matrix, safe_root, window_weights
from .support import BEYOND, gathered_nodes

RIDGE = 1e-13
"""Added to the moment matrix scaled to a unit diagonal: a degenerate neighbourhood scores badly and does not fail."""

BATCH = 32
"""Nodes in one block of factorisations where the neighbours are searched by brute force."""

LEAST_FREEDOM = 1e-9
"""Share of a reading that the others carry, below which leaving it out has no meaning."""


def leave_one_out_errors(
    nodes: Nodes, rule: Rule, neighbours: Sequence[int], chosen: NDArray[np.intp] | None = None
) -> Float[np.ndarray, "supports chosen outputs"]:
    """Reading minus the map without it, at nodes `chosen` (all when None), for several numbers of neighbours.

    All supports share one search and one program.
    """
    chosen = np.arange(len(nodes)) if chosen is None else chosen
    states = np.asarray(nodes.states)[chosen]
    errors = np.zeros((len(neighbours), len(chosen), int(np.prod(nodes.force.shape[1:], dtype=int))))
    for inside, where in apart(nodes, rule, states):
        near = min(max(neighbours) + 1, len(inside))
        work = near * basis_size(nodes.dim, rule.order)
        parts = [
            np.asarray(_errors(around, block, inside.scale, jnp.asarray(list(neighbours)), rule))[:, :length]
            for around, block, length in neighbourhoods(search_tree(inside), inside, near, states[where], work)
        ]
        errors[:, where] = np.concatenate(parts, axis=1)
    return errors


@eqx.filter_jit
def _errors(
    around: Neighbourhood,
    states: Float[Array, "q dim"],
    scale: Float[Array, " dim"],
    supports: Int[Array, " supports"],
    rule: Rule,
) -> Float[Array, "supports q outputs"]:
    def at(support: Int[Array, ""]) -> Float[Array, "q outputs"]:
        return jax.vmap(lambda near, state: error_at_node(near, state, scale, support, rule))(around, states)

    return jax.lax.map(at, supports)


def errors_within(nodes: Nodes, rule: Rule, chosen: Int[Array, " chosen"]) -> Float[Array, "chosen outputs"]:
    """Reading minus the map without it at nodes `chosen`, with neighbours by brute force: traceable, also in the nodes.

    Which nodes are neighbours may change with the scales and never makes a step: a node that enters weighs nothing.
    """

    def at(state: Float[Array, " dim"]) -> Float[Array, " outputs"]:
        near = nearest_nodes(nodes, state, gathered_nodes(rule.neighbours, len(nodes)), rule.across)
        near = near._replace(force=near.force.reshape(len(near.force), -1))
        return error_at_node(near, state, nodes.scale, rule.neighbours, rule)

    blocks = -(-len(chosen) // BATCH)
    width = -(-len(chosen) // blocks)  # of one size, lest the rest be a second program
    even = jnp.resize(chosen, (blocks, width))
    return jax.lax.map(jax.vmap(at), nodes.states[even]).reshape(blocks * width, -1)[: len(chosen)]


def error_at_node(
    near: Neighbourhood,
    state: Float[Array, " dim"],
    scale: Float[Array, " dim"],
    support: Int[Array, ""] | int,
    rule: Rule,
) -> Float[Array, " outputs"]:
    r"""Reading at a node minus what its neighbours say there; `near` begins with the node itself.

    Notes
    -----
    :math:`e_i = (u_i - u^a(x_i)) / (1 - \psi_i(x_i))`, exact for a local fit whose support stays.
    """
    offsets = (state[None, :] - near.states) / scale[None, :]
    distance = safe_root(jnp.sum(offsets**2, axis=1))
    ends = jnp.append(distance, BEYOND * distance[-1])  # as `support_radius`, with the count as data
    z = offsets * rule.window.radius / (rule.dilation * ends[jnp.minimum(support, len(distance))])
    weight = window_weights(z, rule.window) * near.multiplicity
    moments = moment_matrix(z, weight, rule.order)
    size = jnp.sqrt(jnp.diagonal(moments))
    size = jnp.where(size > 0.0, size, 1.0)
    factor = jnp.linalg.cholesky(moments / (size[:, None] * size[None, :]) + RIDGE * jnp.eye(len(size)))
    target = jnp.zeros(len(size)).at[0].set(1.0 / size[0])
    half = solve_triangular(factor, target, lower=True)
    correction = solve_triangular(factor, half, lower=True, trans=1) / size  # M⁻¹ H(0), eq. 24
    psi = weight * (monomials(z, rule.order) @ correction)  # eq. 28
    value = jnp.tensordot(psi, near.force, axes=1)
    return (near.force[0] - value) / jnp.maximum(1.0 - psi[0], LEAST_FREEDOM)
