"""Friction with bristles."""

from itertools import product

import equinox as eqx
import jax.numpy as jnp

from ..._types import as_scalar
from .._term import ABOVE_ZERO, AbstractTerm, Parameter, Scalar, as_link
from .coulomb import FORCE, SPEED, STATIC, Coulomb, Stribeck, gone_at_speed, stribeck_force


class LuGre(AbstractTerm):
    r"""Bristle friction, force sigma0·z + sigma1·ż with ż = w - sigma0·abs(w)·z/h(w), [1]_ Eqs. (1), (3), (4).

    h(w) = F + (F_static - F)·exp(-(w/v_s)²); viscous friction is a dashpot of its own.

    References
    ----------
    .. [1] C. Canudas de Wit, H. Olsson, K. J. Åström, P. Lischinsky, IEEE Trans. Autom. Control 40 (1995) 419-425.
    """

    F: Scalar = eqx.field(converter=as_scalar)
    F_static: Scalar = eqx.field(converter=as_scalar)
    v_s: Scalar = eqx.field(converter=as_scalar)
    sigma0: Scalar = eqx.field(converter=as_scalar)
    sigma1: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "lugre"
    contains = (Stribeck, Coulomb)  # of bristles that do not bend
    parameters = (
        FORCE,
        STATIC,
        SPEED,
        Parameter("sigma0", force=1, length=-1, meaning="stiffness of the bristles", least=0.0),
        Parameter("sigma1", force=1, length=-1, time=1, meaning="damping of the bristles", least=0.0),
    )
    states = 1

    def fading(self, w):
        h = stribeck_force(self.F, self.F_static, self.v_s, w)
        return self.sigma0 * jnp.abs(w) / jnp.where(h > ABOVE_ZERO, h, 1.0)

    def _bend_rate(self, w, z):
        return w - self.fading(w) * z

    def force(self, d, w, z, t):
        return self.sigma0 * z[0] + self.sigma1 * self._bend_rate(w, z[0])

    def state_rate(self, d, w, z, t):
        return jnp.stack([self._bend_rate(w, z[0])])

    def otherwise(self, stiffness):
        return gone_at_speed(self.F, self.F_static)

    @classmethod
    def shapes(cls, scale):
        force, speed = scale.force, scale.speed
        mass = force / (scale.omega**2 * scale.length)
        found = []
        # Bristles damp as the mass on them would need to; friction of a share of `force` has as much less stiff ones.
        for ratio, share in ((1.0, 0.15), (1.5, 0.15), (1.5, 0.4)):  # with equal limits the speed says nothing
            for bend, friction in product((0.02, 0.05, 0.1), (1.0, 0.05)):
                stiff = force / (bend * scale.length)
                damping = (stiff * mass / friction) ** 0.5
                numbers = {"F": force, "F_static": ratio * force, "v_s": share * speed}
                found.append(numbers | {"sigma0": stiff, "sigma1": damping})
        return found
