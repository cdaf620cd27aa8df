"""Two effects at once, where one leaves something: not the best one and then the next, but pairs of good ones."""

from collections.abc import Iterator, Sequence
from itertools import chain, combinations, product
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
    beside = [_beside(base, 0, effects, problem) for base in _bases(singles, known)]
    unplaced = [pair for pair in chain(*beside[:_WITH_UNTOLD]) if pair.promise is None]
    promising = _best([*chain(*(_best(of_one, _BESIDE) for of_one in beside))], _PAIRS)
    tried = [pair.candidate for pair in (*unplaced, *promising)]
    done = {candidate.effects for candidate in tried}
    return tried + [c for c in _together(effects, problem) if c.effects not in done]


def _bases(singles: Sequence[Trial], known: Trial | None) -> list[Trial]:
    """The best single cause of each family, the best family first; those with own values at a bound come last."""
    surely = () if known is None else known.effects
    best: dict[str, Trial] = {}
    for t in sorted(singles, key=lambda t: (t.effects != surely, bool(at_bounds(t)), -t.evidence)):
        best.setdefault(t.effects[0].cause.family, t)
    return list(best.values())[:_BASES]


def _together(effects: Sequence[Effect], problem: Problem) -> list[Candidate]:
    """Pairs of laws that together explain most of what the model lacks, the best of each two families."""
    laws = [effect for effect in effects if not effect.cause.is_sensor]
    allowed = _allowed(laws)
    found: dict[tuple, Candidate] = {}
    for placed in Laws(problem.model, problem.first).together(laws, allowed):
        pair = tuple(laws[i] for i in placed.laws)
        families = tuple((effect.cause.family, effect.at) for effect in pair)
        first, second = placed.terms
        found.setdefault(families, Candidate(pair, (problem.model + first + second,)))
        if len(found) == _TOGETHER:
            break
    return list(found.values())


def _allowed(laws: Sequence[Effect]) -> list[tuple[int, int]]:
    """Indices of two laws that are two effects, in their order."""
    couples = [(i, j) if _in_order(laws[i], laws[j]) else (j, i) for i, j in combinations(range(len(laws)), 2)]
    return [(i, j) for i, j in couples if _are_two(laws[i], laws[j])]


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


def twins(t: Trial, among: Sequence[Effect], model: Structure) -> list[Candidate]:
    """Pairs with what one of their laws really is with the numbers found, in its place: one well is a bent spring."""
    found = []
    for which, part in enumerate(t.parts):
        if isinstance(part, AbstractTerm) and part.otherwise(t.structure.stiffness_of(part.at)):
            other, kept = t.effects[1 - which], t.parts[1 - which]
            for effect, law in _held_by(part, among):
                if effect != other:
                    found.append(joined(model, other, kept, effect, [law], found_in(t)))
    return found


def _held_by(law: AbstractTerm, among: Sequence[Effect]) -> Iterator[tuple[Effect, AbstractTerm]]:
    """Special cases of a law, with those of its numbers that they have."""
    numbers = dict(zip((p.name for p in law.parameters), law.values, strict=True))
    for effect in among:
        kind, names = effect.cause.effect, [p.name for p in effect.cause.effect.parameters]
        if effect.at == law.at and kind in law.contains and set(names) <= set(numbers):
            if effect.cause.has_sign_of(float(numbers[names[0]])):
                yield effect, kind(**{name: numbers[name] for name in names}, at=effect.at)


def _best(found: Sequence[_Pair], most: int) -> list[_Pair]:
    """Those that promise most."""
    told = [(-pair.promise, i) for i, pair in enumerate(found) if pair.promise is not None]
    return [found[i] for _, i in sorted(told)[:most]]


def _beside(base: Trial, kept: int, effects: Sequence[Effect], problem: Problem) -> list[_Pair]:
    """Pairs of one effect of a trial with every other, instead of the trial's second if it has two."""
    effect, part = base.effects[kept], base.parts[kept]
    found: list[_Pair] = []
    to_place: list[Effect] = []
    for other in (other for other in effects if _are_two(effect, other)):
        unplaced = _without_a_shape(base, effect, part, other, problem)
        if unplaced is None:
            to_place.append(other)
        else:
            found.append(_Pair(unplaced, None))
    return found + _placed(base, kept, to_place, problem)


def _placed(base: Trial, kept: int, others: Sequence[Effect], problem: Problem) -> list[_Pair]:
    """Pairs of one effect of a trial with laws of shapes that regression places, each with what it promises."""
    effect, part = base.effects[kept], base.parts[kept]
    changed = base.parts[1 - kept] if len(base.parts) > 1 else None
    structure = base.structure if changed is None else base.structure.without(changed)
    laws, known = Laws(structure, problem.first), [part] if isinstance(part, AbstractTerm) else []
    shapes_of = side_by_side(lambda other: laws.placed(other, known), others)
    placed = {other: shapes for other, shapes in zip(others, shapes_of, strict=True) if shapes}
    ranked = promised(base, changed, laws, list(placed.values()), problem)
    found: list[_Pair] = []
    for other, best in zip(placed, ranked, strict=True):
        terms = [shape.term for shape, _ in best[:SHAPES]] + laws.natural(other)
        shape, most = best[0]
        candidate = joined(problem.model, effect, part, other, terms[:SHAPES], found_in(base))
        found.append(_Pair(candidate, None if shape.share is None else most))
    return found


def _without_a_shape(
    base: Trial, effect: Effect, part: AbstractTerm | AbstractSensor, other: Effect, problem: Problem
) -> Candidate | None:
    """An effect and a second one that no regression places: what takes over an offset, or a sensor's fault."""
    constant = _instead_of_an_offset(base, other)
    if constant is not None:
        return joined(problem.model, effect, part, other, [constant], found_in(base))
    if other.cause.is_sensor:
        # A gain lies on a ridge with the own values: it begins at those as given, and at their end of it.
        starts = natural_starts(problem.model + part, *other, problem.first)
        return Candidate(_ordered(effect, other), starts)
    return None


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
