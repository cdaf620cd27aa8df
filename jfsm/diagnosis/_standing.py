"""Why a candidate is no alternative to what is known already, or does not show what makes it more than another."""

import math
from collections.abc import Sequence

import numpy as np

from ..structures import AccelerationBias, Preload
from ._adequacy import GATE, NEGLIGIBLE, SIGNIFICANT, adequate, explained, unexplained
from ._enough import MAY_HIDE, WORTH_A_SECOND, far_off, hidden, strain
from ._trial import Trial

_SECOND = 15.0
"""Nats by which two effects must beat either of them alone."""
_WORTH_TO_NOISE = 0.01
"""Share of the refit's error by which two effects that leave noise only must predict better than either alone."""
_BIAS = 50.0
"""Nats by which a bias must beat an offset that stands for it where both leave something."""
UNPREDICTED = 15.0
"""Nats by which a cause must beat a refit whose predictions leave nothing: of many, one gains some by chance."""
_UNSEEN = 0.1
"""Nats by which a law must beat a special case of it for its further numbers to be seen."""


def why_not(t: Trial, tried: Sequence[Trial], given: Trial, refitted: Trial) -> str:
    """Why a candidate is no alternative to the model and to the others that were `tried`, or nothing."""
    return _reason(t, given, refitted) or _needs_both(t, tried, refitted) or _has_a_bias(t, tried)


def likelier_laws(winner: Trial, tried: Sequence[Trial], refitted: Trial) -> list[Trial]:
    """Laws that are more probable than a sensor's fault, and that only want a margin to be named beside the refit.

    The fault needs none, as it does what own values do that are all off by the same share.
    """
    if winner.laws or not winner.effects or not adequate(refitted):
        return []
    better = [t for t in tried if len(t.effects) == 1 and t.laws and t.evidence > winner.evidence]
    return [t for t in better if adequate(t) and not _impossible(t, refitted)]


def special_case(winner: Trial, passing: Sequence[Trial]) -> Trial | None:
    """The special case of the winner's law beside which its further numbers are not seen, if there is one."""
    if not winner.laws or len(winner.effects) > 1:
        return None
    law = winner.laws[0]
    cases = [t for t in passing if len(t.effects) == 1 and t.laws and t.laws[0].at == law.at]
    cases = [t for t in cases if isinstance(t.laws[0], law.contains) and winner.evidence - t.evidence < _UNSEEN]
    return max(cases, key=lambda t: t.evidence, default=None)


def _impossible(t: Trial, refitted: Trial) -> str:
    """Why a candidate is none, whatever its evidence, or nothing."""
    if not math.isfinite(t.evidence) or explained(t, refitted) == -math.inf:
        return "its motion runs away"
    for law in t.laws:
        if other := law.otherwise(t.structure.stiffness_of(law.at)):
            return other
    if far := far_off(t) - far_off(refitted):
        return f"takes {' and '.join(sorted(far))} as far from what the model states as they may be"
    return ""


def _reason(t: Trial, given: Trial, refitted: Trial) -> str:
    """Why a candidate is no alternative, or nothing."""
    if why := _impossible(t, refitted):
        return why
    over_refit, over_given = explained(t, refitted), explained(t, given)
    # A gain error and own values that are all off by the same share predict the same readings: only what is believed
    # beforehand weighs them, so such a candidate need not beat the refit by a margin, nor leave less.
    same = not t.laws and adequate(t) and adequate(refitted)
    # Of a law and a refit that both leave nothing the readings have to tell, not how far own values may be off: a law
    # may not win because it spares them, nor because it strains them more.
    spared = max(strain(refitted) - strain(t), 0.0) if t.laws and adequate(t) and adequate(refitted) else 0.0
    better = t.evidence - (given.evidence if same else max(given.evidence, refitted.evidence + spared))
    if better <= SIGNIFICANT:
        return f"no more probable than the model {'as given' if same else 'refitted'}"
    # What shows over the whole record an unknown state may make up for over some periods, and these do not tell then.
    unpredicted = not np.any(unexplained(refitted))
    if unpredicted and better <= UNPREDICTED and t.laws and not _is_constant(t):
        return "hardly more probable than the model refitted, which leaves nothing to explain"
    if over_refit >= GATE or (adequate(t) and over_given >= GATE):
        return ""
    if unpredicted and better > UNPREDICTED and adequate(t) and (_is_constant(t) or not adequate(refitted)):
        return ""
    return f"explains {max(over_refit, 0.0):.0%} of what a refit leaves, less than half"


def _is_constant(t: Trial) -> bool:
    """Whether it is no more than a constant force, for which the refit has an offset, too.

    What tells them is what is believed of that, and the swing with which the force sets in; predictions are the same.
    """
    return bool(t.laws) and all(isinstance(law, Preload) for law in t.laws)


def _hides(t: Trial, alone: Trial) -> bool:
    """Whether what two effects have beside one alone may hide in own values and offsets of that: what is believed of
    these tells them. Where one alone leaves something it is hard to believe that they hide it."""
    kinds = MAY_HIDE if adequate(alone) else hidden([alone])
    return alone.prediction.left < NEGLIGIBLE and _adds(t, alone) in kinds


def _has_a_bias(t: Trial, tried: Sequence[Trial]) -> str:
    """Why one effect alone is no alternative to the same with a bias, or nothing."""
    pairs = [pair for pair in tried if len(pair.effects) > 1 and set(t.effects) < set(pair.effects)]
    return "holds only with an offset that is a bias" if any(_shows_as_a_bias(pair, t) for pair in pairs) else ""


def _shows_as_a_bias(t: Trial, alone: Trial) -> bool:
    """Whether it has a bias beside one effect alone that an offset hardly stands for. No force that is missing makes an
    acceleration's mean, so what either leaves does not speak against it."""
    bias = _adds(t, alone) is AccelerationBias and AccelerationBias in hidden([alone])
    return bias and t.evidence - alone.evidence > _BIAS


def _adds(t: Trial, alone: Trial) -> type | None:
    """What a pair has beside one effect alone, which is one of its own or stands for one of the same family."""
    (single,) = alone.effects
    kin = [e for e in t.effects if (e.cause.family, e.at) == (single.cause.family, single.at)]
    shared = single if single in t.effects else next(iter(kin), None)
    beside = [effect.cause.effect for effect in t.effects if effect != shared]
    return beside[0] if len(beside) == 1 else None


def _needs_both(t: Trial, tried: Sequence[Trial], refitted: Trial) -> str:
    """Why a pair is no alternative to one of its effects alone, or to the best single one, or nothing."""
    if len(t.effects) == 1:
        return ""
    singles = [alone for alone in tried if len(alone.effects) == 1]
    best = max(singles, key=lambda alone: alone.evidence, default=refitted)
    for alone in singles:
        mine = alone is best or alone.effects[0] in t.effects
        if mine and (enough := _is_enough(alone, t, refitted)):
            return f"{alone.effects[0].label} alone {enough}"
    return ""


def _is_enough(alone: Trial, t: Trial, refitted: Trial) -> str:
    """How one effect alone stands beside a pair where that is not worth more, or nothing."""
    if _shows_as_a_bias(t, alone):
        return ""
    gained, hides = t.evidence - alone.evidence, _hides(t, alone)
    if adequate(t) and (hides or not np.any(unexplained(alone))):  # predictions do not tell
        least = SIGNIFICANT if hides and adequate(alone) else _SECOND
        return "" if gained > least else "is about as probable"
    before, after = _size(alone.prediction.excess), _size(t.prediction.excess)
    share, worth = explained(t, alone), WORTH_A_SECOND
    if adequate(t):
        share, worth = 1.0 - (after / before) ** 2, _WORTH_TO_NOISE
    better = before - after >= worth * _size(refitted.prediction.error)
    return "" if share >= GATE and better and gained > _SECOND else "explains it about as well"


def _size(powers: np.ndarray) -> float:
    """Of errors on all sets together; one part of a decay may be too small to show anything."""
    return math.sqrt(float(np.sum(powers)))
