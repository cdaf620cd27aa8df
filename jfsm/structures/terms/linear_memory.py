"""Linear elements with a state of their own: they store and give back."""

import equinox as eqx
import jax.numpy as jnp

from ..._types import as_scalar
from .._term import ABOVE_ZERO, AbstractTerm, Parameter, Scalar, as_link


class Maxwell(AbstractTerm):
    """Viscoelastic (Maxwell) element, force k·z with ż = w - z/tau."""

    k: Scalar = eqx.field(converter=as_scalar)
    tau: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "maxwell"
    parameters = (
        Parameter("k", force=1, length=-1, meaning="stiffness when struck fast"),
        Parameter("tau", time=1, meaning="relaxation time", least=ABOVE_ZERO),
    )
    states = 1

    def force(self, d, w, z, t):
        return self.k * z[0]

    def state_rate(self, d, w, z, t):
        return jnp.stack([w - z[0] / self.tau])

    @classmethod
    def shapes(cls, scale):
        k = scale.force / scale.length
        return [{"k": k, "tau": share / scale.omega} for share in (0.2, 0.4, 0.8, 1.6, 3.0, 5.0)]


class AttachedOscillator(AbstractTerm):
    """A mass m on a spring and a damper (omega, zeta) fixed to the link's far end, which it moves with at the start.

    Hidden states: displacement and velocity of the mass relative to the link's near end, which must not accelerate:
    ground, or the moving base.
    """

    m: Scalar = eqx.field(converter=as_scalar)
    omega: Scalar = eqx.field(converter=as_scalar)
    zeta: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "attached_oscillator"
    parameters = (
        Parameter("m", force=1, length=-1, time=2, meaning="attached mass", least=0.0),
        Parameter("omega", time=-1, meaning="natural frequency, in rad", least=ABOVE_ZERO),
        Parameter("zeta", meaning="damping ratio", least=0.0),
    )
    states = 2
    hangs = True
    base = (0.0, 1.0)

    def __check_init__(self):
        if self.at[0] != 0:
            raise ValueError(f"`at` of attached_oscillator must be (0, j), the mass it hangs on; got {self.at}.")

    def _pull(self, d, w, z):
        return self.omega**2 * (d - z[0]) + 2.0 * self.zeta * self.omega * (w - z[1])

    def force(self, d, w, z, t):
        return self.m * self._pull(d, w, z)

    def state_rate(self, d, w, z, t):
        return jnp.stack([z[1], self._pull(d, w, z)])

    def initial_state(self, d, w):
        return jnp.stack([d, w])

    @classmethod
    def shapes(cls, scale):
        mass = scale.force / (scale.omega**2 * scale.length)
        step = (2.7 / 0.35) ** (1 / 27)
        return [{"m": 0.1 * mass, "omega": 0.35 * step**i * scale.omega, "zeta": 0.02} for i in range(28)]
