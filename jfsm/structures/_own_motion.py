"""How a plant moves that is given as a function."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

Acceleration = Callable[..., Any]


class OwnMotion(NamedTuple):
    """A function for the acceleration (dof,), and the names of its numbers."""

    function: Acceleration
    names: tuple[str, ...]

    def __call__(self, numbers: Float[Array, " own"], q: Any, v: Any, force: Any, t: Any) -> Float[Array, " dof"]:
        parameters = {name: numbers[i] for i, name in enumerate(self.names)}
        return jnp.asarray(self.function(q, v, force, t, parameters))

    def answer(self, numbers: Float[Array, " own"], q: Any, v: Any, t: Any) -> Float[Array, "dof dof"]:
        """Accelerations per unit of force, one force per column: the inverse of the mass matrix."""
        return jax.jacfwd(lambda force: self(numbers, q, v, force, t))(jnp.zeros_like(q))
