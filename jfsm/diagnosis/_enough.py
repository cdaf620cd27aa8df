"""Whether the search has found enough, or what else is worth a try."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from ..identification import Unknown, prior
from ..structures import AccelerationBias, AccelerationGain, ForceGain, Preload, is_offset
from ._adequacy import NEGLIGIBLE, SIGNIFICANT, adequate, almost_all, unexplained
from ._doubt import UNFIT, UNFIT_OF_WHITE
from ._lack_of_fit import Unfit
from ._trial import Trial, ended, own_values

WORTH_A_SECOND = 0.03
"""Share of the refit's error by which two effects must predict better than either of them alone."""
MAY_HIDE = (ForceGain, AccelerationGain, Preload, AccelerationBias)
"""Effects that own values and offsets may stand for."""
_HARDLY_TRUSTED = math.log(2.0)
"""Width of an own value's law from which it may be nothing: its owner trusts it to the whole of itself."""
_NEAR = 0.01
"""Distance to the farthest own value, as a share of it, from which a value is there."""


def settled(trials: Sequence[Trial]) -> bool:
    """Whether the best of them leaves nothing but noise, its laws what they are called."""
    best = max(trials, key=lambda t: t.evidence)
    return adequate(best) and is_itself(best)


def is_itself(t: Trial) -> bool:
    """Whether none of its laws is, with the numbers found, another one."""
    return not any(law.otherwise(t.structure.stiffness_of(law.at)) for law in t.laws)


def far_off(trial: Trial) -> set[str]:
    """Own values of a trial that went as far as they may: it is another structure's force that they make up for.

    So it is with a sensor's fault. Damping may go: a model without friction often states as viscous what friction
    takes. And so may what its owner hardly trusts.
    """
    faults = {effect.cause.effect.kind for effect in trial.effects if effect.cause.is_sensor}
    own = [*own_values(trial), *((u, theta) for u, theta in ended(trial) if u.path.split("@")[0] in faults)]
    low = [u for u, theta in own if theta < u.low + _NEAR and not u.path.startswith("damping@")]
    high = {u.path for u, theta in own if theta > u.high - _NEAR}
    return high | {u.path for u in low if u.width < _HARDLY_TRUSTED}


def something_left(
    trials: Sequence[Trial], refitted: Trial, lack_of_fit: Callable[[Trial], Unfit], *, imposed: bool
) -> bool:
    """Whether the best of them leaves enough for a second effect to be worth a search: what a pair has to gain."""
    best = max(trials, key=lambda t: t.evidence)
    if (imposed and almost_all(best, refitted)) or (not best.effects and best.prediction.left < NEGLIGIBLE):
        return False
    if best.effects and lack_of_fit(best).nats > (UNFIT_OF_WHITE if adequate(best) else UNFIT):
        return True
    # One part of a decay may be too small to show the second effect: all parts tell together.
    much = np.sum(best.prediction.beyond) >= WORTH_A_SECOND**2 * np.sum(refitted.prediction.error)
    return bool(much and not adequate(best) and np.any(unexplained(best)))


def hidden(trials: Sequence[Trial]) -> tuple[type, ...]:
    """What may hide in own values or offsets of the best of them, which holds only with such as are hard to believe."""
    best = max(trials, key=lambda t: t.evidence)
    if not best.effects:
        return ()
    found: list[type] = [ForceGain, AccelerationGain] if strain(best) > SIGNIFICANT else []
    for kind, effect in (("force", Preload), ("acceleration", AccelerationBias)):
        offsets = [(u, theta) for u, theta in ended(best) if is_offset(u.path, kind)]
        found += [effect] if _cost(offsets) > SIGNIFICANT else []
    return tuple(found)


def strain(trial: Trial) -> float:
    """Nats that a trial's own values cost beside those stated."""
    return _cost(own_values(trial))


def _cost(values: Sequence[tuple[Unknown, float]]) -> float:
    """Nats by which values are less probable beforehand than what is believed of them."""
    return float(sum(prior([u], np.array([t]))[0] - prior([u], np.array([u.center]))[0] for u, t in values))
