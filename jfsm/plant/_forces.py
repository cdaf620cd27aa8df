"""Forces of a plant in a state, and the rates and bounds of its hidden states.

x and v are displacement and velocity (dof,), z the hidden states (hidden,) of all memory slots in a row. The functions
are jitted so that a step, which calls them many times, traces them once.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._types import Array
from ._plant import Plant, hidden_width

State = Float[Array, " dof"]
Hidden = Float[Array, " hidden"]
Modes = Float[Array, " slots"]
Square = Float[Array, "dof dof"]
Scalar = Float[Array, ""]


@eqx.filter_jit
def smooth_force(plant: Plant, x: State, v: State, z: Hidden, t: Scalar) -> State:
    """Restoring force of the linear part, smooth laws, maps and memory laws: no inertia, friction or delayed force."""
    total = jnp.sum(plant.stiffness * x[None, :], 1) + jnp.sum(plant.damping * v[None, :], 1)
    slots = plant.smooth
    for i in range(len(slots)):
        d, w = slots.motion(i, x, v)
        total = total + slots.direction[i] * slots.choose(i, lambda law, d=d, w=w: law.force(d, w, (), t))
    for slot in plant.maps:
        row = slot.direction
        total = total + row * slot.force_map(jnp.stack([jnp.sum(row * x), jnp.sum(row * v)]))
    slots = plant.memory
    for i in range(len(slots)):
        (d, w), mine = slots.motion(i, x, v), _own(plant, z, i)
        force = slots.choose(i, lambda law, d=d, w=w, mine=mine: law.force(d, w, mine[: law.states], t))
        total = total + slots.direction[i] * force
    return total


@eqx.filter_jit
def hidden_rate(plant: Plant, x: State, v: State, z: Hidden, t: Scalar, base: Scalar) -> Hidden:
    """Rate of the hidden states; `base` is the acceleration of the base."""

    def rate(law, d, w, mine):
        rates = law.state_rate(d, w, mine[: law.states], t)
        return _padded(rates - jnp.asarray(law.base) * base if law.base else rates, mine)

    found = _each(plant, x, v, z, rate)
    if not has_parts_behind(plant):
        return found
    # What a function knows of the mass behind a spring, its weight say, acts on that mass.
    is_behind, mass = parts_behind(plant)
    pulled = jnp.sum(plant.memory.direction * function_force(plant, x, v, z, t)[None, :], 1)
    slower = jnp.where(is_behind > 0, pulled / jnp.where(is_behind > 0, mass, 1.0), 0.0)
    width = hidden_width(plant.memory)
    return found - (slower[:, None] * (jnp.arange(width) == 1)[None, :]).reshape(-1)


def has_parts_behind(plant: Plant) -> bool:
    """Whether a plant of its own motion has laws that may take inertia of the place where they act."""
    own = plant.own is not None or plant.local is not None
    return own and len(plant.memory) > 0 and any(law.takes for law in plant.memory.laws)


def parts_behind(plant: Plant) -> tuple[Modes, Modes]:
    """Whether the law of each memory slot takes inertia, 1 or 0, and how much."""
    slots = plant.memory
    which = np.zeros((len(slots.laws), slots.parameters.shape[1]))
    for row, law in zip(which, slots.laws, strict=True):
        row[[p.name for p in law.parameters].index(law.takes) if law.takes else []] = 1.0
    mine = jnp.asarray(which)[slots.kind]
    return jnp.sum(mine, 1), jnp.sum(mine * slots.parameters, 1)


def function_force(plant: Plant, x: State, v: State, z: Hidden, t: Scalar) -> State:
    """Force that all but the inertia of a plant of its own motion needs where the parts behind springs are."""
    slots, (is_behind, _) = plant.memory, parts_behind(plant)
    for i in range(len(slots)):
        (d, w), mine, row = slots.motion(i, x, v), _own(plant, z, i), slots.direction[i] * is_behind[i]
        x, v = x + row * (mine[0] - d), v + row * (mine[1] - w)
    if plant.local is not None:
        return plant.local.force_at(x, v, t)
    assert plant.own is not None
    free = plant.own(plant.own_numbers, x, v, jnp.zeros_like(x), t)
    return -jnp.linalg.solve(plant.own.answer(plant.own_numbers, x, v, t), free)


def force_in_front(plant: Plant, force: State) -> State:
    """Of the force that a function needs, what acts on the masses in front of springs."""
    rows = plant.memory.direction * parts_behind(plant)[0][:, None]
    return force - jnp.sum(rows * jnp.sum(rows * force[None, :], 1)[:, None], 0)


def carried(plant: Plant) -> Float[Array, "hidden dof"]:
    """Change of the hidden states per jump of the velocities: an attached mass jumps with the mass that carries it, as
    it does with the base."""
    slots, known = plant.memory, np.zeros((len(plant.memory.laws), hidden_width(plant.memory)))
    for row, law in zip(known, slots.laws, strict=True):
        row[: len(law.base)] = law.base
    return (jnp.asarray(known)[slots.kind][:, :, None] * slots.direction[:, None, :]).reshape(plant.hidden, plant.dof)


@eqx.filter_jit
def hidden_start(plant: Plant, x: State, v: State) -> Hidden:
    """Relaxed hidden states in a state."""
    z = jnp.zeros(plant.hidden)
    return _each(plant, x, v, z, lambda law, d, w, mine: _padded(law.initial_state(d, w), mine))


@eqx.filter_jit
def settle(plant: Plant, x: State, z: Hidden) -> Hidden:
    """Hidden states, projected to their bounds."""
    return _each(plant, x, x, z, lambda law, d, w, mine: _padded(law.settle(d, mine[: law.states]), mine))


@eqx.filter_jit
def friction_limits(plant: Plant, x: State, v: State, t: Scalar) -> tuple[Modes, Modes]:
    """Sliding force backward and forward of every friction slot; their bounds while sticking."""
    slots = plant.friction
    limits = []
    for i in range(len(slots)):
        d, w = slots.motion(i, x, v)
        limits.append(slots.choose(i, lambda law, d=d, w=w: jnp.stack(law.limits(d, w, (), t))))
    low, high = jnp.stack(limits, 1)
    return low, high


def _own(plant: Plant, z: Hidden, slot: int) -> Hidden:
    width = hidden_width(plant.memory)
    return z[slot * width : (slot + 1) * width]


def _padded(values, mine):
    return jnp.concatenate([values, jnp.zeros(mine.size - values.size)])


def _each(plant: Plant, x: State, v: State, z: Hidden, ask) -> Hidden:
    slots = plant.memory
    found = []
    for i in range(len(slots)):
        (d, w), mine = slots.motion(i, x, v), _own(plant, z, i)
        found.append(slots.choose(i, lambda law, d=d, w=w, mine=mine: ask(law, d, w, mine)))
    return jnp.concatenate(found) if found else jnp.zeros(0)
