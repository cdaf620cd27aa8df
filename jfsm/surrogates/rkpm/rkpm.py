"""Force state map by the reproducing kernel particle method."""

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, ArrayLike, Bool, Float
from numpy.typing import NDArray
from scipy.spatial import KDTree

from ..._types import as_array, require_x64
from .._map import AbstractForceStateMap
from .basis import DerivativeTargets, MultiIndex, basis_size, derivative_targets
from .estimates import (
    SINGULAR,
    Neighbourhood,
    Rule,
    basis_at,
    degenerate_message,
    derivatives_at,
    nearest_nodes,
    standard_error_at,
)
from .many import evaluate_many
from .nodes import Nodes, prepare_nodes
from .shape_functions import LocalBasis
from .windows import AbstractWindow, CubicSplineWindow

NEIGHBOURS_PER_MONOMIAL = 8


class RKPM(AbstractForceStateMap):
    """Reproducing kernel particle map; build it with `RKPM.fit`.

    Notes
    -----
    Every polynomial up to `order` is reproduced exactly, with its derivatives. Derivatives are reproduced ones
    (eq. 46); where the truth is no polynomial they differ from `jax.grad` of the value by the approximation error.
    Calls on one state search the neighbours by brute force and factorise by QR: exact, traceable, and slower per state
    than `evaluate`, which searches a tree on the host and uses Cholesky where that is safe.
    """

    nodes: Nodes
    rule: Rule
    reach: Float[Array, ""]
    """Distance to the nearest node, in standard deviations of the states, within which a state counts as visited."""

    @classmethod
    def fit(
        cls,
        states: Any,
        force: Any,
        order: int = 3,
        neighbours: int | None = None,
        window: AbstractWindow | None = None,
    ) -> "RKPM":
        """Map through readings of the restoring force.

        Parameters
        ----------
        states : (n, dim) array
            Columns x1…xd, v1…vd, or any coordinates. Units do not matter: each column is divided by its standard
            deviation.
        force : (n,) or (n, outputs) array
            Restoring force at the states.
        order : int
            Highest order of the polynomials that are reproduced, 1 or more.
        neighbours : int, optional
            Nodes inside the window's support; eight per monomial when None (or all, when there are fewer). The least is
            the paper's n*, eq. 72, the number of monomials; twice that is safe on trajectories; noise wants 16 times.
        window : AbstractWindow, optional
            `CubicSplineWindow`, eq. 8, when None.

        Raises
        ------
        TypeError, ValueError
            If the arguments do not fit together, values are not finite, or the states cannot determine the polynomials.

        Notes
        -----
        Repeated states are merged into one node with the mean force, weighted by how often they occur. Around a state
        where the moment matrix is singular the support grows to twice and four times `neighbours`; if that does not
        help, the evaluation raises a RuntimeError.
        """
        require_x64()
        if isinstance(order, bool) or not isinstance(order, int | np.integer) or order < 1:
            raise ValueError(f"`order` must be an integer of 1 or more; got {order!r}.")
        window = CubicSplineWindow() if window is None else window
        if not isinstance(window, AbstractWindow):
            raise TypeError(f"`window` must be a window such as CubicSplineWindow(); got {window!r}.")
        nodes = prepare_nodes(states, force, int(order))
        count, dim = len(nodes), nodes.dim
        least = basis_size(dim, order)
        neighbours = min(NEIGHBOURS_PER_MONOMIAL * least, count) if neighbours is None else neighbours
        if (
            isinstance(neighbours, bool)
            or not isinstance(neighbours, int | np.integer)
            or not least <= neighbours <= count
        ):
            raise ValueError(
                f"`neighbours` must be an integer from {least} (n*, eq. 72, for order {order} in {dim} dimensions) "
                f"to {count} (all distinct states); got {neighbours!r}."
            )
        tree = KDTree(np.asarray(nodes.states / nodes.scale[None, :]))
        spacing = tree.query(tree.data, k=min(least + 1, count))[0][:, -1]
        return cls(nodes, Rule(window, int(order), int(neighbours)), jnp.asarray(np.quantile(spacing, 0.95)))

    @property
    def dim(self) -> int:
        return self.nodes.dim

    @property
    def box(self) -> Float[Array, "2 dim"]:
        return jnp.stack([jnp.min(self.nodes.states, axis=0), jnp.max(self.nodes.states, axis=0)])

    def __call__(self, state: Float[ArrayLike, " dim"]) -> Float[Array, "*outputs"]:
        """Restoring force at one state, eq. 11.

        Raises
        ------
        RuntimeError
            If the nodes around the state cannot tell the monomials apart.
        """
        return _derivatives(self, self._state(state), self._targets([(0,) * self.dim]))[0]

    def gradient(self, state: Float[ArrayLike, " dim"]) -> Float[Array, "*outputs dim"]:
        """First derivatives at one state, reproduced exactly for polynomials (eq. 46)."""
        axes = [tuple(int(i == axis) for i in range(self.dim)) for axis in range(self.dim)]
        return jnp.moveaxis(_derivatives(self, self._state(state), self._targets(axes)), 0, -1)

    def derivative(self, state: Float[ArrayLike, " dim"], orders: tuple[int, ...]) -> Float[Array, "*outputs"]:
        """Derivative at one state; ``orders=(3, 0)`` is the third one in the first column (eq. 46)."""
        return _derivatives(self, self._state(state), self._targets([orders]))[0]

    def std(self, state: Float[ArrayLike, " dim"]) -> Float[Array, "*outputs"]:
        r"""Standard error of the force at one state from the scatter of the neighbours about the local fit.

        Notes
        -----
        With readings of equal and independent noise σ², windows φ, multiplicities c and leverages
        :math:`l_i = \phi_i c_i H_i^T M^{-1} H_i`,

        .. math:: \hat\sigma^2 = \frac{\sum_i \phi_i c_i e_i^2}{\sum_i \phi_i (1 - l_i)}, \qquad
            \mathrm{std}^2 = \hat\sigma^2 \sum_i \psi_i^2 / c_i,

        which is unbiased where the truth is a polynomial of the map's order. Elsewhere part of the approximation error
        counts as noise. Noise in the states themselves is not known here.

        Raises
        ------
        ValueError
            If `neighbours` equals the number of monomials: no residual is left.
        """
        size = basis_size(self.dim, self.rule.order)
        if self.rule.neighbours <= size:
            raise ValueError(
                f"`std` needs more neighbours than the {size} monomials; the map was fitted with "
                f"{self.rule.neighbours}. Enlarge `neighbours`."
            )
        return _standard_error(self, self._state(state), self._targets([(0,) * self.dim]))

    def evaluate_derivatives(
        self, states: Float[ArrayLike, "q dim"], orders: Sequence[MultiIndex]
    ) -> Float[Array, "q derivatives *outputs"]:
        """Several derivatives at many states; ``(0, 0)`` among `orders` is the force itself.

        Searches neighbours in a tree on the host; where states or window are traced it is `jax.vmap` of calls on one.

        Raises
        ------
        RuntimeError
            If the nodes around some state cannot tell the monomials apart.
        """
        targets = self._targets(orders)
        if any(isinstance(leaf, Tracer) for leaf in jax.tree.leaves((states, self.nodes.states, self.rule))):
            return jax.vmap(lambda state: _derivatives(self, self._state(state), targets))(jnp.asarray(states))
        return evaluate_many(self.nodes, self.rule, self._states(states), targets)

    def visited(self, states: Float[ArrayLike, "q dim"]) -> Bool[NDArray[np.bool_], " q"]:
        """Whether each state has a node within `reach`: the distance of 95 in 100 nodes to their n*-th neighbour.

        Elsewhere the map extrapolates, with errors 10 to 100 times larger.
        """
        scale = np.asarray(self.nodes.scale)
        distance, _ = KDTree(np.asarray(self.nodes.states) / scale).query(self._states(states) / scale)
        return distance <= float(self.reach)

    def _states(self, states: Any) -> NDArray[np.float64]:
        states = as_array(states, "states", 2)
        if states.shape[1] != self.dim:
            raise ValueError(f"`states` must have {self.dim} columns, as in `fit`; got shape {states.shape}.")
        return states

    def _state(self, state: Any) -> Float[Array, " dim"]:
        state = state if isinstance(state, Tracer) else jnp.asarray(as_array(state, "state", 1))
        if state.shape != (self.dim,):
            raise ValueError(
                f"`state` must be one state of shape ({self.dim},); got shape {state.shape}. "
                "Use `evaluate` or `jax.vmap` for many."
            )
        return state

    def _targets(self, derivatives: Sequence[MultiIndex]) -> DerivativeTargets:
        return derivative_targets([self._orders(orders) for orders in derivatives], self.rule.order)

    def _orders(self, orders: Any) -> MultiIndex:
        orders = tuple(orders)
        whole = all(isinstance(o, int | np.integer) and o >= 0 for o in orders)
        if len(orders) != self.dim or not whole or sum(orders) > self.rule.order:
            raise ValueError(
                f"`orders` must be {self.dim} integers from 0, one per column, that sum to the map's order "
                f"{self.rule.order} at most; got {orders!r}."
            )
        return tuple(int(o) for o in orders)


@eqx.filter_jit
def _derivatives(
    force_map: RKPM, state: Float[Array, " dim"], targets: DerivativeTargets
) -> Float[Array, "derivatives *outputs"]:
    near, local = _checked_basis(force_map, state)
    return derivatives_at(local, near, targets)


@eqx.filter_jit
def _standard_error(force_map: RKPM, state: Float[Array, " dim"], value: DerivativeTargets) -> Float[Array, "*outputs"]:
    near, local = _checked_basis(force_map, state)
    return standard_error_at(local, near, value)


def _checked_basis(force_map: RKPM, state: Float[Array, " dim"]) -> tuple[Neighbourhood, LocalBasis]:
    nodes, rule = force_map.nodes, force_map.rule
    near = nearest_nodes(nodes, rule, state)
    local = basis_at(near, nodes.scale, rule, state)
    singular = local.conditioning < SINGULAR
    return near, local._replace(r=eqx.error_if(local.r, singular, degenerate_message(nodes, rule)))
