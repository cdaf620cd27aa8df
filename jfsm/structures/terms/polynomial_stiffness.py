"""Springs that are powers of the displacement."""

import equinox as eqx

from ..._types import as_scalar
from .._term import AbstractTerm, Parameter, Scalar, as_link


class CubicStiffness(AbstractTerm):
    """Cubic spring, force k3·d³: hardening for k3 > 0, softening for k3 < 0."""

    k3: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "cubic_stiffness"
    parameters = (Parameter("k3", force=1, length=-3, positive=False, meaning="cubic stiffness"),)

    def force(self, d, w, z, t):
        return self.k3 * d * d * d


class QuadraticStiffness(AbstractTerm):
    """Quadratic spring, force k2·d²: stiffer to one side, softer to the other."""

    k2: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "quadratic_stiffness"
    parameters = (Parameter("k2", force=1, length=-2, positive=False, meaning="quadratic stiffness"),)

    def force(self, d, w, z, t):
        return self.k2 * d * d
