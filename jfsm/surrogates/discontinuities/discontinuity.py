"""A line as it is told: with its interval, in the units of the readings."""

import math
from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy.typing import NDArray

from .line import Kind, Line, all_but
from .places import last_below, profile, refined_kink
from .regression import Regression, variance

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
    """95 % interval of `offset`."""
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
    narrow = BLURS[1] * regression.resolution if line.kind == "jump" else 0.0
    # a jump that is sharp to the readings is moved as if blurred a little: a step has no derivative by its place
    moving = np.concatenate([columns, line.shift(regression.s, width or narrow)], axis=1)
    moved, shares, freed = regression.residual(moving, size)
    unexplained = moved if line.kind == "kink" or width else residual
    half = math.sqrt(variance(unexplained, freed, -1) * regression.n / looks) / abs(float(shares[lead]))
    low, high = line.offset - QUANTILE_95 * half, line.offset + QUANTILE_95 * half
    if line.kind == "jump" and not width:
        places, squares = profile(regression, line, others)
        likely = places[0.5 * looks * np.log(squares / squares.min()) < 0.5 * QUANTILE_95**2]
        low, high = min(low, last_below(regression, line, float(likely[0]))), max(high, float(likely[-1]))
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
