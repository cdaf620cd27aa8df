"""Lines and surfaces across which a map may jump or kink: nodes on the other side do not count."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float, Int
from numpy.typing import NDArray

from ..._types import as_array, as_scalar

Interface = Callable[[Float[Array, " dim"]], Float[Array, ""]]
"""A function of one state, traceable, whose sign tells the two sides apart; zero belongs to the positive side."""


class Plane(eqx.Module):
    """Point, line or plane ``normal · state = offset``.

    Parameters
    ----------
    normal : (dim,) float array
        ``(1, 0)`` for the line x = offset, ``(0, 1)`` for v = offset.
    offset : float
        In the unit of ``normal · state``.
    """

    normal: Float[Array, " dim"]
    offset: Float[Array, ""]

    def __init__(self, normal: Any, offset: Any = 0.0):
        self.normal = normal if isinstance(normal, Tracer) else jnp.asarray(as_array(normal, "normal", 1))
        if not isinstance(normal, Tracer) and not np.any(np.asarray(normal)):
            raise ValueError("`normal` must not be zero: it gives the direction across the interface.")
        self.offset = as_scalar(offset)

    def __call__(self, state: Float[Array, " dim"]) -> Float[Array, ""]:
        return self.normal @ state - self.offset


def region(state: Float[Array, " dim"], across: Sequence[Interface]) -> Int[Array, ""]:
    """Number of the subdomain Ω of eq. 47 that holds a state: one binary digit per interface."""
    number = jnp.zeros((), dtype=int)
    for digit, level in enumerate(across):
        number = number + 2**digit * (level(state) >= 0.0)
    return number


def regions(states: Any, across: Sequence[Interface]) -> NDArray[np.intp]:
    """`region` of many states, on the host."""
    if not across:
        return np.zeros(len(states), dtype=np.intp)
    return np.asarray(jax.vmap(lambda state: region(state, across))(jnp.asarray(states)))


def as_interfaces(across: Any, dim: int) -> tuple[Interface, ...]:
    """Checked interfaces.

    Raises
    ------
    TypeError, ValueError
        If one is no function of a state that returns one number.
    """
    if not isinstance(across, Iterable) or isinstance(across, jax.Array | str):
        raise TypeError(
            f"`across` must be a list of functions of one state such as Plane((1, 0), 0.0); got {across!r}."
        )
    found = tuple(across)
    for level in found:
        if not callable(level):
            raise TypeError(f"`across` must hold functions of one state such as Plane((1, 0), 0.0); got {level!r}.")
        try:
            shape = jax.eval_shape(level, jax.ShapeDtypeStruct((dim,), jnp.float64)).shape
        except TypeError as error:
            raise ValueError(f"`across` must hold functions of one state of {dim} columns: {error}") from error
        if shape != ():
            raise ValueError(f"`across` must hold functions that return one number; one returned shape {shape}.")
    return found
