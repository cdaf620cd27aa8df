"""External forces that nobody measured: they stand beside g, on the right, and so with a minus on the left."""

import dataclasses
from typing import Any, ClassVar, Self

import numpy as np

from ..drives import SumOfSines
from .base import Hidden, Law, Mode, Scene, either_sign, log_uniform

# An unmeasured line within this share of the frequency of the only line that was measured could not be told from it.
APART = 0.15


@dataclasses.dataclass(frozen=True)
class Preload(Law):
    """A constant force F of either sign [N] on the mass, which begins with the record."""

    cause: ClassVar[str] = "preload"
    F: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        return cls(F=either_sign(rng) * rms_force)

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, F=factor * self.F)

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return -self.F + 0.0 * x


@dataclasses.dataclass(frozen=True)
class PeriodicDisturbance(Law):
    """A force F cos(omega t + phase) on the mass: F > 0 [N], omega [rad/s], phase [rad]."""

    cause: ClassVar[str] = "periodic_disturbance"
    F: float
    omega: float
    phase: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        return cls(
            F=float(np.sqrt(2.0)) * rms_force,
            omega=log_uniform(rng, 0.3, 2.5) * scene.plant.omega,
            phase=float(rng.uniform(-np.pi, np.pi)),
        )

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, F=factor * self.F)

    def fits(self, scene: Scene) -> bool:
        drive = scene.drive
        if not isinstance(drive, SumOfSines) or drive.omega.size > 1:
            return True
        return abs(self.omega / float(drive.omega[0]) - 1.0) > APART

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return -self.F * np.cos(self.omega * t + self.phase)
