"""Where a search for a law's numbers begins: the shapes that explain most of what the rest of the structure leaves.

The force that the structure lacks without the law is smoothed from the record; every natural shape of the law is
evaluated along the smoothed motion, and its size found by linear regression beside errors of the springs, the dashpots
and the offsets. It is equation error, good for a start and for nothing more.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ..estimation import Latent, latent_force
from ..plant import Grid, Imposed, Plant, direction, force_needed, lower
from ..structures import AbstractTerm, LinearDamping, LinearStiffness, MapTerm, Scale, Structure
from ._nuisances import Nuisances
from ._regression import Regression, Shape, forces_that_stay, still_afterwards

_SAMPLES = 8192
_ALIKE = 0.98
"""Correlation of two forces from which they are one start."""
_MOST = 8
"""Shapes that come back."""
_MODEST = 0.05
"""Size of a law to begin with where the record does not tell one, as a share of the elastic force."""


class Placed(NamedTuple):
    """A term, and the share that it explains of the power that springs and dashpots leave of a missing force.

    None where constants, springs and dashpots make the same force, so that regression cannot tell. `left` is the mean
    square force that it leaves.
    """

    term: AbstractTerm
    share: float | None
    left: float


def scale_of(nuisances: Nuisances, structure: Structure) -> Scale:
    """Sizes of a record's motion."""
    length, time = nuisances.length, nuisances.record.time
    force = nuisances.elastic_force(structure)
    return Scale(force, length, nuisances.crest * length, nuisances.omega, float(time[0]), float(time[-1]))


def missing_force(structure: Structure, nuisances: Nuisances, most: int = _SAMPLES) -> Latent:
    """Smoothed motion of a record, its first `most` samples, and the force that a structure lacks to explain it."""
    n = min(nuisances.samples, most)
    plant = lower(structure, nuisances.channels, grid=Grid(nuisances.record.dt, nuisances.inputs.substeps))
    values, use = (np.asarray(q)[:n] for q in (nuisances.readings.values, nuisances.readings.use))
    if isinstance(nuisances.inputs, Imposed):
        return _measured(plant, nuisances, values, use)
    return latent_force(
        plant,
        nuisances.observation,
        nuisances.inputs,
        values,
        use,
        np.asarray(nuisances.readings.variance),
        nuisances.force_covariance,
        nuisances.omega,
        nuisances.length,
    )


def _measured(plant: Plant, nuisances: Nuisances, values: np.ndarray, use: np.ndarray) -> Latent:
    """The force that a structure lacks along an imposed motion: what was measured, less what the motion needs."""
    n, imposed = len(values), nuisances.inputs
    assert isinstance(imposed, Imposed)
    left = np.zeros((n, plant.dof))
    std = np.zeros_like(left)
    known = np.asarray(force_needed(plant, nuisances.observation, imposed))[:n]
    for i in np.flatnonzero(nuisances.judged):
        j, seen = nuisances.channels[i][1] - 1, use[:, i] > 0
        lacking = (values[:, i] - known[:, j]) / (1.0 + float(plant.force_gain[j]))
        left[:, j] = np.interp(np.arange(n), np.flatnonzero(seen), lacking[seen])
        std[:, j] = nuisances.floor[i]
    x, v = (np.asarray(q)[:n, 0] for q in (imposed.x, imposed.v))
    a = np.asarray(imposed.a)[:n]
    return Latent(x, v, a, left, std, np.ones(n, bool))


def _laws(structure: Structure) -> tuple[AbstractTerm, ...]:
    """Terms whose numbers a search may begin elsewhere than where they stand."""
    return tuple(t for t in structure.terms if not isinstance(t, LinearStiffness | LinearDamping | MapTerm))


def starts(structure: Structure, nuisances: Nuisances, most: int = 3, rounds: int = 2) -> list[Structure]:
    """Structures to begin a fit from, the most promising first; none where there is no law to place.

    With several laws each is placed in turn beside the others, and only the best of all comes back.
    """
    laws = _laws(structure)
    if not laws:
        return []
    rest = structure
    for law in laws:
        rest = rest.without(law)
    latent = missing_force(rest, nuisances)
    scale = scale_of(nuisances, structure)
    best: dict[int, AbstractTerm] = {}
    for _ in range(rounds if len(laws) > 1 else 1):
        for i, law in enumerate(laws):
            others = [term for k, term in best.items() if k != i]
            found = place(law, latent, structure, scale, nuisances, others)
            if len(laws) == 1:
                return [_with(structure, {id(law): start.term}) for start in found[:most]]
            if found:
                best[i] = found[0].term
    return [_with(structure, {id(law): best[i] for i, law in enumerate(laws) if i in best})]


def natural_starts(structure: Structure, nuisances: Nuisances, count: int) -> list[Structure]:
    """The structure with its law at `count` of its natural shapes, from end to end; none unless it has just one law."""
    laws = _laws(structure)
    if len(laws) != 1 or count < 1:
        return []
    law, kind = laws[0], type(laws[0])
    shapes = kind.shapes(scale_of(nuisances, structure))
    share = {p.name: _MODEST if p.force else 1.0 for p in kind.parameters}
    found = []
    for i in np.linspace(0, len(shapes) - 1, count).round().astype(int):
        numbers = {name: share[name] * value for name, value in shapes[i].items()} | _stays(law)
        found.append(_with(structure, {id(law): kind(**numbers, at=law.at)}))
    return found


def _with(structure: Structure, instead: Mapping[int, AbstractTerm]) -> Structure:
    """The structure with some of its terms, by identity, replaced."""
    terms = [instead.get(id(term), term) for term in structure.terms]
    return structure.having(terms=terms)


def place(
    law: AbstractTerm,
    latent: Latent,
    structure: Structure,
    scale: Scale,
    nuisances: Nuisances,
    others: Sequence[AbstractTerm] = (),
    sign: int = 0,
    sides: bool = False,
) -> list[Placed]:
    """Terms of `law`'s class at its place, best first, that explain a missing force beside `others`.

    `sign` asks for that sign of the first number; a side stays as it is unless `sides` are to be tried. None are found
    where the missing force is no number.
    """
    rows = shapes_of(law, scale, sides)
    regression = Regression.of(law, latent, structure, nuisances, others)
    if regression is None:
        return []  # a hidden state of the structure's own runs away along this motion
    columns, rows = regression.columns(rows)
    if not rows:
        return []
    if regression.linear(columns):
        return [Placed(law, None, math.inf)]
    regression = regression.with_doubt(columns)
    ranked = regression.ranked(columns, rows, sign, scale)
    grid = {p.name: np.unique([row[p.name] for row in rows]) for p in law.parameters if p.free}
    grid = {name: values for name, values in grid.items() if values.size > 1}
    found: list[Shape] = []
    for shape in ranked:
        if len(found) == _MOST:
            break
        if all(regression.likeness(shape, other) < _ALIKE for other in found):
            found.append(shape if found else regression.polished(shape, grid, sign, scale))
    return [Placed(type(law)(**shape.numbers, at=law.at), shape.share, shape.left) for shape in found]


def about_a_rest(
    kind: type[AbstractTerm], at: tuple[int, int], latent: Latent, structure: Structure
) -> tuple[Placed, float] | None:
    """A term that makes a missing force about a rest of its own, and where that is; None where it has no rest.

    For motion of which no channel tells where it is: the smoothed one is about zero.
    """
    row = direction(at, latent.force.shape[1])
    d, w, missing = latent.displacement @ row, latent.velocity @ row, latent.force @ row
    columns = np.stack([np.ones_like(d), w / max(np.std(w), 1e-300), d / np.std(d), (d / np.std(d)) ** 2], 1)
    straight = np.linalg.lstsq(columns[:, :3], missing, rcond=None)[0]
    sizes = np.linalg.lstsq(columns, missing, rcond=None)[0]
    slope, curvature = sizes[2] / np.std(d), sizes[3] / np.var(d)
    stiffness = structure.stiffness_of(at)
    found = with_a_rest(kind, at, stiffness, slope, curvature)
    if found is None:
        return None
    term, rest = found
    before, left = (float(np.mean((missing - columns[:, : len(q)] @ q) ** 2)) for q in (straight, sizes))
    return Placed(term, 1.0 - left / before, left), rest


def with_a_rest(
    kind: type[AbstractTerm], at: tuple[int, int], stiffness: float, slope: float, curvature: float
) -> tuple[AbstractTerm, float] | None:
    """A term with such a slope and curvature about a rest of its own, and where that is; None if it has none."""
    numbers = kind.about_a_rest(stiffness, slope, curvature)
    term = None if numbers is None else kind(**numbers, at=at)
    rests = () if term is None else term.rests(stiffness)
    return (term, max(rests, key=lambda rest: rest * curvature)) if term is not None and rests else None


def shapes_of(law: AbstractTerm, scale: Scale, sides: bool) -> list[dict[str, float]]:
    """Natural shapes of a law; a side that was chosen stays, and so does the origin of time."""
    if sides:
        return type(law).shapes(scale)
    stays, rows = _stays(law), type(law).shapes(scale)
    if "side" in stays:
        rows = [row for row in rows if row["side"] == stays["side"]]
    return [row | stays for row in rows]


def _stays(law: AbstractTerm) -> dict[str, float]:
    """Numbers that are never fitted, as they are."""
    return {p.name: float(getattr(law, p.name)) for p in law.parameters if not p.free}


def forces_of(terms: Sequence[AbstractTerm], latent: Latent, nuisances: Nuisances) -> Float[np.ndarray, "terms n dof"]:
    """Forces (terms, n, dof) of terms of one class at one place along a smoothed motion, no numbers where they run
    away."""
    n = len(latent.force)
    motion = still_afterwards(latent, np.asarray(nuisances.record.time[:n]))
    rows = [dict(zip((p.name for p in t.parameters), map(float, t.values), strict=True)) for t in terms]
    forces, stable = forces_that_stay(terms[0], rows, motion, max(float(np.max(latent.force.std(0))), 1e-300))
    return np.where(stable[:, None], forces[:, :n], np.nan)[:, :, None] * direction(terms[0].at, latent.force.shape[1])
