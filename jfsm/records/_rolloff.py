"""Whether what a channel holds far above its signal falls with frequency, as noise with a memory does."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

_BESIDE = 1.5
"""Lines of a tapered spectrum that tell as much as one."""


class Rolloff(NamedTuple):
    """The upper three quarters of a channel's spectrum.

    `nats` tell how much likelier it is that of a random walk than that of white noise; `walk` is the variance of that
    walk's steps.
    """

    nats: float
    walk: float

    def density(self, phase: float) -> float:
        """Variance of white noise as strong as the walk where a sample takes `phase` [rad]."""
        return self.walk / (2 - 2 * float(np.cos(phase)))


def rolloff(y: ArrayLike) -> Rolloff:
    """How the spectrum of one channel (n,) falls; of a dead one nothing is told.

    Notes
    -----
    Noise with a memory of more than a few samples is a random walk up there, however long that memory is.

    References
    ----------
    P. Whittle, Ark. Mat. 2 (1953) 423 (the likelihood of a spectrum).
    """
    y = np.asarray(y, dtype=np.float64)
    taper = np.hanning(y.size)
    power = np.abs(np.fft.rfft(taper * (y - y.mean()))) ** 2 / (taper @ taper)
    phase = np.linspace(0.0, np.pi, power.size)
    upper = slice(power.size // 4, -1)
    power, shape = power[upper], 1.0 / (2.0 - 2.0 * np.cos(phase[upper]))
    if not np.any(power):
        return Rolloff(0.0, 0.0)
    walk = float(np.mean(power / shape))
    white, walking = np.log(np.mean(power)), np.log(walk) + np.mean(np.log(shape))
    return Rolloff(float(power.size * (white - walking) / _BESIDE), walk)
