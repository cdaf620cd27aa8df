"""Cubic spline correlation of compact support."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from .base import AbstractCorrelation

KNOT = 0.2


class Spline(AbstractCorrelation):
    """1 - 15ξ² + 30ξ³ below ξ = 0.2, 1.25(1 - ξ)³ up to 1, ξ = |h|/ℓ: the paper's eq. 61 with θ = 1/ℓ."""

    smoothness = 1

    def __call__(self, lag: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        xi = jnp.abs(lag)
        near = 1.0 - 15.0 * lag**2 * (1.0 - 2.0 * xi)  # even powers as such: |h| has no second derivative at zero
        far = 1.25 * (1.0 - jnp.minimum(xi, 1.0)) ** 3
        return jnp.where(xi <= KNOT, near, far)
