"""Spherical correlation: compact support, a kink at zero lag."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from .base import AbstractCorrelation


class Spherical(AbstractCorrelation):
    """1 - 1.5ξ + 0.5ξ³ with ξ = min(1, |h|/ℓ), the paper's eq. 59 with θ = 1/ℓ."""

    smoothness = 0

    def __call__(self, lag: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        xi = jnp.minimum(1.0, jnp.abs(lag))
        return 1.0 - 1.5 * xi + 0.5 * xi**3
