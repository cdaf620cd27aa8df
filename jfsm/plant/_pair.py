"""Check of a record against the structure that it is to be simulated or fitted with."""

import numpy as np

from .._types import known
from ..records import Record
from ..structures import Structure


def check_pair(model: Structure, record: Record, *, imposed: bool = False) -> None:
    """Refuse a record that does not fit the structure, or has an imposed motion, unless `imposed` allows that.

    Raises
    ------
    ValueError
        If the record is too short, names more degrees of freedom, or is driven by a motion; if a mass is zero.
    """
    if len(record) < 2:
        raise ValueError(f"`record` must hold at least 2 samples; it has {len(record)}.")
    if record.dofs > model.dof:
        raise ValueError(f"`record` names degree of freedom {record.dofs}; the structure has {model.dof}.")
    if model.own is not None and (record.drive == "motion" or record.base_acceleration is not None):
        raise ValueError(
            "`record` must hold the forces that drive, as samples of force={...}, for a simulation: it has "
            f"{'drive=motion' if record.drive == 'motion' else 'a moving base'}. A base that moves is part of the "
            "simulation's own function: its inertia forces go into `force`."
        )
    if record.drive == "motion":
        if imposed:
            return
        raise ValueError(
            '`record` has drive="motion"; here a force or a moving base must drive. `simulate`, `fit` and `diagnose` '
            'take imposed motions; if the force drives the structure, make the record with drive="force".'
        )
    masses = np.asarray(known(model.mass, "`mass`"))
    if masses.ndim == 1 and np.any(masses == 0):
        raise ValueError(
            f"`mass` must be positive for the structure to move; got {masses.tolist()}. "
            'A mass of 0 is for imposed motion only: make the record with drive="motion" if that is what it is.'
        )
