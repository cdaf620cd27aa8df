"""A plant that moves by a function of its own: what is linear in it, and the force that a motion needs."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._types import Array
from ._forces import Square, State
from ._plant import Plant


def linear_part(plant: Plant) -> Plant:
    """The plant with springs and dashpots that answer a small motion about rest as its own function does.

    A plant without such a function is given back.
    """
    if plant.own is None:
        return plant
    by_motion = [np.asarray(slope) for slope in _slopes(plant, jnp.zeros(plant.dof))]
    spring, dashpot = (-np.asarray(plant.mass) @ slope for slope in by_motion)
    return replace(plant, stiffness=plant.stiffness + spring, damping=plant.damping + dashpot)


@eqx.filter_jit
def _slopes(plant: Plant, rest: State) -> tuple[Square, Square]:
    """Derivatives of the accelerations at rest by displacement and velocity."""
    assert plant.own is not None
    return jax.jacfwd(plant.own, (1, 2))(plant.own_numbers, rest, rest, rest, jnp.zeros(()))


@eqx.filter_jit
def own_force(
    plant: Plant,
    x: Float[Array, "n dof"],
    v: Float[Array, "n dof"],
    a: Float[Array, "n dof"],
    time: Float[Array, " n"],
) -> tuple[Float[Array, "n dof"], Float[Array, "n dof dof"], Float[Array, "n dof own"]]:
    """Force (n, dof) that a plant of its own motion needs for accelerations `a` (n, dof) along a motion.

    With its derivatives (n, dof, dof) by the accelerations, which are the mass matrices, and (n, dof, own) by the
    logarithms of the plant's numbers.
    """
    own = plant.own
    assert own is not None

    def needed(numbers, x, v, a, t):
        mass = jnp.linalg.inv(own.answer(numbers, x, v, t))
        return mass @ (a - own(numbers, x, v, jnp.zeros_like(x), t)), mass

    def along(x, v, a, t):
        def scaled(log):
            return needed(plant.own_numbers * jnp.exp(log), x, v, a, t)[0]

        return *needed(plant.own_numbers, x, v, a, t), jax.jacfwd(scaled)(jnp.zeros_like(plant.own_numbers))

    return jax.vmap(along)(x, v, a, time)
