"""The model as given, and with its own values refitted."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..._threads import side_by_side
from ...identification import LADDER, Maximum, Posterior, approach, finish, lanes_of
from ...structures import Structure
from ..evidence.fitted import Trial, trial
from ..evidence.own_values import at_bounds
from ..evidence.setup import Problem
from ..hypotheses.initial_values import found_in, own_part

_HEAVIER = 0.03
"""Change of a mass, as a share of it, from which its noise is another."""


def fit_model(problem: Problem, near: Trial | None = None) -> tuple[Trial, Trial]:
    """The model as given, and with its own values refitted, each the better of two climbs.

    One comes down the ladder, for values that are far off; one begins at the values as given, for a model that lacks
    something, whose top rungs lead astray. Of values refitted before, `near` tells them.
    """
    own = None if near is None else own_part(found_in(near))
    both = min(2, lanes_of(problem.model))
    ladder = LADDER if near is None else LADDER[-1:]

    def climb(posterior: Posterior) -> tuple[Maximum, float]:
        rung = approach(posterior, ladder, limit=problem.limit)
        theta = np.vstack([rung.theta[:1], posterior.initial()[1:]])
        return finish(posterior, replace(rung, theta=theta), limit=problem.limit), float(rung.value[0])

    posteriors = [problem.posterior([problem.model] * both, [own] * both, refit=refit) for refit in (False, True)]
    posteriors[0].evaluate(posteriors[0].initial())  # compiled once, before both ask for it
    climbed = side_by_side(climb, posteriors)
    given, refitted = (
        trial(posterior, found, int(np.argmin(found.value)), rung, name)
        for name, posterior, (found, rung) in zip(("given", "refitted"), posteriors, climbed, strict=True)
    )
    return given, refitted


def refit_from(beside: Sequence[Trial], refitted: Trial, problem: Problem) -> Trial:
    """The model refitted, the better of two climbs: its own may have stopped below where one from own values leads that
    were found beside an effect."""
    begins = [own_part(found_in(t)) for t in sorted(beside, key=lambda t: t.value)[: lanes_of(problem.model)]]
    if not begins or problem.limit.over:
        return refitted
    posterior = problem.posterior([problem.model] * len(begins), begins)
    rung = approach(posterior, LADDER[-1:], limit=problem.limit)
    found = finish(posterior, rung, limit=problem.limit)
    again = trial(posterior, found, int(np.argmin(found.value)), float(np.min(rung.value)), refitted.label)
    return again if again.evidence > refitted.evidence else refitted


def believed(problem: Problem, near: Trial | None = None) -> tuple[Problem, Trial, Trial]:
    """The problem, the model as given, and refitted; `near` own values that a part of the records told."""
    if near is None:
        given, refitted = fit_model(problem)
        near = refitted
        if not _outweighed(problem.model, near):
            return problem, given, refitted
    if _outweighed(problem.model, near):
        # The noise of the force acts through the mass, and all hypotheses share one noise: that of the likelier mass.
        problem = problem.weighed(near.structure)
    return problem, *fit_model(problem, near=near)


def _outweighed(model: Structure, refitted: Trial) -> bool:
    """Whether a refit moves any mass by more than some per cent; one with values at their bounds lacks something, and
    its masses tell nothing."""
    stated, found = (np.asarray(s.mass) for s in (model, refitted.structure))
    return bool(np.any(np.abs(found - stated) > _HEAVIER * np.abs(stated))) and not at_bounds(refitted)
