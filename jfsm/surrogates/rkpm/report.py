"""What was done at each state: how many nodes, how far, how well they carry the basis."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int
from numpy.typing import NDArray

from .basis import basis_size
from .estimates import Neighbourhood, Rule, basis_at
from .many import apart, neighbourhoods, search_tree
from .nodes import Nodes
from .support import gathered_nodes


class Support(NamedTuple):
    """The local fits behind a map, one row per state."""

    nodes: Int[NDArray[np.intp], " q"]
    """Distinct nodes inside the window's support, the paper's n*."""
    dilation: Float[NDArray[np.float64], "q dim"]
    """a of eq. 8 per column, in its unit."""
    condition: Float[NDArray[np.float64], " q"]
    """Condition of the moment matrix, by the pivots of its triangle; infinite where no answer is given."""
    visited: Bool[NDArray[np.bool_], " q"]
    """Whether readings lie around; elsewhere the map extrapolates."""


def supports(nodes: Nodes, rule: Rule, states: NDArray[np.float64], visited: Bool[NDArray[np.bool_], " q"]) -> Support:
    """The supports that exact evaluation uses, grown where the nearest nodes do not suffice."""
    counts, condition = np.zeros(len(states), dtype=int), np.zeros(len(states))
    dilation = np.zeros((len(states), nodes.dim))
    for inside, where in apart(nodes, rule, states):
        near = gathered_nodes(rule.neighbours, len(inside))
        work = near * basis_size(nodes.dim, rule.order)
        parts = [
            [np.asarray(one)[:length] for one in _supports(around, inside.scale, rule, block)]
            for around, block, length in neighbourhoods(search_tree(inside), inside, near, states[where], work)
        ]
        for every, found in zip((counts, dilation, condition), zip(*parts, strict=True), strict=False):
            every[where] = np.concatenate(found)
    return Support(counts, dilation, condition, visited)


@eqx.filter_jit
def _supports(
    around: Neighbourhood, scale: Float[Array, " dim"], rule: Rule, states: Float[Array, "q dim"]
) -> tuple[Array, Array, Array]:
    def one(near: Neighbourhood, state: Float[Array, " dim"]) -> tuple[Array, Array, Array]:
        local = basis_at(near, scale, rule, state)
        ratio = local.conditioning
        condition = jnp.where(ratio > 0.0, 1.0 / jnp.where(ratio > 0.0, ratio, 1.0) ** 2, jnp.inf)
        return jnp.sum(local.root_weight > 0.0), local.dilation, condition

    return jax.vmap(one)(around, states)
