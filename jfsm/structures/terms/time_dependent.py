"""Springs and dashpots that change with time; t is the record's own clock."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from ..._types import as_scalar
from .._term import AbstractTerm, Parameter, Scalar, as_link

_ORIGIN = Parameter("t_ref", time=1, positive=False, meaning="instant at which nothing is off", free=False)


class StiffnessDrift(AbstractTerm):
    """A spring that grows with time, force rate·(t - t_ref)·d."""

    rate: Scalar = eqx.field(converter=as_scalar)
    t_ref: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "stiffness_drift"
    timed = True
    parameters = (Parameter("rate", force=1, length=-1, time=-1, positive=False, meaning="stiffness rate"), _ORIGIN)

    def force(self, d, w, z, t):
        return self.rate * (t - self.t_ref) * d

    @classmethod
    def shapes(cls, scale):
        return [{"rate": scale.force / scale.length / (scale.end - scale.begin), "t_ref": scale.begin}]


class DampingDrift(AbstractTerm):
    """A dashpot that grows with time, force rate·(t - t_ref)·w."""

    rate: Scalar = eqx.field(converter=as_scalar)
    t_ref: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "damping_drift"
    timed = True
    parameters = (Parameter("rate", force=1, length=-1, positive=False, meaning="damping rate"), _ORIGIN)

    def force(self, d, w, z, t):
        return self.rate * (t - self.t_ref) * w

    @classmethod
    def shapes(cls, scale):
        return [{"rate": scale.force / scale.speed / (scale.end - scale.begin), "t_ref": scale.begin}]


class StiffnessDrop(AbstractTerm):
    """A spring that is lost at an instant, force -dk·d for t > t_star.

    `ramp` [s] spreads the loss evenly about t_star, so that a scheme of fixed steps, and a search for the instant,
    see where in a step it falls.
    """

    dk: Scalar = eqx.field(converter=as_scalar)
    t_star: Scalar = eqx.field(converter=as_scalar)
    ramp: Scalar = eqx.field(converter=as_scalar, default=0.0)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "stiffness_drop"
    timed = True
    parameters = (
        Parameter("dk", force=1, length=-1, positive=False, meaning="stiffness lost"),
        Parameter("t_star", time=1, positive=False, meaning="instant of the loss"),
    )

    @property
    def breakpoints(self):
        return (self.t_star,)

    def force(self, d, w, z, t):
        since = t - self.t_star
        spread = jnp.clip(since / jnp.where(self.ramp > 0, self.ramp, 1.0) + 0.5, 0.0, 1.0)
        lost = jnp.where(self.ramp > 0, spread, jnp.where(since > 0, 1.0, 0.0))
        return -self.dk * lost * d

    @classmethod
    def shapes(cls, scale):
        return [{"dk": scale.force / scale.length, "t_star": t} for t in scale.instants(100)]


class ParametricStiffness(AbstractTerm):
    """A spring that pulsates, force dk·cos(omega·t + phase)·d."""

    dk: Scalar = eqx.field(converter=as_scalar)
    omega: Scalar = eqx.field(converter=as_scalar)
    phase: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "parametric_stiffness"
    timed = True
    parameters = (
        Parameter("dk", force=1, length=-1, meaning="amplitude of the stiffness"),
        Parameter("omega", time=-1, meaning="angular frequency, in rad"),
        Parameter("phase", positive=False, meaning="phase at t = 0, in rad"),
    )

    def force(self, d, w, z, t):
        return self.dk * jnp.cos(self.omega * t + self.phase) * d

    @classmethod
    def opposite(cls, numbers):
        return numbers | {"phase": numbers["phase"] - np.copysign(np.pi, numbers["phase"])}

    @classmethod
    def shapes(cls, scale):
        dk = scale.force / scale.length
        return [{"dk": dk, "omega": o, "phase": phase} for o in lines(scale, 0.05, 3.0) for phase in (0.0, np.pi / 2)]


def lines(scale, low, high):
    """Frequencies [rad/s] from `low` to `high`, in units of the motion's, as close as the record can tell."""
    step = np.pi / (scale.end - scale.begin)
    count = min(int((high - low) * scale.omega / step) + 1, 1000)
    return np.linspace(low * scale.omega, high * scale.omega, count).tolist()
