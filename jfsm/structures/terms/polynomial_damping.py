"""Damping forces that are powers of the velocity."""

import equinox as eqx
import jax.numpy as jnp

from ..._types import as_scalar
from .._term import ABOVE_ZERO, AbstractTerm, Parameter, Scalar, as_link

_TINY = 1e-30
_DRY = 0.06
"""Exponent of the speed below which it tells nothing of the speed."""


class QuadraticDamping(AbstractTerm):
    """Quadratic (drag) damping, force c2·w·abs(w)."""

    c2: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "quadratic_damping"
    parameters = (Parameter("c2", force=1, length=-2, time=2, meaning="quadratic damping"),)

    def force(self, d, w, z, t):
        return self.c2 * w * jnp.abs(w)


class CubicDamping(AbstractTerm):
    """Cubic damping, force c3·w³."""

    c3: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "cubic_damping"
    parameters = (Parameter("c3", force=1, length=-3, time=3, meaning="cubic damping"),)

    def force(self, d, w, z, t):
        return self.c3 * w * w * w


class PowerDamping(AbstractTerm):
    """Power-law damping, force c·abs(w)ⁿ·sgn w."""

    c: Scalar = eqx.field(converter=as_scalar)
    n: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "power_damping"
    contains = (QuadraticDamping, CubicDamping)
    parameters = (
        Parameter("c", force=1, length=-1, time=1, meaning="power-law damping", exponent="n"),
        Parameter("n", meaning="exponent of the speed", least=ABOVE_ZERO, low=0.05, high=6.0),
    )

    def force(self, d, w, z, t):
        # At w = 0 the slope is infinite for n < 1; a speed that is nothing stands for it.
        speed = jnp.where(jnp.abs(w) > _TINY, jnp.abs(w), _TINY)
        return self.c * jnp.sign(w) * speed**self.n

    def otherwise(self, stiffness):
        return "with so small an exponent it is dry friction" if self.n < _DRY else ""

    @classmethod
    def shapes(cls, scale):
        return [{"c": scale.force / scale.speed**n, "n": n} for n in (0.3, 0.5, 0.7, 1.5, 2.5, 3.0)]


class BilinearDamping(AbstractTerm):
    """A dashpot that acts one way only: dc·w where side·w > 0."""

    dc: Scalar = eqx.field(converter=as_scalar)
    side: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "bilinear_damping"
    parameters = (
        Parameter("dc", force=1, length=-1, time=1, positive=False, meaning="damping to one side"),
        Parameter("side", positive=False, meaning="the side, +1 or -1", free=False),
    )

    def force(self, d, w, z, t):
        return jnp.where(self.side * w > 0, self.dc * w, 0.0)

    @classmethod
    def shapes(cls, scale):
        return [{"dc": scale.force / scale.speed, "side": side} for side in (1.0, -1.0)]
