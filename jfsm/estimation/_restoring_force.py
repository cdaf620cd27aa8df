"""The force of a link against its motion, sample by sample: what a force state map is learned from."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from .._programs import programs_kept
from .._types import as_scalar, require_x64
from ..plant import direction
from ..records import Record, as_record, mended
from ..structures import Structure, as_model, check_places
from ._motion import estimate_motion
from ._observable import Place


@dataclass(frozen=True)
class RestoringForce:
    """Force of one link and the motion that it answers.

    Attributes
    ----------
    at : link (i, j)
    time : (n,) array
        Instants [s].
    states : (n, 2) array
        Displacement x_j - x_i and velocity v_j - v_i of the link.
    force, std : (n,) arrays
        Force in the record's unit (N), restoring side positive, and its standard error, which errors of `states` and of
        the masses are not part of.
    states_std : (n, 2) array
        Standard error of `states`; of a link between two masses as if theirs were independent.
    lacking : bool
        Whether it is what a model lacks, not all that the link exerts.
    """

    at: Place
    time: Float[np.ndarray, " n"]
    states: Float[np.ndarray, "n 2"]
    force: Float[np.ndarray, " n"]
    std: Float[np.ndarray, " n"]
    states_std: Float[np.ndarray, "n 2"]
    lacking: bool


@programs_kept()
def restoring_force(
    record: Record, model: Structure | None = None, mass: float | None = None, at: Place | None = None
) -> RestoringForce:
    """Force of a link, from the motion of `estimate_motion`: all of it, or what a model lacks of it.

    Parameters
    ----------
    record : Record
        With at least one response.
    model : Structure, optional
        The force is then what the model lacks on the link, the forces of all else being the model's.
    mass : float, optional
        Without a model: the mass [kg] of the one degree of freedom that is recorded. The force is all of g - m a.
    at : link (i, j), optional
        Needed where the model has several degrees of freedom.

    Returns
    -------
    RestoringForce

    Raises
    ------
    ValueError
        If neither or both of `model` and `mass` are given, several degrees of freedom are recorded without a model, the
        link is missing, or the channels cannot tell the force there, as `estimate_motion` says.
    """
    require_x64()
    if (model is None) == (mass is None):
        raise ValueError(
            "`model` or `mass` must be given, and not both: a force is g - m a. Give the mass for all of the link's "
            "force, or the model for what it lacks."
        )
    record = mended(as_record(record))
    if model is None:
        return _whole(record, mass, at)
    if at is not None:
        check_places([at], as_model(model).dof)
    else:
        if as_model(model).dof > 1:
            links = ", ".join(map(str, model.links))
            raise ValueError(f"`at` must name a link where the model has several degrees of freedom; it has {links}.")
        at = (0, 1)
    motion = estimate_motion(record, model, places=[at])
    if motion.latent_force is None or motion.latent_force_std is None:
        raise AssertionError  # a model was given
    row, k = direction(at, model.dof), motion.places.index(at)
    states = np.column_stack([motion.displacement @ row, motion.velocity @ row])
    unsure = np.sqrt(np.einsum("j,njk->nk", row**2, motion.std[:, :, :2] ** 2))
    return RestoringForce(
        at, motion.time, states, motion.latent_force[:, k], motion.latent_force_std[:, k], unsure, True
    )


def _whole(record: Record, mass: Any, at: Place | None) -> RestoringForce:
    """g - m a of one degree of freedom."""
    if record.dofs > 1 or at not in (None, (0, 1)):
        raise ValueError(
            f"`model` must be given for the link {at or 'of several degrees of freedom'}: without it only the force "
            f"between ground and a single mass is known, and the record has degrees of freedom up to {record.dofs}."
        )
    weight = float(as_scalar(mass))
    if weight < 0.0 or weight == 0.0 and record.drive == "force":
        raise ValueError(f"`mass` must be positive; got {weight:g}. Give it in kg, or in the record's set of units.")
    motion = estimate_motion(record)
    force = record.channels.get(("force", 1), np.zeros(len(record))) - weight * motion.acceleration[:, 0]
    states = np.column_stack([motion.displacement[:, 0], motion.velocity[:, 0]])
    std = motion.std[:, 0]
    return RestoringForce((0, 1), motion.time, states, force, weight * std[:, 2], std[:, :2], False)
