"""Extended Kalman filter of a plant: what each sample says, given all before it.

The state is (x, v). Between samples the mean follows the plant itself (Runge-Kutta, true stick), the covariance its
linearisation. Channels are taken one after the other, so that no matrix is inverted and many filters run side by side.
The mode of friction is uncertain while the speed is smaller than its error: an acceleration is then judged under each
mode, and the most probable one is used (a max-mixture).
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..dynamics._grid import Fine, advance_sample, true_force
from ..dynamics._plant import Plant, Readout, friction_limits, smooth_force
from ..dynamics._stepper import Motion, acceleration, holding_force, inverse_mass, mode_at


class Readings(eqx.Module):
    """What a filter sees of a record.

    `values` (n, channels), `use` (n, channels) is 1 where a sample may update the state, `variance` (channels,) is
    the white noise of each channel, `valid` (n,) is false in the padding.
    """

    values: Float[Array, "n channels"]
    use: Float[Array, "n channels"]
    variance: Float[Array, " channels"]
    valid: Float[Array, " n"]


class ProcessNoise(eqx.Module):
    """Covariance (dof, dof) that every sample adds to that of the velocity.

    It is the same for all hypotheses: were it to follow a fitted mass or gain, a wrong hypothesis could buy itself
    noise with it.
    """

    velocity: Float[Array, "dof dof"]


class Start(eqx.Module):
    """Mean (dof,) and covariance (2 dof, 2 dof) of the state at the first sample."""

    x: Float[Array, " dof"]
    v: Float[Array, " dof"]
    covariance: Float[Array, "state state"]


class Innovations(NamedTuple):
    """Difference between reading and prediction, and its variance, each (n, channels)."""

    error: Float[Array, "n channels"]
    variance: Float[Array, "n channels"]


def _product(a, b):
    # As a sum of outer products: XLA fuses this into the loop, where a matrix product of this size would be a call.
    return jnp.sum(a[:, :, None] * b[None, :, :], 1)


def innovations(
    plant: Plant, show: Readout, fine: Fine, readings: Readings, noise: ProcessNoise, start: Start, log_scale
) -> Innovations:
    """Innovations of one filter run.

    `log_scale` (channels,) is the logarithm of the factor on each channel's noise variance. A sample with ``use = 0``
    is predicted, not used: a stretch of such samples is a free prediction with its own error bar.
    """
    minv = inverse_mass(plant)
    dof, dt = plant.dof, fine.step
    variances = readings.variance * jnp.exp(log_scale)
    added = jnp.zeros((2 * dof, 2 * dof)).at[dof:, dof:].set(noise.velocity)

    def body(carry, inputs):
        motion, covariance = carry
        force, base, time, y, use, valid = inputs
        g = true_force(plant, force, base)
        mean, updated, error, spread = _update(
            plant, minv, show, motion, covariance, g[0], base[0], time, y, use, variances
        )
        motion = Motion(mean[:dof], mean[dof:], _mode(plant, minv, motion, mean, g[0], time))
        after = advance_sample(plant, minv, motion, g, time, dt)
        step = _transition(plant, minv, motion, after, time, dt)
        propagated = _settle(plant, minv, _product(_product(step, updated), step.T) + added, after.mode)
        keep = valid > 0
        after = Motion(*(jnp.where(keep, new, old) for new, old in zip(after, motion, strict=True)))
        return (after, jnp.where(keep, propagated, covariance)), Innovations(error, spread)

    first = true_force(plant, fine.force[0], fine.base[0])[0]
    motion = Motion(start.x, start.v, mode_at(plant, minv, start.x, start.v, first, fine.time[0]))
    inputs = (fine.force, fine.base, fine.time, readings.values, readings.use, readings.valid)
    return jax.lax.scan(body, (motion, start.covariance), inputs)[1]


def _mode(plant, minv, motion, mean, g, time):
    # A link that sticks stays so while the update leaves it at rest; otherwise its speed decides.
    return mode_at(plant, minv, mean[: plant.dof], mean[plant.dof :], g, time)


def _transition(plant, minv, before: Motion, after: Motion, time, dt):
    """Derivative of the state after a sample by the state before it: exponential series of the mid-point slope."""
    dof = plant.dof
    x, v = (before.x + after.x) / 2, (before.v + after.v) / 2
    by_x, by_v = _force_slopes(plant, x, v, time + dt / 2)
    top = jnp.concatenate([jnp.zeros((dof, dof)), jnp.eye(dof)], 1)
    bottom = -_product(minv, jnp.concatenate([by_x, by_v], 1))
    bottom = _held(plant, minv, bottom, (before.mode == 0) & (after.mode == 0))
    slope = dt * jnp.concatenate([top, bottom], 0)
    square = _product(slope, slope)
    return jnp.eye(2 * dof) + slope + square / 2 + _product(square, slope) / 6 + _product(square, square) / 24


def _force_slopes(plant, x, v, t):
    dof = plant.dof
    basis = jnp.eye(2 * dof)
    columns = jax.vmap(lambda e: jax.jvp(lambda x, v: smooth_force(plant, x, v, t), (x, v), (e[:dof], e[dof:]))[1])(
        basis
    )
    return columns[:dof].T, columns[dof:].T


def _settle(plant, minv, covariance, mode):
    """Covariance once a link sticks: its speed is known to be zero."""
    slots = plant.friction
    dof = plant.dof
    for i in range(len(slots)):
        row = jnp.concatenate([jnp.zeros(dof), slots.direction[i]])
        effect = jnp.concatenate([jnp.zeros(dof), jnp.sum(minv * slots.direction[i][None, :], 1)])
        scale = jnp.sum(row * effect)
        project = jnp.eye(2 * dof) - effect[:, None] * row[None, :] / jnp.where(scale > 0, scale, 1.0)
        stuck = _product(_product(project, covariance), project.T)
        covariance = jnp.where((mode[i] == 0) & (scale > 0), stuck, covariance)
    return covariance


def _update(plant, minv, show, motion, covariance, g, base, time, y, use, variances):
    """State after the readings of one sample, and their innovations."""
    mean = jnp.concatenate([motion.x, motion.v])
    errors, spreads = [], []
    for c in range(y.shape[0]):
        gain = 1.0 + plant.channel_gain[c]
        predicted, row = _predict(
            plant, minv, show, c, mean, covariance, motion.mode, g, base, time, y[c], variances[c], gain
        )
        error = y[c] - gain * predicted - plant.channel_offset[c]
        row = gain * row
        cross = jnp.sum(covariance * row[None, :], 1)
        spread = jnp.sum(row * cross) + variances[c]
        weight = use[c] * cross / spread
        mean = mean + weight * error
        covariance = covariance - weight[:, None] * cross[None, :]
        errors.append(error)
        spreads.append(spread)
    return mean, covariance, jnp.stack(errors), jnp.stack(spreads)


def _predict(plant, minv, show, c, mean, covariance, mode, g, base, time, y, variance, gain):
    """Reading of channel `c` without gain and offset, and its derivative by the state."""
    dof = plant.dof
    select, none = show.select[c], jnp.zeros(dof)
    if show.kinds[c] == "displacement":
        return jnp.sum(select * mean[:dof]), jnp.concatenate([select, none])
    if show.kinds[c] == "velocity":
        return jnp.sum(select * mean[dof:]), jnp.concatenate([none, select])
    if len(plant.friction) == 1:
        a, slope = _most_probable_mode(plant, minv, select, c, mean, covariance, g, base, time, y, variance, gain)
    else:
        a, slope = _acceleration_and_slope(plant, minv, mean, mode, g, time)
    return jnp.sum(select * (a + base)), jnp.sum(select[:, None] * slope, 0)


def _acceleration_and_slope(plant, minv, mean, mode, g, time):
    dof = plant.dof
    a = acceleration(plant, minv, mean[:dof], mean[dof:], mode, g, time)[0]
    by_x, by_v = _force_slopes(plant, mean[:dof], mean[dof:], time)
    return a, _held(plant, minv, -_product(minv, jnp.concatenate([by_x, by_v], 1)), mode == 0)


def _held(plant, minv, slope, sticking):
    """Derivative of the accelerations by the state once links stick: what would move those is taken up."""
    for i in range(len(plant.friction)):
        row = plant.friction.direction[i]
        effect = jnp.sum(minv * row[None, :], 1)
        scale = jnp.sum(row * effect)
        held = slope - effect[:, None] * jnp.sum(row[:, None] * slope, 0)[None, :] / jnp.where(scale > 0, scale, 1.0)
        slope = jnp.where(sticking[i] & (scale > 0), held, slope)
    return slope


def _most_probable_mode(plant, minv, select, c, mean, covariance, g, base, time, y, variance, gain):
    """Acceleration and slope in the mode that the reading and the estimated speed make most probable."""
    dof = plant.dof
    row = plant.friction.direction[0]
    speed = jnp.sum(row * mean[dof:])
    spread = jnp.sqrt(jnp.maximum(jnp.sum(row[:, None] * covariance[dof:, dof:] * row[None, :]), 0.0))
    certain = jnp.where(spread > 0, speed / jnp.where(spread > 0, spread, 1.0), jnp.sign(speed) * 40.0)
    low, high = friction_limits(plant, mean[:dof], jnp.zeros(dof), time)
    free = jnp.sum(minv * (g - smooth_force(plant, mean[:dof], mean[dof:], time))[None, :], 1)
    held = holding_force(plant, minv, free, jnp.ones(1, bool))[0]
    can_stick = (held <= high[0]) & (held >= low[0])
    weights = (
        jax.scipy.stats.norm.logcdf(jnp.clip(certain, -30.0, 30.0)),
        jax.scipy.stats.norm.logcdf(jnp.clip(-certain, -30.0, 30.0)),
        jnp.where(can_stick, -jnp.minimum(certain**2, 900.0) / 2, -1e6),
    )

    def judge(mode, weight):
        a, slope = _acceleration_and_slope(plant, minv, mean, mode[None], g, time)
        line = gain * jnp.sum(select[:, None] * slope, 0)
        total = jnp.sum(line[:, None] * covariance * line[None, :]) + variance
        error = y - gain * jnp.sum(select * (a + base)) - plant.channel_offset[c]
        return weight - error**2 / (2 * total) - jnp.log(total) / 2, a, slope

    scores, values, slopes = jax.vmap(judge)(jnp.array([1.0, -1.0, 0.0]), jnp.stack(weights))
    best = jax.nn.one_hot(jnp.argmax(jax.lax.stop_gradient(scores)), 3)
    return jnp.sum(best[:, None] * values, 0), jnp.sum(best[:, None, None] * slopes, 0)
