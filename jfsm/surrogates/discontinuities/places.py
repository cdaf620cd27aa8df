"""The best place of each line while the others stay."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .line import Line, all_but, step_and_hinge
from .regression import Regression

CANDIDATES = 49
"""Places tried along each direction before the best is refined."""
INNER = 0.1
"""Share of the readings and of the range at either end where no line is looked for: little lies beyond it, and noise
in the states bends every map there."""
MOST_GAPS = 200
"""Places of a jump that are compared around the best candidate."""
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
    """The step lies between two neighbouring readings: at the middle of the best gap."""
    places, squares = profile(regression, line, others)
    place = float(places[np.argmin(squares)])
    return replace(line, offset=(last_below(regression, line, place) + place) / 2.0)


def profile(regression: Regression, line: Line, others: NDArray) -> tuple[NDArray, NDArray]:
    """Places of a step with a change of slope, and the sum of squares at each."""
    places = gaps(regression, line)
    size = regression.best_size(regression.beside(others, line))
    q = np.linalg.qr(np.concatenate([regression.q[:, :size], others], axis=1))[0]
    rest = regression.force - q @ (q.T @ regression.force)
    u = regression.s[line.direction][:, None] - places[None, :]
    step, hinge = (c - q @ (q.T @ c) for c in step_and_hinge(u))
    aa, ab, bb = (np.sum(p * q, axis=0) for p, q in ((step, step), (step, hinge), (hinge, hinge)))
    a, b = rest @ step, rest @ hinge
    slope = np.where(bb > 0.0, b / np.where(bb > 0.0, bb, 1.0), 0.0)
    own = aa - np.where(bb > 0.0, ab**2 / np.where(bb > 0.0, bb, 1.0), 0.0)
    jump = np.where(own > 0.0, (a - slope * ab) ** 2 / np.where(own > 0.0, own, 1.0), 0.0)
    return places, np.maximum(rest @ rest - slope * b - jump, regression.rounding)


def gaps(regression: Regression, line: Line) -> NDArray:
    """Values along the line's normal at which a step changes, within the reach of one candidate's spacing."""
    values = np.unique(regression.s[line.direction])
    near = values[np.abs(values - line.offset) < max(2.0 / CANDIDATES, regression.resolution)]
    return near if near.size <= MOST_GAPS else near[:: near.size // MOST_GAPS + 1]


def last_below(regression: Regression, line: Line, place: float) -> float:
    """The last reading below a place along the line's normal; the place itself if there is none."""
    values = regression.s[line.direction]
    below = values[values < place]
    return float(below.max()) if below.size else place
