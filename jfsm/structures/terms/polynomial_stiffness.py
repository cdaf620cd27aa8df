"""Springs that are powers of the displacement."""

import math

import equinox as eqx
import jax.numpy as jnp

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


class QuinticStiffness(AbstractTerm):
    """Quintic spring, force k5·d⁵."""

    k5: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "quintic_stiffness"
    parameters = (Parameter("k5", force=1, length=-5, positive=False, meaning="quintic stiffness"),)

    def force(self, d, w, z, t):
        return self.k5 * d**5


class SquareStiffness(AbstractTerm):
    """Odd quadratic spring, force k2·d·abs(d)."""

    k2: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "square_stiffness"
    parameters = (Parameter("k2", force=1, length=-2, positive=False, meaning="odd quadratic stiffness"),)

    def force(self, d, w, z, t):
        return self.k2 * d * jnp.abs(d)


class DoubleWell(AbstractTerm):
    """A buckled spring, force -k_neg·d + k3·d³: the linear stiffness turns negative."""

    k_neg: Scalar = eqx.field(converter=as_scalar)
    k3: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "double_well"
    contains = (CubicStiffness,)
    parameters = (
        Parameter("k_neg", force=1, length=-1, meaning="stiffness lost at the centre"),
        Parameter("k3", force=1, length=-3, meaning="cubic stiffness"),
    )

    def force(self, d, w, z, t):
        return (self.k3 * d * d - self.k_neg) * d

    def otherwise(self, stiffness):
        return "" if self.k_neg > stiffness else "takes less stiffness than there is: one well, not two"

    def rests(self, stiffness):
        depth, k3 = float(self.k_neg) - stiffness, float(self.k3)
        well = math.sqrt(depth / k3) if depth > 0 and k3 > 0 else 0.0
        return (well, -well) if well > 0 else ()

    @classmethod
    def about_a_rest(cls, stiffness, slope, curvature):
        if slope + stiffness <= 0 or curvature == 0:
            return None
        # At r = ±√((k_neg - k) / k3) the slope is 3 k3 r² - k_neg = 2 k3 r² - k, and half the second derivative 3 k3 r.
        stiffening = (slope + stiffness) / 2  # k3 r²
        rest = 3 * stiffening / curvature
        return {"k_neg": stiffness + stiffening, "k3": stiffening / rest**2}

    @classmethod
    def shapes(cls, scale):
        k, x = scale.force / scale.length, scale.length
        # From motion over the hill to one within a well that is thirty times as far from the centre as it is wide.
        return [{"k_neg": 1.3 * k, "k3": 1.2 * k / x**2 / 2**i} for i in range(13)]
