"""Monomials of several coordinates up to a total order, and their derivatives at the origin."""

import functools
import itertools
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

MultiIndex = tuple[int, ...]


def basis_size(dim: int, order: int) -> int:
    """Number of monomials of `dim` coordinates up to `order`; the paper's n*, eq. 72."""
    return math.comb(dim + order, dim)


@functools.cache
def multi_indices(dim: int, order: int) -> tuple[MultiIndex, ...]:
    """Exponents of all monomials up to `order`, by rising total order: 1, x, v, x², xv, v², …"""
    every = itertools.product(range(order + 1), repeat=dim)
    within = (exponents for exponents in every if sum(exponents) <= order)
    return tuple(sorted(within, key=lambda exponents: (sum(exponents), *(-e for e in exponents))))


def first_derivatives(dim: int) -> tuple[MultiIndex, ...]:
    """Orders of the first derivatives, in the order of the columns."""
    return multi_indices(dim, 1)[1:]


def monomial_columns(coordinates: Sequence[Float[Array, "*shape"]], order: int) -> list[Float[Array, "*shape"]]:
    """Every monomial as an array of its own; each is one product of an earlier one, so no power of zero is formed."""
    columns: dict[MultiIndex, Float[Array, "*shape"]] = {}
    for exponents in multi_indices(len(coordinates), order):
        if not any(exponents):
            columns[exponents] = jnp.ones_like(coordinates[0])
            continue
        axis = next(i for i, e in enumerate(exponents) if e)
        parent = exponents[:axis] + (exponents[axis] - 1,) + exponents[axis + 1 :]
        columns[exponents] = coordinates[axis] if not any(parent) else columns[parent] * coordinates[axis]
    return list(columns.values())


def monomials(z: Float[Array, "*points dim"], order: int) -> Float[Array, "*points basis"]:
    """H(z): all monomials up to `order` at points given in the last axis, in the order of `multi_indices`."""
    return jnp.stack(monomial_columns([z[..., axis] for axis in range(z.shape[-1])], order), axis=-1)


def chebyshev_polynomials(z: Any, order: int) -> Any:
    """Products of Chebyshev polynomials up to a total order, (*points, basis), in the order of `multi_indices`.

    `z` (*points, dim) lies in [-1, 1]; a NumPy array gives one, a JAX array the other.
    """
    xp = np if isinstance(z, np.ndarray) else jnp
    t = [xp.ones_like(z), z]
    while len(t) <= order:
        t.append(2.0 * z * t[-1] - t[-2])
    columns = []
    for exponents in multi_indices(z.shape[-1], order):
        factors = [t[e][..., axis] for axis, e in enumerate(exponents) if e]
        columns.append(math.prod(factors[1:], start=factors[0]) if factors else t[0][..., 0])
    return xp.stack(columns, axis=-1)


class DerivativeTargets(NamedTuple):
    """Derivatives to be reproduced, as data: one compiled program serves value and every derivative."""

    orders: Float[Array, "derivatives dim"]
    """Each derivative as a multi-index β."""
    at_origin: Float[Array, "derivatives basis"]
    """(-1)^|β| H^β(0), the right-hand sides of eqs. 23 and 39."""

    def per_unit(self, dilation: Float[Array, " dim"]) -> Float[Array, " derivatives"]:
        """Factor from derivatives by coordinates divided by `dilation` to derivatives by the columns themselves."""
        return 1.0 / jnp.prod(dilation[None, :] ** self.orders, axis=1)


def derivative_targets(derivatives: Sequence[MultiIndex], order: int) -> DerivativeTargets:
    """Targets of several derivatives for a basis of monomials up to `order`."""
    dim = len(derivatives[0])
    at_origin = np.zeros((len(derivatives), basis_size(dim, order)))
    for row, beta in zip(at_origin, derivatives, strict=True):
        row[multi_indices(dim, order).index(beta)] = (-1.0) ** sum(beta) * math.prod(map(math.factorial, beta))
    return DerivativeTargets(jnp.asarray(derivatives, dtype=float), jnp.asarray(at_origin))
