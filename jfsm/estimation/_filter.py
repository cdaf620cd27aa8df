"""Extended Kalman filter of a plant: what each sample says, given all before it.

The state is (x, v, z), z being the hidden states of the laws. Between samples the mean follows the plant itself
(Runge-Kutta, true stick), the covariance its linearisation. Channels are taken one after the other, so that no matrix
is inverted and many filters run side by side. The mode of friction is uncertain while the speed is smaller than its
error: an acceleration is then judged under each mode, and the most probable one is used (a max-mixture). Its likelihood
is that of all modes, each with its probability before the reading.

The zero of a channel may wander. It is a state then, with its slope: white noise twice integrated, as in a smoothing
spline, which leaves to the structure all that is not slow. The noise of a channel may have a memory. What it remembers
is a state as well: white noise through a filter of first order.

References
----------
G. Wahba, J. R. Statist. Soc. B 40 (1978) 364, of the spline. A. E. Bryson, D. E. Johansen, IEEE Trans. Autom. Control
10 (1965) 4, of noise with a memory as a state.
"""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from .._traced import kept_result
from .._types import Array
from ..plant import (
    DelayBuffer,
    InterpolatedInput,
    Load,
    Motion,
    Observation,
    Plant,
    Tabulated,
    acceleration,
    advance_sample,
    any_ended,
    as_one_kernel,
    begin,
    carried,
    drive_before,
    friction_limits,
    holding_force,
    in_mode,
    inverse_mass,
    inverse_mass_at,
    linearised,
    load_of,
    mode_at,
    near,
    push,
    settle,
    stopping,
    through_events,
    true_force,
    undelayed,
    with_friction,
)
from ._measurement_update import measurement_update

_NOTHING = 1e-6
"""Change of a resting link's speed that is none, as a share of what the process noise makes of it in a sample."""
_UNFORESEEN = 1e-4
"""Probability that a link does what the estimated motion rules out."""
_FAR = 30.0
"""Standard deviations from zero at which a speed's sign is beyond doubt."""
_BARELY = 1e-3
"""Standard deviations beyond zero that tell a direction, no more."""
_SMALL = 8
"""Columns of a matrix up to which its product is written out."""
_FEW = 4
"""States up to which the loop over samples is one kernel: of more it takes minutes to compile."""


class Readings(eqx.Module):
    """What a filter sees of a record.

    `values` (n, channels), `use` (n, channels) is 1 where a sample may update the state, `variance` (channels,) is
    the noise of each channel, `valid` (n,) is false in the padding. The zeros of the channels `wandering` begin
    with slopes, and change these by as much a sample, of the variances `wander` (wandering, 2). Of the variance of the
    channels `coloured` a share has a memory: `colour` (coloured, 2) is its correlation from sample to sample, and that
    share.
    """

    values: Float[Array, "n channels"]
    use: Float[Array, "n channels"]
    variance: Float[Array, " channels"]
    valid: Float[Array, " n"]
    wander: Float[Array, "wandering 2"] = eqx.field(default_factory=lambda: np.zeros((0, 2)))
    wandering: tuple[int, ...] = eqx.field(default=(), static=True)
    colour: Float[Array, "coloured 2"] = eqx.field(default_factory=lambda: np.zeros((0, 2)))
    coloured: tuple[int, ...] = eqx.field(default=(), static=True)

    @property
    def zeros(self) -> tuple[int | None, ...]:
        """`zeros_of` these."""
        return zeros_of(self)


class ProcessNoise(eqx.Module):
    """Covariance (dof, dof) that every sample adds to that of the velocity; of the force, where motion is imposed.

    It is the same for all hypotheses: were it to follow a fitted mass or gain, a wrong hypothesis could buy itself
    noise with it. For the same reason an attached mass receives that of the mass it hangs on.
    """

    velocity: Float[Array, "dof dof"]


class Start(eqx.Module):
    """Mean (dof,) of x and v at the first sample, where hidden states are relaxed, and covariance of all of them."""

    x: Float[Array, " dof"]
    v: Float[Array, " dof"]
    covariance: Float[Array, "state state"]


@kept_result
class Innovations(NamedTuple):
    """Difference between reading and prediction, and its variance, each (n, channels).

    Where the reading has chosen among several predictions, its law is not the normal one of that prediction but the
    mixture of all: `log_share` is the logarithm of the mixture's density over the normal one, zero where there is but
    one prediction. Without it a law that offers two predictions would score as if each had been certain.
    """

    error: Float[Array, "n channels"]
    variance: Float[Array, "n channels"]
    log_share: Float[Array, "n channels"]


def _product(a, b):
    # Column by column: XLA fuses these sums into the loop, where a matrix product of this size would be a call, and all
    # columns at once would be an array in memory as soon as several filters run side by side.
    if b.shape[1] > _SMALL:
        return a @ b
    return jnp.stack([jnp.sum(a * b[:, j][None, :], 1) for j in range(b.shape[1])], 1)


@kept_result
class State(NamedTuple):
    """What a filter carries from sample to sample.

    `mode` (slots,) is that of each friction slot, a whole number: it is no function of the plant's numbers. `overrun`
    (slots,) tells how surely links rest. `zeros` are those of the channels, as in `Readings.zeros`.
    """

    x: Float[Array, " dof"]
    v: Float[Array, " dof"]
    z: Float[Array, " hidden"]
    mode: Int[Array, " slots"]
    buffer: DelayBuffer
    covariance: Float[Array, "state state"]
    overrun: Float[Array, " slots"]
    zeros: Float[Array, " zeros"]

    @property
    def motion(self) -> Motion:
        return Motion(self.x, self.v, self.z, self.mode.astype(self.x.dtype))


@kept_result
class Passage(NamedTuple):
    """How a lane went through a sample: what was `seen` of it, its motion as predicted and as `read`, and what became
    of a small change.

    `rows` (channels, state) are derivatives of the readings by all states, the zeros last, each at what the channels
    before have left; `gains` (channels, state) what an innovation moves, `step` (state, state) what becomes of a change
    from the sample to the next.
    """

    seen: Innovations
    predicted: Motion
    read: Motion
    rows: Float[Array, "channels state"]
    gains: Float[Array, "channels state"]
    step: Float[Array, "state state"]


class _Told(NamedTuple):
    """What the readings of a sample told: as in `Passage`."""

    seen: Innovations
    rows: Float[Array, "channels state"]
    gains: Float[Array, "channels state"]


class Assumed(eqx.Module):
    """What a lane takes for granted about noise.

    `variance` (channels,) is that of each channel, `wander` and `colour` are as in `Readings`, of the channels that
    `wandering` and `coloured` count; `velocity` (dof, dof) is as in `ProcessNoise`, `start` the covariance of
    the motion and hidden states at the first sample.
    """

    variance: Float[Array, "*lanes channels"]
    wander: Float[Array, "*lanes wandering 2"]
    colour: Float[Array, "*lanes coloured 2"]
    velocity: Float[Array, "*lanes dof dof"]
    start: Float[Array, "*lanes state state"]
    wandering: tuple[int, ...] = eqx.field(static=True)
    coloured: tuple[int, ...] = eqx.field(static=True)

    def begin(self) -> Float[Array, "state state"]:
        """Covariance of all states at the first sample."""
        remembered = self.colour[:, 1] * self.variance[jnp.array(self.coloured, dtype=int)]
        zeros = beside(_about_slopes(self.wander[:, 0]), jnp.diag(remembered))
        return beside(self.start, zeros)


def zeros_of(noise: Readings | Assumed) -> tuple[int | None, ...]:
    """The channel that every state of the channels adds to: a zero that wanders and its slope, which adds to none, then
    what noise remembers."""
    return (*(c for zero in noise.wandering for c in (zero, None)), *noise.coloured)


class Stretch(NamedTuple):
    """Inputs of some samples: what drives the lanes, and what was read.

    `force` (n, halves, lanes, dof) and `base` (n, halves) are on the half steps of each sample; `before`
    (n, lanes, late, 5, dof + 1) is what drove earlier, for every channel that is late, the base last. `near` (n, ...)
    is how plants of their own motion move there, if they do.
    """

    force: Float[Array, "n halves lanes dof"]
    base: Float[Array, "n halves"]
    before: Float[Array, "n lanes late 5 columns"]
    time: Float[Array, " n"]
    values: Float[Array, "n channels"]
    use: Float[Array, "n channels"]
    near: Tabulated | None = None


class Lanes(NamedTuple):
    """Plants side by side; whole numbers are those of all of them."""

    floats: Plant
    fixed: Plant

    def __call__(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """What a function makes of the plant and the arguments of every lane."""
        return jax.vmap(lambda floats, *mine: function(eqx.combine(floats, self.fixed), *mine))(self.floats, *arguments)

    def near(self, table: Tabulated | None, time: Float[Array, ""], step: Float[Array, ""]) -> "Lanes":
        """The lanes in a sample, of whose row of a table each has its own numbers."""
        if table is None:
            return self
        local = self(lambda plant: near(plant, table, time, step).local)
        with_local = partial(eqx.tree_at, lambda plant: plant.local, is_leaf=lambda leaf: leaf is None)
        nothing = jax.tree.map(lambda _: None, local)
        return Lanes(with_local(self.floats, local), with_local(self.fixed, nothing))

    def first(self) -> Plant:
        """The plant of the first lane."""
        return eqx.combine(jax.tree.map(lambda leaf: leaf[0], self.floats), self.fixed)


def on_lanes(plants: Plant) -> Lanes:
    """Lanes of plants that have a leading axis on every leaf that is no whole number."""
    return Lanes(*eqx.partition(plants, eqx.is_inexact_array))


class Known(NamedTuple):
    """Constants of a lane besides its plant: the inverse mass, the channels' white noise variances, the transition
    and process noise of their zeros, the process noise that is `added` to the motion, and speeds that are none."""

    minv: Float[Array, "dof dof"]
    variances: Float[Array, " channels"]
    transition: Float[Array, "zeros zeros"]
    process_noise: Float[Array, "zeros zeros"]
    added: Float[Array, "motion motion"]
    nothing: Float[Array, " slots"]

    @classmethod
    def of(cls, plant: Plant, assumed: Assumed) -> "Known":
        picked, rows = jnp.array(assumed.coloured, dtype=int), plant.friction.direction
        memory, remembered = assumed.colour[:, 0], assumed.colour[:, 1] * assumed.variance[picked]
        noise_input = jnp.concatenate([jnp.zeros((plant.dof, plant.dof)), jnp.eye(plant.dof), carried(plant)])
        speeds = jnp.sum(rows[:, :, None] * assumed.velocity[None] * rows[:, None, :], (1, 2))
        return cls(
            inverse_mass(plant),
            assumed.variance.at[picked].add(-remembered),
            beside(_ramps(len(assumed.wandering)), jnp.diag(memory)),
            beside(_about_slopes(assumed.wander[:, 1]), jnp.diag((1.0 - memory**2) * remembered)),
            noise_input @ assumed.velocity @ noise_input.T,
            _NOTHING * jnp.sqrt(speeds),
        )


def begun(
    plant: Plant, assumed: Assumed, x0, v0, force: Float[Array, "halves dof"], base: Float[Array, " halves"], time, step
):
    """State of a lane before its first sample, which begins with these forces; hidden states are relaxed."""
    motion, buffer = begin(
        plant, inverse_mass(plant), x0, v0, InterpolatedInput(force[None], base[None], time[None], step)
    )
    beyond_doubt, zeros = jnp.full(len(plant.friction), _FAR), jnp.zeros(len(zeros_of(assumed)))
    return State(*motion[:3], motion.mode.astype(int), buffer, assumed.begin(), beyond_doubt, zeros)


def run(
    plants: Plant,
    assumed: Assumed,
    observation: Observation,
    stretch: Stretch,
    dt,
    states: State,
    *,
    one_kernel: bool = False,
) -> tuple[State, Innovations]:
    """States of all lanes after a stretch, and their innovations, each (n, lanes, channels).

    `plants`, `assumed` and `states` have a leading axis of lanes on every leaf that is no whole number, states on all.
    A sample with ``use = 0`` is predicted, not used: many of them in a row are a free prediction with its error bar. A
    delay reaches back into the means of the filter. Lanes share what rarely happens, a reversal: all pay when one of
    them has it. As `one_kernel` the loop is faster where it can be one; where it cannot, the steps of a sample are one.
    """
    of_zeros, alone = zeros_of(assumed), on_lanes(plants).first()

    whole = one_kernel and few_states(alone, of_zeros)
    advanced = as_one_kernel(_advanced) if one_kernel and not whole and alone.elementary else _advanced

    def loop(plants, known, observation, dt, states, stretch):
        def sample(states, now):
            states, passage = _sample(on_lanes(plants), known, observation, of_zeros, dt, states, now, advanced)
            return states, passage.seen

        return jax.lax.scan(sample, states, stretch)

    run_all = as_one_kernel(loop) if whole else loop
    return run_all(plants, on_lanes(plants)(Known.of, assumed), observation, dt, states, stretch)


def passages(
    plants: Plant, assumed: Assumed, observation: Observation, stretch: Stretch, dt, states: State
) -> tuple[State, Passage]:
    """As `run`, with all of every sample's `Passage` (n, lanes, ...)."""
    each = on_lanes(plants)
    sample = partial(_sample, each, each(Known.of, assumed), observation, zeros_of(assumed), dt, advanced=_advanced)
    return jax.lax.scan(sample, states, stretch)


def few_states(plant: Plant, zeros: tuple[int | None, ...]) -> bool:
    """Whether the loop over a plant's samples may be one kernel."""
    return 2 * plant.dof + plant.hidden + len(zeros) <= _FEW and plant.elementary


def _sample(
    each: Lanes, known: Known, observation, of_zeros, dt, states: State, now: Stretch, advanced: Callable[..., Motion]
) -> tuple[State, Passage]:
    """States of all lanes after a sample, and how they went through it."""
    each = each.near(now.near, now.time, dt)
    force, base = jnp.moveaxis(now.force, 1, 0), now.base  # (lanes, halves, dof)
    substeps = (base.size - 1) // 2

    def read(plant, known, state, force, before):
        g = load_of(plant, known.minv, state.motion, state.buffer, force, base, now.time, dt)
        load = Load(g[:3], base[:3], now.time, dt / substeps)
        return (*_read(plant, known, observation, of_zeros, state, load, before, now.values, now.use), g)

    motion, updated, zeros, buffer, told, g = each(read, known, states, force, now.before)
    after = advanced(each, known, motion, g, base, now.time, dt)

    def carry_on(plant, known, motion, after, updated, g):
        return _carried_on(plant, known, motion, after, updated, g[substeps], now.time, dt, substeps)

    covariance, overrun, step = each(carry_on, known, motion, after, updated, g)
    zeros = each(lambda plant, known, zeros: jnp.sum(known.transition * zeros[None, :], 1), known, zeros)
    passage = Passage(told.seen, states.motion, motion, told.rows, told.gains, step)
    return State(*after[:3], after.mode.astype(int), buffer, covariance, overrun, zeros), passage


def _advanced(each: Lanes, known: Known, motion: Motion, g, base, time, dt) -> Motion:
    """Motion of all lanes one sample later; `g` (lanes, halves, dof) drives them."""
    substeps = (base.size - 1) // 2
    h = dt / substeps

    def step(motion, inputs):
        force, base, i = inputs
        load = Load(force, base, time + i * h, h)

        def of(function):
            return lambda plant, known, force, *rest: function(plant, known.minv, *rest, load._replace(force=force))

        end = each(of(in_mode), known, force, motion)
        if not motion.mode.shape[1]:
            return end, None
        over = jnp.any(each(of(any_ended), known, force, end))
        return jax.lax.cond(over, lambda: each(of(through_events), known, force, motion, end), lambda: end), None

    nodes = np.arange(substeps)[:, None] * 2 + np.arange(3)
    inputs = jnp.moveaxis(g[:, nodes], 1, 0), base[nodes], jnp.arange(substeps)
    if substeps == 1:
        return step(motion, jax.tree.map(lambda a: a[0], inputs))[0]
    return jax.lax.scan(step, motion, inputs)[0]


def _read(plant: Plant, known: Known, observation, of_zeros, state: State, load: Load, before, values, use):
    """Motion, covariance, zeros and buffer of a lane once it has read a sample, and what that told."""
    motion, dof, rows = state.motion, plant.dof, plant.friction.direction
    mean, updated, found = _update(
        plant, known.minv, observation, motion, state.zeros, of_zeros, state.covariance, state.overrun, load, before,
        values, use, known.variances, known.nothing,
    )  # fmt: skip
    x, v, z, zeros = jnp.split(mean, [dof, 2 * dof, 2 * dof + plant.hidden])
    # A link that sticks stays so while the update leaves it at rest; otherwise its speed decides.
    pushed = jnp.abs(jnp.sum(rows * (v - motion.v)[None, :], 1))
    still = (motion.mode == 0) & (pushed <= known.nothing)
    minv = inverse_mass_at(plant, known.minv, x, v, load.time)
    v = v - stopping(minv, rows, jnp.sum(rows * v[None, :], 1), still)
    moving = Motion(x, v, settle(plant, x, z), mode_at(plant, known.minv, x, v, z, load.force[0], load.time, still))
    return moving, updated, zeros, push(state.buffer, x, v), found


def _carried_on(plant: Plant, known: Known, motion: Motion, after: Motion, updated, g, time, dt, substeps: int):
    """Covariance of a lane after a sample, how surely links rest by then, and what becomes of a small change; `g`
    drives it halfway."""
    x, v, z = ((a + b) / 2 for a, b in zip(motion[:3], after[:3], strict=True))
    free, rates = linearised(plant, known.minv, x, v, z, g, time + dt / 2)
    minv = inverse_mass_at(plant, known.minv, x, v, time + dt / 2)
    step = beside(_transition(plant, minv, motion, after, rates, dt, substeps), known.transition)
    moving = _product(_product(step, updated), step.T) + beside(known.added, known.process_noise)
    slope = with_friction(plant, known.minv, x, v, motion.mode, free, time + dt / 2)[0]
    overrun = _overrun(plant, motion, after, moving, slope, dt)
    return _rest(plant, minv, moving, after.mode), overrun, step


def innovations(
    plant: Plant,
    observation: Observation,
    inputs: InterpolatedInput,
    readings: Readings,
    noise: ProcessNoise,
    start: Start,
    log_scale: Float[Array, " channels"],
    *,
    one_kernel: bool = False,
) -> Innovations:
    """Innovations (n, channels) of one run, to be traced.

    `log_scale` is the logarithm of the factor on each channel's noise variance.
    """
    variance = readings.variance * jnp.exp(log_scale)
    inputs, lone = undelayed(plant, inputs), lambda tree: jax.tree.map(lambda leaf: leaf[None], tree)
    assumed = Assumed(
        variance, readings.wander, readings.colour, noise.velocity, start.covariance, readings.wandering,
        readings.coloured,
    )  # fmt: skip
    n, _, dof = inputs.force.shape
    earlier = [drive_before(inputs, tau) for tau in plant.channel_delay]
    before = [jnp.concatenate([force, base[..., None]], 2) for force, base in earlier]
    before = jnp.stack(before, 1)[:, None] if before else jnp.zeros((n, 1, 0, 5, dof + 1))
    stretch = Stretch(inputs.force[:, :, None], inputs.base, before, inputs.time, readings.values, readings.use)
    state = begun(
        plant, assumed, start.x, start.v, inputs.force[0, :3], inputs.base[0, :3], inputs.time[0], inputs.step
    )
    floats, fixed = eqx.partition(plant, eqx.is_inexact_array)
    found = run(
        eqx.combine(lone(floats), fixed),
        lone(assumed),
        observation,
        stretch,
        inputs.step,
        lone(state),
        one_kernel=one_kernel,
    )[1]
    return jax.tree.map(lambda leaf: leaf[:, 0], found)


def beside(a, b):
    """Two matrices on one diagonal."""
    return a if not b.size else b if not a.size else jax.scipy.linalg.block_diag(a, b)


def _about_slopes(variances):
    """Covariance of zeros and their slopes where only the slopes are in doubt."""
    return jnp.diag(jnp.stack([jnp.zeros_like(variances), variances], 1).ravel())


def _ramps(count: int):
    """What a sample makes of zeros that change by their slopes."""
    return jnp.kron(jnp.eye(count), jnp.array([[1.0, 1.0], [0.0, 1.0]]))


def _transition(plant, minv, before: Motion, after: Motion, rates, dt, substeps: int):
    """Derivative of the state after a sample by the state before it, from the mid-point's `rates`."""
    dof, hidden = plant.dof, plant.hidden
    held = _held(plant, minv, rates[dof : 2 * dof], (before.mode == 0) & (after.mode == 0))
    step = transition(jnp.concatenate([rates[:dof], held, rates[2 * dof :]], 0), dt, substeps)
    if not hidden:
        return step
    # What is put back within its bounds at the end of the step follows the bound from there on.
    kept = jax.vmap(lambda e: jax.jvp(lambda x, z: settle(plant, x, z), (after.x, after.z), (e[:dof], e[dof:]))[1])
    bounds = kept(jnp.eye(dof + hidden)).T
    return jnp.concatenate(
        [step[: 2 * dof], _product(bounds[:, :dof], step[:dof]) + _product(bounds[:, dof:], step[2 * dof :])]
    )


def transition(rates, dt, substeps: int):
    """Exponential of constant rates for a sample: its series for a step as short as those of the mean, squared back."""
    halvings = (substeps - 1).bit_length()
    step = short_transition(dt / 2**halvings * rates)
    for _ in range(halvings):
        step = _product(step, step)
    return step


def short_transition(exponent):
    """Exponential to the fourth power of its exponent, which is what the Runge-Kutta method makes of a step."""
    one, square = jnp.eye(exponent.shape[0]), _product(exponent, exponent)
    return one + exponent + _product(square, one / 2 + exponent / 6 + square / 24)


def _rest(plant, minv, covariance, mode):
    """Covariance once a link sticks: its speed is known to be zero."""
    slots = plant.friction
    dof = plant.dof
    for i in range(len(slots)):
        still, hidden = jnp.zeros(dof), jnp.zeros(covariance.shape[0] - 2 * dof)
        row = jnp.concatenate([still, slots.direction[i], hidden])
        effect = jnp.concatenate([still, jnp.sum(minv * slots.direction[i][None, :], 1), hidden])
        scale = jnp.sum(row * effect)
        project = jnp.eye(row.size) - effect[:, None] * row[None, :] / jnp.where(scale > 0, scale, 1.0)
        stuck = _product(_product(project, covariance), project.T)
        covariance = jnp.where((mode[i] == 0) & (scale > 0), stuck, covariance)
    return covariance


def _overrun(plant, before: Motion, after: Motion, covariance, slope, dt):
    """Speed with which every link that came to rest in a sample would have ended it unheld, in its standard deviations.

    The closer to zero, the less certain it is that the link rests by then. All others are beyond doubt. `slope` is the
    acceleration halfway.
    """
    rows, dof = plant.friction.direction, plant.dof
    speed = before.mode * jnp.sum(rows * (before.v + dt * slope)[None, :], 1)
    power = jnp.sum(rows[:, :, None] * covariance[None, dof : 2 * dof, dof : 2 * dof] * rows[:, None, :], (1, 2))
    stopped = (before.mode != 0) & (after.mode == 0) & (power > 0)
    beyond = jnp.minimum(speed / jnp.sqrt(jnp.where(stopped, power, 1.0)), -_BARELY)
    return jnp.where(stopped, before.mode * beyond, _FAR)


def _update(
    plant, minv, observation, motion: Motion, zeros, of_zeros, covariance, overrun, load: Load, before, y, use,
    variances, nothing,
) -> tuple[Float[Array, " state"], Float[Array, "state state"], _Told]:  # fmt: skip
    """State after the readings of one sample, and what they told; `overrun` tells how surely links rest, `load` is
    that of the sample's first step, `before` what drove it earlier, and speeds of links up to `nothing` are none."""
    at_first = jnp.concatenate([motion.x, motion.v, motion.z])
    mean, size = jnp.concatenate([at_first, zeros]), at_first.size
    late = [
        (channel, *_late(plant, minv, observation, tau, at_first, motion.mode, load, drive[:, :-1], drive[:, -1]))
        for tau, channel, drive in zip(plant.channel_delay, plant.late_channel, before, strict=True)
    ]
    readings = list[tuple]()
    for c in range(y.shape[0]):
        gain, mine = 1.0 + plant.channel_gain[c], jnp.array([float(channel == c) for channel in of_zeros])
        reading = y[c] - jnp.sum(mine * mean[size:])
        predicted, row, share = _predict(
            plant, minv, observation, c, mean[:size], covariance[:size, :size], motion.mode, overrun, load, reading,
            use[c], variances[c], gain, nothing,
        )  # fmt: skip
        for channel, then, rows in late:  # what other channels have told of the motion by now moves it along its slope
            predicted = jnp.where(channel == c, then[c] + jnp.sum(rows[c] * (mean[:size] - at_first)), predicted)
            row = jnp.where(channel == c, rows[c], row)
            share = jnp.where(channel == c, 0.0, share)
        error = reading - gain * predicted - plant.channel_offset[c]
        row = jnp.concatenate([gain * row, mine])
        mean, covariance, spread, by_error = measurement_update(mean, covariance, row, error, variances[c], use[c])
        readings.append((error, spread, share, row, by_error))
    error, spread, share, rows, gains = (jnp.stack(each) for each in zip(*readings, strict=True))
    return mean, covariance, _Told(Innovations(error, spread, share), rows, gains)


def _predict(plant, minv, observation, c, mean, covariance, mode, overrun, load: Load, y, use, variance, gain, nothing):
    """Reading of channel `c` without gain and offset, its derivative by the state, and the reading's `log_share`."""
    dof, certain = plant.dof, jnp.zeros(())
    select, none, hidden = observation.select[c], jnp.zeros(dof), jnp.zeros(plant.hidden)
    if observation.kinds[c] == "displacement":
        return jnp.sum(select * mean[:dof]), jnp.concatenate([select, none, hidden]), certain
    if observation.kinds[c] == "velocity":
        return jnp.sum(select * mean[dof : 2 * dof]), jnp.concatenate([none, select, hidden]), certain
    x, v, z = mean[:dof], mean[dof : 2 * dof], mean[2 * dof :]
    without = linearised(plant, minv, x, v, z, load.force[0], load.time)
    minv = inverse_mass_at(plant, minv, x, v, load.time)
    if len(plant.friction) == 1:
        a, by_state, log_share = _most_probable_mode(
            plant, minv, select, c, mean, covariance, mode[0], overrun[0], load, without, y, use, variance, gain,
            nothing[0],
        )  # fmt: skip
    else:
        (a, by_state), log_share = _moving_in(plant, minv, mean, mode, load, *without), certain
    return jnp.sum(select * (a + load.base[0])), jnp.sum(select[:, None] * by_state, 0), log_share


def _late(plant, minv, observation, tau, mean, mode, load: Load, force, base):
    """Readings (channels,) of the motion of a moment ago, two steps back in time, and their derivative by the state.

    `force` (5, dof) and `base` (5,) are what was measured from now back to then. What answers the past stays as it is.
    """
    dof = plant.dof
    measured = true_force(plant, force, base)
    g = measured + (load.force[0] - measured[0])[None, :]

    def readings(mean):
        now = Motion(mean[:dof], mean[dof : 2 * dof], mean[2 * dof :], mode)
        then = advance_sample(plant, minv, now, g, base, load.time, -tau)
        a = acceleration(plant, minv, *then, g[-1], load.time - tau)[0]
        return shown(observation, then, a + base[-1])

    return jax.vmap(lambda e: jax.jvp(readings, (mean,), (e,)), out_axes=(None, 1))(jnp.eye(mean.size))


def shown(observation: Observation, motion: Motion, a: Float[Array, " dof"]) -> Float[Array, " channels"]:
    """What the channels show of a motion and its accelerations `a`, without gains and offsets."""
    values = {"displacement": motion.x, "velocity": motion.v, "acceleration": a}
    rows = zip(observation.select, observation.kinds, strict=True)
    return jnp.stack([jnp.sum(row * values[kind]) for row, kind in rows])


def _moving_in(plant, minv, mean, mode, load: Load, free, rates):
    """Acceleration in a mode, and its derivative by the state, from those without friction."""
    dof = plant.dof
    a = with_friction(plant, minv, mean[:dof], mean[dof : 2 * dof], mode, free, load.time)[0]
    return a, _held(plant, minv, rates[dof : 2 * dof], mode == 0)


def _held(plant, minv, by_state, sticking):
    """Derivative of the accelerations by the state once links stick: what would move those is taken up."""
    for i in range(len(plant.friction)):
        row = plant.friction.direction[i]
        effect = jnp.sum(minv * row[None, :], 1)
        scale = jnp.sum(row * effect)
        along = jnp.sum(row[:, None] * by_state, 0) / jnp.where(scale > 0, scale, 1.0)
        held = by_state - effect[:, None] * along[None, :]
        by_state = jnp.where(sticking[i] & (scale > 0), held, by_state)
    return by_state


def _most_probable_mode(
    plant, minv, select, c, mean, covariance, mode, overrun, load: Load, without, y, use, variance, gain, nothing
):
    """Acceleration and slope in the mode that the reading and the estimated speed make most probable, and the
    reading's `log_share`; `without` friction they are known.

    A reading that is not used has no say in the mode.
    """
    dof = plant.dof
    row = plant.friction.direction[0]
    x, v = mean[:dof], mean[dof : 2 * dof]
    speed = jnp.sum(row * v)
    power = jnp.sum(row[:, None] * covariance[dof : 2 * dof, dof : 2 * dof] * row[None, :])
    spread = jnp.sqrt(jnp.maximum(power, 0.0) + nothing**2)
    certain = jnp.where(spread > 0, speed / jnp.where(spread > 0, spread, 1.0), jnp.sign(speed) * _FAR)
    low, high = friction_limits(plant, x, jnp.zeros(dof), load.time)
    held = holding_force(plant, minv, without[0], jnp.ones(1, bool))[0]
    can_stick = (held <= high[0]) & (held >= low[0])
    # What comes to rest where it can be held stays there: it slides still as it did, or it rests.
    came = jnp.where(mode == 0, -jnp.sign(overrun), mode)
    certain = jnp.clip(jnp.where(can_stick & (mode == 0), overrun, certain), -_FAR, _FAR)
    forward, backward = (
        jnp.where(can_stick & (came != way), 0.0, jax.scipy.stats.norm.cdf(way * certain)) for way in (1.0, -1.0)
    )
    likely = jnp.stack([forward, backward, 1.0 - forward - backward])
    log_likely = jnp.log(_UNFORESEEN / 3 + (1.0 - _UNFORESEEN) * likely)

    def judge(mode):
        a, by_state = _moving_in(plant, minv, mean, mode[None], load, *without)
        line = gain * jnp.sum(select[:, None] * by_state, 0)
        total = jnp.sum(line[:, None] * covariance * line[None, :]) + variance
        error = y - gain * jnp.sum(select * (a + load.base[0])) - plant.channel_offset[c]
        return -(error**2) / (2 * total) - jnp.log(total) / 2, a, by_state

    normal, values, slopes = jax.vmap(judge)(jnp.array([1.0, -1.0, 0.0]))
    scores = log_likely + jnp.where(use > 0, normal, 0.0)
    best = jax.nn.one_hot(jnp.argmax(jax.lax.stop_gradient(scores)), 3)
    log_share = jax.nn.logsumexp(scores) - jnp.sum(best * jnp.where(use > 0, normal, 0.0))
    return jnp.sum(best[:, None] * values, 0), jnp.sum(best[:, None, None] * slopes, 0), log_share
