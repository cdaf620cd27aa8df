"""Inverse of a symmetric matrix from its Cholesky factor, in as many operations as LAPACK's potri."""

import jax.numpy as jnp
from jax.lax.linalg import triangular_solve
from jaxtyping import Array, Float

BLOCK = 256
"""Columns solved at once: enough for matrix products to carry the work, few enough to skip most zeros."""


def inverse_columns(factor: Float[Array, "n n"], start: int) -> Float[Array, "rest width"]:
    """The next `BLOCK` columns of K⁻¹ from row and column `start` on, K = L Lᵀ.

    Below row `start` the columns depend on the lower right part of L alone; the rest of K⁻¹ is its mirror image.
    """
    part = factor[start:, start:]
    unit = jnp.eye(len(part), min(BLOCK, len(part)))
    half = triangular_solve(part, unit, left_side=True, lower=True)
    return triangular_solve(part, half, left_side=True, lower=True, transpose_a=True)


def inverse_diagonal(factor: Float[Array, "n n"]) -> Float[Array, " n"]:
    """Diagonal of K⁻¹."""
    starts = range(0, len(factor), BLOCK)
    return jnp.concatenate([jnp.diagonal(inverse_columns(factor, start)) for start in starts])
