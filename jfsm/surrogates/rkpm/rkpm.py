"""Force state map by the reproducing kernel particle method."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from ..._types import as_array, is_traced, require_x64
from .._readings import check_shapes
from .._scattered import AbstractScatteredMap, whole_number
from .basis import DerivativeTargets, MultiIndex, basis_size, derivative_targets, first_derivatives
from .estimates import (
    SINGULAR,
    Neighbourhood,
    Rule,
    basis_at,
    degenerate_message,
    nearest_nodes,
    standard_error_at,
)
from .interfaces import Interface
from .leave_one_out import errors_within, leave_one_out_errors
from .many import evaluate_many
from .nodes import Nodes, check_enough, prepare_nodes
from .report import Support, supports
from .robust import doubted
from .rule import weighing_rule
from .selection import Score, choose
from .shape_functions import LocalBasis
from .support import gathered_nodes
from .tuning import log_parameters as known_parameters
from .tuning import tune, with_parameters
from .windows import AbstractWindow


class RKPM(AbstractScatteredMap):
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

    @classmethod
    def fit(
        cls,
        states: Any,
        force: Any,
        order: int = 3,
        neighbours: int | None = None,
        window: AbstractWindow | None = None,
        dilation: Any = 1.0,
        across: Sequence[Interface] = (),
        robust: bool = False,
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
        dilation : float
            Share of the support that holds `neighbours` nodes, at most 1: a continuous measure of its size.
        across : sequence of functions of one state
            Interfaces across which force or slope may jump, such as ``Plane((0, 1), 0.0)`` for v = 0. Their signs
            divide the states into regions, and each region is fitted from its own nodes, eqs. 47 to 50: whatever is
            a polynomial on either side is reproduced exactly. `find_discontinuities` looks for them.
        robust : bool
            Whether readings that contradict their neighbours count less, by Tukey's bisquare of their leave-one-out
            errors. The polynomials are still reproduced.

        Raises
        ------
        TypeError, ValueError
            If the arguments do not fit together, values are not finite, or the states cannot determine the polynomials.

        Notes
        -----
        The map is a tree of arrays: `equinox.filter_grad` of any function of it differentiates by node states,
        readings, the scale of each column, `dilation` and the window's width. Which nodes are neighbours stays fixed.

        Repeated states are merged into one node with the mean force, weighted by how often they occur. Around a state
        where the moment matrix is singular the support grows to twice and four times `neighbours`; if that does not
        help, the evaluation raises a RuntimeError.
        """
        order = whole_number(order, "order", 1)
        if not isinstance(robust, bool | np.bool_):
            raise TypeError(f"`robust` must be True or False; got {robust!r}.")
        nodes = prepare_nodes(states, force, order)
        rule = weighing_rule(nodes, order, neighbours, window, dilation, across)
        return cls(doubted(nodes, rule) if robust else nodes, rule)

    @classmethod
    def select(
        cls,
        states: Any,
        force: Any,
        orders: Sequence[int] = (1, 2, 3, 4),
        neighbours: Sequence[int] | None = None,
        window: AbstractWindow | None = None,
        across: Sequence[Interface] = (),
        robust: bool = False,
    ) -> "Selection":
        """Map whose order and support are chosen by the data, with the errors of all that were tried.

        Parameters
        ----------
        states, force, window, across, robust
            As for `fit`.
        orders : sequence of int
            Orders to try, rising; those that the states cannot carry are left out.
        neighbours : sequence of int, optional
            Numbers of neighbours to try; 2, 4, 8, 16 and 32 per monomial when None, half of the nodes at most.

        Raises
        ------
        TypeError, ValueError
            As `fit` does, for the first order.

        Notes
        -----
        Judged by leave-one-out errors at 1500 nodes at most. Of all combinations whose mean square is within one
        standard error (of the difference) of the best, that with the most neighbours and the lowest order is taken.
        Where the error exceeds 0.5 % of the force at least 16 neighbours per monomial are: with noise in the states
        too, leave-one-out prefers too few.
        """
        scores = choose(
            states, force, [whole_number(o, "orders", 1) for o in orders], neighbours, window=window, across=across
        )
        best = next(score for score in scores if score.chosen)
        return Selection(cls.fit(states, force, best.order, best.neighbours, window, 1.0, across, robust), scores)

    def tuned(self) -> "RKPM":
        """This map with the scale of each column, the dilation and the window's width at the least leave-one-out error.

        By gradient (BFGS on logarithms, 30 evaluations at most), from the values it has and at 300 nodes at most;
        `leave_one_out_errors` is the function that it makes small.
        """
        return RKPM(*tune(self.nodes, self.rule))

    def leave_one_out(self) -> Float[Array, "nodes *outputs"]:
        """Force at each node minus what the other nodes say there, in the order of ``nodes.states``.

        Exact for the local fit with its support kept: the closed form of leaving one reading out.
        """
        errors = leave_one_out_errors(self.nodes, self.rule, [self.rule.neighbours])[0]
        return jnp.asarray(errors.reshape(self.nodes.force.shape))

    @staticmethod
    def leave_one_out_errors(
        log_parameters: ArrayLike,
        states: ArrayLike,
        force: ArrayLike,
        order: int = 3,
        neighbours: int | None = None,
        window: AbstractWindow | None = None,
    ) -> Float[Array, "n *outputs"]:
        """Every reading minus what the others say there, as a function of what weighs them.

        Parameters
        ----------
        log_parameters : (dim + 1 + numbers of the window,) array
            Natural logarithms of the scale of every column, in its unit; of the dilation, at most 0; and of the numbers
            that shape the window: the width of a `GaussianWindow`, none of the splines. Only the ratios of the scales
            matter, since the support follows the nodes.
        states, force, order, neighbours, window
            As for `fit`. Log-parameters, states and force may be traced. Readings at one state are not merged: each is
            left out while its twin stays.

        Returns
        -------
        errors : (n,) or (n, outputs) array
            In the unit of the force, exact for a local fit whose support is kept. Keep the dilation above a half, as
            `tuned` does: where a support holds hardly more than its own node the errors have no meaning.
            `jax.grad`, `jax.hessian` and `jax.vmap` apply; the neighbours are searched
            anew, and a node that becomes one weighs nothing at first.
        """
        require_x64()
        order = whole_number(order, "order", 1)
        if not is_traced((states, force)):
            states, force = check_shapes(states, force)
            check_enough(np.unique(states, axis=0), order)
        states, force = jnp.asarray(states), jnp.asarray(force)
        dim, ones = states.shape[1], jnp.ones(len(states))
        nodes = Nodes(states, force, ones, jnp.ones(dim), reach=jnp.zeros(()))
        rule = weighing_rule(nodes, order, neighbours, window)
        size = len(known_parameters(nodes, rule))
        if not is_traced(log_parameters):
            log_parameters = as_array(log_parameters, "log_parameters", 1)
        if np.shape(log_parameters) != (size,):
            raise ValueError(
                f"`log_parameters` must hold the logarithms of {dim} scales, of the dilation, and of the numbers of "
                f"the window, shape ({size},); got shape {np.shape(log_parameters)}."
            )
        return _left_out(jnp.asarray(log_parameters), nodes, rule)

    def support(self, states: ArrayLike) -> Support:
        """What is done at each state: nodes in the support, dilation, condition, and whether the map extrapolates."""
        states = self._states(states)
        return supports(self.nodes, self.rule, states, self.visited(states))

    def __call__(self, state: ArrayLike) -> Float[Array, "*outputs"]:
        """Restoring force at one state, eq. 11.

        Raises
        ------
        RuntimeError
            If the nodes around the state cannot tell the monomials apart.
        """
        return _derivatives(self, self._state(state), self._targets([(0,) * self.dim]))[0]

    def gradient(self, state: ArrayLike) -> Float[Array, "*outputs dim"]:
        """First derivatives at one state, reproduced exactly for polynomials (eq. 46)."""
        return jnp.moveaxis(_derivatives(self, self._state(state), self._targets(first_derivatives(self.dim))), 0, -1)

    def derivative(self, state: ArrayLike, orders: tuple[int, ...]) -> Float[Array, "*outputs"]:
        """Derivative at one state; ``orders=(3, 0)`` is the third one in the first column (eq. 46)."""
        return _derivatives(self, self._state(state), self._targets([orders]))[0]

    def std(self, state: ArrayLike, orders: tuple[int, ...] | None = None) -> Float[Array, "*outputs"]:
        r"""Standard error of the force at one state from the scatter of the neighbours about the local fit.

        With `orders`, as for `derivative`, that of the derivative.

        Notes
        -----
        With readings of equal and independent noise σ², windows φ, multiplicities c and leverages
        :math:`l_i = \phi_i c_i H_i^T M^{-1} H_i`,

        .. math:: \hat\sigma^2 = \frac{\sum_i \phi_i c_i e_i^2}{\sum_i \phi_i (1 - l_i)}, \qquad
            \mathrm{std}^2 = \hat\sigma^2 \sum_i \psi_i^2 / c_i,

        with the shape functions θ of eq. 46 for ψ where a derivative is asked for. It is unbiased where the truth is a
        polynomial of the map's order. Elsewhere part of the approximation error counts as noise. Noise in the states
        themselves is not known here.

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
        return _standard_error(self, self._state(state), self._targets([orders or (0,) * self.dim]))

    def evaluate_derivatives(
        self, states: ArrayLike, orders: Sequence[MultiIndex]
    ) -> Float[Array, "q derivatives *outputs"]:
        """Several derivatives at many states; ``(0, 0)`` among `orders` is the force itself.

        Searches neighbours in a tree on the host; where states or window are traced it is `jax.vmap` of calls on one.

        Raises
        ------
        RuntimeError
            If the nodes around some state cannot tell the monomials apart.
        """
        targets = self._targets(orders)
        if is_traced((states, self.nodes.states, self.nodes.scale, self.rule)):
            return jax.vmap(lambda state: _derivatives(self, self._state(state), targets))(jnp.asarray(states))
        return evaluate_many(self.nodes, self.rule, self._states(states), targets)

    def _targets(self, derivatives: Sequence[MultiIndex]) -> DerivativeTargets:
        return derivative_targets([self._orders(orders, self.rule.order) for orders in derivatives], self.rule.order)


class Selection(NamedTuple):
    """A map and the combinations of order and support that it was chosen from."""

    force_map: RKPM
    scores: tuple[Score, ...]


@eqx.filter_jit
def _derivatives(
    force_map: RKPM, state: Float[Array, " dim"], targets: DerivativeTargets
) -> Float[Array, "derivatives *outputs"]:
    near, local = _checked_basis(force_map, state)
    return local.derivatives(targets, near.force)


@eqx.filter_jit
def _left_out(log_parameters: Float[Array, " parameters"], nodes: Nodes, rule: Rule) -> Float[Array, "n *outputs"]:
    errors = errors_within(*with_parameters(log_parameters, nodes, rule), jnp.arange(len(nodes)))
    return errors.reshape(nodes.force.shape)


@eqx.filter_jit
def _standard_error(
    force_map: RKPM, state: Float[Array, " dim"], targets: DerivativeTargets
) -> Float[Array, "*outputs"]:
    near, local = _checked_basis(force_map, state)
    return standard_error_at(local, near, targets)


def _checked_basis(force_map: RKPM, state: Float[Array, " dim"]) -> tuple[Neighbourhood, LocalBasis]:
    nodes, rule = force_map.nodes, force_map.rule
    near = nearest_nodes(nodes, state, gathered_nodes(rule.neighbours, len(nodes)), rule.across)
    local = basis_at(near, nodes.scale, rule, state)
    singular = ~(local.conditioning >= SINGULAR)  # also where no node lies in the region, and it is no number
    return near, local._replace(r=eqx.error_if(local.r, singular, degenerate_message(nodes, rule)))
