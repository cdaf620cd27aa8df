"""The shape of a missing force, in numbers and in words: what it follows, and how."""

from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import legvander

from ..._types import evenly_taken
from ..evidence.missing_force import Residual
from ..hypotheses.curves import bent, growth

_DEGREE = 9
"""Of the polynomials that stand for the parts that follow one of displacement and velocity."""
_READINGS = 2000
_APART = 1e-3
"""Singular value, as a share of the largest, from which polynomials differ along a motion: along a steady vibration, an
ellipse, even ones in displacement and in velocity are the same."""
_MOST, _MUCH = 0.7, 0.3
"""Shares from which a part is most of a force, or much of it."""


class Shape(NamedTuple):
    """Shares of power of a missing force.

    `of_state` is what displacement and velocity tell of it, beyond its noise. Of that follow `displacement` and
    `velocity` the one or the other alone, and `mixed` only both; `odd` is what changes sign with the motion, of the
    larger of the first two, and `growth` the sign of its bend: 1 where it grows faster than in proportion, -1 where it
    levels off, 0 where neither is told. Straight lines do not count, as own values take them.
    """

    of_state: float
    displacement: float
    velocity: float
    mixed: float
    odd: float
    growth: int

    @property
    def words(self) -> str:
        """The shape as a sentence."""
        if self.of_state < 1 - _MUCH:
            said = f"{1 - self.of_state:.0%} of it is no matter of displacement and velocity"
            return f"The same motion meets different forces: {said}; it remembers, or follows time or what drives."
        parts = {"displacement": self.displacement, "velocity": self.velocity}
        leading = max(parts, key=lambda name: parts[name])
        if self.mixed > _MOST:
            return "It follows displacement and velocity together, neither by itself."
        also = (
            "" if parts[leading] > _MOST else ", and both together" if self.mixed > _MUCH else ", and the other as well"
        )
        side = "is odd" if self.odd > _MOST else "is even" if self.odd < 1 - _MOST else "differs between the two sides"
        grows = {1: " and grows faster than in proportion", -1: " and levels off", 0: ""}
        return f"It follows the {leading} ({parts[leading]:.0%}{also}), {side}{grows[self.growth]}."


def shape_of(found: Residual) -> Shape | None:
    """Shape of a missing force; None where it has no map."""
    if found.force_map is None:
        return None
    take = evenly_taken(found.force.size, _READINGS)
    d, w, force = found.displacement[take], found.velocity[take], found.force[take]
    u, z = d / np.max(np.abs(d)), w / np.max(np.abs(w))
    along = [legvander(axis, _DEGREE)[:, 1:] for axis in (u, z)]
    columns = np.column_stack([np.ones_like(u), *along])
    mapped = np.asarray(found.force_map.evaluate(np.column_stack([d, w])))
    by_curves = columns @ np.linalg.lstsq(columns, force, rcond=_APART)[0]
    if np.var(force - by_curves) < np.var(force - mapped):  # readings at a few states only, as of a steady vibration
        mapped = by_curves
    noise = float(np.mean(found.std[take] ** 2))
    left = max(float(np.var(force - mapped)) - noise, 0.0)
    there = max(float(np.var(force)) - noise, left, np.finfo(float).tiny)
    numbers = np.linalg.lstsq(columns, mapped, rcond=_APART)[0]
    rest = float(np.var(mapped - columns @ numbers))
    sizes = np.split(numbers[1:], 2)
    curves = [
        bent(axis, part[:, ::2] @ size[::2], part[:, 1::2] @ size[1::2])
        for axis, part, size in zip((u, z), along, sizes, strict=True)
    ]
    power = [float(np.var(odd + even)) for odd, even in curves]
    total = max(sum(power) + rest, np.finfo(float).tiny)
    leading = int(np.argmax(power))
    odd, even = curves[leading]
    share = float(np.var(odd) / max(np.var(odd) + np.var(even), np.finfo(float).tiny))
    grows = growth((u, z)[leading], odd) if share > _MUCH else 0
    return Shape(1.0 - left / there, power[0] / total, power[1] / total, rest / total, share, grows)
