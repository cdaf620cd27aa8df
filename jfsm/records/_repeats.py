"""Samples that repeat others: a sensor that hung, a channel sampled more slowly, one channel under two names."""

from collections.abc import Iterator, Mapping
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from jfsm.records._quantisation import quantisation_step
from jfsm.records._tapers import Samples

HELD = 5  # equal samples in a row, within the record, that no continuous channel has
RAREST, TOGETHER, CHANCE = 1e-5, 3.0, 0.05  # share of equal neighbours at least; how far they cluster; a hang by chance
GENTLE = 0.1  # of the usual step, and of a velocity's standard deviation: beside it, a channel stands still
MOSTLY = 0.5  # share of samples in long runs, above which a channel is a staircase
SAME = 1e-9  # share of the standard deviation by which copies may differ


def longest_hold(y: Samples) -> tuple[int, int]:
    """First sample and length of the longest run of equal values inside a continuous channel; 0 and 0 without one.

    Runs at the start and the end are rest, and so are those that the channel comes to and leaves gently, as a joint
    that sticks does where it turns; those at the extreme values are clipping. A coarsely quantised channel repeats its
    values anyway, and so does one that was computed from such a channel: a run must be longer than the short ones let
    expect. A channel that mostly holds is switched in steps.
    """
    same = np.diff(y) == 0
    if quantisation_step(y) > GENTLE * _usual_step(y) or repetition(y) > 1:
        return 0, 0
    edges = np.flatnonzero(np.diff(np.concatenate([[False], same, [False]]).astype(int)))
    starts, ends = edges[::2], edges[1::2] + 1
    inside = (starts > 0) & (ends < y.size) & (y[starts] > y.min()) & (y[starts] < y.max())
    lengths = np.where(inside, ends - starts, 0)
    if np.sum(lengths[lengths >= HELD]) > MOSTLY * y.size:
        return 0, 0
    lengths = np.where(inside & ~_gentle(y, np.maximum(starts, 1), np.minimum(ends, y.size - 1)), lengths, 0)
    if lengths.size == 0 or lengths.max() < HELD:
        return 0, 0
    longest = int(np.argmax(lengths))
    runs = ends - starts
    usual = max(float(np.sum((runs - 1)[runs < HELD])) / y.size, RAREST)
    if y.size * usual ** ((lengths[longest] - 1) / TOGETHER) > CHANCE:
        return 0, 0
    return int(starts[longest]), int(lengths[longest])


def _gentle(y: Samples, starts: NDArray[np.int64], ends: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which runs of equal values, from `starts` to before `ends`, the channel comes to and leaves as if it stood still.

    Of a displacement both steps are small beside the usual step; a velocity is 0 then, and was small before.
    """
    step = np.maximum(np.abs(y[starts] - y[starts - 1]), np.abs(y[ends] - y[ends - 1]))
    slow = step <= GENTLE * _usual_step(y)
    return slow | ((y[starts] == 0) & (step <= GENTLE * y.std()))


def _usual_step(y: Samples) -> float:
    """Root mean square of the differences between neighbouring samples."""
    return float(np.sqrt(np.mean(np.diff(y) ** 2)))


def repetition(y: Samples) -> int:
    """How many samples share one value throughout, 1 if they do not: the channel was sampled more slowly."""
    changes = np.flatnonzero(np.diff(y)) + 1
    if changes.size < 8 or np.unique(y).size < 0.5 * changes.size:  # a switch returns to its values
        return 1
    stride = int(np.gcd.reduce(np.diff(changes)))
    return stride if changes.size * stride > 0.9 * (y.size - stride) else 1


def copies(channels: Mapping[str, Samples]) -> Iterator[tuple[str, str, float]]:
    """Pairs of channels of which the second is a constant times the first, and that constant."""
    for (one, y), (other, z) in combinations(channels.items(), 2):
        power = float(y @ y)
        factor = float(y @ z) / power if power > 0 else 0.0
        if factor and z.std() > 0 and np.abs(z - factor * y).max() <= SAME * z.std():
            yield one, other, factor
