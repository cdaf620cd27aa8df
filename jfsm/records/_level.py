"""Where a channel lies when its oscillation is taken away: offset and drift, each with its error."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from jfsm.records._tapers import Pieces, Samples

# Lines of the whole record beyond the reach of the taper: what motion there is next to standing still.
NEAR = slice(3, 9)
EXPLAINED = 0.95  # share of the power on these lines that drives must account for; a strange one rarely does
MOST_DRIVES = 3  # that six lines can tell apart
OFF = 4.0  # standard errors from which on a drive has an offset of its own


class Level(NamedTuple):
    """Offset and drift over the whole record, in the channel's unit, with standard errors."""

    offset: float
    offset_error: float
    drift: float
    drift_error: float


def level(y: Samples, dt: float, drives: Sequence[Samples] = ()) -> Level:
    """Offset and drift of a channel (n,) sampled every `dt` seconds.

    Parameters
    ----------
    y : (n,) float array
    dt : float
    drives : (n,) float arrays, optional
        What pushes a displacement slowly to and fro. Offset and drift are then what they leave unexplained.

    Notes
    -----
    Both are means under a taper as long as the record, which motion of more than three periods in the record does not
    reach. What the channel has on the next lines, if it goes on as strongly towards frequency 0, is the error. Motion
    as slow as that follows its drives without delay. Drives with an offset explain nothing: it may be their sensor's.
    """
    whole = Pieces.of(y.size, y.size, dt)
    taper = whole.taper[0]
    place = (np.arange(y.size) - 0.5 * y.size) / y.size
    widening = 1.0
    if not any(abs(own.offset) > OFF * own.offset_error for own in (level(drive, dt) for drive in drives)):
        y, widening = _without_drives(y, drives, taper)
    mean = float(taper @ y / taper.sum())
    slope = float((taper * place) @ (y - mean) / (taper @ place**2))
    rest = y - mean - slope * place
    beside = [
        widening * np.sqrt(np.mean(np.abs(np.fft.rfft(weight * rest)[NEAR]) ** 2)) for weight in (taper, taper * place)
    ]
    return Level(mean, float(beside[0] / taper.sum()), slope, float(beside[1] / (taper @ place**2)))


def _without_drives(y: Samples, drives: Sequence[Samples], taper: Samples) -> tuple[Samples, float]:
    """`y` less what follows the drives on the slow lines, and the factor by which that widens an error."""
    if not 0 < len(drives) <= MOST_DRIVES:
        return y, 1.0
    slow = np.stack([np.fft.rfft(taper * (z - z.mean()))[NEAR] for z in (y, *drives)], axis=1)
    target, *columns = np.concatenate([slow.real, slow.imag]).T
    matrix = np.stack(columns, axis=1)
    gain = np.linalg.lstsq(matrix, target, rcond=None)[0]
    left = target - matrix @ gain
    freedom = 1.0 - 2.0 * len(drives) / target.size  # the taper ties neighbouring lines: half of them are independent
    if left @ left > (1.0 - EXPLAINED) * freedom * (target @ target):
        return y, 1.0
    constant = np.array([taper @ drive for drive in drives])
    doubt = np.linalg.pinv(matrix.T @ matrix)
    follow = sum(factor * drive for factor, drive in zip(gain, drives, strict=True))
    return y - follow, float(np.sqrt((1.0 + 0.5 * constant @ doubt @ constant) / freedom))
