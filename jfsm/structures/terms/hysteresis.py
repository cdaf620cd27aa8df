"""Springs that remember which way they were bent."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from ..._types import as_scalar
from .._term import ABOVE_ZERO, AbstractTerm, Parameter, Scalar, as_link
from .piecewise_stiffness import EndStop, beyond

_STIFFNESS = Parameter("k", force=1, length=-1, meaning="stiffness while it sticks")
_ROUNDING = 1e-9
"""Share of a force by which what is at its limit may seem to be below it."""
_SLIDERS = 16
_CLOSED = 0.02
"""What a Bouc-Wen loop loses, as a share of how far it leans, below which it is closed."""


def _power(z, n):
    # abs(z)ⁿ whose derivatives at z = 0 are those of a limit from n >= 1, not of a logarithm
    size = jnp.abs(z)
    return jnp.where(size > 0, jnp.where(size > 0, size, 1.0) ** n, 0.0)


class BoucWen(AbstractTerm):
    r"""Smooth hysteresis, force k·z with ż = w - beta·abs(w)·abs(z)ⁿ⁻¹·z - gamma·w·abs(z)ⁿ, [1]_ Eq. (10).

    The hidden state z is a displacement; it tends to (beta + gamma)^(-1/n).

    References
    ----------
    .. [1] Y.-K. Wen, J. Eng. Mech. Div. ASCE 102 (1976) 249-263.
    """

    k: Scalar = eqx.field(converter=as_scalar)
    beta: Scalar = eqx.field(converter=as_scalar)
    gamma: Scalar = eqx.field(converter=as_scalar)
    n: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "bouc_wen"
    parameters = (
        Parameter("k", force=1, length=-1, meaning="hysteretic stiffness"),
        Parameter("beta", length=-1, positive=False, meaning="what the loop loses", exponent="n"),
        Parameter("gamma", length=-1, positive=False, meaning="how the loop leans", exponent="n"),
        Parameter("n", meaning="sharpness of yielding", least=ABOVE_ZERO, low=1.0, high=8.0),
    )
    states = 1

    def force(self, d, w, z, t):
        return self.k * z[0]

    def state_rate(self, d, w, z, t):
        bent = _power(z[0], self.n)
        return jnp.stack([w - self.beta * jnp.abs(w) * jnp.sign(z[0]) * bent - self.gamma * w * bent])

    def otherwise(self, stiffness):
        # Without beta the rate of z is w·(1 - gamma·abs(z)ⁿ): z is a function of the displacement.
        return "its loop has no width: it remembers nothing" if abs(self.beta) < _CLOSED * abs(self.gamma) else ""

    @classmethod
    def shapes(cls, scale):
        k = scale.force / scale.length
        return [
            {"k": k, "beta": 0.7 / (share * scale.length) ** n, "gamma": 0.3 / (share * scale.length) ** n, "n": n}
            for share in (0.3, 0.6, 1.2)
            for n in (1.0, 2.0)
        ]


class Jenkins(AbstractTerm):
    """A spring in series with a slider, force k·z with abs(z) ≤ slip."""

    k: Scalar = eqx.field(converter=as_scalar)
    slip: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "jenkins"
    parameters = (_STIFFNESS, Parameter("slip", length=1, meaning="stretch at which it slides", least=0.0))
    states = 1

    def force(self, d, w, z, t):
        return self.k * _within(z[0], self.slip)

    def state_rate(self, d, w, z, t):
        return jnp.stack([_stretch_rate(z[0], w, self.slip)])

    def settle(self, d, z):
        return jnp.stack([_within(z[0], self.slip)])

    @classmethod
    def shapes(cls, scale):
        return [
            {"k": scale.force / scale.length, "slip": share * scale.length} for share in (0.2, 0.3, 0.5, 0.7, 0.9, 1.1)
        ]


def _within(z, slip):
    return jnp.where(z >= slip, slip, jnp.where(z <= -slip, -slip, z))


def _stretch_rate(z, w, slip):
    sliding = ((z >= slip) & (w > 0)) | ((z <= -slip) & (w < 0))
    return jnp.where(sliding, 0.0, w)


class Iwan(AbstractTerm):
    r"""Parallel Jenkins elements of equal stiffness whose slips fill (0, slip): density ∝ s^chi, [1]_ Eq. (21).

    `k` is the stiffness before anything slides; sixteen sliders stand for the continuum.

    References
    ----------
    .. [1] D. J. Segalman, J. Appl. Mech. 72 (2005) 752-760.
    """

    k: Scalar = eqx.field(converter=as_scalar)
    slip: Scalar = eqx.field(converter=as_scalar)
    chi: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "iwan"
    parameters = (
        _STIFFNESS,
        Parameter("slip", length=1, meaning="stretch at which all of it slides", least=0.0),
        Parameter("chi", positive=False, meaning="exponent of the sliders' density", least=-0.999, low=-0.95, high=5.0),
    )
    states = _SLIDERS

    @property
    def _slips(self):
        # equal shares of the sliders: quantiles of the density s^chi on (0, slip)
        return self.slip * jnp.asarray((np.arange(_SLIDERS) + 0.5) / _SLIDERS) ** (1.0 / (1.0 + self.chi))

    def force(self, d, w, z, t):
        return self.k * jnp.mean(_within(z, self._slips))

    def state_rate(self, d, w, z, t):
        return _stretch_rate(z, w, self._slips)

    def settle(self, d, z):
        return _within(z, self._slips)

    @classmethod
    def shapes(cls, scale):
        k = scale.force / scale.length
        return [{"k": k, "slip": share * scale.length, "chi": chi} for share in (0.5, 1.0, 2.0) for chi in (-0.5, 0.0)]


class FreePlay(AbstractTerm):
    """A spring behind a gap that drags a slider at s, force k·dz(d - s), kept within -F_minus and F_plus by sliding.

    The slider begins in the middle of its gap.
    """

    k: Scalar = eqx.field(converter=as_scalar)
    gap: Scalar = eqx.field(converter=as_scalar)
    F_plus: Scalar = eqx.field(converter=as_scalar)
    F_minus: Scalar = eqx.field(converter=as_scalar)
    at: tuple[int, int] = eqx.field(converter=as_link, static=True, kw_only=True)
    kind = "free_play"
    contains = (Jenkins, EndStop)  # without a gap, and where nothing slides
    parameters = (
        Parameter("k", force=1, length=-1, meaning="stiffness behind the gap", least=ABOVE_ZERO),
        Parameter("gap", length=1, meaning="half width of the gap", least=0.0),
        Parameter("F_plus", force=1, meaning="force at which the slider moves forward", least=0.0),
        Parameter("F_minus", force=1, meaning="force at which the slider moves backward", least=0.0),
    )
    states = 1

    def force(self, d, w, z, t):
        pull, forward, backward = self._pull(d, z)
        return jnp.where(forward, self.F_plus, jnp.where(backward, -self.F_minus, pull))

    def state_rate(self, d, w, z, t):
        _, forward, backward = self._pull(d, z)
        sliding = (forward & (w > 0)) | (backward & (w < 0))
        return jnp.stack([jnp.where(sliding, w, 0.0)])

    def _pull(self, d, z):
        """Force of the spring, and whether it has reached the limit ahead or behind; rounding is not to decide that."""
        pull = self.k * beyond(d - z[0], self.gap)
        least = 1.0 - _ROUNDING
        return pull, pull >= least * self.F_plus, pull <= -least * self.F_minus

    def initial_state(self, d, w):
        return jnp.stack([d])

    def settle(self, d, z):
        stiffness = jnp.where(self.k > 0, self.k, 1.0)  # an empty slot has none
        behind, ahead = d - self.gap - self.F_plus / stiffness, d + self.gap + self.F_minus / stiffness
        return jnp.stack([jnp.where(z[0] <= behind, behind, jnp.where(z[0] >= ahead, ahead, z[0]))])

    @classmethod
    def shapes(cls, scale):
        force = 0.7 * scale.force
        return [
            {"k": scale.force / scale.length * stiff, "gap": gap * scale.length, "F_plus": force, "F_minus": force}
            for gap in (0.05, 0.2, 0.5, 0.9)
            for stiff in (1.0, 3.0)
        ]

    @classmethod
    def holding(cls, law, scale):
        if isinstance(law, EndStop):  # it gives way before the largest displacement
            gap = float(law.gap)
            found = [(gap, share * (scale.peak - gap)) for share in (0.3, 0.5, 0.7, 0.9)]
        elif isinstance(law, Jenkins):
            found = [(share * scale.length, float(law.slip)) for share in (0.02, 0.1)]
        else:
            return []
        k = float(law.k)
        return [{"k": k, "gap": gap, "F_plus": k * slip, "F_minus": k * slip} for gap, slip in found if slip > 0]
