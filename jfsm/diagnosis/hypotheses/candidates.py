"""Hypotheses to be tried: every cause at every place where it could sit, with its starts."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from itertools import chain, product, zip_longest

import equinox as eqx
import numpy as np

from ..._threads import side_by_side
from ...identification import (
    DEGREES,
    DEGREES_BESIDE,
    LANES,
    Hypothesis,
    Nuisances,
    Placed,
    PlacedTogether,
    Posterior,
    Unknown,
    about_a_rest,
    effect_unknown,
    forces_of,
    lanes_of,
    missing_force,
    natural_size,
    nuisance_unknowns,
    own_unknown,
    place,
    place_together,
    scale_of,
    with_a_rest,
    with_offsets,
)
from ...structures import (
    AbstractTerm,
    AccelerationBias,
    AccelerationGain,
    Cause,
    ChannelDelay,
    Clipping,
    CoulombAsymmetric,
    ForceGain,
    PeriodicDisturbance,
    Preload,
    Structure,
    causes,
    is_offset,
)
from .effect import Effect
from .initial_values import Begin, Start, begun

_START, _START_AT_PEAK = 0.1, 0.3
"""First guess of an effect as a share of the elastic force, in the mean and at the largest displacement.

A softening spring that outweighs the elastic one at a peak would let the motion run away from the start.
"""
_START_LATE = 0.5
"""Second guess of a delay, in radians of the motion."""
_WELLS = 2.0 ** (np.arange(-1, 7) / 2)
"""How far from the middle two wells are, in one and a half sizes of the motion,"""
_SEEN_FROM = (0.03, 0.01)
"""and the shares of unmodelled force beside which the likeliest of them are chosen."""


_MODEST = 0.02
"""Size of an effect that nothing speaks for, as a share of the elastic force."""
SHAPES = 2
"""Starts of a law."""
_FOLLOWED = 8
"""Laws that are fitted, the most promising ones."""
_HARDLY_LESS = 0.8
"""Share of what a law explains of the missing force, from which another may be as likely: regression is not the fit."""
_NOT_BESIDE_A_MOTION = (ForceGain, ChannelDelay, AccelerationBias, AccelerationGain, Preload, CoulombAsymmetric)
"""Effects that an imposed motion does not show: a gain of the force is that of all own values, a constant force its
offset, asymmetric friction friction beside an offset, a late motion an early force, and what is wrong with an
accelerometer shows beside the displacement."""


class Apart(Enum):
    """What each of several records has to itself, beside what is never shared: nothing, own values, or all numbers."""

    nothing = 0
    own = 1
    all = 2


@dataclass(frozen=True, eq=False)
class Candidate:
    """A cause at a place, or several at theirs; `starts` are the structures that a fit begins from.

    `share` is how much of the missing force the best of them explains by regression; None where regression cannot tell,
    as of sensors, which lack no force. A law that no shape of which explains any has no starts. `begin` is where a fit
    begins otherwise, where that is not as given.
    """

    effects: tuple[Effect, ...]
    starts: tuple[Structure, ...]
    share: float | None = None
    begin: Begin | None = None


def chosen_causes(selection: Sequence[str | Cause] | None) -> dict[str, Cause]:
    """The causes to try, by id; wrong own values are always tried.

    Raises
    ------
    ValueError
        If an id is not in the catalogue.
    """
    known = dict(causes())
    found = {}
    for item in known if selection is None else selection:
        if isinstance(item, Cause):
            found[item.id] = item
        elif item in known:
            found[item] = known[item]
        else:
            raise ValueError(
                f"`causes` must name causes of the catalogue ({', '.join(known)}) or be causes; got {item!r}."
            )
    return {name: cause for name, cause in found.items() if not cause.is_value}


def candidates(
    model: Structure,
    records: Sequence[Nuisances],
    selection: Mapping[str, Cause],
    places: Sequence[tuple] | None = None,
) -> list[Candidate]:
    """Every cause of `selection` at every place: laws on links or masses, sensor effects on the channels."""
    physical, sensors, imposed = [], [], records[0].path is not None
    for cause in selection.values():
        if not any(p.free for p in cause.effect.parameters):
            continue  # nothing to fit: a clipped channel shows by itself
        if imposed and cause.effect in _NOT_BESIDE_A_MOTION:
            continue
        if cause.is_sensor:
            channels = ("force",) if imposed else cause.effect.channels
            kinds = [kind for kind in channels if imposed or _shows(cause.effect, kind, records)]
            spots = dict.fromkeys(c for n in records for c in n.record.channels if c[0] in kinds)
            if cause.effect in (ForceGain, AccelerationGain):  # below its limit noise makes a clipped channel smaller
                spots = [at for at in spots if not any(isinstance(s, Clipping) and s.at == at for s in model.sensors)]
            sensors += [Candidate((Effect(cause, at),), natural_starts(model, cause, at, records[0])) for at in spots]
        else:
            physical += [Effect(cause, at) for at in _spots(cause, model, places)]
    laws = chain.from_iterable(side_by_side(Laws(model, records[0]).of, physical)) if physical else ()
    return [*laws, *sensors]


def _spots(cause: Cause, model: Structure, places: Sequence[tuple] | None) -> list[tuple]:
    """Where a law may be: on the links; on the masses if it hangs on one or loads it from outside."""
    masses = [(0, j) for j in range(1, model.dof + 1)]
    if cause.effect.hangs:
        return [at for at in masses if places is None or at in places]
    return list(places if places is not None else masses if cause.family == "input" else model.links)


def promising(tried: Sequence[Candidate]) -> tuple[list[Candidate], list[Candidate]]:
    """Candidates that are worth a fit, and those that are not: laws that explain least of the missing force."""
    shares = dict[tuple[Effect, ...], float]()
    for c in tried:
        if c.share is not None:
            shares[c.effects] = max(c.share, shares.get(c.effects, -math.inf))
    ranked = sorted(shares.values(), reverse=True)
    least = ranked[_FOLLOWED - 1] if len(ranked) > _FOLLOWED else -math.inf
    chosen = [c for c in tried if c.starts and (c.share is None or c.share >= least)]
    fitted = {c.effects for c in chosen}
    return chosen, [c for c in tried if c.effects not in fitted]


def contained(laws: Sequence[AbstractTerm], among: Sequence[Candidate]) -> list[Candidate]:
    """Candidates that can begin and whose law is what one of `laws` is for certain of its numbers, at its place."""
    found = {(law.at, kind) for law in laws for kind in law.contains}
    return [c for c in alone_there(found, among) if c.starts]


def alone_there(laws: Collection[tuple[tuple, type]], among: Sequence[Candidate]) -> list[Candidate]:
    """Candidates of a single effect that is one of these laws, each at its place."""
    alone = [c for c in among if len(c.effects) == 1]
    return [c for c in alone if (c.effects[0].at, c.effects[0].cause.effect) in laws]


def as_promising(
    effects: tuple[Effect, ...], tried: Sequence[Candidate], left: Sequence[Candidate], least: float = _HARDLY_LESS
) -> list[Candidate]:
    """Candidates left out that explain `least` times as much of the missing force as the `effects` found, or more."""
    found = max((c.share for c in tried if c.effects == effects and c.share is not None), default=math.inf)
    return [c for c in left if c.starts and c.share is not None and c.share >= least * found]


def elsewhere(effects: tuple[Effect, ...], left: Sequence[Candidate]) -> list[Candidate]:
    """Candidates left out whose law is the one that was found, of either sign: as a rule at other places.

    Where not all motions are seen, regression tells the place less well than the law.
    """
    found = {effect.cause.effect for effect in effects}
    return [c for c in left if c.starts and all(effect.cause.effect in found for effect in c.effects)]


def may_rest_anywhere(structure: Structure, nuisances: Nuisances) -> bool:
    """Whether one degree of freedom moves about a rest of which nothing tells where it is."""
    return structure.dof == 1 and not nuisances.at_rest and not _tells_where(nuisances)


def _tells_where(nuisances: Nuisances) -> bool:
    """Whether anything tells where the motion is."""
    return nuisances.path is not None or any(kind == "displacement" for kind, _ in nuisances.channels)


def at_rest(at: tuple, rest: float) -> dict[tuple[str, int | None], Start]:
    """Where motions begin, and are believed to, if the link at such a place is stretched by `rest`."""
    x0 = rest if at == (0, 1) else -rest
    return {("x0@1", None): Start(x0, x0)}


class Laws:
    """Laws placed where they explain most of what a structure lacks."""

    def __init__(self, structure: Structure, nuisances: Nuisances):
        self.structure, self.nuisances, self.scale = structure, nuisances, scale_of(nuisances, structure)
        self.missing = missing_force(structure, nuisances)

    def placed(self, effect: Effect, others: Sequence[AbstractTerm] = ()) -> list[Placed]:
        """Shapes of a law that explain most; the sizes of `others`, which the structure has, are free beside it."""
        law, sign = self._law(effect), effect.cause.sign
        return place(law, self.missing, self.structure, self.scale, self.nuisances, others, sign, sides=True)

    def holding(self, effect: Effect, law: AbstractTerm) -> list[Placed]:
        """Shapes of a law that are near a special case of it; what they explain is not known."""
        kind = effect.cause.effect
        return [Placed(kind(**row, at=effect.at), None, math.inf) for row in kind.holding(law, self.scale)]

    def forces(self, terms: Sequence[AbstractTerm]) -> np.ndarray:
        """Forces (terms, n, dof) of shapes of one law along the smoothed motion."""
        return forces_of(terms, self.missing, self.nuisances)

    def together(self, effects: Sequence[Effect], pairs: Sequence[tuple[int, int]]) -> list[PlacedTogether]:
        """The best shapes of each of these `pairs` of laws, those first that explain most together."""
        laws, signs = [self._law(effect) for effect in effects], [effect.cause.sign for effect in effects]
        return place_together(laws, signs, pairs, self.missing, self.structure, self.scale, self.nuisances)

    def _law(self, effect: Effect) -> AbstractTerm:
        """The law at its place, in the first of its natural shapes."""
        kind = effect.cause.effect
        return kind(**kind.shapes(self.scale)[0], at=effect.at)

    def of(self, effect: Effect) -> list[Candidate]:
        """The law from where it explains most, and where it may rest elsewhere, from there."""
        found = self.candidate(effect)
        return [found, *self.about_a_rest(effect), *self.between_rests(effect, found.share)]

    def candidate(self, effect: Effect) -> Candidate:
        placed = self.placed(effect)
        starts = [self.structure + start.term for start in placed[:SHAPES] if start.share is not None]
        starts += [self.structure + term for term in self._otherwise_directed(placed)]
        starts += [self.structure + term for term in self.natural(effect)][: SHAPES - len(starts)]
        return Candidate((effect,), tuple(starts), placed[0].share if placed else 0.0)

    def natural(self, effect: Effect) -> list[AbstractTerm]:
        """The law at natural sizes, where it has nothing but a size: an ill seen missing force may not show it."""
        if len(effect.cause.effect.parameters) > 1 or lanes_of(self.structure + self._law(effect)) == 1:
            return []
        return [start.terms[-1] for start in natural_starts(self.structure, *effect, self.nuisances)]

    def _otherwise_directed(self, placed: Sequence[Placed]) -> list[AbstractTerm]:
        """The best shape with its sign changed, of a load whose force and motion nothing but an acceleration tells."""
        if not placed or _tells_where(self.nuisances) or not isinstance(placed[0].term, PeriodicDisturbance):
            return []
        term = placed[0].term
        return [eqx.tree_at(lambda t: t.phase, term, term.phase + math.pi)]

    def about_a_rest(self, effect: Effect) -> list[Candidate]:
        """A law that may rest elsewhere than at zero, beginning there, where no channel tells where the motion is."""
        if not may_rest_anywhere(self.structure, self.nuisances):
            return []
        found = about_a_rest(effect.cause.effect, effect.at, self.missing, self.structure)
        if found is None:
            return []
        placed, rest = found
        return [Candidate((effect,), (self.structure + placed.term,), placed.share, at_rest(effect.at, rest))]

    def between_rests(self, effect: Effect, share: float | None) -> list[Candidate]:
        """A law of two wells whose spring there is the model's, beginning in one of them, where no channel tells where
        the motion is: smoothed, one from well to well stays in the middle.

        Of wells so far apart that the record makes it likeliest.
        """
        stiffness = self.structure.stiffness_of(effect.at)
        if stiffness <= 0 or not may_rest_anywhere(self.structure, self.nuisances):
            return []
        bends = [side * stiffness / (width * self.nuisances.length) for width in _WELLS for side in (1.0, -1.0)]
        wells = [with_a_rest(effect.cause.effect, effect.at, stiffness, 0.0, bend) for bend in bends]
        tried = [
            Candidate((effect,), (self.structure + term,), share, at_rest(effect.at, rest))
            for term, rest in (well for well in wells if well is not None)
        ]
        found = {int(np.argmin(costs)) for costs in self._costs(tried)} if tried else set()
        return [tried[i] for i in sorted(found)]

    def _costs(self, tried: Sequence[Candidate]) -> np.ndarray:
        """Minus the logarithms of the posteriors with which candidates (shares of unmodelled force, candidates)
        begin."""
        nuisances, costs = self.nuisances.resolving([c.starts[0] for c in tried]), []
        for i in range(0, len(tried), LANES):
            few = tried[i : i + LANES]
            begins = [c.begin for c in few]
            posed = hypothesis(self.structure, [c.starts[0] for c in few], [nuisances], begins=begins)
            posterior = Posterior(posed, [nuisances])
            costs.append([posterior.values(posterior.initial(), slack, first=True) for slack in _SEEN_FROM])
        return np.concatenate(costs, 1)


def _shows(effect: type, kind: str, records: Sequence[Nuisances]) -> bool:
    """Whether anything but the channels of this kind tells how large and how late they are; a bias needs none."""
    if kind == "force":
        return any(n.driven for n in records)
    return effect is AccelerationBias or any(n.driven or any(c[0] != kind for c in n.channels) for n in records)


def natural_starts(model: Structure, cause: Cause, at: tuple, nuisances: Nuisances) -> tuple[Structure, ...]:
    """The model with the effect at natural sizes, of either sign where the cause has both."""
    structures = []
    parameter = cause.effect.parameters[0]
    # A law of degree n in the displacement weighs crest^(n - 1) times more at the largest displacement.
    degree = 1 if parameter.time else -parameter.length
    share = min(_START, _START_AT_PEAK / nuisances.crest ** max(degree - 1, 0))
    # The basin of a delay is no wider than a part of a period.
    shares = (share, _START_LATE) if cause.is_sensor and parameter.time == 1 else (share,)
    for sign, size in product((cause.sign,) if cause.sign else (1, -1), shares):
        unit = cause.effect(**{p.name: float(sign) for p in cause.effect.parameters}, at=at)
        extended = model + unit
        path = next(p for p in extended.entries() if p not in model.entries())
        structures.append(extended.with_values({path: sign * size * natural_size(extended, path, nuisances)}))
    return tuple(structures)


def modest(candidate: Candidate, model: Structure, nuisances: Nuisances) -> Structure:
    """The model with a small effect of a natural shape."""
    [(cause, at)] = candidate.effects
    if cause.is_sensor:
        return candidate.starts[0]
    shapes = cause.effect.shapes(scale_of(nuisances, model))
    shape = shapes[len(shapes) // 2]
    size = {p.name: _MODEST * (cause.sign or 1) if p.force else 1.0 for p in cause.effect.parameters}
    return model + cause.effect(**{name: size[name] * value for name, value in shape.items()}, at=at)


def own_paths(model: Structure, records: Sequence[Nuisances]) -> tuple[str, ...]:
    """The model's own values that a refit may change.

    Without any force only ratios show, so masses stay as stated; so they do where a motion is imposed that needs hardly
    any force for them. Values of zero have nothing to be relative to. Offsets are nuisances also where they are stated.
    """
    scaled = any(n.weighs(model) for n in records)
    values = model.values()
    free = [p for p, (what, _) in model.entries().items() if what.free and values[p] != 0 and not is_offset(p)]
    return tuple(p for p in free if scaled or not p.startswith("mass@"))


def hypothesis(
    model: Structure,
    starts: Sequence[Structure],
    records: Sequence[Nuisances],
    *,
    refit: bool = True,
    begins: Sequence[Begin | None] = (),
    apart: Apart = Apart.nothing,
) -> Hypothesis:
    """Starts with their unknowns: the model's own values, the effect's numbers, and each record's nuisances.

    `begins` holds where each start begins otherwise, if it is not as given. Every record has to itself what is `apart`.
    """

    def of_each(u: Unknown, own: bool) -> list[Unknown]:
        alone = apart is Apart.all or (own and apart is Apart.own)
        return [replace(u, record=index) for index in range(len(records))] if alone else [u]

    structures, unknowns = [], []
    trust = dict(model.trust)
    given = set(model.entries())
    own = own_paths(model, records) if refit else ()
    for start, begin in zip_longest(starts, begins):
        effect = [p for p, (what, _) in start.entries().items() if p not in given and what.free]
        structure = with_offsets(start, records)
        degrees = DEGREES_BESIDE if effect else DEGREES
        mine = [begun(u, begin) for p in own for u in of_each(own_unknown(structure, p, trust, degrees), own=True)]
        mine += [u for p in effect for u in of_each(effect_unknown(structure, p, records[0]), own=False)]
        for index, nuisances in enumerate(records):
            mine += [begun(u, begin) for u in nuisance_unknowns(structure, nuisances, index)]
        structures.append(structure)
        unknowns.append(tuple(mine))
    return Hypothesis(tuple(structures), tuple(unknowns))
