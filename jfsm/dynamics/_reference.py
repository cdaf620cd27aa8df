"""Free runs at a stated tolerance by diffrax, for structures that neither stick nor answer the past."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..plant import (
    InterpolatedInput,
    Plant,
    free_acceleration,
    hidden_rate,
    hidden_start,
    inverse_mass,
    true_force,
    undelayed,
)

STEPS_OF_DRIVE = 16
"""Steps per sample at least on which the drive is given. Between the half steps of 16 a sine with two samples a period
is off by 1e-7, and one with ten by 1e-11."""
_STEPS_PER_SAMPLE = 200
_NODES = np.arange(6.0)
"""Half steps that one value of the drive is made of."""
_OTHERS = ~np.eye(6, dtype=bool)
_SCALES = 1.0 / np.array([np.prod((k - _NODES)[_OTHERS[i]]) for i, k in enumerate(_NODES)])


@eqx.filter_jit
def run_reference(plant: Plant, inputs: InterpolatedInput, x0, v0, tolerance, scale):
    """Displacement and velocity at every sample, each (n, dof), the hidden states, and whether the end was reached.

    `scale` is the size of the motion that `tolerance` is relative to. Step control finds knots and jumps by itself.
    Between its half steps the drive is the quintic through the six nearest of the same sample.
    """
    minv = inverse_mass(plant)
    inputs = undelayed(plant, inputs)
    n, halves, dof = inputs.force.shape
    forces = true_force(plant, inputs.force.reshape(n * halves, -1), inputs.base.reshape(-1)).reshape(
        inputs.force.shape
    )
    drive = jnp.concatenate([forces, inputs.base[..., None]], 2)

    def slope(t, state, _):
        x, v, z = state
        place = jnp.clip((t - inputs.time[0]) / inputs.step, 0.0, n - 1e-9)
        k = jnp.floor(place).astype(int)
        inner = (place - k) * (halves - 1)
        first = jnp.clip(jnp.floor(inner).astype(int) - 2, 0, halves - 6)
        near = jax.lax.dynamic_slice(drive, (k, first, 0), (1, 6, dof + 1))[0]
        driving = jnp.sum(_quintic_weights(inner - first)[:, None] * near, 0)
        a = free_acceleration(plant, minv, x, v, z, driving[:dof], t)
        return v, a, hidden_rate(plant, x, v, z, t, driving[dof])

    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(slope),
        diffrax.Tsit5(),
        t0=inputs.time[0],
        t1=inputs.time[-1],
        dt0=inputs.step / inputs.substeps,
        y0=(x0, v0, hidden_start(plant, x0, v0)),
        saveat=diffrax.SaveAt(ts=inputs.time),
        stepsize_controller=diffrax.PIDController(rtol=tolerance, atol=tolerance * scale),
        max_steps=_STEPS_PER_SAMPLE * n,
        throw=False,
    )
    assert solution.ys is not None
    x, v, z = solution.ys
    return x, v, z, solution.result == diffrax.RESULTS.successful


def _quintic_weights(place, xp=jnp):
    """Weights (6,) of values at 0, 1, … 5 in that of the quintic through them at `place`, by Lagrange."""
    distances = xp.where(_OTHERS, (place - _NODES)[None, :], 1.0)
    return xp.prod(distances, axis=1) * _SCALES


def coarser(inputs: InterpolatedInput) -> InterpolatedInput:
    """The same drive known on every second half step only; in between the quintic through the six nearest of these.

    Where the reconstruction is smooth it is off by 64 times as much as `inputs` itself.
    """
    halves = inputs.force.shape[1]
    few = np.arange(0, halves, 2)
    thin = np.zeros((halves, halves))
    thin[few, few] = 1.0
    for node in range(1, halves, 2):
        first = min(max(node // 2 - 2, 0), few.size - 6)
        thin[node, few[first : first + 6]] = _quintic_weights(node / 2 - first, np)
    force = np.einsum("ij,njd->nid", thin, np.asarray(inputs.force), optimize=True)
    base = np.asarray(inputs.base) @ thin.T
    return InterpolatedInput(jnp.asarray(force), jnp.asarray(base), inputs.time, inputs.step)
