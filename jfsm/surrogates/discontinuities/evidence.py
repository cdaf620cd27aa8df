"""The lines that stand against every rival: a smooth force, and a transition wider than a line."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .line import Line, all_but
from .places import refined_kink, settled
from .regression import Regression, variance

WIDTHS = 1.5 * 2.0 ** np.arange(5)
"""Smooth transitions that rival a line, in units of `resolution`."""


def weeded(regression: Regression, lines: list[Line], least: float) -> list[Line]:
    """The lines whose confidence is `least` or more; the weakest goes first, and the others are weighed anew."""
    while lines:
        weighed = [replace(line, confidence=confidence(regression, lines, k)) for k, line in enumerate(lines)]
        weakest = int(np.argmin([line.confidence for line in weighed]))
        if weighed[weakest].confidence >= least:
            return weighed
        lines = settled(regression, all_but(lines, weakest))
    return []


def confidence(regression: Regression, lines: Sequence[Line], k: int) -> float:
    """Probability of line k against no line and against smooth transitions."""
    line, others = lines[k], regression.columns(all_but(lines, k))
    columns, lead = regression.beside(others, line), others.shape[1]
    residual, coefficients, freed = regression.residual(columns, regression.best_size(columns))
    looks = regression.looks(residual)
    base = regression.score(columns, line.price, looks)
    without = regression.score(others, 0.0, looks) - base
    robust = 0.5 * coefficients[lead] ** 2 / variance(residual, freed, lead) * looks / regression.n
    none = min(without, robust - 0.5 * line.price * math.log(looks)) - math.log(2.0 * len(regression.directions))
    soft = min(transition(regression, line, others, width, looks) for width in WIDTHS * regression.resolution) - base
    return 1.0 / (1.0 + math.exp(-np.clip(none, -700, 700)) + math.exp(-np.clip(soft, -700, 700)))


def transition(regression: Regression, line: Line, others: NDArray, width: float, looks: float) -> float:
    """Score of the line blurred over a width, at its best place; one more parameter than the line."""
    moved = refined_kink(regression, line, others, width, steps=5)
    return regression.score(regression.beside(others, moved, width), line.price + 1.0, looks)
