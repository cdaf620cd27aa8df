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
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from ..dynamics._forces import carried, friction_limits, settle
from ..dynamics._grid import (
    Fine,
    Past,
    advance_sample,
    begin,
    drive_before,
    load_of,
    punctual,
    remember,
    true_force,
)
from ..dynamics._kernel import one_kernel_scan
from ..dynamics._plant import Plant, Readout
from ..dynamics._stepper import (
    Load,
    Motion,
    acceleration,
    holding_force,
    inverse_mass,
    linearised,
    mode_at,
    stopping,
    with_friction,
)

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
    wander: Float[Array, "wandering 2"] = eqx.field(default_factory=lambda: jnp.zeros((0, 2)))
    wandering: tuple[int, ...] = eqx.field(default=(), static=True)
    colour: Float[Array, "coloured 2"] = eqx.field(default_factory=lambda: jnp.zeros((0, 2)))
    coloured: tuple[int, ...] = eqx.field(default=(), static=True)

    @property
    def zeros(self) -> tuple[int | None, ...]:
        """The channel that every state of the channels adds to: a zero that wanders and its slope, which adds to none,
        then what noise remembers."""
        return (*(c for zero in self.wandering for c in (zero, None)), *self.coloured)


class ProcessNoise(eqx.Module):
    """Covariance (dof, dof) that every sample adds to that of the velocity; of the force, where motion is imposed.

    It is the same for all hypotheses: were it to follow a fitted mass or gain, a wrong hypothesis could buy itself
    noise with it. For the same reason a mass that hangs on another is struck with that one.
    """

    velocity: Float[Array, "dof dof"]


class Start(eqx.Module):
    """Mean (dof,) of x and v at the first sample, where hidden states are relaxed, and covariance of all of them."""

    x: Float[Array, " dof"]
    v: Float[Array, " dof"]
    covariance: Float[Array, "state state"]


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


class State(NamedTuple):
    """What a filter carries from sample to sample.

    `mode` (slots,) is that of each friction slot, a whole number: it is no function of the plant's numbers. `overrun`
    (slots,) tells how surely links rest. `zeros` are those of the channels, as in `Readings.zeros`.
    """

    x: Float[Array, " dof"]
    v: Float[Array, " dof"]
    z: Float[Array, " hidden"]
    mode: Int[Array, " slots"]
    past: Past
    covariance: Float[Array, "state state"]
    overrun: Float[Array, " slots"]
    zeros: Float[Array, " zeros"]

    @property
    def motion(self) -> Motion:
        return Motion(self.x, self.v, self.z, self.mode.astype(self.x.dtype))


class Known(NamedTuple):
    """What a run of the filter knows throughout besides the plant: its inverse mass, the channels' white noise
    variances, what a sample makes of their zeros, and the covariance that it adds to these."""

    minv: Float[Array, "dof dof"]
    variances: Float[Array, " channels"]
    onward: Float[Array, "zeros zeros"]
    stirred: Float[Array, "zeros zeros"]


class Drive(NamedTuple):
    """What of the inputs of all samples depends on the plant where a sensor is late: the force, and what drove it
    earlier, for every channel delay."""

    force: Float[Array, "n halves dof"]
    before: tuple[tuple[Array, Array], ...]


class Sample(NamedTuple):
    """The other inputs of all samples."""

    base: Float[Array, "n halves"]
    time: Float[Array, " n"]
    values: Float[Array, "n channels"]
    use: Float[Array, "n channels"]
    valid: Float[Array, " n"]


def begun(
    plant: Plant, fine: Fine, readings: Readings, start: Start, log_scale: Float[Array, " channels"]
) -> tuple[Known, State, Drive]:
    """A run of the filter before its first sample."""
    minv = inverse_mass(plant)
    fine = punctual(plant, fine)
    motion, past = begin(plant, minv, start.x, start.v, fine)
    variances, picked = readings.variance * jnp.exp(log_scale), jnp.array(readings.coloured, dtype=int)
    memory, remembered = readings.colour[:, 0], readings.colour[:, 1] * variances[picked]
    known = Known(
        minv,
        variances.at[picked].add(-remembered),
        _beside(_ramps(len(readings.wandering)), jnp.diag(memory)),
        _beside(_about_slopes(readings.wander[:, 1]), jnp.diag((1.0 - memory**2) * remembered)),
    )
    beyond_doubt = jnp.full(len(plant.friction), _FAR)
    zeros = jnp.zeros(len(readings.zeros))
    covariance = _beside(start.covariance, _beside(_about_slopes(readings.wander[:, 0]), jnp.diag(remembered)))
    state = State(*motion[:3], motion.mode.astype(int), past, covariance, beyond_doubt, zeros)
    return known, state, Drive(fine.force, tuple(drive_before(fine, tau) for tau in plant.channel_delay))


def innovations(
    plant: Plant,
    show: Readout,
    fine: Fine,
    readings: Readings,
    noise: ProcessNoise,
    start: Start,
    log_scale,
    *,
    one_kernel: bool = False,
) -> Innovations:
    """Innovations of one filter run.

    `log_scale` (channels,) is the logarithm of the factor on each channel's noise variance. A sample with ``use = 0``
    is predicted, not used: a stretch of such samples is a free prediction with its own error bar. A delay reaches back
    into the means of the filter. Where not many run at once, `one_kernel` is faster.
    """
    known, state, drive = begun(plant, fine, readings, start, log_scale)

    def body(state, inputs):
        return one_sample(plant, known, show, noise, fine.step, readings.zeros, state, *inputs)

    loop = loop_of(plant, readings, one_kernel)
    return loop(body, state, (drive, samples_of(fine, readings)))[1]


def samples_of(fine: Fine, readings: Readings) -> Sample:
    """Inputs of all samples that no plant changes."""
    return Sample(fine.base, fine.time, readings.values, readings.use, readings.valid)


def loop_of(plant: Plant, readings: Readings, one_kernel: bool) -> Callable[..., Any]:
    """`jax.lax.scan`, or the one kernel that is asked for, where the filter of this plant can be one."""
    small = 2 * plant.dof + plant.hidden + len(readings.zeros) <= _FEW and plant.elementary
    return one_kernel_scan if one_kernel and small else jax.lax.scan


def one_sample(
    plant: Plant,
    known: Known,
    show: Readout,
    noise: ProcessNoise,
    dt,
    of_zeros: tuple[int | None, ...],
    state: State,
    drive: Drive,
    sample: Sample,
) -> tuple[State, Innovations]:
    """State one sample later, and the innovations of this one; `drive` and `sample` are what comes with it."""
    (minv, variances, onward, stirred), motion, past = known, state.motion, state.past
    dof, rows = plant.dof, plant.friction.direction
    substeps = (drive.force.shape[0] - 1) // 2
    struck = jnp.concatenate([jnp.zeros((dof, dof)), jnp.eye(dof), carried(plant)])
    added = _product(_product(struck, noise.velocity), struck.T)
    nothing = _NOTHING * jnp.sqrt(jnp.sum(rows[:, :, None] * noise.velocity[None] * rows[:, None, :], (1, 2)))
    base, time = sample.base, sample.time
    g = load_of(plant, minv, motion, past, drive.force, base, time, dt)
    mean, updated, found = _update(
        plant, minv, show, motion, state.zeros, of_zeros, state.covariance, state.overrun,
        Load(g[:3], base[:3], time, dt / substeps), drive.before, sample.values, sample.use, variances, nothing,
    )  # fmt: skip
    x, v, z, zeros = jnp.split(mean, [dof, 2 * dof, 2 * dof + plant.hidden])
    # A link that sticks stays so while the update leaves it at rest; otherwise its speed decides.
    pushed = jnp.abs(jnp.sum(rows * (v - motion.v)[None, :], 1))
    still = (motion.mode == 0) & (pushed <= nothing)
    v = v - stopping(minv, rows, jnp.sum(rows * v[None, :], 1), still)
    motion = Motion(x, v, settle(plant, x, z), mode_at(plant, minv, x, v, z, g[0], time, still))
    keep = sample.valid > 0
    past = remember(past, x, v, keep)
    after = advance_sample(plant, minv, motion, g, base, time, dt)
    x, v, z = ((a + b) / 2 for a, b in zip(motion[:3], after[:3], strict=True))
    free, rates = linearised(plant, minv, x, v, z, g[g.shape[0] // 2], time + dt / 2)
    step = _beside(_transition(plant, minv, motion, after, rates, dt, substeps), onward)
    moving = _product(_product(step, updated), step.T) + _beside(added, stirred)
    slope = with_friction(plant, minv, x, v, motion.mode, free, time + dt / 2)[0]
    overrun = _overrun(plant, motion, after, moving, slope, dt)
    covariance = _rest(plant, minv, moving, after.mode)
    later = State(*after[:3], after.mode.astype(int), past, covariance, overrun, jnp.sum(onward * zeros[None, :], 1))
    later = jax.tree.map(
        lambda new, old: jnp.where(keep, new, old), later._replace(past=None), state._replace(past=None)
    )
    return later._replace(past=past), found


def _beside(a, b):
    """Two matrices on one diagonal."""
    return a if not b.size else b if not a.size else jax.scipy.linalg.block_diag(a, b)


def _about_slopes(variances):
    """Covariance of zeros and their slopes where only the slopes are in doubt."""
    return jnp.diag(jnp.stack([jnp.zeros_like(variances), variances], 1).ravel())


def _ramps(count: int):
    """What a sample makes of zeros that change by their slopes."""
    return jnp.kron(jnp.eye(count), jnp.array([[1.0, 1.0], [0.0, 1.0]]))


def _transition(plant, minv, before: Motion, after: Motion, rates, dt, substeps: int):
    """Derivative of the state after a sample by the state before it: exponential of the mid-point's `rates`.

    Its series is taken for a step as short as those of the mean, and squared back.
    """
    dof, hidden = plant.dof, plant.hidden
    held = _held(plant, minv, rates[dof : 2 * dof], (before.mode == 0) & (after.mode == 0))
    halvings = (substeps - 1).bit_length()
    exponent = dt / 2**halvings * jnp.concatenate([rates[:dof], held, rates[2 * dof :]], 0)
    one, square = jnp.eye(exponent.shape[0]), _product(exponent, exponent)
    step = one + exponent + _product(square, one / 2 + exponent / 6 + square / 24)  # to the fourth power
    for _ in range(halvings):
        step = _product(step, step)
    if not hidden:
        return step
    # What is put back within its bounds at the end of the step follows the bound from there on.
    kept = jax.vmap(lambda e: jax.jvp(lambda x, z: settle(plant, x, z), (after.x, after.z), (e[:dof], e[dof:]))[1])
    bounds = kept(jnp.eye(dof + hidden)).T
    return jnp.concatenate(
        [step[: 2 * dof], _product(bounds[:, :dof], step[:dof]) + _product(bounds[:, dof:], step[2 * dof :])]
    )


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
    plant, minv, show, motion: Motion, zeros, of_zeros, covariance, overrun, load: Load, before, y, use, variances,
    nothing,
) -> tuple[Float[Array, " state"], Float[Array, "state state"], Innovations]:  # fmt: skip
    """State after the readings of one sample, and their innovations; `overrun` tells how surely links rest, `load` is
    that of the sample's first step, `before` what drove it earlier, and speeds of links up to `nothing` are none."""
    at_first = jnp.concatenate([motion.x, motion.v, motion.z])
    mean, size = jnp.concatenate([at_first, zeros]), at_first.size
    late = [
        (channel, *_late(plant, minv, show, tau, at_first, motion.mode, load, *drive))
        for tau, channel, drive in zip(plant.channel_delay, plant.late_channel, before, strict=True)
    ]
    errors, spreads, shares = [], [], []
    for c in range(y.shape[0]):
        gain, mine = 1.0 + plant.channel_gain[c], jnp.array([float(channel == c) for channel in of_zeros])
        reading = y[c] - jnp.sum(mine * mean[size:])
        predicted, row, share = _predict(
            plant, minv, show, c, mean[:size], covariance[:size, :size], motion.mode, overrun, load, reading, use[c],
            variances[c], gain, nothing,
        )  # fmt: skip
        for channel, then, rows in late:  # what other channels have told of the motion by now moves it along its slope
            predicted = jnp.where(channel == c, then[c] + jnp.sum(rows[c] * (mean[:size] - at_first)), predicted)
            row = jnp.where(channel == c, rows[c], row)
            share = jnp.where(channel == c, 0.0, share)
        error = reading - gain * predicted - plant.channel_offset[c]
        row = jnp.concatenate([gain * row, mine])
        cross = jnp.sum(covariance * row[None, :], 1)
        spread = jnp.sum(row * cross) + variances[c]
        weight = use[c] * cross / spread
        mean = mean + weight * error
        covariance = covariance - weight[:, None] * cross[None, :]
        errors.append(error)
        spreads.append(spread)
        shares.append(share)
    return mean, covariance, Innovations(jnp.stack(errors), jnp.stack(spreads), jnp.stack(shares))


def _predict(plant, minv, show, c, mean, covariance, mode, overrun, load: Load, y, use, variance, gain, nothing):
    """Reading of channel `c` without gain and offset, its derivative by the state, and the reading's `log_share`."""
    dof, certain = plant.dof, jnp.zeros(())
    select, none, hidden = show.select[c], jnp.zeros(dof), jnp.zeros(plant.hidden)
    if show.kinds[c] == "displacement":
        return jnp.sum(select * mean[:dof]), jnp.concatenate([select, none, hidden]), certain
    if show.kinds[c] == "velocity":
        return jnp.sum(select * mean[dof : 2 * dof]), jnp.concatenate([none, select, hidden]), certain
    x, v, z = mean[:dof], mean[dof : 2 * dof], mean[2 * dof :]
    without = linearised(plant, minv, x, v, z, load.force[0], load.time)
    if len(plant.friction) == 1:
        a, by_state, log_share = _most_probable_mode(
            plant, minv, select, c, mean, covariance, mode[0], overrun[0], load, without, y, use, variance, gain,
            nothing[0],
        )  # fmt: skip
    else:
        (a, by_state), log_share = _moving_in(plant, minv, mean, mode, load, *without), certain
    return jnp.sum(select * (a + load.base[0])), jnp.sum(select[:, None] * by_state, 0), log_share


def _late(plant, minv, show, tau, mean, mode, load: Load, force, base):
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
        shown = {"displacement": then.x, "velocity": then.v, "acceleration": a + base[-1]}
        return jnp.stack([jnp.sum(row * shown[kind]) for row, kind in zip(show.select, show.kinds, strict=True)])

    return jax.vmap(lambda e: jax.jvp(readings, (mean,), (e,)), out_axes=(None, 1))(jnp.eye(mean.size))


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
