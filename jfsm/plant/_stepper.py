"""One step on the sample grid: Runge-Kutta of order four, with true stick and located reversals for friction.

While every link either slides one way or sticks, the motion is smooth. So a step freezes that *mode* (+1, -1, or 0 for
sticking), looks for the first instant at which a mode ends (a sliding speed passes zero, or the force that holds a
sticking link passes its limit), steps to that instant, decides the next mode from the force needed to stick, and
continues. The number of such segments in a step is fixed, so that many runs go side by side. Hidden states take part in
the Runge-Kutta steps, and are put back within their bounds at the end of each.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Bool, Float

from .._traced import kept_result
from .._types import Array
from ._forces import (
    Hidden,
    Modes,
    Scalar,
    Square,
    State,
    force_in_front,
    friction_limits,
    function_force,
    has_parts_behind,
    hidden_rate,
    settle,
    smooth_force,
)
from ._plant import Plant

_SEGMENTS = 3
"""Modes that one step may pass through: slide, stick, slide."""
_SHARED = 1e-10
"""Compliance of a sticking link, as a share of that of the masses: links in a loop or in parallel share the load."""


@kept_result
class Motion(NamedTuple):
    """State of a run: displacement, velocity, hidden states, and mode of each friction slot."""

    x: State
    v: State
    z: Hidden
    mode: Modes


class Load(NamedTuple):
    """Forces at the start, the middle and the end of a step, the base's acceleration, its start time and its length."""

    force: Float[Array, "3 dof"]
    base: Float[Array, " 3"]
    time: Scalar
    step: Scalar

    def at(self, share: Scalar) -> State:
        """Force at a share of the step, by the parabola through the three values."""
        a, b, c = self.force[0], self.force[1], self.force[2]
        return a + share * (4 * b - 3 * a - c) + share * share * (2 * a + 2 * c - 4 * b)


def inverse_mass(plant: Plant) -> Square:
    """Inverse of the mass matrix, formed once per run."""
    return 1.0 / plant.mass if plant.dof == 1 else jnp.linalg.inv(plant.mass)


def times(matrix: Float[Array, "rows columns"], vector: Float[Array, " columns"]) -> Float[Array, " rows"]:
    """Product of a small matrix and a vector."""
    # Written as a sum: a matrix product of this size would leave the fused loop of the compiled step.
    return jnp.sum(matrix * vector[None, :], 1)


def inverse_mass_at(plant: Plant, minv: Square, x: State, v: State, t: Scalar) -> Square:
    """Inverse of the mass matrix in a state: that of a plant with its own motion is another one in every state."""
    if plant.local is not None:
        mass = plant.local.mass_at(t)
        return _solved(mass - plant.behind if plant.behind.size else mass, jnp.eye(plant.dof))
    if plant.own is None:
        return minv
    answer = plant.own.answer(plant.own_numbers, x, v, t)
    if not has_parts_behind(plant):
        return answer
    return _solved(_solved(answer, jnp.eye(plant.dof)) - plant.behind, jnp.eye(plant.dof))


def free_acceleration(plant: Plant, minv: Square, x: State, v: State, z: Hidden, g: State, t: Scalar) -> State:
    """Acceleration without friction."""
    net = g - smooth_force(plant, x, v, z, t)
    if has_parts_behind(plant):
        there = inverse_mass_at(plant, minv, x, v, t)
        return times(there, net - force_in_front(plant, function_force(plant, x, v, z, t)))
    if plant.local is not None:
        return _solved(plant.local.mass_at(t), net - plant.local.force_at(x, v, t))
    return times(minv, net) if plant.own is None else plant.own(plant.own_numbers, x, v, net, t)


def linearised(
    plant: Plant, minv: Square, x: State, v: State, z: Hidden, g: State, t: Scalar
) -> tuple[State, Float[Array, "state state"]]:
    """Acceleration without friction, and derivative of the rate of (x, v, z) by (x, v, z), the base at rest."""
    dof = plant.dof

    def rate(state):
        x, v, z = state[:dof], state[dof : 2 * dof], state[2 * dof :]
        a = free_acceleration(plant, minv, x, v, z, g, t)
        return jnp.concatenate([v, a, hidden_rate(plant, x, v, z, t, jnp.zeros(()))])

    state = jnp.concatenate([x, v, z])
    push = jax.vmap(lambda e: jax.jvp(rate, (state,), (e,)), out_axes=(None, 1))
    rates, slopes = push(jnp.eye(state.size))
    return rates[dof : 2 * dof], slopes


def holding_force(plant: Plant, minv: Square, a: State, sticking: Bool[Array, " slots"]) -> Modes:
    """Friction forces that keep the sticking links from moving, given the acceleration `a` without them."""
    rows = plant.friction.direction
    need = jnp.sum(rows * a[None, :], 1)
    compliance = jnp.sum(rows[:, None, :] * jnp.sum(minv[None, :, :] * rows[:, None, :], 2)[None, :, :], 2)
    if rows.shape[0] == 1:
        return jnp.where(sticking, need / jnp.where(compliance[0] > 0, compliance[0], 1.0), 0.0)
    both = sticking[:, None] & sticking[None, :]
    matrix = jnp.where(both, compliance, jnp.eye(rows.shape[0]))
    matrix = jnp.where(jnp.diag(matrix)[:, None] > 0, matrix, jnp.eye(rows.shape[0]))
    matrix = matrix + _SHARED * jnp.diag(jnp.diag(matrix))
    return _solved(matrix, jnp.where(sticking, need, 0.0))


def _solved(matrix, right):
    """Solution of a small positive definite system, of a vector or of columns."""
    # Eliminated here, without pivots: a call of a library would leave the compiled step.
    for i in range(right.shape[0]):
        row, value = matrix[i] / matrix[i, i], right[i] / matrix[i, i]
        others = jnp.where(jnp.arange(right.shape[0]) == i, 0.0, matrix[:, i])
        matrix = (matrix - others[:, None] * row[None, :]).at[i].set(row)
        of_value = others * value if right.ndim == 1 else others[:, None] * value[None, :]
        right = (right - of_value).at[i].set(value)
    return right


def acceleration(
    plant: Plant, minv: Square, x: State, v: State, z: Hidden, mode: Modes, g: State, t: Scalar
) -> tuple[State, Modes]:
    """Acceleration in the given mode, and the margin of each friction slot: negative once its mode has ended."""
    return with_friction(plant, minv, x, v, mode, free_acceleration(plant, minv, x, v, z, g, t), t)


def with_friction(
    plant: Plant, minv: Square, x: State, v: State, mode: Modes, a: State, t: Scalar
) -> tuple[State, Modes]:
    """`acceleration`, from the one without friction."""
    if not len(plant.friction):
        return a, mode
    minv = inverse_mass_at(plant, minv, x, v, t)
    low, high = friction_limits(plant, x, v, t)
    rows = plant.friction.direction
    sliding = jnp.where(mode > 0, high, jnp.where(mode < 0, low, 0.0))
    a = a - times(minv, jnp.sum(rows * sliding[:, None], 0))
    held = holding_force(plant, minv, a, mode == 0)
    a = a - times(minv, jnp.sum(rows * held[:, None], 0))
    margin = jnp.where(mode == 0, jnp.minimum(high - held, held - low), mode * jnp.sum(rows * v[None, :], 1))
    return a, margin


def mode_at(
    plant: Plant,
    minv: Square,
    x: State,
    v: State,
    z: Hidden,
    g: State,
    t: Scalar,
    still: Bool[Array, " slots"] | bool = False,
) -> Modes:
    """Mode of each friction slot in a state: the sign of its speed; at rest, 0 or the sign of its breakaway.

    Slots that are known to be `still` are at rest whatever rounding made of their speeds.
    """
    if not len(plant.friction):
        return jnp.zeros(0)
    speed = jnp.sum(plant.friction.direction * v[None, :], 1)
    return _from_rest(plant, minv, x, v, z, g, t, jnp.where(still, 0.0, jnp.sign(speed)), jnp.zeros(speed.shape, bool))


def _from_rest(plant: Plant, minv, x, v, z, g, t, mode, broken):
    # Force needed to hold the links at rest while the others slide; beyond a limit a link breaks away. One that is
    # known to have broken follows the pull: at the instant itself rounding decides about the limit.
    rows, rest = plant.friction.direction, mode == 0
    low, high = friction_limits(plant, x, v, t)
    there = inverse_mass_at(plant, minv, x, v, t)
    sliding = jnp.where(mode > 0, high, jnp.where(mode < 0, low, 0.0))
    a = free_acceleration(plant, minv, x, v, z, g, t) - times(there, jnp.sum(rows * sliding[:, None], 0))
    held = holding_force(plant, there, a, rest)
    low, high = jnp.where(broken, (low + high) / 2, low), jnp.where(broken, (low + high) / 2, high)
    return jnp.where(rest, jnp.where(held > high, 1.0, jnp.where(held < low, -1.0, 0.0)), mode)


_SHARES = ((0.5, 1 / 6), (0.5, 1 / 3), (1.0, 1 / 3), (0.0, 1 / 6))
"""Of each stage of the Runge-Kutta method: the share of the step to the next stage, and its weight in the sum."""


def runge_kutta(rate, y, h, nodes, rolled: bool = False):
    """`y`, a tree of arrays, one step `h` on: the method of order four.

    `rate(y, node)` is its rate at the beginning, the middle and the end of the step, which are the three `nodes`. The
    stages are written out, or `rolled` into a loop.
    """

    def along(share, slope):
        return jax.tree.map(lambda y, r: y + share * r, y, slope)

    begin, middle, end = nodes
    if rolled:

        def stage(carry, inputs):
            (at, total), (node, ahead, weight) = carry, inputs
            slope = rate(at, node)
            return (along(ahead * h, slope), jax.tree.map(lambda t, r: t + weight * h * r, total, slope)), None

        stages = jax.tree.map(lambda *each: jnp.stack(each), begin, middle, middle, end)
        return jax.lax.scan(stage, (y, y), (stages, *jnp.array(_SHARES).T))[0][1]
    k1 = rate(y, begin)
    k2 = rate(along(h / 2, k1), middle)
    k3 = rate(along(h / 2, k2), middle)
    k4 = rate(along(h, k3), end)
    return jax.tree.map(lambda y, a, b, c, d: y + h / 6 * (a + 2 * b + 2 * c + d), y, k1, k2, k3, k4)


def _in_mode(plant: Plant, minv, x, v, z, mode, load: Load, start, share):
    """State after `share` of the step from `start` (both shares of the whole step), in a frozen mode."""
    first, last = load.time + start * load.step, load.time + (start + share) * load.step
    middle = load.time + (start + share / 2) * load.step
    # The base's inertia is part of the force; its effect on hidden masses is taken at the three nodes.
    nodes = (
        (load.at(start), load.base[0], first),
        (load.at(start + share / 2), load.base[1], middle),
        (load.at(start + share), load.base[2], last),
    )

    def rate(state, node):
        (x, v, z), (g, base, t) = state, node
        return v, acceleration(plant, minv, x, v, z, mode, g, t)[0], hidden_rate(plant, x, v, z, t, base)

    x, v, z = runge_kutta(rate, (x, v, z), share * load.step, nodes, plant.rolled)
    return x, v, settle(plant, x, z)


def advance(plant: Plant, minv: Square, motion: Motion, load: Load) -> Motion:
    """Motion at the end of one step."""
    end = in_mode(plant, minv, motion, load)
    if not len(plant.friction):
        return end
    over = any_ended(plant, minv, end, load)
    return jax.lax.cond(over, lambda: through_events(plant, minv, motion, end, load), lambda: end)


def in_mode(plant: Plant, minv: Square, motion: Motion, load: Load) -> Motion:
    """Motion at the end of one step, had no mode ended in it."""
    return Motion(*_in_mode(plant, minv, *motion, load, jnp.zeros(()), jnp.ones(())), motion.mode)


def any_ended(plant: Plant, minv: Square, end: Motion, load: Load) -> Bool[Array, ""]:
    """Whether any mode has ended before the `end` of a step."""
    return jnp.any(acceleration(plant, minv, *end, load.force[2], load.time + load.step)[1] < 0)


def through_events(plant: Plant, minv: Square, motion: Motion, end: Motion, load: Load) -> Motion:
    """Motion at the end of a step in which modes end; `end` is where the first of them would lead."""
    rows, one = plant.friction.direction, jnp.ones(())

    def switch(carry, _):
        (x, v, z, mode), start, (xe, ve, ze, _) = carry
        left = 1.0 - start
        ended = acceleration(plant, minv, xe, ve, ze, mode, load.at(one), load.time + load.step)[1] < 0
        path = _path(plant, minv, (x, v, z), (xe, ve, ze), mode, load, start, left)
        shares = jnp.where(ended, _event(plant, minv, path, mode, load, start, left), 1.0)
        share = jnp.min(shares)
        xs, vs, zs = path(share)
        now = start + left * share
        switching = ended & (shares == share)
        there = inverse_mass_at(plant, minv, xs, vs, load.time + now * load.step)
        vs = vs - stopping(there, rows, jnp.sum(rows * vs[None, :], 1), switching & (mode != 0))
        resting = jnp.where(switching, 0.0, mode)
        broken = switching & (mode == 0)
        decided = _from_rest(plant, minv, xs, vs, zs, load.at(now), load.time + now * load.step, resting, broken)
        at = Motion(xs, vs, zs, jnp.where(switching, decided, mode))
        then = Motion(*_in_mode(plant, minv, *at, load, now, 1.0 - now), at.mode)
        switched, kept = (at, now, then), carry
        return jax.tree.map(lambda new, old: jnp.where(jnp.any(ended), new, old), switched, kept), None

    # The last mode continues to the end of the step, which is short compared to the time between reversals.
    (_, _, end), _ = jax.lax.scan(switch, (motion, jnp.zeros(()), end), length=_SEGMENTS - 1)
    return end


def stopping(minv: Square, rows: Float[Array, "slots dof"], speed: Modes, stopped: Bool[Array, " slots"]) -> State:
    """Velocity that must go for the stopped links to be at rest exactly."""
    effect = jnp.sum(minv[None, :, :] * rows[:, None, :], 2)
    scale = jnp.sum(rows * effect, 1)
    return jnp.sum(jnp.where(stopped, speed / jnp.where(scale > 0, scale, 1.0), 0.0)[:, None] * effect, 0)


def _path(plant, minv, begin, end, mode, load, start, left):
    """State along the rest of a step: cubic Hermite for x from v, for v from the accelerations at both ends, and so on.

    Its error is of the order of the step's own, and it is used at events only.
    """
    (x, v, z), (xe, ve, ze) = begin, end
    h, one = left * load.step, jnp.ones(())
    t0, t1 = load.time + start * load.step, load.time + load.step
    a0 = acceleration(plant, minv, x, v, z, mode, load.at(start), t0)[0]
    a1 = acceleration(plant, minv, xe, ve, ze, mode, load.at(one), t1)[0]
    r0 = hidden_rate(plant, x, v, z, t0, load.base[0])
    r1 = hidden_rate(plant, xe, ve, ze, t1, load.base[2])

    def state(s):
        h00, h10, h01, h11 = 2 * s**3 - 3 * s**2 + 1, s**3 - 2 * s**2 + s, 3 * s**2 - 2 * s**3, s**3 - s**2
        return tuple(
            h00 * y0 + h10 * h * rate0 + h01 * y1 + h11 * h * rate1
            for y0, rate0, y1, rate1 in ((x, v, xe, ve), (v, a0, ve, a1), (z, r0, ze, r1))
        )

    return state


def _event(plant, minv, path, mode, load, start, left):
    """Share of the rest of a step at which each mode ends, for those that do.

    Four steps of regula falsi (Illinois) along the path; one more by its slope, taken with the found instant held
    fixed, gives the instant its exact derivative.
    """

    def margin(s):
        place = start + left * s
        x, v, z = path(s)
        return acceleration(plant, minv, x, v, z, mode, load.at(place), load.time + place * load.step)[1]

    slots = jnp.arange(len(plant.friction))

    def narrow(bracket, _):
        low, f_low, high, f_high = bracket
        middle = low + (high - low) * _crossing(f_low, f_high)
        f = jax.vmap(margin)(middle)[slots, slots]
        above = f > 0
        inside = (jnp.where(above, middle, low), jnp.where(above, f, f_low / 2))
        return (*inside, jnp.where(above, high, middle), jnp.where(above, f_high / 2, f)), None

    zero, one = jnp.zeros(()), jnp.ones(())
    ends = (jnp.zeros(slots.size), jnp.maximum(margin(zero), 0.0), jnp.ones(slots.size), margin(one))
    (low, f_low, high, f_high), _ = jax.lax.scan(narrow, jax.lax.stop_gradient(ends), length=4)
    found = jax.lax.stop_gradient(low + (high - low) * _crossing(f_low, f_high))
    value, slope = jax.vmap(lambda s: jax.jvp(margin, (s,), (one,)))(found)
    value, slope = value[slots, slots], jax.lax.stop_gradient(slope[slots, slots])
    correction = jnp.where(slope < 0, value / jnp.where(slope < 0, slope, 1.0), 0.0)
    return jnp.clip(found - correction, 0.0, 1.0)


def _crossing(above, below):
    """Share of an interval at which the line from `above` > 0 to `below` < 0 crosses zero."""
    gap = above - below
    return jnp.where(gap > 0, above / jnp.where(gap > 0, gap, 1.0), 0.5)
