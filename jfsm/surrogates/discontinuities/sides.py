"""The place of a jump by the side of it that every reading shows."""

import numpy as np
from numpy.typing import NDArray

from ..._types import evenly_taken
from .line import Line
from .places import CANDIDATES
from .regression import FLOOR, Regression

AT_ONCE = 200
"""Places that are compared at once; around the likely ones then more finely, to the last gap between two readings."""
WIDTHS = np.append(0.0, 2.0 ** -np.arange(9))
"""Widths over which noise in the states may mix the two sides, in units of `resolution`."""
DROP = 7.35 / 2.0
"""Loss of log-likelihood at the ends of a 95 % interval, where the likelihood falls in steps."""
NORMAL = 0.6745
"""Median of the absolute value of a standard normal number."""
EXACT = 10.0 * FLOOR
"""Residual of readings without noise: that of states would show in it."""


def sides(regression: Regression, line: Line, rest: NDArray, jump: float) -> tuple[float, float, float]:
    """Most likely place of a jump and its 95 % interval, which ends at readings; of exact ones the gap it lies in.

    Parameters
    ----------
    rest : (n,) array
        What the regression leaves without the step.
    jump : float
        Height of the step.

    Notes
    -----
    Reading i lies beyond the place o with probability p = (1 + tanh((s - o)/w))/2, as noise in its state has it, and
    then shows rest - jump, else rest, up to noise of one size. The likelihood is the largest over w. It falls in steps
    from reading to reading where w = 0, and 7.35 is the 95 % quantile of twice its loss there [1]_.

    References
    ----------
    .. [1] B. E. Hansen, Econometrica 68 (2000) 575-603.
    """
    s, reach = regression.s[line.direction], 2.0 * max(1.0 / CANDIDATES, regression.resolution)
    looks = regression.looks(np.where(np.abs(rest - jump) < np.abs(rest), rest - jump, rest))  # each on its better side
    spread = float(np.median(np.abs(rest - jump * (s >= line.offset)))) / NORMAL
    noise, widths = max(spread, FLOOR), WIDTHS * regression.resolution if spread > EXACT else WIDTHS[:1]
    near = np.abs(s - line.offset) < 2.0 * reach
    s, rest = s[near], rest[near]
    below, beyond = -0.5 * (rest / noise) ** 2, -0.5 * ((rest - jump) / noise) ** 2
    values = np.unique(s)
    middle = (values[1:] + values[:-1]) / 2.0
    gaps = np.flatnonzero(np.abs(middle - line.offset) < reach)
    if not gaps.size:
        return line.offset, line.offset - reach, line.offset + reach
    while True:
        some = gaps[evenly_taken(len(gaps), AT_ONCE)]
        likelihood = looks / regression.n * _likelihood(s, below, beyond, middle[some], widths)
        likely = np.flatnonzero(likelihood > likelihood.max() - DROP)
        first, last = some[max(likely[0] - 1, 0)], some[min(likely[-1] + 1, len(some) - 1)]
        finer = gaps[(gaps >= first) & (gaps <= last)]
        if len(some) == len(gaps) or len(finer) == len(gaps):
            low, high = some[likely[0]], some[likely[-1]] + 1
            return float(middle[some[np.argmax(likelihood)]]), float(values[low]), float(values[high])
        gaps = finer


def _likelihood(s: NDArray, below: NDArray, beyond: NDArray, places: NDArray, widths: NDArray) -> NDArray:
    """Logarithm of the likelihood at every place, the largest over the widths."""
    u = s[None, :] - places[:, None]
    found = np.full(len(places), -np.inf)
    for width in widths:
        if width == 0.0:
            total = np.where(u >= 0.0, beyond, below).sum(axis=1)
        else:
            odds = np.clip(2.0 * u / width, -700.0, 700.0)
            total = np.sum(np.logaddexp(below, beyond + odds) - np.logaddexp(0.0, odds), axis=1)
        found = np.maximum(found, total)
    return found
