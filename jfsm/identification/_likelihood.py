"""The likelihood of a structure on one record, its gradient and its information matrix, in one compiled program.

With innovations e and their variances S,

    -log L = ½ Σ (e²/S + log 2πS),     F = Σ (∂e ∂eᵀ / S + ½ ∂log S ∂log Sᵀ),

F being the expected information. All derivatives go forward, side by side with the filter itself, and several starts
run as lanes of the same program.
"""

from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..dynamics._grid import Fine
from ..dynamics._imposed import Imposed
from ..dynamics._kernel import jit_with_kernels
from ..dynamics._plant import Plant, Readout
from ..estimation._filter import Innovations, ProcessNoise, Readings, Start, innovations
from ..estimation._imposed import force_innovations
from ._layout import with_vector

_FEW = 32
"""Unknowns up to which derivatives by all of them are taken in one kernel."""
_BLOCKS = 64
"""Stretches of a record whose gradients count as independent of each other."""


class Lanes(eqx.Module):
    """Parameter maps of several starts: base + rows·value(theta), the plant's numbers, then x0, v0, log scales.

    A value is its unit times theta or exp(theta), and times exp(tie·values) where it is tied to its exponent.
    """

    base: Float[Array, "lanes size"]
    rows: Float[Array, "lanes unknowns size"]
    unit: Float[Array, "lanes unknowns"]
    log: Float[Array, "lanes unknowns"]
    tie: Float[Array, "lanes unknowns unknowns"]


def _run(
    plant: Plant,
    lane,
    theta,
    show: Readout,
    fine: Fine | Imposed,
    readings: Readings,
    noise: ProcessNoise,
    doubt,
    one_kernel: bool,
) -> Innovations:
    """Innovations of one start: of a filter that a force drives, or of the force readings along an imposed motion."""
    base, rows, unit, log, tie = lane
    value = unit * jnp.where(log > 0, jnp.exp(jnp.where(log > 0, theta, 0.0)), theta)
    value = value * jnp.exp(tie @ value)
    numbers = base + jnp.sum(rows * value[:, None], 0)
    dof, channels = plant.dof, readings.values.shape[1]
    tail = numbers[numbers.size - 2 * dof - channels :]
    if isinstance(fine, Imposed):
        return force_innovations(with_vector(plant, numbers), show, fine, readings, noise, doubt, tail[2 * dof :])
    start = Start(tail[:dof], tail[dof : 2 * dof], jnp.diag(doubt**2))
    plant = with_vector(plant, numbers)
    return innovations(plant, show, fine, readings, noise, start, tail[2 * dof :], one_kernel=one_kernel)


def _each(one, plant: Plant, lanes: Lanes, theta):
    """What `one` makes of every lane."""
    # Values and places differ between lanes; which law stands in a slot does not, so that it stays a branch.
    axes = jax.tree.map(lambda leaf: 0 if jnp.issubdtype(leaf.dtype, jnp.floating) else None, plant)
    mapped = (lanes.base, lanes.rows, lanes.unit, lanes.log, lanes.tie, theta)
    if theta.shape[0] > 1:
        return jax.vmap(one, in_axes=(axes, 0, 0, 0, 0, 0, 0))(plant, *mapped)
    # One lane alone is not mapped, so that what rarely happens (a reversal) is a branch as well.
    alone = jax.tree.map(lambda leaf: leaf[0] if jnp.issubdtype(leaf.dtype, jnp.floating) else leaf, plant)
    return jax.tree.map(lambda found: found[None], one(alone, *(leaf[0] for leaf in mapped)))


@jit_with_kernels
def derivatives(plant: Plant, lanes: Lanes, theta, show, fine, readings, noise, doubt, until, *, one_kernel: bool):
    """Minus log-likelihood (lanes,), its gradient (lanes, unknowns), and two matrices (lanes, unknowns, unknowns): the
    information, and the sum of outer products of the gradients of `_BLOCKS` stretches of the record.

    Samples from index `until` on take no part. `plant` has a leading axis of lanes on every floating leaf.
    """
    counted = readings.use * (jnp.arange(readings.valid.size) < until)[:, None] * readings.valid[:, None]

    few = one_kernel and theta.shape[1] <= _FEW

    def one(plant, *lane_and_theta):
        *lane, theta = lane_and_theta

        def outcome(theta):
            found = _run(plant, lane, theta, show, fine, readings, noise, doubt, few)
            return found.error, jnp.log(found.variance), found.log_share

        push = partial(jax.jvp, outcome, (theta,))
        (error, log_variance, log_share), slopes = jax.vmap(push, out_axes=(None, 0))((jnp.eye(theta.size),))
        by_error, by_variance, by_share = slopes
        root = jnp.sqrt(counted)
        deviation = root * jnp.exp(-log_variance / 2)
        e, de, ds = error * deviation, by_error * deviation[None], by_variance * root[None]
        value = jnp.sum(0.5 * e**2 + counted * (0.5 * log_variance + 0.5 * jnp.log(2 * jnp.pi) - log_share))
        de, ds, by_share = (array.reshape(theta.size, -1) for array in (de, ds, counted[None] * by_share))
        # d(log L)/d(theta) of every reading; their sum is the gradient, their sums over stretches tell how it scatters.
        scores = de * e.ravel()[None] + 0.5 * ds * (root - e**2 / jnp.maximum(root, 1e-30)).ravel()[None] - by_share
        block = jnp.arange(counted.shape[0]) * _BLOCKS // jnp.maximum(until, 1)
        inside = jax.nn.one_hot(block, _BLOCKS, dtype=scores.dtype)
        stretches = jnp.sum(scores.reshape(theta.size, counted.shape[0], -1), 2) @ inside
        return value, jnp.sum(scores, 1), de @ de.T + 0.5 * ds @ ds.T, stretches @ stretches.T

    return _each(one, plant, lanes, theta)


@jit_with_kernels
def predictions(
    plant: Plant, lanes: Lanes, theta, show, fine, readings, noise, doubt, *, one_kernel: bool
) -> Innovations:
    """Innovations (lanes, n, channels) of every lane."""

    few = one_kernel and theta.shape[1] <= _FEW

    def one(plant, *lane_and_theta):
        *lane, theta = lane_and_theta
        return _run(plant, lane, theta, show, fine, readings, noise, doubt, few)

    return _each(one, plant, lanes, theta)
