"""Laws placed where they explain most of the force that a structure lacks, and the rests about which they act."""

import math
from collections.abc import Sequence
from dataclasses import replace

import equinox as eqx
import numpy as np

from ...estimation import Latent
from ...identification import (
    LANES,
    Nuisances,
    Placed,
    PlacedTogether,
    Posterior,
    about_a_rest,
    forces_of,
    lanes_of,
    missing_force,
    place,
    place_together,
    scale_of,
    with_a_rest,
)
from ...structures import AbstractTerm, LinearStiffness, PeriodicDisturbance, Structure
from .candidate import Candidate
from .effect import Effect
from .initial_values import Start
from .natural_starts import natural_starts
from .parametrisation import hypothesis

SHAPES = 2
"""Starts of a law."""
_ALMOST_NONE = 1e-6
"""Share of a linear spring that is left where a law takes its place."""
_WELLS = 2.0 ** (np.arange(-1, 7) / 2)
"""How far from the middle two wells are, in one and a half sizes of the motion,"""
_SEEN_FROM = (0.03, 0.01)
"""and the shares of unmodelled force with which the likeliest of them are chosen."""


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

    def __init__(self, structure: Structure, nuisances: Nuisances, missing: Latent | None = None):
        self.structure, self.nuisances, self.scale = structure, nuisances, scale_of(nuisances, structure)
        self.missing = missing_force(structure, nuisances) if missing is None else missing

    def placed(self, effect: Effect, others: Sequence[AbstractTerm] = ()) -> list[Placed]:
        """Shapes of a law that explain most; the sizes of `others`, which the structure has, are free as well."""
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
        elsewhere = *self.about_a_rest(effect), *self.between_rests(effect, found.share)
        return [found, *elsewhere, *self.in_place_of_the_spring(effect, found.share)]

    def candidate(self, effect: Effect) -> Candidate:
        """The law from where it explains most, and from its natural sizes."""
        placed = self.placed(effect)
        starts = [self.structure + term for term in effect.cause.examples_at(effect.at)]
        starts += [self.structure + start.term for start in placed[:SHAPES] if start.share is not None]
        starts += [self.structure + term for term in self._otherwise_directed(placed)]
        starts += [self.structure + term for term in self.natural(effect)][: max(SHAPES - len(starts), 0)]
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
        if not may_rest_anywhere(self.structure, self.nuisances):
            return []
        tried = [
            Candidate((effect,), (self.structure + term,), share, at_rest(effect.at, rest))
            for term, rest in self._wells(effect)
        ]
        found = {int(np.argmin(costs)) for costs in self._costs(tried)} if tried else set()
        return [tried[i] for i in sorted(found)]

    def in_place_of_the_spring(self, effect: Effect, share: float | None) -> list[Candidate]:
        """A law that may be a whole spring, beside next to nothing of the linear one that the model has there."""
        at, model = effect.at, self.structure
        springs = [t for t in model.terms if isinstance(t, LinearStiffness) and set(t.at) == set(at) and float(t.k) > 0]
        if not effect.cause.effect.is_whole_spring or len(springs) != 1:
            return []
        [spring] = springs
        without = model.with_values({f"{spring.kind}@{spring.place}.k": _ALMOST_NONE * float(spring.k)})
        whole = self.missing.force + forces_of([spring], self.missing, self.nuisances)[0]
        missing = replace(self.missing, force=whole)
        found = place(
            self._law(effect), missing, without, self.scale, self.nuisances, (), effect.cause.sign, sides=True
        )
        starts = tuple(without + placed.term for placed in found[:SHAPES] if placed.share is not None)
        return [Candidate((effect,), starts, share)] if starts else []

    def _wells(self, effect: Effect) -> list[tuple[AbstractTerm, float]]:
        """Laws with wells at several distances, on either side, whose spring there is the model's, and their rests."""
        stiffness = self.structure.stiffness_of(effect.at)
        if stiffness <= 0:
            return []
        bends = [side * stiffness / (width * self.nuisances.length) for width in _WELLS for side in (1.0, -1.0)]
        wells = [with_a_rest(effect.cause.effect, effect.at, stiffness, 0.0, bend) for bend in bends]
        return [well for well in wells if well is not None]

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
