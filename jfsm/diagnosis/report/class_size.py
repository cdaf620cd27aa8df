"""How large a cause is, as a number that all laws of its class share."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..._result import Estimate
from ...identification import values_of
from ...plant import forces_of_law
from ...structures import AbstractTerm, Structure
from ..evidence.fitted import Trial
from ..evidence.missing_force import Residual
from ..hypotheses.law_classes import (
    AMPLITUDE,
    DAMPING,
    FASTER,
    FRICTION,
    HARDENING,
    PLAY,
    SOFTENING,
    TWO_WAYS,
)
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


class Measure(NamedTuple):
    """A size of a force along a motion, in the units of force, displacement and time."""

    of: Callable[[np.ndarray, np.ndarray, np.ndarray], float]
    unit: Callable[[Units], str]


def _mean_power_by_speed(force: np.ndarray, d: np.ndarray, w: np.ndarray) -> float:
    return float(force @ w / np.sum(np.abs(w)))


def _equivalent_damping(force: np.ndarray, d: np.ndarray, w: np.ndarray) -> float:
    return float(force @ w / (w @ w))


def _equivalent_stiffness(force: np.ndarray, d: np.ndarray, w: np.ndarray) -> float:
    about = d - np.mean(d)
    return float(force @ about / (about @ about))


def _rms(force: np.ndarray, d: np.ndarray, w: np.ndarray) -> float:
    return float(np.sqrt(np.mean(force**2)))


_GAINED = Measure(_equivalent_stiffness, lambda units: f"{units['force']}/{units['displacement']}")
_FORCE = Measure(_rms, lambda units: units["force"])
_OF_CLASS: Mapping[str, Measure] = {
    FRICTION: Measure(_mean_power_by_speed, lambda units: units["force"]),
    **dict.fromkeys(
        (FASTER, AMPLITUDE, DAMPING, TWO_WAYS),
        Measure(_equivalent_damping, lambda units: f"{units['force']}*s/{units['displacement']}"),
    ),
    **dict.fromkeys((HARDENING, SOFTENING, PLAY), _GAINED),
}
"""Of friction the energy that it takes, by the way; of damping what it adds to a dashpot; of springs that grow harder
or softer the stiffness that they gain beyond that of small motions (least squares); of all others the rms of force."""
_AS_GOOD_AS_REST = 1e-4
"""Displacement that counts as a small motion, as a share of the largest."""


def size_of_class(
    kind: str, members: Sequence[Member], model: Structure, motion: Residual, dt: float, units: Units
) -> Estimate | None:
    """Size of what the laws of a class have in common, along the motion of their link.

    The value is the mean over members by probability; the interval holds that of every member. None for sensors, and
    where motions cannot be told.
    """
    measure = _OF_CLASS.get(kind, _FORCE)
    laws = [m for m in members if isinstance(m.trial.parts[m.which], AbstractTerm)]
    if not laws:
        return None
    along = motion.displacement, motion.velocity, dt * np.arange(motion.displacement.size)
    found = np.array([_size(m, model, measure, *along) for m in laws])
    if not np.all(np.isfinite(found)):
        return None
    weights = np.array([m.probability for m in laws])
    value, errors = float(np.average(found[:, 0], weights=weights)), _Z * found[:, 1]
    low, high = float(np.min(found[:, 0] - errors)), float(np.max(found[:, 0] + errors))
    return Estimate(value, low, high, measure.unit(units))


def _size(
    member: Member, model: Structure, measure: Measure, d: np.ndarray, w: np.ndarray, time: np.ndarray
) -> tuple[float, float]:
    """Size of one law, and its standard error by the covariance of its numbers."""
    t, part = member.trial, member.trial.parts[member.which]
    assert isinstance(part, AbstractTerm)
    own = [k for k in unknowns_of_effect(t, member.which, model) if t.unknowns[k].record is None]
    sd = np.sqrt(np.maximum(np.diag(t.covariance)[own], 0.0))
    steps = np.maximum(_STEP * sd, 1e-6)
    thetas = np.repeat(np.asarray(t.theta, float)[None], len(own) + 1, 0)
    thetas[1 + np.arange(len(own)), own] += steps
    rows = np.array([_numbers(t, part, own, theta) for theta in thetas])
    forces = forces_of_law(type(part), rows, d, w, time)
    if measure is _GAINED and not part.states:
        forces = forces - _about_rest(part, rows, float(np.max(np.abs(d))))[:, None] * d
    sizes = np.array([measure.of(force, d, w) for force in forces])
    slope = (sizes[1:] - sizes[0]) / steps
    variance = slope @ t.covariance[np.ix_(own, own)] @ slope
    return float(sizes[0]), math.sqrt(max(float(variance), 0.0))


def _about_rest(part: AbstractTerm, rows: np.ndarray, peak: float) -> np.ndarray:
    """Stiffness (rows,) of small motions."""
    d = _AS_GOOD_AS_REST * peak * np.array([1.0, -1.0])
    force = forces_of_law(type(part), rows, d, np.zeros(2), np.arange(2.0))
    return (force[:, 0] - force[:, 1]) / (d[0] - d[1])


def _numbers(t: Trial, part: AbstractTerm, own: Sequence[int], theta: np.ndarray) -> list[float]:
    """Numbers of a law where the unknowns of its trial are others."""
    values = values_of(t.unknowns, theta)
    fitted = {name_of(t.unknowns[k].path): values[k] for k in own}
    return [float(fitted.get(p.name, value)) for p, value in zip(part.parameters, part.values, strict=True)]
