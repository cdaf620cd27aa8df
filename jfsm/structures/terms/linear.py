"""Linear springs and dashpots: the part of a structure that becomes its matrices."""

import equinox as eqx

from ..._types import as_scalar
from .._term import AbstractTerm, Parameter, Scalar, as_link


class LinearStiffness(AbstractTerm):
    """Linear spring, force k·d."""

    k: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "stiffness"
    parameters = (Parameter("k", force=1, length=-1, meaning="stiffness"),)

    def force(self, d, w, z, t):
        return self.k * d


class LinearDamping(AbstractTerm):
    """Linear dashpot, force c·w."""

    c: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "damping"
    parameters = (Parameter("c", force=1, length=-1, time=1, meaning="damping coefficient"),)

    def force(self, d, w, z, t):
        return self.c * w
