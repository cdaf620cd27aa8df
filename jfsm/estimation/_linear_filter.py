"""The filter of linear plants: the innovations of `_filter.run` from matrices that are formed once.

The covariance of a linear plant does not depend on what is read. So lanes that differ in their starts, in what drives
them or in the zeros of their sensors share its gains, and only their means go through the samples. A covariance that
has settled is kept, with its gains, while the same channels are read.

A sample's readings are taken one after the other, and what they make of the mean is kept as a matrix: the update of
every mean at once. A reading that is not used tells the later ones nothing.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from .._types import Array
from ..plant import Observation, Plant, inverse_mass, times
from ._filter import Assumed, Known, beside, short_transition, transition, zeros_of
from ._measurement_update import measurement_update

_SETTLED = 1e-12
"""Change of a covariance in a sample, in standard deviations, that is none. What is still to come is that times the
samples that the filter remembers, thousands at most. Where little stirs the structure nothing settles."""


class Law(NamedTuple):
    """Constants of every sample: of the state (x, v, zeros of channels), of its covariance, and of readings.

    From a sample to the next `transition` multiplies the mean, and `push` times the forces on the half steps moves it.
    The covariance follows `spread`, which differs from `transition` where steps are no power of two, and grows by
    `added`. Channels show the state by `shown`, the forces by `direct`, the acceleration of the base by `based`.
    """

    transition: Float[Array, "state state"]
    push: Float[Array, "halves state dof"]
    spread: Float[Array, "state state"]
    added: Float[Array, "state state"]
    start: Float[Array, "state state"]
    shown: Float[Array, "channels state"]
    direct: Float[Array, "channels dof"]
    based: Float[Array, " channels"]
    noise: Float[Array, " channels"]
    inertia: Float[Array, " dof"]

    @classmethod
    def of(cls, plant: Plant, assumed: Assumed, observation: Observation, dt: Float[Array, ""], substeps: int) -> "Law":
        known, minv, dof = Known.of(plant, assumed), inverse_mass(plant), plant.dof
        answer = -jnp.concatenate([minv @ plant.stiffness, minv @ plant.damping], 1)
        rates = jnp.concatenate([jnp.eye(dof, 2 * dof, dof), answer])
        step, push = _runge_kutta(rates, minv, dt / substeps, substeps)
        zeros, gain = zeros_of(assumed), 1.0 + plant.channel_gain
        seen = {"displacement": jnp.eye(dof, 2 * dof), "velocity": jnp.eye(dof, 2 * dof, dof), "acceleration": answer}
        rows = jnp.stack([row @ seen[kind] for row, kind in zip(observation.select, observation.kinds, strict=True)])
        added_to = np.array([[channel == c for channel in zeros] for c in range(len(observation.kinds))], float)
        driven = gain * np.array([kind == "acceleration" for kind in observation.kinds], float)
        return cls(
            beside(step, known.transition),
            jnp.pad(push, ((0, 0), (0, len(zeros)), (0, 0))),
            beside(transition(rates, dt, substeps), known.transition),
            beside(known.added, known.process_noise),
            assumed.begin(),
            jnp.concatenate([gain[:, None] * rows, added_to.reshape(len(rows), len(zeros))], 1),
            driven[:, None] * (observation.select @ minv),
            driven * jnp.sum(observation.select, 1),
            known.variances,
            jnp.sum(plant.mass, 1),
        )


def _runge_kutta(rates, minv, step, substeps: int):
    """What the Runge-Kutta steps of a sample make of the state, and of the forces on their half steps."""
    dof, one, exponent = minv.shape[0], jnp.eye(rates.shape[0]), step * rates
    square, by_force = exponent @ exponent, step / 6 * jnp.concatenate([jnp.zeros((dof, dof)), minv])
    first, middle = one + exponent + square / 2 + square @ exponent / 4, 4 * one + 2 * exponent + square / 2
    nodes = jnp.stack([first @ by_force, middle @ by_force, by_force])
    along = short_transition(exponent)
    whole, after = jax.lax.scan(lambda power, _: (along @ power, power), one, length=substeps)
    pushes = after[::-1, None] @ nodes[None]  # of each step, by what the steps after it make of it
    push = jnp.zeros((2 * substeps + 1, 2 * dof, dof))
    for node in range(3):
        push = push.at[node : node + 2 * substeps - 1 : 2].add(pushes[:, node])
    return whole, push


class Course(NamedTuple):
    """Where lanes and their laws stand before a sample: means, and covariances."""

    mean: Float[Array, "lanes state"]
    covariance: Float[Array, "laws state state"]


class Errors(NamedTuple):
    """Innovations of lanes (n, lanes, channels), and their variances (n, laws, channels), which lanes share."""

    error: Float[Array, "n lanes channels"]
    variance: Float[Array, "n laws channels"]


def follow(
    laws: Law,
    whose: Int[Array, " lanes"],
    moved: Float[Array, "n lanes state"],
    read: Float[Array, "n lanes channels"],
    use: Float[Array, "n channels"],
    count: Int[Array, ""],
    course: Course,
) -> tuple[Course, Errors]:
    """Course of all lanes after `count` samples, and their errors, of which those beyond are nothing.

    `whose` law each lane obeys, how far each sample `moved` it, and what it `read` besides what the state shows.
    """
    again = jnp.concatenate([jnp.zeros(1, bool), jnp.all(use[1:] == use[:-1], 1)])
    sees = jnp.concatenate([laws.shown, laws.transition], 1)[whose]
    channels = use.shape[1]

    def move(k, mean, gains: Float[Array, "lanes out channels"]):
        """Means after a sample, and its errors."""
        seen = jax.vmap(times)(sees, mean)
        tells = jax.vmap(times)(gains, read[k] - seen[:, :channels])
        return seen[:, channels:] + tells[:, channels:] + moved[k], tells[:, :channels]

    def learn(carry: _Carry) -> _Carry:
        """One sample with new gains."""
        k, course, errors, _, _ = carry
        gains, variance, covariance = jax.vmap(_learned, (0, 0, None))(laws, course.covariance, use[k])
        mean, error = move(k, course.mean, gains[whose])
        errors = Errors(errors.error.at[k].set(error), errors.variance.at[k].set(variance))
        size = jnp.sqrt(jnp.diagonal(covariance, axis1=1, axis2=2))
        change = jnp.abs(covariance - course.covariance)
        settled = again[k] & jnp.all(change <= _SETTLED * size[:, :, None] * size[:, None, :])
        return _Carry(k + 1, Course(mean, covariance), errors, gains, settled)

    def keep(carry: _Carry) -> _Carry:
        """All samples that the same gains serve."""
        gains, variance = carry.gains[whose], carry.errors.variance[carry.k - 1]

        def one(carry):
            k, mean, errors = carry
            mean, error = move(k, mean, gains)
            return k + 1, mean, Errors(errors.error.at[k].set(error), errors.variance.at[k].set(variance))

        start = carry.k, carry.course.mean, carry.errors
        k, mean, errors = jax.lax.while_loop(lambda now: (now[0] < count) & again[now[0]], one, start)
        return _Carry(k, Course(mean, carry.course.covariance), errors, carry.gains, jnp.zeros((), bool))

    def both(carry: _Carry) -> _Carry:
        return keep(jax.lax.while_loop(lambda now: (now.k < count) & ~now.settled, learn, carry))

    (n, lanes, _), (many, size) = read.shape, laws.transition.shape[:2]
    nothing = Errors(jnp.zeros((n, lanes, channels)), jnp.ones((n, many, channels)))
    begin = _Carry(
        jnp.zeros((), count.dtype), course, nothing, jnp.zeros((many, channels + size, channels)), jnp.zeros((), bool)
    )
    end = jax.lax.while_loop(lambda now: now.k < count, both, begin)
    return end.course, end.errors


class _Carry(NamedTuple):
    """What the loops over samples carry: the next sample, and the gains of the last one."""

    k: Int[Array, ""]
    course: Course
    errors: Errors
    gains: Float[Array, "laws out channels"]
    settled: Bool[Array, ""]


def _learned(law: Law, covariance, use):
    """Gains (channels + state, channels), variances, and the covariance a sample later.

    Of differences between readings and what was predicted before the sample, gains make those of one reading after the
    other, and below what all used ones add to the state a sample later. The loop over channels keeps programs small.
    """
    channels, size = law.shown.shape

    def read(known, channel):
        moved, covariance = known
        row, of_reading, noise, counted = channel
        error = of_reading - jnp.sum(row[:, None] * moved, 0)

        def update(mean, error):
            return tuple(measurement_update(mean, covariance, row, error, noise, counted))

        moved, updated, variance, _ = jax.vmap(update, (1, 0), (1, None, None, None))(moved, error)
        return (moved, updated), (error, variance)

    each = law.shown, jnp.eye(channels), law.noise, use
    (moved, updated), (apart, variance) = jax.lax.scan(read, (jnp.zeros((size, channels)), covariance), each)
    after = law.spread @ updated @ law.spread.T + law.added
    return jnp.concatenate([apart, law.transition @ moved]), variance, after
