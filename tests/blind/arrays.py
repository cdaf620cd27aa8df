"""The one kind of array used here."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]


def rms(y: FloatArray) -> float:
    """Root of the mean square, in the unit of y (n,)."""
    return float(np.sqrt(np.mean(np.square(y))))
