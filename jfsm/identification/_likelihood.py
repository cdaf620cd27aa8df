"""The likelihood of a structure on one record: runs of the filter side by side, and what they differ by.

With innovations e and their variances S,

    -log L = ½ Σ (e²/S + log 2πS),     F = Σ (∂e ∂eᵀ / S + ½ ∂log S ∂log Sᵀ),

F being the expected information. Derivatives are differences of runs, lanes of the same program: a lane costs a tenth
of a run by itself, the program of runs alone is compiled in a third of the time that one with derivatives takes, and no
rule of differentiation has to know what a law does.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Shaped

from .._types import Array
from ..estimation._filter import Assumed, Innovations, ProcessNoise, Readings, State, Stretch, begun, on_lanes, run
from ..estimation._imposed import force_innovations
from ..plant import DelayBuffer, Imposed, InterpolatedInput, Observation, Plant, Tabulated, jit_with_kernels
from ._drive import between_samples, forces_before, undelayed_force
from ._layout import place_of, with_vector, without_part

SAMPLES = 1024
"""Samples that a program runs at a time; fewer are padded, so that one program serves records of any length."""
_KEPT = 8
"""Stretches of a record that are kept, the first ones: those of a long one would fill the memory."""
_BLOCKS = 64
"""Stretches of a record whose gradients count as independent of each other."""
_PIECE = 256
"""Columns of a product that one core is faster with."""
NUDGE = 1e-6
"""Change of an unknown that shows what it does."""
_HANDFUL, _MOSTLY = 8, 0.5
"""Where so few readings like the greatest hold such a share of what an unknown does, a lane may have jumped: it is
asked the other way round, too."""
RUNS = 8
"""Runs that a program does side by side; fewer are repeated, so that one program serves all."""


class Slopes(NamedTuple):
    """Minus log-likelihood of some readings, and how unknowns change it.

    Readings (n·channels,) stand in a row. `error` are the innovations in their standard deviations, times the square
    `root` of how much each counts. `by_error` and `by_spread` (unknowns, n·channels) are changes of these and of the
    logarithms of their variances; `by_share` of the logarithms of what mixtures add, or None.
    """

    value: float
    root: Float[np.ndarray, " readings"]
    error: Float[np.ndarray, " readings"]
    by_error: Float[np.ndarray, "unknowns readings"]
    by_spread: Float[np.ndarray, "unknowns readings"]
    by_share: Float[np.ndarray, "unknowns readings"] | None

    @property
    def gradient(self) -> Float[np.ndarray, " unknowns"]:
        with np.errstate(all="ignore"):  # a lane that runs away is told by its value
            slope = self.by_error @ self.error + self.by_spread @ self._by_variance
            return slope if self.by_share is None else slope - self.by_share.sum(1)

    @property
    def information(self) -> Float[np.ndarray, "unknowns unknowns"]:
        with np.errstate(all="ignore"):
            return _gram(self.by_error) + 0.5 * _gram(self.by_spread)

    @property
    def scatter(self) -> Float[np.ndarray, "unknowns unknowns"]:
        """Sum of the outer products of the gradients of `_BLOCKS` stretches."""
        scores = self.by_error * self.error + self.by_spread * self._by_variance
        if self.by_share is not None:
            scores = scores - self.by_share
        begins = np.unique(-(-np.arange(_BLOCKS) * self.error.size // _BLOCKS))
        stretches = np.add.reduceat(scores, begins[begins < self.error.size], 1)
        return stretches @ stretches.T

    @property
    def _by_variance(self) -> np.ndarray:
        return 0.5 * (self.root - self.error**2 / np.maximum(self.root, 1e-30))


def _gram(rows: np.ndarray) -> np.ndarray:
    """Products of rows (unknowns, n) with each other.

    They are taken in pieces that BLAS gives to no threads, which wait for each other longer than they work; it would
    whatever their size, were the second factor not a copy.
    """
    pieces = np.array_split(rows, max(rows.shape[1] // _PIECE, 1), 1)
    return np.sum([piece @ piece.T.copy() for piece in pieces], 0)


def values_and_slopes(
    run: Callable[[np.ndarray, np.ndarray], Innovations],
    thetas: Float[np.ndarray, "lanes unknowns"],
    use: Shaped[np.ndarray, "n channels"],
    jumps: bool = True,
) -> list[Slopes]:
    """`Slopes` of each lane at its values (lanes, unknowns), of the readings that `use` (n, channels) counts.

    `run` gives the innovations (runs, n, channels) of lanes (runs,), in ascending order, at values (runs, unknowns).
    Lanes that seem to have jumped are asked the other way round, if they can: those of laws.
    """
    count, size = thetas.shape
    nudges, counts = NUDGE * np.eye(size), use.ravel()

    def in_rows(lanes: np.ndarray, values: np.ndarray) -> Any:
        return Innovations(*(a.reshape(len(values), -1) for a in run(lanes, values)))

    around = thetas[:, None] + np.concatenate([np.zeros((1, size)), nudges])
    found = in_rows(np.repeat(np.arange(count), size + 1), around.reshape(-1, size))
    lanes = [_Differences(Innovations(*(a[k * (size + 1) :][: size + 1] for a in found)), counts) for k in range(count)]
    back = [(lane, k) for lane, one in enumerate(lanes) for k in np.flatnonzero(one.jumped) if jumps]
    if back:
        of, which = np.array(back).T
        other = in_rows(of, thetas[of] - nudges[which])
        for lane, one in enumerate(lanes):
            one.flattened(Innovations(*(a[of == lane] for a in other)))
    return [one.slopes for one in lanes]


class _Differences:
    """Differences between the innovations (1 + unknowns, readings) of a run and of those with each unknown nudged."""

    def __init__(self, found: Any, use: Float[np.ndarray, " readings"]):
        self.base: Any = Innovations(*(a[0] for a in found))
        self.use, self.root = use, np.sqrt(use)
        with np.errstate(all="ignore"):
            self.standard = self.root / np.sqrt(self.base.variance)
            self.changes = self._changes(Innovations(*(a[1:] for a in found)), NUDGE)
            power = self.changes[0] ** 2 + 0.5 * self.changes[1] ** 2
            self.jumped = _HANDFUL * np.max(power, 1, initial=0.0) > _MOSTLY * np.sum(power, 1)

    def _changes(self, lanes: Any, nudge: float) -> list[np.ndarray]:
        by_error = (lanes.error - self.base.error) * (self.standard / nudge)
        by_spread = np.log(lanes.variance / self.base.variance) * (self.root / nudge)
        mixed = bool(np.any(self.base.log_share))
        return [by_error, by_spread, *([(lanes.log_share - self.base.log_share) * (self.use / nudge)] if mixed else [])]

    def flattened(self, back: Any) -> None:
        """The smaller of both differences for unknowns that `jumped`, whose runs nudged `back` are these."""
        with np.errstate(all="ignore"):
            for mine, other in zip(self.changes, self._changes(back, -NUDGE), strict=True):
                mine[self.jumped] = np.where(np.abs(other) < np.abs(mine[self.jumped]), other, mine[self.jumped])

    @property
    def slopes(self) -> Slopes:
        with np.errstate(all="ignore"):
            density = minus_log_density(self.base.error, self.base.variance) - self.base.log_share
            value = float(np.sum(self.use * density))
        by_error, by_spread, *by_share = self.changes
        return Slopes(value, self.root, self.base.error * self.standard, by_error, by_spread, *(by_share or [None]))


def loss(found: Innovations, use: Shaped[np.ndarray, "n channels"]) -> Float[np.ndarray, " lanes"]:
    """Minus log-likelihoods of lanes (lanes, n, channels), of the readings that `use` (n, channels) counts."""
    error, variance, log_share = map(np.asarray, found)
    with np.errstate(all="ignore"):
        return np.sum(use * (minus_log_density(error, variance) - log_share), (1, 2))


def minus_log_density(error: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """Minus the logarithm of the normal density of errors about zero."""
    return 0.5 * (error**2 / variance + np.log(2 * np.pi * variance))


class Runs(NamedTuple):
    """What lanes are to do on one record.

    `numbers` (lanes, size) are those of each plant, then x0, v0 and logarithms of the factors on the channels' noise;
    `velocity` (lanes, dof, dof) is their process noise, `use` (n, channels) which readings they use, where not all that
    the record has, `push` (lanes, n, dof), if there is any, a force that drives them as well.
    """

    numbers: Float[np.ndarray, "lanes numbers"]
    velocity: Float[np.ndarray, "lanes dof dof"]
    use: Shaped[np.ndarray, "n channels"] | None = None
    push: Float[np.ndarray, "lanes n dof"] | None = None

    def split(self) -> list["Runs"]:
        """As many at a time as run side by side, the last of them repeated."""
        count = len(self.numbers)
        lots = [np.minimum(np.arange(i, i + RUNS), count - 1) for i in range(0, count, RUNS)]
        return [
            Runs(self.numbers[lot], self.velocity[lot], self.use, None if self.push is None else self.push[lot])
            for lot in lots
        ]


@dataclass(frozen=True)
class Scene:
    """What all lanes share.

    A plant (of it the numbers that parameters can change do not matter), which channels show what, what is imposed, the
    readings, and the standard deviation (state,) of the state at the first sample. `stretches` keeps those of the
    record, by their first sample. `near` is how a plant of its own motion moves near the record's.
    """

    plant: Plant
    observation: Observation
    inputs: InterpolatedInput | Imposed
    readings: Readings
    doubt: Any
    stretches: dict[int, Stretch]
    near: Tabulated | None = None

    @property
    def has_laws(self) -> bool:
        """Whether anything but linear springs, dashpots and masses acts."""
        plant = self.plant
        others = plant.friction, plant.memory, plant.delayed, plant.maps
        own = plant.own is not None or self.near is not None
        return any(len(part) for part in others) or bool(np.any(plant.smooth.direction)) or own

    @cached_property
    def lowered(self) -> tuple[list[Array], Any]:
        """Arrays on the device, and the tree of plant, noise and observation; the drive has the force's delay."""
        seen = without_part(self.plant, "force_delay"), Noise.of(self.readings, self.doubt), self.observation
        leaves, static = jax.tree.flatten(seen)
        return jax.device_put(leaves), static

    @cached_property
    def nowhere(self) -> State:
        """A state of all lanes before there is any, on the device."""
        plant, readings = self.plant, self.readings
        dof, slots, reach = plant.dof, len(plant.friction), plant.reach if len(plant.delayed) else 0
        motion, zeros = 2 * dof + plant.hidden, 2 * len(readings.wandering) + len(readings.coloured)
        none: Callable[..., Any] = np.zeros
        buffer = DelayBuffer(none((RUNS, reach, dof)), none((RUNS, reach, dof)), none(RUNS, int))
        return jax.device_put(State(
            none((RUNS, dof)), none((RUNS, dof)), none((RUNS, plant.hidden)), none((RUNS, slots), int), buffer,
            none((RUNS, motion + zeros, motion + zeros)), none((RUNS, slots)), none((RUNS, zeros)),
        ))  # fmt: skip

    def stretch(self, begin: int) -> Stretch:
        """Samples from `begin`, as many as a program runs, as the record has them."""
        found = self._recorded(begin)
        if self.near is None:
            return found
        if begin not in self._rows:
            self._rows[begin] = jax.device_put(jax.tree.map(lambda rows: _padded(rows, begin, "edge"), self.near))
        return found._replace(near=self._rows[begin])

    @cached_property
    def _rows(self) -> dict[int, Tabulated]:
        """Of the table, by the first sample."""
        return {}

    def _recorded(self, begin: int) -> Stretch:
        """The same without a table."""
        if begin in self.stretches:
            return self.stretches[begin]
        inputs, readings = self.inputs, self.readings
        assert isinstance(inputs, InterpolatedInput)
        arrays: Any = inputs.force, inputs.base, inputs.time, readings.values, readings.use
        force, base, time, values, use = (_padded(np.asarray(array), begin) for array in arrays)
        lanes: Any = np.broadcast_to(force[:, :, None], (*force.shape[:2], RUNS, force.shape[2]))
        before: Any = np.zeros((SAMPLES, RUNS, 0, 5, force.shape[2] + 1))
        found = jax.device_put(Stretch(lanes, base, before, time, values, use))
        if len(self.stretches) < _KEPT:
            self.stretches[begin] = found
        return found


def innovations_of(scene: Scene, runs: Runs, count: int) -> Innovations:
    """Innovations (lanes, count, channels) of all lanes on the first `count` samples."""
    along = _along_motion if isinstance(scene.inputs, Imposed) else _filtered
    shape = len(runs.numbers), count, scene.readings.values.shape[1]
    empty: Callable[..., Any] = np.empty
    found = Innovations(empty(shape), empty(shape), empty(shape))
    for k, lot in enumerate(runs.split()):
        mine = slice(k * RUNS, min((k + 1) * RUNS, shape[0]))
        along(scene, lot, count, Innovations(*(a[mine] for a in found)))
    return found


def _filtered(scene: Scene, runs: Runs, count: int, found: Innovations) -> None:
    """Put in what a full set of lanes has `found`, or the first of them, a stretch of samples after the other."""
    leaves, static = scene.lowered
    numbers = np.delete(runs.numbers, place_of(scene.plant, "force_delay"), 1)
    drive, state, dt = _Drive.of(scene, runs, count), scene.nowhere, np.asarray(scene.inputs.step)
    parts = []
    for begin in range(0, count, SAMPLES):
        stretch = drive.put_in(scene.stretch(begin), begin, runs.use)
        state, seen = _run(static, leaves, numbers, runs.velocity, dt, stretch, state, np.asarray(begin == 0))
        parts.append(seen)
    for k, part in enumerate(parts):  # all are on their way by now
        rows = slice(k * SAMPLES, min((k + 1) * SAMPLES, count))
        for whole, lanes in zip(found, part, strict=True):
            whole[:, rows] = np.asarray(lanes)[: rows.stop - rows.start, : len(whole)].swapaxes(0, 1)


def _padded(rows: np.ndarray, begin: int, mode: Literal["constant", "edge"] = "constant") -> Any:
    """Rows from `begin`, as many as a program runs, zero where there are none, or the last again."""
    mine = rows[begin : begin + SAMPLES].astype(float, copy=False)
    return np.pad(mine, ((0, SAMPLES - len(mine)), *((0, 0),) * (rows.ndim - 1)), mode)


class Noise(eqx.Module):
    """What all lanes assume of noise, before their own factors on that of the channels."""

    variance: Float[Array, " channels"]
    wander: Float[Array, "wandering 2"]
    colour: Float[Array, "coloured 2"]
    doubt: Float[Array, " state"]
    wandering: tuple[int, ...] = eqx.field(static=True)
    coloured: tuple[int, ...] = eqx.field(static=True)

    @classmethod
    def of(cls, seen: Readings, doubt: Float[Array, " state"]) -> "Noise":
        return cls(seen.variance, seen.wander, seen.colour, doubt, seen.wandering, seen.coloured)

    def assumed(self, log_scale: Float[Array, "lanes channels"], velocity: Float[Array, "lanes dof dof"]) -> Assumed:
        """That of all lanes."""
        shared = (self.wander, self.colour, jnp.diag(self.doubt**2))
        wander, colour, start = (jnp.broadcast_to(a[None], (len(log_scale), *a.shape)) for a in shared)
        variance = self.variance[None, :] * jnp.exp(log_scale)
        return Assumed(variance, wander, colour, velocity, start, self.wandering, self.coloured)


@jit_with_kernels
def _run(
    static: Any,
    leaves: list[Array],
    numbers: Float[Array, "lanes size"],
    velocity: Float[Array, "lanes dof dof"],
    dt: Float[Array, ""],
    stretch: Stretch,
    state: State,
    first: Bool[Array, ""],
    *,
    one_kernel: bool,
) -> tuple[State, Innovations]:
    """State of all lanes after a stretch, and innovations (n, lanes, channels); the `first` one has no state yet.

    `leaves` and `static` are a plant, `Noise` and an `Observation`.
    """
    plants, assumed, observation, state = lanes_before(static, leaves, numbers, velocity, dt, stretch, state, first)
    return run(plants, assumed, observation, stretch, dt, state, one_kernel=one_kernel)


def lanes_before(
    static: Any,
    leaves: list[Array],
    numbers: Float[Array, "lanes size"],
    velocity: Float[Array, "lanes dof dof"],
    dt: Float[Array, ""],
    stretch: Stretch,
    state: State,
    first: Bool[Array, ""],
) -> tuple[Plant, Assumed, Observation, State]:
    """Plants, noise and states of all lanes before a stretch, and what is observed; arguments as of a run."""
    plant, noise, observation = jax.tree.unflatten(static, leaves)
    floats, fixed = eqx.partition(plant, eqx.is_inexact_array)

    def lane(row: Float[Array, " size"]) -> Plant:
        return eqx.partition(with_vector(eqx.combine(floats, fixed), row), eqx.is_inexact_array)[0]

    plants = eqx.combine(jax.vmap(lane)(numbers), fixed)
    x0, v0, log_scale = tail_of(plant, numbers, noise.variance.size)
    assumed = noise.assumed(log_scale, velocity)

    def begin() -> State:
        force, base, time = jnp.moveaxis(stretch.force[0], 1, 0), stretch.base[0], stretch.time[0]

        def one(plant, assumed, x0, v0, force):
            return begun(plant, assumed, x0, v0, force, base, time, dt)

        table = jax.tree.map(lambda rows: rows[0], stretch.near)
        return on_lanes(plants).near(table, time, dt)(one, assumed, x0, v0, force)

    return plants, assumed, observation, jax.lax.cond(first, begin, lambda: state)


def tail_of(plant: Plant, numbers, channels: int):
    """x0, v0 and the logarithms of the factors on the channels' noise."""
    dof, tail = plant.dof, numbers[:, numbers.shape[1] - 2 * plant.dof - channels :]
    return tail[:, :dof], tail[:, dof : 2 * dof], tail[:, 2 * dof :]


class _Drive(NamedTuple):
    """What drives lanes otherwise than the record says: forces (n, halves, lanes, dof), and what drove earlier
    (n, lanes, late, 5, dof + 1); None where it does not."""

    force: np.ndarray | None
    before: np.ndarray | None

    @classmethod
    def of(cls, scene: Scene, runs: Runs, count: int) -> "_Drive":
        inputs: Any = scene.inputs
        plant = scene.plant
        force = before = None
        if plant.force_delay.size:
            delays = runs.numbers[:, place_of(plant, "force_delay")] / float(inputs.step)
            force = _by_value(delays, lambda tau: undelayed_force(np.asarray(inputs.force), tau)[:count], 2)
        if runs.push is not None:
            halves = inputs.force.shape[1]
            pushed = np.moveaxis(between_samples(runs.push, halves, count), 0, 2)
            force = pushed + (np.asarray(inputs.force)[:count, :, None] if force is None else force)
        if plant.channel_delay.size:
            late = runs.numbers[:, place_of(plant, "channel_delay")]
            before = np.stack(
                [_by_value(each, lambda tau: forces_before(inputs, float(tau))[:count], 1) for each in late.T], 2
            )
        return cls(force, before)

    def put_in(self, stretch: Stretch, begin: int, use: np.ndarray | None) -> Stretch:
        """A stretch of the record from sample `begin`, driven so, of which lanes use these readings."""
        given = {"force": self.force, "before": self.before, "use": use}
        return stretch._replace(**{name: _padded(rows, begin) for name, rows in given.items() if rows is not None})


def _by_value(values: np.ndarray, function: Callable[[Any], np.ndarray], axis: int) -> np.ndarray:
    """What a function makes of each value, along an axis; of the same one but once."""
    different, which = np.unique(values, return_inverse=True, axis=0)
    return np.take(np.stack([function(value) for value in different], axis), which.ravel(), axis)


def _along_motion(scene: Scene, runs: Runs, count: int, found: Innovations) -> None:
    """The same of the force readings along an imposed motion."""
    seen = scene.readings
    if runs.use is not None:
        use: Any = np.zeros(seen.use.shape)
        use[: len(runs.use)] = runs.use[: len(use)]
        seen = replace(seen, use=use)
    along = _along(scene.plant, runs.numbers, scene.observation, scene.inputs, seen, runs.velocity, scene.doubt)
    for whole, part in zip(found, along, strict=True):
        whole[:] = np.asarray(part)[: len(whole), :count]


@eqx.filter_jit
def _along(
    plant: Plant, numbers, observation: Observation, inputs: Any, readings: Readings, velocity, doubt
) -> Innovations:
    log_scale = tail_of(plant, numbers, readings.values.shape[1])[2]

    def one(numbers, velocity, log_scale):
        lane = with_vector(plant, numbers)
        return force_innovations(lane, observation, inputs, readings, ProcessNoise(velocity), doubt, log_scale)

    return jax.vmap(one)(numbers, velocity, log_scale)
