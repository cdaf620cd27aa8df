"""Damping forces that are powers of the velocity."""

import equinox as eqx
import jax.numpy as jnp

from ..._types import as_scalar
from .._term import AbstractTerm, Parameter, Scalar, as_link


class QuadraticDamping(AbstractTerm):
    """Quadratic (drag) damping, force c2·w·abs(w)."""

    c2: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "quadratic_damping"
    parameters = (Parameter("c2", force=1, length=-2, time=2, meaning="quadratic damping"),)

    def force(self, d, w, z, t):
        return self.c2 * w * jnp.abs(w)
