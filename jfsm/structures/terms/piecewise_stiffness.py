"""Springs that are straight in pieces: knots, gaps and stops."""

import equinox as eqx
import jax.numpy as jnp

from ..._types import as_scalar
from .._term import AbstractTerm, Parameter, Scalar, as_link

_STIFFNESS = Parameter("k", force=1, length=-1, meaning="stiffness")
_GAP = Parameter("gap", length=1, meaning="half width of the gap", least=0.0)
_GAPS = tuple(0.1 + 0.65 / 11 * i for i in range(12))
"""Gaps to begin from, in peaks."""


def beyond(d, gap):
    """d less the gap: 0 inside ±gap, d ∓ gap outside."""
    return jnp.where(d > gap, d - gap, jnp.where(d < -gap, d + gap, 0.0))


class BilinearStiffness(AbstractTerm):
    """A second spring on one side of a knot: k·(d - knot)₊ for side = +1, -k·(knot - d)₊ for side = -1."""

    k: Scalar = eqx.field(converter=as_scalar)
    knot: Scalar = eqx.field(converter=as_scalar)
    side: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "bilinear_stiffness"
    parameters = (
        Parameter("k", force=1, length=-1, positive=False, meaning="stiffness beyond the knot"),
        Parameter("knot", length=1, positive=False, meaning="displacement of the knot"),
        Parameter("side", positive=False, meaning="the side it acts on, +1 or -1", free=False),
    )

    def force(self, d, w, z, t):
        return self.k * jnp.where(self.side * (d - self.knot) > 0, d - self.knot, 0.0)

    @classmethod
    def shapes(cls, scale):
        k = scale.force / scale.length
        return [
            {"k": k, "knot": share * scale.peak, "side": side}
            for side in (1.0, -1.0)
            for share in (-0.45, -0.35, -0.25, -0.15, -0.05, 0.05, 0.15, 0.25, 0.35, 0.45)
        ]


class _AbstractGap(AbstractTerm):
    """Laws of a stiffness and a gap share their natural sizes."""

    @classmethod
    def shapes(cls, scale):
        return [{"k": scale.force / scale.length, "gap": share * scale.peak} for share in _GAPS]


class DeadZone(_AbstractGap):
    """Play around the centre, force -k·(d - dz(d)): the spring acts only beyond the gap."""

    k: Scalar = eqx.field(converter=as_scalar)
    gap: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "dead_zone"
    parameters = (_STIFFNESS, _GAP)

    def force(self, d, w, z, t):
        return -self.k * (d - beyond(d, self.gap))


class EndStop(_AbstractGap):
    """A second spring that joins beyond the gap, force k·dz(d)."""

    k: Scalar = eqx.field(converter=as_scalar)
    gap: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "end_stop"
    parameters = (_STIFFNESS, _GAP)

    def force(self, d, w, z, t):
        return self.k * beyond(d, self.gap)


class Saturation(_AbstractGap):
    """A spring whose force stops growing beyond the gap, force -k·dz(d)."""

    k: Scalar = eqx.field(converter=as_scalar)
    gap: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "saturation"
    parameters = (_STIFFNESS, _GAP)

    def force(self, d, w, z, t):
        return -self.k * beyond(d, self.gap)


class DampedStop(AbstractTerm):
    """An elastic stop with damping, force k·dz(d)·(1 + chi·w·sgn d), never pulling [1]_ Eq. (15) with n = 1.

    References
    ----------
    .. [1] K. H. Hunt, F. R. E. Crossley, J. Appl. Mech. 42 (1975) 440-445.
    """

    k: Scalar = eqx.field(converter=as_scalar)
    gap: Scalar = eqx.field(converter=as_scalar)
    chi: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "damped_stop"
    parameters = (
        _STIFFNESS,
        _GAP,
        Parameter("chi", length=-1, time=1, meaning="damping of the stop", least=0.0),
    )

    def force(self, d, w, z, t):
        return self.k * beyond(d, self.gap) * jnp.maximum(1.0 + self.chi * w * jnp.sign(d), 0.0)

    @classmethod
    def shapes(cls, scale):
        k = scale.force / scale.length
        return [{"k": k, "gap": share * scale.peak, "chi": 0.1 / scale.speed} for share in _GAPS]
