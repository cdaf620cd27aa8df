"""Hypotheses to be tried: every cause at every place where it could sit, with its starts."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import zip_longest

from ..estimation import Latent
from ..identification import (
    DEGREES,
    DEGREES_BESIDE,
    Hypothesis,
    Nuisances,
    Unknown,
    effect_unknown,
    missing_force,
    natural_size,
    nuisance_unknowns,
    own_unknown,
    place,
    scale_of,
    with_offsets,
)
from ..structures import Cause, Structure, causes

_START, _START_AT_PEAK = 0.1, 0.3
"""First guess of an effect as a share of the elastic force, in the mean and at the largest displacement.

A softening spring that outweighs the elastic one at a peak would let the motion run away from the start.
"""


_SHAPES = 2
"""Shapes of a law that are followed."""
SOUGHT = (
    "cubic_hardening", "cubic_softening", "quadratic_stiffness", "coulomb", "quadratic_damping", "force_gain",
    "accel_gain",
)  # fmt: skip
"""Causes that are looked for unless others are asked for."""


@dataclass(frozen=True)
class Candidate:
    """A cause at a place; `starts` are the structures that a fit begins from."""

    cause: Cause
    at: tuple
    starts: tuple[Structure, ...]


def chosen_causes(selection: Sequence[str | Cause] | None) -> dict[str, Cause]:
    """The causes to try, by id; wrong own values are always tried.

    Raises
    ------
    ValueError
        If an id is not in the catalogue.
    """
    known = dict(causes())
    if selection is None:
        return {name: known[name] for name in SOUGHT}
    found = {}
    for item in selection:
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
    """Every cause of `selection` at every place: link laws on the model's links, sensor effects on the channels."""
    found, shaped = [], _Shaped(model, records[0])
    for cause in selection.values():
        if not any(p.free for p in cause.effect.parameters):
            continue  # nothing to fit: what a clipped channel lost takes no part anyway
        if cause.is_sensor:
            kinds = [kind for kind in cause.effect.channels if _has_scale(kind, records)]
            spots: list[tuple] = list(dict.fromkeys(c for n in records for c in n.record.channels if c[0] in kinds))
        else:
            spots = list(model.links) if places is None else list(places)
        for at in spots:
            several = not cause.is_sensor and len(cause.effect.parameters) > 1
            starts = shaped.starts(cause, at) if several else _starts(model, cause, at, records[0])
            if starts:
                found.append(Candidate(cause, tuple(at), starts))
    return found


class _Shaped:
    """Starts of laws with a shape of their own: those that explain most of what the model lacks."""

    def __init__(self, model: Structure, nuisances: Nuisances):
        self.model, self.nuisances = model, nuisances

    @cached_property
    def missing(self) -> Latent:
        return missing_force(self.model, self.nuisances)

    def starts(self, cause: Cause, at: tuple[int, int]) -> tuple[Structure, ...]:
        scale = scale_of(self.nuisances, self.model)
        law = cause.effect(**cause.effect.shapes(scale)[0], at=at)
        found = place(law, self.missing, self.model, scale, self.nuisances, sides=True, sign=cause.sign)
        return tuple(self.model + term for term in found[:_SHAPES])


def _has_scale(kind: str, records: Sequence[Nuisances]) -> bool:
    """Whether anything but the channels of this kind tells how large they should be."""
    if kind == "force":
        return any(driven(n) for n in records)
    return any(driven(n) or any(c[0] != kind for c in n.channels) for n in records)


def driven(nuisances: Nuisances) -> bool:
    """Whether a measured force or a moving base drives the record."""
    return bool(nuisances.fine.force.any() or nuisances.fine.base.any())


def _starts(model: Structure, cause: Cause, at: tuple, nuisances: Nuisances) -> tuple[Structure, ...]:
    structures = []
    parameter = cause.effect.parameters[0]
    # A law of degree n in the displacement weighs crest^(n - 1) times more at the largest displacement.
    degree = 1 if parameter.time else -parameter.length
    share = min(_START, _START_AT_PEAK / nuisances.crest ** max(degree - 1, 0))
    for sign in (cause.sign,) if cause.sign else (1, -1):
        unit = cause.effect(**{p.name: float(sign) for p in cause.effect.parameters}, at=at)
        extended = model + unit
        path = next(p for p in extended.entries() if p not in model.entries())
        structures.append(extended.with_values({path: sign * share * natural_size(extended, path, nuisances)}))
    return tuple(structures)


def own_paths(model: Structure, records: Sequence[Nuisances]) -> tuple[str, ...]:
    """The model's own values that a refit may change.

    Without any force only ratios show, so masses stay as stated. Values of zero have nothing to be relative to.
    """
    scaled = any(driven(n) for n in records)
    values = model.values()
    return tuple(p for p in model.entries() if values[p] != 0 and (scaled or not p.startswith("mass@")))


def hypothesis(
    model: Structure,
    starts: Sequence[Structure],
    records: Sequence[Nuisances],
    *,
    refit: bool = True,
    begins: Sequence[Mapping[str, float] | None] = (),
) -> Hypothesis:
    """Starts with their unknowns: the model's own values, the effect's numbers, and each record's nuisances.

    `begins` holds the own values of each start, where they differ from the model's.
    """
    structures, unknowns = [], []
    trust = dict(model.trust)
    given = set(model.entries())
    own = own_paths(model, records) if refit else ()
    for start, begin in zip_longest(starts, begins):
        effect = [p for p, (what, _) in start.entries().items() if p not in given and what.free]
        structure = with_offsets(start, records)
        degrees = DEGREES_BESIDE if effect else DEGREES
        mine: list[Unknown] = [own_unknown(structure, p, trust, degrees) for p in own]
        if begin is not None:
            stated = structure.values()
            mine = [replace(u, theta=math.log(begin[u.path] / stated[u.path])) for u in mine]
        mine += [effect_unknown(structure, p, records[0]) for p in effect]
        for index, nuisances in enumerate(records):
            mine += nuisance_unknowns(structure, nuisances, index)
        structures.append(structure)
        unknowns.append(tuple(mine))
    return Hypothesis(tuple(structures), tuple(unknowns))
