"""The model's own values in a fitted hypothesis: whether they reached a bound, and their cost in nats."""

import math
from collections.abc import Sequence

import numpy as np

from ...identification import Unknown, prior
from ...structures import is_offset
from .fitted import Trial, ended, own_values

_HARDLY_TRUSTED = math.log(2.0)
"""Width of an own value's prior from which it may be nothing: its owner trusts it to the whole of itself."""
_NEAR = 0.01
"""Distance to a bound, as a share of it, from which a value is there."""


def at_bounds(trial: Trial) -> set[str]:
    """Own values that went as far as they may: they make up for a force that another structure has.

    So it is with the size of a sensor's fault. Damping may go: a model without friction often states as viscous what
    friction takes. And so may what its owner hardly trusts.
    """
    values = _may_make_up(trial)
    low = [u for u, theta in values if theta < u.low + _NEAR and not u.path.startswith("damping@")]
    high = {u.path for u, theta in values if theta > u.high - _NEAR}
    return high | {u.path for u in low if u.width < _HARDLY_TRUSTED}


def _may_make_up(trial: Trial) -> list[tuple[Unknown, float]]:
    """Own values and sizes of sensors' faults, which may make up for a force, and where they ended."""
    faults = {effect.cause.effect.kind for effect in trial.effects if effect.cause.is_sensor}
    return [*own_values(trial), *((u, theta) for u, theta in ended(trial) if u.path.split("@")[0] in faults)]


def prior_cost(trial: Trial) -> float:
    """Nats that a trial's own values cost, compared with those stated."""
    return _cost(own_values(trial))


def offset_cost(trial: Trial, kind: str) -> float:
    """Nats that the offsets of the sensors of a kind ("force", "acceleration") cost."""
    return _cost([(u, theta) for u, theta in ended(trial) if is_offset(u.path, kind)])


def _cost(values: Sequence[tuple[Unknown, float]]) -> float:
    """Nats by which values are less probable beforehand than what is believed of them."""
    return float(sum(prior([u], np.array([t]))[0] - prior([u], np.array([u.center]))[0] for u, t in values))
