"""How large a cause is, as a number that all laws of its class share."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..._result import Estimate
from ...identification import values_of
from ...structures import AbstractTerm, Structure
from ..evidence.fitted import Trial
from ..evidence.missing_force import Residual
from ..hypotheses.class_sizes import size_unit, sizes_along
from .estimates import Units, name_of, unknowns_of_effect

_STEP = 0.1
"""Step of a derivative, in standard deviations of the number."""
_Z = 1.96
"""Standard deviations to the end of a 95 % interval."""


class Member(NamedTuple):
    """A law of a class, in the hypothesis that was fitted with it, and the hypothesis's probability."""

    trial: Trial
    which: int
    probability: float

    @property
    def cause(self) -> str:
        return self.trial.effects[self.which].cause.id


def size_of_class(
    kind: str, members: Sequence[Member], model: Structure, motion: Residual, dt: float, units: Units
) -> Estimate | None:
    """Size of what the laws of a class have in common, along the motion of their link.

    The value is the mean over members by probability; the interval holds that of every member. None for sensors, and
    where motions cannot be told.
    """
    laws = [m for m in members if isinstance(m.trial.parts[m.which], AbstractTerm)]
    if not laws:
        return None
    found = np.array([_size(m, model, kind, motion.displacement, motion.velocity, dt) for m in laws])
    if not np.all(np.isfinite(found)):
        return None
    weights = np.array([m.probability for m in laws])
    value, errors = float(np.average(found[:, 0], weights=weights)), _Z * found[:, 1]
    low, high = float(np.min(found[:, 0] - errors)), float(np.max(found[:, 0] + errors))
    return Estimate(value, low, high, size_unit(kind, units))


def _size(member: Member, model: Structure, kind: str, d: np.ndarray, w: np.ndarray, dt: float) -> tuple[float, float]:
    """Size of one law, and its standard error by the covariance of its numbers."""
    t, part = member.trial, member.trial.parts[member.which]
    assert isinstance(part, AbstractTerm)
    own = [k for k in unknowns_of_effect(t, member.which, model) if t.unknowns[k].record is None]
    sd = np.sqrt(np.maximum(np.diag(t.covariance)[own], 0.0))
    steps = np.maximum(_STEP * sd, 1e-6)
    thetas = np.repeat(np.asarray(t.theta, float)[None], len(own) + 1, 0)
    thetas[1 + np.arange(len(own)), own] += steps
    rows = np.array([_numbers(t, part, own, theta) for theta in thetas])
    sizes = sizes_along(kind, type(part), rows, d, w, dt)
    slope = (sizes[1:] - sizes[0]) / steps
    variance = slope @ t.covariance[np.ix_(own, own)] @ slope
    return float(sizes[0]), math.sqrt(max(float(variance), 0.0))


def _numbers(t: Trial, part: AbstractTerm, own: Sequence[int], theta: np.ndarray) -> list[float]:
    """Numbers of a law where the unknowns of its trial are others."""
    values = values_of(t.unknowns, theta)
    fitted = {name_of(t.unknowns[k].path): values[k] for k in own}
    return [float(fitted.get(p.name, value)) for p, value in zip(part.parameters, part.values, strict=True)]
