"""The force that laws exert along a given motion."""

from dataclasses import replace

import jax
import jax.numpy as jnp
from jaxtyping import Float

from .._traced import jit_kept
from .._types import Array
from ._forces import friction_limits, hidden_rate, hidden_start, settle, smooth_force
from ._grid import delayed_along
from ._plant import Plant
from ._stepper import runge_kutta

HIDDEN_SUBSTEPS = 4
"""Steps of a hidden state per sample; the motion is straight in between."""


@jit_kept
def force_along(
    plant: Plant,
    x: Float[Array, "n dof"],
    v: Float[Array, "n dof"],
    time: Float[Array, " n"],
    *,
    substeps: int = HIDDEN_SUBSTEPS,
) -> Float[Array, "n dof"]:
    """Force [N] of everything but the linear springs and dashpots along a motion; friction slides.

    A function of the plant's own has no part in it, also where it acts on masses behind springs.
    """
    step = time[1] - time[0]
    z = _hidden_along(replace(plant, own=None, local=None), x, v, time, step, substeps)

    def one(x, v, z, t):
        linear = jnp.sum(plant.stiffness * x[None, :], 1) + jnp.sum(plant.damping * v[None, :], 1)
        force = smooth_force(plant, x, v, z, t) - linear
        if len(plant.friction):
            low, high = friction_limits(plant, x, v, t)
            rows = plant.friction.direction
            speed = jnp.sum(rows * v[None, :], 1)
            force = force + jnp.sum(jnp.where(speed > 0, high, jnp.where(speed < 0, low, 0.0))[:, None] * rows, 0)
        return force

    force = jax.vmap(one)(x, v, z, time)
    return force + delayed_along(plant, x, v, time) if len(plant.delayed) else force


def _hidden_along(plant: Plant, x, v, time, step, substeps: int):
    if not plant.hidden:
        return jnp.zeros((x.shape[0], 0))
    zero = jnp.zeros(())

    def sample(z, inputs):
        x0, x1, v0, v1, t = inputs

        def rate(z, s):
            return hidden_rate(plant, x0 + s * (x1 - x0), v0 + s * (v1 - v0), z, t + s * step, zero)

        def substep(z, i):
            begin, end = i / substeps, (i + 1) / substeps
            after = runge_kutta(rate, z, step / substeps, (begin, (begin + end) / 2, end))
            return settle(plant, x0 + end * (x1 - x0), after), None

        return jax.lax.scan(substep, z, jnp.arange(substeps))[0], z

    last, z = jax.lax.scan(sample, hidden_start(plant, x[0], v[0]), (x[:-1], x[1:], v[:-1], v[1:], time[:-1]))
    return jnp.concatenate([z, last[None, :]])
