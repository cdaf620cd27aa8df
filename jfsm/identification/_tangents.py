"""How unknowns change the innovations of one run, the filter staying linear as it was along it.

A small change s of the state, which a change of an unknown has made by some sample, goes the way of the filter's own
linearisation: of channel after channel

    ∂e = -(h s + ∂y),     s <- s + k ∂e + ∂k e,     and then     s <- Φ s + ∂m,

where ∂y and ∂m are what the unknown makes of this reading and of this step alone: differences of single steps from
states that are known, of all samples at once. Gains k follow the noise of the channels, by the same way of covariances.
That h and Φ change, too, is left out: where a hypothesis holds it does not matter, as innovations tell nothing of each
other; where it does not, it is what makes their likelihood rough. What is left of the loop over samples is a product of
matrices, so these slopes cost a small part of those of whole runs where there are many states.

References
----------
N. K. Gupta, R. K. Mehra, IEEE Trans. Autom. Control 19 (1974) 774, of the sensitivities of a filter.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Shaped

from .._traced import jit_kept, kept_result
from .._types import Array
from ..estimation._filter import Passage, State, Stretch, few_states, passages, shown
from ..plant import InterpolatedInput, acceleration, advance_sample, begin, inverse_mass, near, true_force
from ._layout import with_vector
from ._likelihood import NUDGE, SAMPLES, Scene, Slopes, lanes_before, minus_log_density, tail_of

_WIDTH = 16
"""Unknowns that a program changes at a time; fewer are padded, so that one program serves all."""
_COARSER = 4
"""Steps that are one here: a difference of steps needs no short ones."""


def has_tangents(scene: Scene) -> bool:
    """Whether a record's plant has so many states that this pays, and none that jump or answer the past."""
    plant = scene.plant
    jumping = plant.friction, plant.memory, plant.delayed, plant.channel_delay, plant.force_delay
    smooth = isinstance(scene.inputs, InterpolatedInput) and not any(len(part) for part in jumping)
    return smooth and not few_states(plant, scene.readings.zeros)


def slopes_along(
    scene: Scene,
    numbers: Float[np.ndarray, "lanes size"],
    velocity: Float[np.ndarray, "dof dof"],
    use: Shaped[np.ndarray, "n channels"],
) -> Slopes:
    """`Slopes` of the readings that `use` (n, channels) counts, along the run of the first of `numbers`.

    Those of the others (unknowns, size) are what they would be were each unknown larger by the nudge.
    """
    run, many, channels = numbers[0], len(numbers) - 1, use.shape[1]
    scales = (numbers[1:, -channels:] - run[-channels:]) / NUDGE
    lots = [_filled(numbers[1 + i : 1 + i + _WIDTH]) for i in range(0, many, _WIDTH)]
    error, variance, error_by_noise, variance_by_noise, *by_lots = _along(scene, run, velocity, lots, len(use))
    by_error = np.concatenate(by_lots, 2)[:, :, :many] + error_by_noise @ scales.T
    with np.errstate(all="ignore"):
        root = np.sqrt(use)
        standard = root / np.sqrt(variance)
        value = float(np.sum(use * minus_log_density(error, variance)))
        by_spread = variance_by_noise @ scales.T * (root / variance)[:, :, None]
        by_error = by_error * standard[:, :, None]
    by_error, by_spread = (np.moveaxis(a, 2, 0).reshape(many, -1) for a in (by_error, by_spread))
    return Slopes(value, root.ravel(), (error * standard).ravel(), by_error, by_spread, None)


def _filled(rows: np.ndarray) -> np.ndarray:
    """As many rows as a program takes, the last of them repeated."""
    return rows[np.minimum(np.arange(_WIDTH), len(rows) - 1)]


def _along(
    scene: Scene, run: np.ndarray, velocity: np.ndarray, lots: list[np.ndarray], count: int
) -> list[Float[np.ndarray, "n channels ..."]]:
    """Innovations and variances of a run, what the channels' noise makes of both, and of innovations each lot of
    unknowns; a stretch of samples after the other."""
    leaves, static = scene.lowered
    state, dt = jax.tree.map(lambda leaf: leaf[:1], scene.nowhere), np.asarray(scene.inputs.step)
    parts, noise, changes = list[list[Any]](), None, list[Any]()
    for first in range(0, count, SAMPLES):
        stretch = scene.stretch(first)
        stretch = stretch._replace(force=stretch.force[:, :, :1], before=stretch.before[:, :1])
        begins = np.asarray(first == 0)
        state, passed = _passages(static, leaves, run[None], velocity[None], dt, stretch, state, begins)
        if noise is None:
            noise = _no_change(passed)
            changes = [_begin(static, leaves, run, lot, dt, stretch) for lot in lots]
        noise, *of_noise = _by_noise(static, leaves, run, stretch.use, passed, noise)
        of_lots = []
        for k, lot in enumerate(lots):
            changes[k], shows = _by_unknowns(static, leaves, run, lot, dt, stretch, passed, changes[k])
            of_lots.append(shows)
        parts.append([passed.seen.error[:, 0], passed.seen.variance[:, 0], *of_noise, *of_lots])
    return [np.concatenate([np.asarray(a) for a in each])[:count] for each in zip(*parts, strict=True)]


@kept_result
class _Change(NamedTuple):
    """What the logarithms of the channels' noise variances make of a state's covariance (channels, state, state) and
    of itself (state, channels)."""

    covariance: Float[Array, "channels state state"]
    state: Float[Array, "state channels"]


def _no_change(passed: Passage) -> _Change:
    channels, size = passed.rows.shape[2:]
    return _Change(jnp.zeros((channels, size, size)), jnp.zeros((size, channels)))


@jit_kept
def _passages(static: Any, leaves, numbers, velocity, dt, stretch: Stretch, state: State, first: Bool[Array, ""]):
    """State of a lane after a stretch, and its `Passage` (n, 1, ...); arguments as of a run."""
    plants, assumed, observation, state = lanes_before(static, leaves, numbers, velocity, dt, stretch, state, first)
    return passages(plants, assumed, observation, stretch, dt, state)


@jit_kept
def _begin(static: Any, leaves, run, lot, dt, stretch: Stretch) -> Float[Array, "state width"]:
    """Changes of the state at the first sample by each of a lot of unknowns."""
    plant, noise, _ = jax.tree.unflatten(static, leaves)
    inputs = InterpolatedInput(stretch.force[:1, :, 0], stretch.base[:1], stretch.time[:1], dt)

    def at_first(row):
        x0, v0, _ = (a[0] for a in tail_of(plant, row[None], noise.variance.size))
        lane = with_vector(plant, row)
        return _flat(begin(lane, inverse_mass(lane), x0, v0, inputs)[0])

    zeros = jnp.zeros((2 * len(noise.wandering) + len(noise.coloured), len(lot)))
    return jnp.concatenate([(jax.vmap(at_first)(lot) - at_first(run)[None]).T / NUDGE, zeros])


def _flat(motion):
    return jnp.concatenate(motion[:3])


@jit_kept
def _by_unknowns(static: Any, leaves, run, lot, dt, stretch: Stretch, passed: Passage, begins):
    """Changes (state, width) of the state after a stretch that begins with some, and of the innovations
    (n, channels, width), by each of a lot of unknowns."""
    plant, _, observation = jax.tree.unflatten(static, leaves)
    passed = jax.tree.map(lambda a: a[:, 0], passed)
    stride = min(_COARSER, (stretch.base.shape[1] - 1) // 2)
    force, base = stretch.force[:, ::stride, 0], stretch.base[:, ::stride]

    def one(row, predicted, read, force, base, time, table):
        """Readings at a sample, and the state at the next."""
        lane = near(with_vector(plant, row), table, time, dt)
        minv, g = inverse_mass(lane), true_force(lane, force, base)
        x, v, z, mode = predicted
        a = acceleration(lane, minv, x, v, z, mode, g[0], time)[0] + base[0]
        y = (1.0 + lane.channel_gain) * shown(observation, predicted, a) + lane.channel_offset
        return y, _flat(advance_sample(lane, minv, read, g, base, time, dt))

    along = jax.vmap(one, (None, *(0,) * 6))
    samples = passed.predicted, passed.read, force, base, stretch.time, stretch.near
    there = jax.vmap(along, (0, *(None,) * 6), 2)(lot, *samples)
    by_y, by_m = ((new - old[..., None]) / NUDGE for new, old in zip(there, along(run, *samples), strict=True))
    by_m = jnp.pad(by_m, ((0, 0), (0, passed.rows.shape[2] - by_m.shape[1]), (0, 0)))
    return _carried(passed, begins, by_y, jnp.zeros((*by_y.shape[:2], *by_m.shape[1:])), by_m)


@jit_kept
def _by_noise(static: Any, leaves, run, use, passed: Passage, begins: _Change):
    """`_Change` after a stretch that begins with one, and what the logarithms of the channels' noise variances make of
    the innovations and of their variances (n, channels, channels)."""
    plant, noise, _ = jax.tree.unflatten(static, leaves)
    passed = jax.tree.map(lambda a: a[:, 0], passed)
    own = jnp.diag(noise.variance * jnp.exp(tail_of(plant, run[None], noise.variance.size)[2][0]))

    def told(rows, gains, variance, error, use, covariance):
        """What gains and variances of a sample become (channels of the readings first), and covariances after it."""
        moved, spreads = list[Any](), list[Any]()
        for c in range(len(rows)):
            cross = covariance @ rows[c]
            spread = cross @ rows[c] + own[c]
            moved.append((use[c] * error[c] / variance[c]) * (cross - spread[:, None] * gains[c][None]).T)
            spreads.append(spread)
            outer = gains[c][None, :, None] * cross[:, None, :]
            again = spread[:, None, None] * gains[c][None, :, None] * gains[c][None, None, :]
            covariance = covariance - outer - jnp.swapaxes(outer, 1, 2) + again
        return jnp.stack(moved), jnp.stack(spreads), covariance

    each = jax.vmap(told)
    samples = passed.rows, passed.gains, passed.seen.variance, passed.seen.error, use
    through = _through(passed)[1]
    none = jnp.zeros((len(use), *begins.covariance.shape))
    added = jnp.einsum("nij,ncjk,nlk->ncil", passed.step, each(*samples, none)[2], passed.step)

    def sample(covariance, now):
        through, added = now
        return jnp.einsum("ij,cjk,lk->cil", through, covariance, through) + added, covariance

    last, covariances = jax.lax.scan(sample, begins.covariance, (through, added))
    moved, spreads, _ = each(*samples, covariances)
    nothing = jnp.zeros_like(spreads), jnp.zeros((len(use), *begins.state.shape))
    state, by_error = _carried(passed, begins.state, nothing[0], moved, nothing[1])
    return _Change(last, state), by_error, spreads


def _carried(passed: Passage, begins, by_y, by_gain, by_m):
    """Changes (state, width) of the state after a stretch that `begins` with some, and of innovations
    (n, channels, width), where readings change by `by_y` (n, channels, width), what they move by `by_gain`
    (n, channels, state, width), and steps by `by_m` (n, state, width)."""
    shows, through = _through(passed)
    by_error, s = jax.vmap(_read)(passed.rows, passed.gains, jnp.zeros_like(by_m), by_y, by_gain)
    added = jnp.einsum("nij,njw->niw", passed.step, s) + by_m

    def sample(s, now):
        through, added = now
        return through @ s + added, s

    last, along = jax.lax.scan(sample, begins, (through, added))
    return last, by_error + jnp.einsum("ncs,nsw->ncw", shows, along)


def _through(passed: Passage):
    """What becomes of changes of a state: those of the innovations (n, channels, state), and of the next state
    (n, state, state)."""
    channels, size = passed.rows.shape[1:]
    none = jnp.zeros((channels, size)), jnp.zeros((channels, size, size))
    shows, read = jax.vmap(lambda rows, gains: _read(rows, gains, jnp.eye(size), *none))(passed.rows, passed.gains)
    return shows, jnp.einsum("nij,njk->nik", passed.step, read)


def _read(rows, gains, s, by_y, by_gain):
    """Changes of a sample's innovations (channels, width), and of the state (state, width) once it has been read."""
    told = list[Any]()
    for row, gain, y, moved in zip(rows, gains, by_y, by_gain, strict=True):
        by_error = -(row @ s + y)
        s = s + gain[:, None] * by_error[None, :] + moved
        told.append(by_error)
    return jnp.stack(told), s
