"""Noise over frequency, where no signal covers it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jfsm.records._noise_floor import NoiseFloor
from jfsm.records._tapers import SHORTEST_PIECE, Pieces

PIECE, PIECES = 256, 8  # samples in a piece at most, and pieces at least
ABOVE = 1.4  # times the band limit of the smooth curve: from here on it takes nothing from the noise
BANDS = 4
COLOURED = 2.0  # ratio of densities between bands from which on noise is not called white


@dataclass(frozen=True)
class NoiseSpectrum:
    """Density of a channel's noise.

    Attributes
    ----------
    channel : str
    frequency : (m,) float array
        Above the signal, up to the band limit [Hz].
    density : (m,) float array
        One-sided power spectral density, in the channel's unit² per Hz; white noise has 2 std² dt.
    """

    channel: str
    frequency: NDArray[np.float64]
    density: NDArray[np.float64]

    def bands(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Centre [Hz] and mean density of four equal bands."""
        parts = zip(np.array_split(self.frequency, BANDS), np.array_split(self.density, BANDS), strict=True)
        centre, density = zip(*((frequency.mean(), density.mean()) for frequency, density in parts), strict=True)
        return np.array(centre), np.array(density)

    @property
    def coloured(self) -> bool:
        """Whether its density differs between bands by more than a factor of two."""
        _, density = self.bands()
        return bool(density.max() > COLOURED * density.min())


def noise_spectrum(channel: str, y: NDArray[np.float64], floor: NoiseFloor) -> NoiseSpectrum | None:
    """What the smooth curve of `floor` leaves of `y` (n,), by frequency; None where too few frequencies are left.

    The median over pieces is taken, so that jumps and spikes count as what they are: rare.
    """
    length = min(PIECE, 2 * y.size // (PIECES + 1))
    if length < SHORTEST_PIECE:
        return None
    pieces = Pieces.of(y.size, length, floor.dt)
    frequency = pieces.omega / (2.0 * np.pi)
    free = frequency > (0.0 if floor.silent else ABOVE / (2.0 * floor.spacing * floor.dt))
    free[:3] = free[-3:] = False
    if np.count_nonzero(free) < 2 * BANDS:
        return None
    # The median of the squared modulus of a complex normal number is its mean times ln 2.
    power = np.median(np.abs(pieces.spectra(y - floor.smooth)) ** 2, axis=0) / np.log(2.0)
    return NoiseSpectrum(channel, frequency[free], pieces.density(power)[free])
