"""Samples that are not readings: limited by the recorder, or torn out of the curve."""

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline
from scipy.ndimage import maximum_filter1d, median_filter

from jfsm.records._asked_again import kept
from jfsm.records._noise_floor import noise_floor
from jfsm.records._quantisation import quantisation_step

CLIPPED_SAMPLES = 6  # at one end level; a continuous signal is there once
CLIPPED_SAMPLES_QUANTISED = 12
CLIPPED_OVER_NEIGHBOUR = 3  # times the samples of the level next to the end of a quantised channel
SWITCHING = 0.9  # share of samples at the two ends above which a signal is a switch, not a limited curve
APPROACH, DECELERATION = 0.1, 0.4  # how fast, and how little slowed, a curve must meet a level that cuts it off
VISITS, DISTINCT = 4, 0.99  # returns to the same level, and share of other values that occur once: a curve with noise
SPIKE_ROBUST, SPIKE_FLOORS = 8.0, 6.0  # a spike is this many robust deviations and this many noise floors off
SURROUNDING = 101  # samples in which the robust deviation is taken
OUTSIDE = 0.75  # share of a spike's height that must stand out of the range of the samples beside it
STEEP = 4.0  # times as high as the motion goes between samples, from which a spike stands out of its slope
ALONE = 3.0  # times as far off as anything that is left around it: where a channel rattles, its crests are no spikes
OFF_CURVE = np.array([-1.0, 6.0, -15.0, 20.0, -15.0, 6.0, -1.0]) / 20.0  # a sample minus the quintic through six beside
BESIDE = 3  # samples on either side of a spike that make its curve
# Which samples a spike takes, beside the one that is farthest off.
TORN = ((0,), (0, 1), (-1, 0), (0, 2), (-2, 0), (0, 3), (-3, 0))
PASSES = 2  # of three that are close together, the third is seen once the others are mended
ONE_SIDED = 2.0  # times as far off where the curve ends beside a spike and goes on by itself


def clipped(y: ArrayLike, torn: NDArray[np.bool_] | None = None) -> NDArray[np.bool_]:
    """Which samples of a channel sit at the limit of the recorder.

    Parameters
    ----------
    y : (n,) array
    torn : (n,) bool array, optional
        Samples that are no readings, and may be beyond the limit.

    Returns
    -------
    mask : (n,) bool array

    Notes
    -----
    Six samples equal to the largest (or smallest) value are a limit, if the curve runs into it at speed. A structure
    that dwells at its extreme position, is held before a release, or rests, comes to that level gently; but a curve
    with noise, none of whose other values occurs twice, does not come back to one level four times. A quantised
    channel meets its end levels anyway: it needs twelve samples, and three times as many as the level beside. A channel
    that spends nine tenths of its time at both ends is a switch.
    """
    y = np.asarray(y, dtype=np.float64)
    if torn is not None and np.any(torn):
        mask = np.zeros(y.size, dtype=bool)
        mask[~torn] = clipped(y[~torn])
        return mask
    low, high = float(y.min()), float(y.max())
    if low == high:
        return np.zeros(y.size, dtype=bool)
    step = quantisation_step(y)
    masks = [_at_level(y, level, inward, step) for level, inward in ((high, -1.0), (low, 1.0))]
    both = masks[0] | masks[1]
    return both if both.mean() < SWITCHING else np.zeros(y.size, dtype=bool)


def spikes(y: ArrayLike, std: float) -> NDArray[np.bool_]:
    """Which samples of a channel are torn out of the curve their neighbours make.

    Parameters
    ----------
    y : (n,) array
    std : float
        Noise floor of the channel, in its unit.

    Returns
    -------
    mask : (n,) bool array
        One sample or two, side by side or with up to two between them, off the running median of five by more than 6
        floors, off the curve through their neighbours by more than 8 robust standard deviations of the samples around,
        and by three times what remains around them when the spikes are gone.

    Notes
    -----
    A jump, as dry friction leaves in an acceleration, is no spike: a spike stands out of the samples on both sides.
    Nor is a crest among the like, as where a joint chatters.
    """
    original = np.asarray(y, dtype=np.float64)
    y = original.copy()
    mask = np.zeros(y.size, dtype=bool)
    if y.size < 2 * OFF_CURVE.size:
        return mask
    for _ in range(PASSES):
        off_median = np.abs(y - median_filter(y, size=5, mode="mirror"))
        disturbance = _off_curve(y)
        disturbance[[0, -1]] = off_median[[0, -1]]  # continued beyond itself, an end is never off
        limit = SPIKE_ROBUST * np.maximum(_deviation_around(disturbance), 1e-12 * np.ptp(y))
        suspects = np.flatnonzero((off_median > SPIKE_FLOORS * std) & (disturbance > limit))
        before = int(mask.sum())
        for i in suspects[np.argsort(-disturbance[suspects])]:  # the highest first: they disturb their neighbours
            for torn in TORN:
                if not mask[i] and _mended(y, i + np.array(torn), float(limit[i])):
                    mask[i + np.array(torn)] = True
        if mask.sum() == before:
            break
    height = maximum_filter1d(np.abs(original - y), 5)  # what is torn together stands or falls together
    left = _off_curve(y)
    left[:BESIDE] = left[-BESIDE:] = 0.0  # of the ends no curve tells
    return mask & (height > ALONE * maximum_filter1d(left, SURROUNDING))


@kept
def defects(y: ArrayLike, dt: float) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which samples (n,) of a channel are no readings: those at the limit of its recorder, and those torn out of it."""
    y = np.asarray(y, dtype=np.float64)
    torn = spikes(y, noise_floor(y, dt).std)
    found = clipped(y, torn), torn
    for mask in found:
        mask.setflags(write=False)
    return found


def bridged(y: NDArray[np.float64], lost: NDArray[np.bool_]) -> NDArray[np.float64]:
    """The channel with a cubic spline through its other samples where samples are lost."""
    if not np.any(lost):
        return y
    index = np.arange(y.size)
    return np.where(lost, CubicSpline(index[~lost], y[~lost])(index), y)


def _off_curve(y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance of each sample from the quintic through its six neighbours."""
    return np.abs(np.convolve(np.pad(y, 3, mode="reflect", reflect_type="odd"), OFF_CURVE, mode="valid"))


def _mended(y: NDArray[np.float64], torn: NDArray[np.int_], limit: float) -> bool:
    """Replace these samples of `y` by the curve of those beside, if they are a spike."""
    if torn[0] < 0 or torn[-1] >= y.size:
        return False
    around = np.arange(max(torn[0] - BESIDE, 0), min(torn[-1] + BESIDE + 1, y.size))
    beside = np.setdiff1d(around, torn)
    curve = _through(tuple(beside - torn[0]), tuple(torn - torn[0])) @ y[beside]
    height = np.abs(y[torn] - curve)
    steps = np.concatenate([np.diff(y[part]) for part in (beside[beside < torn[0]], beside[beside > torn[-1]])])
    steepest = np.abs(steps).max(initial=0.0)
    nearest = beside[(beside > torn[0] - BESIDE) & (beside < torn[-1] + BESIDE)]
    outside = _outside(y[torn], y[nearest])
    if np.all(height > STEEP * steepest):
        # Of a fast motion a high spike may be in the range of the samples beside it; not about the slope on both sides.
        slope = np.mean(steps)
        outside = np.maximum(outside, _outside(y[torn] - slope * torn, y[nearest] - slope * nearest))
    limit *= 1.0 if beside.size >= 2 * BESIDE else ONE_SIDED
    if np.any(height <= max(limit, steepest)) or np.any(outside < OUTSIDE * height):
        return False
    y[torn] = curve
    return True


def _outside(y: NDArray[np.float64], range_of: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far values are outside of the range of others; negative inside."""
    return np.maximum(y - range_of.max(), range_of.min() - y)


@lru_cache
def _through(beside: tuple[int, ...], lost: tuple[int, ...]) -> NDArray[np.float64]:
    """Weights (lost, beside) that give lost samples of the polynomial through those beside."""
    powers = np.arange(len(beside))
    return np.linalg.solve(
        np.array(beside, float)[None, :] ** powers[:, None], np.array(lost, float)[None, :] ** powers[:, None]
    ).T


def _deviation_around(distance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Robust standard deviation in the surroundings of each sample."""
    return 1.4826 * median_filter(distance, size=min(SURROUNDING, distance.size), mode="reflect")


def _at_level(y: NDArray[np.float64], level: float, inward: float, step: float) -> NDArray[np.bool_]:
    """Samples at one end level, if they are too many to have come there by themselves."""
    nothing = np.zeros(y.size, dtype=bool)
    mask = np.abs(y - level) <= 1e-9 * float(np.ptp(y))
    if step > 0:
        beside = int(np.count_nonzero(np.abs(y - (level + inward * step)) <= 0.5 * step))
        enough = mask.sum() >= max(CLIPPED_SAMPLES_QUANTISED, CLIPPED_OVER_NEIGHBOUR * beside)
    else:
        enough = mask.sum() >= CLIPPED_SAMPLES
    return mask if enough and (_cut_off(y, mask, level) or _returns(y, mask)) else nothing


def _returns(y: NDArray[np.float64], mask: NDArray[np.bool_]) -> bool:
    """Whether a noisy curve comes back to exactly the same level again and again, as noise never does by itself."""
    visits = int(np.count_nonzero(mask[1:] & ~mask[:-1]))
    level = np.round((y - y.min()) / (1e-9 * float(np.ptp(y))))
    between = level[(level > level.min()) & (level < level.max())]  # it may be cut off on both sides
    return visits >= VISITS and np.unique(between).size > DISTINCT * between.size


def _cut_off(y: NDArray[np.float64], mask: NDArray[np.bool_], level: float) -> bool:
    """Whether the curve meets the level at speed, judged two and four samples before and after it stays there."""
    starts = np.flatnonzero(mask[1:-1] & ~mask[:-2] & mask[2:]) + 1
    ends = np.flatnonzero(mask[1:-1] & ~mask[2:] & mask[:-2]) + 1
    near = np.concatenate([starts[starts >= 4] - 2, ends[ends < y.size - 4] + 2])
    far = np.concatenate([starts[starts >= 4] - 4, ends[ends < y.size - 4] + 4])
    if near.size == 0:
        return False
    last, before = np.abs(y[near] - level), np.abs(y[far] - y[near])
    usual = float(np.sqrt(np.mean(np.diff(y) ** 2)))
    return bool(np.median(last) / 2.0 >= APPROACH * usual and last.sum() >= DECELERATION * before.sum())
