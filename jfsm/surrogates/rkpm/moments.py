"""Many points at once: distinct moments and a Cholesky factor written out, with the points in the last axis."""

import math
from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.scipy.linalg import cho_solve
from jaxtyping import Array, Float

from .basis import DerivativeTargets, MultiIndex, multi_indices
from .estimates import Rule
from .shape_functions import window_weights
from .support import pivot_ratio

UNROLLED = 10
"""Largest basis whose factor is written out; above, compiling it costs more than LAPACK's batches."""

Column = Float[Array, " points"]
Triangle = list[list[Column]]
"""Lower triangle of a symmetric matrix: row i holds the entries 0 to i."""


@eqx.filter_jit
def moment_estimates(
    offsets: Sequence[Float[Array, "chunks near chunk"]],
    multiplicity: Float[Array, "chunks near chunk"],
    force: Float[Array, "chunks near chunk outputs"],
    support: Float[Array, " points"],
    scale: Float[Array, " dim"],
    targets: DerivativeTargets,
    rule: Rule,
) -> tuple[Float[Array, "points derivatives outputs"], Float[Array, " points"]]:
    """Derivatives of the map at many points, and the pivot ratio that says whether to trust them.

    Parameters
    ----------
    offsets : sequence of (chunks, near, chunk) float arrays, one per axis
        Point minus node, in units of `scale`. Points come in chunks, those of the first before those of the second; a
        chunk is small enough for its sums to be formed in the cache.
    multiplicity : (chunks, near, chunk) float array
        How many readings each node stands for.
    force : (chunks, near, chunk, outputs) float array
    support : (points,) float array
        Distance at which the support ends, in units of `scale`.
    scale : (dim,) float array
        Scale of the offsets per axis, in its unit.

    Returns
    -------
    estimates : (points, derivatives, outputs) float array
    ratio : (points,) float array
        Smallest over largest pivot; 0 where the factor broke down, and the estimate is meaningless.

    Notes
    -----
    M holds far fewer distinct moments Σ w z^(α+β) than entries: 28 for the 10 × 10 of a cubic basis in two dimensions.
    """
    chunks, _, chunk = multiplicity.shape
    dilation = rule.dilation * support / rule.window.radius
    inputs = (tuple(offsets), multiplicity, force, dilation.reshape(chunks, chunk))
    sums = jax.lax.map(lambda each: _sums(each[0], each[1], each[2], each[3], rule), inputs)
    moments, loads = jax.tree.map(lambda q: q.reshape(-1, *q.shape[2:]), sums)
    basis = multi_indices(len(offsets), rule.order)
    matrix = [[moments[_plus(alpha, beta)] for beta in basis[: row + 1]] for row, alpha in enumerate(basis)]
    solve = _solve_unrolled if len(basis) <= UNROLLED else _solve_batched
    correction, ratio = solve(matrix, targets.at_origin)
    estimates = sum(b[..., None] * load[None] for b, load in zip(correction, loads, strict=True))
    unit = jax.vmap(targets.per_unit, out_axes=1)(dilation[:, None] * scale[None, :])
    return jnp.moveaxis(estimates * unit[..., None], 0, 1), ratio


def _sums(
    offsets: Sequence[Float[Array, "near chunk"]],
    multiplicity: Float[Array, "near chunk"],
    force: Float[Array, "near chunk outputs"],
    dilation: Float[Array, " chunk"],
    rule: Rule,
) -> tuple[dict[MultiIndex, Float[Array, " chunk"]], list[Float[Array, "chunk outputs"]]]:
    """Moments Σ w z^α up to twice the order, and loads Σ H w u, of the points of one chunk."""
    # The sums run over the first axis, points side by side. Without the barriers XLA would form window, quotients and
    # powers anew in each of the many sums.
    z = [axis / dilation[None, :] for axis in offsets]
    weight = window_weights(jnp.stack(z, axis=-1), rule.window) * multiplicity
    first, *others = [_powers(axis, 2 * rule.order) for axis in _kept(z)]
    weighted = [weight, *_kept([weight * power for power in first[1:]])]

    def total(values: list[Array], alpha: MultiIndex) -> Array:
        factors = [powers[e] for powers, e in zip(others, alpha[1:], strict=True) if e]
        return jnp.sum(math.prod(factors, start=values[alpha[0]]), axis=0)

    moments = {alpha: total(weighted, alpha) for alpha in multi_indices(len(z), 2 * rule.order)}
    loads = []
    for output in range(force.shape[-1]):
        driven = _kept([w * force[..., output] for w in weighted[: rule.order + 1]])
        loads.append([total(driven, alpha) for alpha in multi_indices(len(z), rule.order)])
    return moments, [jnp.stack(of_outputs, axis=-1) for of_outputs in zip(*loads, strict=True)]


def _powers(base: Array, highest: int) -> list[Array]:
    """Powers of one coordinate, from the zeroth."""
    powers = [jnp.ones_like(base), base]
    while len(powers) <= highest:
        powers += _kept([powers[-1] * base])
    return powers


def _kept(values: list[Array]) -> list[Array]:
    """The same values, formed once."""
    return list(jax.lax.optimization_barrier(tuple(values)))


def _plus(a: MultiIndex, b: MultiIndex) -> MultiIndex:
    return tuple(i + j for i, j in zip(a, b, strict=True))


def _solve_unrolled(
    matrix: Triangle, targets: Float[Array, "derivatives basis"]
) -> tuple[list[Float[Array, "derivatives points"]], Column]:
    """M⁻¹ of each target, by a Cholesky factor whose every entry is an array over the points."""
    size = len(matrix)
    factor: Triangle = []
    for i in range(size):
        row: list[Column] = []
        for j in range(i):
            row.append((matrix[i][j] - _dot(row, factor[j])) / factor[j][j])
        row.append(jnp.sqrt(matrix[i][i] - _dot(row, row)))
        factor.append(row)

    def substitute(target: Float[Array, " basis"]) -> list[Column]:
        forward: list[Column] = []
        for i in range(size):
            forward.append((target[i] - _dot(factor[i], forward)) / factor[i][i])
        solution: list[Column] = []  # filled from its end
        for i in reversed(range(size)):
            below = [factor[k][i] for k in range(i + 1, size)]
            solution.insert(0, (forward[i] - _dot(below, solution)) / factor[i][i])
        return solution

    pivots = jnp.stack([factor[i][i] for i in range(size)])
    return jax.vmap(substitute)(targets), pivot_ratio(pivots)


def _dot(a: list[Column], b: list[Column]) -> Any:
    """Sum of products over the shorter list; 0 when it is empty."""
    return sum(p * q for p, q in zip(a, b, strict=False))


def _solve_batched(
    matrix: Triangle, targets: Float[Array, "derivatives basis"]
) -> tuple[list[Float[Array, "derivatives points"]], Column]:
    """M⁻¹ of each target by LAPACK, one point after another."""
    size = len(matrix)
    full = jnp.stack([jnp.stack([matrix[max(i, j)][min(i, j)] for j in range(size)], -1) for i in range(size)], -2)
    factor = jnp.linalg.cholesky(full)
    solution = jax.vmap(lambda one: cho_solve((one, True), targets.T))(factor)  # (points, basis, derivatives)
    return list(jnp.moveaxis(solution, 0, -1)), pivot_ratio(jnp.diagonal(factor, axis1=1, axis2=2).T)
