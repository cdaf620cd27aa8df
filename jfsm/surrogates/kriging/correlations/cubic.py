"""Cubic correlation of compact support."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from .base import AbstractCorrelation


class Cubic(AbstractCorrelation):
    """1 - 3ξ² + 2ξ³ with ξ = min(1, |h|/ℓ), the paper's eq. 60 with θ = 1/ℓ.

    Notes
    -----
    It is no valid correlation for every set of states: its spectrum 4 sin u (sin u - u cos u)/u⁴ of u = wℓ/2 is
    negative beyond u = π. Where the matrix of the readings is not positive definite, the fit keeps to length scales and
    nuggets at which it is. `Spline` has the same support and no such flaw.
    """

    smoothness = 1

    def __call__(self, lag: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        inside = 1.0 - lag**2 * (3.0 - 2.0 * jnp.abs(lag))  # even powers as such: |h| has no second derivative at zero
        return jnp.where(jnp.abs(lag) < 1.0, inside, 0.0)
