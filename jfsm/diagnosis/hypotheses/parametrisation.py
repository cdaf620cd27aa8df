"""Unknowns of a hypothesis: own values, the numbers of its effects, and the nuisances of every record."""

from collections.abc import Sequence
from dataclasses import replace
from enum import Enum
from itertools import zip_longest

from ...identification import (
    DEGREES,
    DEGREES_BESIDE,
    Hypothesis,
    Nuisances,
    Unknown,
    effect_unknown,
    nuisance_unknowns,
    own_unknown,
    with_offsets,
)
from ...structures import Structure, is_offset
from .initial_values import Begin, begun


class Apart(Enum):
    """The numbers that each of several records has to itself, apart from its nuisances: none, own values, or all."""

    nothing = 0
    own = 1
    all = 2


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
    given, own = set(model.entries()), own_paths(model, records) if refit else ()
    structures = [with_offsets(start, records) for start in starts]
    unknowns = []
    for start, structure, begin in zip_longest(starts, structures, begins):
        numbers = [path for path, (what, _) in start.entries().items() if what.free and path not in given]
        unknowns.append(
            (
                *(begun(u, begin) for u in _own_unknowns(model, structure, own, records, apart, beside=bool(numbers))),
                *_effect_unknowns(structure, numbers, records, apart),
                *(begun(u, begin) for i, n in enumerate(records) for u in nuisance_unknowns(structure, n, i)),
            )
        )
    return Hypothesis(tuple(structures), tuple(unknowns))


def _own_unknowns(
    model: Structure,
    structure: Structure,
    own: Sequence[str],
    records: Sequence[Nuisances],
    apart: Apart,
    *,
    beside: bool,
) -> list[Unknown]:
    """The model's own values as unknowns, alone or `beside` an effect."""
    trust, degrees = dict(model.trust), DEGREES_BESIDE if beside else DEGREES
    unknowns = [own_unknown(structure, path, trust, degrees) for path in own]
    return unknowns if apart is Apart.nothing else _in_each(unknowns, records)


def _effect_unknowns(
    structure: Structure, numbers: Sequence[str], records: Sequence[Nuisances], apart: Apart
) -> list[Unknown]:
    """The numbers of effects as unknowns."""
    unknowns = [effect_unknown(structure, path, records[0]) for path in numbers]
    return _in_each(unknowns, records) if apart is Apart.all else unknowns


def _in_each(unknowns: Sequence[Unknown], records: Sequence[Nuisances]) -> list[Unknown]:
    """Unknowns that every record has to itself."""
    return [replace(u, record=index) for u in unknowns for index in range(len(records))]
