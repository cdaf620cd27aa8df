"""Error of a hypothesis' multi-step prediction, beside what noise explains of it."""

import math
from dataclasses import dataclass, replace

import numpy as np

from ..thresholds import THRESHOLDS

_LOST = 0.05
"""Share of a baseline's error that noise may leave of a prediction, whatever its filter says."""


@dataclass(frozen=True)
class Prediction:
    """Free prediction over some periods, in units of each channel's spread, squared and summed over channels.

    `error` is what was seen, `expected` what noise alone would leave, `scatter` the standard deviation of that; all per
    set of samples (training, held out, ...).
    """

    error: np.ndarray
    expected: np.ndarray
    scatter: np.ndarray

    @property
    def excess(self) -> np.ndarray:
        """Power beyond noise, per set."""
        return np.maximum(self.error - self.expected, 0.0)

    def beyond(self, chance: float = THRESHOLDS.chance) -> np.ndarray:
        """Power beyond noise and `chance` standard deviations of it, per set."""
        return np.maximum(self.error - self.expected - chance * self.scatter, 0.0)

    @property
    def power(self) -> float:
        """Error power over all sets, in those of the signal."""
        return float(np.sum(self.error))

    def left(self, chance: float = THRESHOLDS.chance) -> float:
        """What is left beyond noise and chance, as a share of the signal; of the worst set."""
        return math.sqrt(float(np.max(self.beyond(chance))))

    def bounded_by(self, baseline: "Prediction") -> "Prediction":
        """The same, with no more left to noise than twice what it leaves of a baseline, or a share of that one's error.

        A filter that reports no knowledge of the motion, as where a law's slope has no bounds, predicts nothing.
        """
        most = np.maximum(2 * baseline.expected, _LOST * baseline.error)
        return Prediction(self.error, np.minimum(self.expected, most), np.minimum(self.scatter, most))

    def at_floor(self, least: np.ndarray) -> "Prediction":
        """The same, with no more left to noise than `least`, what it left of the best hypothesis per set.

        Noise is common to all hypotheses.
        """
        return Prediction(self.error, np.minimum(self.expected, least), np.minimum(self.scatter, least))

    def with_noise(self, power: np.ndarray) -> "Prediction":
        """The same, with so much more noise expected per set."""
        return replace(self, expected=self.expected + power)
