"""The likelihood of a structure on one record: runs of the filter side by side, and what they differ by.

With innovations e and their variances S,

    -log L = ½ Σ (e²/S + log 2πS),     F = Σ (∂e ∂eᵀ / S + ½ ∂log S ∂log Sᵀ),

F being the expected information. Derivatives are differences of runs, lanes of the same program: a lane costs a tenth
of a run by itself, the program of runs alone is compiled in a third of the time that one with derivatives takes, and no
rule of differentiation has to know what a law does.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..dynamics._grid import Fine, Past
from ..dynamics._imposed import Imposed
from ..dynamics._kernel import jit_with_kernels
from ..dynamics._plant import Plant, Readout
from ..estimation._filter import Assumed, Innovations, ProcessNoise, Readings, State, Stretch, begun, on_lanes, run
from ..estimation._imposed import force_innovations
from ._drive import between_samples, forces_before, punctual_force
from ._layout import part_of, with_vector, without_part

SAMPLES = 1024
"""Samples that a program runs at a time; fewer are padded, so that one program serves records of any length."""
_BLOCKS = 64
"""Stretches of a record whose gradients count as independent of each other."""
_PIECE = 256
"""Columns of a product that one core is faster with."""
_NUDGE = 1e-6
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
    root: np.ndarray
    error: np.ndarray
    by_error: np.ndarray
    by_spread: np.ndarray
    by_share: np.ndarray | None

    @property
    def gradient(self) -> np.ndarray:
        with np.errstate(all="ignore"):  # a lane that runs away is told by its value
            slope = self.by_error @ self.error + self.by_spread @ self._by_variance
            return slope if self.by_share is None else slope - self.by_share.sum(1)

    @property
    def information(self) -> np.ndarray:
        with np.errstate(all="ignore"):
            return _gram(self.by_error) + 0.5 * _gram(self.by_spread)

    @property
    def scatter(self) -> np.ndarray:
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


def value_and_slopes(run: Callable[[np.ndarray], Innovations], theta: np.ndarray, use: np.ndarray) -> Slopes:
    """`Slopes` at `theta` (unknowns,) of the readings that `use` (n, channels) counts.

    `run` gives the innovations (lanes, n, channels) of some values (lanes, unknowns).
    """

    def in_a_row(values: np.ndarray) -> Innovations:
        return Innovations(*(a.reshape(len(values), -1) for a in run(values)))

    nudges = _NUDGE * np.eye(theta.size)
    found, use = in_a_row(np.concatenate([theta[None], theta + nudges])), use.ravel()
    base = Innovations(*(a[0] for a in found))
    with np.errstate(all="ignore"):
        root = np.sqrt(use)
        standard = root / np.sqrt(base.variance)
        normal = 0.5 * (base.error**2 / base.variance + np.log(2 * np.pi * base.variance))
        value = float(np.sum(use * (normal - base.log_share)))
        mixed = bool(np.any(base.log_share))

        def changes(lanes: Innovations, nudge: float) -> list[np.ndarray]:
            by_error = (lanes.error - base.error) * (standard / nudge)
            by_spread = np.log(lanes.variance / base.variance) * (root / nudge)
            return [by_error, by_spread, *([(lanes.log_share - base.log_share) * (use / nudge)] if mixed else [])]

        slopes = changes(Innovations(*(a[1:] for a in found)), _NUDGE)
        power = slopes[0] ** 2 + 0.5 * slopes[1] ** 2
        jumped = _HANDFUL * np.max(power, 1, initial=0.0) > _MOSTLY * np.sum(power, 1)
        if np.any(jumped):
            back = changes(in_a_row(theta - nudges[jumped]), -_NUDGE)
            for mine, other in zip(slopes, back, strict=True):
                mine[jumped] = np.where(np.abs(other) < np.abs(mine[jumped]), other, mine[jumped])
    return Slopes(value, root, base.error * standard, slopes[0], slopes[1], slopes[2] if mixed else None)


class Runs(NamedTuple):
    """What lanes are to do on one record.

    `numbers` (lanes, size) are those of each plant, then x0, v0 and logarithms of the factors on the channels' noise;
    `velocity` (lanes, dof, dof) is their process noise, `use` (n, channels) which readings they use, `push`
    (lanes, n, dof), if there is any, a force that drives them as well.
    """

    numbers: np.ndarray
    velocity: np.ndarray
    use: np.ndarray
    push: np.ndarray | None = None

    def split(self) -> list["Runs"]:
        """As many at a time as run side by side, the last of them repeated."""
        count = len(self.numbers)
        lots = [np.minimum(np.arange(i, i + RUNS), count - 1) for i in range(0, count, RUNS)]
        return [
            Runs(self.numbers[lot], self.velocity[lot], self.use, None if self.push is None else self.push[lot])
            for lot in lots
        ]


class Scene(NamedTuple):
    """What all lanes share: a plant (of it the numbers that parameters can change do not matter), which channels show
    what, what is imposed, the readings, and the standard deviation (state,) of the state at the first sample."""

    plant: Plant
    show: Readout
    fine: Fine | Imposed
    readings: Readings
    doubt: np.ndarray


def innovations_of(scene: Scene, runs: Runs, count: int) -> Innovations:
    """Innovations (lanes, count, channels) of all lanes on the first `count` samples."""
    along = _along_motion if isinstance(scene.fine, Imposed) else _filtered
    shape = len(runs.numbers), count, scene.readings.values.shape[1]
    found = Innovations(np.empty(shape), np.empty(shape), np.empty(shape))
    for k, lot in enumerate(runs.split()):
        mine = slice(k * RUNS, min((k + 1) * RUNS, shape[0]))
        along(scene, lot, count, Innovations(*(a[mine] for a in found)))
    return found


def _filtered(scene: Scene, runs: Runs, count: int, found: Innovations) -> None:
    """Put in what a full set of lanes has `found`, or the first of them, a stretch of samples after the other."""
    plant, numbers = without_part(scene.plant, runs.numbers, "force_delay")  # the drive has it
    readings = scene.readings
    leaves, static = jax.tree.flatten((plant, Noise.of(readings, scene.doubt), scene.show))
    drive, state = _Drive.of(scene, runs, count), _nowhere(plant, readings)
    fixed = jax.device_put((leaves, numbers, runs.velocity, np.asarray(drive.fine.step)))
    for begin in range(0, count, SAMPLES):
        end = min(begin + SAMPLES, count)
        stretch = drive.stretch(begin, end, np.asarray(readings.values), runs.use)
        state, seen = _run(static, *fixed, stretch, state, np.asarray(begin == 0))
        for whole, part in zip(found, seen, strict=True):
            whole[:, begin:end] = np.moveaxis(np.asarray(part), 1, 0)[: len(whole), : end - begin]


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

    `leaves` and `static` are a plant, `Noise` and a readout.
    """
    plant, noise, show = jax.tree.unflatten(static, leaves)
    floats, fixed = eqx.partition(plant, eqx.is_inexact_array)

    def lane(row: Float[Array, " size"]) -> Plant:
        return eqx.partition(with_vector(eqx.combine(floats, fixed), row), eqx.is_inexact_array)[0]

    plants = eqx.combine(jax.vmap(lane)(numbers), fixed)
    x0, v0, log_scale = tail_of(plant, numbers, noise.variance.size)
    assumed = noise.assumed(log_scale, velocity)

    def begin() -> State:
        force, base, time = jnp.moveaxis(stretch.force[0], 1, 0), stretch.base[0], stretch.time[0]
        return on_lanes(plants)(lambda *one: begun(*one, base, time, dt), assumed, x0, v0, force)

    state = jax.lax.cond(first, begin, lambda: state)
    return run(plants, assumed, show, stretch, dt, state, one_kernel=one_kernel)


def tail_of(plant: Plant, numbers, channels: int):
    """x0, v0 and the logarithms of the factors on the channels' noise."""
    dof, tail = plant.dof, numbers[:, numbers.shape[1] - 2 * plant.dof - channels :]
    return tail[:, :dof], tail[:, dof : 2 * dof], tail[:, 2 * dof :]


def _nowhere(plant: Plant, readings: Readings) -> State:
    """A state of all lanes before there is any."""
    dof, slots, reach = plant.dof, len(plant.friction), plant.reach if len(plant.delayed) else 0
    motion, zeros = 2 * dof + plant.hidden, 2 * len(readings.wandering) + len(readings.coloured)
    past = Past(*np.zeros((2, RUNS, reach, dof)), np.zeros(RUNS, int))
    return State(
        np.zeros((RUNS, dof)), np.zeros((RUNS, dof)), np.zeros((RUNS, plant.hidden)), np.zeros((RUNS, slots), int),
        past, np.zeros((RUNS, motion + zeros, motion + zeros)), np.zeros((RUNS, slots)), np.zeros((RUNS, zeros)),
    )  # fmt: skip


class _Drive(NamedTuple):
    """What drives every lane: forces (n, halves, lanes, dof) and what drove earlier (n, lanes, late, 5, dof + 1)."""

    fine: Fine
    force: np.ndarray
    before: np.ndarray

    @classmethod
    def of(cls, scene: Scene, runs: Runs, count: int) -> "_Drive":
        fine = scene.fine
        assert isinstance(fine, Fine)
        shared = np.asarray(fine.force)
        force = np.broadcast_to(shared[:count, :, None], (*shared[:count].shape[:2], RUNS, shared.shape[2]))
        if runs.push is not None:
            force = force + np.moveaxis(between_samples(runs.push, shared.shape[1], count), 0, 2)
        if scene.plant.force_delay.size:
            delays = part_of(scene.plant, runs.numbers, "force_delay")
            force = np.stack([punctual_force(shared, tau / fine.step)[:count] for tau in delays], 2)
        late = part_of(scene.plant, runs.numbers, "channel_delay")
        before = np.zeros((count, RUNS, late.shape[1], 5, shared.shape[2] + 1))
        for lane, delay in np.ndindex(late.shape):
            before[:, lane, delay] = forces_before(fine, late[lane, delay])[:count]
        return cls(fine, force, before)

    def stretch(self, begin: int, end: int, values: np.ndarray, use: np.ndarray) -> Stretch:
        """The samples from `begin` to `end`, padded to as many as a program runs."""

        def padded(rows: np.ndarray) -> np.ndarray:
            found = np.zeros((SAMPLES, *rows.shape[1:]))
            found[: end - begin] = rows[begin:end]
            return found

        base, time = np.asarray(self.fine.base), np.asarray(self.fine.time)
        return Stretch(*map(padded, (self.force, base, self.before, time, values, use)))


def _along_motion(scene: Scene, runs: Runs, count: int, found: Innovations) -> None:
    """The same of the force readings along an imposed motion."""
    rows, readings = scene.fine.time.shape[0], scene.readings
    seen = readings.values, jnp.asarray(runs.use), readings.variance, readings.valid
    seen = Readings(*(a if a.ndim == 1 and a.size != readings.valid.size else a[:rows] for a in seen))
    along = _along(scene.plant, runs.numbers, scene.show, scene.fine, seen, runs.velocity, scene.doubt)
    for whole, part in zip(found, along, strict=True):
        whole[:] = np.asarray(part)[: len(whole), :count]


@eqx.filter_jit
def _along(plant: Plant, numbers, show: Readout, fine: Imposed, readings: Readings, velocity, doubt) -> Innovations:
    log_scale = tail_of(plant, numbers, readings.values.shape[1])[2]

    def one(numbers, velocity, log_scale):
        lane = with_vector(plant, numbers)
        return force_innovations(lane, show, fine, readings, ProcessNoise(velocity), doubt, log_scale)

    return jax.vmap(one)(numbers, velocity, log_scale)
