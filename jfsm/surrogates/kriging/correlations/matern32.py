"""Matérn correlation of smoothness 3/2."""

import math

from jaxtyping import Array, Float

from .base import AbstractCorrelation
from .half_integer import once


class Matern32(AbstractCorrelation):
    """(1 + a) exp(-a) with a = √3 |h|/ℓ, along each column."""

    smoothness = 1

    def __call__(self, lag: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        return once(math.sqrt(3.0) * lag)
