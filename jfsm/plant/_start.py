"""Initial state of a free run."""

from dataclasses import replace
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._traced import jit_kept
from .._types import as_array
from ..records import Record
from ..structures import EvaluatedMotion, Structure
from ._course import Course
from ._drive import Reconstruction
from ._excitation import bucket, excitation, substeps_for, typical_size
from ._grid import free_run, shifted
from ._plant import Channel, Grid, lower, observation_of
from ._tabulated import Tabulated

_ITERATIONS = 12
_FAR = 0.1
"""Error of a run, as a share of the channels' spread, from which its start is sought otherwise as well."""
_SHARES, _FEWEST = (0.06, 0.12, 0.25, 0.5, 1.0), 8
"""Shares of the samples that are seen one after the other, and the fewest samples."""


def starting_state(
    model: Structure,
    record: Record,
    initial_state: Any = None,
    *,
    window: int = 50,
    reconstruction: Reconstruction = "band-limited",
) -> tuple[Float[np.ndarray, " dof"], Float[np.ndarray, " dof"]]:
    """Displacement and velocity (dof,) at the first sample.

    In this order: `initial_state`; rest if the record says so; least squares of the structure over the first `window`
    samples of the response (Gauss-Newton with a Levenberg-Marquardt guard, every channel divided by its
    spread); rest.
    """
    dof = model.dof
    if initial_state is not None:
        try:
            x0, v0 = initial_state
        except (TypeError, ValueError):
            raise ValueError(
                f"`initial_state` must be a pair (displacement, velocity); got {initial_state!r}."
            ) from None
        pair = []
        for name, value in (("displacement", x0), ("velocity", v0)):
            array = np.atleast_1d(as_array(value, f"initial_state {name}", (0, 1)))
            if array.shape != (dof,):
                raise ValueError(
                    f"`initial_state` {name} must have one value per degree of freedom ({dof}); got {array.size}."
                )
            pair.append(array)
        return pair[0], pair[1]
    if record.at_rest or not record.responses:
        return np.zeros(dof), np.zeros(dof)
    return _least_squares(model, record[: min(window, len(record))], reconstruction)


def check_window(window: Any) -> None:
    """Refuse what is no number of samples to find a start from.

    Raises
    ------
    ValueError
        With what it was.
    """
    if not isinstance(window, int | np.integer) or isinstance(window, bool) or window < 2:
        raise ValueError(f"`window` must be a whole number of samples from 2 on; got {window!r}. Leave it out for 50.")


def _least_squares(model: Structure, head: Record, reconstruction: Reconstruction) -> tuple[np.ndarray, np.ndarray]:
    channels = tuple(head.responses)
    y = np.column_stack([head.responses[c] for c in channels])
    spread = np.maximum(np.std(y, axis=0), 1e-12 * np.max(np.abs(y)) + 1e-300)
    padded = bucket(len(head))
    substeps = substeps_for(model, head.dt, typical_size(head))
    inputs = excitation(head, model.dof, substeps, reconstruction, length=padded)
    counted = (np.arange(padded) < len(head)).astype(float)
    plant = lower(model, channels, grid=Grid(head.dt, substeps), rolled=True)
    observation = observation_of(channels, model.dof)
    offset = y - np.asarray(plant.channel_offset)
    state = np.zeros(2 * model.dof)
    for i, (kind, j) in enumerate(channels):  # a measured channel is its own best first guess
        if kind in ("displacement", "velocity"):
            state[(j - 1) + (model.dof if kind == "velocity" else 0)] = offset[0, i]
    near = _near(model, channels, offset, head)
    if near is not None:  # so near the readings as the start must be, a table stands for the function
        rows = [(0, padded - len(head))]
        near = jax.tree.map(lambda q: np.pad(q, rows + [(0, 0)] * (q.ndim - 1), "edge"), near)
        inputs, plant = replace(inputs, near=near), replace(plant, own=None)
    readings = np.pad(y, ((0, padded - len(head)), (0, 0)))
    known = plant, observation, inputs, readings, spread, counted
    cost, found = min((_descended(known, begin) for begin in (state, *_rests(model, channels))), key=lambda end: end[0])
    if cost > _FAR**2 * y.size:
        _, found = min((cost, found), _grown(known, state), key=lambda end: end[0])
    return found[: model.dof], found[model.dof :]


def _near(
    model: Structure, channels: tuple[Channel, ...], readings: Float[np.ndarray, "n channels"], head: Record
) -> Tabulated | None:
    """The table of a simulation's function near the readings; None where there is no such function, or where they do
    not show every coordinate."""
    if model.own is None:
        return None
    course = Course.of(dict(zip(channels, readings.T, strict=True)), model.dof, head.dt, float(head.time[0]))
    if course is not None:
        return course.near(model)
    if isinstance(model.own, EvaluatedMotion):
        raise ValueError(
            "`record` must show the displacement of every coordinate, or begin at rest, for the start of a simulation "
            "by `from_accelerations` to be found; pass `initial_state`, or make the record with `at_rest=True`."
        )
    return None


def _grown(known: tuple, state: np.ndarray) -> tuple[float, np.ndarray]:
    """The cost and the state where steps end that see a few samples first, and then more and more of them.

    Of a motion from well to well many samples together lead astray from a start that is not near.
    """
    counted, cost = known[-1], np.inf
    for share in _SHARES:
        seen = counted * (np.arange(counted.size) < max(share * np.sum(counted), _FEWEST))
        cost, state = _descended((*known[:-1], seen), state)
    return cost, state


def _rests(model: Structure, channels: tuple[Channel, ...]) -> list[np.ndarray]:
    """Equilibria away from zero, of masses whose displacement is not measured."""
    grounded = [(max(at), rest) for at, rest in model.rests() if min(at) == 0]
    unseen = [(j, rest) for j, rest in grounded if ("displacement", j) not in channels]
    return [np.where(np.arange(2 * model.dof) == j - 1, rest, 0.0) for j, rest in unseen]


def _descended(known: tuple, state: np.ndarray) -> tuple[float, np.ndarray]:
    """Guarded Gauss-Newton steps from a state: the cost at their end, and the state there.

    On the host, from one program for residuals and slopes. `optimistix.LevenbergMarquardt` ends at the same states, but
    its loop around the run takes three to four times as long to compile, and twice as long to run.
    """
    plant, observation, inputs, readings, spread, counted = known
    damp, best = 1e-6, None
    for _ in range(_ITERATIONS):
        residual, slope = _residuals(plant, observation, inputs, readings, spread, counted, state)
        residual, slope = np.asarray(residual), np.asarray(slope)
        cost = float(residual @ residual) if np.all(np.isfinite(residual)) else np.inf
        if best is None or cost < best[0]:
            improved = best is None or cost < best[0] * (1 - 1e-10)
            best, damp = (cost, state, residual, slope), damp / 10
            if not improved:
                break
        else:
            damp *= 100
        _, state, residual, slope = best
        with np.errstate(over="ignore", invalid="ignore"):  # a start from which the motion runs away
            normal = slope.T @ slope
        if not np.all(np.isfinite(normal)):
            break
        step = np.linalg.lstsq(normal + damp * np.diag(np.diag(normal)), -slope.T @ residual, rcond=None)[0]
        state = best[1] + step
    assert best is not None
    return best[:2]


@jit_kept
def _residuals(plant, observation, inputs, y, spread, counted, state):
    dof = plant.dof

    def residual(state):
        x, v, a = free_run(plant, inputs, state[:dof], state[dof:])
        shown = {"displacement": x, "velocity": v, "acceleration": a + inputs.base[:, :1]}
        rows = zip(observation.kinds, observation.select, strict=True)
        seen = jnp.stack([shown[kind] @ row for kind, row in rows], 1)
        used = jnp.broadcast_to(counted[:, None] > 0, seen.shape)
        for tau, channel in zip(plant.channel_delay / inputs.step, plant.late_channel, strict=True):
            seen = seen.at[:, channel].set(shifted(seen[:, channel], -tau))
            then = jnp.arange(counted.size) - tau  # earlier readings do not depend on the state at the start
            used = used.at[:, channel].set(used[:, channel] & (then >= 0) & (then <= jnp.sum(counted) - 1))
        shown_by_sensors = (1 + plant.channel_gain)[None, :] * seen + plant.channel_offset[None, :]
        return jnp.where(used, (shown_by_sensors - y) / spread[None, :], 0.0).ravel()

    jacobian = jax.vmap(partial(jax.jvp, residual, (state,)), out_axes=(None, 1))
    value, slope = jacobian((jnp.eye(2 * dof),))
    return value, slope
