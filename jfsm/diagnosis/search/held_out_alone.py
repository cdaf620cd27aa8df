"""A class of laws sought once more in readings that took no part in a fit.

Of a law that is not of the right shape the numbers turn on the motion, and its runs over other motions are wrong; what
the laws of its class have in common need not be.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from ...identification import prepare_all
from ...structures import AbstractTerm, Cause
from ..channels.drift import steadied
from ..evidence.excess import explained
from ..evidence.fitted import Trial
from ..evidence.found_again import FoundAgain
from ..evidence.missing_force import residual
from ..evidence.scorecard import classes_in
from ..evidence.setup import Problem
from ..evidence.split import HeldOut
from ..hypotheses.candidate import promising
from ..hypotheses.candidates import candidates
from ..hypotheses.class_sizes import sizes_along
from .baseline import fit_model
from .searches import search


def found_again(
    t: Trial, kind: str, causes: Mapping[str, Cause], problem: Problem, held: Sequence[HeldOut]
) -> FoundAgain | None:
    """The class `kind` of the only law of a trial, by the likeliest of its laws among `causes` that is fitted to what
    was held out alone; None for sensors and for several effects, and where no law of the class is found."""
    if len(t.effects) != 1 or not isinstance(t.parts[0], AbstractTerm) or problem.limit.over:
        return None
    alone = _alone(t, problem, held)
    given, refitted = fit_model(alone)
    shown = [steadied(n) for n in alone.records]
    tried, _ = promising(candidates(problem.model, shown, causes, [t.effects[0].at]))
    found = search(tried, given, refitted, alone, lambda what, left: None).trials
    kin = [again for again in found if again.laws and kind in classes_in(again, alone)[0]]
    if not kin:
        return None
    again = max(kin, key=lambda trial: trial.evidence)
    size, before = _size(again, kind, alone), _size(t, kind, problem)
    return FoundAgain(again.effects[0].label, explained(again, refitted), size, before)


def _alone(t: Trial, problem: Problem, held: Sequence[HeldOut]) -> Problem:
    """The problem of what was held out, with what is known of its channels."""
    records = [part.record[part.begin :] for part in held]
    prepared = prepare_all(records, problem.model, problem.first.reconstruction)
    alone = Problem(problem.model, prepared, [n.samples for n in prepared], limit=problem.limit)
    return alone.as_timed(problem).knowing(problem).weighed(t.structure)


def _size(t: Trial, kind: str, problem: Problem) -> float:
    """Size of the only law of a trial along the motion of the first record."""
    (law,), (effect,) = t.laws, t.effects
    along = residual(t.structure, problem.first, problem.until[0], effect.at)
    rows = np.array([law.values], float)
    return float(sizes_along(kind, type(law), rows, along.displacement, along.velocity, problem.first.record.dt)[0])
