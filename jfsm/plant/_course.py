"""The measured motion of a record, near which the function of a simulation is tabulated."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float
from scipy.interpolate import make_smoothing_spline

from ..structures import Structure
from ._plant import Channel
from ._tabulated import Tabulated, tabulated

_KEPT = 8
"""Tables of different numbers that are kept, those made last."""
_FEWEST = 5
"""Samples that a smoothing spline needs."""


@dataclass(frozen=True)
class Course:
    """Displacement, velocity and acceleration (2 n + 1, dof) on half samples, smoothed, and their instants [s].

    A table about a motion that errs by a little errs by the square of that. It ends as far from the motion as that is
    wide: a prediction that has gone so wrong must stay finite, as those of a sine do.
    """

    x: Float[np.ndarray, "nodes dof"]
    v: Float[np.ndarray, "nodes dof"]
    a: Float[np.ndarray, "nodes dof"]
    time: Float[np.ndarray, " nodes"]
    _tables: dict[bytes, Tabulated] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, shown: Mapping[Channel, Float[np.ndarray, " n"]], dof: int, dt: float, begin: float) -> "Course | None":
        """That of channels whose first sample is at an instant; None where one of `dof` coordinates has no
        displacement among them."""
        if any(("displacement", j) not in shown for j in range(1, dof + 1)):
            return None
        n = len(shown["displacement", 1])
        if n < _FEWEST:
            return None
        places = np.arange(2 * n + 1) / 2
        columns = []
        for j in range(1, dof + 1):
            position = make_smoothing_spline(np.arange(n), shown["displacement", j])
            speed = shown.get(("velocity", j))
            slope = position.derivative() if speed is None else make_smoothing_spline(np.arange(n), speed * dt)
            columns.append([position(places), slope(places) / dt, slope.derivative()(places) / dt**2])
        x, v, a = np.moveaxis(np.array(columns), 0, 2)
        return cls(x, v, a, begin + places * dt)

    def showing(self, shown: Mapping[Channel, Float[np.ndarray, " n"]]) -> "Course | None":
        """That of the same record, had its channels shown something else."""
        begin, dt = float(self.time[0]), 2 * float(self.time[1] - self.time[0])
        return Course.of(shown, self.x.shape[1], dt, begin)

    def near(self, structure: Structure) -> Tabulated | None:
        """The table (n, ...) of a structure's own function with its own numbers; None where it has none."""
        if structure.own is None:
            return None
        numbers = np.asarray(structure.own_numbers)
        key = numbers.tobytes()
        if key not in self._tables:
            reach = np.stack([np.ptp(self.x, 0), np.ptp(self.v, 0)])
            self._tables[key] = tabulated(
                structure.own, numbers, self.x, self.v, self.a, self.time, nodes=3, reach=reach
            )
            while len(self._tables) > _KEPT:
                self._tables.pop(next(iter(self._tables)))
        return self._tables[key]
