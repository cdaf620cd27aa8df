"""Dry friction that sticks."""

import equinox as eqx

from ..._types import as_scalar
from .._term import AbstractFriction, Parameter, Scalar, as_link


class Coulomb(AbstractFriction):
    """Coulomb friction, force F·sgn w, any value within ±F while it sticks."""

    F: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "coulomb"
    parameters = (Parameter("F", force=1, meaning="friction force"),)

    def __check_init__(self):
        # A traced value cannot be looked at; the fit keeps it positive by its logarithm.
        try:
            negative = bool(self.F < 0)
        except Exception:
            return
        if negative:
            raise ValueError(
                f"`F` of Coulomb friction must not be negative (it would drive the motion); got {float(self.F)}."
            )

    def limits(self, d, w, z, t):
        return -self.F, self.F
