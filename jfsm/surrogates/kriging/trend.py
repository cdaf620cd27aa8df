"""Trend of universal kriging: a polynomial, whose functions are made orthonormal over the readings."""

import math
from dataclasses import dataclass

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jax.scipy.linalg import solve_triangular
from jaxtyping import Array, Float

from .._readings import check_rank
from ..rkpm.basis import multi_indices


@dataclass(frozen=True)
class PolynomialTrend:
    """All monomials up to an order, the f_j of eq. 52; ``cross_terms=False`` keeps powers of single columns only.

    Parameters
    ----------
    order : int
        0 for a constant; 2 is the paper's choice, eq. 53.
    cross_terms : bool
        The paper's p = 2l + 1 for order 2 without, 1 + l + l(l + 1)/2 with them.
    """

    order: int
    cross_terms: bool = True

    def exponents(self, dim: int) -> tuple[tuple[int, ...], ...]:
        """Exponents of every monomial by rising total order: 1, x, v, x², xv, v², …"""
        return tuple(e for e in multi_indices(dim, self.order) if self.cross_terms or sum(map(bool, e)) <= 1)


TRENDS = {
    "constant": PolynomialTrend(0),
    "linear": PolynomialTrend(1),
    "quadratic": PolynomialTrend(2),
    "pure quadratic": PolynomialTrend(2, cross_terms=False),
    "cubic": PolynomialTrend(3),
}


def as_trend(trend: str | PolynomialTrend) -> PolynomialTrend:
    """The trend that a name stands for.

    Raises
    ------
    ValueError
        If the name is unknown or the order is negative.
    """
    if isinstance(trend, PolynomialTrend):
        if trend.order < 0:
            raise ValueError(f"`trend` must have an order of 0 or more; got {trend.order}.")
        return trend
    if not isinstance(trend, str) or trend not in TRENDS:
        names = ", ".join(repr(name) for name in TRENDS)
        raise ValueError(f"`trend` must be one of {names} or a PolynomialTrend; got {trend!r}.")
    return TRENDS[trend]


class TrendBasis(eqx.Module):
    """Functions that span the trend and are orthonormal over the readings it was built for."""

    trend: PolynomialTrend = eqx.field(static=True)
    centre: Float[Array, " dim"]
    scale: Float[Array, " dim"]
    triangle: Float[Array, "p p"]

    def __call__(self, states: Float[Array, "q dim"], orders: tuple[int, ...]) -> Float[Array, "q p"]:
        """Derivative of every function by the columns, at every state; orders of zero mean the function itself."""
        raw = monomials(self.trend, (states - self.centre[None]) / self.scale[None], orders)
        raw = raw / jnp.prod(self.scale ** jnp.asarray(orders))
        return solve_triangular(self.triangle, raw.T, trans=1, lower=False).T


def monomials(
    trend: PolynomialTrend, z: Float[Array, "q dim"], orders: tuple[int, ...] | None = None
) -> Float[Array, "q p"]:
    """The monomials of the trend, or their derivative by the columns of `z`."""
    dim = z.shape[1]
    orders = (0,) * dim if orders is None else orders
    columns = []
    for exponents in trend.exponents(dim):
        column = jnp.full(z.shape[:1], float(math.prod(map(math.perm, exponents, orders))))
        for k, (power, order) in enumerate(zip(exponents, orders, strict=True)):
            if power > order:
                column = column * z[:, k] ** (power - order)
        columns.append(column)
    return jnp.stack(columns, axis=1)


def trend_basis(trend: PolynomialTrend, states: Float[Array, "n dim"]) -> tuple[TrendBasis, Float[Array, "n p"]]:
    """Orthonormal functions of the trend, and F of eq. 62 in terms of them.

    Raises
    ------
    ValueError
        If the states cannot tell the monomials apart.

    Notes
    -----
    The paper takes the monomials themselves. They span the same functions, so that every map and likelihood is the
    same; but in metres and metres per second their normal matrix is singular to double precision.
    """
    basis, f = _orthonormal(trend, states)
    if not isinstance(f, Tracer):
        check_rank(
            np.asarray(basis.triangle),
            f"monomials of the trend of order {trend.order}",
            f"{len(states)} points",
            "Take a simpler trend or add data of another amplitude.",
        )
    return basis, f


@eqx.filter_jit
def _orthonormal(trend: PolynomialTrend, states: Float[Array, "n dim"]) -> tuple[TrendBasis, Float[Array, "n p"]]:
    centre, spread = jnp.mean(states, axis=0), jnp.std(states, axis=0)
    scale = jnp.where(spread > 0.0, spread, 1.0)
    f, triangle = jnp.linalg.qr(monomials(trend, (states - centre[None]) / scale[None]))
    return TrendBasis(trend, centre, scale, triangle), f
