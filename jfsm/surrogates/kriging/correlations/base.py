"""What every correlation of kriging offers: one function of the lag along one axis."""

import abc
import functools
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float


class AbstractCorrelation(eqx.Module):
    r"""Correlation of the random field between two states, eq. 54: a product over the columns.

    .. math:: R(h) = \prod_k \rho(h_k / \ell_k)

    with one length scale :math:`\ell_k` per column, in its unit. A product of valid correlations is valid in any number
    of columns; only the Gaussian one is also a function of the distance alone.
    """

    smoothness: ClassVar[float]
    """How often the field can be differentiated along a column (in mean square); infinite for the Gaussian one."""

    @abc.abstractmethod
    def __call__(self, lag: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        """ρ, dimensionless, at lags divided by the length scale of their column; one at zero lag."""

    def derivative(self, lag: Float[Array, "*shape"], order: int) -> Float[Array, "*shape"]:
        """Derivative of ρ of any order by the scaled lag."""
        function = self.__call__
        for _ in range(order):
            function = functools.partial(_slope, function)
        return function(lag)

    def between(
        self,
        a: Float[Array, "q dim"],
        b: Float[Array, "n dim"],
        length_scale: Float[Array, " dim"],
        orders: tuple[int, ...] | None = None,
    ) -> Float[Array, "q n"]:
        """R of every pair, or its derivative by the columns of `a`."""
        orders = (0,) * a.shape[1] if orders is None else orders
        factors = []
        for k, order in enumerate(orders):
            lag = (a[:, k, None] - b[None, :, k]) / length_scale[k]
            factors.append(self.derivative(lag, order) / length_scale[k] ** order)
        return functools.reduce(jnp.multiply, factors)

    def variance_of_derivative(self, length_scale: Float[Array, " dim"], orders: tuple[int, ...]) -> Float[Array, ""]:
        """Variance of a derivative of the field over that of the field: Π (-1)^o ρ^(2o)(0) / ℓ^(2o)."""
        zero = jnp.zeros(())
        factors = [
            (-1) ** order * self.derivative(zero, 2 * order) / length_scale[k] ** (2 * order)
            for k, order in enumerate(orders)
        ]
        return functools.reduce(jnp.multiply, factors)


def _slope(function, lag: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    return jax.jvp(function, (lag,), (jnp.ones_like(lag),))[1]
