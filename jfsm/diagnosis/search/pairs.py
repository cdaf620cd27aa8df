"""Two effects at once, where one leaves something: not the best one and then the next, but pairs of good ones."""

from collections.abc import Sequence
from itertools import combinations, product
from typing import NamedTuple

from ..._threads import side_by_side
from ...structures import (
    AbstractSensor,
    AbstractTerm,
    AccelerationBias,
    CubicStiffness,
    Offset,
    Preload,
    QuadraticStiffness,
    Structure,
)
from ..evidence.fitted import Trial
from ..evidence.own_values import at_bounds
from ..evidence.score_test import promised
from ..evidence.setup import Problem
from ..hypotheses.candidate import Candidate
from ..hypotheses.effect import Effect
from ..hypotheses.initial_values import Begin, found_in
from ..hypotheses.natural_starts import natural_starts
from ..hypotheses.placement import SHAPES, Laws
from .related_laws import other_delay

_BASES = 5
"""Causes beside which a second one is looked for, at most: the best of each family."""
_BESIDE = 2
"""Laws that are tried beside each, those that promise most,"""
_PAIRS = 6
"""and of these pairs those that promise most."""
_WITH_UNTOLD = 2
"""Bases beside which effects are tried that no missing force tells of, sensors' faults before all."""
_TOGETHER = 4
"""Pairs that are tried because their laws together explain most, whatever either explains alone."""
_INSTEAD = 5
"""Laws that are tried instead of either effect of the best pair, those that promise most."""
_ONE_SPRING = {QuadraticStiffness, CubicStiffness}
"""Laws of one family that are two effects all the same: the parts of an asymmetric spring."""


class _Pair(NamedTuple):
    """A pair to be tried, and what it promises: its evidence as far as a first step tells, or, along an imposed motion,
    minus the mean square force that it leaves; None where nothing tells."""

    candidate: Candidate
    promise: float | None


def pairs(
    singles: Sequence[Trial],
    known: Trial | None,
    effects: Sequence[Effect],
    problem: Problem,
) -> list[Candidate]:
    """Pairs to be tried, from what single causes explain and what they leave; what is `known` to act before others."""
    found: list[_Pair] = []
    families: list[str] = []
    surely = () if known is None else known.effects
    for base in sorted(singles, key=lambda t: (t.effects != surely, bool(at_bounds(t)), -t.evidence)):
        family = base.effects[0].cause.family
        if family in families or len(families) == _BASES:
            continue
        families.append(family)
        beside = _beside(base, 0, effects, problem)
        if len(families) <= _WITH_UNTOLD:
            found += [pair for pair in beside if pair.promise is None]
        found += _best(beside, _BESIDE)
    untold = [pair.candidate for pair in found if pair.promise is None]
    tried = untold + [pair.candidate for pair in _best(found, _PAIRS)]
    done = {candidate.effects for candidate in tried}
    return tried + [c for c in _together(effects, problem) if c.effects not in done]


def _together(effects: Sequence[Effect], problem: Problem) -> list[Candidate]:
    """Pairs of laws that together explain most of what the model lacks, the best of each two families."""
    laws = [effect for effect in effects if not effect.cause.is_sensor]
    in_order = [(i, j) if _in_order(laws[i], laws[j]) else (j, i) for i, j in combinations(range(len(laws)), 2)]
    allowed = [(i, j) for i, j in in_order if _are_two(laws[i], laws[j])]
    found: dict[tuple, Candidate] = {}
    for placed in Laws(problem.model, problem.first).together(laws, allowed):
        pair = tuple(laws[i] for i in placed.laws)
        families = tuple((effect.cause.family, effect.at) for effect in pair)
        first, second = placed.terms
        found.setdefault(families, Candidate(pair, (problem.model + first + second,)))
        if len(found) == _TOGETHER:
            break
    return list(found.values())


def instead(pair: Trial, effects: Sequence[Effect], problem: Problem) -> list[Candidate]:
    """Pairs that share an effect with one that was found, its neighbours."""
    found = []
    for kept, changed in ((0, 1), (1, 0)):
        beside = _beside(pair, kept, effects, problem)
        if pair.effects[changed].cause.is_sensor:
            found += [one.candidate for one in beside if one.promise is None]
        effect, part = pair.effects[kept], pair.parts[kept]
        for other, late in other_delay(pair.parts[changed], effects):
            found.append(joined(problem.model, effect, part, other, [late], found_in(pair)))
        found += [one.candidate for one in _best(beside, _INSTEAD)]
    return [c for c in found if set(c.effects) != set(pair.effects)]


def crossed(found: Sequence[Trial], singles: Sequence[Trial], model: Structure) -> list[Candidate]:
    """Pairs of an effect of one of these and one of another, all of the same families, that are not among them.

    Effects of `singles` take part where they are of these families. All begin where the best pair ended.
    """
    best = max(found, key=lambda t: t.evidence)
    places = [dict[Effect, AbstractTerm | AbstractSensor](), dict[Effect, AbstractTerm | AbstractSensor]()]
    for t in sorted(found, key=lambda t: -t.evidence):
        for place, effect, part in zip(places, t.effects, t.parts, strict=True):
            place.setdefault(effect, part)
    for t in singles:
        [effect], [part] = t.effects, t.parts
        for place, mine in zip(places, best.effects, strict=True):
            if (effect.cause.family, effect.at) == (mine.cause.family, mine.at):
                place.setdefault(effect, part)
    done, tried = {t.effects for t in found}, list[Candidate]()
    for (one, part), (other, law) in product(places[0].items(), places[1].items()):
        if _ordered(one, other) not in done and _are_two(one, other):
            tried.append(joined(model, one, part, other, [law], found_in(best)))
    return tried


def _best(found: Sequence[_Pair], most: int) -> list[_Pair]:
    """Those that promise most."""
    told = [(-pair.promise, i) for i, pair in enumerate(found) if pair.promise is not None]
    return [found[i] for _, i in sorted(told)[:most]]


def _beside(base: Trial, kept: int, effects: Sequence[Effect], problem: Problem) -> list[_Pair]:
    """Pairs of one effect of a trial with every other, instead of the trial's second if it has two."""
    model, effect, part = problem.model, base.effects[kept], base.parts[kept]
    changed = base.parts[1 - kept] if len(base.parts) > 1 else None
    structure = base.structure if changed is None else base.structure.without(changed)
    laws, others = Laws(structure, problem.first), [part] if isinstance(part, AbstractTerm) else []
    begin = found_in(base)
    found: list[_Pair] = []
    to_place: list[Effect] = []
    for other in effects:
        if not _are_two(effect, other):
            continue
        constant = _instead_of_an_offset(base, other)
        if constant is not None:
            found.append(_Pair(joined(model, effect, part, other, [constant], begin), None))
        elif other.cause.is_sensor:
            # A gain lies on a ridge with the own values: it begins at those as given, and at their end of it.
            starts = natural_starts(model + part, *other, problem.first)
            found.append(_Pair(Candidate(_ordered(effect, other), starts), None))
        else:
            to_place.append(other)
    shapes_of = list(side_by_side(lambda other: laws.placed(other, others), to_place))
    placed = [(other, shapes) for other, shapes in zip(to_place, shapes_of, strict=True) if shapes]
    ranked = promised(base, changed, laws, [shapes for _, shapes in placed], problem)
    for (other, _), best in zip(placed, ranked, strict=True):
        terms = [shape.term for shape, _ in best[:SHAPES]] + laws.natural(other)
        shape, most = best[0]
        promise = None if shape.share is None else most
        found.append(_Pair(joined(model, effect, part, other, terms[:SHAPES], begin), promise))
    return found


def _instead_of_an_offset(base: Trial, other: Effect) -> AbstractTerm | AbstractSensor | None:
    """A constant force on a mass, or a bias, that takes over what the offset of its sensor is beside `base`."""
    kind, (first, j) = other.cause.effect, other.at
    channel, sign = {Preload: ("force", -1), AccelerationBias: ("acceleration", 1)}.get(kind, ("", 0))
    offset = base.structure.values().get(Offset.path(channel, j), 0.0)
    if offset == 0 or (kind is Preload and first != 0):
        return None
    return kind(sign * offset, at=other.at)


def _are_two(one: Effect, other: Effect) -> bool:
    """Whether they are two effects, not two forms of one: of different families, or at different places."""
    if one.cause.is_sensor and other.cause.is_sensor:
        return False
    if one.cause.family != other.cause.family or one.at != other.at:
        return True
    return {one.cause.effect, other.cause.effect} == _ONE_SPRING


def _in_order(one: Effect, other: Effect) -> bool:
    return (one.cause.family, one.cause.id, one.at) <= (other.cause.family, other.cause.id, other.at)


def _ordered(one: Effect, other: Effect) -> tuple[Effect, Effect]:
    return (one, other) if _in_order(one, other) else (other, one)


def joined(
    model: Structure,
    one: Effect,
    part: AbstractTerm | AbstractSensor,
    other: Effect,
    laws: Sequence[AbstractTerm | AbstractSensor],
    begin: Begin,
) -> Candidate:
    """One effect with its part and another, which starts as each of these laws."""
    first = _in_order(one, other)
    starts = tuple(model + part + law if first else model + law + part for law in laws)
    return Candidate(_ordered(one, other), starts, begin=begin)
