"""The smallest effect that a record would have shown."""

import math
from collections.abc import Sequence

import numpy as np

from .._threads import compiled_once, side_by_side
from ..identification import Nuisances, Posterior, Unknown, prior
from ..structures import Structure
from ._candidates import Candidate, hypothesis, modest
from ._trial import Trial

_NATS = 10.0
"""Evidence that an effect must bring: the margin of a finding, and what its freedom costs."""

Smallest = tuple[str, float]
"""Path and size of an effect."""
Unseen = list[tuple[Candidate, Structure, Smallest | None]]
"""Laws that were not fitted, with a structure that has them, and their smallest size."""


def detectable(trial: Trial, own: set[str]) -> Smallest | None:
    """Smallest size of a candidate's effect at which it would have been found; None without an effect.

    An effect of size a brings a²/2s² nats, s being the standard error that the readings alone leave it, everything
    else refitted. Taken at the trial's own values: exact for a law linear in its size, an estimate for friction.
    """
    return _smallest(trial.unknowns, trial.theta, trial.information, own)


def also_detectable(
    candidates: Sequence[Candidate], model: Structure, records: Sequence[Nuisances], until: Sequence[int]
) -> Unseen:
    """The same for laws that were not fitted, each at a modest size of a natural shape beside `model`."""
    posteriors = []
    for candidate in candidates:
        start = modest(candidate, model, records[0])
        resolved = [n.resolving([start]) for n in records]
        posteriors.append(Posterior(hypothesis(model, [start], resolved), resolved, until))
    information = {}
    for together in compiled_once(posteriors):
        outcomes = side_by_side(lambda p: p.evaluate(p.initial())[2][0], together)
        information.update(zip(together, outcomes, strict=True))
    own, found = set(model.entries()), []
    for candidate, posterior in zip(candidates, posteriors, strict=True):
        theta = posterior.initial()[0]
        size = _smallest(posterior.hypothesis.unknowns[0], theta, information[posterior], own)
        found.append((candidate, posterior.hypothesis.structures[0], size))
    return found


def _smallest(
    unknowns: Sequence[Unknown], theta: np.ndarray, information: np.ndarray, own: set[str]
) -> Smallest | None:
    effect = [k for k, u in enumerate(unknowns) if u.record is None and u.path not in own]
    if not effect or not np.all(np.isfinite(information)):
        return None
    k = effect[0]
    rest = np.array([i for i in range(len(unknowns)) if i != k])
    information = information.copy()
    information[k, k] -= prior(unknowns, theta)[2][k]  # what the readings say, without what was believed
    cross = information[k, rest]
    left = information[k, k] - cross @ np.linalg.lstsq(information[np.ix_(rest, rest)], cross, rcond=None)[0]
    if left <= 0:
        return unknowns[k].path, math.inf
    return unknowns[k].path, abs(unknowns[k].slope(theta[k])) / math.sqrt(left) * math.sqrt(2 * _NATS)
