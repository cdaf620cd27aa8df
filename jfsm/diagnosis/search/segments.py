"""Pieces of long records, in which causes are sought before what was found is fitted to all of them."""

import math
from collections.abc import Sequence

import numpy as np

from ...records import Record

_PIECES = 3
"""Of one long record; fewer each of several."""
_LEAST = 4000
"""Readings of a piece,"""
_PERIODS = 25.0
"""and periods of the structure in it, at least."""
_WORTH = 4
"""Times as many readings as its pieces a record must have for these to be worth it."""


def pieces(training: Sequence[tuple[Record, int]], periods: Sequence[float]) -> list[tuple[Record, int]] | None:
    """Loud pieces of the long ones among the records, with the number of their readings; the others as they are.

    Each is the loudest stretch of its part of what is fitted, so that all of the time has a say, and several levels do.
    `periods` are those of the structure, one per record. None where no record is long.
    """
    count, found, long = max(_PIECES // len(training), 1), list[tuple[Record, int]](), False
    for (record, until), period in zip(training, periods, strict=True):
        length = max(_LEAST, math.ceil(_PERIODS * period / record.dt))
        if until < _WORTH * count * length:
            found.append((record, until))
        else:
            found += [(record[begin : begin + length], length) for begin in _loudest(record, until, count, length)]
            long = True
    return found if long else None


def _loudest(record: Record, until: int, count: int, length: int) -> list[int]:
    """Where the loudest stretch of each of so many equal parts of the record begins."""
    power = np.zeros(until)
    for y in record.responses.values():
        about = y[:until] - np.mean(y[:until])
        power += about**2 / max(float(np.mean(about**2)), np.finfo(float).tiny)
    total = np.concatenate([[0.0], np.cumsum(power)])
    step = length // 4
    begins = []
    for part in range(count):
        first, last = part * until // count, (part + 1) * until // count - length
        tried = np.arange(first, last + 1, step)
        begins.append(int(tried[np.argmax(total[tried + length] - total[tried])]))
    return begins
