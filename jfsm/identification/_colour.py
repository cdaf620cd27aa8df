"""Noise with a memory, and how much of the force is noise: what a record is taken to hold of both."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import equinox as eqx
import numpy as np
from jaxtyping import Float
from scipy.special import expit

from .._types import Array
from ..estimation._filter import ProcessNoise, Readings

_BEGIN = 1.5
"""Logit of a memory, and of its share, from which both climb."""
_MEMORIES, _SHARES, _WITHIN = (-3.0, 7.0), (-6.0, 5.0), 8.0
"""Reach of their logits, and how far the logarithm of a variance goes from where it begins."""


class Colour(eqx.Module):
    """Memory of the noise of some channels.

    Of the `variance` of a channel's noise a `share` has the correlation `memory` from sample to sample, each
    (coloured,); the noise of the force has `louder` times the variance that it was taken to have.
    """

    channels: tuple[int, ...] = eqx.field(static=True)
    memory: Float[Array, " coloured"]
    share: Float[Array, " coloured"]
    variance: Float[Array, " coloured"]
    louder: Float[Array, ""]

    @classmethod
    def of(cls, values: Float[np.ndarray, " values"], channels: Sequence[int]) -> "Colour":
        """Colour by its logits and logarithms, those of all channels one after the other."""
        memory, share, variance = values[:-1].reshape(3, len(channels))
        numbers: list[Any] = [expit(memory), expit(share), np.exp(variance), np.exp(values[-1])]
        return cls(tuple(channels), *numbers)

    @staticmethod
    def begin(variance: Float[np.ndarray, " coloured"]) -> Float[np.ndarray, " values"]:
        """Values from which noise of this variance (coloured,) climbs."""
        return np.concatenate([np.full(2 * variance.size, _BEGIN), np.log(variance), [0.0]])

    @staticmethod
    def reach(begin: Float[np.ndarray, " values"], loudest: float) -> list[tuple[float, float]]:
        """Bounds of the values from there; the noise of the force is up to `loudest` times as strong."""
        count, far = begin.size // 3, begin[2 * (begin.size // 3) : -1, None] + np.array([-_WITHIN, _WITHIN])
        return [*[_MEMORIES] * count, *[_SHARES] * count, *map(tuple, far.tolist()), (0.0, float(np.log(loudest)))]

    def on(self, readings: Readings) -> Readings:
        """Readings whose noise has this colour."""
        variance = np.array(readings.variance)
        variance[list(self.channels)] = self.variance
        colour = np.stack([self.memory, self.share], 1)
        return replace(readings, variance=variance, colour=colour, coloured=self.channels)

    def of_force(self, noise: ProcessNoise) -> ProcessNoise:
        """Noise of the force, as loud as this."""
        return ProcessNoise(noise.velocity * self.louder)
