"""Damping that depends on where the link is."""

import equinox as eqx

from ..._types import as_scalar
from .._term import ABOVE_ZERO, AbstractTerm, Parameter, Scalar, as_link


class PositionDamping(AbstractTerm):
    """Damping that grows away from the centre, force c·d²·w."""

    c: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "position_damping"
    parameters = (Parameter("c", force=1, length=-3, time=1, meaning="damping per squared displacement"),)

    def force(self, d, w, z, t):
        return self.c * d * d * w


class VanDerPol(AbstractTerm):
    """Damping that drives small motions and brakes large ones, force eps·((d/x0)² - 1)·w."""

    eps: Scalar = eqx.field(converter=as_scalar)
    x0: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "van_der_pol"
    contains = (PositionDamping,)
    parameters = (
        Parameter("eps", force=1, length=-1, time=1, meaning="negative damping at the centre"),
        Parameter("x0", length=1, meaning="displacement at which it turns positive", least=ABOVE_ZERO),
    )

    def force(self, d, w, z, t):
        return self.eps * ((d / self.x0) ** 2 - 1.0) * w

    @classmethod
    def shapes(cls, scale):
        return [
            {"eps": scale.force / scale.speed, "x0": share * scale.length} for share in (0.5, 0.7, 0.85, 1.0, 1.2, 1.4)
        ]
