"""The filter of a motion whose force map is part of its state, about a motion that was smoothed before."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.lax.linalg import cholesky
from jax.scipy.linalg import solve_triangular
from jaxtyping import Float

from .._types import Array
from ..surrogates.kriging.correlations import AbstractCorrelation
from ..surrogates.kriging.trend import TrendBasis
from ._kalman import Filtered, told_by

MOVING = 4
"""Displacement, velocity, force and rate of the force come first in the state; the coefficients of the map, which stay,
follow."""
JITTER = 1e-9
"""Added to the diagonal of R: nodes a few length scales apart are told apart no better."""


class Field(eqx.Module):
    """Functions that a map is a sum of: those of the trend, and L⁻¹r, which make a field of unit variance at the nodes.

    With R = LLᵀ between the nodes and independent coefficients γ of variance σ², rᵀL⁻ᵀγ is the conditional mean of the
    random field given its values Lγ at the nodes.
    """

    trend: TrendBasis
    correlation: AbstractCorrelation
    nodes: Float[Array, "nodes 2"]

    @property
    def size(self) -> int:
        """Number of functions."""
        return self.trend.triangle.shape[0] + len(self.nodes)

    def factor(self, length_scale: Float[Array, "2"]) -> Float[Array, "nodes nodes"]:
        """L."""
        r = self.correlation.between(self.nodes, self.nodes, length_scale)
        return cholesky(r + JITTER * jnp.eye(len(r)), symmetrize_input=False)

    def functions(
        self, states: Float[Array, "q 2"], length_scale: Float[Array, "2"], factor: Float[Array, "nodes nodes"]
    ) -> Float[Array, "q functions"]:
        """All functions at several states."""
        r = self.correlation.between(states, self.nodes, length_scale)
        return jnp.concatenate([self.trend(states, (0, 0)), solve_triangular(factor, r.T, lower=True).T], axis=1)


class Hyper(NamedTuple):
    """Logarithms of the process standard deviation and of the length scales: what the likelihood is maximised over."""

    process_std: Float[Array, ""]
    length_scale: Float[Array, "2"]


class Recording(eqx.Module):
    """Readings of one mass on a grid, padded, and what is known of their noise.

    `seen` (n, channels) are the responses and, last, the measured force; those with ``use = 0`` do not count. `orders`
    are how often each response is differentiated. `going` is zero where samples are only padding. The rate of the force
    walks with intensity `walk`, so that between samples the force is a cubic.
    """

    field: Field
    seen: Float[Array, "n channels"]
    use: Float[Array, "n channels"]
    going: Float[Array, " n"]
    base: Float[Array, " n"]
    variance: Float[Array, " channels"]
    walk: Float[Array, ""]
    mass: Float[Array, ""]
    dt: Float[Array, ""]
    first: Float[Array, "4"]
    spread: Float[Array, "4"]
    """Mean and standard deviation of the first state beforehand."""
    vague: Float[Array, ""]
    """Standard deviation of the trend coefficients beforehand."""
    orders: tuple[int, ...] = eqx.field(static=True)
    substeps: int = eqx.field(static=True)


class Steps(NamedTuple):
    """The motion to first order about a smoothed one: s → step s + pushed, and readings rows s + shift."""

    step: Float[Array, "n 4 state"]
    pushed: Float[Array, "n 4"]
    rows: Float[Array, "n channels state"]
    shift: Float[Array, "n channels"]


def _stepped(recording: Recording, state, c, base, hyper: Hyper, factor):
    """The moving part one sample later, by the classical Runge-Kutta method, while the rate of the force stays."""
    x, v, g, rise = state
    length_scale = jnp.exp(hyper.length_scale)

    def rate(moved, after):
        held = recording.field.functions(moved[None], length_scale, factor)[0] @ c
        return jnp.stack([moved[1], (g + rise * after - held) / recording.mass - base])

    def substep(moved, after):
        k1 = rate(moved, after)
        k2 = rate(moved + 0.5 * h * k1, after + 0.5 * h)
        k3 = rate(moved + 0.5 * h * k2, after + 0.5 * h)
        k4 = rate(moved + h * k3, after + h)
        return moved + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4), None

    h = recording.dt / recording.substeps
    moved, _ = jax.lax.scan(substep, jnp.stack([x, v]), h * jnp.arange(recording.substeps))
    return jnp.concatenate([moved, jnp.stack([g + rise * recording.dt, rise])])


def _shown(recording: Recording, state, c, base, hyper: Hyper, factor):
    """What the channels would show without noise."""
    x, v, g, _ = state
    held = recording.field.functions(state[None, :2], jnp.exp(hyper.length_scale), factor)[0] @ c
    kinds = x, v, (g - held) / recording.mass - base
    return jnp.stack([*(kinds[order] for order in recording.orders), g])


def _steps(recording: Recording, states: Float[Array, "n 4"], c: Float[Array, " functions"], hyper: Hyper) -> Steps:
    factor = recording.field.factor(jnp.exp(hyper.length_scale))

    def first_order(of, state, base):
        def one(both):
            return of(recording, both[:MOVING], both[MOVING:], base, hyper, factor)

        both = jnp.concatenate([state, c])
        value, pull = jax.vjp(one, both)
        slope = jax.vmap(lambda row: pull(row)[0])(jnp.eye(len(value)))
        return slope, value - slope @ both

    step, pushed = jax.vmap(lambda s, b: first_order(_stepped, s, b))(states, recording.base)
    rows, shift = jax.vmap(lambda s, b: first_order(_shown, s, b))(states, recording.base)
    still = jnp.eye(MOVING, MOVING + len(c))
    going = recording.going[:, None]
    return Steps(jnp.where(going[..., None] > 0, step, still), pushed * going, rows, shift)


def _wander(dt, mass) -> Float[Array, "4 4"]:
    """Covariance that a random walk of the rate of the force, of intensity one, makes of the moving part in a step.

    Four integrals of one white noise: ∫ τ^(i+j) dτ / (i! j!) (Wiener process integrated up to three times).
    """
    powers = jnp.arange(MOVING - 1.0, -1.0, -1.0)
    lever = jnp.stack([dt**3 / (6.0 * mass), dt**2 / (2.0 * mass), dt, jnp.ones(())])
    return dt * jnp.outer(lever, lever) / (powers[:, None] + powers[None, :] + 1.0)


def _filtered(recording: Recording, steps: Steps, hyper: Hyper) -> tuple[tuple[Array, Array], Filtered]:
    """Moments after the last sample, and of every sample."""
    trend = recording.field.trend.triangle.shape[0]
    std = jnp.where(jnp.arange(recording.field.size) < trend, recording.vague, jnp.exp(hyper.process_std))
    start = (
        jnp.concatenate([recording.first, jnp.zeros(recording.field.size)]),
        jnp.diag(jnp.append(recording.spread, std) ** 2),
    )
    noise = recording.walk * _wander(recording.dt, recording.mass)

    @jax.checkpoint
    def body(carry, inputs):
        mean, covariance = carry
        step, seen, use, going = inputs
        mean, covariance, sample = told_by(mean, covariance, step.rows, recording.variance, seen - step.shift, use)
        led = step.step @ covariance
        moving = led @ step.step.T + going * noise
        onward = (
            jnp.concatenate([step.step @ mean + step.pushed, mean[MOVING:]]),
            jnp.concatenate(
                [
                    jnp.concatenate([0.5 * (moving + moving.T), led[:, MOVING:]], axis=1),
                    jnp.concatenate([led[:, MOVING:].T, covariance[MOVING:, MOVING:]], axis=1),
                ]
            ),
        )
        return onward, sample

    return jax.lax.scan(body, start, (steps, recording.seen, recording.use, recording.going))


@eqx.filter_jit
@eqx.filter_value_and_grad
def cost(
    hyper: Hyper, recording: Recording, states: Float[Array, "n 4"], c: Float[Array, " functions"]
) -> Float[Array, ""]:
    """Minus log-likelihood of the readings, with its slope, about a motion and coefficients of the map."""
    return -jnp.sum(_filtered(recording, _steps(recording, states, c, hyper), hyper)[1].total)


class Smoothed(NamedTuple):
    """Motion and force given all readings; mean and covariance of the coefficients; log-likelihood."""

    states: Float[Array, "n 4"]
    mean: Float[Array, " functions"]
    covariance: Float[Array, "functions functions"]
    log_likelihood: Float[Array, ""]


@eqx.filter_jit
def smoothed(
    recording: Recording, states: Float[Array, "n 4"], c: Float[Array, " functions"], hyper: Hyper
) -> Smoothed:
    """The next motion and coefficients, from those about which the filter was made linear.

    Repeated, this is Gauss and Newton's method for the most probable motion and map (Bell and Cathey, IEEE Trans.
    Autom. Control 38 (1993) 294-297).
    """
    steps = _steps(recording, states, c, hyper)
    (mean, covariance), filtered = _filtered(recording, steps, hyper)

    def body(slope, inputs):
        # Slope of minus the log-likelihood of all later readings, by the state predicted for them (Bierman 1973).
        step, sample, use = inputs
        slope = jnp.concatenate([jnp.zeros(MOVING), slope[MOVING:]]) + step.step.T @ slope[:MOVING]
        for i in reversed(range(len(recording.variance))):
            told = use[i] / sample.spread[i]
            slope = slope - step.rows[i] * (sample.weight[i] @ slope + told * sample.error[i])
        return slope, (sample.mean - sample.covariance @ slope)[:MOVING]

    _, found = jax.lax.scan(body, jnp.zeros(mean.shape), (steps, filtered, recording.use), reverse=True)
    c, spread = mean[MOVING:], covariance[MOVING:, MOVING:]
    return Smoothed(found, c, 0.5 * (spread + spread.T), jnp.sum(filtered.total))
