"""Free runs on the sample grid, many parameter sets at once."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ._plant import Plant
from ._stepper import Load, Motion, acceleration, advance, inverse_mass, mode_at

_UNROLLED = 4
"""Substeps up to which a smooth step is written out: faster to run, still quick to compile."""


class Fine(eqx.Module):
    """What drives a run between consecutive samples: forces on half steps.

    `force` (n, 2 substeps + 1, dof) belongs to the interval after each sample, `base` (n, 2 substeps + 1) is the
    acceleration of the base.
    """

    force: Float[Array, "n halves dof"]
    base: Float[Array, "n halves"]
    time: Float[Array, " n"]
    step: Float[Array, ""]

    @property
    def substeps(self) -> int:
        return (self.force.shape[1] - 1) // 2


def true_force(
    plant: Plant, force: Float[Array, "halves dof"], base: Float[Array, " halves"]
) -> Float[Array, "halves dof"]:
    """Force on the masses from the measured one: gain and offset of its sensor undone, the base's inertia added."""
    inertia = jnp.sum(plant.mass, 1)
    measured = (force - plant.force_offset[None, :]) / (1.0 + plant.force_gain)[None, :]
    return measured - base[:, None] * inertia[None, :]


def advance_sample(plant: Plant, minv, motion: Motion, force, time, step) -> Motion:
    """Motion one sample later; `force` (2 substeps + 1, dof) is the true force on half steps."""
    substeps = (force.shape[0] - 1) // 2
    h = step / substeps
    if substeps <= _UNROLLED and not len(plant.friction):
        for i in range(substeps):
            motion = advance(plant, minv, motion, Load(force[2 * i : 2 * i + 3], time + i * h, h))
        return motion
    triples = jnp.stack([force[:-2:2], force[1:-1:2], force[2::2]], 1)

    def body(motion, inputs):
        triple, i = inputs
        return advance(plant, minv, motion, Load(triple, time + i * h, h)), None

    return jax.lax.scan(body, motion, (triples, jnp.arange(substeps)))[0]


@eqx.filter_jit
def run_grid(plant: Plant, fine: Fine, x0: Float[Array, " dof"], v0: Float[Array, " dof"]):
    """Displacement, velocity and acceleration (relative to the base) at every sample, each (n, dof)."""
    minv = inverse_mass(plant)

    def body(motion, inputs):
        force, base, time = inputs
        g = true_force(plant, force, base)
        a = acceleration(plant, minv, motion.x, motion.v, motion.mode, g[0], time)[0]
        return advance_sample(plant, minv, motion, g, time, fine.step), (motion.x, motion.v, a)

    first = true_force(plant, fine.force[0], fine.base[0])[0]
    start = Motion(x0, v0, mode_at(plant, minv, x0, v0, first, fine.time[0]))
    return jax.lax.scan(body, start, (fine.force, fine.base, fine.time))[1]
