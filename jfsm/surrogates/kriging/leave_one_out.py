"""Every reading predicted from all the others: is the map right, and are its error bars?"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.stats import norm


@dataclass(frozen=True)
class LeaveOneOut:
    """Prediction of each reading without it, in closed form, hyper-parameters kept.

    Attributes
    ----------
    residual : (n,) or (n, outputs) array
        Reading minus prediction, in the unit of the force.
    std : (n,) or (n, outputs) array
        Standard error of that difference, noise of the reading included.
    """

    residual: Float[np.ndarray, "n *outputs"]
    std: Float[np.ndarray, "n *outputs"]

    @property
    def standardised(self) -> Float[np.ndarray, "n *outputs"]:
        """Residual over its standard error: of unit variance if the error bars are right."""
        return self.residual / self.std

    @property
    def rms(self) -> Float[np.ndarray, "*outputs"] | np.float64:
        """Root mean square of the residual, per output."""
        return np.sqrt(np.mean(self.residual**2, axis=0))

    @property
    def spread(self) -> Float[np.ndarray, "*outputs"] | np.float64:
        """Root mean square of the standardised residuals: above 1 the error bars are too small, below too large."""
        return np.sqrt(np.mean(self.standardised**2, axis=0))

    def coverage(self, level: float = 0.95) -> Float[np.ndarray, "*outputs"] | np.float64:
        """Share of the readings within the interval that should hold a share `level` of them."""
        return np.mean(np.abs(self.standardised) <= norm.ppf(0.5 + level / 2.0), axis=0)
