"""Claims that a law, or a class of laws, acts at a place, and which alternatives hold them."""

import itertools
from collections.abc import Mapping, Sequence

from ...reporting import place_name
from ..evidence.scorecard import EffectCard, Scorecard
from ..hypotheses.law_classes import NARROWEST_FIRST
from ..thresholds import THRESHOLDS, Thresholds
from .decision import Decision

Claim = tuple[tuple[tuple, str], ...]
"""Places, each with the class of what acts there."""


def claims_of(card: Scorecard) -> list[Claim]:
    """What can be said of all effects of an alternative by their classes, the narrowest first."""
    each = [[(effect.at, name) for name in effect.classes] for effect in card.effects]
    return sorted(itertools.product(*each), key=_width)


def holds(card: Scorecard, claim: Claim) -> bool:
    """Whether an alternative has an effect for every part of a claim, and maybe others."""
    return any(
        all(effect.at == at and name in effect.classes for effect, (at, name) in zip(chosen, claim, strict=True))
        for chosen in itertools.permutations(card.effects, len(claim))
    )


def alike(card: Scorecard, winner: Scorecard) -> bool:
    """Whether the effects of two alternatives are of the same classes at the same places, one by one."""
    return len(card.effects) == len(winner.effects) and any(
        all(map(_share_a_class, card.effects, order)) for order in itertools.permutations(winner.effects)
    )


def shares_a_class(card: Scorecard, winner: Scorecard) -> bool:
    """Whether any effects of two alternatives are of one class."""
    classes = {name for effect in winner.effects for name in effect.classes}
    return any(not classes.isdisjoint(effect.classes) for effect in card.effects)


def chance(kind: str, at: tuple, decision: Decision, cards: Mapping[str, Scorecard]) -> float:
    """Probability that something of a class acts at a place."""
    return sum(
        decision.probability_of_class(key)
        for key, card in cards.items()
        if any(effect.at == at and kind in effect.classes for effect in card.effects)
    )


def narrowest_sure(
    effect: EffectCard, decision: Decision, cards: Mapping[str, Scorecard], limits: Thresholds = THRESHOLDS
) -> tuple[str, float]:
    """The narrowest class of an effect that is sure, with its probability; the likeliest of its classes if none is."""
    chances = {kind: chance(kind, effect.at, decision, cards) for kind in effect.classes}
    sure = (kind for kind, found in chances.items() if found >= limits.class_named)
    kind = next(sure, max(chances, key=lambda kind: chances[kind]))
    return kind, chances[kind]


def words(claim: Claim) -> str:
    """A claim in words."""
    return " and ".join(f"{name} at {place_name(at)}" for at, name in claim)


def _share_a_class(one: EffectCard, other: EffectCard) -> bool:
    return one.at == other.at and not set(one.classes).isdisjoint(other.classes)


def _width(claim: Claim) -> tuple[int, Sequence[int]]:
    ranks = [NARROWEST_FIRST.index(name) for _, name in claim]
    return sum(ranks), ranks
