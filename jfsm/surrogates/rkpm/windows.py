"""Windows of compact support: how much a node counts by its distance from the point of evaluation."""

import abc
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..._types import as_scalar


class AbstractWindow(eqx.Module):
    """A weight of the distance in dilations, positive below `radius` and zero beyond.

    Its height does not matter: shape functions are unchanged when the window is multiplied by a number.
    """

    radius: ClassVar[float]
    """Half-width of the support in dilations."""

    @abc.abstractmethod
    def __call__(self, distance: Float[Array, "..."]) -> Float[Array, "..."]:
        """Weight, dimensionless, at distances (any shape, not negative) divided by the dilation."""


class CubicSplineWindow(AbstractWindow):
    """Cubic B-spline of the paper, eq. 8: twice continuously differentiable, support of two dilations."""

    radius = 2.0

    def __call__(self, distance: Float[Array, "..."]) -> Float[Array, "..."]:
        inner = 2.0 / 3.0 - distance**2 * (2.0 - distance) / 2.0
        outer = (2.0 - distance) ** 3 / 6.0
        return jnp.where(distance <= 1.0, inner, jnp.where(distance < 2.0, outer, 0.0))


class QuarticSplineWindow(AbstractWindow):
    """1 - 6r² + 8r³ - 3r⁴ on a support of one dilation, usual in moving least squares; flatter near its point."""

    radius = 1.0

    def __call__(self, distance: Float[Array, "..."]) -> Float[Array, "..."]:
        inside = (1.0 - distance) ** 3 * (1.0 + 3.0 * distance)
        return jnp.where(distance < 1.0, inside, 0.0)


class GaussianWindow(AbstractWindow):
    """exp(-(r/width)²/2) on a support of one dilation, brought to zero at its edge with zero slope.

    Parameters
    ----------
    width : float
        Standard deviation in dilations. An array leaf: a map can be differentiated by it.
    """

    width: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.4)
    radius = 1.0

    def __call__(self, distance: Float[Array, "..."]) -> Float[Array, "..."]:
        taper = jnp.where(distance < 1.0, (1.0 - distance**2) ** 2, 0.0)
        return jnp.exp(-0.5 * (distance / self.width) ** 2) * taper
