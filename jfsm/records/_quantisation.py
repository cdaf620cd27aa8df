"""The step of a digitised channel."""

import numpy as np
from numpy.typing import NDArray

SAME = 1e-9  # share of the extent by which one level may differ from itself: a conversion of units rounds
WHOLE = 0.1  # of a step, by which distances between levels may miss whole steps
NEAR = 20.5  # steps; over larger distances the error of the step adds up
FEWEST = 8  # levels met again, and distances up to NEAR: a continuous channel hardly meets one value twice


def quantisation_step(y: NDArray[np.float64]) -> float:
    """Distance between neighbouring levels of a quantised channel, 0 for a continuous one.

    A channel is quantised when it comes back to the same values, all of them whole steps apart.

    Parameters
    ----------
    y : (n,) float array

    Returns
    -------
    step : float
        In the unit of `y`.
    """
    levels, counts = np.unique(y, return_counts=True)
    if levels.size < 3 or np.count_nonzero(counts > 1) < min(FEWEST, levels.size - 2):
        return 0.0
    gaps = np.diff(levels)
    gaps = gaps[gaps > SAME * np.ptp(levels)]
    if gaps.size == 0:
        return 0.0
    step = float(np.median(gaps[gaps <= 1.5 * gaps.min()]))
    near = gaps[gaps < NEAR * step] / step
    steps = near if near.size >= FEWEST else gaps / step
    return step if np.all(np.abs(steps - np.round(steps)) < WHOLE) else 0.0
