"""What the linear part of a model makes of a measured drive, without a fit and without a compiled program."""

from collections.abc import Mapping

import numpy as np
import scipy.linalg

from ...plant import Channel, numbers_of
from ...records import Record
from ...structures import Structure

_ESCAPED = 1e12
"""Growth from sample to sample, all in all, beyond which a linear part is of no use."""


def driven_run(model: Structure, record: Record) -> Mapping[Channel, np.ndarray]:
    """Response channels (n,) of the linear part of a model from rest, the drive straight between samples.

    Empty where the linear part runs away.
    """
    plant, dof = numbers_of(model), model.dof
    mass = np.asarray(plant.mass)
    force = np.zeros((len(record), dof))
    for (kind, j), y in record.channels.items():
        if kind == "force":
            force[:, j - 1] = y / (1.0 + plant.force_gain[j - 1])
    if record.base_acceleration is not None:
        force -= np.outer(record.base_acceleration, mass.sum(1))
    still, inverse = np.zeros((dof, dof)), np.linalg.inv(mass)
    flow = np.block([[still, np.eye(dof)], [-inverse @ plant.stiffness, -inverse @ plant.damping]])
    entry = np.vstack([still, inverse])
    state = _states(flow, entry, force, record.dt)
    if not np.all(np.isfinite(state)):
        return {}
    x, v = state[:, :dof], state[:, dof:]
    a = (state @ flow.T + force @ entry.T)[:, dof:]
    if record.base_acceleration is not None:
        a = a + record.base_acceleration[:, None]
    shown = {"displacement": x, "velocity": v, "acceleration": a}
    return {(kind, j): shown[kind][:, j - 1] for kind, j in record.responses}


def _states(flow: np.ndarray, entry: np.ndarray, force: np.ndarray, dt: float) -> np.ndarray:
    """States (n, 2 dof) under a force that is straight between samples, exactly."""
    size, inputs = entry.shape
    block = np.zeros((size + 2 * inputs,) * 2)
    block[:size, :size], block[:size, size : size + inputs] = flow * dt, entry * dt
    block[size : size + inputs, size + inputs :] = np.eye(inputs)
    whole = scipy.linalg.expm(block)
    step, held, ramp = whole[:size, :size], whole[:size, size : size + inputs], whole[:size, size + inputs :]
    pushed = force[:-1] @ (held - ramp).T + force[1:] @ ramp.T
    state, now = np.zeros((len(force), size)), np.zeros(size)
    if np.max(np.abs(np.linalg.eigvals(step))) ** len(force) > _ESCAPED:
        return np.full_like(state, np.nan)
    for i, push in enumerate(pushed, start=1):
        now = step @ now + push
        state[i] = now
    return state
