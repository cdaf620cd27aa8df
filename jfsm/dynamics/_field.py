"""A structure left to itself: its right-hand side as a function of the state alone, and what forbids one."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from .._types import as_array
from ..plant import Plant, free_acceleration, inverse_mass, lower, smooth_force
from ..structures import AbstractFriction, AbstractTerm, Structure
from ..surrogates import HermiteTable

_TIMES = np.concatenate([[0.0], np.geomspace(1e-3, 1e7, 40), -np.geomspace(1e-3, 1e7, 40)])
"""Instants [s] at which a force that does not depend on time must be the same to the last bit."""
_PROBES = 4


class Field(eqx.Module):
    """Right-hand side of y' = F(y), y = (x, v), under a constant force.

    It is data: one compiled program serves all structures of a class.
    """

    plant: Plant
    minv: Float[Array, "dof dof"]
    load: Float[Array, " dof"]

    @property
    def dof(self) -> int:
        return self.plant.dof

    @property
    def mass(self) -> Float[Array, "dof dof"]:
        return self.plant.mass

    def __call__(self, state: Float[Array, " n"]) -> Float[Array, " n"]:
        """Rate of the state."""
        x, v = jnp.split(state, 2)
        return jnp.concatenate([v, self._acceleration(x, v)])

    def _acceleration(self, x: Float[Array, " dof"], v: Float[Array, " dof"]) -> Float[Array, " dof"]:
        return free_acceleration(self.plant, self.minv, x, v, jnp.zeros(0), self.load, jnp.zeros(()))

    def force(self, x: Float[Array, " dof"], v: Float[Array, " dof"]) -> Float[Array, " dof"]:
        """What the terms leave of the constant force, zero at a point of rest [N].

        Of a plant with its own motion: what moves its masses at rest as it moves.
        """
        if self.plant.own is not None:
            return -self.mass @ self._acceleration(x, v)
        return smooth_force(self.plant, x, v, jnp.zeros(0), jnp.zeros(())) - self.load

    def visited(self, state: Float[Array, " n"]) -> Bool[Array, ""]:
        """Whether every learned map was fitted where this state lies."""
        x, v = jnp.split(state, 2)
        inside = jnp.ones((), bool)
        for slot in self.plant.maps:
            if isinstance(slot.force_map, HermiteTable):
                inside &= slot.force_map.inside(jnp.sum(slot.direction * x), jnp.sum(slot.direction * v))
        return inside


def autonomous_field(model: Structure, force: Any = None) -> Field:
    """Right-hand side of a structure under a constant force [N], none unless given.

    Raises
    ------
    ValueError
        If a mass is zero, a term sticks, remembers the past or depends on time, or `force` has the wrong shape.
    """
    masses = np.asarray(model.mass)
    if masses.ndim == 1 and np.any(masses == 0):
        raise ValueError(
            f"`mass` must be positive for the structure to move; got {masses.tolist()}. Give every mass its value."
        )
    for term in model.terms:
        if isinstance(term, AbstractFriction):
            raise ValueError(
                f"`model` must hold no friction that sticks: {_name(term)} holds it at rest anywhere within its "
                "limits, so its points of rest are a continuum, and its force has no slope there. "
                "Leave it out with `model.without(term)`."
            )
        if term.states or term.delay is not None:
            raise ValueError(
                f"`model` must answer the present displacement and velocity alone; {_name(term)} remembers the past. "
                "Leave it out with `model.without(term)`, or follow the motion with `jfsm.simulate`."
            )
    plant = lower(model)
    if _depends_on_time(plant):
        culprits = (_name(t) for t in model.terms if _depends_on_time(lower(Structure(model.mass, [t]))))
        raise ValueError(
            f"`model` must not depend on time; the force of {next(culprits, 'its own function')} does. "
            "Leave it out with `model.without(term)`, or follow the motion with `jfsm.simulate`."
        )
    load = np.zeros(model.dof) if force is None else as_array(force, "force", (0, 1))
    load = np.atleast_1d(load)
    if load.shape != (model.dof,):
        raise ValueError(f"`force` must hold one constant force per degree of freedom ({model.dof}); got {load.size}.")
    return Field(plant, inverse_mass(plant), jnp.asarray(load))


def _name(term: AbstractTerm) -> str:
    return f"{term.kind}@{term.place}"


def _present_force(plant: Plant, x, v, t):
    force = smooth_force(plant, x, v, jnp.zeros(plant.hidden), t)
    return force if plant.own is None else plant.own(plant.own_numbers, x, v, -force, t)


@eqx.filter_jit
def _forces(plant: Plant, x, v, times):
    at_all_times = jax.vmap(_present_force, (None, None, None, 0))
    return jax.vmap(lambda x, v: at_all_times(plant, x, v, times))(x, v)


def _depends_on_time(plant: Plant) -> bool:
    # Values, not slopes: the force of a spring that breaks at one instant has no slope in time.
    x, v = np.random.default_rng(0).normal(size=(2, _PROBES, plant.dof))
    forces = np.asarray(_forces(plant, x, v, _TIMES))
    return not np.array_equal(forces, np.broadcast_to(forces[:, :1], forces.shape), equal_nan=True)
