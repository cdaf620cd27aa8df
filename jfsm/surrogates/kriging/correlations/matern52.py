"""Matérn correlation of smoothness 5/2."""

import math

from jaxtyping import Array, Float

from .base import AbstractCorrelation
from .half_integer import twice


class Matern52(AbstractCorrelation):
    """(1 + a + a²/3) exp(-a) with a = √5 |h|/ℓ, along each column."""

    smoothness = 2

    def __call__(self, lag: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        return twice(math.sqrt(5.0) * lag)
