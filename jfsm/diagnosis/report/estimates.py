"""Numbers of a fitted hypothesis as estimates: value, interval and unit."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..._result import Estimate
from ...identification import Mode, Nuisances, modes_of, oscillations, ratios
from ...structures import Structure
from ..advice.detection_limits import Smallest
from ..evidence.fitted import Trial
from ..evidence.plain import as_plain
from ..hypotheses.effect import names, places

Units = Mapping[Any, str]
"""Unit of each kind of quantity."""


def unit_of(structure: Structure, path: str, units: Units) -> str:
    """Unit of one of a structure's numbers."""
    return structure.entries()[path][0].unit(units["force"], units["displacement"])


def name_of(path: str) -> str:
    """The number's own name, of a second term of one law as well."""
    return path.split(".")[-1].split("#")[0]


def estimate(t: Trial, path: str, units: Units) -> Estimate:
    """A number of a trial with its 95 % interval."""
    value, low, high = t.interval(path)
    return Estimate(value, low, high, unit_of(t.structure, path, units))


def refitted_values(t: Trial, model: Structure, units: Units) -> dict[str, Estimate]:
    """The model's own values that a trial fitted, by path."""
    fitted = {u.path for u in t.unknowns}
    return {path: estimate(t, path, units) for path in model.entries() if path in fitted}


def modes_of_trial(t: Trial) -> tuple[Mode, ...]:
    """Frequency and damping ratio of the modes of what is linear in a trial."""
    return modes_of(t.structure, t.unknowns, t.theta, t.covariance)


def plain_modes(model: Structure, found: Sequence[Mode]) -> list[dict[str, Any]]:
    """The modes as a trial has them, each beside that of the model as given where that has as many."""
    given = oscillations(model)
    known = len(given) == len(found)
    before = zip(np.abs(given) / (2 * np.pi), ratios(given), strict=True) if known else ((None, None) for _ in found)
    return [
        {
            name: {"given": None if value is None else float(value), **as_plain(one, lossless=False)}
            for name, value, one in zip(Mode._fields, values, mode, strict=True)
        }
        for values, mode in zip(before, found, strict=True)
    ]


def effect_values(t: Trial, which: int, model: Structure, units: Units) -> dict[str, Estimate]:
    """Values of one of a trial's effects, by name."""
    paths = [t.unknowns[k].path for k in unknowns_of_effect(t, which, model)]
    return {name_of(p): estimate(t, p, units) for p in paths}


def unknowns_of_effect(t: Trial, which: int, model: Structure) -> list[int]:
    """Places among a trial's unknowns of the numbers of one of its effects."""
    own, prefix = set(model.entries()), f"{t.parts[which].kind}@{t.parts[which].place}."
    return [k for k, u in enumerate(t.unknowns) if u.path.startswith(prefix) and u.path not in own]


def all_effect_values(t: Trial, model: Structure, units: Units) -> dict[str, Estimate]:
    """Values of all effects of a trial; of several, each with its cause before its name."""
    if len(t.effects) == 1:
        return effect_values(t, 0, model, units)
    named = [(effect.cause.id, effect_values(t, i, model, units)) for i, effect in enumerate(t.effects)]
    return {f"{cause}.{name}": value for cause, values in named for name, value in values.items()}


def noise_by_channel(nuisances: Nuisances) -> dict[str, float]:
    """Standard deviation of every channel's noise, by the channel's name."""
    return {f"{kind} {j}": float(s) for (kind, j), s in zip(nuisances.channels, nuisances.floor, strict=True)}


class SmallestEffect(NamedTuple):
    """An effect of the smallest size: its place, the name of the number that is its size, and all its numbers."""

    at: tuple
    name: str
    effect: dict[str, Estimate]

    @property
    def size(self) -> Estimate:
        """The number that is its size, without its sign."""
        size = abs(self.effect[self.name].value)
        return Estimate(size, size, size, self.effect[self.name].unit)

    @property
    def plain(self) -> dict[str, Any]:
        """For the page and JSON."""
        effect = {name: {"value": e.value, "unit": e.unit} for name, e in self.effect.items()}
        size = {"parameter": self.name, "value": self.size.value, "unit": self.size.unit}
        return size | {"at": list(self.at), "effect": effect}


def smallest_effects(seen: list[Smallest], units: Units) -> dict[str, SmallestEffect]:
    """The smallest detectable size of every cause, at the place where it would have shown first."""
    found: dict[str, Smallest] = {}
    for smallest in seen:
        cause = names(smallest.effects)
        if cause not in found or smallest.size < found[cause].size:
            found[cause] = smallest
    return {cause: _smallest_effect(smallest, units) for cause, smallest in found.items()}


def _smallest_effect(smallest: Smallest, units: Units) -> SmallestEffect:
    effect = {
        name_of(path): Estimate(value, value, value, unit_of(smallest.structure, path, units))
        for path, value in smallest.numbers.items()
    }
    return SmallestEffect(places(smallest.effects), name_of(smallest.path), effect)
