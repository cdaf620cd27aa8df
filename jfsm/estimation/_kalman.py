"""Linear Gaussian motion on a grid: likelihood of its readings, and the state given all of them.

The smoother is that of G. J. Bierman, Automatica 9 (1973) 503-508, which inverts nothing.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._types import Array
from ._measurement_update import measurement_update

_LEAST_SWELL = 1e-4


def swell_of(power: np.ndarray) -> np.ndarray:
    """How random forces of this power swell and fade, in the mean by 1."""
    return np.maximum(power / np.mean(power), _LEAST_SWELL)


class LinearModel(eqx.Module):
    """From sample to sample s ← step s + pushed + N(0, noise + swell wander); readings are rows s + N(0, variance).

    At the first sample s is N(0, start). `swell` (n,) differs from step to step; without `wander` there is none.
    Channels are taken one after the other, so that no matrix is inverted.
    """

    step: Float[Array, "state state"]
    noise: Float[Array, "state state"]
    rows: Float[Array, "channels state"]
    variance: Float[Array, " channels"]
    start: Float[Array, "state state"]
    wander: Float[Array, "state state"] | None = None


class Filtered(NamedTuple):
    """Moments predicted for every sample; error, variance and gain of every reading; log-likelihood of a sample's."""

    mean: Float[Array, "n state"]
    covariance: Float[Array, "n state state"]
    error: Float[Array, "n channels"]
    spread: Float[Array, "n channels"]
    weight: Float[Array, "n channels state"]
    total: Float[Array, " n"]


def told_by(
    mean: Float[Array, " state"],
    covariance: Float[Array, "state state"],
    rows: Float[Array, "channels state"],
    variance: Float[Array, " channels"],
    seen: Float[Array, " channels"],
    counted: Float[Array, " channels"],
) -> tuple[Float[Array, " state"], Float[Array, "state state"], Filtered]:
    """Predicted moments once the readings of a sample are known, and what these told."""
    predicted = mean, covariance
    total, readings = jnp.zeros(()), []
    for c in range(seen.shape[0]):
        error = seen[c] - jnp.sum(rows[c] * mean)
        mean, covariance, spread, weight = measurement_update(mean, covariance, rows[c], error, variance[c], counted[c])
        total = total - 0.5 * counted[c] * (error**2 / spread + jnp.log(2 * jnp.pi * spread))
        readings.append((error, spread, weight))
    error, spread, weight = (jnp.stack(each) for each in zip(*readings, strict=True))
    return mean, covariance, Filtered(*predicted, error, spread, weight, total)


def _filtered(model: LinearModel, pushed, seen, use, swell) -> Filtered:
    def body(carry, inputs):
        mean, covariance = carry
        push, y, counted, swell = inputs
        mean, covariance, sample = told_by(mean, covariance, model.rows, model.variance, y, counted)
        noise = model.noise if model.wander is None else model.noise + swell * model.wander
        onward = (model.step @ mean + push, model.step @ covariance @ model.step.T + noise)
        return onward, sample

    start = (jnp.zeros(model.start.shape[0]), model.start)
    swell = jnp.ones(len(seen)) if swell is None else swell
    return jax.lax.scan(body, start, (pushed, seen, use, swell))[1]


def log_likelihood(
    model: LinearModel,
    pushed: Float[Array, "n state"],
    seen: Float[Array, "n channels"],
    use: Float[Array, "n channels"],
    swell: Float[Array, " n"] | None = None,
) -> Float[Array, ""]:
    """Of readings `seen`, less what is known of them beforehand; those with ``use = 0`` do not count."""
    return jnp.sum(_filtered(model, pushed, seen, use, swell).total)


def smoothed(
    model: LinearModel,
    pushed: Float[Array, "n state"],
    seen: Float[Array, "n channels"],
    use: Float[Array, "n channels"],
    watch: Float[Array, "watched state"],
    swell: Float[Array, " n"] | None = None,
) -> tuple[Float[Array, "n watched"], Float[Array, "n watched watched"]]:
    """Mean and covariance of ``watch s`` at every sample, given all readings."""

    filtered = _filtered(model, pushed, seen, use, swell)

    def body(carry, inputs):
        # Slope and curvature of minus the log-likelihood of this and all later readings, by the state predicted here.
        slope, curvature = carry
        sample, counted = inputs
        for c in reversed(range(len(model.rows))):
            row, gain = model.rows[c], sample.weight[c]
            told = counted[c] / sample.spread[c]
            # (I - gain row)ᵀ from the left, and on both sides
            slope = slope - row * jnp.sum(gain * slope) - row * told * sample.error[c]
            across = jnp.sum(curvature * gain[None, :], 1)
            curvature = curvature - row[:, None] * across[None, :] - across[:, None] * row[None, :]
            curvature = curvature + row[:, None] * row[None, :] * (jnp.sum(gain * across) + told)
        spread = watch @ sample.covariance
        shown = watch @ sample.mean - spread @ slope, spread @ watch.T - spread @ curvature @ spread.T
        return (model.step.T @ slope, model.step.T @ curvature @ model.step), shown

    state = model.start.shape[0]
    end = (jnp.zeros(state), jnp.zeros((state, state)))
    return jax.lax.scan(body, end, (filtered, use), reverse=True)[1]
