"""The likelihood's runs where nothing but masses, springs and dashpots answers the motion.

Runs that differ in no mass, spring, dashpot, gain of a channel or noise obey the same law of the linear filter.
"""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from .._types import Array
from ..estimation._filter import Innovations, few_states
from ..estimation._linear_filter import Course, Errors, Law, follow
from ..plant import InterpolatedInput
from ._drive import between_samples
from ._layout import place_of, with_vector, without_part
from ._likelihood import SAMPLES, Runs, Scene, tail_of

_OWN = ("force_gain", "force_offset", "channel_offset")
"""Of a plant's numbers those that are no part of a law."""
_LOT = 8
"""Lanes and laws are made up to a multiple of this, so that few programs serve all,"""
_MOST = 64
"""and so many lanes go side by side."""


def is_linear(scene: Scene) -> bool:
    """Whether a record is that of a linear plant which the linear filter follows faster than the other does."""
    late = scene.plant.channel_delay.size + scene.plant.force_delay.size
    driven = isinstance(scene.inputs, InterpolatedInput) and not late
    return driven and not scene.has_laws and not few_states(scene.plant, scene.readings.zeros)


def linear_innovations(scene: Scene, runs: Runs, count: int) -> Innovations:
    """Innovations (lanes, count, channels) of a record that `is_linear`, as `innovations_of` gives them."""
    shape = len(runs.numbers), count, scene.readings.values.shape[1]
    empty: Callable[..., Any] = np.zeros
    found = Innovations(empty(shape), empty(shape), empty(shape))
    for begin in range(0, shape[0], _MOST):
        mine = slice(begin, begin + _MOST)
        push = None if runs.push is None else runs.push[mine]
        lot = Runs(runs.numbers[mine], runs.velocity[mine], runs.use, push)
        _put(scene, lot, count, Innovations(*(a[mine] for a in found)))
    return found


def _put(scene: Scene, runs: Runs, count: int, found: Innovations) -> None:
    """Put in what some lanes have `found`, a stretch of samples after the other."""
    assert isinstance(scene.inputs, InterpolatedInput)
    inputs, values = scene.inputs, np.asarray(scene.readings.values)
    course: Any = None
    use: Any = np.asarray(scene.readings.use) if runs.use is None else runs.use
    leaves, static = scene.lowered
    first, lanes = _Lanes.of(scene, runs)
    force: Any = np.asarray(inputs.force)[:count, :, None]
    if runs.push is not None:
        push = _filled(between_samples(runs.push, force.shape[1], count), len(lanes.whose))
        force = force + np.moveaxis(push, 0, 2)
    law = _law(static, inputs.substeps, leaves, runs.numbers[first], runs.velocity[first], np.asarray(inputs.step))
    for begin in range(0, count, SAMPLES):
        end = min(begin + SAMPLES, count)
        some = force[begin:end], np.asarray(inputs.base)[begin:end], values[begin:end], use[begin:end]
        samples = _Samples(*(_filled(a, SAMPLES) for a in some))
        course = Course(lanes.start, law.start) if course is None else course
        course, errors = _follow(law, lanes, samples, np.asarray(end - begin), course)
        error, variance = np.asarray(errors.error)[: end - begin], np.asarray(errors.variance)[: end - begin]
        found.error[:, begin:end] = np.moveaxis(error, 1, 0)[: len(found.error)]
        found.variance[:, begin:end] = np.moveaxis(variance, 1, 0)[lanes.whose[: len(found.error)]]


def _filled(rows: Any, count: int) -> Any:
    """As many rows, the last of them repeated."""
    return rows if len(rows) == count else rows[np.minimum(np.arange(count), len(rows) - 1)]


def _lots(count: int) -> int:
    return -(-count // _LOT) * _LOT


class _Lanes(NamedTuple):
    """Whose law every lane obeys, the gain and zero of its force, the zeros of its channels, and where it begins."""

    whose: Any
    force_gain: Any
    force_offset: Any
    channel_offset: Any
    start: Any

    @classmethod
    def of(cls, scene: Scene, runs: Runs) -> tuple[np.ndarray, "_Lanes"]:
        """The first run of every law, and the lanes of all runs; both a number of lots."""
        plant, shared, count = scene.plant, runs.numbers, len(runs.numbers)
        for name in _OWN:
            plant, shared = without_part(plant, name), np.delete(shared, place_of(plant, name), 1)
        channels = scene.readings.values.shape[1]
        motion = 2 * scene.plant.dof
        tail = shared.shape[1] - motion - channels
        shared = np.concatenate([shared[:, :tail], shared[:, tail + motion :], runs.velocity.reshape(count, -1)], 1)
        first, whose = np.unique(shared, axis=0, return_index=True, return_inverse=True)[1:]
        start = runs.numbers[:, runs.numbers.shape[1] - motion - channels :][:, :motion]
        start = np.pad(start, ((0, 0), (0, len(scene.readings.zeros))))
        own = (runs.numbers[:, place_of(scene.plant, name)] for name in _OWN)
        lanes = cls(*(_filled(a, _lots(count)) for a in (whose.reshape(-1), *own, start)))
        return _filled(first, _lots(len(first))), lanes


class _Samples(NamedTuple):
    """What drives lanes on the half steps of some samples, and what was read."""

    force: Float[Array, "n halves lanes dof"]
    base: Float[Array, "n halves"]
    values: Float[Array, "n channels"]
    use: Float[Array, "n channels"]


@partial(jax.jit, static_argnums=(0, 1))
def _law(
    static: Any,
    substeps: int,
    leaves: list[Array],
    numbers: Float[Array, "laws size"],
    velocity: Float[Array, "laws dof dof"],
    dt: Float[Array, ""],
) -> Law:
    """The law of every row of numbers; `leaves` and `static` are a plant, `Noise` and an `Observation`."""
    plant, noise, observation = jax.tree.unflatten(static, leaves)
    assumed = noise.assumed(tail_of(plant, numbers, noise.variance.size)[2], velocity)
    return jax.vmap(lambda row, assumed: Law.of(with_vector(plant, row), assumed, observation, dt, substeps))(
        numbers, assumed
    )


@jax.jit
def _follow(law: Law, lanes: _Lanes, samples: _Samples, count: Int[Array, ""], course: Course) -> tuple[Course, Errors]:
    """Course after a stretch of `count` samples, and the errors of all lanes."""
    mine = jax.tree.map(lambda leaf: leaf[lanes.whose], law)
    gain, zero, inertia = (a[None, None] for a in (lanes.force_gain, lanes.force_offset, mine.inertia))
    g = (samples.force - zero) / (1.0 + gain) - samples.base[:, :, None, None] * inertia
    moved = jnp.einsum("nhld,lhsd->nls", g, mine.push)
    direct = jnp.einsum("nld,lcd->nlc", g[:, 0], mine.direct) + samples.base[:, :1, None] * mine.based[None]
    read = samples.values[:, None] - lanes.channel_offset[None] - direct
    return follow(law, lanes.whose, moved, read, samples.use, count, course)
