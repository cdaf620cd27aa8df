"""Noise where a signal reaches too far up for a spline, but not to the top: the flat end of its spectrum."""

import numpy as np
from numpy.typing import NDArray
from scipy.signal import firwin, oaconvolve

from jfsm.records._core import core_std

BANDS = 10
"""Where a signal reaches into all but one of them, that one still shows the noise."""
_BESIDE = 1.5
"""Lines of a tapered spectrum that tell as much as one."""
_FEWEST = 20
"""Lines that tell, of a band, at least."""
_SIGNIFICANT = 3.5
"""Standard errors by which bands may differ that hold the same noise."""
_CLIFF = 10.0
"""Ratio of power, at least, by which a signal ends above that end: what falls slowly goes on falling."""
_ALIKE = 0.85
"""Standard deviation of the core of noise, at least, as a share of the whole: else there are jumps in it."""
_TAPS, _EDGE = 61, 0.12
"""Of the filter beside which noise is looked at in time: 60 dB below the edge, whose width is relative to the band."""


def spectrum_by_band(y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Power of a channel (n,) in ten equal bands up to the band limit; of white noise, its variance in each."""
    taper = np.hanning(y.size)
    power = np.abs(np.fft.rfft(taper * (y - y.mean()))) ** 2 / (taper @ taper)
    return np.array([band.mean() for band in np.array_split(power, min(BANDS, power.size))])


def flat_top_std(y: NDArray[np.float64]) -> float | None:
    """Standard deviation of the white noise of a channel (n,) beyond whose signal there are bands of nothing else.

    None unless two bands or more at the top hold the same, a signal ends steeply below them, and what they hold is the
    same all along: jumps and kinks have flat ends as well.
    """
    lines = y.size / (2 * BANDS * _BESIDE)
    if lines < _FEWEST:
        return None
    band, apart = spectrum_by_band(y), _SIGNIFICANT / np.sqrt(lines)
    for begin in range(1, BANDS - 1):
        level = band[begin:].mean()
        if np.all(np.abs(band[begin:] - level) < apart * level):
            break
    else:
        return None
    if band[max(begin - 2, 0) : begin].max() < _CLIFF * level:
        return None
    above = min((begin + 1) / BANDS, 1 - 1 / BANDS)
    rest = oaconvolve(y - y.mean(), firwin(_TAPS, above, width=_EDGE, pass_zero=False), mode="valid")
    return float(np.sqrt(level)) if core_std(rest) > _ALIKE * np.std(rest) else None
