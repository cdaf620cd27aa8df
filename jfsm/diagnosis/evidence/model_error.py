"""Hypotheses none of which is right, compared where that much of the force is forgiven to all of them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..._threads import side_by_side
from ...identification import settle
from ..thresholds import THRESHOLDS
from .excess import explained
from .fitted import Trial, predict, trial
from .setup import Problem

_SHARES = (0.03, 0.01, 0.003, 0.001)
"""Shares of the elastic force that may be forgiven."""
_WORSE = 1.25
"""Error of the best hypothesis' predictions, in errors from noise alone, from which forgiving leads it astray."""
_COMPARED = 12
"""Hypotheses that are compared, the best of them where a hundredth was forgiven."""


def forgiving(trials: Sequence[Trial], problem: Problem) -> tuple[Problem, list[Trial]] | None:
    """The problem with the share forgiven that makes the best hypothesis most probable, and the best trials there.

    From the noise alone a hypothesis that lacks a little ends at values that make up for it, or nowhere, and no two of
    them can be compared: one predicts far better than the model, and is less probable. None where that is not so, or
    noise alone does as well. `trials` begin with the model as given and refitted.
    """
    given, refitted, *others = trials
    least = max(given.evidence, refitted.evidence)
    if not any(t.evidence < least and explained(t, refitted) >= THRESHOLDS.nearly_all for t in others):
        return None
    leader = min(trials, key=lambda t: t.rung)
    posteriors = {share: _forgiven(problem, share).posterior_of(leader) for share in _SHARES}
    climbed = {share: settle(one, leader.theta, problem.limit) for share, one in posteriors.items()}
    best = min(climbed, key=lambda share: climbed[share].value[0])
    if climbed[best].value[0] >= leader.value:
        return None
    noise_alone, problem = leader.prediction, _forgiven(problem, best)
    error = predict(problem.posterior_of(leader), climbed[best].theta[0], slight=not leader.effects).error
    if np.any(error > _WORSE**2 * noise_alone.error):
        return None
    compared = [given, refitted, *sorted(others, key=lambda t: t.rung)[:_COMPARED]]

    def again(one: Trial) -> Trial:
        posterior = problem.posterior_of(one)
        found = settle(posterior, one.theta, problem.limit)
        return trial(posterior, found, 0, float(found.value[0]), one.label, one.effects)

    given, refitted, *others = [again(compared[0]), *side_by_side(again, compared[1:])]
    return problem, [given, refitted, *(t.beside(refitted) for t in others)]


def _forgiven(problem: Problem, share: float) -> Problem:
    return problem._replace(records=[replace(n, forgiven=share) for n in problem.records])
