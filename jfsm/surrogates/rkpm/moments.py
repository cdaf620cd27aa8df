"""Many points at once: distinct moments and a Cholesky factor written out, with the points in the last axis."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.scipy.linalg import cho_solve
from jaxtyping import Array, Float

from .basis import DerivativeTargets, MultiIndex, monomial_columns, multi_indices
from .estimates import Rule
from .shape_functions import window_weights
from .support import pivot_ratio, support_radius

UNROLLED = 10
"""Largest basis whose factor is written out; above, compiling it costs more than LAPACK's batches."""

Column = Float[Array, " points"]
Triangle = list[list[Column]]
"""Lower triangle of a symmetric matrix: row i holds the entries 0 to i."""


@eqx.filter_jit
def moment_estimates(
    offsets: Float[Array, "points near dim"],
    multiplicity: Float[Array, "points near"],
    force: Float[Array, "points near outputs"],
    distance: Float[Array, "points near_and_next"],
    scale: Float[Array, " dim"],
    targets: DerivativeTargets,
    rule: Rule,
) -> tuple[Float[Array, "points derivatives outputs"], Float[Array, " points"]]:
    """Derivatives of the map at many points, and the pivot ratio that says whether to trust them.

    Parameters
    ----------
    offsets : (points, near, dim) float array
        Point minus node, in units of `scale`.
    multiplicity : (points, near) float array
        How many readings each node stands for.
    force : (points, near, outputs) float array
    distance : (points, near + 1) float array
        Length of the offsets, rising, and that of the next node, where the support ends; without it if there is none.
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
    dim, order = offsets.shape[-1], rule.order
    dilation = rule.dilation * support_radius(distance, rule.neighbours) / rule.window.radius
    z = offsets / dilation[:, None, None]
    weight = window_weights(z, rule.window) * multiplicity
    powers = multi_indices(dim, 2 * order)
    columns = monomial_columns([z[..., axis] for axis in range(dim)], 2 * order)
    moments = {exponents: jnp.sum(weight * column, axis=1) for exponents, column in zip(powers, columns, strict=True)}
    basis = multi_indices(dim, order)
    matrix = [[moments[_plus(alpha, beta)] for beta in basis[: row + 1]] for row, alpha in enumerate(basis)]
    solve = _solve_unrolled if len(basis) <= UNROLLED else _solve_batched
    correction, ratio = solve(matrix, targets.at_origin)
    loads = [jnp.sum((weight * column)[..., None] * force, axis=1) for column in columns[: len(basis)]]  # Σ H φ u
    estimates = sum(b[..., None] * load[None] for b, load in zip(correction, loads, strict=True))
    unit = jax.vmap(targets.per_unit, out_axes=1)(dilation[:, None] * scale[None, :])
    return jnp.moveaxis(estimates * unit[..., None], 0, 1), ratio


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
