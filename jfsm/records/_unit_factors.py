"""Factors by which numbers are off when a unit was taken for another."""

import math
from typing import NamedTuple


class UnitFactor(NamedTuple):
    """A factor, and the units that it lies between."""

    size: float
    words: str


UNIT_FACTORS = (
    UnitFactor(1e6, "µm for m, or MN for N"),
    UnitFactor(1e3, "mm for m, or kN for N"),
    UnitFactor(math.degrees(1.0), "degrees for radians"),
    UnitFactor(1 / 0.0254, "inches for m"),
    UnitFactor(25.4, "inches for mm"),
    UnitFactor(9.80665, "g for m/s², or kgf for N"),
    UnitFactor(2 * math.pi, "turns for radians, or Hz for rad/s"),
    UnitFactor(4.4482216, "lbf for N"),
)


def likely_unit(times: float) -> UnitFactor:
    """The factor that `times`, or its inverse, is closest to."""
    return min(UNIT_FACTORS, key=lambda known: miss(times, known))


def miss(times: float, known: UnitFactor) -> float:
    """How far `times`, or its inverse, is from a factor: the logarithm of their ratio, without its sign."""
    return abs(abs(math.log(times)) - math.log(known.size))
