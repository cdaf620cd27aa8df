"""The spectrum of a channel."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jfsm.records._tapers import SHORTEST_PIECE, Pieces, Samples

PIECES = 8


@dataclass(frozen=True)
class Spectrum:
    """Power of a channel by frequency.

    Attributes
    ----------
    channel : str
    frequency : (m,) float array
        Up to the band limit [Hz], without those next to 0 that a constant reaches.
    density : (m,) float array
        One-sided power spectral density, in the channel's unit² per Hz.
    """

    channel: str
    frequency: NDArray[np.float64]
    density: NDArray[np.float64]


def spectrum(channel: str, y: Samples, dt: float) -> Spectrum | None:
    """Power of `y` (n,), sampled every `dt` seconds, averaged over eight pieces; None if they would be too short."""
    length = 2 * y.size // (PIECES + 1)
    if length < SHORTEST_PIECE:
        return None
    pieces = Pieces.of(y.size, length, dt)
    power = np.mean(np.abs(pieces.spectra(y - y.mean())) ** 2, axis=0)
    return Spectrum(channel, pieces.omega[3:] / (2.0 * np.pi), pieces.density(power)[3:])
