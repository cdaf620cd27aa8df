"""Forces that answer the motion of the past."""

import equinox as eqx

from ..._types import as_scalar
from .._term import AbstractTerm, Parameter, Scalar, as_link


class DelayedForce(AbstractTerm):
    """A spring that answers late, force k·d(t - tau); before the start the motion was the starting value."""

    k: Scalar = eqx.field(converter=as_scalar)
    tau: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "delayed_force"
    parameters = (
        Parameter("k", force=1, length=-1, positive=False, meaning="stiffness of the late spring"),
        Parameter("tau", time=1, meaning="delay", least=0.0),
    )

    @property
    def delay(self):
        return self.tau

    def force(self, d, w, z, t):
        return self.k * d

    @classmethod
    def shapes(cls, scale):
        return [
            {"k": scale.force / scale.length, "tau": angle / scale.omega} for angle in (0.2, 0.5, 0.9, 1.4, 2.0, 2.6)
        ]
