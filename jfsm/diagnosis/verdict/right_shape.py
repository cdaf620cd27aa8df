"""Whether the law that would be named has the right shape, by what forces of other shapes would gain beside it."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..evidence.scorecard import CONSTANT_FORCE, EffectCard, OtherShapes, Scorecard
from ..nats import shown
from .bench import Bench
from .checks import Check
from .decision import SHAPE
from .ranking import kin_of

WRONG_SHAPE = "explains much of it, but is not of the right shape"
_UNSEEN = "are two laws of which predictions show nothing, and may stand for one of another shape"


def doubt(card: Scorecard, gained: float, bench: Bench, *, shapeless: bool = False) -> tuple[float, Check]:
    """How far other shapes speak against a hypothesis whose last effect gained so many nats, and the check: above 1,
    too far, it fails.

    With `shapeless` only that gain is asked for. Without it also which share of the innovations they explain, and the
    check has what is the nearer to its limit. Two kinds of law must leave innovations that are white, since two wrong
    ones together come near most forces; one kind at several places need not, as dry friction in every joint.
    """
    limits, shapes = bench.limits, bench.evidence.other_shapes(card.key)
    white = bench.white(card)
    share = limits.other_shapes_of_one if card.effects else limits.other_shapes_of_values
    least = limits.other_shapes_white if white else limits.other_shapes
    much = (limits.other_shapes_of_white if white else share) * gained
    far = max(shapes.nats - least, 0.0) / max(much - least, least)
    limit = max(much, 2 * least)
    says = _says(shapes, limit, bench)
    if white or shapeless:
        return far, bench.check("right_shape", card.key, shapes.nats, limit, says)
    if _kinds(card) > 1:
        says = f"its innovations correlate by {card.whiteness:.2g} from sample to sample; two laws must leave none"
        row = bench.check("right_shape", card.key, card.whiteness, limits.white, says, "correlation")
        return 0.0 if row.passed else card.whiteness / limits.white, row
    rest = limits.rest_with_shape
    if shapes.share / rest <= shapes.nats / limit:
        return far, bench.check("right_shape", card.key, shapes.nats, limit, says)
    says = f"forces of other shapes would explain {shapes.share:.0%} of what it leaves; {rest:.0%} at most may be left"
    row = bench.check("right_shape", card.key, shapes.share, rest, says, "share of the innovations' power")
    return max(far, shapes.share / rest), row


def _says(shapes: OtherShapes, limit: float, bench: Bench) -> str:
    if bench.evidence.setting.imposed:
        return "its shape was not tested: no score test can be made along an imposed motion"
    if math.isinf(shapes.strays):
        return "its shape was not tested: its motion over what was fitted runs away"
    return f"forces of other shapes would gain {shown(shapes.nats)} nats beside it; {shown(limit)} at most may be left"


class Settled(NamedTuple):
    """The law that stands for its class, the check that it fails, if it does, and laws whose class is right, by key."""

    law: Scorecard
    failed: Check | None
    near: tuple[str, ...] = ()


def settle_shape(winner: Scorecard, bench: Bench) -> Settled:
    """Whether the winner has the right shape, or another law of its class has where its own is wrong."""
    found, far, check = _of_right_shape(winner, bench)
    kin = [card.key for card in kin_of(found, bench)]
    bench.less_sure(kin, SHAPE, 1.0 - 0.5 * min(far, 1.0))
    against = _not_identifiable(found, bench) or _both_unseen(found, bench)
    if against is not None:
        bench.refuse(found.key, against.says)
        return Settled(found, against)
    if check.passed:
        return Settled(found, None)
    near = nearest(found, bench)
    bench.reasons[found.key] = WRONG_SHAPE
    if not near:
        bench.refuse(found.key, WRONG_SHAPE)
    return Settled(found, check, near)


def _of_right_shape(winner: Scorecard, bench: Bench) -> tuple[Scorecard, float, Check]:
    """The winner, or another law of its class whose shape is right where its own is not, with its doubt and check.

    Predictions that all leave something hardly tell one law from another of its class.
    """
    far, check = _doubt_of(winner, winner, bench)
    if check.passed or bench.noise_only(winner):
        return winner, far, check
    for card in _alike(winner, bench):
        other, its = _doubt_of(card, winner, bench)
        if its.passed:
            bench.refuse(winner.key, WRONG_SHAPE)
            bench.reasons[card.key] = ""
            return card, other, its
    return winner, far, check


def _doubt_of(card: Scorecard, winner: Scorecard, bench: Bench) -> tuple[float, Check]:
    """How far other shapes speak against a law.

    Where a model error is admitted much of the rest has a shape, and says nothing against a law that explains nearly
    all; nor does a trace that no second effect would be named for, nor one that a whole run is to judge.
    """
    trace = bench.explained(card) > 1.0 - bench.limits.second_effect**2
    shapeless = bool(bench.evidence.setting.model_error) or bench.long_run or trace
    fewer = [c for c in (bench.given, bench.refitted, *bench.candidates) if len(c.effects) < len(winner.effects)]
    return doubt(card, card.evidence - max(c.evidence for c in fewer), bench, shapeless=shapeless)


def _alike(winner: Scorecard, bench: Bench) -> Sequence[Scorecard]:
    """Other laws of its class that are not much less probable, the most probable first."""
    least = bench.limits.alike * bench.probability(winner.key)
    alike = [card for card in kin_of(winner, bench) if card is not winner]
    ranked = sorted(alike, key=lambda card: -bench.probability(card.key))
    return [card for card in ranked if bench.probability(card.key) > least]


def nearest(winner: Scorecard, bench: Bench) -> tuple[str, ...]:
    """Keys of the laws of the winner's class that are right in their class though not in their shape, the likeliest
    first.

    Predictions over some periods hardly tell such laws apart; runs over all that was fitted do.
    """
    if bench.white(winner):
        return ()
    kin = [card for card in (winner, *_alike(winner, bench)) if _is_near(card, bench)]
    if not kin:
        return ()
    strays = np.array([max(bench.evidence.other_shapes(card.key).strays, 1e-9) for card in kin])
    before = np.array([bench.probability(card.key) for card in kin])
    weighed = before * (np.min(strays) / strays) ** bench.limits.fewest_looks
    after = weighed * np.sum(before) / np.sum(weighed)
    for card, factor in zip(kin, after / before, strict=True):
        bench.less_sure([card.key], "run over all that was fitted", float(factor))
    return tuple(kin[i].key for i in np.argsort(-weighed, kind="stable"))


def _is_near(card: Scorecard, bench: Bench) -> bool:
    """Whether a law explains enough for its class to be right; two must explain almost all and leave nothing."""
    if _kinds(card) < 2:
        return bench.explained(card) >= bench.limits.half
    return bench.explained(card) >= bench.limits.almost_all and bench.left(card) < bench.limits.negligible


def _not_identifiable(card: Scorecard, bench: Bench) -> Check | None:
    says = card.not_identifiable or "these records can show it"
    done = bench.check("identifiable_here", card.key, bool(card.not_identifiable), 0, says)
    return None if done.passed else done


def _both_unseen(card: Scorecard, bench: Bench) -> Check | None:
    """Two laws that only their evidence speaks for are no finding; a constant force is no such law."""
    if len(_laws(card)) < 2 or bench.shows(bench.refitted):
        return None
    return bench.check("identifiable_here", card.key, 1, 0, _UNSEEN)


def _kinds(card: Scorecard) -> int:
    """How many kinds of law act: at different places those that share a class are one."""
    kinds: list[EffectCard] = []
    for law in _laws(card):
        if not any(law.at != other.at and set(law.classes) & set(other.classes) for other in kinds):
            kinds.append(law)
    return len(kinds)


def _laws(card: Scorecard) -> list[EffectCard]:
    return [law for law in card.laws if law.role != CONSTANT_FORCE]
