"""What a function of one's own does near a motion that was measured.

Its equation of motion M(q, p) a + b(q, v, t, p) = g is taken to the first order about the motion (q, v, a) at each
instant, and to the first order in the numbers p, in which the equations of mechanics are linear. A filter follows the
measured motion by itself, so that this is all it sees of the function; and a program that has tables in place of a
function serves every function.
"""

from dataclasses import replace
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._types import Array
from ..structures import EvaluatedMotion, OwnMotion
from ._plant import Local, Plant

_AT_ONCE = 1024
"""Instants that one call is for."""
_STEP = 1e-5
"""Step of a central difference, as a share of the motion or of a number."""


class Tabulated(eqx.Module):
    """Mass matrix, stiffness and damping near a motion `x`, `v`, and the force that all but the inertia needs in it.

    Masses and forces are for numbers of zero, and what each number adds stands beside. The slopes hold up to `reach`
    (2, dof) from the motion.
    """

    mass: Float[Array, "*n nodes dof dof"]
    mass_by: Float[Array, "*n nodes own dof dof"]
    force: Float[Array, "*n nodes dof"]
    force_by: Float[Array, "*n nodes own dof"]
    stiffness: Float[Array, "*n nodes dof dof"]
    damping: Float[Array, "*n nodes dof dof"]
    x: Float[Array, "*n nodes dof"]
    v: Float[Array, "*n nodes dof"]
    reach: Float[Array, "*n 2 dof"]

    def of(self, numbers: Float[Array, " own"], time: Float[Array, ""], step: Float[Array, ""]) -> Local:
        """What these numbers make of a sample's row of it, from `time` on."""
        mass = self.mass + jnp.sum(numbers[None, :, None, None] * self.mass_by, 1)
        force = self.force + jnp.sum(numbers[None, :, None] * self.force_by, 1)
        return Local(mass, force, self.stiffness, self.damping, self.x, self.v, self.reach, time, step)


def near(plant: Plant, table: Tabulated | None, time: Float[Array, ""], step: Float[Array, ""]) -> Plant:
    """The plant that moves as a sample's row of a table says; the same one without a table."""
    return plant if table is None else replace(plant, local=table.of(plant.own_numbers, time, step))


def about_a_state(
    plant: Plant, x: Float[np.ndarray, " dof"], v: Float[np.ndarray, " dof"], time: float, step: float
) -> Plant:
    """The plant with a table about one state, for a `step` from a `time` on, in place of a function that no program of
    JAX holds."""
    assert isinstance(plant.own, EvaluatedMotion)
    own = plant.own.with_numbers(np.asarray(plant.own_numbers))
    x, v = (np.repeat(np.asarray(q, float)[None], 2, 0) for q in (x, v))
    table = tabulated(own, np.zeros(0), x, v, np.zeros_like(x), time + np.array([0.0, step]), nodes=2)
    row = jax.tree.map(lambda rows: jnp.asarray(rows[0]), table)
    bare = replace(plant, own=None, own_numbers=jnp.zeros(0))
    return near(bare, row, jnp.asarray(time), jnp.asarray(step))


class _Equation(NamedTuple):
    """Mass matrix of a motion at its instants, the force that all but the inertia needs, what more of both by one more
    of each number, and the slopes of the whole by displacement and velocity."""

    mass: Float[np.ndarray, "n dof dof"]
    force: Float[np.ndarray, "n dof"]
    mass_by: Float[np.ndarray, "n own dof dof"]
    force_by: Float[np.ndarray, "n own dof"]
    stiffness: Float[np.ndarray, "n dof dof"]
    damping: Float[np.ndarray, "n dof dof"]


def tabulated(
    own: OwnMotion | EvaluatedMotion,
    numbers: Float[np.ndarray, " own"],
    x: Float[np.ndarray, "nodes dof"],
    v: Float[np.ndarray, "nodes dof"],
    a: Float[np.ndarray, "nodes dof"],
    time: Float[np.ndarray, " nodes"],
    *,
    nodes: int,
    between: int = 1,
    reach: Float[np.ndarray, "2 dof"] | None = None,
) -> Tabulated:
    """The table (n, nodes, ...) of a function near a motion, `nodes` a sample with both its ends.

    The motion is given on all of them, an end that two samples share but once. Slopes are asked for at one of
    `between` of these, and straight in between; they hold up to `reach` from the motion, or anywhere.
    """
    e = _equation(own, numbers, x, v, a, time, between)
    mass = e.mass - np.einsum("p,npij->nij", numbers, e.mass_by)
    force = e.force - np.einsum("p,npi->ni", numbers, e.force_by)
    take = (nodes - 1) * np.arange((len(time) - 1) // (nodes - 1))[:, None] + np.arange(nodes)
    parts: Any = mass, e.mass_by, force, e.force_by, e.stiffness, e.damping, x, v
    reach = np.full((2, x.shape[1]), np.inf) if reach is None else reach
    rows: Any = [*(part[take] for part in parts), np.broadcast_to(reach, (len(take), *reach.shape))]
    return Tabulated(*rows)


def own_force(
    own: OwnMotion | EvaluatedMotion,
    numbers: Float[np.ndarray, " own"],
    x: Float[np.ndarray, "n dof"],
    v: Float[np.ndarray, "n dof"],
    a: Float[np.ndarray, "n dof"],
    time: Float[np.ndarray, " n"],
) -> tuple[Float[np.ndarray, "n dof"], Float[np.ndarray, "n dof dof"], Float[np.ndarray, "n dof own"]]:
    """Force (n, dof) that a plant of its own motion needs for accelerations `a` (n, dof) along a motion.

    With its derivatives (n, dof, dof) by the accelerations, which are the mass matrices, and (n, dof, own) by the
    logarithms of the plant's numbers.
    """
    e = _equation(own, numbers, x, v, a, time)
    by_numbers = np.einsum("npij,nj->nip", e.mass_by, a) + np.moveaxis(e.force_by, 1, 2)
    return np.einsum("nij,nj->ni", e.mass, a) + e.force, e.mass, by_numbers * np.asarray(numbers)


def _equation(own: OwnMotion | EvaluatedMotion, numbers, x, v, a, time, between: int = 1) -> _Equation:
    """The equation of motion at some instants."""
    numbers, some = np.asarray(numbers), slice(None, None, between)
    if isinstance(own, OwnMotion):
        found = _in_lots(_here_traced, own, numbers, x, v, time)
        rates = _in_lots(_slopes_traced, own, numbers, x[some], v[some], a[some], time[some])
    else:
        found = _here(own, numbers, x, v, time)
        rates = _slopes(own, numbers, x[some], v[some], a[some], time[some])
    if between > 1:
        place = np.arange(len(time)) / between
        k = np.minimum(place.astype(int), len(rates[0]) - 2)
        share = place - k
        rates = [q[k] + (q[k + 1] - q[k]) * share.reshape(-1, *(1,) * (q.ndim - 1)) for q in rates]
    return _Equation(*found, *rates)


def _in_lots(ask: Any, own: OwnMotion, numbers: np.ndarray, *rows: np.ndarray) -> list[np.ndarray]:
    """What a program gives for rows, of which each call takes as many."""
    count = len(rows[0])
    full = [np.pad(q, ((0, -count % _AT_ONCE), *((0, 0),) * (q.ndim - 1)), "edge") for q in rows]
    lots = [ask(own, numbers, *(q[i : i + _AT_ONCE] for q in full)) for i in range(0, len(full[0]), _AT_ONCE)]
    return [np.concatenate([np.asarray(lot) for lot in each])[:count] for each in zip(*lots, strict=True)]


def _mass_and_force(own: OwnMotion, numbers, x, v, t):
    """Mass matrix in a state, and the force that all but the inertia needs."""
    mass = jnp.linalg.inv(own.answer(numbers, x, v, t))
    return mass, -mass @ own(numbers, x, v, jnp.zeros_like(x), t)


@eqx.filter_jit
def _here_traced(own: OwnMotion, numbers, x, v, time):
    return jax.vmap(lambda x, v, t: _mass_and_force(own, numbers, x, v, t))(x, v, time)


@eqx.filter_jit
def _slopes_traced(own: OwnMotion, numbers, x, v, a, time):
    def one(x, v, a, t):
        def needed(x, v):
            mass, force = _mass_and_force(own, numbers, x, v, t)
            return mass @ a + force

        mass_by, force_by = jax.jacfwd(lambda numbers: _mass_and_force(own, numbers, x, v, t))(numbers)
        return jnp.moveaxis(mass_by, 2, 0), force_by.T, *jax.jacfwd(needed, (0, 1))(x, v)

    return jax.vmap(one)(x, v, a, time)


def _here(own: EvaluatedMotion, numbers, x, v, time):
    """As `_mass_and_force`, of all instants at once."""
    rows, none = np.broadcast_to(numbers, (len(x), len(numbers))), np.zeros_like(x)
    mass = np.linalg.inv(own.answers(rows, x, v, none, time))
    return mass, -np.einsum("nij,nj->ni", mass, own.many(rows, x, v, none, time))


def _slopes(own: EvaluatedMotion, numbers, x, v, a, time):
    """The slopes of a function that is no program of JAX: central differences."""
    dof, count = x.shape[1], len(numbers)

    def needed(x, v, a, time):
        mass, force = _here(own, numbers, x, v, time)
        return np.einsum("nij,nj->ni", mass, a) + force

    mass_by, force_by = np.zeros((len(x), count, dof, dof)), np.zeros((len(x), count, dof))
    for k, step in enumerate(_STEP * np.maximum(np.abs(numbers), _STEP)):
        moved = step * (np.arange(count) == k)
        there, back = (_here(own, numbers + sign * moved, x, v, time) for sign in (1, -1))
        mass_by[:, k], force_by[:, k] = ((p - q) / (2 * step) for p, q in zip(there, back, strict=True))
    # Of all coordinates at once, one way and the other: a function in NumPy is slow by the call.
    steps = _STEP * np.maximum(np.std(np.hstack([x, v]), 0), _STEP)
    moved = np.concatenate([np.diag(steps), -np.diag(steps)])[:, None]
    at_x, at_v, at_a = (np.broadcast_to(q, (4 * dof, *q.shape)) for q in (x, v, a))
    states = (at_x + moved[..., :dof], at_v + moved[..., dof:], at_a)
    in_x, in_v, in_a = (q.reshape(-1, dof) for q in states)
    found = needed(in_x, in_v, in_a, np.tile(time, 4 * dof)).reshape(2, 2 * dof, len(x), dof)
    slopes = np.moveaxis((found[0] - found[1]) / (2 * steps)[:, None, None], 0, 2)
    return mass_by, force_by, slopes[..., :dof], slopes[..., dof:]
