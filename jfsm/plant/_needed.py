"""The force that an imposed motion needs.

The state is known, so nothing is integrated but the hidden states, along the motion itself. Friction slides with the
sign of the imposed speed; where the speed is smaller than its error, the force lies between both sides. An error of the
motion moves the force by its slopes; hidden states follow an error of the displacement as they follow the displacement.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Float

from .._types import Array
from ._forces import friction_limits, hidden_rate, hidden_start, settle, smooth_force
from ._grid import delayed_along, shifted
from ._imposed import Imposed
from ._plant import Observation, Plant
from ._stepper import runge_kutta

_NOTHING = 1e-300
"""Added under a root: unused hidden states are zero, and have no slope."""


class Needed(NamedTuple):
    """Force (n, dof) of a motion as its sensors read it, without their noise, and its uncertainty.

    `slopes` (n, force's dof, motion's dof, 3) are its derivatives by x, v and a, `besides` (n, dof) is the variance
    that the side to which friction acts and hidden states at the start leave.
    """

    force: Float[Array, "n dof"]
    slopes: Float[Array, "n dof dof 3"]
    besides: Float[Array, "n dof"]


@eqx.filter_jit
def force_needed(plant: Plant, observation: Observation, imposed: Imposed) -> Float[Array, "n dof"]:
    """Force (n, dof) of an imposed motion, hidden states relaxed at the start."""
    return needed(plant, observation, imposed, jnp.zeros(())).force


def needed(plant: Plant, observation: Observation, imposed: Imposed, doubt: Float[Array, ""]) -> Needed:
    """As `force_needed`, to be traced, with its error.

    `doubt` is the standard deviation of hidden states and of delayed forces at the start, as a share of their rms along
    the motion.
    """
    moved = _recentred(plant, observation, imposed)
    x, v, time = moved.x[:, 0], moved.v[:, 0], moved.time
    z0 = hidden_start(plant, x[0], v[0])
    push = jax.vmap(lambda e: jax.jvp(lambda z: _hidden_along(plant, moved, z), (z0,), (e,)), out_axes=(None, -1))
    z, by_start = push(jnp.eye(z0.size)) if z0.size else (jnp.zeros((*time.shape, 0)), jnp.zeros((*time.shape, 0, 0)))

    unknown = doubt * jnp.sqrt(jnp.mean(z**2, 0) + _NOTHING)

    def one(x, v, a, speed_std, z, by_start, t):
        force, (by_x, by_v, by_z) = _with_slopes(plant, x, v, z, t)
        if z0.size:
            by_x = by_x + by_z @ jax.jacfwd(lambda v: hidden_rate(plant, x, v, z, t, jnp.zeros(())))(v)
        besides = jnp.sum((by_z @ by_start * unknown[None, :]) ** 2, 1)
        if len(plant.friction):
            sliding, doubtful = _friction(plant, x, v, speed_std, t)
            force, besides = force + sliding, besides + doubtful
        return force + jnp.sum(plant.mass * a[None, :], 1), jnp.stack([by_x, by_v, plant.mass], -1), besides

    force, slopes, besides = jax.vmap(one)(x, v, moved.a, moved.speed_std, z, by_start, time)
    if len(plant.delayed):
        late, by_shift = _delayed(plant, x, v, time)
        force, slopes = force + late, slopes.at[..., 0].add(by_shift)
        before = _before_the_start(plant, time)
        besides = besides + doubt**2 * before[:, None] * jnp.mean(late**2, 0)[None, :]
    if plant.force_delay.size:
        places = -plant.force_delay / moved.step
        force, besides = (jax.vmap(shifted, in_axes=(1, 0), out_axes=1)(q, places) for q in (force, besides))
    gain = 1.0 + plant.force_gain
    return Needed(
        gain[None, :] * force + plant.force_offset[None, :],
        gain[None, :, None, None] * slopes,
        gain[None, :] ** 2 * jnp.maximum(besides, 0.0),
    )


def _recentred(plant: Plant, observation: Observation, imposed: Imposed) -> Imposed:
    """The motion without the offsets of its displacement channels."""
    rows = [i for i, kind in enumerate(observation.kinds) if kind == "displacement"]
    shift = sum((plant.channel_offset[i] * observation.select[i] for i in rows), jnp.zeros(plant.dof))
    return eqx.tree_at(lambda m: m.x, imposed, imposed.x - shift[None, None, :])


def _hidden_along(plant: Plant, imposed: Imposed, z0: Float[Array, " hidden"]) -> Float[Array, "n hidden"]:
    """Hidden states at every sample."""
    h = imposed.step / imposed.substeps

    def rate(z, node):
        x, v, t = node
        return hidden_rate(plant, x, v, z, t, jnp.zeros(()))

    def substep(z, inputs):
        nodes = tuple(tuple(q[i] for q in inputs) for i in range(3))
        return settle(plant, inputs[0][2], runge_kutta(rate, z, h, nodes, plant.rolled)), None

    def sample(z, inputs):
        return jax.lax.scan(substep, z, inputs)[0], z

    def by_steps(q):
        return jnp.stack([q[:, :-2:2], q[:, 1:-1:2], q[:, 2::2]], 2)

    instants = imposed.time[:, None] + h / 2 * jnp.arange(2 * imposed.substeps + 1)[None, :]
    return jax.lax.scan(sample, z0, (by_steps(imposed.x), by_steps(imposed.v), by_steps(instants)))[1]


def _with_slopes(plant: Plant, x, v, z, t):
    """Smooth force, without inertia, friction and delayed forces, and its slopes by x, v and z."""

    def force(x, v, z):
        total = smooth_force(plant, x, v, z, t)
        return total, total

    slopes, total = jax.jacfwd(force, argnums=(0, 1, 2), has_aux=True)(x, v, z)
    return total, slopes


def _friction(plant: Plant, x, v, speed_std, t):
    """Expected force (dof,) of the friction slots, and its variance: the side is certain but near a reversal."""
    rows = plant.friction.direction
    speed = jnp.sum(rows * v[None, :], 1)
    error = jnp.sqrt(jnp.sum((rows * speed_std[None, :]) ** 2, 1))
    known = error > 0
    by_error = jax.scipy.stats.norm.cdf(speed / jnp.where(known, error, 1.0))
    forward = jnp.where(known, by_error, 0.5 * (1.0 + jnp.sign(speed)))
    low, high = friction_limits(plant, x, v, t)
    force = forward * high + (1.0 - forward) * low
    variance = forward * (1.0 - forward) * (high - low) ** 2
    return jnp.sum(rows * force[:, None], 0), jnp.sum(rows**2 * variance[:, None], 0)


def _before_the_start(plant: Plant, time):
    """1 (n,) while a delayed force depends on the motion before the record, 0 afterwards, over one sample."""
    slots = plant.delayed
    longest = jnp.max(jnp.stack([slots.choose(i, lambda law: law.delay) for i in range(len(slots))]))
    return jnp.clip((longest - (time - time[0])) / (time[1] - time[0]), 0.0, 1.0)


def _delayed(plant: Plant, x, v, time):
    """Delayed force (n, dof), and its slope (n, dof, dof) by a shift of each degree of freedom."""
    along = jax.vmap(
        lambda e: jax.jvp(lambda s: delayed_along(plant, x + s[None, :], v, time), (jnp.zeros_like(e),), (e,)),
        out_axes=(None, -1),
    )
    return along(jnp.eye(plant.dof))
