"""Laws that no catalogue names: what is asked about them is whether the tool says so."""

import abc
import dataclasses
from typing import Any, ClassVar, Self

import numpy as np

from ..arrays import rms
from .base import Hidden, KinkedLaw, Mode, Scene, either_sign


@dataclasses.dataclass(frozen=True)
class Outside(KinkedLaw):
    """F times a shape of x / x_0 and v / v_0, the rms of the motion it was made for; F of any unit of force [N]."""

    smooth: ClassVar[bool] = True  # but where it has kinks
    F: float
    x0: float
    v0: float

    @staticmethod
    @abc.abstractmethod
    def shape(x: Any, v: Any, mode: Mode) -> Any:
        """The law in units of its own; `mode` holds the signs of its kinks."""

    @classmethod
    def sign(cls, rng: np.random.Generator) -> float:
        """Sign of the force; a law that takes energy out has no choice."""
        return 1.0

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        unit, x, v = cls(1.0, scene.x_rms, scene.v_rms), scene.motion.x, scene.motion.v
        mode = tuple(np.sign(y) for y in unit.velocity_kinks(x, v, ()) + unit.displacement_kinks(x, v, ()))
        return unit.scaled(cls.sign(rng) * rms_force / rms(unit.force(x, v, (), 0.0, 0.0, mode)))

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, F=factor * self.F)

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return self.F * self.shape(x / self.x0, v / self.v0, mode)


@dataclasses.dataclass(frozen=True)
class SpeedStiffness(Outside):
    """x abs(v): a spring that stiffens with speed."""

    cause: ClassVar[str] = "speed_stiffness"
    smooth: ClassVar[bool] = False

    def velocity_kinks(self, x: Any, v: Any, z: Hidden) -> tuple[Any, ...]:
        return (v,)

    @staticmethod
    def shape(x: Any, v: Any, mode: Mode) -> Any:
        return x * v * mode[0]


@dataclasses.dataclass(frozen=True)
class FadingFriction(Outside):
    """tanh(4 v) exp(-v^2): friction that is gone at speed."""

    cause: ClassVar[str] = "fading_friction"

    @staticmethod
    def shape(x: Any, v: Any, mode: Mode) -> Any:
        return np.tanh(4.0 * v) * np.exp(-v * v)


@dataclasses.dataclass(frozen=True)
class Bump(Outside):
    """sin(4 x) exp(-2 x^2): a spring in the middle only, with a wave in it."""

    cause: ClassVar[str] = "bump"

    @classmethod
    def sign(cls, rng: np.random.Generator) -> float:
        return either_sign(rng)

    @staticmethod
    def shape(x: Any, v: Any, mode: Mode) -> Any:
        return np.sin(4.0 * x) * np.exp(-2.0 * x * x)


@dataclasses.dataclass(frozen=True)
class WedgeFriction(Outside):
    """x^2 tanh(6 v): friction that grows with the square of the stretch."""

    cause: ClassVar[str] = "wedge_friction"

    @staticmethod
    def shape(x: Any, v: Any, mode: Mode) -> Any:
        return x * x * np.tanh(6.0 * v)


@dataclasses.dataclass(frozen=True)
class WavyDamping(Outside):
    """v cos(2 v)^2: a damping that comes and goes with speed."""

    cause: ClassVar[str] = "wavy_damping"

    @staticmethod
    def shape(x: Any, v: Any, mode: Mode) -> Any:
        return v * np.cos(2.0 * v) ** 2


@dataclasses.dataclass(frozen=True)
class HalfDamping(Outside):
    """v max(x, 0): a damper that acts on one side of the middle."""

    cause: ClassVar[str] = "half_damping"
    smooth: ClassVar[bool] = False

    def displacement_kinks(self, x: Any, v: Any, z: Hidden) -> tuple[Any, ...]:
        return (x,)

    @staticmethod
    def shape(x: Any, v: Any, mode: Mode) -> Any:
        return v * x * (1.0 + mode[0]) / 2.0


@dataclasses.dataclass(frozen=True)
class Whirl(Outside):
    """x v^2, as where an inertia changes with the stretch."""

    cause: ClassVar[str] = "whirl"

    @classmethod
    def sign(cls, rng: np.random.Generator) -> float:
        return either_sign(rng)

    @staticmethod
    def shape(x: Any, v: Any, mode: Mode) -> Any:
        return x * v * v


@dataclasses.dataclass(frozen=True)
class SlantedDamping(Outside):
    """x v: a damper on one side of the middle, a drive on the other."""

    cause: ClassVar[str] = "slanted_damping"

    @staticmethod
    def shape(x: Any, v: Any, mode: Mode) -> Any:
        return x * v
