"""What is linear in a plant that moves by a function of its own."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ._forces import Square, State
from ._plant import Plant


def linear_part(plant: Plant) -> Plant:
    """The plant with springs and dashpots that answer a small motion about rest as its own function does.

    A plant without such a function is given back.
    """
    if plant.own is None:
        return plant
    by_motion = [np.asarray(slope) for slope in _slopes(plant, jnp.zeros(plant.dof))]
    spring, dashpot = (-np.asarray(plant.whole_mass) @ slope for slope in by_motion)
    return replace(plant, stiffness=plant.stiffness + spring, damping=plant.damping + dashpot)


@eqx.filter_jit
def _slopes(plant: Plant, rest: State) -> tuple[Square, Square]:
    """Derivatives of the accelerations at rest by displacement and velocity."""
    assert plant.own is not None
    return jax.jacfwd(plant.own, (1, 2))(plant.own_numbers, rest, rest, rest, jnp.zeros(()))
