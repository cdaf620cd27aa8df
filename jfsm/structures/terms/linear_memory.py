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


class ElasticJoint(AbstractTerm):
    """A spring k with a dashpot c behind which the part m of a mass moves that was taken as one; the rest stays.

    The coordinate is that of the part where forces act, of a gear the motor's side: m is then the inertia of the link,
    and the motor keeps the remainder, so that slow motions are those of the whole. Terms that act on the coordinate
    stay on its side; what the function of a simulation knows, weight say, acts on the part behind. The part moves as
    the place does at the start.

    Hidden states: displacement and velocity of the part relative to the link's near end, which must not accelerate:
    ground, or the moving base.
    """

    k: Scalar = eqx.field(converter=as_scalar)
    c: Scalar = eqx.field(converter=as_scalar)
    m: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "elastic_joint"
    parameters = (
        Parameter("k", force=1, length=-1, meaning="stiffness of the joint", least=0.0),
        Parameter("c", force=1, length=-1, time=1, meaning="damping of the joint", least=0.0),
        Parameter("m", force=1, length=-1, time=2, meaning="mass behind it, of the place's own", least=ABOVE_ZERO),
    )
    states = 2
    hangs = True
    takes = "m"
    base = (0.0, 1.0)

    def __check_init__(self):
        if self.at[0] != 0:
            raise ValueError(f"`at` of elastic_joint must be (0, j), the mass that is not one; got {self.at}.")

    def force(self, d, w, z, t):
        return self.k * (d - z[0]) + self.c * (w - z[1])

    def state_rate(self, d, w, z, t):
        return jnp.stack([z[1], self.force(d, w, z, t) / self.m])

    def initial_state(self, d, w):
        return jnp.stack([d, w])

    @classmethod
    def shapes(cls, scale):
        mass = scale.force / (scale.omega**2 * scale.length)
        step = (_FASTEST / _SLOWEST) ** (1 / (_RATES - 1))
        omegas = [_SLOWEST * step**i * scale.omega for i in range(_RATES)]
        return [
            {"k": mass * omega**2, "c": 2.0 * ratio * mass * omega, "m": mass} for omega in omegas for ratio in _RATIOS
        ]


_SLOWEST, _FASTEST, _RATES = 0.5, 20.0, 36
"""Natural frequencies of a joint with its coordinate held, in those of the motion,"""
_RATIOS = (0.02, 0.2)
"""and damping ratios, that a search begins from."""
