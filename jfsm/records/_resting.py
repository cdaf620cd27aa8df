"""Noise of a channel whose signal rests for much of the time: a force that is held, steps, blows."""

import numpy as np
from numpy.typing import NDArray

from jfsm.records._core import core_std

_JUMPS = 0.5
"""Core of the differences, at most, as a share of their standard deviation: the rest is the signal's."""
_AGREE = 0.15
"""Relative difference, at most, of what first and second differences tell: those of white noise tell the same."""


def resting_std(y: NDArray[np.float64]) -> float | None:
    """Standard deviation of the white noise of a channel (n,) that is constant for two samples or more, and then jumps.

    None where differences of neighbours do not say so.
    """
    first, second = np.diff(y), np.diff(y, 2)
    core = core_std(first)
    # Differences of white noise of variance one have the variances 2 and 6.
    once, twice = core / np.sqrt(2.0), core_std(second) / np.sqrt(6.0)
    rests = core < _JUMPS * np.std(first) and abs(twice - once) < _AGREE * once
    return float(once) if rests else None
