"""Forces that repeat with the position: cogging of motors, errors of gears, belts and eccentric pulleys."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from ..._types import as_scalar
from .._term import ABOVE_ZERO, AbstractTerm, Parameter, Scalar, as_link
from ..law_classes import RIPPLE

_FEWEST, _MOST, _APART = 2.0, 80.0, 0.7
"""Angle of a ripple at the largest displacement, from and up to which, and in what steps, a search begins: less is a
spring's."""


class Ripple(AbstractTerm):
    """A force that repeats with the position, A·sin(n·d + phase); in a joint, n times a turn."""

    A: Scalar = eqx.field(converter=as_scalar)
    n: Scalar = eqx.field(converter=as_scalar)
    phase: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "ripple"
    classes = (RIPPLE,)
    parameters = (
        Parameter("A", force=1, meaning="amplitude of the force"),
        Parameter("n", length=-1, meaning="angle per displacement: times a turn", least=ABOVE_ZERO),
        Parameter("phase", positive=False, meaning="phase at zero, in rad"),
    )

    def force(self, d, w, z, t):
        return self.A * jnp.sin(self.n * d + self.phase)

    @classmethod
    def opposite(cls, numbers):
        return numbers | {"phase": numbers["phase"] - np.copysign(np.pi, numbers["phase"])}

    @classmethod
    def shapes(cls, scale):
        angles = np.arange(_FEWEST, _MOST, _APART).tolist()
        return [
            {"A": scale.force, "n": angle / scale.peak, "phase": phase}
            for angle in angles
            for phase in (0.0, np.pi / 2)
        ]
