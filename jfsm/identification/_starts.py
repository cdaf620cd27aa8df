"""Where a search for a law's numbers begins: the shapes that explain most of what the rest of the structure leaves.

The force that the structure lacks without the law is smoothed from the record; every natural shape of the law is
evaluated along the smoothed motion, and its size found by linear regression beside errors of the springs, the dashpots
and the offsets. It is equation error, good for a start and for nothing more.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import compress
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.stats import qmc

from ..estimation import Latent, latent_force
from ..plant import HIDDEN_SUBSTEPS, Grid, Imposed, Plant, bucket, direction, force_needed, forces_of_law, lower
from ..structures import AbstractTerm, LinearDamping, LinearStiffness, MapTerm, Scale, Structure
from ._nuisances import Nuisances

_SAMPLES = 8192
_AT_ONCE = 16
"""Shapes evaluated in one call; a short list is filled up, so that one program serves all."""
_ALIKE = 0.98
"""Correlation of two forces from which they are one start."""
_MOST = 8
"""Shapes that come back."""
_SHRINK = (1.0, 0.4, 0.16, 0.064)
"""Rounds in which the best shape is looked for between those that were tried, so many gaps of their grid wide."""
_SPRING, _DASHPOT, _CONSTANT = 0.15, 1.0, 10.0
"""How far springs and dashpots may be off, as shares of themselves, and a constant force as a share of the missing."""
CORRELATED = 20.0
"""Samples of a smoothed force that count as one."""
_FINER = 8
"""Times as many steps for hidden states that the usual ones cannot follow, as stiff bristles'."""
_RUN_AWAY = 1e9
"""Force of a hidden state that its steps could not follow, as a multiple of the missing one."""
_NO_FORCE = 1e100
"""Missing force [N] that is none."""
_LEAST = 1e-4
"""Force of an effect, as a share of the elastic one in the mean square, below which it is no start."""
_ALMOST_NONE = 1e-6
"""Share of a law's power outside springs, dashpots and constants, below which it is none."""
_MODEST = 0.05
"""Size of a law to begin with where the record does not tell one, as a share of the elastic force."""


class _Motion(NamedTuple):
    """Displacement and velocity (n, dof) at these times (n,), as many as others have too."""

    x: Float[np.ndarray, "n dof"]
    v: Float[np.ndarray, "n dof"]
    time: Float[np.ndarray, " n"]


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
    return Latent(np.asarray(imposed.x)[:n, 0], np.asarray(imposed.v)[:n, 0], left, std, np.ones(n, bool))


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
    return Structure(structure.mass, terms, structure.sensors, structure.trust)


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
    found: list[_Shape] = []
    for shape in ranked:
        if len(found) == _MOST:
            break
        if all(shape.differs(other) for other in found):
            found.append(shape if found else regression.polished(shape, grid, sign, scale))
    return [Placed(type(law)(**shape.numbers, at=law.at), shape.share, shape.left) for shape in found]


@dataclass(frozen=True)
class _Shape:
    """Numbers of a law with their size by regression; what it explains of the missing force, and what its force is."""

    row: dict[str, float]
    numbers: dict[str, float]
    share: float
    left: float
    force: np.ndarray

    def differs(self, other: "_Shape") -> bool:
        """Whether the two forces are not much alike."""
        return abs(float(self.force @ other.force)) < _ALIKE


@dataclass(frozen=True)
class Regression:
    """A missing force regressed on those of a law, beside errors of springs, dashpots and constants, and other laws.

    `ridge` holds how well those are known: without that, a law that is partly linear has no size of its own.
    """

    law: AbstractTerm
    motion: _Motion
    moves: np.ndarray
    missing: np.ndarray
    spread: np.ndarray
    basis: np.ndarray
    doubt: np.ndarray
    ridge: np.ndarray

    @classmethod
    def of(
        cls,
        law: AbstractTerm,
        latent: Latent,
        structure: Structure,
        nuisances: Nuisances,
        others: Sequence[AbstractTerm],
    ) -> "Regression | None":
        """None where the missing force is no number."""
        n = len(latent.force)
        motion = _still_afterwards(latent, np.asarray(nuisances.record.time[:n]))
        # At rest friction is anything within its limits, and all else is noise.
        moves = latent.moves if np.any(latent.moves) else np.ones(n, bool)
        missing = latent.force[moves]
        if not np.all(np.abs(missing) < _NO_FORCE):
            return None
        spread = np.maximum(missing.std(0), 1e-300)
        beside = [_forces(t, np.array([t.values], dtype=float), motion)[0, :n] for t in others]
        basis, doubt = _basis(latent, structure, beside)
        basis = (basis[moves] / spread[:, None]).reshape(-1, len(doubt))
        return cls(law, motion, moves, missing, spread, basis, doubt, np.zeros((0, len(doubt))))

    @property
    def wanted(self) -> np.ndarray:
        return np.concatenate([(self.missing / self.spread).ravel(), np.zeros(len(self.ridge))])

    @cached_property
    def projector(self) -> np.ndarray:
        """Orthonormal basis of what else may be off."""
        return np.linalg.qr(np.vstack([self.basis, self.ridge]))[0]

    def columns(self, rows: list[dict[str, float]]) -> tuple[np.ndarray, list[dict[str, float]]]:
        """Forces (rows, samples x dof) of those shapes that do not run away along the motion, and these."""
        forces, stable = _forces_of(self.law, rows, self.motion, np.max(self.spread))
        forces, rows = forces[:, : len(self.moves)], list(compress(rows, stable))
        return (forces[stable][:, self.moves] / self.spread).reshape(len(rows), self.missing.size), rows

    def linear(self, columns: np.ndarray) -> bool:
        """Whether springs, dashpots and constants make all of these forces, so that regression cannot tell."""
        own = _regressed(columns, self.wanted, self.projector)[3]
        return bool(np.all(np.sum(own**2, 1) < _ALMOST_NONE * np.sum(columns**2, 1)))

    def with_doubt(self, columns: np.ndarray) -> "Regression":
        """The regression with its ridge, from what the best of these forces leaves."""
        wanted = self.wanted
        left, gain, _, _ = _regressed(columns, wanted, self.projector)
        rest = max(np.min(left @ left - gain), 1e-12 * wanted.size)
        return replace(self, ridge=np.diag(np.sqrt(CORRELATED * rest / wanted.size) / self.doubt))

    def ranked(self, columns: np.ndarray, rows: list[dict[str, float]], sign: int, scale: Scale) -> Iterator[_Shape]:
        """Shapes that may be used, those first that explain most."""
        kind, wanted = type(self.law), self.wanted
        rms = np.sqrt(np.mean((columns.reshape(*columns.shape[:1], *self.missing.shape) * self.spread) ** 2, (1, 2)))
        padded = np.hstack([columns, np.zeros((len(columns), len(self.ridge)))])
        left, gain, size, padded = _regressed(padded, wanted, self.projector)
        power = np.maximum(np.sum(padded**2, 1), 1e-300)
        positive = one_sign(kind)
        opposite = [kind.opposite(row) if positive and s < 0 else None for row, s in zip(rows, size, strict=True)]
        rows = [row if other is None else other for row, other in zip(rows, opposite, strict=True)]
        size = np.where([other is None for other in opposite], size, -size)
        usable = power > 1e-12 * self.missing.size
        usable &= (size if positive else np.abs(size)) * rms > _LEAST * scale.force
        if sign:
            first = np.array([next(iter(row.values())) for row in rows])
            usable &= np.sign(size * first) == sign
        total = float(left @ left)
        mean = total / len(self.missing) * float(np.mean(self.spread**2))
        for k in np.argsort(-np.where(usable, gain, -np.inf)):
            if usable[k]:
                share = float(gain[k]) / total
                numbers = of_size(kind, rows[k], size[k])
                yield _Shape(rows[k], numbers, share, (1 - share) * mean, padded[k] / np.sqrt(power[k]))

    def polished(self, shape: _Shape, grid: Mapping[str, np.ndarray], sign: int, scale: Scale) -> _Shape:
        """The shape that explains most between those of the `grid` next to this one."""
        if not grid:
            return shape
        around = [_neighbours(values, shape.row[name]) for name, values in grid.items()]
        low, high = np.array(around).T
        offsets = (2.0 * qmc.Sobol(len(grid), scramble=False).random(_AT_ONCE) - 1.0) * (high - low) / 2
        for shrink in _SHRINK:
            centre = np.array([shape.row[name] for name in grid])
            points = np.clip(centre + shrink * offsets, low, high)
            rows = [shape.row | dict(zip(grid, point.tolist(), strict=True)) for point in points]
            shape = max([shape, *self.ranked(*self.columns(rows), sign, scale)], key=lambda s: s.share)
        return shape


def _neighbours(values: np.ndarray, value: float) -> tuple[float, float]:
    """The values of a grid next to one of its own; past an end, as far off as on its other side."""
    k = int(np.argmin(np.abs(values - value)))
    if k == 0:
        return max(2 * value - values[1], value / 2) if value > 0 else 2 * value - values[1], values[1]
    return values[k - 1], values[k + 1] if k + 1 < values.size else 2 * value - values[k - 1]


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


def one_sign(kind: type[AbstractTerm]) -> bool:
    """Whether a law's size must be positive."""
    return all(p.positive for p in kind.parameters if p.force)


def of_size(kind: type[AbstractTerm], row: Mapping[str, float], size: float) -> dict[str, float]:
    """Numbers of a shape with all that hold a force so many times larger."""
    return {p.name: row[p.name] * (size if p.force else 1.0) for p in kind.parameters}


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


def _lots(kind: type[AbstractTerm], rows: list[dict[str, float]]):
    for begin in range(0, len(rows), _AT_ONCE):
        chunk = rows[begin : begin + _AT_ONCE]
        filled = chunk + [chunk[-1]] * (_AT_ONCE - len(chunk))
        yield chunk, np.array([[row[p.name] for p in kind.parameters] for row in filled])


def _still_afterwards(latent: Latent, time: np.ndarray) -> _Motion:
    """The smoothed motion, standing still from its end on, in a length that others share."""
    more = bucket(len(time)) - len(time)
    later = time[-1] + (time[-1] - time[-2]) * np.arange(1, more + 1)
    x = np.pad(latent.displacement, ((0, more), (0, 0)), "edge")
    v = np.pad(latent.velocity, ((0, more), (0, 0)))
    return _Motion(x, v, np.concatenate([time, later]))


def forces_of(terms: Sequence[AbstractTerm], latent: Latent, nuisances: Nuisances) -> Float[np.ndarray, "terms n dof"]:
    """Forces (terms, n, dof) of terms of one class at one place along a smoothed motion, no numbers where they run
    away."""
    n = len(latent.force)
    motion = _still_afterwards(latent, np.asarray(nuisances.record.time[:n]))
    rows = [dict(zip((p.name for p in t.parameters), map(float, t.values), strict=True)) for t in terms]
    forces, stable = _forces_of(terms[0], rows, motion, max(float(np.max(latent.force.std(0))), 1e-300))
    return np.where(stable[:, None, None], forces[:, :n], np.nan)


def _forces_of(
    law: AbstractTerm, rows: list[dict[str, float]], motion: _Motion, usual: float
) -> tuple[np.ndarray, np.ndarray]:
    """Forces (rows, n, dof) of a law's shapes along a motion, and which of them do not run away from a `usual` size.

    In finer steps where hidden states need them.
    """

    def of(rows: list[dict[str, float]], finer: int = 1) -> np.ndarray:
        lots = _lots(type(law), rows)
        return np.concatenate([_forces(law, lot, motion, finer)[: len(some)] for some, lot in lots])

    def stable(forces: np.ndarray) -> np.ndarray:
        return np.max(np.abs(forces), (1, 2)) < _RUN_AWAY * usual  # false for what is no number, too

    forces = of(rows)
    if type(law).states and not np.all(stable(forces)):
        stiff = np.flatnonzero(~stable(forces))
        forces[stiff] = of([rows[k] for k in stiff], _FINER)
    return forces, stable(forces)


def _forces(law: AbstractTerm, numbers: np.ndarray, motion: _Motion, finer: int = 1) -> np.ndarray:
    """Forces (rows, n, dof) of a law along a motion for rows of its numbers."""
    row = direction(law.at, motion.x.shape[1])
    d, w = motion.x @ row, motion.v @ row
    return forces_of_law(type(law), numbers, d, w, motion.time, substeps=finer * HIDDEN_SUBSTEPS)[:, :, None] * row


def _regressed(columns: np.ndarray, wanted: np.ndarray, q: np.ndarray):
    """What an orthonormal basis leaves of `wanted`, how much of its square each column takes, with what factor; columns
    left."""
    wanted = wanted - q @ (q.T @ wanted)
    columns = columns - (columns @ q) @ q.T
    power = np.maximum(np.sum(columns**2, 1), 1e-300)
    size = columns @ wanted / power
    return wanted, size**2 * power, size, columns


def _basis(latent: Latent, structure: Structure, beside: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Forces (n, dof, columns) of what may be off besides, and how far: springs, dashpots, constants; given forces."""
    n, dof = latent.force.shape
    columns, doubt = list(beside), [1.0] * len(beside)
    for term in structure.terms:
        if isinstance(term, LinearStiffness | LinearDamping):
            spring, row = isinstance(term, LinearStiffness), direction(term.at, dof)
            motion = (latent.displacement if spring else latent.velocity) @ row
            columns.append(float(term.values[0]) * motion[:, None] * row)
            doubt.append(_SPRING if spring else _DASHPOT)
    for j in range(dof):
        columns.append(np.ones((n, 1)) * (np.arange(dof) == j) * np.std(latent.force))
        doubt.append(_CONSTANT)
    return np.stack(columns, 2), np.array(doubt)
