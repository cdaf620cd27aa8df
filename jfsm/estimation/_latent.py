r"""The force that a model lacks, as a hidden state: Kalman filter and Rauch-Tung-Striebel smoother.

    M ẍ + C ẋ + K x + r = g,     ṙ = -r/τ + w,

r is an Ornstein-Uhlenbeck process per degree of freedom, its amplitude and its memory τ chosen by likelihood among a
few, and whether it swells and fades with the motion, as in a decay. Of several masses each has an amplitude of its own:
a law acts on two of them, and the others tell where these are. Whatever the model says of nonlinear terms is
inside r, and is taken off afterwards. This is for pictures and maps, not for the likelihood of a hypothesis.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import scipy.linalg
from jaxtyping import ArrayLike, Bool, Float, Shaped
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from .._traced import jit_kept
from .._types import Array
from ..plant import (
    InterpolatedInput,
    Observation,
    Plant,
    bucket,
    force_along,
    linear_part,
    own_force,
    shifted,
    undelayed,
)
from ._kalman import LinearModel, log_likelihood, smoothed, swell_of

_MEMORIES = (0.15, 1.0)
"""τ of the latent force, in radians of the motion."""
_AMPLITUDES = (0.003, 0.01, 0.03, 0.1, 0.3, 1.0)
"""Its amplitude, as a share of the elastic force."""
_SWELL = (1, 2)
"""Powers of the motion's energy that the latent force's power may follow: of linear laws and of steeper ones."""
_TOLD_APART = 5
"""Steps that tell the amplitudes on several masses apart, at most,"""
_OTHER_MEMORIES = (0.5, 1.0, 2.0, 4.0)
"""and memories that are tried in each, in those of the step before."""
_WIDE = 10.0
_CERTAIN = 5.0
"""Velocity, in its standard errors, from which something moves."""


@dataclass(frozen=True)
class Latent:
    """Smoothed motion and missing force of a record.

    Attributes
    ----------
    displacement, velocity, acceleration, force : (n, dof) arrays
        `acceleration` is relative to the base. `force` stands on the left-hand side, restoring side positive, beside
        everything the model has.
    std : (n, dof) array
        Standard error of `force`.
    moves : (n,) array of bool
        Whether anything moved within half a period, beyond the error of its velocity.
    """

    displacement: Float[np.ndarray, "n dof"]
    velocity: Float[np.ndarray, "n dof"]
    acceleration: Float[np.ndarray, "n dof"]
    force: Float[np.ndarray, "n dof"]
    std: Float[np.ndarray, "n dof"]
    moves: Bool[np.ndarray, " n"]


class _Belief(NamedTuple):
    """Memory [s] of the missing force, and its amplitude on each mass, as an acceleration."""

    memory: float
    amplitude: Float[np.ndarray, " dof"]

    def after(
        self, force: Float[np.ndarray, "n dof"], std: Float[np.ndarray, "n dof"], plant: Plant
    ) -> Iterator["_Belief"]:
        """With the amplitudes at which the smoothed force is likelier (a step of expectation maximisation), and this
        memory, shorter and longer ones."""
        amplitude = np.sqrt(np.mean(force**2 + std**2, 0)) / np.diag(np.asarray(plant.mass))
        yield from (_Belief(factor * self.memory, amplitude) for factor in _OTHER_MEMORIES)


class _Model(NamedTuple):
    """The motion, and how the force enters it: over a step, and straight into an acceleration."""

    linear: LinearModel
    by_force: Float[Array, "halves state dof"]
    through: Float[Array, "channels dof"]


class _Likely(NamedTuple):
    """The likeliest of some models, by its log-likelihood, and how its latent force swells and fades (n,)."""

    likelihood: float
    model: _Model
    belief: _Belief
    swell: Float[np.ndarray, " n"]


def latent_force(
    plant: Plant,
    observation: Observation,
    inputs: InterpolatedInput,
    values: Float[ArrayLike, "n channels"],
    use: Shaped[ArrayLike, "n channels"],
    variance: Float[ArrayLike, " channels"],
    force_covariance: Float[ArrayLike, "dof dof"],
    omega: float,
    length: float,
) -> Latent:
    """Smoothed motion and missing force.

    Parameters
    ----------
    plant : Plant
        With its sensors' gains, offsets and delays.
    inputs : InterpolatedInput
        What drives the record, at least as long as the readings.
    values, use : (n, channels) arrays
        Readings, and which of them count.
    variance, force_covariance : (channels,), (dof, dof) arrays
    omega, length : float
        Angular frequency [rad/s] and size of the motion.
    """
    n, dt, linear = np.shape(values)[0], float(inputs.step), linear_part(plant)
    padded = min(bucket(n), inputs.time.shape[0])  # nothing is read where it is filled up
    values, use = (np.pad(np.asarray(q), ((0, padded - n), (0, 0))) for q in (values, use))
    base = np.asarray(inputs.base)[:padded]
    true = (np.asarray(undelayed(plant, inputs).force)[:padded] - np.asarray(plant.force_offset)) / (
        1 + np.asarray(plant.force_gain)
    )
    true = true - base[..., None] * np.asarray(plant.mass).sum(1)
    seen = (values - np.asarray(plant.channel_offset)) / (1 + np.asarray(plant.channel_gain))
    seen, use = _on_time(plant, seen, use, dt)
    acceleration = np.array([kind == "acceleration" for kind in observation.kinds])
    seen = seen - base[:, :1] * acceleration
    arrays = np.asarray(force_covariance), np.asarray(variance), omega, length
    make = partial(_model, linear, observation, dt, inputs.substeps, *arrays)
    even = np.full(plant.dof, omega**2 * length)
    beliefs = [_Belief(tau / omega, share * even) for tau, share in product(_MEMORIES, _AMPLITUDES)]
    models = [make(*belief) for belief in beliefs]
    data = (true, seen, use)
    dof, minv = plant.dof, np.linalg.inv(np.asarray(plant.mass))
    period = max(int(2 * np.pi / (omega * dt)), 1)

    def most_likely(models: list[_Model], beliefs: list[_Belief], swell: np.ndarray) -> _Likely:
        stacked = jax.tree.map(lambda *leaves: np.stack(leaves), *models)
        found = np.asarray(_likelihoods(stacked, *data, swell))
        likelihoods = np.where(np.isnan(found), -np.inf, found)  # a smoother that has broken down
        best = int(np.argmax(likelihoods))
        return _Likely(float(likelihoods[best]), models[best], beliefs[best], swell)

    def motion(one: _Likely) -> tuple[np.ndarray, np.ndarray]:
        mean, std = _smooth(one.model, *data, one.swell)
        return np.asarray(mean), np.asarray(std)

    best = most_likely(models, beliefs, np.ones(padded))
    mean, std = motion(best)
    energy = np.mean(mean[:n, :dof] ** 2 + (mean[:n, dof : 2 * dof] / omega) ** 2, 1)
    energy = gaussian_filter1d(energy, period, mode="nearest")
    swelling = [
        most_likely(models, beliefs, np.pad(swell_of(energy**power), (0, padded - n), mode="edge"))
        for power in _SWELL
        if np.any(energy > 0)
    ]
    best = max(best, *swelling, key=lambda found: found.likelihood)
    mean, std = motion(best)
    for _ in range(_TOLD_APART if dof > 1 else 0):
        others = list(best.belief.after(mean[:n, 2 * dof :], std[:n, 2 * dof :], plant))
        found = most_likely([make(*belief) for belief in others], others, best.swell)
        if not found.likelihood > best.likelihood:
            break
        best = found
        mean, std = motion(best)
    x, v, r = mean[:, :dof], mean[:, dof : 2 * dof], mean[:, 2 * dof :]
    known = (
        np.asarray(force_along(plant, jnp.asarray(x), jnp.asarray(v), inputs.time[:padded]))
        if plant.laws
        else np.zeros_like(x)
    )
    a = (true[:, 0] - r - x @ np.asarray(linear.stiffness).T - v @ np.asarray(linear.damping).T) @ minv.T
    if plant.own is not None:
        needed, mass, _ = own_force(plant.own, np.asarray(plant.own_numbers), x, v, a, np.asarray(inputs.time[:padded]))
        behind = np.asarray(plant.whole_mass - plant.mass)
        needed, mass = needed - a @ behind.T, mass - behind
        r, known = true[:, 0] - needed, known + x @ np.asarray(plant.stiffness).T + v @ np.asarray(plant.damping).T
        force_std = np.sqrt(np.einsum("nij,nj->ni", (mass @ minv) ** 2, std[:, 2 * dof :] ** 2))
        std = np.concatenate([std[:, : 2 * dof], force_std], 1)
    x, v, a, r, known, std = (q[:n] for q in (x, v, a, r, known, std))
    moves = maximum_filter1d(np.abs(v), period, axis=0) > _CERTAIN * std[:, dof : 2 * dof]
    return Latent(x, v, a, r - known, std[:, 2 * dof :], np.any(moves, 1))


def _on_time(plant: Plant, seen: np.ndarray, use: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """Readings with their channels' delays undone, and which of them count: those with four that do around them."""
    seen, use = np.array(seen), np.array(use)
    for tau, channel in zip(np.asarray(plant.channel_delay), np.asarray(plant.late_channel), strict=True):
        seen[:, channel] = shifted(jnp.asarray(seen[:, channel]), jnp.asarray(tau / dt))
        index = np.arange(len(use)) + int(np.floor(tau / dt))
        near = index[:, None] + np.arange(-1, 3)
        inside = (near >= 0) & (near < len(use))
        use[:, channel] = np.min(np.where(inside, use[np.clip(near, 0, len(use) - 1), channel], 0.0), 1)
    return seen, use


def _model(
    plant: Plant, observation: Observation, dt, substeps, force_covariance, variance, omega, length, tau, amplitude
) -> _Model:
    dof = plant.dof
    minv = np.linalg.inv(np.asarray(plant.mass))
    zero, eye = np.zeros((dof, dof)), np.eye(dof)
    k, c = np.asarray(plant.stiffness), np.asarray(plant.damping)
    rate = np.block([[zero, eye, zero], [-minv @ k, -minv @ c, -minv], [zero, zero, -eye / tau]])
    gain = np.concatenate([zero, minv, zero])
    n = 3 * dof
    # Simpson's rule over the half steps of the force, each carried to the end of the sample by the free motion.
    nodes = 2 * substeps + 1
    weight = (
        dt / (6 * substeps) * np.array([1.0 if j in (0, nodes - 1) else 4.0 if j % 2 else 2.0 for j in range(nodes)])
    )
    transitions = [np.eye(n)]
    short = scipy.linalg.expm(rate * dt / (nodes - 1))
    for _ in range(nodes - 1):
        transitions.append(transitions[-1] @ short)
    carried = weight[:, None, None] * (np.array(transitions[::-1]) @ gain)
    step = transitions[-1]
    mass = np.diag(np.asarray(plant.mass))
    noise = np.zeros((n, n))
    noise[dof : 2 * dof, dof : 2 * dof] = minv @ (force_covariance * dt**2) @ minv.T
    wander = _accumulated(rate, np.diag(np.concatenate([np.zeros(2 * dof), 2 / tau * (amplitude * mass) ** 2])), dt)
    row = {
        "displacement": np.hstack([eye, zero, zero]),
        "velocity": np.hstack([zero, eye, zero]),
        "acceleration": rate[dof : 2 * dof],
    }
    select = np.asarray(observation.select)
    rows = np.array([s @ row[kind] for kind, s in zip(observation.kinds, select, strict=True)])
    through = np.array(
        [s @ minv if kind == "acceleration" else 0 * s for kind, s in zip(observation.kinds, select, strict=True)]
    )
    sizes = np.concatenate([np.full(dof, length), np.full(dof, length * omega), amplitude * mass])
    start = np.diag((_WIDE * sizes) ** 2)
    arrays: Any = step, noise, rows, variance, start, wander  # of NumPy, to go to the device together
    drive: Any = carried, through
    return _Model(LinearModel(*arrays), *drive)


def _accumulated(
    rate: Float[np.ndarray, "state state"], white: Float[np.ndarray, "state state"], dt: float
) -> Float[np.ndarray, "state state"]:
    """Covariance that white noise of this intensity leaves after a step (Van Loan 1978, IEEE TAC 23, 395)."""
    n = len(rate)
    both = scipy.linalg.expm(np.block([[-rate, white], [np.zeros((n, n)), rate.T]]) * dt)
    found = both[n:, n:].T @ both[:n, n:]
    return (found + found.T) / 2


def _driven(model: _Model, force, values):
    """What the force adds over every step, and the readings less what it adds to them at once."""
    return jnp.einsum("hsd,nhd->ns", model.by_force, force), values - force[:, 0] @ model.through.T


@jit_kept
def _likelihoods(models: _Model, force, values, use, swell):
    return jax.vmap(lambda m: log_likelihood(m.linear, *_driven(m, force, values), use, swell))(models)


@jit_kept
def _smooth(model: _Model, force, values, use, swell):
    size = model.linear.step.shape[0]
    mean, covariance = smoothed(model.linear, *_driven(model, force, values), use, jnp.eye(size), swell)
    return mean, jnp.sqrt(jnp.maximum(jnp.diagonal(covariance, axis1=1, axis2=2), 0.0))
