"""Friction without sticking: a steep but continuous function of the velocity."""

import equinox as eqx
import jax.numpy as jnp

from ..._types import as_scalar
from .._term import ABOVE_ZERO, AbstractTerm, Parameter, Scalar, as_link
from .coulomb import Coulomb


class SmoothCoulomb(AbstractTerm):
    """Regularised Coulomb friction, force F·tanh(w/v_s)."""

    F: Scalar = eqx.field(converter=as_scalar)
    v_s: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "smooth_coulomb"
    contains = (Coulomb,)
    parameters = (
        Parameter("F", force=1, meaning="friction force", least=0.0),
        Parameter("v_s", length=1, time=-1, meaning="speed at which it is fully there", least=ABOVE_ZERO),
    )

    def force(self, d, w, z, t):
        return self.F * jnp.tanh(w / self.v_s)

    @classmethod
    def shapes(cls, scale):
        return [{"F": scale.force, "v_s": share * scale.speed} for share in (0.05, 0.1, 0.2, 0.35, 0.6)]
