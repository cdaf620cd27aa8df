"""Force state map by radial basis functions on the nearest nodes."""

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, ArrayLike, Float

from .._types import as_scalar, is_traced
from ._differentiate import mixed_derivative
from ._scattered import AbstractScatteredMap, whole_number
from .rkpm.basis import MultiIndex, basis_size, first_derivatives, monomials
from .rkpm.estimates import Neighbourhood, nearest_nodes
from .rkpm.many import neighbourhoods, search_tree
from .rkpm.nodes import Nodes, prepare_nodes

NEIGHBOURS_PER_MONOMIAL = 5


class RadialBasis(AbstractScatteredMap):
    """Polyharmonic spline through the nearest nodes, with a polynomial; build it with `RadialBasis.fit`.

    Notes
    -----
    For order p the spline is r^(2p-1) and the polynomial of total order p, which is reproduced exactly; derivatives
    exist up to order p. Without `smoothing` the map passes through every reading. Each state has a system of its own
    over its nearest nodes, as `scipy.interpolate.RBFInterpolator` with `neighbors` [1]_; the map jumps slightly where
    one node takes another's place.

    References
    ----------
    .. [1] B. Fornberg, N. Flyer, A Primer on Radial Basis Functions with Applications to the Geosciences, SIAM 2015.
    """

    nodes: Nodes
    order: int = eqx.field(static=True)
    neighbours: int = eqx.field(static=True)
    smoothing: Float[Array, ""]

    @classmethod
    def fit(
        cls, states: Any, force: Any, order: int = 3, neighbours: int | None = None, smoothing: Any = 0.0
    ) -> "RadialBasis":
        """Map through readings of the restoring force.

        Parameters
        ----------
        states : (n, dim) array
        force : (n,) or (n, outputs) array
            May be traced.
        order : int
            Order of the polynomial, 1 or more.
        neighbours : int, optional
            Nodes of each local system; five per monomial when None (or all, when there are fewer).
        smoothing : float
            Added to the diagonal of the local system in coordinates divided by its radius: 0 interpolates, large values
            tend to the least-squares polynomial of the neighbours.

        Raises
        ------
        TypeError, ValueError
            If the arguments do not fit together, values are not finite, or the states cannot determine the polynomial.
        """
        order = whole_number(order, "order", 1)
        nodes = prepare_nodes(states, force, order)
        count, least = len(nodes), basis_size(nodes.dim, order)
        if neighbours is None:
            neighbours = min(NEIGHBOURS_PER_MONOMIAL * least, count)
        neighbours = whole_number(neighbours, "neighbours", least)
        if neighbours > count:
            raise ValueError(f"`neighbours` must be {count} (all distinct states) at most; got {neighbours}.")
        ridge = as_scalar(smoothing)
        if not isinstance(ridge, Tracer) and ridge < 0.0:
            raise ValueError(f"`smoothing` must not be negative; got {ridge:g}.")
        return cls(nodes, order, neighbours, ridge)

    def __call__(self, state: ArrayLike) -> Float[Array, "*outputs"]:
        """Restoring force at one state."""
        return _derivatives(self, self._state(state), ((0,) * self.dim,))[0]

    def gradient(self, state: ArrayLike) -> Float[Array, "*outputs dim"]:
        """First derivatives of the local spline at one state."""
        return jnp.moveaxis(_derivatives(self, self._state(state), first_derivatives(self.dim)), 0, -1)

    def derivative(self, state: ArrayLike, orders: tuple[int, ...]) -> Float[Array, "*outputs"]:
        """Derivative of the local spline at one state; its orders sum to the map's order at most."""
        return _derivatives(self, self._state(state), (self._orders(orders, self.order),))[0]

    def std(self, state: ArrayLike) -> Float[Array, "*outputs"]:
        """Standard error of the force at one state.

        Notes
        -----
        The spline is the best linear prediction of a random force whose generalised covariance is ±r^(2p-1), with
        `smoothing` as its nugget. The variance of that prediction is scaled by the local readings,
        σ² = uᵀA⁻¹u/(neighbours - monomials). Zero at a node unless smoothed.

        Raises
        ------
        ValueError
            If `neighbours` equals the number of monomials.
        """
        if self.neighbours <= basis_size(self.dim, self.order):
            raise ValueError(f"`std` needs more neighbours than the {self.neighbours} monomials. Enlarge `neighbours`.")
        return _standard_error(self, self._state(state))

    def evaluate_derivatives(
        self, states: ArrayLike, orders: Sequence[MultiIndex]
    ) -> Float[Array, "q derivatives *outputs"]:
        """Several derivatives at many states: one local system each serves all of them."""
        checked = tuple(self._orders(one, self.order) for one in orders)
        if is_traced((states, self)):
            return jax.vmap(lambda state: _derivatives(self, self._state(state), checked))(jnp.asarray(states))
        states, outputs = self._states(states), self.nodes.force.shape[1:]
        tree, work = search_tree(self.nodes), self.neighbours**2
        parts = [
            np.asarray(_block_derivatives(self, around, block, checked))[:length]
            for around, block, length in neighbourhoods(tree, self.nodes, self.neighbours, states, work)
        ]
        found = np.concatenate(parts) if parts else np.zeros((0, len(checked), 1))
        return jnp.asarray(found.reshape(len(states), len(checked), *outputs))


def _spline(distance_squared: Float[Array, "..."], order: int) -> Float[Array, "..."]:
    """(-1)^p r^(2p-1), conditionally positive definite of order p; its derivatives up to the p-th vanish at r = 0."""
    apart = distance_squared > 0.0
    power = jnp.where(apart, distance_squared, 1.0) ** (order - 0.5)
    return (-1.0) ** order * jnp.where(apart, power, 0.0)


class _Local:
    """The system around one state, in coordinates about it divided by the distance of the farthest node."""

    def __init__(self, force_map: RadialBasis, near: Neighbourhood, state: Float[Array, " dim"]):
        self.order, self.centre = force_map.order, jax.lax.stop_gradient(state)
        offsets = (near.states - self.centre[None, :]) / force_map.nodes.scale[None, :]
        self.radius = jnp.sqrt(jnp.max(jnp.sum(offsets**2, axis=1))) * force_map.nodes.scale
        self.z = (near.states - self.centre[None, :]) / self.radius[None, :]
        covariance = _spline(jnp.sum((self.z[:, None, :] - self.z[None, :, :]) ** 2, axis=-1), self.order)
        covariance = covariance + jnp.diag(force_map.smoothing / near.multiplicity)
        trend = monomials(self.z, self.order)
        size = trend.shape[1]
        self.matrix = jnp.block([[covariance, trend], [trend.T, jnp.zeros((size, size))]])

    def functions(self, state: Float[Array, " dim"]) -> Float[Array, " system"]:
        """Spline of each node and monomials, at a state near the centre."""
        z = (state - self.centre) / self.radius
        spline = _spline(jnp.sum((z[None, :] - self.z) ** 2, axis=1), self.order)
        return jnp.concatenate([spline, monomials(z, self.order)])

    def solve(self, values: Float[Array, "near columns"]) -> Float[Array, "system columns"]:
        return jnp.linalg.solve(self.matrix, jnp.pad(values, ((0, self.matrix.shape[0] - values.shape[0]), (0, 0))))


def _local_derivatives(
    force_map: RadialBasis, near: Neighbourhood, state: Float[Array, " dim"], orders: tuple[MultiIndex, ...]
) -> Float[Array, "derivatives *outputs"]:
    local = _Local(force_map, near, state)
    solution = local.solve(near.force.reshape(near.force.shape[0], -1))
    rows = jnp.stack([mixed_derivative(local.functions, one)(state) for one in orders])
    return (rows @ solution).reshape(len(orders), *near.force.shape[1:])


@eqx.filter_jit
def _derivatives(
    force_map: RadialBasis, state: Float[Array, " dim"], orders: tuple[MultiIndex, ...]
) -> Float[Array, "derivatives *outputs"]:
    near = nearest_nodes(force_map.nodes, state, force_map.neighbours)
    return _local_derivatives(force_map, near, state, orders)


@eqx.filter_jit
def _block_derivatives(
    force_map: RadialBasis, around: Neighbourhood, states: Float[Array, "block dim"], orders: tuple[MultiIndex, ...]
) -> Float[Array, "block derivatives outputs"]:
    return jax.vmap(lambda near, state: _local_derivatives(force_map, near, state, orders))(around, states)


@eqx.filter_jit
def _standard_error(force_map: RadialBasis, state: Float[Array, " dim"]) -> Float[Array, "*outputs"]:
    near = nearest_nodes(force_map.nodes, state, force_map.neighbours)
    local = _Local(force_map, near, state)
    force = near.force.reshape(near.force.shape[0], -1)
    weights = local.solve(force)[: force.shape[0]]
    process_variance = jnp.sum(force * weights, axis=0) / (force.shape[0] - basis_size(force_map.dim, force_map.order))
    at_state = local.functions(state)
    power = -at_state @ jnp.linalg.solve(local.matrix, at_state)
    variance = jnp.maximum(process_variance, 0.0) * jnp.maximum(power, 0.0)
    return jnp.sqrt(variance).reshape(near.force.shape[1:])
