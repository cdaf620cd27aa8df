"""Free runs on the sample grid, many parameter sets at once."""

from dataclasses import replace
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from .._traced import jit_kept, kept_result
from .._types import Array, is_traced
from ._forces import Scalar, Square, State, hidden_start
from ._plant import Plant
from ._stepper import Load, Motion, acceleration, advance, inverse_mass, mode_at
from ._tabulated import Tabulated, near

Run = Float[Array, "n dof"]


class InterpolatedInput(eqx.Module):
    """Input of a run between consecutive samples, on half steps.

    `force` (n, 2 substeps + 1, dof) holds the applied forces of the interval after each sample, `base`
    (n, 2 substeps + 1) the acceleration of the base, `near` (n, ...) how a plant of its own motion moves there, where
    that is known.
    """

    force: Float[Array, "n halves dof"]
    base: Float[Array, "n halves"]
    time: Float[Array, " n"]
    step: Float[Array, ""]
    near: Tabulated | None = None

    @property
    def substeps(self) -> int:
        return (self.force.shape[1] - 1) // 2

    def strided(self, stride: int) -> "InterpolatedInput":
        """The same input with steps `stride` times as long."""
        return replace(self, force=self.force[:, ::stride], base=self.base[:, ::stride])

    def by_steps(self, stride: int = 1, length: int | None = None) -> "InterpolatedInput":
        """The same input with every `stride` steps a sample of one step, padded to `length` of these."""
        n, count = self.force.shape[0], self.substeps // stride
        nodes = 2 * stride * np.arange(count)[:, None] + stride * np.arange(3)[None, :]
        given: Any = (self.force, self.base, self.time[0], self.step)
        force, base, begin, step = given if is_traced(given) else map(np.asarray, given)
        step = step / count
        force, base = force[:, nodes].reshape(n * count, 3, -1), base[:, nodes].reshape(n * count, 3)
        more = (0 if length is None else length) - n * count
        if more > 0:
            xp = jnp if is_traced(force) else np
            force, base = (xp.concatenate([q, xp.broadcast_to(q[-1:], (more, *q.shape[1:]))]) for q in (force, base))
        time = begin + step * np.arange(n * count + max(more, 0))
        return InterpolatedInput(jnp.asarray(force), jnp.asarray(base), jnp.asarray(time), jnp.asarray(step))


def undelayed(plant: Plant, inputs: InterpolatedInput) -> InterpolatedInput:
    """Input of a run without the delay of its force sensor: the force at t is the reading at t + tau."""
    if not plant.force_delay.size:
        return inputs
    n, halves, dof = inputs.force.shape
    flat = _in_a_row(inputs.force)
    columns = [shifted(flat[:, j], plant.force_delay[j] / inputs.step * (halves - 1)) for j in range(dof)]
    later = jnp.stack(columns, 1)
    take = jnp.arange(n)[:, None] * (halves - 1) + jnp.arange(halves)[None, :]
    return InterpolatedInput(later[take], inputs.base, inputs.time, inputs.step, inputs.near)


def drive_before(
    inputs: InterpolatedInput, tau: Float[Array, ""]
) -> tuple[Float[Array, "n 5 dof"], Float[Array, "n 5"]]:
    """Forces, and accelerations of the base, from each sample back to tau earlier: two steps in time, on half steps."""
    n, halves, dof = inputs.force.shape
    flat = _in_a_row(jnp.concatenate([inputs.force, inputs.base[..., None]], 2))
    places = -tau / inputs.step * (halves - 1) * jnp.linspace(0.0, 1.0, 5)
    earlier = jax.vmap(jax.vmap(shifted, (1, None), 1), (None, 0), 1)(flat, places)[: n * (halves - 1) : halves - 1]
    return earlier[..., :dof], earlier[..., dof]


def _in_a_row(values: Float[Array, "n halves columns"]) -> Float[Array, "nodes columns"]:
    """Values on the half steps of all samples one after the other, each instant once."""
    return jnp.concatenate([values[:, :-1].reshape(-1, values.shape[2]), values[-1:, -1]])


def cubic_weights(s: Any) -> tuple[Any, Any, Any, Any]:
    """Weights of the samples at -1, 0, 1 and 2 in the cubic through them, at `s` between 0 and 1 (Lagrange)."""
    return (
        -s * (s - 1) * (s - 2) / 6,
        (s + 1) * (s - 1) * (s - 2) / 2,
        -(s + 1) * s * (s - 2) / 2,
        (s + 1) * s * (s - 1) / 6,
    )


def shifted(values: Float[Array, " n"], places: Float[Array, ""]) -> Float[Array, " n"]:
    """Values so many places further on, by the cubic through four neighbours."""
    whole = jax.lax.stop_gradient(jnp.floor(places))
    weights = cubic_weights(places - whole)
    index = jnp.arange(values.size) + whole.astype(int)
    last = values.size - 1
    near = jnp.stack([values[jnp.clip(index + k, 0, last)] for k in (-1, 0, 1, 2)])
    return jnp.sum(jnp.stack(weights)[:, None] * near, 0)


def true_force(
    plant: Plant, force: Float[Array, "halves dof"], base: Float[Array, " halves"]
) -> Float[Array, "halves dof"]:
    """Force on the masses from the measured one: gain and offset of its sensor undone, the base's inertia added."""
    inertia = jnp.sum(plant.mass, 1)
    measured = (force - plant.force_offset[None, :]) / (1.0 + plant.force_gain)[None, :]
    return measured - base[:, None] * inertia[None, :]


@kept_result
class DelayBuffer(NamedTuple):
    """Ring buffer of the displacements and velocities of the last samples, and the number of samples so far.

    Before the first sample the motion was at rest in the initial displacement. Empty if no force is delayed.
    """

    x: Float[Array, "reach dof"]
    v: Float[Array, "reach dof"]
    count: Int[Array, ""]


def delay_buffer(plant: Plant, x0: Float[Array, " dof"]) -> DelayBuffer:
    """Delay buffer of a run that begins at `x0`."""
    reach = plant.reach if len(plant.delayed) else 0
    return DelayBuffer(
        jnp.broadcast_to(x0[None, :], (reach, plant.dof)), jnp.zeros((reach, plant.dof)), jnp.zeros((), int)
    )


def push(
    buffer: DelayBuffer, x: Float[Array, " dof"], v: Float[Array, " dof"], keep: Bool[Array, ""] | bool = True
) -> DelayBuffer:
    """Buffer with one sample more, if `keep`."""
    if not buffer.x.size:
        return buffer
    here = buffer.count % buffer.x.shape[0]  # only this row changes, so that the others need not be copied
    x, v = jnp.where(keep, x, buffer.x[here]), jnp.where(keep, v, buffer.v[here])
    return DelayBuffer(buffer.x.at[here].set(x), buffer.v.at[here].set(v), buffer.count + keep)


def delayed_force(
    plant: Plant,
    minv: Square,
    motion: Motion,
    buffer: DelayBuffer,
    g: Float[Array, "halves dof"],
    time: Scalar,
    step: Scalar,
) -> Float[Array, "halves dof"]:
    """Delayed forces on the half steps of a sample; `g` (halves, dof) is its load.

    The buffer is read by cubic Hermite interpolation between samples. A delay shorter than a sample is read off the
    parabola of the motion at the start of this sample.
    """
    halves, reach = g.shape[0], buffer.x.shape[0]
    a = acceleration(plant, minv, motion.x, motion.v, motion.z, motion.mode, g[0], time)[0]
    ahead = jnp.linspace(0.0, 1.0, halves)
    slots, total = plant.delayed, jnp.zeros(g.shape)

    def before(k: Int[Array, " halves"], now, ring) -> Float[Array, "halves dof"]:
        """Values so many samples ago."""
        return jnp.where((k == 0)[:, None], now[None, :], ring[(buffer.count - k) % reach])

    for i in range(len(slots)):
        lag = slots.choose(i, lambda law: law.delay) / step - ahead  # samples from each node towards the past
        early, inside = (lag > buffer.count)[:, None], (lag < 0)[:, None]
        k = jnp.clip(jnp.floor(lag).astype(int), 0, reach - 1)
        s = (lag - k)[:, None]
        (x, x_before), (v, v_before) = (
            (before(k, now, ring), before(k + 1, now, ring))
            for now, ring in ((motion.x, buffer.x), (motion.v, buffer.v))
        )
        d_past = (1.0 + 2.0 * s) * (1.0 - s) ** 2 * x + (3.0 - 2.0 * s) * s**2 * x_before
        d_past = d_past + step * s * (1.0 - s) * (s * v_before - (1.0 - s) * v)
        w_past = 6.0 * s * (1.0 - s) / step * (x - x_before)
        w_past = w_past + (1.0 - s) * (1.0 - 3.0 * s) * v + s * (3.0 * s - 2.0) * v_before
        d_past = jnp.where(early, buffer.x[buffer.count % reach][None, :], d_past)
        w_past = jnp.where(early, 0.0, w_past)
        ago = -lag[:, None] * step
        d_now = motion.x[None, :] + ago * motion.v[None, :] + ago**2 / 2 * a[None, :]
        w_now = motion.v[None, :] + ago * a[None, :]
        moved, speed = jnp.where(inside, d_now, d_past), jnp.where(inside, w_now, w_past)
        d, w = (jnp.sum(slots.direction[i][None, :] * q, 1) for q in (moved, speed))
        force = _late_force(plant, i, d, w, time + ahead * step)
        total = total + force[:, None] * slots.direction[i][None, :]
    return total


def delayed_along(plant: Plant, x: Run, v: Run, time: Float[Array, " n"]) -> Run:
    """Delayed forces along a given motion (n, dof), at rest before its first sample."""
    n, step, slots = x.shape[0], time[1] - time[0], plant.delayed
    total = jnp.zeros(x.shape)
    for i in range(len(slots)):
        place = jnp.arange(n) - slots.choose(i, lambda law: law.delay) / step
        early = (place < 0)[:, None]
        k = jnp.clip(jnp.floor(place).astype(int), 0, n - 2)
        s = jnp.clip(place - k, 0.0, 1.0)[:, None]
        bent = (1.0 - s) * v[k] - s * v[k + 1] - (1.0 - 2.0 * s) * (x[k + 1] - x[k]) / step  # cubic Hermite
        moved = jnp.where(early, x[:1], x[k] + s * (x[k + 1] - x[k]) + s * (1.0 - s) * step * bent)
        speed = jnp.where(early, 0.0, v[k] + s * (v[k + 1] - v[k]))
        d, w = (jnp.sum(slots.direction[i][None, :] * q, 1) for q in (moved, speed))
        force = _late_force(plant, i, d, w, time)
        total = total + force[:, None] * slots.direction[i][None, :]
    return total


def _late_force(plant: Plant, slot: int, d, w, times):
    def along(law):
        return jax.vmap(lambda d, w, t: law.force(d, w, (), t))(d, w, times)

    return plant.delayed.choose(slot, along)


def load_of(
    plant: Plant,
    minv: Square,
    motion: Motion,
    buffer: DelayBuffer,
    force: Float[Array, "halves dof"],
    base: Float[Array, " halves"],
    time: Scalar,
    step: Scalar,
) -> Float[Array, "halves dof"]:
    """Load of a sample on half steps (2 substeps + 1, dof): the true force, less the delayed forces."""
    g = true_force(plant, force, base)
    return g - delayed_force(plant, minv, motion, buffer, g, time, step) if len(plant.delayed) else g


def advance_sample(
    plant: Plant,
    minv: Square,
    motion: Motion,
    force: Float[Array, "halves dof"],
    base: Float[Array, " halves"],
    time: Scalar,
    step: Scalar,
) -> Motion:
    """Motion one sample later; `force` (2 substeps + 1, dof) is the load on half steps."""
    substeps = (force.shape[0] - 1) // 2
    h = step / substeps
    if substeps == 1:
        return advance(plant, minv, motion, Load(force, base, time, h))
    forces, bases = (
        jnp.stack([force[:-2:2], force[1:-1:2], force[2::2]], 1),
        jnp.stack([base[:-2:2], base[1:-1:2], base[2::2]], 1),
    )

    def body(motion, inputs):
        triple, bases, i = inputs
        return advance(plant, minv, motion, Load(triple, bases, time + i * h, h)), None

    return jax.lax.scan(body, motion, (forces, bases, jnp.arange(substeps)))[0]


def begin(plant: Plant, minv: Square, x0: State, v0: State, inputs: InterpolatedInput) -> tuple[Motion, DelayBuffer]:
    """Motion and delay buffer at the first sample; hidden states are relaxed."""
    z0, buffer = hidden_start(plant, x0, v0), delay_buffer(plant, x0)
    resting = Motion(x0, v0, z0, jnp.zeros(len(plant.friction)))
    g = load_of(plant, minv, resting, buffer, inputs.force[0], inputs.base[0], inputs.time[0], inputs.step)[0]
    return Motion(x0, v0, z0, mode_at(plant, minv, x0, v0, z0, g, inputs.time[0])), buffer


@jit_kept
def run_grid(plant: Plant, inputs: InterpolatedInput, x0: State, v0: State) -> tuple[Run, Run, Run]:
    """Displacement, velocity and acceleration (relative to the base) at every sample, each (n, dof)."""
    return free_run(plant, inputs, x0, v0)


@jit_kept
def run_strided(
    plant: Plant, inputs: InterpolatedInput, stride: Int[Array, ""], x0: State, v0: State
) -> tuple[Run, Run, Run]:
    """As `run_grid`, in steps `stride` times as long; the same program whatever the stride.

    The plant must have no delayed forces.
    """
    minv = inverse_mass(plant)
    inputs = undelayed(plant, inputs)
    h = inputs.step / inputs.substeps * stride

    def body(motion, sample):
        force, base, time = sample
        g = true_force(plant, force, base)
        a = acceleration(plant, minv, motion.x, motion.v, motion.z, motion.mode, g[0], time)[0]

        def step(i, motion):
            at = [stride * (2 * i + k) for k in range(3)]
            forces, bases = (
                jnp.stack([jax.lax.dynamic_index_in_dim(q, j, keepdims=False) for j in at]) for q in (g, base)
            )
            return advance(plant, minv, motion, Load(forces, bases, time + i * h, h))

        return jax.lax.fori_loop(0, inputs.substeps // stride, step, motion), (motion.x, motion.v, a)

    motion, _ = begin(plant, minv, x0, v0, inputs)
    return jax.lax.scan(body, motion, (inputs.force, inputs.base, inputs.time))[1]


@eqx.filter_jit
def run_again(plant: Plant, inputs: InterpolatedInput, x0: State, v0: State) -> tuple[Run, Run, Run]:
    """As `run_grid`, for reverse-mode derivatives: each sample is computed again instead of stored."""
    return free_run(plant, inputs, x0, v0, again=True)


def free_run(
    plant: Plant, inputs: InterpolatedInput, x0: State, v0: State, again: bool = False
) -> tuple[Run, Run, Run]:
    """As `run_grid`, to be traced; as `run_again` if `again`."""
    inputs = undelayed(plant, inputs)

    def body(carry, sample):
        motion, buffer = carry
        after, a = _after(plant, inputs.step, motion, buffer, sample)
        return after, (motion.x, motion.v, a)

    first = jax.tree.map(lambda rows: rows[0], inputs.near)
    start = begin(near(plant, first, inputs.time[0], inputs.step), inverse_mass(plant), x0, v0, inputs)
    steps = jax.checkpoint(body) if again else body
    return jax.lax.scan(steps, start, (inputs.force, inputs.base, inputs.time, inputs.near))[1]


def _after(plant: Plant, step: Scalar, motion: Motion, buffer: DelayBuffer, sample: tuple[Any, ...]):
    """Motion and delay buffer one sample later, and the acceleration at the sample: its load, base, time and table."""
    force, base, time, table = sample
    plant, minv = near(plant, table, time, step), inverse_mass(plant)
    g = load_of(plant, minv, motion, buffer, force, base, time, step)
    a = acceleration(plant, minv, motion.x, motion.v, motion.z, motion.mode, g[0], time)[0]
    after = advance_sample(plant, minv, motion, g, base, time, step)
    return (after, push(buffer, motion.x, motion.v)), a


@jit_kept
def run_on(
    plant: Plant, inputs: InterpolatedInput, motion: Motion, buffer: DelayBuffer
) -> tuple[Run, tuple[Motion, DelayBuffer]]:
    """Acceleration (n, dof) at every sample of a run that goes on from a state, and the states at the samples and after
    the last."""

    def body(carry, sample):
        motion, buffer = carry
        after, a = _after(plant, inputs.step, motion, buffer, sample)
        return after, (a, carry)

    last, (a, states) = jax.lax.scan(body, (motion, buffer), (inputs.force, inputs.base, inputs.time, inputs.near))
    return a, jax.tree.map(lambda rows, end: jnp.concatenate([rows, end[None]]), states, last)
