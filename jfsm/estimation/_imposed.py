"""What the readings of a force say where the motion is imposed.

The motion is known up to the noise of its channels, so a reading is the force that the motion needs, the error of the
motion times the slopes of that force, and noise. The error has a memory of some samples; a small Kalman filter follows
it, so that the innovations are white where the structure is right.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Float

from .._types import Array
from ..plant import Imposed, Observation, Plant, needed
from ._filter import Innovations, ProcessNoise, Readings


def force_innovations(
    plant: Plant,
    observation: Observation,
    imposed: Imposed,
    readings: Readings,
    noise: ProcessNoise,
    doubt: Float[Array, ""],
    log_scale: Float[Array, " channels"],
) -> Innovations:
    """Readings of every force channel less their predictions; nothing for the channels of the motion.

    `log_scale` is the logarithm of the factor on each channel's noise variance; the motion of a degree of freedom has
    the mean of its channels'. `doubt` is that of what laws remember at the start, as a share of
    its own size, `noise` the force that is forgiven.
    """
    found, error, dof = needed(plant, observation, imposed, doubt), imposed.error, plant.dof
    forces = [c for c, kind in enumerate(observation.kinds) if kind == "force"]
    others = jnp.array([float(kind != "force") for kind in observation.kinds])
    mine = observation.select * others[:, None]
    share = jnp.exp(jnp.sum(mine * log_scale[:, None], 0) / jnp.sum(mine, 0))
    pick = observation.select[jnp.array(forces)]
    rows = jnp.einsum("cf,nfjo,njok->ncjk", pick, found.slopes, error.rows)
    white = (found.besides + jnp.diag(noise.velocity)[None, :]) @ pick.T
    white = white + (readings.variance * jnp.exp(log_scale))[None, jnp.array(forces)]
    apart = readings.values[:, jnp.array(forces)] - found.force @ pick.T

    def body(carry, inputs):
        mean, covariance = carry
        enters, follow, fresh, row, seen, white, use = inputs
        mean = _followed(mean[..., None], enters, follow)[..., 0]
        covariance = _followed(covariance.reshape(dof, 6, -1), enters, follow).reshape(covariance.shape)
        covariance = covariance.transpose(2, 3, 0, 1)
        covariance = _followed(covariance.reshape(dof, 6, -1), enters, follow).reshape(covariance.shape)
        new = jnp.where(enters, fresh * share, 0.0)
        covariance = covariance.at[jnp.arange(dof), 5, jnp.arange(dof), 5].add(new)
        errors, variances = [], []
        for i in range(len(forces)):
            across = jnp.sum(covariance * row[i][None, None], (2, 3))
            error, variance = seen[i] - jnp.sum(row[i] * mean), jnp.sum(row[i] * across) + white[i]
            weight = use[i] * across / variance
            mean = mean + weight * error
            covariance = covariance - weight[:, :, None, None] * across[None, None]
            errors.append(error)
            variances.append(variance)
        return (mean, covariance), (jnp.stack(errors), jnp.stack(variances))

    start = jnp.zeros((dof, 6, dof, 6))
    start = start.at[jnp.arange(dof), :, jnp.arange(dof)].set(error.start * share[:, None, None])
    use = readings.use[:, jnp.array(forces)] * readings.valid[:, None]
    inputs = (error.enters, error.follow, error.fresh, rows, apart, white, use)
    _, (errors, variances) = jax.lax.scan(body, (jnp.zeros((dof, 6)), start), inputs)
    none = jnp.zeros(readings.values.shape)
    variances = (none + 1.0).at[:, jnp.array(forces)].set(variances)
    return Innovations(none.at[:, jnp.array(forces)].set(errors), variances, none)


def _followed(columns: Float[Array, "dof 6 width"], enters, follow) -> Float[Array, "dof 6 width"]:
    """Coefficients once the next one has taken the place of the oldest, where it does."""
    rest = columns[:, 1:]
    newest = jnp.sum(follow[:, :, None] * rest, 1, keepdims=True)
    return jnp.where(enters[:, None, None], jnp.concatenate([rest, newest], 1), columns)
