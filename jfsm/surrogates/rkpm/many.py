"""Many states: neighbours from a tree on the host, Cholesky where it is safe, QR where it is not."""

import functools
import weakref
from collections.abc import Iterator
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float
from numpy.typing import NDArray
from scipy.spatial import KDTree

from ..._types import is_traced
from .._blocks import padded_blocks
from .basis import DerivativeTargets, basis_size
from .estimates import SINGULAR, Neighbourhood, Rule, basis_at, degenerate_message
from .interfaces import regions
from .moments import moment_estimates
from .nodes import Nodes
from .support import gathered_nodes

TRUSTED_PIVOT_RATIO = 1e-2
"""Pivot ratio above which Cholesky serves: a cubic is then reproduced to 4e-10 or better, at the corners of
a two-tone motion with one neighbour to spare; at 1e-3 to 1e-7 only. QR keeps 1e-10 at every ratio met there."""

LARGEST_WORK = 2**21
"""Numbers in flight at once, such as states × neighbours × monomials: 16 MiB, so that a block stays near the cache."""

LARGEST_FACTORISED = 256
"""States in one block of factorisations: from 512 on XLA's pool of two threads waits for itself and never ends."""


def evaluate_many(
    nodes: Nodes, rule: Rule, states: NDArray[np.float64], targets: DerivativeTargets
) -> Float[Array, "q derivatives *outputs"]:
    """Derivatives of the map at many states; one search and one factor serve all of them.

    Raises
    ------
    RuntimeError
        If the nodes around some state are in degenerate position.
    """
    force = nodes.force.reshape(len(nodes), -1)
    estimates = np.zeros((len(states), len(targets.orders), force.shape[1]))
    if isinstance(force, Tracer):
        estimates = jnp.asarray(estimates)
    for inside, where in apart(nodes, rule, states):
        part = _evaluate_region(inside, rule, states[where], targets)
        estimates = _placed(estimates, where, part)
    return jnp.asarray(estimates).reshape(len(states), len(targets.orders), *nodes.force.shape[1:])


def apart(nodes: Nodes, rule: Rule, states: NDArray[np.float64]) -> Iterator[tuple[Nodes, NDArray[np.intp]]]:
    """The nodes of each region, and the indices of the states that lie there: the sum of eq. 50, term by term."""
    if not rule.across:
        yield nodes, np.arange(len(states))
        return
    of_nodes, of_states = regions(nodes.states, rule.across), regions(states, rule.across)
    for number in np.unique(of_states):
        own = np.flatnonzero(of_nodes == number)
        where = np.flatnonzero(of_states == number)
        if own.size <= 1:
            raise RuntimeError(
                f"{where.size} of {len(states)} states lie in a region between the interfaces `across` where no "
                f"readings were taken, the first {np.array2string(states[where[0]], precision=4)}."
            )
        taken = Nodes(nodes.states[own], _take(nodes.force, own), nodes.multiplicity[own], nodes.scale, nodes.reach)
        yield taken, where


def _evaluate_region(
    nodes: Nodes, rule: Rule, states: NDArray[np.float64], targets: DerivativeTargets
) -> Float[Array, "q derivatives outputs"]:
    tree = search_tree(nodes)
    estimates, ratio = _by_moments(tree, nodes, rule, states, targets)
    doubtful = np.flatnonzero(ratio < TRUSTED_PIVOT_RATIO)
    if doubtful.size:
        exact, conditioning = _by_factorisation(tree, nodes, rule, states[doubtful], targets)
        failed = doubtful[~(conditioning >= SINGULAR)]
        if failed.size:
            first = np.array2string(states[failed[0]], precision=4)
            raise RuntimeError(
                f"{degenerate_message(nodes, rule)} So at {failed.size} of {len(states)} states, the first {first}."
            )
        estimates = _placed(estimates, doubtful, exact)
    return estimates


def _by_moments(
    tree: KDTree, nodes: Nodes, rule: Rule, states: NDArray[np.float64], targets: DerivativeTargets
) -> tuple[Float[Array, "q derivatives outputs"], NDArray[np.float64]]:
    """Fast estimates, each with the pivot ratio of its moment matrix."""
    scale, multiplicity = np.asarray(nodes.scale), np.asarray(nodes.multiplicity)
    force = nodes.force.reshape(len(nodes), -1)
    estimates, ratios = [np.zeros((0, len(targets.orders), force.shape[1]))], [np.zeros(0)]
    largest = LARGEST_WORK // (rule.neighbours * basis_size(nodes.dim, rule.order))
    for block, length in padded_blocks(states, largest):
        distance, index = _nearest(tree, block / scale, min(rule.neighbours + 1, len(nodes)))
        index = index[:, : rule.neighbours]
        block_estimates, ratio = moment_estimates(
            jnp.asarray((block / scale)[:, None, :] - tree.data[index]),
            jnp.asarray(multiplicity[index]),
            _take(force, index),
            jnp.asarray(distance),
            nodes.scale,
            targets,
            rule,
        )
        estimates.append(_first(block_estimates, length))
        ratios.append(np.asarray(ratio)[:length])
    return _joined(estimates), np.concatenate(ratios)


def _by_factorisation(
    tree: KDTree, nodes: Nodes, rule: Rule, states: NDArray[np.float64], targets: DerivativeTargets
) -> tuple[Float[Array, "q derivatives outputs"], NDArray[np.float64]]:
    """Exact estimates with supports that grow, each with the conditioning of its basis."""
    near = gathered_nodes(rule.neighbours, len(nodes))
    work = near * basis_size(nodes.dim, rule.order)
    parts = [
        (_first(estimates, length), np.asarray(conditioning)[:length])
        for around, block, length in neighbourhoods(tree, nodes, near, states, work)
        for estimates, conditioning in [_exact_estimates(around, nodes.scale, rule, block, targets)]
    ]
    estimates, conditionings = zip(*parts, strict=True)
    return _joined(list(estimates)), np.concatenate(conditionings)


def search_tree(nodes: Nodes) -> KDTree:
    """Tree of the nodes, each column in units of its scale; it is kept as long as they are."""
    owners = nodes.states, nodes.scale
    key = tuple(map(id, owners))
    kept = _TREES.get(key)
    if kept is None or any(owner() is not now for owner, now in zip(kept.owners, owners, strict=True)):
        tree = KDTree(np.asarray(nodes.states) / np.asarray(nodes.scale))
        forget = functools.partial(_forget, key)
        kept = _TREES[key] = _Kept(tree, tuple(weakref.ref(owner, forget) for owner in owners))
    return kept.tree


class _Kept(NamedTuple):
    tree: KDTree
    owners: tuple[weakref.ref, ...]
    """The arrays that it was made of: a number of theirs may be another array's later."""


_TREES: dict[tuple[int, ...], _Kept] = {}


def _forget(key: tuple[int, ...], _: weakref.ref) -> None:
    _TREES.pop(key, None)


def neighbourhoods(
    tree: KDTree, nodes: Nodes, count: int, states: NDArray[np.float64], work: int
) -> Iterator[tuple[Neighbourhood, Float[Array, "block dim"], int]]:
    """Blocks of states with their `count` nearest nodes; the last number counts the true states.

    A state takes `work` numbers. Blocks are small enough to be factorised. The force of each neighbourhood is
    (block, count, outputs).
    """
    node_states, multiplicity = np.asarray(nodes.states), np.asarray(nodes.multiplicity)
    force = nodes.force.reshape(len(nodes), -1)
    for block, length in padded_blocks(states, min(LARGEST_WORK // work, LARGEST_FACTORISED)):
        _, index = _nearest(tree, block / np.asarray(nodes.scale), count)
        around = Neighbourhood(jnp.asarray(node_states[index]), _take(force, index), jnp.asarray(multiplicity[index]))
        yield around, jnp.asarray(block), length


@eqx.filter_jit
def _exact_estimates(
    around: Neighbourhood,
    scale: Float[Array, " dim"],
    rule: Rule,
    states: Float[Array, "q dim"],
    targets: DerivativeTargets,
) -> tuple[Float[Array, "q derivatives outputs"], Float[Array, " q"]]:
    def one(near: Neighbourhood, state: Float[Array, " dim"]) -> tuple[Array, Array]:
        local = basis_at(near, scale, rule, state)
        return local.derivatives(targets, near.force), local.conditioning

    return jax.vmap(one)(around, states)


def _nearest(tree: KDTree, points: NDArray[np.float64], count: int) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Distances and indices of the `count` nearest nodes of each point; a basis needs at least two."""
    distance, index = tree.query(points, count, workers=-1)
    return np.asarray(distance), np.asarray(index)


def _take(force: Float[Array, "nodes *outputs"], index: NDArray[np.intp]) -> Array:
    """Rows of the force; on the host unless it is traced, so that no program depends on the number of nodes."""
    return force[index] if isinstance(force, Tracer) else jnp.asarray(np.asarray(force)[index])


def _placed(values: Any, where: NDArray[np.intp], part: Any) -> Any:
    """Rows `where` replaced by `part`; on the host unless one is traced."""
    if is_traced((values, part)):
        return jnp.asarray(values).at[where].set(part)
    values = np.array(values)
    values[where] = np.asarray(part)
    return values


def _first(block: Array, length: int) -> Any:
    return block[:length] if isinstance(block, Tracer) else np.asarray(block)[:length]


def _joined(parts: list[Any]) -> Array:
    """Blocks end to end; on the host unless one is traced, so that no program depends on the number of states."""
    return jnp.concatenate(parts) if is_traced(parts) else jnp.asarray(np.concatenate(parts))
