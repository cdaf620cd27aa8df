"""Whether the search has found enough, or what else is worth a try."""

from collections.abc import Callable, Sequence

import numpy as np

from ...structures import AccelerationBias, AccelerationGain, ForceGain, Preload
from ..evidence.excess import almost_all, is_noise_only, left, unexplained
from ..evidence.fitted import Trial
from ..evidence.own_values import offset_cost, prior_cost
from ..evidence.scorecard import OtherShapes
from ..thresholds import THRESHOLDS


def settled(trials: Sequence[Trial], other_shapes: Callable[[Trial], OtherShapes]) -> bool:
    """Whether no law can gain much over the best of them, whose laws are what they are called.

    It leaves nothing but noise; or its innovations are not quite white, and still no force of any shape would explain
    them.
    """
    best = max(trials, key=lambda t: t.evidence)
    return is_itself(best) and (is_noise_only(best) or _has_the_shape(best, other_shapes))


def _has_the_shape(t: Trial, other_shapes: Callable[[Trial], OtherShapes]) -> bool:
    """Whether a law leaves nothing to see, and other shapes are known to gain nothing beside it."""
    if not t.effects or left(t) >= THRESHOLDS.negligible:
        return False
    found = other_shapes(t)
    return found.told and found.nats < THRESHOLDS.other_shapes_white


def is_itself(t: Trial) -> bool:
    """Whether none of its laws is, with the numbers found, another one."""
    return not any(law.otherwise(t.structure.stiffness_of(law.at)) for law in t.laws)


def something_left(
    trials: Sequence[Trial], refitted: Trial, other_shapes: Callable[[Trial], OtherShapes], *, imposed: bool
) -> bool:
    """Whether the best of them leaves enough for a second effect to be worth a search: what a pair has to gain."""
    limits, best = THRESHOLDS, max(trials, key=lambda t: t.evidence)
    noise_only = is_noise_only(best)
    if imposed and almost_all(best, refitted):
        return False
    if not best.effects and best.prediction.left() < limits.negligible:
        return False
    least = limits.other_shapes_white if noise_only else limits.other_shapes
    if best.effects and other_shapes(best).nats > least:
        return True
    if left(best) < limits.negligible:
        return False
    # One part of a decay may be too small to show the second effect: all parts tell together.
    much = np.sum(best.prediction.beyond()) >= limits.second_effect**2 * np.sum(refitted.prediction.error)
    return bool(much and np.any(unexplained(best)))


def hidden(trials: Sequence[Trial]) -> tuple[type, ...]:
    """What may hide in own values or offsets of the best of them, which holds only with such as are hard to believe."""
    best = max(trials, key=lambda t: t.evidence)
    if not best.effects:
        return ()
    costs = {
        ForceGain: prior_cost(best),
        AccelerationGain: prior_cost(best),
        Preload: offset_cost(best, "force"),
        AccelerationBias: offset_cost(best, "acceleration"),
    }
    return tuple(kind for kind, cost in costs.items() if cost > THRESHOLDS.significant)
