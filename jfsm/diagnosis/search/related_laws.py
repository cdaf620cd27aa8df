"""What is akin to a law or a fault that was found, to be fitted from its numbers too."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from ...identification import Nuisances, with_a_rest
from ...structures import (
    AbstractSensor,
    AbstractTerm,
    ChannelDelay,
    DeadZone,
    EndStop,
    ForceDelay,
    QuadraticStiffness,
    Structure,
)
from ..evidence.excess import is_noise_only
from ..evidence.fitted import Trial
from ..evidence.score_test import promised
from ..evidence.setup import Problem
from ..hypotheses.candidate import Candidate, alone_there, contained
from ..hypotheses.effect import Effect
from ..hypotheses.initial_values import Begin, found_in, own_part
from ..hypotheses.placement import SHAPES, Laws, at_rest, may_rest_anywhere
from ..thresholds import THRESHOLDS

_BESIDE_A_SPRING: Mapping[type[AbstractTerm], type[AbstractTerm]] = {EndStop: DeadZone, DeadZone: EndStop}
"""Laws that are another one with the same numbers beside a spring: play in a spring is a stop beside a softer one."""


def special_cases(law: AbstractTerm, begin: Begin, among: Sequence[Candidate]) -> list[Candidate]:
    """What a law that was found is for certain of its numbers, which begins from these."""
    numbers, cases = dict(zip(_names(law), law.values, strict=True)), []
    for c in contained([law], among):
        start = c.starts[0]
        placed = start.terms[-1]
        special = {name: numbers.get(name, value) for name, value in zip(_names(placed), placed.values, strict=True)}
        if not c.effects[0].cause.has_sign_of(float(next(iter(special.values())))):
            continue
        start = start.without(placed) + type(placed)(**special, at=placed.at)
        cases.append(replace(c, starts=(start,), begin=begin))
    return cases


def beside_a_spring(law: AbstractTerm, begin: Begin, among: Sequence[Candidate], model: Structure) -> list[Candidate]:
    """What a law that was found is if the stiffness is as the model states, and not as it was found beside the law."""
    other = _BESIDE_A_SPRING.get(type(law))
    if other is None:
        return []
    softened = f"stiffness@{law.at[0]}-{law.at[1]}."
    own = {key: start for key, start in own_part(begin).items() if not key[0].startswith(softened)}
    starts = (model + other(*law.values, at=law.at),)
    return [replace(c, starts=starts, begin=own) for c in alone_there({(law.at, other)}, among)]


def instead_of(
    t: Trial, law: AbstractTerm, among: Sequence[Candidate], close: Mapping[Effect, float], problem: Problem
) -> list[Candidate]:
    """What a law that was found is a special case of, where a score test promises more of it in the law's place, or the
    law leaves something; and what comes `close`, where it promises more than the evidence to which that has come.

    None along an imposed motion, of which there are no innovations.
    """
    wider = [] if problem.imposed else _wider(law, among, close)
    laws = Laws(t.structure.without(law), problem.first)
    placed = {effect: shapes for effect in wider if (shapes := laws.placed(effect) + laws.holding(effect, law))}
    if not placed:
        return []
    cases, begin = [], found_in(t)
    for effect, best in zip(placed, promised(t, law, laws, list(placed.values()), problem), strict=True):
        # What comes close has been at a top of its own: to promise more than that, before its numbers move, is much.
        least = close.get(effect, t.evidence + THRESHOLDS.significant)
        if best[0][1] > least or (effect not in close and not is_noise_only(t)):
            starts = tuple(problem.model + shape.term for shape, _ in best[:SHAPES])
            cases.append(Candidate((effect,), starts, begin=begin))
    return cases


def _wider(law: AbstractTerm, among: Sequence[Candidate], close: Mapping[Effect, float]) -> list[Effect]:
    """Laws at its place that hold it as a special case, or that come close."""
    there = dict.fromkeys(c.effects[0] for c in among if len(c.effects) == 1 and c.effects[0].at == law.at)
    return [effect for effect in there if effect in close or type(law) in effect.cause.effect.contains]


def late_instead(
    early: AbstractTerm | AbstractSensor, begin: Begin, effects: Sequence[Effect], model: Structure
) -> list[Candidate]:
    """The delay of the other one of two channels, of which one was found to be early."""
    return [Candidate((effect,), (model + late,), begin=begin) for effect, late in other_delay(early, effects)]


def other_delay(early: AbstractTerm | AbstractSensor, effects: Sequence[Effect]) -> list[tuple[Effect, AbstractSensor]]:
    """The channel that is late where another one seems to be early; of three, one is late as none of the others is."""
    if not isinstance(early, ForceDelay | ChannelDelay) or early.tau >= 0:
        return []
    others = [e for e in effects if e.cause.effect in (ForceDelay, ChannelDelay) and e.at != early.at]
    return [(effect, effect.cause.effect(-early.tau, at=effect.at)) for effect in others if len(others) == 1]


def resting(
    found: Structure,
    law: AbstractTerm,
    begin: Begin,
    among: Sequence[Candidate],
    model: Structure,
    nuisances: Nuisances,
) -> list[Candidate]:
    """Laws with a rest of their own that are, about it, the quadratic spring that was found, where none tells where
    the motion is."""
    if not isinstance(law, QuadraticStiffness) or not may_rest_anywhere(model, nuisances):
        return []
    stiffness, softer = model.stiffness_of(law.at), found.without(law).stiffness_of(law.at)
    own = {key: start for key, start in own_part(begin).items() if not key[0].startswith("stiffness@")}
    cases = {}
    for c in among:
        effect = c.effects[0]
        if len(c.effects) > 1 or effect.at != law.at or effect.cause.is_sensor:
            continue
        placed = with_a_rest(effect.cause.effect, law.at, stiffness, softer - stiffness, float(law.k2))
        if placed is not None:
            term, rest = placed
            cases[c.effects] = replace(c, starts=(model + term,), begin=own | at_rest(law.at, rest))
    return list(cases.values())


def _names(law: AbstractTerm) -> list[str]:
    return [p.name for p in law.parameters]
