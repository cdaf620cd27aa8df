"""Polynomials times exp(-|a|) whose derivatives at zero, where |a| has a kink, are those of the smooth function."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float


@jax.custom_jvp
def once(a: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    """(1 + |a|) exp(-|a|)."""
    return (1.0 + jnp.abs(a)) * jnp.exp(-jnp.abs(a))


@once.defjvp
def _once_jvp(primals, tangents):
    (a,), (da,) = primals, tangents
    return once(a), -a * jnp.exp(-jnp.abs(a)) * da


@jax.custom_jvp
def twice(a: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    """(1 + |a| + a²/3) exp(-|a|)."""
    return (1.0 + jnp.abs(a) + a**2 / 3.0) * jnp.exp(-jnp.abs(a))


@twice.defjvp
def _twice_jvp(primals, tangents):
    (a,), (da,) = primals, tangents
    return twice(a), -a / 3.0 * once(a) * da
