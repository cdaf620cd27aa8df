"""Likelihood of the readings, eqs. 63 to 67, with the gradient of its costly part in closed form."""

import functools
import math
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.lax.linalg import cholesky
from jax.scipy.linalg import solve_triangular
from jaxtyping import Float

from ..._types import Array
from .correlations import AbstractCorrelation
from .inverse import BLOCK, inverse_columns


class Readings(eqx.Module):
    """What a likelihood is of: everything but the hyper-parameters."""

    states: Float[Array, "n dim"]
    basis: Float[Array, "n p"]
    """F of eq. 62, orthonormal."""
    force: Float[Array, "n outputs"]
    relative_noise: Float[Array, " n"]
    """Noise variance of each reading over that of a reading of weight one."""
    correlation: AbstractCorrelation
    noise_variance: Float[Array, " outputs"] | None
    """Noise variance [N²] of a reading of weight one where it is known; None where the process variance sets it."""
    restricted: bool = eqx.field(static=True)


class Whitened(NamedTuple):
    """The readings in coordinates in which they are uncorrelated and of equal variance, K = L Lᵀ."""

    factor: Float[Array, "n n"]
    basis: Float[Array, "n p"]
    """U, orthonormal columns that span L⁻¹F."""
    triangle: Float[Array, "p p"]
    """T of L⁻¹F = U T."""
    trend_coefficients: Float[Array, "p outputs"]
    """β of eq. 65."""
    residual: Float[Array, "n outputs"]
    """L⁻¹(g - Fβ)."""


def noisy_diagonal(readings: Readings, nugget: Float[Array, ""], jitter: Float[Array, ""]) -> Float[Array, " n"]:
    """Diagonal of K: correlation, noise, and what numerical reasons add."""
    return 1.0 + nugget * readings.relative_noise + jitter


def scaled_states(states: Float[Array, "n dim"], length_scale: Float[Array, " dim"]) -> Float[Array, "n dim"]:
    """States about their mean, in length scales."""
    return (states - jnp.mean(states, axis=0)[None]) / length_scale[None]


def matrix(
    correlation: AbstractCorrelation, z: Float[Array, "n dim"], diagonal: Float[Array, " n"]
) -> Float[Array, "n n"]:
    """K: the correlation matrix of eq. 54 of states in length scales, with nugget and jitter on its diagonal."""
    unit = jnp.ones(z.shape[1])
    return jnp.where(jnp.eye(len(z), dtype=bool), diagonal[:, None], correlation.between(z, z, unit))


def whiten(k: Float[Array, "n n"], f: Float[Array, "n p"], g: Float[Array, "n outputs"]) -> Whitened:
    """Generalised least squares by Cholesky and QR; only the lower half of `k` is read."""
    factor = cholesky(k, symmetrize_input=False)
    both = solve_triangular(factor, jnp.concatenate([f, g], axis=1), lower=True)
    basis, triangle = jnp.linalg.qr(both[:, : f.shape[1]])
    force = both[:, f.shape[1] :]
    projection = basis.T @ force
    beta = solve_triangular(triangle, projection)  # eq. 65
    return Whitened(factor, basis, triangle, beta, force - basis @ projection)


class Summary(NamedTuple):
    """What the likelihood needs of the whitened readings."""

    log_determinant: Float[Array, ""]
    """ln|K|."""
    log_information: Float[Array, ""]
    """ln|FᵀK⁻¹F|; zero unless the likelihood is restricted."""
    misfit: Float[Array, " outputs"]
    """(g - Fβ)ᵀ K⁻¹ (g - Fβ)."""


@functools.partial(jax.custom_vjp, nondiff_argnums=(5,))
def summarise(
    correlation: AbstractCorrelation,
    z: Float[Array, "n dim"],
    diagonal: Float[Array, " n"],
    f: Float[Array, "n p"],
    g: Float[Array, "n outputs"],
    restricted: bool,
) -> Summary:
    """Determinants and misfit of generalised least squares under the matrix K of `matrix`.

    Notes
    -----
    With α = K⁻¹(g - Fβ) and V = K⁻¹F T⁻¹, the derivatives by K are K⁻¹, -VVᵀ and -ααᵀ. They meet the derivative of the
    correlation block by block, and only below the diagonal. Autodiff through the Cholesky factor takes about twice the
    time and several times the memory.
    """
    return _summary(whiten(matrix(correlation, z, diagonal), f, g), restricted)


def _summary(white: Whitened, restricted: bool) -> Summary:
    information = 2.0 * jnp.sum(jnp.log(jnp.abs(jnp.diagonal(white.triangle)))) if restricted else jnp.zeros(())
    return Summary(2.0 * jnp.sum(jnp.log(jnp.diagonal(white.factor))), information, jnp.sum(white.residual**2, axis=0))


def _summarise_forward(correlation, z, diagonal, f, g, restricted):
    white = whiten(matrix(correlation, z, diagonal), f, g)
    return _summary(white, restricted), (correlation, z, white)


def _summarise_backward(restricted: bool, kept, by: Summary):
    correlation, z, white = kept
    both = jnp.concatenate([white.residual, white.basis], axis=1)
    both = solve_triangular(white.factor, both, lower=True, trans=1)
    outputs = white.residual.shape[1]
    alpha, v = both[:, :outputs], both[:, outputs:]
    by_force = 2.0 * alpha * by.misfit[None]
    by_basis = -by_force @ white.trend_coefficients.T
    rows, weights = alpha, by.misfit
    if restricted:
        by_basis = by_basis + 2.0 * by.log_information * solve_triangular(white.triangle, v.T).T
        rows, weights = both, jnp.concatenate([by.misfit, jnp.full(v.shape[1], by.log_information)])
    by_correlation, by_z, by_diagonal = jax.tree.map(jnp.zeros_like, correlation), jnp.zeros_like(z), []
    for start in range(0, len(z), BLOCK):
        below, block = slice(start, None), slice(start, start + BLOCK)
        by_k = by.log_determinant * inverse_columns(white.factor, start)
        by_k = by_k - (rows[below] * weights[None]) @ rows[block].T
        width = by_k.shape[1]
        by_diagonal.append(jnp.diagonal(by_k))
        by_k = jnp.concatenate([by_k[:width], 2.0 * by_k[width:]])  # with its mirror image
        # The diagonal does not depend on the states; a lag that is zero but for rounding has a slope where R is rough.
        by_k = jnp.where(jnp.eye(*by_k.shape, dtype=bool), 0.0, by_k)
        _, pull_back = jax.vjp(_unit_correlation, correlation, z[below], z[block])
        by_part, by_rows, by_columns = pull_back(by_k)
        by_correlation = jax.tree.map(jnp.add, by_correlation, by_part)
        by_z = by_z.at[below].add(by_rows).at[block].add(by_columns)
    return by_correlation, by_z, jnp.concatenate(by_diagonal), by_basis, by_force


def _unit_correlation(correlation, a, b):
    return correlation.between(a, b, jnp.ones(a.shape[1]))


summarise.defvjp(_summarise_forward, _summarise_backward)


def negative_log_likelihood(
    log_parameters: Float[Array, " parameters"], readings: Readings, jitter: Float[Array, ""]
) -> Float[Array, ""]:
    """Eq. 64 at its minimum over trend and process variance, constants kept; all outputs share the parameters.

    `log_parameters` are the logarithms of the length scales and, last, of the nugget. Not finite where K is not
    positive definite. Restricted: the likelihood of what no trend explains, Harville's form.
    """
    length_scale, nugget = jnp.exp(log_parameters[:-1]), jnp.exp(log_parameters[-1])
    summary: Any = summarise(
        readings.correlation,
        scaled_states(readings.states, length_scale),
        noisy_diagonal(readings, nugget, jitter),
        readings.basis,
        readings.force,
        readings.restricted,
    )
    n, p = readings.basis.shape
    freedom = n - p if readings.restricted else n
    variance = process_variance(readings, summary.misfit, nugget)
    per_output = freedom * jnp.log(2.0 * math.pi * variance) + summary.misfit / variance
    return 0.5 * jnp.sum(per_output + summary.log_determinant + summary.log_information)


def process_variance(
    readings: Readings, misfit: Float[Array, " outputs"], nugget: Float[Array, ""]
) -> Float[Array, " outputs"]:
    """σ² of eq. 66 (over n - p where restricted); from the nugget where the noise is known."""
    if readings.noise_variance is not None:
        return readings.noise_variance / nugget
    n, p = readings.basis.shape
    return misfit / (n - p if readings.restricted else n)
