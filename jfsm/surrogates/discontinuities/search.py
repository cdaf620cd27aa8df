"""Candidates for lines, added one at a time at the best of many places."""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from .line import Kind, Line, step_and_hinge
from .places import CANDIDATES, INNER, settled
from .regression import Regression

MOST = 4
"""Lines at most."""
WORTH_A_TRY = 5.0
"""Gain in log-likelihood beyond its price from which a candidate is examined further."""


def lines_of(regression: Regression) -> list[Line]:
    """Candidates, added while one is worth a try."""
    found: list[Line] = []
    while len(found) < MOST:
        line, gain = best_addition(regression, found)
        if line is None or gain < WORTH_A_TRY:
            break
        moved = settled(regression, [*found, line])
        if crowded(moved, 2.0 * regression.resolution):  # what is left of a line that noise in the states has blurred
            break
        found = moved
    return found


def crowded(lines: Sequence[Line], apart: float) -> bool:
    """Whether two lines of one direction lie nearer than the width that counts as sharp."""
    return any(a.direction == b.direction and abs(a.offset - b.offset) < apart for a, b in combinations(lines, 2))


def best_addition(regression: Regression, lines: Sequence[Line]) -> tuple[Line | None, float]:
    """The single column that gains most, over directions, kinds, places and polynomial orders."""
    force, fixed = regression.force, regression.columns(lines)
    q = np.linalg.qr(np.concatenate([fixed, regression.q], axis=1))[0]
    load, rows = q.T @ force, fixed.shape[1] + regression.sizes - 1
    price = sum(line.price for line in lines)
    before = regression.score(fixed, price, regression.n)
    best, best_gain = None, -math.inf
    kinds: tuple[Kind, Kind] = ("jump", "kink")
    for direction in map(int, regression.directions):
        taken = np.array([line.offset for line in lines if line.direction == direction])
        places = candidates(regression, direction)
        places = places[np.all(np.abs(places[:, None] - taken) > 2.0 * regression.resolution, axis=1)]
        if not places.size:
            continue
        u = regression.s[direction][:, None] - places[None, :]
        for kind, columns in zip(kinds, step_and_hinge(u), strict=True):
            shadow = q.T @ columns
            own = np.sum(columns**2, axis=0)[None, :] - np.cumsum(shadow**2, axis=0)[rows]
            along = (columns.T @ force)[None, :] - np.cumsum(shadow * load[:, None], axis=0)[rows]
            left = force @ force - np.cumsum(load**2)[rows][:, None]
            sound = own > 1e-9 * np.sum(columns**2, axis=0)[None, :]
            gained = np.where(sound, along**2 / np.where(sound, own, 1.0), 0.0)
            squares = np.maximum(left - gained, regression.rounding)
            line = Line(kind, direction, 0.0)
            score = np.min(regression.scores(squares.T, price + line.price, regression.n), axis=1)
            place = int(np.argmin(score))
            gain = before - float(score[place])
            if gain > best_gain:
                best, best_gain = replace(line, offset=float(places[place])), gain
    return best, best_gain


def candidates(regression: Regression, direction: int) -> NDArray:
    """Places along a direction where a line is looked for: evenly spread over the readings and over the range."""
    s = np.sort(regression.s[direction])
    inner = np.linspace(INNER, 1.0 - INNER, CANDIDATES)
    grid = np.unique(np.concatenate([np.quantile(s, inner), 2.0 * inner - 1.0]))
    end = int(INNER * regression.n)
    low, high = max(s[end], 2.0 * INNER - 1.0), min(s[-end], 1.0 - 2.0 * INNER)
    return grid[(grid >= low) & (grid <= high)]
