"""Dampers whose force is not proportional to the velocity. Their modes are the sign of v; 0 is sticking."""

import dataclasses
from typing import Any, ClassVar, Self

import numpy as np

from ..arrays import FloatArray, rms
from .base import Hidden, KinkedLaw, Law, Mode, Scene, sign


@dataclasses.dataclass(frozen=True)
class QuadraticDamping(Law):
    """c2 v abs(v), c2 > 0 [N s^2/m^2]; its second derivative jumps at v = 0."""

    cause: ClassVar[str] = "quadratic_damping"
    smooth: ClassVar[bool] = False
    c2: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        return cls(c2=rms_force / rms(scene.motion.v**2))

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, c2=factor * self.c2)

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return self.c2 * mode * v * v

    def first_mode(self, x: float, v: float, z: Hidden, t: float, load: float) -> Mode:
        return sign(v) or sign(load) or 1

    def velocity_guards(self, mode: Mode, x: Any, v: Any, z: Hidden) -> tuple[Any, ...]:
        return (mode * v,)

    def next_mode(self, mode: Mode, which: int, load: float) -> Mode:
        return -mode


@dataclasses.dataclass(frozen=True)
class DryFriction(Law):
    """A force against the motion; at v = 0 the mass sticks for as long as the load stays within the limits."""

    smooth: ClassVar[bool] = False
    dry: ClassVar[bool] = True

    @property
    def limits(self) -> tuple[float, float]:
        """Least and largest load [N] under which the mass sticks."""
        raise NotImplementedError

    def sliding(self, v: Any, mode: Mode) -> Any:
        """Force [N] while it slides towards `mode`."""
        raise NotImplementedError

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return self.sliding(v, mode) if mode else load

    def _from_rest(self, load: float) -> Mode:
        low, high = self.limits
        return sign(load) if not low <= load <= high else 0

    def first_mode(self, x: float, v: float, z: Hidden, t: float, load: float) -> Mode:
        return sign(v) or self._from_rest(load)

    def velocity_guards(self, mode: Mode, x: Any, v: Any, z: Hidden) -> tuple[Any, ...]:
        return (mode * v,)

    def next_mode(self, mode: Mode, which: int, load: float) -> Mode:
        return sign(load) if mode == 0 else self._from_rest(load)

    def holds(self, mode: Mode) -> bool:
        return mode == 0

    def release(self, load: FloatArray) -> FloatArray:
        low, high = self.limits
        return np.minimum(high - load, load - low)


@dataclasses.dataclass(frozen=True)
class Coulomb(DryFriction):
    """F sgn v, F > 0 [N]; at v = 0 the mass sticks for as long as the load stays within -F and F."""

    cause: ClassVar[str] = "coulomb"
    F: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        return cls(F=rms_force)

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, F=factor * self.F)

    @property
    def limits(self) -> tuple[float, float]:
        return -self.F, self.F

    def sliding(self, v: Any, mode: Mode) -> Any:
        return self.F * mode


@dataclasses.dataclass(frozen=True)
class CoulombAsymmetric(DryFriction):
    """F_plus for v > 0, -F_minus for v < 0, both positive [N]; the larger is 1.4 to 4 times the smaller."""

    cause: ClassVar[str] = "coulomb_asymmetric"
    F_plus: float
    F_minus: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        small, large = rms_force, float(rng.uniform(1.4, 4.0)) * rms_force
        unit = rms_force / float(np.sqrt(0.5 * (small**2 + large**2)))
        plus, minus = rng.permutation([small, large])
        return cls(F_plus=float(unit * plus), F_minus=float(unit * minus))

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, F_plus=factor * self.F_plus, F_minus=factor * self.F_minus)

    @property
    def limits(self) -> tuple[float, float]:
        return -self.F_minus, self.F_plus

    def sliding(self, v: Any, mode: Mode) -> Any:
        return self.F_plus if mode > 0 else -self.F_minus


@dataclasses.dataclass(frozen=True)
class Stribeck(DryFriction):
    """sgn v (F + (F_static - F) exp(-(v / v_s)^2)): F, F_static > F [N], v_s [m/s]."""

    cause: ClassVar[str] = "stribeck"
    F: float
    F_static: float
    v_s: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        ratio, v_s = float(rng.uniform(1.3, 2.5)), float(rng.uniform(0.1, 0.5)) * scene.v_rms
        F = rms_force / rms(1.0 + (ratio - 1.0) * np.exp(-((scene.motion.v / v_s) ** 2)))
        return cls(F=F, F_static=ratio * F, v_s=v_s)

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, F=factor * self.F, F_static=factor * self.F_static)

    def fits(self, scene: Scene) -> bool:
        return 0.07 < self.v_s / scene.v_rms < 0.7

    @property
    def limits(self) -> tuple[float, float]:
        return -self.F_static, self.F_static

    def sliding(self, v: Any, mode: Mode) -> Any:
        return mode * (self.F + (self.F_static - self.F) * np.exp(-((v / self.v_s) ** 2)))


@dataclasses.dataclass(frozen=True)
class SmoothCoulomb(Law):
    """F tanh(v / v_s): F [N], v_s [m/s]."""

    cause: ClassVar[str] = "smooth_coulomb"
    F: float
    v_s: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        v_s = float(rng.uniform(0.1, 0.4)) * scene.v_rms
        return cls(F=rms_force / rms(np.tanh(scene.motion.v / v_s)), v_s=v_s)

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, F=factor * self.F)

    def fits(self, scene: Scene) -> bool:
        return 0.07 < self.v_s / scene.v_rms < 0.6

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return self.F * np.tanh(v / self.v_s)


@dataclasses.dataclass(frozen=True)
class CubicDamping(Law):
    """c3 v^3, c3 > 0 [N s^3/m^3]."""

    cause: ClassVar[str] = "cubic_damping"
    c3: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        return cls(c3=rms_force / rms(scene.motion.v**3))

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, c3=factor * self.c3)

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return self.c3 * v * v * v


@dataclasses.dataclass(frozen=True)
class PowerDamping(KinkedLaw):
    """c abs(v)^n sgn v, c > 0 [N (s/m)^n]; n well away from 0, 1, 2 and 3, where the law has another name."""

    cause: ClassVar[str] = "power_damping"
    creeps: ClassVar[bool] = True
    c: float
    n: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        low, high = ((0.3, 0.7), (1.4, 1.6), (2.4, 2.6))[rng.choice(3, p=(0.5, 0.3, 0.2))]
        n = float(rng.uniform(low, high))
        return cls(c=rms_force / rms(np.abs(scene.motion.v) ** n), n=n)

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, c=factor * self.c)

    def fits(self, scene: Scene) -> bool:
        """Whether no reversal comes under a small load: below n = 1 the mass would all but stick there, and creep."""
        if self.n > 1.0:
            return True
        v, acceleration = scene.motion.v, scene.motion.acceleration
        turns = np.flatnonzero(v[1:] * v[:-1] <= 0.0)
        before = np.abs(v[turns]) / np.maximum(np.abs(v[turns]) + np.abs(v[turns + 1]), np.finfo(float).tiny)
        load = scene.plant.mass * (acceleration[turns] + before * (acceleration[turns + 1] - acceleration[turns]))
        return bool(np.abs(load).min(initial=np.inf) > 0.03 * self.c * scene.v_rms**self.n)

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return self.c * mode[0] * abs(v) ** self.n

    def velocity_kinks(self, x: Any, v: Any, z: Hidden) -> tuple[Any, ...]:
        return (v,)


@dataclasses.dataclass(frozen=True)
class VanDerPol(Law):
    """eps ((x / x0)^2 - 1) v: eps > 0 [N s/m], x0 [m]. Small motions are driven, large ones braked."""

    cause: ClassVar[str] = "van_der_pol"
    chaotic: ClassVar[bool] = True
    eps: float
    x0: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        x0 = float(rng.uniform(0.6, 1.4)) * scene.x_rms
        return cls(eps=rms_force / rms(((scene.motion.x / x0) ** 2 - 1.0) * scene.motion.v), x0=x0)

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, eps=factor * self.eps)

    def fits(self, scene: Scene) -> bool:
        return 0.4 < self.x0 / scene.x_rms < 1.8

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return self.eps * ((x / self.x0) * (x / self.x0) - 1.0) * v


@dataclasses.dataclass(frozen=True)
class PositionDamping(Law):
    """c x^2 v, c > 0 [N s/m^3]."""

    cause: ClassVar[str] = "position_damping"
    c: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        return cls(c=rms_force / rms(scene.motion.x**2 * scene.motion.v))

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, c=factor * self.c)

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return self.c * x * x * v


@dataclasses.dataclass(frozen=True)
class BilinearDamping(KinkedLaw):
    """dc v where side v > 0, else 0: dc > 0 [N s/m], side 1 or -1."""

    cause: ClassVar[str] = "bilinear_damping"
    dc: float
    side: int

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        side = int(rng.choice((-1, 1)))
        return cls(dc=rms_force / rms(np.maximum(side * scene.motion.v, 0.0)), side=side)

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, dc=factor * self.dc)

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return self.dc * v if mode[0] == self.side else 0.0 * v

    def velocity_kinks(self, x: Any, v: Any, z: Hidden) -> tuple[Any, ...]:
        return (v,)
