"""Exponential of a power of the lag: between rough and smooth."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...._types import as_scalar
from .base import AbstractCorrelation


class PowerExponential(AbstractCorrelation):
    """exp(-(|h|/ℓ)^power), the paper's eq. 56 with θ = ℓ^-power and its last parameter as `power`.

    Parameters
    ----------
    power : float
        Above 0 and at most 2; 1 is `Exponential`, 2 a Gaussian of length scale ℓ/√2. An array leaf: the likelihood can
        be differentiated by it; `Kriging.fit` keeps it.

    Raises
    ------
    RuntimeError
        If `power` lies outside: no random field has such a correlation.
    """

    power: Float[Array, ""]
    smoothness = 0

    def __init__(self, power: float | Float[Array, ""] = 1.5):
        power = as_scalar(power)
        self.power = eqx.error_if(
            power, (power <= 0.0) | (power > 2.0), "`power` must be above 0 and at most 2, eq. 56; change it."
        )

    def __call__(self, lag: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        apart = lag != 0.0  # a power has no slope at zero, nor has its logarithm a value
        distance = jnp.where(apart, jnp.abs(lag), 1.0)
        return jnp.where(apart, jnp.exp(-(distance**self.power)), 1.0)
