"""Samples that repeat others: a sensor that hung, a channel sampled more slowly, one channel under two names."""

from collections.abc import Iterator, Mapping
from itertools import combinations

import numpy as np

from jfsm.records._quantisation import quantisation_step
from jfsm.records._tapers import Samples

HELD = 5  # equal samples in a row, within the record, that no continuous channel has
RAREST, TOGETHER, CHANCE = 1e-5, 3.0, 0.05  # share of equal neighbours at least; how far they cluster; a hang by chance
SAME = 1e-9  # share of the standard deviation by which copies may differ


def longest_hold(y: Samples) -> tuple[int, int]:
    """First sample and length of the longest run of equal values inside a continuous channel; 0 and 0 without one.

    Runs at the start and the end are rest, and those at the extreme values clipping. A quantised channel repeats its
    values anyway, and so does one that was computed from such a channel: a run must be longer than the short ones let
    expect.
    """
    same = np.diff(y) == 0
    if quantisation_step(y) or repetition(y) > 1:
        return 0, 0
    edges = np.flatnonzero(np.diff(np.concatenate([[False], same, [False]]).astype(int)))
    starts, ends = edges[::2], edges[1::2] + 1
    inside = (starts > 0) & (ends < y.size) & (y[starts] > y.min()) & (y[starts] < y.max())
    lengths = np.where(inside, ends - starts, 0)
    if lengths.size == 0 or lengths.max() < HELD:
        return 0, 0
    longest = int(np.argmax(lengths))
    runs = ends - starts
    usual = max(float(np.sum((runs - 1)[runs < HELD])) / y.size, RAREST)
    if y.size * usual ** ((lengths[longest] - 1) / TOGETHER) > CHANCE:
        return 0, 0
    return int(starts[longest]), int(lengths[longest])


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
