"""Linear Gaussian motion on a grid: likelihood of its readings, and the Rauch-Tung-Striebel smoother.

H. E. Rauch, F. Tung, C. T. Striebel, AIAA J. 3 (1965) 1445-1450.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float


class LinearModel(eqx.Module):
    """From sample to sample s ← step s + pushed + N(0, noise); readings are rows s + N(0, variance).

    At the first sample s is N(0, start). Channels are taken one after the other, so that no matrix is inverted.
    """

    step: Float[Array, "state state"]
    noise: Float[Array, "state state"]
    rows: Float[Array, "channels state"]
    variance: Float[Array, " channels"]
    start: Float[Array, "state state"]


def _filtered(model: LinearModel, pushed, seen, use):
    """Moments at every sample, predicted and then updated, and the log-likelihood of its readings."""

    def body(carry, inputs):
        mean, covariance = carry
        push, y, counted = inputs
        predicted, total = (mean, covariance), jnp.zeros(())
        for c in range(y.shape[0]):
            row = model.rows[c]
            cross = jnp.sum(covariance * row[None, :], 1)
            spread = jnp.sum(row * cross) + model.variance[c]
            error = y[c] - jnp.sum(row * mean)
            weight = counted[c] * cross / spread
            mean, covariance = mean + weight * error, covariance - weight[:, None] * cross[None, :]
            total = total - 0.5 * counted[c] * (error**2 / spread + jnp.log(2 * jnp.pi * spread))
        onward = (model.step @ mean + push, model.step @ covariance @ model.step.T + model.noise)
        return onward, (*predicted, mean, covariance, total)

    start = (jnp.zeros(model.start.shape[0]), model.start)
    return jax.lax.scan(body, start, (pushed, seen, use))[1]


def log_likelihood(
    model: LinearModel,
    pushed: Float[Array, "n state"],
    seen: Float[Array, "n channels"],
    use: Float[Array, "n channels"],
) -> Float[Array, ""]:
    """Of readings `seen`, less what is known of them beforehand; those with ``use = 0`` do not count."""
    return jnp.sum(_filtered(model, pushed, seen, use)[-1])


def smoothed(
    model: LinearModel,
    pushed: Float[Array, "n state"],
    seen: Float[Array, "n channels"],
    use: Float[Array, "n channels"],
    watch: Float[Array, "watched state"],
) -> tuple[Float[Array, "n watched"], Float[Array, "n watched watched"]]:
    """Mean and covariance of ``watch s`` at every sample, given all readings."""
    ahead, spread_ahead, mean, covariance, _ = _filtered(model, pushed, seen, use)

    def shown(mean, covariance):
        return watch @ mean, watch @ covariance @ watch.T

    def body(carry, inputs):
        later, spread_later = carry
        ahead, spread_ahead, mean, covariance = inputs
        weight = jnp.linalg.solve(spread_ahead, model.step @ covariance).T
        mean = mean + weight @ (later - ahead)
        covariance = covariance + weight @ (spread_later - spread_ahead) @ weight.T
        return (mean, covariance), shown(mean, covariance)

    last = (mean[-1], covariance[-1])
    inputs = (ahead[1:], spread_ahead[1:], mean[:-1], covariance[:-1])
    _, (means, covariances) = jax.lax.scan(body, last, inputs, reverse=True)
    end_mean, end_covariance = shown(*last)
    return jnp.concatenate([means, end_mean[None]]), jnp.concatenate([covariances, end_covariance[None]])
