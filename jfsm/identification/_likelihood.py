"""The likelihood of a structure on one record, its gradient and its information matrix, in one compiled program.

With innovations e and their variances S,

    -log L = ½ Σ (e²/S + log 2πS),     F = Σ (∂e ∂eᵀ / S + ½ ∂log S ∂log Sᵀ),

F being the expected information. All derivatives go forward, side by side with the filter itself, and several starts
run as lanes of the same program.
"""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..dynamics._grid import Fine
from ..dynamics._imposed import Imposed
from ..dynamics._kernel import jit_with_kernels
from ..dynamics._plant import Plant, Readout
from ..estimation._filter import (
    Innovations,
    ProcessNoise,
    Readings,
    Start,
    begun,
    innovations,
    loop_of,
    one_sample,
    samples_of,
)
from ..estimation._imposed import force_innovations
from ._colour import Colour
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


class _Seen(NamedTuple):
    """Innovations (n, channels), with the logarithm of their variance."""

    error: Float[Array, "n channels"]
    log_variance: Float[Array, "n channels"]
    log_share: Float[Array, "n channels"]

    @classmethod
    def of(cls, found: Innovations) -> "_Seen":
        return cls(found.error, jnp.log(found.variance), found.log_share)


@jit_with_kernels
def derivatives(plant: Plant, lanes: Lanes, theta, show, fine, readings, noise, doubt, until, *, one_kernel: bool):
    """Minus log-likelihood (lanes,), its gradient (lanes, unknowns), and two matrices (lanes, unknowns, unknowns): the
    information, and the sum of outer products of the gradients of `_BLOCKS` stretches of the record.

    Samples from index `until` on take no part. `plant` has a leading axis of lanes on every floating leaf.
    """
    counted = readings.use * (jnp.arange(readings.valid.size) < until)[:, None] * readings.valid[:, None]
    few = one_kernel and theta.shape[1] <= _FEW
    if isinstance(fine, Imposed):
        found, slopes = _slopes_of_forces(plant, lanes, theta, show, fine, readings, noise, doubt)
    else:
        found, slopes = _slopes_of_motion(plant, lanes, theta, show, fine, readings, noise, doubt, one_kernel=few)

    def sums(found: _Seen, slopes: _Seen):
        size, root = theta.shape[1], jnp.sqrt(counted)
        deviation = root * jnp.exp(-found.log_variance / 2)
        e, de, ds = found.error * deviation, slopes.error * deviation[None], slopes.log_variance * root[None]
        normal = 0.5 * found.log_variance + 0.5 * jnp.log(2 * jnp.pi)
        value = jnp.sum(0.5 * e**2 + counted * (normal - found.log_share))
        de, ds, by_share = (array.reshape(size, -1) for array in (de, ds, counted[None] * slopes.log_share))
        # d(log L)/d(theta) of every reading; their sum is the gradient, their sums over stretches tell how it scatters.
        scores = de * e.ravel()[None] + 0.5 * ds * (root - e**2 / jnp.maximum(root, 1e-30)).ravel()[None] - by_share
        block = jnp.arange(counted.shape[0]) * _BLOCKS // jnp.maximum(until, 1)
        inside = jax.nn.one_hot(block, _BLOCKS, dtype=scores.dtype)
        stretches = jnp.sum(scores.reshape(size, counted.shape[0], -1), 2) @ inside
        return value, jnp.sum(scores, 1), de @ de.T + 0.5 * ds @ ds.T, stretches @ stretches.T

    return _each(sums, theta.shape[0])(found, slopes)


@jit_with_kernels
def predictions(
    plant: Plant, lanes: Lanes, theta, show, fine, readings, noise, doubt, *, one_kernel: bool
) -> Innovations:
    """Innovations (lanes, n, channels) of every lane."""
    few = one_kernel and theta.shape[1] <= _FEW
    floats, fixed = eqx.partition(plant, eqx.is_inexact_array)

    def one(floats, lane, theta):
        plant, numbers = eqx.combine(floats, fixed), _numbers(lane, theta)
        if isinstance(fine, Imposed):
            return _forces(plant, numbers, show, fine, readings, noise, doubt)
        start, log_scale = _start(plant, numbers, readings, doubt)
        plant = with_vector(plant, numbers)
        return innovations(plant, show, fine, readings, noise, start, log_scale, one_kernel=few)

    return _each(one, theta.shape[0])(floats, lanes, theta)


@eqx.filter_jit
def slope_by_colour(plant: Plant, lanes: Lanes, theta, show, fine, readings, noise, doubt, until, values, channels):
    """Minus log-likelihood at `theta` (unknowns,) of one lane, and its gradient by the `values` of a `Colour` of these
    channels."""
    floats, fixed = eqx.partition(plant, eqx.is_inexact_array)
    plant, lane = eqx.combine(jax.tree.map(lambda leaf: leaf[0], floats), fixed), jax.tree.map(lambda a: a[0], lanes)
    counted = readings.use * (jnp.arange(readings.valid.size) < until)[:, None] * readings.valid[:, None]

    def cost(values):
        colour = Colour.of(values, channels)
        seen, numbers = colour.on(readings), _numbers(lane, theta)
        start, log_scale = _start(plant, numbers, seen, doubt)
        stirred = colour.of_force(noise)
        found = innovations(with_vector(plant, numbers), show, fine, seen, stirred, start, log_scale)
        value = jnp.sum(counted * (found.error**2 / found.variance / 2 + jnp.log(found.variance) / 2 - found.log_share))
        return value, value

    slope, value = jax.jacfwd(cost, has_aux=True)(values)
    return value, slope


def _slopes_of_motion(
    plant: Plant, lanes: Lanes, theta, show, fine: Fine, readings, noise, doubt, *, one_kernel: bool
) -> tuple[_Seen, _Seen]:
    """What the filter sees, and its slopes (lanes, unknowns, n, channels).

    These are taken of one sample at a time, inside the loop. Those of the loop are the same, but to find them JAX goes
    over all of what is in it several times, and programs take longer to trace.
    """
    count, late = theta.shape[0], plant.force_delay.size > 0
    floats, fixed = eqx.partition(plant, eqx.is_inexact_array)

    def before(floats, lane, theta):
        plant = eqx.combine(floats, fixed)

        def at(theta):
            numbers = _numbers(lane, theta)
            start, log_scale = _start(plant, numbers, readings, doubt)
            known, state, drive = begun(with_vector(plant, numbers), fine, readings, start, log_scale)
            state, modes = eqx.partition(state, eqx.is_inexact_array)
            return ((numbers, known), state, drive if late else drive._replace(force=None)), modes

        return _pushed(at, (theta,), (jnp.eye(theta.size),))

    (held, state, drive), (held_slopes, state_slopes, drive_slopes), modes = _each(before, count)(floats, lanes, theta)

    def body(carry, inputs):
        force, sample, drive, drive_slopes = inputs

        def one(floats, modes, at, slopes):
            plant = eqx.combine(floats, fixed)

            def onward(held, state, drive):
                numbers, known = held
                after, found = one_sample(
                    with_vector(plant, numbers), known, show, noise, fine.step, readings.zeros,
                    eqx.combine(state, modes), drive if late else drive._replace(force=force), sample,
                )  # fmt: skip
                after, modes_after = eqx.partition(after, eqx.is_inexact_array)
                return (after, _Seen.of(found)), modes_after

            (after, seen), (after_slopes, seen_slopes), modes_after = _pushed(onward, at, slopes)
            return (after, after_slopes, modes_after), (seen, seen_slopes)

        state, slopes, modes = carry
        return _each(one, count)(floats, modes, (held, state, drive), (held_slopes, slopes, drive_slopes))

    loop = loop_of(eqx.combine(jax.tree.map(lambda leaf: leaf[0], floats), fixed), readings, one_kernel)
    inputs = (fine.force, samples_of(fine, readings), _moved(drive, 1, 0), _moved(drive_slopes, 2, 0))
    found, slopes = loop(body, (state, state_slopes, modes), inputs)[1]
    return _moved(found, 0, 1), _moved(slopes, 0, 2)


def _slopes_of_forces(
    plant: Plant, lanes: Lanes, theta, show, fine: Imposed, readings, noise, doubt
) -> tuple[_Seen, _Seen]:
    """The same of force readings along an imposed motion."""
    floats, fixed = eqx.partition(plant, eqx.is_inexact_array)

    def one(floats, lane, theta):
        def at(theta):
            numbers = _numbers(lane, theta)
            found = _forces(eqx.combine(floats, fixed), numbers, show, fine, readings, noise, doubt)
            return _Seen.of(found), None

        return _pushed(at, (theta,), (jnp.eye(theta.size),))[:2]

    return _each(one, theta.shape[0])(floats, lanes, theta)


def _each(one: Callable[..., Any], count: int) -> Callable[..., Any]:
    """What `one` makes of every lane; all arguments have a leading axis of lanes.

    One lane alone is not mapped, so that what rarely happens (a reversal) is a branch.
    """

    def alone(*arguments):
        found = one(*jax.tree.map(lambda leaf: leaf[0], arguments))
        return jax.tree.map(lambda leaf: leaf[None], found)

    return jax.vmap(one) if count > 1 else alone


def _moved(tree: Any, axis: int, to: int) -> Any:
    return jax.tree.map(lambda leaf: jnp.moveaxis(leaf, axis, to), tree)


def _pushed(function: Callable[..., Any], at: tuple, slopes: tuple) -> tuple[Any, Any, Any]:
    """What `function` gives, its derivatives along each of the `slopes`, and what it gives that has none."""
    push = partial(jax.jvp, function, at, has_aux=True)
    return jax.vmap(push, out_axes=(None, 0, None))(slopes)


def _numbers(lane: Lanes, theta: Float[Array, " unknowns"]) -> Float[Array, " size"]:
    """The numbers of one lane."""
    value = lane.unit * jnp.where(lane.log > 0, jnp.exp(jnp.where(lane.log > 0, theta, 0.0)), theta)
    value = value * jnp.exp(lane.tie @ value)
    return lane.base + jnp.sum(lane.rows * value[:, None], 0)


def _start(plant: Plant, numbers, readings: Readings, doubt) -> tuple[Start, Float[Array, " channels"]]:
    """The first state, and logarithms of the factors on the channels' noise variances."""
    dof, channels = plant.dof, readings.values.shape[1]
    tail = numbers[numbers.size - 2 * dof - channels :]
    return Start(tail[:dof], tail[dof : 2 * dof], jnp.diag(doubt**2)), tail[2 * dof :]


def _forces(plant: Plant, numbers, show: Readout, fine: Imposed, readings, noise: ProcessNoise, doubt) -> Innovations:
    """Innovations of the force readings along an imposed motion."""
    log_scale = numbers[numbers.size - readings.values.shape[1] :]
    return force_innovations(with_vector(plant, numbers), show, fine, readings, noise, doubt, log_scale)
