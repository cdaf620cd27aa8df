"""One mass on a spring and a damper, and its motion."""

import dataclasses
from typing import TypeAlias

import numpy as np

from .arrays import FloatArray, rms

State: TypeAlias = tuple[float, float]  # x [m], v [m/s]


class EscapeError(ArithmeticError):
    """The motion left the region in which the plant is a fair question."""


class UnfairError(RuntimeError):
    """A seed whose cause and excitation never give a challenge of the wanted size."""


@dataclasses.dataclass(frozen=True)
class Plant:
    """Mass [kg], stiffness [N/m], damping [N s/m]."""

    mass: float
    stiffness: float
    damping: float

    @property
    def omega(self) -> float:
        """Undamped natural frequency [rad/s]."""
        return float(np.sqrt(self.stiffness / self.mass))

    @property
    def damping_ratio(self) -> float:
        return self.damping / (2.0 * self.mass * self.omega)


@dataclasses.dataclass(frozen=True)
class Motion:
    """A motion on its sample times, (n,) in SI; `instants` (events,) [s] is when the law changed its mode.

    `hidden` holds what the law remembers, (n,) each: its hidden states, or the delayed displacement.
    """

    time: FloatArray
    x: FloatArray
    v: FloatArray
    acceleration: FloatArray
    effect: FloatArray
    instants: FloatArray
    hidden: tuple[FloatArray, ...] = ()

    @property
    def peak(self) -> float:
        """Largest abs(x) [m]."""
        return float(np.abs(self.x).max())

    def shares(self, plant: Plant) -> tuple[float, float]:
        """Rms of the effect over rms of the linear link's force; the same for what no other k and c could take up."""
        link = rms(plant.stiffness * self.x + plant.damping * self.v)
        if link == 0.0:  # stuck where it stood
            return np.inf, np.inf
        return rms(self.effect) / link, rms(self.left(plant, self.effect)) / link

    def left(self, plant: Plant, force: FloatArray) -> FloatArray:
        """What no other k and c could take up of a force (n,) along the motion, (n,) [N]."""
        # Both columns are forces, so that the least squares are well conditioned in any units.
        basis = np.stack([plant.stiffness * self.x, plant.mass * plant.omega * self.v], axis=1)
        return force - basis @ np.linalg.lstsq(basis, force, rcond=None)[0]
