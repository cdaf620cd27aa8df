"""Springs whose force is not proportional to the stretch."""

import dataclasses
from typing import Any, ClassVar, Self

import numpy as np

from .base import FloatArray, Law, rms

# Share of the displacement at which the total stiffness vanishes that a motion may reach: beyond it the plant is on its
# way over the edge, and the question becomes another one.
FAIR_REACH = 0.6


@dataclasses.dataclass(frozen=True)
class CubicHardening(Law):
    """k3 x^3, k3 > 0 [N/m^3]."""

    cause: ClassVar[str] = "cubic_hardening"
    k3: float

    @classmethod
    def draw(cls, rng: np.random.Generator, x: FloatArray, v: FloatArray, rms_force: float) -> Self:
        return cls(k3=rms_force / rms(x**3))

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, k3=factor * self.k3)

    def force(self, x: Any, v: Any, load: Any, mode: int) -> Any:
        return self.k3 * x * x * x


@dataclasses.dataclass(frozen=True)
class CubicSoftening(CubicHardening):
    """k3 x^3, k3 < 0 [N/m^3]; k + 3 k3 x^2 vanishes at sqrt(-k / (3 k3))."""

    cause: ClassVar[str] = "cubic_softening"

    @classmethod
    def draw(cls, rng: np.random.Generator, x: FloatArray, v: FloatArray, rms_force: float) -> Self:
        return cls(k3=-rms_force / rms(x**3))

    def reach(self, stiffness: float) -> float:
        return FAIR_REACH * float(np.sqrt(-stiffness / (3.0 * self.k3)))


@dataclasses.dataclass(frozen=True)
class QuadraticStiffness(Law):
    """k2 x^2, k2 of either sign [N/m^2]; k + 2 k2 x vanishes at -k / (2 k2)."""

    cause: ClassVar[str] = "quadratic_stiffness"
    k2: float

    @classmethod
    def draw(cls, rng: np.random.Generator, x: FloatArray, v: FloatArray, rms_force: float) -> Self:
        return cls(k2=float(rng.choice((-1.0, 1.0))) * rms_force / rms(x**2))

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, k2=factor * self.k2)

    def force(self, x: Any, v: Any, load: Any, mode: int) -> Any:
        return self.k2 * x * x

    def reach(self, stiffness: float) -> float:
        return FAIR_REACH * stiffness / (2.0 * abs(self.k2))
