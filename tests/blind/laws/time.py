"""Springs and dampers that change with time."""

import dataclasses
from typing import Any, ClassVar, Self

import numpy as np

from ..arrays import FloatArray, rms
from .base import Hidden, Law, Mode, Scene, either_sign, log_uniform


@dataclasses.dataclass(frozen=True)
class StiffnessDrift(Law):
    """rate (t - t_ref) x, rate of either sign [N/(m s)]; by the end of the record 5 to 40 % of the stiffness.

    The plant's values are those at the start, t_ref = 0.
    """

    cause: ClassVar[str] = "stiffness_drift"
    rate: float
    t_ref: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        return cls(rate=either_sign(rng) * rms_force / rms(scene.motion.time * scene.motion.x), t_ref=0.0)

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, rate=factor * self.rate)

    def fits(self, scene: Scene) -> bool:
        return 0.05 < abs(self.rate) * scene.duration / scene.plant.stiffness < 0.4

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return self.rate * (t - self.t_ref) * x


@dataclasses.dataclass(frozen=True)
class DampingDrift(Law):
    """rate (t - t_ref) v, rate of either sign [N/m]; the damping stays positive. The effect's size sets the rate.

    The plant's values are those at the start, t_ref = 0.
    """

    cause: ClassVar[str] = "damping_drift"
    rate: float
    t_ref: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        way = float(rng.choice((1.0, -1.0), p=(0.75, 0.25)))
        return cls(rate=way * rms_force / rms(scene.motion.time * scene.motion.v), t_ref=0.0)

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, rate=factor * self.rate)

    def fits(self, scene: Scene) -> bool:
        return self.rate * scene.duration > -0.9 * scene.plant.damping

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return self.rate * (t - self.t_ref) * v


@dataclasses.dataclass(frozen=True)
class StiffnessDrop(Law):
    """-dk x for t > t_star: dk > 0 [N/m], up to 60 % of the stiffness, t_star [s] in the record's middle 60 %.

    Mode 0 is before the instant, mode 1 after it.
    """

    cause: ClassVar[str] = "stiffness_drop"
    dk: float
    t_star: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        t_star = float(scene.motion.time[0] + rng.uniform(0.2, 0.8) * scene.duration)
        return cls(dk=rms_force / rms((scene.motion.time > t_star) * scene.motion.x), t_star=t_star)

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, dk=factor * self.dk)

    def fits(self, scene: Scene) -> bool:
        return self.dk < 0.6 * scene.plant.stiffness

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return -self.dk * x if mode else 0.0 * x

    def first_mode(self, x: float, v: float, z: Hidden, t: float, load: float) -> Mode:
        return int(t > self.t_star)

    def stops(self, begin: float, end: float) -> FloatArray:
        return np.array([self.t_star]) if begin < self.t_star < end else np.empty(0)

    def mode_after_stop(self, mode: Mode, t: float) -> Mode:
        return int(t >= self.t_star)


@dataclasses.dataclass(frozen=True)
class ParametricStiffness(Law):
    """dk cos(omega t + phase) x: dk > 0 [N/m], omega [rad/s] 0.1 to 2 times the plant's, phase [rad]."""

    cause: ClassVar[str] = "parametric_stiffness"
    dk: float
    omega: float
    phase: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        return cls(
            dk=float(np.sqrt(2.0)) * rms_force / scene.x_rms,
            omega=log_uniform(rng, 0.1, 2.0) * scene.plant.omega,
            phase=float(rng.uniform(-np.pi, np.pi)),
        )

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, dk=factor * self.dk)

    def fits(self, scene: Scene) -> bool:
        return self.dk < 0.7 * scene.plant.stiffness

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return self.dk * np.cos(self.omega * t + self.phase) * x
