"""Free runs of a plant whose own function is asked for in states, not traced.

A stretch of the run is found by Newton's method on the whole of it: the function is tabulated near the last guess, the
plant that moves as the table says is run, and its motion is the next guess. Errors square from one to the next. What
has settled at the beginning of the stretch is kept, and the next stretch begins there.
"""

from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicHermiteSpline

from ..structures import EvaluatedMotion
from ._grid import InterpolatedInput, begin, run_on, undelayed
from ._plant import Plant
from ._stepper import inverse_mass
from ._tabulated import about_a_state, tabulated

_STRETCH = 16
"""Samples of a stretch."""
_GUESSES = 12
"""Guesses of one stretch, at most."""
_AHEAD = 4
"""Samples beyond those that have settled of which a guess is believed, twice as many with every guess."""
_NODES = 9
"""Instants of a sample, with both its ends, at which the function is asked for, at most; for its slopes at the ends."""
_NO_NUMBERS = np.zeros(0)
_SETTLED = 1e-5
"""Change of the motion from one guess to the next, in its size, whose square is none."""


def run_by_itself(
    plant: Plant, inputs: InterpolatedInput, n: int, x0: Float[np.ndarray, " dof"], v0: Float[np.ndarray, " dof"]
) -> tuple[Float[np.ndarray, "n dof"], Float[np.ndarray, "n dof"], Float[np.ndarray, "n dof"]]:
    """Displacement, velocity and acceleration (relative to the base) at the first `n` samples, each (n, dof).

    Where the motion runs away, all later samples are no numbers.
    """
    assert isinstance(plant.own, EvaluatedMotion)
    own = plant.own.with_numbers(np.asarray(plant.own_numbers))
    inputs = jax.tree.map(np.asarray, undelayed(plant, inputs))
    state, first = _begin(plant, inputs, x0, v0), 0
    plant, dof = replace(plant, own=None, own_numbers=jnp.zeros(0)), plant.dof
    found = np.full((3, n, dof), np.nan)
    while first < n:
        here = _stretch(inputs, first)
        motion, states, settled = _settled(plant, own, here, state)
        count = min(settled, n - first)
        if not count:
            break
        found[:, first : first + count] = motion[:, :count]
        state, first = jax.tree.map(lambda rows, k=count: rows[k], states), first + count
    return found[0], found[1], found[2]


def _begin(plant: Plant, inputs: InterpolatedInput, x0, v0) -> Any:
    """State at the first sample: motion and delay buffer."""
    here = about_a_state(plant, x0, v0, float(inputs.time[0]), float(inputs.step))
    return begin(here, inverse_mass(plant), jnp.asarray(x0), jnp.asarray(v0), inputs)


def _stretch(inputs: InterpolatedInput, first: int) -> InterpolatedInput:
    """A stretch of the input; past its end the last sample's again."""
    rows = np.minimum(np.arange(first, first + _STRETCH), len(inputs.time) - 1)
    time = inputs.time[0] + inputs.step * np.arange(first, first + _STRETCH)
    return InterpolatedInput(inputs.force[rows], inputs.base[rows], time, inputs.step)


def _settled(plant: Plant, own: EvaluatedMotion, inputs: InterpolatedInput, state: Any) -> tuple[np.ndarray, Any, int]:
    """Motion (3, samples, dof) and states of a stretch from a state on, and how many of its samples have settled."""
    count = min(inputs.force.shape[1], _NODES)
    step = float(inputs.step)
    begin = float(inputs.time[0])
    ends = begin + step * np.arange(_STRETCH + 1)
    nodes = begin + step / (count - 1) * np.arange(_STRETCH * (count - 1) + 1)
    x0, v0 = (np.asarray(q)[None] for q in state[0][:2])
    x, v, a = (np.repeat(q, len(nodes), 0) for q in (x0, v0, 0 * v0))
    last, settled, shown, states = np.repeat(x0, _STRETCH + 1, 0), 0, np.zeros((3, _STRETCH, x0.size)), state
    for guess in range(_GUESSES):
        try:
            table = tabulated(own, _NO_NUMBERS, x, v, a, nodes, nodes=count, between=count - 1)
        except np.linalg.LinAlgError:  # so far away that its masses drown in rounding
            break
        acceleration, states = run_on(plant, replace(inputs, near=table), *state)
        position, speed, acceleration = (np.array(q) for q in (states[0].x, states[0].v, acceleration))
        finite = np.all(np.isfinite(position) & np.isfinite(speed), 1)
        until = int(np.argmin(finite)) if not np.all(finite) else len(finite)
        if until < 2:
            return shown, states, 0
        size = np.maximum(np.max(np.abs(position[:until]), 0), step * np.max(np.abs(speed[:until]), 0))
        same = np.all(np.abs(position - last)[:until] <= _SETTLED * size + 1e-300, 1)
        settled = max(int(np.argmin(same)) if not np.all(same) else until, 1) - 1
        shown = np.stack([position[:-1], speed[:-1], acceleration])
        if settled >= _STRETCH:
            break
        until = min(until, settled + _AHEAD * 2**guess)
        position[until:], speed[until:] = position[until - 1], 0.0
        x, v, a = _between(ends, position, speed, nodes)
        last = position
    return shown, states, settled


def _between(ends: np.ndarray, x: np.ndarray, v: np.ndarray, nodes: np.ndarray) -> tuple[np.ndarray, ...]:
    """Displacement, velocity and acceleration between samples."""
    speed = CubicHermiteSpline(ends, x, v)
    return speed(nodes), speed(nodes, 1), speed(nodes, 2)
