"""Dry friction that sticks."""

import equinox as eqx
import jax.numpy as jnp

from ..._types import as_scalar
from .._term import ABOVE_ZERO, AbstractFriction, Parameter, Scalar, as_link

FORCE = Parameter("F", force=1, meaning="friction force", least=0.0)
SPEED = Parameter("v_s", length=1, time=-1, meaning="Stribeck speed", least=ABOVE_ZERO)
STATIC = Parameter("F_static", force=1, meaning="friction force at rest", least=0.0)
_FADES = 0.2
"""Friction at speed, as a share of that at rest, below which the friction is gone rather than less."""


class Coulomb(AbstractFriction):
    """Coulomb friction, force F·sgn w, any value within ±F while it sticks."""

    F: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "coulomb"
    parameters = (FORCE,)

    def limits(self, d, w, z, t):
        return -self.F, self.F


class CoulombAsymmetric(AbstractFriction):
    """Friction that differs with the direction: F_plus for w > 0, -F_minus for w < 0."""

    F_plus: Scalar = eqx.field(converter=as_scalar)
    F_minus: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "coulomb_asymmetric"
    contains = (Coulomb,)
    parameters = (
        Parameter("F_plus", force=1, meaning="friction force forward", least=0.0),
        Parameter("F_minus", force=1, meaning="friction force backward", least=0.0),
    )

    def limits(self, d, w, z, t):
        return -self.F_minus, self.F_plus

    @classmethod
    def shapes(cls, scale):
        return [
            {"F_plus": scale.force, "F_minus": ratio * scale.force} for ratio in (0.1, 0.3, 0.6, 1.0, 1.6, 3.0, 10.0)
        ]


def stribeck_force(F, F_static, v_s, w):
    """Friction force that falls from F_static at rest to F while sliding fast."""
    return F + (F_static - F) * jnp.exp(-((w / v_s) ** 2))


def gone_at_speed(F, F_static) -> str:
    """Why friction with these levels is none; empty if it is."""
    return "at speed its friction is all but gone" if F < _FADES * F_static else ""


class Stribeck(AbstractFriction):
    """Friction that falls with speed: sgn w·(F + (F_static - F)·exp(-(w/v_s)²)), within ±F_static while it sticks."""

    F: Scalar = eqx.field(converter=as_scalar)
    F_static: Scalar = eqx.field(converter=as_scalar)
    v_s: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "stribeck"
    contains = (Coulomb,)
    parameters = (FORCE, STATIC, SPEED)

    def limits(self, d, w, z, t):
        size = stribeck_force(self.F, self.F_static, self.v_s, w)
        return -size, size

    def otherwise(self, stiffness):
        if self.F_static < self.F:
            return "it does not fall with speed: the static friction is the smaller one"
        return gone_at_speed(self.F, self.F_static)

    @classmethod
    def shapes(cls, scale):
        return [
            {"F": scale.force, "F_static": ratio * scale.force, "v_s": share * scale.speed}
            for ratio in (1.3, 2.0)
            for share in (0.1, 0.2, 0.35, 0.5)
        ]
