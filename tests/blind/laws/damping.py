"""Dampers whose force is not proportional to the velocity. Their modes are the sign of v; 0 is sticking."""

import dataclasses
from typing import Any, ClassVar, Self

import numpy as np

from .base import FloatArray, Law, rms


def sign(y: float) -> int:
    return (y > 0.0) - (y < 0.0)


@dataclasses.dataclass(frozen=True)
class QuadraticDamping(Law):
    """c2 v abs(v), c2 > 0 [N s^2/m^2]; its second derivative jumps at v = 0."""

    cause: ClassVar[str] = "quadratic_damping"
    smooth: ClassVar[bool] = False
    c2: float

    @classmethod
    def draw(cls, rng: np.random.Generator, x: FloatArray, v: FloatArray, rms_force: float) -> Self:
        return cls(c2=rms_force / rms(v**2))

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, c2=factor * self.c2)

    def force(self, x: Any, v: Any, load: Any, mode: int) -> Any:
        return self.c2 * mode * v * v

    def first_mode(self, v: float, load: float) -> int:
        return sign(v) or sign(load) or 1

    def guard(self, mode: int, x: float, v: float) -> float:
        return mode * v

    def next_mode(self, mode: int, load: float) -> int:
        return -mode


@dataclasses.dataclass(frozen=True)
class Coulomb(Law):
    """F sgn v, F > 0 [N]; at v = 0 the mass sticks for as long as the load stays within -F and F."""

    cause: ClassVar[str] = "coulomb"
    smooth: ClassVar[bool] = False
    F: float

    @classmethod
    def draw(cls, rng: np.random.Generator, x: FloatArray, v: FloatArray, rms_force: float) -> Self:
        return cls(F=rms_force)

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, F=factor * self.F)

    def force(self, x: Any, v: Any, load: Any, mode: int) -> Any:
        return self.F * mode if mode else load

    def first_mode(self, v: float, load: float) -> int:
        return sign(v) or (sign(load) if abs(load) > self.F else 0)

    def guard(self, mode: int, x: float, v: float) -> float:
        return mode * v

    def next_mode(self, mode: int, load: float) -> int:
        if mode == 0:
            return sign(load)
        return sign(load) if abs(load) > self.F else 0

    def holds(self, mode: int) -> bool:
        return mode == 0

    def release(self, load: FloatArray) -> FloatArray:
        return self.F - np.abs(load)
