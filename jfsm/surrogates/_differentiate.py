"""Mixed derivatives of a function of one state, by forward mode once per order."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .rkpm.basis import MultiIndex

Function = Callable[[Float[Array, " dim"]], Array]


def mixed_derivative(function: Function, orders: MultiIndex) -> Function:
    """The function differentiated ``orders[axis]`` times along each axis."""
    for axis, times in enumerate(orders):
        for _ in range(times):
            function = _partial(function, axis)
    return function


def _partial(function: Function, axis: int) -> Function:
    def slope(state: Float[Array, " dim"]) -> Array:
        return jax.jvp(function, (state,), (jnp.zeros_like(state).at[axis].set(1.0),))[1]

    return slope
