"""What the maps learned from scattered readings have in common: their nodes, the visited region, checked queries."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float
from numpy.typing import NDArray

from ._map import AbstractForceStateMap
from ._readings import within
from .rkpm.basis import MultiIndex
from .rkpm.nodes import Nodes


class AbstractScatteredMap(AbstractForceStateMap):
    """A map that keeps the readings it was learned from."""

    nodes: eqx.AbstractVar[Nodes]

    @property
    def dim(self) -> int:
        return self.nodes.dim

    @property
    def box(self) -> Float[Array, "2 dim"]:
        return jnp.stack([jnp.min(self.nodes.states, axis=0), jnp.max(self.nodes.states, axis=0)])

    def visited(self, states: ArrayLike) -> Bool[NDArray[np.bool_], " q"]:
        """Whether each state has a node within `Nodes.reach`.

        Elsewhere the map extrapolates, with errors 10 to 100 times larger.
        """
        scale = np.asarray(self.nodes.scale)
        return within(np.asarray(self.nodes.states) / scale, float(self.nodes.reach), self._states(states) / scale)

    def _orders(self, orders: Any, highest: int) -> MultiIndex:
        """One derivative as a multi-index, of total order `highest` at most."""
        orders = tuple(orders)
        whole = all(isinstance(o, int | np.integer) and o >= 0 for o in orders)
        if len(orders) != self.dim or not whole or sum(orders) > highest:
            raise ValueError(
                f"`orders` must be {self.dim} integers from 0, one per column, that sum to the map's order "
                f"{highest} at most; got {orders!r}."
            )
        return tuple(int(o) for o in orders)


def whole_number(value: Any, name: str, least: int) -> int:
    """A checked integer argument of a fit.

    Raises
    ------
    ValueError
        If `value` is no integer of at least `least`.
    """
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
        raise ValueError(f"`{name}` must be an integer of {least} or more; got {value!r}.")
    return int(value)
