"""Two laws placed at once: pairs that together explain most of a missing force.

Laws that hide each other explain little alone, and what one of them leaves by itself misleads. So every shape of one is
regressed beside every shape of the other, which takes no more than their inner products.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Shaped

from ..estimation import Latent
from ..structures import AbstractTerm, Scale, Structure
from ._nuisances import Nuisances
from ._starts import CORRELATED, Regression, of_size, one_sign, shapes_of

_APART = 1e-3
"""Share of a shape's power that another does not make, below which the two are one."""
_ENOUGH = 3000
"""Readings of a missing force, of more than which only some samples count."""


class PlacedTogether(NamedTuple):
    """Two laws, as numbered in the list that was given, their terms, and the share of a missing force that they explain
    beside springs, dashpots and constants."""

    laws: tuple[int, int]
    terms: tuple[AbstractTerm, AbstractTerm]
    share: float


class _Shapes(NamedTuple):
    """Forces (shapes, samples) of a law, and which signs (shapes,) their sizes may have: 0 is either."""

    law: AbstractTerm
    rows: list[dict[str, float]]
    forces: Float[np.ndarray, "shapes samples"]
    signs: Shaped[np.ndarray, " shapes"]

    def sized(self, k: int, size: float) -> AbstractTerm:
        """The term of a shape and its size."""
        kind, row = type(self.law), self.rows[k]
        other = kind.opposite(row) if size < 0 and one_sign(kind) else None
        row, size = (row, size) if other is None else (other, -size)
        return kind(**of_size(kind, row, size), at=self.law.at)


def place_together(
    laws: Sequence[AbstractTerm],
    signs: Sequence[int],
    pairs: Sequence[tuple[int, int]],
    latent: Latent,
    structure: Structure,
    scale: Scale,
    nuisances: Nuisances,
) -> list[PlacedTogether]:
    """The best shapes of each of these `pairs` of laws, those first that explain most of a missing force.

    `signs` asks for that sign of the first number of a law, unless it is 0. Pairs of which no shapes do are left out.
    """
    shapes: dict[int, _Shapes] = {}
    regression = None
    for i, (law, sign) in enumerate(zip(laws, signs, strict=True)):
        regression = Regression.of(law, latent, structure, nuisances, ())
        if regression is None:
            return []
        forces, rows = regression.columns(shapes_of(law, scale, sides=True))
        if rows and not regression.linear(forces):
            shapes[i] = _Shapes(law, rows, forces, _signs(law, rows, sign))
    pairs = [pair for pair in pairs if shapes.keys() >= set(pair)]
    if regression is None or not pairs:
        return []
    samples, dof = regression.missing.shape
    every = -(-samples * dof // _ENOUGH)
    kept = np.repeat(np.arange(samples) % every == 0, dof)
    basis, wanted = regression.basis[kept], regression.wanted[kept]
    shapes = {i: one._replace(forces=one.forces[:, kept]) for i, one in shapes.items()}
    found = _explaining(shapes, pairs, basis, wanted, np.zeros((0, basis.shape[1])))
    if not found:
        return []
    # What else may be off is not so far off that it would take the place of a law: as for laws placed by themselves.
    rest = max(1.0 - max(one.share for one in found), 1e-12) * float(np.mean(wanted**2))
    ridge = np.diag(np.sqrt(CORRELATED / every * rest) / regression.doubt)
    return sorted(_explaining(shapes, pairs, basis, wanted, ridge), key=lambda one: -one.share)


def _signs(law: AbstractTerm, rows: list[dict[str, float]], sign: int) -> np.ndarray:
    """Signs that the size of each shape must have."""
    kind = type(law)
    if one_sign(kind):
        return np.array([0 if kind.opposite(row) else 1 for row in rows])
    return np.array([sign * np.sign(next(iter(row.values()))) for row in rows])


def _explaining(
    shapes: dict[int, _Shapes],
    pairs: Sequence[tuple[int, int]],
    basis: np.ndarray,
    wanted: np.ndarray,
    ridge: np.ndarray,
) -> list[PlacedTogether]:
    q = np.linalg.qr(np.vstack([basis, ridge]))[0]

    def outside(rows: np.ndarray) -> np.ndarray:
        padded = np.pad(rows, ((0, 0), (0, len(ridge))))
        return padded - (padded @ q) @ q.T

    [wanted] = outside(wanted[None])
    total = float(wanted @ wanted)
    beside = {i: one._replace(forces=outside(one.forces)) for i, one in shapes.items()}
    found = []
    for pair in pairs:
        one, other = (beside[i] for i in pair)
        k, m, sizes, gain = _best(one, other, wanted)
        if gain > 0:
            terms = one.sized(k, sizes[0]), other.sized(m, sizes[1])
            found.append(PlacedTogether(pair, terms, gain / total))
    return found


def _best(one: _Shapes, other: _Shapes, wanted: np.ndarray) -> tuple[int, int, tuple[float, float], float]:
    """Which shape of either explains most of what is wanted, with what sizes, and how much of its square."""
    cross = one.forces @ other.forces.T
    powers = np.sum(one.forces**2, 1)[:, None], np.sum(other.forces**2, 1)[None, :]
    alike = (one.forces @ wanted)[:, None], (other.forces @ wanted)[None, :]
    determinant = powers[0] * powers[1] - cross**2
    apart = determinant > _APART * powers[0] * powers[1]
    determinant = np.where(apart, determinant, 1.0)
    sizes = (
        (alike[0] * powers[1] - alike[1] * cross) / determinant,
        (alike[1] * powers[0] - alike[0] * cross) / determinant,
    )
    usable = apart & (one.signs[:, None] * sizes[0] >= 0) & (other.signs[None, :] * sizes[1] >= 0)
    gain = np.where(usable, sizes[0] * alike[0] + sizes[1] * alike[1], 0.0)
    k, m = np.unravel_index(np.argmax(gain), gain.shape)
    return int(k), int(m), (float(sizes[0][k, m]), float(sizes[1][k, m])), float(gain[k, m])
