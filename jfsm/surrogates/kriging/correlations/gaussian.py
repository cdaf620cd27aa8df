"""Gaussian correlation: infinitely smooth."""

import math

import jax.numpy as jnp
from jaxtyping import Array, Float

from .base import AbstractCorrelation


class Gaussian(AbstractCorrelation):
    """exp(-(h/ℓ)²/2), the paper's eq. 57 with θ = 1/(2ℓ²)."""

    smoothness = math.inf

    def __call__(self, lag: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        return jnp.exp(-0.5 * lag**2)
