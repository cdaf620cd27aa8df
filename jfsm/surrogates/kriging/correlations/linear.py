"""Linear correlation: a tent of compact support."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from .base import AbstractCorrelation


class Linear(AbstractCorrelation):
    """max(0, 1 - |h|/ℓ), the paper's eq. 58 with θ = 1/ℓ."""

    smoothness = 0

    def __call__(self, lag: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        return jnp.maximum(0.0, 1.0 - jnp.abs(lag))
