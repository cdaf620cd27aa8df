"""Force state map by moving least squares."""

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from .._types import is_traced
from ._differentiate import mixed_derivative
from ._scattered import AbstractScatteredMap
from .rkpm.basis import MultiIndex
from .rkpm.interfaces import Interface
from .rkpm.nodes import Nodes
from .rkpm.rkpm import RKPM
from .rkpm.windows import AbstractWindow, QuarticSplineWindow

BATCH = 64
"""States whose neighbourhoods are held at once."""


class MovingLeastSquares(AbstractScatteredMap):
    """Moving least squares map; build it with `MovingLeastSquares.fit`.

    Notes
    -----
    With the same window its values are those of `RKPM`: the correction function of the kernel and the normal equations
    of the local fit are the same [1]_. Derivatives are those of the map itself: they belong to its value everywhere,
    while those of `RKPM` are read off the local polynomial, nearer to a smooth truth and much cheaper.

    References
    ----------
    .. [1] T. Belytschko et al., Comput. Methods Appl. Mech. Engrg. 139 (1996) 3-47.
    """

    values: RKPM
    """Its derivatives are not those of this map."""

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
    ) -> "MovingLeastSquares":
        """Map through readings of the restoring force; the arguments and errors are those of `RKPM.fit`.

        The window is `QuarticSplineWindow` when None.
        """
        window = QuarticSplineWindow() if window is None else window
        values = RKPM.fit(states, force, order, neighbours, window, dilation, across)
        return cls(values)  # pyright: ignore[reportCallIssue]  (takes the property `nodes` for a field)

    @property
    def nodes(self) -> Nodes:
        return self.values.nodes

    def __call__(self, state: ArrayLike) -> Float[Array, "*outputs"]:
        """Restoring force at one state; a RuntimeError where the nodes around it are in degenerate position."""
        return self.values(state)

    def gradient(self, state: ArrayLike) -> Float[Array, "*outputs dim"]:
        """First derivatives of the map at one state."""
        return _gradient(self.values, self._state(state))

    def derivative(self, state: ArrayLike, orders: tuple[int, ...]) -> Float[Array, "*outputs"]:
        """Derivative of the map at one state; ``orders=(2, 0)`` is the second one in the first column.

        The window has two continuous derivatives: from the third on they jump at the edge of every node's support.
        """
        return _derivative(self.values, self._state(state), self._orders(orders, self.values.rule.order))

    def std(self, state: ArrayLike) -> Float[Array, "*outputs"]:
        """Standard error of the force at one state, as `RKPM.std`."""
        return self.values.std(state)

    def evaluate_derivatives(
        self, states: ArrayLike, orders: Sequence[MultiIndex]
    ) -> Float[Array, "q derivatives *outputs"]:
        """Several derivatives at many states; the force itself is evaluated as fast as that of `RKPM`."""
        checked = [self._orders(one, self.values.rule.order) for one in orders]
        states = states if is_traced((states, self)) else self._states(states)
        columns = []
        for one in checked:
            if any(one):
                columns.append(_many_derivatives(self.values, jnp.asarray(states), one))
            else:
                columns.append(self.values.evaluate(states))
        return jnp.stack(columns, axis=1)


@eqx.filter_jit
def _gradient(values: RKPM, state: Float[Array, " dim"]) -> Float[Array, "*outputs dim"]:
    return jax.jacfwd(values)(state)


@eqx.filter_jit
def _derivative(values: RKPM, state: Float[Array, " dim"], orders: MultiIndex) -> Float[Array, "*outputs"]:
    return mixed_derivative(values, orders)(state)


@eqx.filter_jit
def _many_derivatives(values: RKPM, states: Float[Array, "q dim"], orders: MultiIndex) -> Float[Array, "q *outputs"]:
    return jax.lax.map(mixed_derivative(values, orders), states, batch_size=min(BATCH, max(len(states), 1)))
