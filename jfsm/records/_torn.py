"""Samples so far outside that no part of a test can have made them: marks of an overload, codes for "no reading"."""

import numpy as np
from numpy.typing import NDArray

from jfsm.records._noise_floor import SHORTEST, noise_floor
from jfsm.records._runs_of import runs_of

FAR = {"displacement": 30.0, "velocity": 30.0}  # times the extent of all other samples: nothing moves so far and back
FAR_JUMPING = 1000.0  # the same of a force or an acceleration, which a blow may make
FAR_CODE = 30.0  # the same of the numbers that recorders write for an overload or for no reading
CODES = (1.0, 9.99, 9.999, 9.9999, 9.99999, 3.2767, 3.2768, 3.4028235, 9.96921)  # but for powers of ten
ROUNDING = 1e-6  # relative, of a code
BEYOND_ANY = 1e20  # in any unit
MOST, FEWEST = 0.05, 3  # share, or number, of the samples of a channel that may be torn
LONGEST = 3  # samples in a row; a code may stand for longer


def far_outside(kind: str, y: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which samples of a channel are marks, not readings.

    Parameters
    ----------
    kind : str
        Force, displacement, velocity, acceleration or base_acceleration.
    y : (n,) float array

    Returns
    -------
    mask : (n,) bool array

    Notes
    -----
    A displacement does not go thirty times as far as in all the rest of a record for a sample or two, and come back. A
    force or an acceleration may, in a blow: of these only what is a thousand times as large is torn, or thirty times
    and a number such as −9999 or 1e30. Where a force is nothing but noise beside it, the blow is the drive.
    """
    mask = np.zeros(y.size, dtype=bool)
    if y.size < SHORTEST:
        return mask
    distance = np.abs(y - np.median(y))
    most = max(FEWEST, int(MOST * y.size)) + 1
    least = float(np.partition(distance, y.size - most)[y.size - most])
    if distance.max() <= min(FAR_CODE, FAR_JUMPING) * least:
        return mask  # as in most channels
    order = np.argsort(distance)[::-1][:most]
    far = FAR.get(kind, FAR_JUMPING)
    codes = _is_code(y[order])
    candidates = np.zeros(y.size, dtype=bool)
    for place in range(order.size - 1):
        size, rest = distance[order[place]], distance[order[place + 1]]
        if rest <= 0 and size < BEYOND_ANY:
            break
        candidates[order[place]] = True
        if size > far * rest or (codes[: place + 1].all() and size > FAR_CODE * rest) or size > BEYOND_ANY > rest:
            mask |= candidates
    mask &= _in_short_runs(mask) | _is_code(y)
    if kind in ("force", "base_acceleration") and np.any(mask) and _is_all_there_is(y, mask):
        mask &= np.abs(y) > BEYOND_ANY
    return mask


def _is_code(y: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which numbers are a power of ten, as many nines, or the end of a range of bits, by a power of ten."""
    size = np.abs(y)
    mantissa = size / 10.0 ** np.floor(np.log10(np.where(size > 0, size, 1.0)))
    return np.any([np.abs(mantissa / code - 1.0) < ROUNDING for code in CODES], axis=0)


def _in_short_runs(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which marked samples stand in runs of at most three."""
    short = np.zeros(mask.size, dtype=bool)
    for start, end in zip(*runs_of(mask), strict=True):
        short[start:end] = end - start <= LONGEST
    return short


def _is_all_there_is(y: NDArray[np.float64], mask: NDArray[np.bool_]) -> bool:
    """Whether a channel shows nothing but noise without these samples."""
    rest = y[~mask]
    return rest.size < SHORTEST or np.ptp(rest) == 0 or noise_floor(rest, 1.0).silent
