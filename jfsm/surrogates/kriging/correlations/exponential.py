"""Exponential correlation: continuous and rough."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from .base import AbstractCorrelation


class Exponential(AbstractCorrelation):
    """exp(-|h|/ℓ), the paper's eq. 55 with θ = 1/ℓ."""

    smoothness = 0

    def __call__(self, lag: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        return jnp.exp(-jnp.abs(lag))
