"""Laws that no catalogue names: what is asked about them is whether the tool says so."""

import abc
import dataclasses
from typing import Any, ClassVar, Self

import numpy as np

from ..arrays import rms
from .base import Hidden, KinkedLaw, Law, Mode, Scene, either_sign


@dataclasses.dataclass(frozen=True)
class Outside(Law):
    """F times a shape of x / x_0 and v / v_0, the rms of the motion it was made for; F of any unit of force [N]."""

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
    def signs(cls, x: Any, v: Any) -> Mode:
        """Signs of its kinks along a motion."""
        return ()

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        x, v = scene.motion.x / scene.x_rms, scene.motion.v / scene.v_rms
        size = rms_force / rms(cls.shape(x, v, cls.signs(x, v)))
        return cls(cls.sign(rng) * size, scene.x_rms, scene.v_rms)

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, F=factor * self.F)

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return self.F * self.shape(x / self.x0, v / self.v0, mode)


@dataclasses.dataclass(frozen=True)
class SpeedStiffness(KinkedLaw, Outside):
    """x abs(v): a spring that stiffens with speed."""

    cause: ClassVar[str] = "speed_stiffness"

    @classmethod
    def signs(cls, x: Any, v: Any) -> Mode:
        return (np.sign(v),)

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
class HalfDamping(KinkedLaw, Outside):
    """v max(x, 0): a damper that acts on one side of the middle."""

    cause: ClassVar[str] = "half_damping"

    @classmethod
    def signs(cls, x: Any, v: Any) -> Mode:
        return (np.sign(x),)

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
