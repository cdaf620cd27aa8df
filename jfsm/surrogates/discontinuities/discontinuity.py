"""A line as it is told: with its interval, in the units of the readings."""

import math
from collections.abc import Sequence
from dataclasses import replace

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy.typing import NDArray

from .line import Kind, Line, all_but
from .places import refined_kink
from .regression import Regression, variance
from .sides import sides

QUANTILE_95 = 1.959964
BLURS = 2.0 ** np.arange(-4, 1)
"""Transitions that pass for a jump blurred by noise in the states, in units of `resolution`."""


class Discontinuity(eqx.Module):
    """A point, line or plane ``normal · state = offset`` across which the force jumps or kinks.

    As a function of a state it is an interface for ``RKPM.fit(..., across=...)``.
    """

    kind: Kind = eqx.field(static=True)
    normal: Float[Array, " dim"]
    offset: Float[Array, ""]
    low: Float[Array, ""]
    high: Float[Array, ""]
    """95 % interval of `offset`; of a jump it ends at readings, and is the gap between two of them without noise."""
    size: Float[Array, ""]
    """Jump of the force, or change of its slope per unit of ``normal · state``, towards higher values."""
    size_error: Float[Array, ""]
    """Standard error of `size`."""
    confidence: Float[Array, ""]
    """Probability of a line here, against a smooth force and against a transition wider than the resolution."""

    def __call__(self, state: Float[Array, " dim"]) -> Float[Array, ""]:
        return self.normal @ state - self.offset


def described(regression: Regression, lines: Sequence[Line], k: int) -> Discontinuity:
    """Line k with its interval, the size of what happens there, and its error."""
    line, others = lines[k], regression.columns(all_but(lines, k))
    columns, lead = regression.beside(others, line), others.shape[1]
    size = regression.best_size(columns)
    looks = regression.looks(regression.residual(columns, size)[0])
    line, width = blurred(regression, line, others, looks)
    columns = regression.beside(others, line, width)
    residual, coefficients, freed = regression.residual(columns, size)
    error = math.sqrt(variance(residual, freed, lead) * regression.n / looks)
    if line.kind == "jump":
        step = coefficients[lead] * columns[:, lead]
        place, low, high = sides(regression, line, residual + step, float(coefficients[lead]))
        line = replace(line, offset=place)
    else:
        moving = np.concatenate([columns, line.shift(regression.s)], axis=1)
        moved, shares, freed = regression.residual(moving, size)
        deviation = math.sqrt(variance(moved, freed, -1) * regression.n / looks)
        # and the step that the search still had to go, where sums of squares were at their rounding
        half = (QUANTILE_95 * deviation + abs(float(shares[-1]))) / abs(float(shares[lead]))
        low, high = line.offset - half, line.offset + half
    middle, reach = regression.middle[line.direction], regression.half[line.direction]
    per_unit = regression.unit / (1.0 if line.kind == "jump" else reach)
    numbers = (
        regression.normals[line.direction],
        *(middle + reach * place for place in (line.offset, low, high)),
        coefficients[lead] * per_unit,
        error * per_unit,
        line.confidence,
    )
    return Discontinuity(line.kind, *map(jnp.asarray, numbers))


def blurred(regression: Regression, line: Line, others: NDArray, looks: float) -> tuple[Line, float]:
    """A jump as noise in the states shows it: the width within the resolution that fits best, 0 if none does."""
    least, best = regression.score(regression.beside(others, line), line.price, looks), (line, 0.0)
    for width in BLURS * regression.resolution if line.kind == "jump" else ():
        moved = refined_kink(regression, line, others, width)
        score = regression.score(regression.beside(others, moved, width), line.price + 1.0, looks)
        if score < least:
            least, best = score, (moved, width)
    return best
