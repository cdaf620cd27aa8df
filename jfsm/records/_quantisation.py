"""The step of a digitised channel."""

import numpy as np
from numpy.typing import NDArray

MAX_LEVELS = 0.5  # distinct values per sample above which a channel is not called quantised


def quantisation_step(y: NDArray[np.float64]) -> float:
    """Distance between neighbouring levels of a quantised channel, 0 for a continuous one.

    A channel is quantised when it takes few distinct values, all of them whole steps apart.

    Parameters
    ----------
    y : (n,) float array

    Returns
    -------
    step : float
        In the unit of `y`.
    """
    levels = np.unique(y)
    if levels.size < 3 or levels.size > MAX_LEVELS * y.size:
        return 0.0
    gaps = np.diff(levels)
    extent = levels[-1] - levels[0]
    gaps = gaps[gaps > 1e-9 * extent]  # the same level, rounded differently by a conversion of units
    if gaps.size == 0:
        return 0.0
    step = float(np.median(gaps[gaps <= 1.5 * gaps.min()]))
    counts = gaps / step
    return step if np.all(np.abs(counts - np.round(counts)) < 0.1) else 0.0
