"""A channel as it was recorded, and which of its samples are no readings."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jfsm.records._defects import clipped, spikes
from jfsm.records._noise_floor import NoiseFloor
from jfsm.records._tapers import Samples


@dataclass(frozen=True)
class Trace:
    """Samples of one channel.

    Attributes
    ----------
    channel, unit : str
    samples : (n,) float array
        In `unit`.
    clipped, spikes : (n,) bool arrays
        Samples at the limit of the recorder, and samples torn out of the curve beside them.
    """

    channel: str
    unit: str
    samples: Samples
    clipped: NDArray[np.bool_]
    spikes: NDArray[np.bool_]

    @classmethod
    def of(cls, channel: str, unit: str, samples: Samples, floor: NoiseFloor | None) -> "Trace":
        """A channel with its defects; without a noise floor nothing is called a spike."""
        torn = np.zeros(samples.size, dtype=bool) if floor is None else spikes(samples, floor.std)
        return cls(channel, unit, samples, clipped(samples, torn), torn)

    @property
    def lost(self) -> NDArray[np.bool_]:
        """(n,) samples that are no readings."""
        return self.clipped | self.spikes
