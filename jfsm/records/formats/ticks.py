"""What recorders do to a clock between its ticks: stamps rounded or doubled, samples lost, the clock put back."""

import numpy as np
from numpy.typing import NDArray

Seconds = NDArray[np.float64]

SAME = 0.01  # of a step: instants as close are one
LOST = 1.5  # median steps without a sample from which on samples are missing
UNEVEN = 0.05  # relative deviation of a step up to which a clock counts as uniform


def mended(seconds: Seconds) -> tuple[Seconds, list[str]]:
    """A clock without the marks of its writing, and what was done to it, one sentence each."""
    notes: list[str] = []
    if seconds.size < 4 or not np.all(np.isfinite(seconds)):
        return seconds, notes
    steps = np.diff(seconds)
    mean = float(steps.mean())
    if mean > 0 and steps.max() <= (1 + UNEVEN) * mean and steps.min() >= (1 - UNEVEN) * mean:
        return seconds, notes
    ramp, resolution = _ramp(seconds)
    if ramp is not None:
        notes.append(
            f"The instants are written to {resolution:.3g} s only; a uniform clock of {1 / (ramp[1] - ramp[0]):.6g} "
            f"Hz, which gives every one of them, takes their place."
        )
        return ramp, notes
    seconds, moved = _undoubled(seconds)
    if moved.size:
        notes.append(
            f"{moved.size} instants were written twice, with a double step behind; the second of each pair is moved to "
            f"the middle of that step (the first is sample {moved[0]}, t = {seconds[moved[0]]:.9g} s)."
        )
    notes += _missing(seconds)
    return seconds, notes


def beginnings(seconds: Seconds) -> NDArray[np.int64]:
    """Samples at which runs begin: the first, and each that lies before the one ahead of it."""
    return np.concatenate([[0], np.flatnonzero(np.diff(seconds) < 0) + 1])


def _ramp(seconds: Seconds) -> tuple[Seconds | None, float]:
    """The uniform clock that gives every stamp by rounding or by cutting digits off, and what they are rounded to."""
    steps = np.diff(seconds)
    if np.any(steps < -1e-12 * max(1.0, float(np.abs(seconds).max()))):
        return None, 0.0
    levels = np.unique(np.round(steps, 12))
    if not 1 < levels.size <= 64:
        return None, 0.0
    gaps = np.diff(levels)
    resolution = float(np.min(gaps[gaps > 1e-9 * levels[-1]], initial=levels[-1]))
    if np.max(np.abs(steps / resolution - np.round(steps / resolution))) > 0.02:
        return None, 0.0
    mean = float(steps.mean()) / resolution
    if np.ptp(np.round(steps / resolution)) > 1 and abs(mean - round(mean)) < 0.02:  # stamps that were doubled
        return None, 0.0
    index = np.arange(seconds.size) - 0.5 * (seconds.size - 1)
    slope, start = np.polyfit(index, seconds, 1)
    short = [step for d in (3, 2, 1) for step in (1 / float(f"{1 / slope:.{d}g}"), float(f"{slope:.{d}g}"))]
    for step in (slope, *short):  # a rate or a step is a number of few digits
        ramp = start + step * index
        if np.ptp(seconds - ramp) <= resolution * (1 + 1e-6):
            return ramp, resolution
    return None, 0.0


def _undoubled(seconds: Seconds) -> tuple[Seconds, NDArray[np.int64]]:
    steps = np.diff(seconds)
    median = float(np.median(steps))
    doubled = np.flatnonzero((np.abs(steps[:-1]) <= SAME * median) & (np.abs(steps[1:] - 2 * median) <= 0.5 * median))
    if not doubled.size:
        return seconds, doubled
    result = seconds.copy()
    result[doubled + 1] = 0.5 * (seconds[doubled] + seconds[doubled + 2])
    return result, doubled + 1


def _missing(seconds: Seconds) -> list[str]:
    steps = np.diff(seconds)
    median = float(np.median(steps))
    if median <= 0 or np.any(steps <= 0):
        return []
    wide = np.flatnonzero(steps > LOST * median)
    others = np.delete(steps, wide)
    if not wide.size or np.ptp(others) > 0.2 * median:  # uneven throughout: nothing can be said to be missing
        return []
    lost = np.round(steps[wide] / median).astype(int) - 1
    first = wide[0]
    return [
        f"{int(lost.sum())} samples are missing in {wide.size} places, the first {int(lost[0])} behind sample "
        f"{first} (t = {seconds[first]:.9g} s); the gaps are kept. The steps elsewhere are {median:.6g} s "
        f"({1 / median:.6g} Hz)."
    ]
