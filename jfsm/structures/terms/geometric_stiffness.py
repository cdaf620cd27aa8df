"""Forces of the geometry: pendulums and arms that turn."""

import equinox as eqx
import jax.numpy as jnp

from ..._types import as_scalar
from .._term import ABOVE_ZERO, AbstractTerm, Parameter, Scalar, as_link

_RATE = Parameter("s", length=-1, meaning="angle per displacement", least=ABOVE_ZERO)


class SineStiffness(AbstractTerm):
    """Pendulum, force (k/s)·sin(s·d)."""

    k: Scalar = eqx.field(converter=as_scalar)
    s: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "sine_stiffness"
    is_whole_spring = True
    parameters = (Parameter("k", force=1, length=-1, positive=False, meaning="stiffness at the centre"), _RATE)

    def force(self, d, w, z, t):
        return self.k / self.s * jnp.sin(self.s * d)

    @classmethod
    def shapes(cls, scale):
        return [{"k": scale.force / scale.length, "s": angle / scale.peak} for angle in (0.6, 1.0, 1.5, 2.0, 3.0)]


class CosineStiffness(AbstractTerm):
    """Weight of an arm that turns about the horizontal, force (k/s)·cos(s·d)."""

    k: Scalar = eqx.field(converter=as_scalar)
    s: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "cosine_stiffness"
    parameters = (Parameter("k", force=1, length=-1, positive=False, meaning="weight times angle per length"), _RATE)

    def force(self, d, w, z, t):
        return self.k / self.s * jnp.cos(self.s * d)

    @classmethod
    def shapes(cls, scale):
        return SineStiffness.shapes(scale)
