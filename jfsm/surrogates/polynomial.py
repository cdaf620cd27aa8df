"""Force state map by one polynomial over the whole visited box."""

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.core import Tracer
from jax.scipy.linalg import solve_triangular
from jaxtyping import Array, ArrayLike, Float

from ._differentiate import mixed_derivative
from ._scattered import AbstractScatteredMap, whole_number
from .rkpm.basis import MultiIndex, basis_size, chebyshev_polynomials, first_derivatives
from .rkpm.nodes import Nodes, prepare_nodes


class Polynomial(AbstractScatteredMap):
    """One polynomial of a total order, in products of Chebyshev polynomials over the box; build it with `fit`.

    The reference for local maps: best where the truth is a polynomial, and wild outside the visited region.
    """

    nodes: Nodes
    order: int = eqx.field(static=True)
    coefficients: Float[Array, "basis *outputs"]
    """Of the products T_i T_j … over the box, in N, in the order of `multi_indices`."""
    triangle: Float[Array, "basis basis"]
    """R of √c H = Q R, for the standard error."""
    variance: Float[Array, "*outputs"]
    """Noise variance of one reading, from the residual."""

    @classmethod
    def fit(cls, states: Any, force: Any, order: int = 3) -> "Polynomial":
        """Least squares over all readings.

        Parameters
        ----------
        states : (n, dim) array
        force : (n,) or (n, outputs) array
            May be traced.
        order : int
            Highest total order, 1 or more.

        Raises
        ------
        TypeError, ValueError
            If the arguments do not fit together, values are not finite, or the states cannot determine the polynomial.
        """
        order = whole_number(order, "order", 1)
        nodes = prepare_nodes(states, force, order)
        return cls(nodes, order, *_least_squares(nodes, order))

    def __call__(self, state: ArrayLike) -> Float[Array, "*outputs"]:
        """Restoring force at one state."""
        return _derivative(self, self._state(state), (0,) * self.dim)

    def gradient(self, state: ArrayLike) -> Float[Array, "*outputs dim"]:
        """First derivatives of the polynomial at one state."""
        return jnp.stack([_derivative(self, self._state(state), axis) for axis in first_derivatives(self.dim)], axis=-1)

    def derivative(self, state: ArrayLike, orders: tuple[int, ...]) -> Float[Array, "*outputs"]:
        """Derivative of the polynomial at one state."""
        return _derivative(self, self._state(state), self._orders(orders, self.order))

    def std(self, state: ArrayLike) -> Float[Array, "*outputs"]:
        """Standard error of the force at one state, from the scatter of all readings about the polynomial."""
        return _standard_error(self, self._state(state))

    def evaluate_derivatives(
        self, states: ArrayLike, orders: Sequence[MultiIndex]
    ) -> Float[Array, "q derivatives *outputs"]:
        """Several derivatives at many states."""
        checked = [self._orders(one, self.order) for one in orders]
        states = states if isinstance(states, Tracer) else jnp.asarray(self._states(states))
        return jnp.stack([_many_derivatives(self, states, one) for one in checked], axis=1)


def _basis(nodes: Nodes, order: int, states: Float[Array, "*points dim"]) -> Float[Array, "*points basis"]:
    low, high = jnp.min(nodes.states, axis=0), jnp.max(nodes.states, axis=0)
    return chebyshev_polynomials((2.0 * states - high - low) / (high - low), order)


@eqx.filter_jit
def _least_squares(nodes: Nodes, order: int) -> tuple[Array, Array, Array]:
    root = jnp.sqrt(nodes.multiplicity)
    force = nodes.force.reshape(len(nodes), -1)
    q, r = jnp.linalg.qr(root[:, None] * jax.vmap(lambda state: _basis(nodes, order, state))(nodes.states))
    load = q.T @ (root[:, None] * force)
    residual = root[:, None] * force - q @ load
    freedom = jnp.maximum(len(nodes) - basis_size(nodes.dim, order), 1)
    outputs = nodes.force.shape[1:]
    variance = jnp.sum(residual**2, axis=0) / freedom
    return solve_triangular(r, load).reshape(-1, *outputs), r, variance.reshape(outputs)


def _value(force_map: Polynomial, state: Float[Array, " dim"]) -> Float[Array, "*outputs"]:
    return jnp.tensordot(_basis(force_map.nodes, force_map.order, state), force_map.coefficients, axes=1)


@eqx.filter_jit
def _derivative(force_map: Polynomial, state: Float[Array, " dim"], orders: MultiIndex) -> Float[Array, "*outputs"]:
    return mixed_derivative(lambda point: _value(force_map, point), orders)(state)


@eqx.filter_jit
def _many_derivatives(
    force_map: Polynomial, states: Float[Array, "q dim"], orders: MultiIndex
) -> Float[Array, "q *outputs"]:
    return jax.vmap(mixed_derivative(lambda point: _value(force_map, point), orders))(states)


@eqx.filter_jit
def _standard_error(force_map: Polynomial, state: Float[Array, " dim"]) -> Float[Array, "*outputs"]:
    h = _basis(force_map.nodes, force_map.order, state)
    return jnp.sqrt(force_map.variance * jnp.sum(solve_triangular(force_map.triangle, h, trans=1) ** 2))
