"""External forces that nobody measured; a load at (i, j) pushes j by +F and i by -F."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from ..._types import as_scalar
from .._term import AbstractTerm, Parameter, Scalar, as_link
from .time_dependent import lines


class Preload(AbstractTerm):
    """A constant force F."""

    F: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "preload"
    parameters = (Parameter("F", force=1, positive=False, meaning="constant force"),)

    def force(self, d, w, z, t):
        return -self.F


class PeriodicDisturbance(AbstractTerm):
    """A harmonic force F·cos(omega·t + phase)."""

    F: Scalar = eqx.field(converter=as_scalar)
    omega: Scalar = eqx.field(converter=as_scalar)
    phase: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "periodic_disturbance"
    timed = True
    parameters = (
        Parameter("F", force=1, meaning="amplitude of the force"),
        Parameter("omega", time=-1, meaning="angular frequency, in rad"),
        Parameter("phase", positive=False, meaning="phase at t = 0, in rad"),
    )

    def force(self, d, w, z, t):
        return -self.F * jnp.cos(self.omega * t + self.phase)

    @classmethod
    def opposite(cls, numbers):
        return numbers | {"phase": numbers["phase"] - np.copysign(np.pi, numbers["phase"])}

    @classmethod
    def shapes(cls, scale):
        return [
            {"F": scale.force, "omega": o, "phase": phase}
            for o in lines(scale, 0.05, 5.0)
            for phase in (0.0, np.pi / 2)
        ]
