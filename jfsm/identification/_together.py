"""Two laws placed at once: pairs that together explain most of a missing force.

Laws that hide each other explain little alone, and what one of them leaves by itself misleads. So every shape of one is
regressed beside every shape of the other, which takes no more than their inner products.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Shaped

from ..estimation import Latent
from ..structures import AbstractTerm, Scale, Structure
from ._nuisances import Nuisances
from ._regression import CORRELATED, Regression, of_size, one_sign
from ._starts import shapes_of

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
    """Forces of a law along its link, and which signs their sizes may have: 0 is either."""

    regression: Regression
    rows: list[dict[str, float]]
    forces: Float[np.ndarray, "shapes samples"]
    signs: Shaped[np.ndarray, " shapes"]

    @property
    def law(self) -> AbstractTerm:
        return self.regression.law

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
    for i, (law, sign) in enumerate(zip(laws, signs, strict=True)):
        regression = Regression.of(law, latent, structure, nuisances, ())
        if regression is None:
            return []
        every = -(-regression.missing.size // _ENOUGH)
        forces, rows = regression.columns(shapes_of(law, scale, sides=True))
        if rows and not regression.linear(forces):
            shapes[i] = _Shapes(regression.every(every), rows, forces[:, ::every], _signs(law, rows, sign))
    pairs = [pair for pair in pairs if shapes.keys() >= set(pair)]
    found = _explaining(shapes, pairs)
    if not found:
        return []
    # What else may be off is not so far off that it would take the place of a law: as for laws placed by themselves.
    some = next(iter(shapes.values())).regression
    rest = max(1.0 - max(one.share for one in found), 1e-12) * float(np.mean(some.wanted**2))
    ridge = np.sqrt(CORRELATED / every * rest) / some.doubt
    doubted = {i: one._replace(regression=replace(one.regression, ridge=ridge)) for i, one in shapes.items()}
    return sorted(_explaining(doubted, pairs), key=lambda one: -one.share)


def _signs(law: AbstractTerm, rows: list[dict[str, float]], sign: int) -> np.ndarray:
    """Signs that the size of each shape must have."""
    kind = type(law)
    if one_sign(kind):
        return np.array([0 if kind.opposite(row) else 1 for row in rows])
    return np.array([sign * np.sign(next(iter(row.values()))) for row in rows])


class _Outside(NamedTuple):
    """Forces of a law and their inner products outside of what else may be off: what of them that makes, their powers,
    and their products with the missing force."""

    shapes: _Shapes
    taken: Float[np.ndarray, "shapes told"]
    power: Float[np.ndarray, " shapes"]
    wanted: Float[np.ndarray, " shapes"]


def _explaining(shapes: dict[int, _Shapes], pairs: Sequence[tuple[int, int]]) -> list[PlacedTogether]:
    if not pairs:
        return []
    some = next(iter(shapes.values())).regression
    outside, (total, missing) = some.outside, some.missing_outside
    beside = {i: _outside(one, outside, missing) for i, one in shapes.items()}
    found = []
    for pair in pairs:
        one, other = (beside[i] for i in pair)
        k, m, sizes, gain = _best(one, other)
        if gain > 0:
            terms = one.shapes.sized(k, sizes[0]), other.shapes.sized(m, sizes[1])
            found.append(PlacedTogether(pair, terms, gain / total))
    return found


def _outside(shapes: _Shapes, outside: np.ndarray, missing: np.ndarray) -> _Outside:
    moments = shapes.regression.moments(shapes.forces)
    taken = moments.off @ outside
    return _Outside(shapes, taken, moments.power - np.sum(taken**2, 1), moments.wanted - taken @ missing)


def _best(one: _Outside, other: _Outside) -> tuple[int, int, tuple[float, float], float]:
    """Which shape of either explains most of what is wanted, with what sizes, and how much of its square."""
    meet = float(one.shapes.regression.along @ other.shapes.regression.along)
    cross = meet * (one.shapes.forces @ other.shapes.forces.T) - one.taken @ other.taken.T
    powers, alike = (one.power[:, None], other.power[None, :]), (one.wanted[:, None], other.wanted[None, :])
    determinant = powers[0] * powers[1] - cross**2
    apart = determinant > _APART * powers[0] * powers[1]
    determinant = np.where(apart, determinant, 1.0)
    sizes = (
        (alike[0] * powers[1] - alike[1] * cross) / determinant,
        (alike[1] * powers[0] - alike[0] * cross) / determinant,
    )
    usable = apart & (one.shapes.signs[:, None] * sizes[0] >= 0) & (other.shapes.signs[None, :] * sizes[1] >= 0)
    gain = np.where(usable, sizes[0] * alike[0] + sizes[1] * alike[1], 0.0)
    k, m = np.unravel_index(np.argmax(gain), gain.shape)
    return int(k), int(m), (float(sizes[0][k, m]), float(sizes[1][k, m])), float(gain[k, m])
