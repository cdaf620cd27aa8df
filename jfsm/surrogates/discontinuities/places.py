"""The best place of each line while the others stay."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .line import Line, all_but
from .regression import Regression

CANDIDATES = 49
"""Places tried along each direction before the best is refined."""
INNER = 0.1
"""Share of the readings and of the range at either end where no line is looked for: little lies beyond it, and noise
in the states bends every map there."""
SWEEPS = 4


def settled(regression: Regression, lines: list[Line]) -> list[Line]:
    """The same lines, each moved to its best place while the others stay."""
    for _ in range(SWEEPS):
        before = [line.offset for line in lines]
        for k, line in enumerate(lines):
            refined = refined_kink if line.kind == "kink" else refined_jump
            lines[k] = refined(regression, line, regression.columns(all_but(lines, k)))
        if np.allclose(before, [line.offset for line in lines], rtol=0.0, atol=1e-12):
            break
    return lines


def refined_kink(regression: Regression, line: Line, others: NDArray, width: float = 0.0, steps: int = 12) -> Line:
    """Linearised in the offset: a column for the shift beside the line, whose share moves the offset."""
    columns = regression.beside(others, line, width)
    size = regression.best_size(columns)
    row = int(np.argmax(regression.sizes == size))
    least = regression.squares(columns)[row]
    for _ in range(steps):
        shifted = np.concatenate([columns, line.shift(regression.s, width)], axis=1)
        _, coefficients, _ = regression.residual(shifted, size)
        slope = coefficients[others.shape[1]]
        if slope == 0.0:
            break
        move = float(np.clip(-coefficients[-1] / slope, -0.1, 0.1))
        for _ in range(3):
            moved = replace(line, offset=line.offset + move)
            columns = regression.beside(others, moved, width)
            squares = regression.squares(columns)[row] if abs(moved.offset) < 1.0 - 2.0 * INNER else math.inf
            if squares < least:
                break
            move /= 3.0
        else:
            break
        line, least = moved, squares
        if abs(move) < 1e-13:
            break
    return line


def refined_jump(regression: Regression, line: Line, others: NDArray) -> Line:
    """The step lies between two neighbouring readings: at the middle of the gap with the least sum of squares."""
    size = regression.best_size(regression.beside(others, line))
    q = np.linalg.qr(np.concatenate([regression.q[:, :size], others], axis=1))[0]
    rest = regression.force - q @ (q.T @ regression.force)
    # sums over all readings from each upwards, for step and hinge: no column for every place
    s = regression.s[line.direction] - line.offset
    order = np.argsort(-s)
    s, rows = s[order], np.concatenate([q, rest[:, None]], axis=1)[order]
    flat, rising = np.cumsum(rows, axis=0), np.cumsum(s[:, None] * rows, axis=0)
    count, first, second = np.arange(1.0, regression.n + 1.0), np.cumsum(s), np.cumsum(s**2)
    near = np.flatnonzero((s[1:] < s[:-1]) & (np.abs(s[:-1]) < max(2.0 / CANDIDATES, regression.resolution)))
    if not near.size:
        return line
    u, step = s[near], flat[near]
    hinge = rising[near] - u[:, None] * step
    aa = count[near] - np.sum(step[:, :-1] ** 2, axis=1)
    ab = first[near] - u * count[near] - np.sum(step[:, :-1] * hinge[:, :-1], axis=1)
    bb = second[near] - 2.0 * u * first[near] + u**2 * count[near] - np.sum(hinge[:, :-1] ** 2, axis=1)
    slope = _ratio(hinge[:, -1], bb)
    jump = step[:, -1] - slope * ab
    gained = slope * hinge[:, -1] + _ratio(jump, aa - _ratio(ab, bb) * ab) * jump
    best = near[np.argmax(gained)]
    return replace(line, offset=line.offset + float(s[best] + s[best + 1]) / 2.0)


def _ratio(part: NDArray, whole: NDArray) -> NDArray:
    """Share of a column that is left; none of one that the others hold."""
    sound = whole > 0.0
    return np.where(sound, part / np.where(sound, whole, 1.0), 0.0)
