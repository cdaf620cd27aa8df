"""Normal noise that a few jumps widen: its core."""

import numpy as np
from numpy.typing import NDArray

# The second moment of a standard normal variable confined to |z| < 2, by which the core of a sample is read.
CORE = 2.0
CORE_VARIANCE = 0.7737413035


def core_std(sample: NDArray[np.float64], stretches: int = 1) -> float:
    """Standard deviation of the normal core of a zero-mean sample, whatever lies in its tails; the widest of so many
    stretches."""
    return max(_core_of(np.abs(stretch)) for stretch in np.array_split(sample, stretches))


def _core_of(size: NDArray[np.float64]) -> float:
    std = float(np.quantile(size, 0.3)) / 0.3853  # 30 % of a normal sample lie within 0.3853 standard deviations
    for _ in range(20):
        core = size[size <= CORE * std]
        if core.size == 0 or std == 0:
            return std
        before, std = std, float(np.sqrt(np.mean(core**2) / CORE_VARIANCE))
        if std == before:  # the same core again
            break
    return std
