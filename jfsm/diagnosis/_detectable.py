"""The smallest effect that a record would have shown."""

import math

import numpy as np

from ..identification import prior
from ._trial import Trial

_NATS = 10.0
"""Evidence that an effect must bring: the margin of a finding, and what its freedom costs."""


def detectable(trial: Trial, own: set[str]) -> tuple[str, float] | None:
    """Path and smallest size of a candidate's effect at which it would have been found; None without an effect.

    An effect of size a brings a²/2s² nats, s being the standard error that the readings alone leave it, everything
    else refitted. Taken at the trial's own values: exact for a law linear in its size, an estimate for friction.
    """
    effect = [k for k, u in enumerate(trial.unknowns) if u.record is None and u.path not in own]
    if not effect or not np.all(np.isfinite(trial.information)):
        return None
    k = effect[0]
    rest = np.array([i for i in range(len(trial.unknowns)) if i != k])
    information = trial.information.copy()
    information[k, k] -= prior(trial.unknowns, trial.theta)[2][k]  # what the readings say, without what was believed
    cross = information[k, rest]
    left = information[k, k] - cross @ np.linalg.lstsq(information[np.ix_(rest, rest)], cross, rcond=None)[0]
    unknown = trial.unknowns[k]
    if left <= 0:
        return unknown.path, math.inf
    return unknown.path, abs(unknown.slope(trial.theta[k])) / math.sqrt(left) * math.sqrt(2 * _NATS)
