"""Whether a motion grows, stays or dies away."""

from typing import NamedTuple

import numpy as np

from jfsm.records._abstract_record import AbstractRecord
from jfsm.records._checks import strongest_frequency


class Growth(NamedTuple):
    """Power of the last quarter of a motion over that of the first, and how many periods there are."""

    ratio: float
    periods: float


def growth_of(record: AbstractRecord) -> Growth | None:
    """The growth of all responses together; of displacement and velocity where there are any, since blows make an
    acceleration large. None without a response that oscillates about a level."""
    motion = {key: y for key, y in record.responses.items() if key[0] != "acceleration"} or dict(record.responses)
    powers, periods = np.zeros(4), []
    for y in motion.values():
        if np.ptp(y) == 0:
            continue
        level, size = y - y.mean(), float(np.var(y))
        powers += [float(np.mean(quarter**2)) / size for quarter in np.array_split(level, 4)]
        crossings = np.count_nonzero(np.diff(np.sign(level)) != 0)
        periods.append(min(strongest_frequency(y, record.dt) * record.duration, 0.5 * crossings))
    if not periods or powers[0] <= 0:
        return None
    return Growth(float(powers[-1] / powers[0]), float(np.median(periods)))
