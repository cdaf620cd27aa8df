"""Whether a candidate is an alternative to what is known without it: the model as given, refitted, a single effect."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from ..evidence.scorecard import (
    ACCELERATION_BIAS,
    ACCELERATION_GAIN,
    CONSTANT_FORCE,
    FORCE_GAIN,
    EffectCard,
    Scorecard,
)
from ..nats import gains
from .bench import Bench

_MAY_BE_ABSORBED = (FORCE_GAIN, ACCELERATION_GAIN, CONSTANT_FORCE, ACCELERATION_BIAS)
"""Roles of effects that own values and offsets may stand for."""
Reason = str
"""Why a candidate is no alternative; empty if it is one."""


def judge_candidates(bench: Bench) -> None:
    """Find for every candidate the first check that it does not pass."""
    for card in bench.candidates:
        bench.reasons[card.key] = _first_reason(card, bench, (*_POSSIBLE, *_WORTH_IT))
    baselines = (bench.given, bench.refitted)
    explained = [card for card in bench.apart_from_the_drive if not bench.reasons[card.key]]
    if any(map(bench.noise_only, (*baselines, *explained))):
        for card in bench.candidates:
            bench.reasons[card.key] = bench.reasons[card.key] or _takes_the_drives_place(card, bench)


def is_possible(card: Scorecard, bench: Bench) -> bool:
    """Whether nothing makes a candidate impossible, whatever its evidence."""
    return not _first_reason(card, bench, _POSSIBLE)


def _first_reason(card: Scorecard, bench: Bench, checks: Sequence[Callable[[Scorecard, Bench], Reason]]) -> Reason:
    return next((why for check in checks if (why := check(card, bench))), "")


# Possible at all


def _stays_bounded(card: Scorecard, bench: Bench) -> Reason:
    escapes = not math.isfinite(card.evidence) or bench.explained(card) == -math.inf
    says = "its motion runs away" if escapes else "its motion stays bounded"
    done = bench.check("stays_bounded", card.key, escapes, 0, says)
    return "" if done.passed else says


def _law_is_itself(card: Scorecard, bench: Bench) -> Reason:
    says = card.is_really or "with the numbers found, its law is no other one"
    done = bench.check("law_is_itself", card.key, bool(card.is_really), 0, says)
    return "" if done.passed else says


def _own_values_within_bounds(card: Scorecard, bench: Bench) -> Reason:
    far = sorted(set(card.at_bounds) - set(bench.refitted.at_bounds))
    says = f"takes {' and '.join(far)} as far from what the model states as a value may be"
    told = says if far else _no_farther_than_refit(card)
    done = bench.check("own_values_within_bounds", card.key, len(far), 0, told)
    return "" if done.passed else says


def _no_farther_than_refit(card: Scorecard) -> str:
    if not card.at_bounds:
        return "takes no own value to a bound"
    return f"takes {' and '.join(sorted(card.at_bounds))} to a bound, as the refitted model does, too"


# Worth it


def _better_than_refit(card: Scorecard, bench: Bench) -> Reason:
    """More probable than the model without it, of which many candidates have a chance where nothing else shows it.

    What shows over the whole record an unknown state may make up for over some periods: predictions do not tell then.
    """
    gain, same = gained(card, bench)
    unseen = not bench.shows(bench.refitted) and bool(card.laws) and not is_constant(card)
    limit = bench.limits.searched if unseen else bench.limits.significant
    baseline = "as given" if same else "refitted"
    says = f"{gains(gain)} over the model {baseline}; more than {limit:.4g} are needed"
    done = bench.check("better_than_refit", card.key, gain, limit, says)
    if done.passed:
        return ""
    if gain > bench.limits.significant:
        return "hardly more probable than the model refitted, which leaves nothing to explain"
    return f"no more probable than the model {baseline}"


def gained(card: Scorecard, bench: Bench) -> tuple[float, bool]:
    """Nats by which a candidate beats the model without it; and whether that is the model as given alone.

    A gain error and own values that are all off by the same share predict the same readings: only what is believed
    beforehand weighs them, so such a candidate need not beat the refit. Of a law and a refit that both leave nothing
    the readings have to tell, not how far own values may be off: a law may not win because it spares them.
    """
    given, refitted = bench.given, bench.refitted
    noise_only = bench.noise_only(card) and bench.noise_only(refitted)
    if noise_only and not card.laws:
        return card.evidence - given.evidence, True
    spared = max(refitted.prior_cost - card.prior_cost, 0.0) if noise_only else 0.0
    return card.evidence - max(given.evidence, refitted.evidence + spared), False


def _explains_half(card: Scorecard, bench: Bench) -> Reason:
    half, over_refit = bench.limits.half, bench.explained(card)
    noise_only = bench.noise_only(card)
    share = max(over_refit, bench.explained(card, bench.given)) if noise_only else over_refit
    gain, _ = gained(card, bench)
    unseen = not bench.shows(bench.refitted) and gain > bench.limits.searched and noise_only
    if share < half and unseen and (is_constant(card) or not bench.noise_only(bench.refitted)):
        return ""  # predictions leave nothing to explain, and the innovations tell
    reason = f"explains {max(over_refit, 0.0):.0%} of what the refitted model leaves, less than half"
    says = f"explains {share:.0%} of what the model leaves; at least {half:.0%} is needed"
    done = bench.check("explains_half_of_excess", card.key, share, half, says)
    return "" if done.passed else reason


def is_constant(card: Scorecard) -> bool:
    """Whether it is no more than a constant force, for which the refit has an offset, too.

    What tells them is what is believed of that, and the swing with which the force sets in; predictions are the same.
    """
    return bool(card.laws) and all(law.role == CONSTANT_FORCE for law in card.laws)


# One effect or two


def _second_effect_pays(card: Scorecard, bench: Bench) -> Reason:
    if len(card.effects) == 1:
        return ""
    for alone in _to_be_beaten(card, bench):
        if enough := _is_enough(alone, card, bench):
            return f"{alone.effects[0].label} alone {enough}"
    return ""


def _to_be_beaten(pair: Scorecard, bench: Bench) -> list[Scorecard]:
    """Single effects that a pair must be better than: its own, and the best that nothing speaks against, if that has
    fewer numbers."""
    singles = [alone for alone in bench.apart_from_the_drive if len(alone.effects) == 1]
    passing = [alone for alone in singles if not bench.reasons.get(alone.key)]
    best = max(passing, key=lambda alone: alone.evidence, default=None)
    return [c for c in singles if c.effects[0] in pair.effects or (c is best and c.unknowns < pair.unknowns)]


def _is_enough(alone: Scorecard, pair: Scorecard, bench: Bench) -> Reason:
    """What makes one effect alone enough, beside which a pair has another one."""
    if _shows_as_a_bias(pair, alone, bench):
        return ""
    unseen, prespecified = _separation(pair, alone, bench)
    least = bench.limits.significant if prespecified else bench.limits.searched
    nats = pair.evidence - alone.evidence
    says = f"{gains(nats)} over {alone.label} alone; more than {least:.4g} are needed"
    probable = bench.check("second_effect_pays", pair.key, nats, least, says).passed
    if probable and (unseen or _predicts_better(alone, pair, bench)):
        return ""
    return "is about as probable" if unseen or not probable else "explains it about as well"


def _separation(pair: Scorecard, alone: Scorecard, bench: Bench) -> tuple[bool, bool]:
    """Whether predictions do not separate a pair from one effect alone; and whether this is a comparison that was named
    beforehand, with an effect that own values or offsets may stand for."""
    absorbed = _may_be_absorbed(pair, alone, bench)
    unseen = bench.noise_only(pair) and (absorbed or not bench.shows(alone))
    return unseen, unseen and absorbed and bench.noise_only(alone)


def _predicts_better(alone: Scorecard, pair: Scorecard, bench: Bench) -> bool:
    """Whether two effects explain half of what one leaves, and that is worth a second one."""
    limits, (before, after) = bench.limits, (_size(card.prediction.excess) for card in (alone, pair))
    share, worth = bench.explained(pair, alone), limits.second_effect
    if bench.noise_only(pair):
        share, worth = 1.0 - (after / before) ** 2, limits.second_effect_to_noise
    says = f"explains {share:.0%} of what {alone.label} alone leaves; at least {limits.half:.0%} is needed"
    half = bench.check("second_effect_explains_half", pair.key, share, limits.half, says)
    better = (before - after) / max(_size(bench.refitted.prediction.error), np.finfo(float).tiny)
    says = f"takes {better:.1%} of the refitted model's error; at least {worth:.0%} is needed"
    much = bench.check("second_effect_predicts_better", pair.key, better, worth, says)
    return bool(half.passed and much.passed)


def _no_bias_beside_it(card: Scorecard, bench: Bench) -> Reason:
    """No single effect is an alternative to the same with a bias that an offset hardly stands for."""
    pairs = [pair for pair in bench.apart_from_the_drive if set(card.effects) < set(pair.effects)]
    for pair in (pair for pair in pairs if _adds_a_bias(pair, card, bench)):
        nats, most = pair.evidence - card.evidence, bench.limits.bias
        says = f"with a bias of the accelerometer it {gains(nats)}; {most:.4g} at most may be an offset's"
        if not bench.check("no_bias_beside_it", card.key, nats, most, says).passed:
            return "holds only with an offset that is a bias"
    return ""


def _shows_as_a_bias(pair: Scorecard, alone: Scorecard, bench: Bench) -> bool:
    """Whether it has a bias that an offset of one effect alone would not do for. No force that is missing makes an
    acceleration's mean, so what either leaves does not speak against it."""
    return _adds_a_bias(pair, alone, bench) and pair.evidence - alone.evidence > bench.limits.bias


def _adds_a_bias(pair: Scorecard, alone: Scorecard, bench: Bench) -> bool:
    """Whether a pair has a bias instead of an offset of one effect alone that is hard to believe."""
    return _adds(pair, alone) == ACCELERATION_BIAS and _hard_to_believe(alone, ACCELERATION_BIAS, bench)


def _may_be_absorbed(pair: Scorecard, alone: Scorecard, bench: Bench) -> bool:
    """Whether the single-effect model could absorb the second effect in its own values or offsets, so that only the
    priors separate the two. Where it leaves something it is hard to believe that they absorb it."""
    role = _adds(pair, alone)
    if bench.left(alone) >= bench.limits.negligible or role not in _MAY_BE_ABSORBED:
        return False
    return bench.noise_only(alone) or _hard_to_believe(alone, role, bench)


def _hard_to_believe(card: Scorecard, role: str, bench: Bench) -> bool:
    """Whether own values or offsets that an effect of this role may hide in are hard to believe."""
    costs = {CONSTANT_FORCE: card.force_offset_cost, ACCELERATION_BIAS: card.acceleration_offset_cost}
    return bool(card.effects) and costs.get(role, card.prior_cost) > bench.limits.significant


def _adds(pair: Scorecard, alone: Scorecard) -> str:
    """Role of what a pair has beside one effect alone, which is one of its own or stands for one of the same family;
    empty if that is not one effect."""
    (single,) = alone.effects

    def kin(effect: EffectCard) -> bool:
        return (effect.family, effect.at) == (single.family, single.at)

    shared = single if single in pair.effects else next(filter(kin, pair.effects), None)
    more = [effect.role for effect in pair.effects if effect != shared]
    return more[0] if len(more) == 1 else ""


def _size(powers: np.ndarray) -> float:
    """Of errors on all sets together; one part of a decay may be too small to show anything."""
    return math.sqrt(float(np.sum(powers)))


# Told apart from time and drive


def _holds_without_time(card: Scorecard, bench: Bench) -> Reason:
    """Where a model error is admitted, laws of time would explain whatever is left."""
    if not bench.evidence.setting.model_error or not card.timed:
        return ""
    says = "depends on time, and no second record shows the same"
    bench.check("identifiable_here", card.key, 1, 0, says)
    return says


def _takes_the_drives_place(card: Scorecard, bench: Bench) -> Reason:
    if not card.in_step:
        return ""
    says = "takes the place of a noisy drive, with which it is in step"
    bench.check("identifiable_here", card.key, 1, 0, says)
    return says


_POSSIBLE = (_stays_bounded, _law_is_itself, _own_values_within_bounds)
_WORTH_IT = (_better_than_refit, _explains_half, _second_effect_pays, _no_bias_beside_it, _holds_without_time)
