"""What the linear part of a model makes of a measured drive, without a fit and without a compiled program."""

from collections.abc import Mapping

import numpy as np
import scipy.linalg
import scipy.signal

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
    if np.max(np.abs(np.linalg.eigvals(scipy.linalg.expm(flow * record.dt)))) ** len(record) > _ESCAPED:
        return {}
    whole = flow, entry, np.eye(2 * dof), np.zeros((2 * dof, dof))
    state = np.asarray(scipy.signal.lsim(whole, force, record.dt * np.arange(len(record)))[2])
    x, v = state[:, :dof], state[:, dof:]
    a = (state @ flow.T + force @ entry.T)[:, dof:]
    if record.base_acceleration is not None:
        a = a + record.base_acceleration[:, None]
    shown = {"displacement": x, "velocity": v, "acceleration": a}
    return {(kind, j): shown[kind][:, j - 1] for kind, j in record.responses}
