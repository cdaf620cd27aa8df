"""How good a run is, from another of the same motion that was made more coarsely."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

PARTED = 0.1
"""Difference of two runs, in standard deviations of the motion, from which on they are two motions."""
_NOTHING = 1e-9
"""Share of what a motion could be below which it is rounding: a mass that friction holds does not part from itself."""


class Agreement(NamedTuple):
    """Estimated largest error of the displacement of each degree of freedom, and the first sample where runs part."""

    error: Float[np.ndarray, " dof"]
    parted: int | None

    def within(self, share: float, x: Float[np.ndarray, "n dof"], usual: float) -> bool:
        """Whether the error is at most a share of every degree of freedom's motion `x`."""
        return bool(np.all(self.error <= share * _spread(x, usual)))


def agreement(
    x: Float[np.ndarray, "n dof"], coarse: Float[np.ndarray, "n dof"], share: float, usual: float
) -> Agreement:
    """Agreement of a run with a coarser one.

    Parameters
    ----------
    x, coarse : (n, dof) arrays
        Displacements [m] of both runs. The coarser one need not be finite.
    share : float
        Error of the better run over the difference of both while they are close.
    usual : float
        Displacement [m] that is usual for what drives.

    Notes
    -----
    Where a motion is sensitive a difference grows until it is as large as the motion. From there on the error of the
    better run is not a share of it any more: it is the difference itself.
    """
    if not x.size:
        return Agreement(np.zeros(x.shape[1]), None)
    gap = np.abs(x - coarse)
    gap = np.where(np.isfinite(gap), gap, np.maximum(np.ptp(x, axis=0), _spread(x, usual)))
    apart = np.any(gap > PARTED * _spread(x, usual), axis=1)
    first = int(np.argmax(apart)) if np.any(apart) else len(x)
    error = np.max(np.where(np.arange(len(x))[:, None] < first, share * gap, gap), axis=0)
    return Agreement(error, first if first < len(x) else None)


def _spread(x: np.ndarray, usual: float) -> np.ndarray:
    return np.maximum(np.std(x, axis=0), _NOTHING * max(usual, 1e-300))
