"""Force, derivatives and standard error at one state, from the nodes around it."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .basis import DerivativeTargets, basis_size
from .interfaces import Interface, region
from .nodes import Nodes
from .shape_functions import LocalBasis, local_basis
from .support import BEYOND, choose_dilation, gathered_nodes
from .windows import AbstractWindow

SINGULAR = 1e-12
"""Pivot ratio of √W H below which no answer is given: its derivatives would have no correct digit."""


class Rule(eqx.Module):
    """How the nodes around a state are weighed."""

    window: AbstractWindow
    order: int = eqx.field(static=True)
    neighbours: int = eqx.field(static=True)
    dilation: Float[Array, ""]
    """Dilation over that at which `neighbours` nodes fill the support, 1 at most."""
    across: tuple[Interface, ...] = ()
    """Interfaces that no neighbourhood crosses."""


class Neighbourhood(NamedTuple):
    """The nodes nearest to one state, nearest first."""

    states: Float[Array, "near dim"]
    force: Float[Array, "near *outputs"]
    multiplicity: Float[Array, " near"]


def nearest_nodes(
    nodes: Nodes, state: Float[Array, " dim"], count: int, across: tuple[Interface, ...] = ()
) -> Neighbourhood:
    """Neighbours of one state by brute force over all nodes of its region: traceable, O(nodes)."""
    offsets = jax.lax.stop_gradient((state[None, :] - nodes.states) / nodes.scale[None, :])
    squared = jnp.sum(offsets**2, axis=1)
    if across:  # I_Ω of eq. 48
        home = jax.vmap(lambda node: region(node, across))(nodes.states) == region(state, across)
        squared = jnp.where(home, squared, jnp.inf)
    least, chosen = jax.lax.top_k(-squared, count)
    states = nodes.states[chosen]
    if across:  # where the region has no more nodes, the rest stands at the edge of the support and weighs nothing
        inside = jnp.isfinite(least)
        farthest = states[jnp.maximum(jnp.sum(inside) - 1, 0)]
        states = jnp.where(inside[:, None], states, (state + BEYOND * (farthest - state))[None, :])
    return Neighbourhood(states, nodes.force[chosen], nodes.multiplicity[chosen])


def basis_at(near: Neighbourhood, scale: Float[Array, " dim"], rule: Rule, state: Float[Array, " dim"]) -> LocalBasis:
    """Local basis with the support that the neighbourhood calls for."""
    a = choose_dilation(
        (state[None, :] - near.states) / scale[None, :],
        near.multiplicity,
        neighbours=rule.neighbours,
        order=rule.order,
        window=rule.window,
        factor=rule.dilation,
    )
    return local_basis(
        state, near.states, a * scale, order=rule.order, window=rule.window, multiplicity=near.multiplicity
    )


def standard_error_at(local: LocalBasis, near: Neighbourhood, targets: DerivativeTargets) -> Float[Array, "*outputs"]:
    """Standard error of the first of `targets`; `RKPM.std` states the formula."""
    force = near.force.reshape(near.force.shape[0], -1)
    weighted = local.root_weight[:, None] * force
    residual = weighted - local.q @ (local.q.T @ weighted)  # √(φc)·e
    freedom = jnp.sum(local.root_weight**2 / near.multiplicity * (1.0 - local.leverage))
    variance = jnp.sum(residual**2, axis=0) / freedom
    spread = jnp.sum(local.shape_functions(targets) ** 2 / near.multiplicity)
    return jnp.sqrt(variance * spread).reshape(near.force.shape[1:])


def degenerate_message(nodes: Nodes, rule: Rule) -> str:
    """Why no local fit is possible around a state."""
    size = basis_size(nodes.dim, rule.order)
    near = gathered_nodes(rule.neighbours, len(nodes))
    return (
        f"The nodes around the state are in degenerate position: the nearest {near} of {len(nodes)} determine fewer "
        f"than the {size} monomials of order {rule.order} (the moment matrix has rank below {size}). "
        "Enlarge `neighbours`, lower `order`, or thin out readings that repeat one line or curve."
    )
