"""Whether a hypothesis leaves nothing but noise, and how much of what another leaves it explains."""

import math

import numpy as np

from ._trial import Trial

GATE = 0.5
"""Share of the excess power that a cause explains, at least."""
SIGNIFICANT = 5.0
"""Nats by which something must beat nothing."""
NEGLIGIBLE = 0.02
"""Excess, as a share of the signal, below which nothing but a perfect explanation is a finding."""
NEARLY_ALL, MUCH = 0.8, 0.1
"""A law that explains less than this share of the excess and leaves more than this share of the signal is near."""
NOTICEABLE = 0.1
"""Excess, as a share of the power that noise leaves, from which a set says anything about an effect."""
ALMOST_ALL = 0.95
"""A law that explains this share of the excess along an imposed motion stands, whatever a map makes of the rest; one
of the wrong shape must close this share of the error of held-out runs."""
_WHITE = 0.1
_SCALE = 0.5


def adequate(trial: Trial) -> bool:
    """Whether a trial leaves nothing but noise: white innovations of the size of the floor, no excess."""
    return white(trial) and trial.prediction.left < NEGLIGIBLE


def white(trial: Trial) -> bool:
    """Whether a trial's innovations are white, and of the size of the floor where that is known."""
    return trial.whiteness < _WHITE and bool(np.all(np.abs(trial.noise[trial.trusted]) < _SCALE))


def unexplained(baseline: Trial) -> np.ndarray:
    """Sets of which a baseline's predictions leave anything to explain: more than chance may, where any does."""
    found = baseline.prediction
    noticeable = found.excess > np.maximum(NOTICEABLE * found.expected, 1e-9)
    beyond = noticeable & (found.beyond > 0)
    return beyond if np.any(beyond) else noticeable


def explained(trial: Trial, baseline: Trial) -> float:
    """Smallest share of the baseline's excess power that a trial explains, over the sets where there is any."""
    start, left, significant = baseline.prediction.excess, trial.prediction.excess, unexplained(baseline)
    if not np.any(significant):
        return 0.0
    return float(np.min(1.0 - left[significant] / start[significant])) if np.all(np.isfinite(left)) else -math.inf


def almost_all(t: Trial, refitted: Trial) -> bool:
    """Whether a trial explains almost all of what a refit leaves."""
    return explained(t, refitted) >= ALMOST_ALL and t.prediction.left < MUCH


def practically_all(t: Trial, refitted: Trial) -> bool:
    """Whether a trial explains almost all of what a refit leaves, or most of it, and the rest is negligible."""
    negligible = explained(t, refitted) >= NEARLY_ALL and t.prediction.left < NEGLIGIBLE
    return negligible or almost_all(t, refitted)
