"""Whether a hypothesis leaves only noise, and how much of what another one leaves it explains."""

import math
from typing import Protocol

import numpy as np

from ..thresholds import THRESHOLDS, Thresholds
from .prediction import Prediction


class Predicts(Protocol):
    """Whatever has a prediction."""

    @property
    def prediction(self) -> Prediction: ...


class Measured(Predicts, Protocol):
    """A fitted hypothesis, or its scorecard."""

    @property
    def whiteness(self) -> float: ...
    @property
    def noise_scale(self) -> float: ...


def left(t: Predicts, limits: Thresholds = THRESHOLDS) -> float:
    """What predictions leave beyond noise and chance, as a share of the signal."""
    return t.prediction.left(limits.chance)


def white(t: Measured, limits: Thresholds = THRESHOLDS) -> bool:
    """Whether innovations are white, and of the size of the noise floor where that is known."""
    return t.whiteness < limits.white and t.noise_scale < limits.noise_scale


def is_noise_only(t: Measured, limits: Thresholds = THRESHOLDS) -> bool:
    """Whether a hypothesis leaves only noise: white innovations of the size of the floor, no excess."""
    return white(t, limits) and left(t, limits) < limits.negligible


def unexplained(baseline: Predicts, limits: Thresholds = THRESHOLDS) -> np.ndarray:
    """Sets of which a baseline's predictions leave anything to explain: more than chance may, where any does."""
    found = baseline.prediction
    noticeable = found.excess > np.maximum(limits.noticeable * found.expected, 1e-9)
    beyond = noticeable & (found.beyond(limits.chance) > 0)
    return beyond if np.any(beyond) else noticeable


def explained(t: Predicts, baseline: Predicts, limits: Thresholds = THRESHOLDS) -> float:
    """Smallest share of the baseline's excess power that a hypothesis explains, over the sets where there is any.

    0 where there is none; minus infinity for a motion that runs away.
    """
    start, rest, significant = baseline.prediction.excess, t.prediction.excess, unexplained(baseline, limits)
    if not np.any(significant):
        return 0.0
    return float(np.min(1.0 - rest[significant] / start[significant])) if np.all(np.isfinite(rest)) else -math.inf


def almost_all(t: Predicts, refitted: Predicts, limits: Thresholds = THRESHOLDS) -> bool:
    """Whether a hypothesis explains almost all of what the refitted model leaves."""
    return explained(t, refitted, limits) >= limits.almost_all and left(t, limits) < limits.much
