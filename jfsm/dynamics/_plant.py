"""A structure lowered to arrays: what a compiled program sees of it.

A program is keyed by the number of degrees of freedom, of slots and of channels, and by the table of laws, never by
which law of the table stands in a slot, by its place, sign or values: those are data.
"""

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..structures import (
    FRICTION_TERMS,
    SMOOTH_TERMS,
    AbstractFriction,
    LinearDamping,
    LinearStiffness,
    MapTerm,
    Offset,
    Structure,
)

Channel = tuple[str, int]

LAW_PARAMETERS = 4
"""Width of a slot's row of numbers; laws with fewer leave the rest at zero."""


class Slots(eqx.Module):
    """Places for laws of one class, in one compiled program whatever stands in them.

    An empty slot has direction zero and acts on nothing.
    """

    kind: Int[Array, " slots"]
    parameters: Float[Array, "slots width"]
    direction: Float[Array, "slots dof"]
    laws: tuple[type, ...] = eqx.field(static=True)

    def __len__(self) -> int:
        return self.kind.shape[0]

    def term(self, law: type, slot: int, parameters: Float[Array, " width"]) -> Any:
        """The term of this class that a row of numbers means."""
        return law(*(parameters[i] for i in range(len(law.parameters))), at=(0, 1))


class MapSlot(eqx.Module):
    """A learned map acting along one direction."""

    force_map: Any
    direction: Float[Array, " dof"]


class Plant(eqx.Module):
    """Arrays of a structure and of its sensors, for one list of response channels."""

    mass: Float[Array, "dof dof"]
    damping: Float[Array, "dof dof"]
    stiffness: Float[Array, "dof dof"]
    smooth: Slots
    friction: Slots
    maps: tuple[MapSlot, ...]
    force_gain: Float[Array, " dof"]
    force_offset: Float[Array, " dof"]
    channel_gain: Float[Array, " channels"]
    channel_offset: Float[Array, " channels"]

    @property
    def dof(self) -> int:
        return self.mass.shape[0]


class Readout(eqx.Module):
    """Which response each channel shows: its kind, and a row that selects the degree of freedom."""

    select: Float[Array, "channels dof"]
    kinds: tuple[str, ...] = eqx.field(static=True)


def readout(channels: Sequence[Channel], dof: int) -> Readout:
    """Selectors of the response channels (kind, degree of freedom)."""
    rows = np.zeros((len(channels), dof))
    for i, (_, j) in enumerate(channels):
        rows[i, j - 1] = 1.0
    return Readout(jnp.asarray(rows), tuple(kind for kind, _ in channels))


def direction(at: tuple[int, int], dof: int) -> np.ndarray:
    """Row B of a link: d = x_j - x_i, ground at rest."""
    row = np.zeros(dof)
    for index, sign in ((at[0], -1.0), (at[1], 1.0)):
        if index:
            row[index - 1] += sign
    return row


def lower(
    structure: Structure, channels: Sequence[Channel] = (), *, smooth_slots: int = 0, friction_slots: int = 0
) -> Plant:
    """Plant of a structure.

    Parameters
    ----------
    structure : Structure
    channels : sequence of (kind, degree of freedom)
        Response channels, in the order of the record.
    smooth_slots, friction_slots : int
        Least number of slots; more are made where the structure needs them.
    """
    dof = structure.dof
    mass = np.asarray(structure.mass)
    matrices = {LinearStiffness: np.zeros((dof, dof)), LinearDamping: np.zeros((dof, dof))}
    smooth, friction, maps = [], [], []
    for term in structure.terms:
        row = direction(term.at, dof)
        if isinstance(term, LinearStiffness | LinearDamping):
            matrices[type(term)] += float(term.values[0]) * np.outer(row, row)
        elif isinstance(term, MapTerm):
            maps.append(MapSlot(term.force_map, jnp.asarray(row)))
        else:
            (friction if isinstance(term, AbstractFriction) else smooth).append(term)
    force_gain, force_offset = np.zeros(dof), np.zeros(dof)
    channel_gain, channel_offset = np.zeros(len(channels)), np.zeros(len(channels))
    for sensor in structure.sensors:
        offset = isinstance(sensor, Offset)
        if sensor.at[0] == "force":
            (force_offset if offset else force_gain)[sensor.at[1] - 1] += sensor.value
        elif sensor.at in channels:
            (channel_offset if offset else channel_gain)[list(channels).index(sensor.at)] += sensor.value
    return Plant(
        mass=jnp.asarray(np.diag(mass) if mass.ndim == 1 else mass),
        damping=jnp.asarray(matrices[LinearDamping]),
        stiffness=jnp.asarray(matrices[LinearStiffness]),
        smooth=_slots(smooth, SMOOTH_TERMS, max(smooth_slots, len(smooth)), dof),
        friction=_slots(friction, FRICTION_TERMS, max(friction_slots, len(friction)), dof),
        maps=tuple(maps),
        force_gain=jnp.asarray(force_gain),
        force_offset=jnp.asarray(force_offset),
        channel_gain=jnp.asarray(channel_gain),
        channel_offset=jnp.asarray(channel_offset),
    )


def _slots(terms: list, laws: tuple[type, ...], count: int, dof: int) -> Slots:
    laws = laws + tuple(dict.fromkeys(type(term) for term in terms if type(term) not in laws))
    kind, parameters, directions = np.zeros(count, np.int32), np.zeros((count, LAW_PARAMETERS)), np.zeros((count, dof))
    for i, term in enumerate(terms):
        kind[i] = laws.index(type(term))
        parameters[i, : len(term.values)] = [float(value) for value in term.values]
        directions[i] = direction(term.at, dof)
    return Slots(jnp.asarray(kind), jnp.asarray(parameters), jnp.asarray(directions), laws)


def smooth_force(
    plant: Plant, x: Float[Array, " dof"], v: Float[Array, " dof"], t: Float[Array, ""]
) -> Float[Array, " dof"]:
    """Everything on the left-hand side but inertia and friction."""
    total = jnp.sum(plant.stiffness * x[None, :], 1) + jnp.sum(plant.damping * v[None, :], 1)
    slots = plant.smooth
    for i in range(len(slots)):
        row = slots.direction[i]
        branches = [lambda p, d, w, t, law=law, i=i: slots.term(law, i, p).force(d, w, (), t) for law in slots.laws]
        d, w = jnp.sum(row * x), jnp.sum(row * v)
        total = total + row * jax.lax.switch(slots.kind[i], branches, slots.parameters[i], d, w, t)
    for slot in plant.maps:
        row = slot.direction
        total = total + row * slot.force_map(jnp.stack([jnp.sum(row * x), jnp.sum(row * v)]))
    return total


def friction_limits(
    plant: Plant, x: Float[Array, " dof"], v: Float[Array, " dof"], t: Float[Array, ""]
) -> tuple[Float[Array, " slots"], Float[Array, " slots"]]:
    """Sliding force backward and forward of every friction slot; their bounds while sticking."""
    slots = plant.friction
    lower_limits, upper_limits = [], []
    for i in range(len(slots)):
        d, w = jnp.sum(slots.direction[i] * x), jnp.sum(slots.direction[i] * v)
        branches = [lambda p, d, w, t, law=law, i=i: slots.term(law, i, p).limits(d, w, (), t) for law in slots.laws]
        low, high = jax.lax.switch(slots.kind[i], branches, slots.parameters[i], d, w, t)
        lower_limits.append(low)
        upper_limits.append(high)
    return jnp.stack(lower_limits), jnp.stack(upper_limits)
