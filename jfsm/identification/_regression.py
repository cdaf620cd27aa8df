"""A missing force regressed on those of laws at one place, beside what else may be off.

A law acts along its link, so that its forces are one number at each instant; all that is asked of them is inner
products, of which there are as many as the springs, the dashpots and the constants that may be off.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import compress
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.stats import qmc

from ..estimation import Latent
from ..plant import HIDDEN_SUBSTEPS, bucket, direction, forces_of_law, own_force
from ..structures import AbstractTerm, LinearDamping, LinearStiffness, Scale, Structure
from ._nuisances import Nuisances

AT_ONCE = 16
"""Shapes evaluated in one call; a short list is filled up, so that one program serves all."""
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
_ONE = 1e-13
"""Share of the largest inner product below which what may be off is a combination of others."""


class Motion(NamedTuple):
    """Displacement, velocity and acceleration (n, dof) at these times (n,), as many as others have too."""

    x: Float[np.ndarray, "n dof"]
    v: Float[np.ndarray, "n dof"]
    a: Float[np.ndarray, "n dof"]
    time: Float[np.ndarray, " n"]


@dataclass(frozen=True)
class Shape:
    """Numbers of a law with their size by regression; what it explains of the missing force, and what that leaves.

    `force` is along its link, and `taken` what of it is made by what else may be off.
    """

    row: dict[str, float]
    numbers: dict[str, float]
    share: float
    left: float
    force: Float[np.ndarray, " n"]
    taken: Float[np.ndarray, " off"]


class Moments(NamedTuple):
    """Inner products of forces along one link: with themselves, with what is missing, and with what else may be off."""

    power: Float[np.ndarray, " rows"]
    wanted: Float[np.ndarray, " rows"]
    off: Float[np.ndarray, "rows off"]


@dataclass(frozen=True)
class Regression:
    """A missing force, in its standard deviations on each mass, and what springs, dashpots and constants make of it.

    `ridge` holds how well those are known: without that, a law that is partly linear has no size of its own.
    """

    law: AbstractTerm
    motion: Motion
    moves: Bool[np.ndarray, " samples"]
    missing: Float[np.ndarray, "n dof"]
    spread: Float[np.ndarray, " dof"]
    basis: Float[np.ndarray, "n dof off"]
    doubt: Float[np.ndarray, " off"]
    ridge: Float[np.ndarray, " off"]

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
        motion = still_afterwards(latent, np.asarray(nuisances.record.time[:n]))
        # At rest friction is anything within its limits, and all else is noise.
        moves = latent.moves if np.any(latent.moves) else np.ones(n, bool)
        missing = latent.force[moves]
        if not np.all(np.abs(missing) < _NO_FORCE):
            return None
        spread = np.maximum(missing.std(0), 1e-300)
        beside = [
            forces_along(t, np.array([t.values], dtype=float), motion)[0, :n, None] * direction(t.at, missing.shape[1])
            for t in others
        ]
        basis, doubt = _basis(latent, structure, nuisances.record.time[:n], beside)
        return cls(law, motion, moves, missing, spread, basis[moves] / spread[:, None], doubt, np.zeros(len(doubt)))

    def every(self, samples: int) -> "Regression":
        """The regression with one of so many samples."""
        chosen = np.flatnonzero(self.moves)[::samples]
        moves = np.zeros_like(self.moves)
        moves[chosen] = True
        return replace(self, moves=moves, missing=self.missing[::samples], basis=self.basis[::samples])

    @cached_property
    def wanted(self) -> Float[np.ndarray, "n dof"]:
        return self.missing / self.spread

    @cached_property
    def along(self) -> Float[np.ndarray, " dof"]:
        """What a force of the law is on each mass, in standard deviations of the missing one."""
        return direction(self.law.at, len(self.spread)) / self.spread

    @cached_property
    def outside(self) -> Float[np.ndarray, "off told"]:
        """What makes inner products with what may be off into those with orthonormal forces that it spans."""
        flat = self.basis.reshape(-1, len(self.doubt))
        products = flat.T @ flat + np.diag(self.ridge**2)
        scale = np.sqrt(np.maximum(np.diag(products), 1e-300))
        values, vectors = np.linalg.eigh(products / np.outer(scale, scale))
        told = values > _ONE * values[-1]
        return vectors[:, told] / np.sqrt(values[told]) / scale[:, None]

    @cached_property
    def missing_outside(self) -> tuple[float, Float[np.ndarray, " told"]]:
        """Square of the missing force that what may be off leaves, and what of it that makes."""
        taken = np.einsum("nd,ndo->o", self.wanted, self.basis) @ self.outside
        return float(np.sum(self.wanted**2) - taken @ taken), taken

    def columns(self, rows: list[dict[str, float]]) -> tuple[Float[np.ndarray, "rows n"], list[dict[str, float]]]:
        """Forces along the link of those shapes that do not run away along the motion, and these."""
        forces, stable = forces_that_stay(self.law, rows, self.motion, np.max(self.spread))
        return forces[stable][:, : len(self.moves)][:, self.moves], list(compress(rows, stable))

    def moments(self, columns: Float[np.ndarray, "rows n"]) -> Moments:
        along = self.along
        power = np.sum(columns**2, 1) * (along @ along)
        return Moments(power, columns @ (self.wanted @ along), columns @ np.einsum("ndo,d->no", self.basis, along))

    def linear(self, columns: Float[np.ndarray, "rows n"]) -> bool:
        """Whether springs, dashpots and constants make all of these forces, so that regression cannot tell."""
        moments = self.moments(columns)
        own = moments.power - np.sum((moments.off @ self.outside) ** 2, 1)
        return bool(np.all(own < _ALMOST_NONE * moments.power))

    def with_doubt(self, columns: Float[np.ndarray, "rows n"]) -> "Regression":
        """The regression with its ridge, from what the best of these forces leaves."""
        left, gain, *_ = self.regressed(self.moments(columns))
        count = self.missing.size
        rest = max(float(np.min(left - gain)), 1e-12 * count)
        return replace(self, ridge=np.sqrt(CORRELATED * rest / count) / self.doubt)

    def regressed(self, moments: Moments) -> tuple[float, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """What is missing outside of what may be off; how much of its square each column takes, with what factor; the
        power of columns outside, and what of them is made by what may be off."""
        left, missing = self.missing_outside
        taken = moments.off @ self.outside
        power = np.maximum(moments.power - np.sum(taken**2, 1), 1e-300)
        alike = moments.wanted - taken @ missing
        size = alike / power
        return left, size * alike, size, power, taken

    def ranked(
        self, columns: Float[np.ndarray, "rows n"], rows: list[dict[str, float]], sign: int, scale: Scale
    ) -> Iterator[Shape]:
        """Shapes that may be used, those first that explain most."""
        kind, dof = type(self.law), len(self.spread)
        total, gain, size, power, taken = self.regressed(self.moments(columns))
        acting = direction(self.law.at, dof)
        rms = np.sqrt(np.mean(columns**2, 1) * (acting @ acting) / dof)
        positive = one_sign(kind)
        opposite = [kind.opposite(row) if positive and s < 0 else None for row, s in zip(rows, size, strict=True)]
        rows = [row if other is None else other for row, other in zip(rows, opposite, strict=True)]
        size = np.where([other is None for other in opposite], size, -size)
        usable = power > 1e-12 * self.missing.size
        usable &= (size if positive else np.abs(size)) * rms > _LEAST * scale.force
        if sign:
            first = np.array([next(iter(row.values())) for row in rows])
            usable &= np.sign(size * first) == sign
        mean = total / len(self.missing) * float(np.mean(self.spread**2))
        for k in np.argsort(-np.where(usable, gain, -np.inf)):
            if usable[k]:
                share, unit = float(gain[k]) / total, 1.0 / np.sqrt(power[k])
                numbers = of_size(kind, rows[k], float(size[k]))
                yield Shape(rows[k], numbers, share, (1 - share) * mean, columns[k] * unit, taken[k] * unit)

    def likeness(self, one: Shape, other: Shape) -> float:
        """Correlation of two forces outside of what may be off."""
        along = self.along
        return abs(float((along @ along) * (one.force @ other.force) - one.taken @ other.taken))

    def polished(self, shape: Shape, grid: Mapping[str, np.ndarray], sign: int, scale: Scale) -> Shape:
        """The shape that explains most between those of the `grid` next to this one."""
        if not grid:
            return shape
        around = [_neighbours(values, shape.row[name]) for name, values in grid.items()]
        low, high = np.array(around).T
        offsets = (2.0 * qmc.Sobol(len(grid), scramble=False).random(AT_ONCE) - 1.0) * (high - low) / 2
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


def one_sign(kind: type[AbstractTerm]) -> bool:
    """Whether a law's size must be positive."""
    return all(p.positive for p in kind.parameters if p.force)


def of_size(kind: type[AbstractTerm], row: Mapping[str, float], size: float) -> dict[str, float]:
    """Numbers of a shape with all that hold a force so many times larger."""
    return {p.name: row[p.name] * (size if p.force else 1.0) for p in kind.parameters}


def still_afterwards(latent: Latent, time: np.ndarray) -> Motion:
    """The smoothed motion, standing still from its end on, in a length that others share."""
    more = bucket(len(time)) - len(time)
    later = time[-1] + (time[-1] - time[-2]) * np.arange(1, more + 1)
    x = np.pad(latent.displacement, ((0, more), (0, 0)), "edge")
    v, a = (np.pad(q, ((0, more), (0, 0))) for q in (latent.velocity, latent.acceleration))
    return Motion(x, v, a, np.concatenate([time, later]))


def forces_that_stay(
    law: AbstractTerm, rows: list[dict[str, float]], motion: Motion, usual: float
) -> tuple[Float[np.ndarray, "rows n"], Bool[np.ndarray, " rows"]]:
    """Forces along its link of a law's shapes, and which of them do not run away from a `usual` size.

    In finer steps where hidden states need them.
    """

    def of(rows: list[dict[str, float]], finer: int = 1) -> np.ndarray:
        lots = _lots(type(law), rows)
        return np.concatenate([forces_along(law, lot, motion, finer)[: len(some)] for some, lot in lots])

    def stable(forces: np.ndarray) -> np.ndarray:
        return np.max(np.abs(forces), 1) < _RUN_AWAY * usual  # false for what is no number, too

    forces = of(rows)
    if type(law).states and not np.all(stable(forces)):
        stiff = np.flatnonzero(~stable(forces))
        forces[stiff] = of([rows[k] for k in stiff], _FINER)
    return forces, stable(forces)


def _lots(kind: type[AbstractTerm], rows: list[dict[str, float]]):
    for begin in range(0, len(rows), AT_ONCE):
        chunk = rows[begin : begin + AT_ONCE]
        filled = chunk + [chunk[-1]] * (AT_ONCE - len(chunk))
        yield chunk, np.array([[row[p.name] for p in kind.parameters] for row in filled])


def forces_along(law: AbstractTerm, numbers: np.ndarray, motion: Motion, finer: int = 1) -> np.ndarray:
    """Forces (rows, n) of a law along its link for rows of its numbers, less those on the inertia that it takes."""
    row, kind = direction(law.at, motion.x.shape[1]), type(law)
    forces = forces_of_law(kind, numbers, motion.x @ row, motion.v @ row, motion.time, substeps=finer * HIDDEN_SUBSTEPS)
    if not kind.takes:
        return forces
    taken = numbers[:, [p.name for p in kind.parameters].index(kind.takes)]
    return forces - taken[:, None] * (motion.a @ row)


def _basis(
    latent: Latent, structure: Structure, time: np.ndarray, beside: Sequence[np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Forces (n, dof, off) of what may be off besides, and how far: springs, dashpots, a simulation's own numbers,
    constants; given forces."""
    n, dof = latent.force.shape
    columns, doubt = list(beside), [1.0] * len(beside)
    for term in structure.terms:
        if isinstance(term, LinearStiffness | LinearDamping):
            spring, row = isinstance(term, LinearStiffness), direction(term.at, dof)
            motion = (latent.displacement if spring else latent.velocity) @ row
            columns.append(float(term.values[0]) * motion[:, None] * row)
            doubt.append(_SPRING if spring else _DASHPOT)
    if structure.own is not None:  # what it would need more were a number of its own larger
        motion = latent.displacement, latent.velocity, latent.acceleration
        by_number = own_force(structure.own, np.asarray(structure.own_numbers), *motion, time)[2]
        columns += list(np.moveaxis(by_number, 2, 0))
        doubt += [_DASHPOT] * by_number.shape[2]
    for j in range(dof):
        columns.append(np.ones((n, 1)) * (np.arange(dof) == j) * np.std(latent.force))
        doubt.append(_CONSTANT)
    return np.stack(columns, 2), np.array(doubt)
