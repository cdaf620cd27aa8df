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
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.spatial import KDTree

from ..._types import Array, is_traced
from .._blocks import padded_blocks
from .basis import DerivativeTargets, basis_size
from .estimates import SINGULAR, Neighbourhood, Rule, basis_at, degenerate_message
from .interfaces import regions
from .moments import moment_estimates
from .nodes import Nodes
from .support import gathered_nodes, support_radius

TRUSTED_PIVOT_RATIO = 1e-2
"""Pivot ratio above which Cholesky serves: a cubic is then reproduced to 4e-10 or better, at the corners of
a two-tone motion with one neighbour to spare; at 1e-3 to 1e-7 only. QR keeps 1e-10 at every ratio met there."""

LARGEST_WORK = 2**21
"""Numbers in flight at once, such as states × neighbours × monomials: 16 MiB, so that a block stays near the cache."""

LARGEST_CHUNK = 2**14
"""Points × neighbours whose powers are held at once: 128 KiB a power, so that all of them stay in the cache."""

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
    force, columns = nodes.force.reshape(len(nodes), -1), np.ascontiguousarray(tree.data.T)
    found = []
    largest = LARGEST_WORK // (rule.neighbours * basis_size(nodes.dim, rule.order))
    for block, length in padded_blocks(states, largest):
        points = block / scale
        distance, index = _nearest(tree, points, min(rule.neighbours + 1, len(nodes)))
        index = _in_chunks(index[:, : rule.neighbours])
        chunks, _, chunk = index.shape
        here = points.T.reshape(nodes.dim, chunks, 1, chunk)
        # What a block gives is not looked at before the last: XLA computes one while the tree is searched for the next.
        block_estimates, ratio = moment_estimates(
            [jnp.asarray(x - column[index]) for x, column in zip(here, columns, strict=True)],
            jnp.asarray(multiplicity[index]),
            _take(force, index),
            support_radius(jnp.asarray(distance), rule.neighbours),
            nodes.scale,
            targets,
            rule,
        )
        found.append((block_estimates, ratio, length))
    estimates = [np.zeros((0, len(targets.orders), force.shape[1])), *(_first(part, n) for part, _, n in found)]
    return _joined(estimates), np.concatenate([np.zeros(0), *(np.asarray(ratio)[:n] for _, ratio, n in found)])


def _in_chunks(index: NDArray[np.intp]) -> NDArray[np.intp]:
    """Nodes (points, near) around points as (chunks, near, chunk); points and chunks are counted by powers of two."""
    points, near = index.shape
    chunk = min(points, 1 << max(LARGEST_CHUNK // near, 1).bit_length() - 1)
    return np.ascontiguousarray(index.reshape(points // chunk, chunk, near).transpose(0, 2, 1))


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
