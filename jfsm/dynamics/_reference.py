"""Free runs at a stated tolerance by diffrax, for structures that neither stick nor answer the past."""

import diffrax
import equinox as eqx
import jax.numpy as jnp

from ._forces import hidden_rate, hidden_start, smooth_force
from ._grid import Fine, punctual, true_force
from ._plant import Plant
from ._stepper import inverse_mass

_STEPS_PER_SAMPLE = 200


@eqx.filter_jit
def run_reference(plant: Plant, fine: Fine, x0, v0, tolerance, scale):
    """Displacement and velocity at every sample, each (n, dof), the hidden states, and whether the end was reached.

    `scale` is the size of the motion that `tolerance` is relative to. Step control finds knots and jumps by itself.
    """
    minv = inverse_mass(plant)
    fine = punctual(plant, fine)
    n, halves, _ = fine.force.shape
    forces = true_force(plant, fine.force.reshape(n * halves, -1), fine.base.reshape(-1)).reshape(fine.force.shape)

    def slope(t, state, _):
        x, v, z = state
        # The parabola through the half steps of the interval that holds t, as on the grid.
        place = jnp.clip((t - fine.time[0]) / fine.step, 0.0, n - 1e-9)
        k = jnp.floor(place).astype(int)
        inner = (place - k) * fine.substeps
        i = jnp.minimum(jnp.floor(inner).astype(int), fine.substeps - 1)
        s = inner - i
        a, b, c = forces[k, 2 * i], forces[k, 2 * i + 1], forces[k, 2 * i + 2]
        g = a + s * (4 * b - 3 * a - c) + 2 * s * s * (a + c - 2 * b)
        a, b, c = fine.base[k, 2 * i], fine.base[k, 2 * i + 1], fine.base[k, 2 * i + 2]
        base = a + s * (4 * b - 3 * a - c) + 2 * s * s * (a + c - 2 * b)
        acceleration = jnp.sum(minv * (g - smooth_force(plant, x, v, z, t))[None, :], 1)
        return v, acceleration, hidden_rate(plant, x, v, z, t, base)

    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(slope),
        diffrax.Tsit5(),
        t0=fine.time[0],
        t1=fine.time[-1],
        dt0=fine.step / fine.substeps,
        y0=(x0, v0, hidden_start(plant, x0, v0)),
        saveat=diffrax.SaveAt(ts=fine.time),
        stepsize_controller=diffrax.PIDController(rtol=tolerance, atol=tolerance * scale),
        max_steps=_STEPS_PER_SAMPLE * n,
        throw=False,
    )
    assert solution.ys is not None
    x, v, z = solution.ys
    return x, v, z, solution.result == diffrax.RESULTS.successful
