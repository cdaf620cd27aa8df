"""Samples that repeat others: a sensor that hung, a channel sampled more slowly, one channel under two names."""

from collections.abc import Iterator, Mapping
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from jfsm.records._quantisation import quantisation_step
from jfsm.records._runs_of import runs_of
from jfsm.records._tapers import Samples

HELD = 5  # equal samples in a row, within the record, that no continuous channel has
HELD_TO_THE_END = 20  # the same at its end
RAREST, TOGETHER, CHANCE = 1e-5, 3.0, 0.05  # share of equal neighbours at least; how far they cluster; a hang by chance
GENTLE = 0.1  # of the usual step, and of a velocity's standard deviation: beside it, a channel stands still
MOSTLY = 0.5  # share of samples in long runs, above which a channel is a staircase
SAME = 1e-9  # share of the standard deviation by which copies may differ


def longest_hold(y: Samples) -> tuple[int, int]:
    """First sample and length of the longest run of equal values inside a continuous channel; 0 and 0 without one."""
    return max(held(y), key=lambda run: run[1], default=(0, 0))


def held(y: Samples) -> list[tuple[int, int]]:
    """First samples and lengths of the runs of equal values inside a continuous channel: where the sensor hung.

    A run at the start is rest, and so are those that the channel comes to and leaves gently, as a joint that sticks
    does where it turns, and one at the end to which it came gently, or at 0; those at the extreme values, or twice at
    one value, are clipping. A coarsely quantised channel repeats its values anyway, and so does one that was computed
    from such a channel: a run must be longer than the short ones let expect. A channel that mostly holds is switched in
    steps.
    """
    same = np.diff(y) == 0
    if not np.any(same) or quantisation_step(y) > GENTLE * _usual_step(y) or repetition(y) > 1:
        return []
    starts, ends = runs_of(same)
    ends = ends + 1
    last = (ends == y.size) & (ends - starts >= HELD_TO_THE_END) & (y[starts] != 0)
    inside = (starts > 0) & ((ends < y.size) | last) & (y[starts] > y.min()) & (y[starts] < y.max())
    lengths = np.where(inside, ends - starts, 0)
    if np.sum(lengths[lengths >= HELD]) > MOSTLY * y.size:
        return []
    lengths = np.where(inside & ~_gentle(y, np.maximum(starts, 1), ends), lengths, 0)
    runs = ends - starts
    usual = max(float(np.sum((runs - 1)[runs < HELD])) / y.size, RAREST)
    long = (lengths >= HELD) & (y.size * usual ** ((lengths - 1) / TOGETHER) <= CHANCE)
    levels, counts = np.unique(y[starts[long]], return_counts=True)
    long[long] = np.isin(y[starts[long]], levels[counts == 1])  # the end of a range is come back to
    return [(int(start), int(length)) for start, length in zip(starts[long], lengths[long], strict=True)]


def _gentle(y: Samples, starts: NDArray[np.int64], ends: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which runs of equal values, from `starts` to before `ends`, the channel comes to and leaves as if it stood still.

    Of a displacement both steps are small beside the usual step; a velocity is 0 then, and was small before.
    """
    left = np.minimum(ends, y.size - 1)  # nothing where the record ends
    step = np.maximum(np.abs(y[starts] - y[starts - 1]), np.abs(y[left] - y[ends - 1]))
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
