"""Where a channel lies when its oscillation is taken away: offset and drift, each with its error."""

from typing import NamedTuple

import numpy as np

from jfsm.records._tapers import Pieces, Samples

NEAR = slice(
    3, 9
)  # lines of the whole record beyond the reach of the taper: what motion there is next to standing still


class Level(NamedTuple):
    """Offset and drift over the whole record, in the channel's unit, with standard errors."""

    offset: float
    offset_error: float
    drift: float
    drift_error: float


def level(y: Samples, dt: float) -> Level:
    """Offset and drift of a channel (n,) sampled every `dt` seconds.

    Notes
    -----
    Both are means under a taper as long as the record, which motion of more than three periods in the record does not
    reach. What the channel has on the next lines, if it goes on as strongly towards frequency 0, is the error.
    """
    whole = Pieces.of(y.size, y.size, dt)
    taper = whole.taper[0]
    place = (np.arange(y.size) - 0.5 * y.size) / y.size
    mean = float(taper @ y / taper.sum())
    slope = float((taper * place) @ (y - mean) / (taper @ place**2))
    rest = y - mean - slope * place
    beside = [np.sqrt(np.mean(np.abs(np.fft.rfft(weight * rest)[NEAR]) ** 2)) for weight in (taper, taper * place)]
    return Level(mean, float(beside[0] / taper.sum()), slope, float(beside[1] / (taper @ place**2)))
