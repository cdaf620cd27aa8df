"""Springs whose force is not proportional to the stretch."""

import dataclasses
from typing import Any, ClassVar, Self

import numpy as np
from scipy.optimize import brentq

from ..arrays import FloatArray, rms
from ..plants import EscapeError
from .base import LARGEST_SHARE, SMALLEST_SHARE, Hidden, KinkedLaw, Law, Mode, Scene, either_sign, log_uniform

# Share of the displacement at which the total stiffness vanishes that a motion may reach: beyond it the plant is on its
# way over the edge, and the question becomes another one.
FAIR_REACH = 0.6


@dataclasses.dataclass(frozen=True)
class CubicHardening(Law):
    """k3 x^3, k3 > 0 [N/m^3]."""

    cause: ClassVar[str] = "cubic_hardening"
    k3: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        return cls(k3=rms_force / rms(scene.motion.x**3))

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, k3=factor * self.k3)

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return self.k3 * x * x * x


@dataclasses.dataclass(frozen=True)
class CubicSoftening(CubicHardening):
    """k3 x^3, k3 < 0 [N/m^3]; k + 3 k3 x^2 vanishes at sqrt(-k / (3 k3))."""

    cause: ClassVar[str] = "cubic_softening"

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        return cls(k3=-rms_force / rms(scene.motion.x**3))

    def reach(self, stiffness: float) -> float:
        return FAIR_REACH * float(np.sqrt(-stiffness / (3.0 * self.k3)))


@dataclasses.dataclass(frozen=True)
class QuadraticStiffness(Law):
    """k2 x^2, k2 of either sign [N/m^2]; k + 2 k2 x vanishes at -k / (2 k2)."""

    cause: ClassVar[str] = "quadratic_stiffness"
    k2: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        return cls(k2=either_sign(rng) * rms_force / rms(scene.motion.x**2))

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, k2=factor * self.k2)

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return self.k2 * x * x

    def reach(self, stiffness: float) -> float:
        return FAIR_REACH * stiffness / (2.0 * abs(self.k2))


@dataclasses.dataclass(frozen=True)
class QuinticStiffness(Law):
    """k5 x^5, k5 of either sign [N/m^5]; for k5 < 0, k + 5 k5 x^4 vanishes at (-k / (5 k5))^(1/4)."""

    cause: ClassVar[str] = "quintic_stiffness"
    k5: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        return cls(k5=either_sign(rng) * rms_force / rms(scene.motion.x**5))

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, k5=factor * self.k5)

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return self.k5 * x * x * x * x * x

    def reach(self, stiffness: float) -> float:
        return np.inf if self.k5 > 0.0 else FAIR_REACH * float((-stiffness / (5.0 * self.k5)) ** 0.25)


@dataclasses.dataclass(frozen=True)
class SquareStiffness(KinkedLaw):
    """k2 x abs(x), k2 of either sign [N/m^2]; for k2 < 0, k + 2 k2 abs(x) vanishes at -k / (2 k2)."""

    cause: ClassVar[str] = "square_stiffness"
    k2: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        return cls(k2=either_sign(rng) * rms_force / rms(scene.motion.x**2))

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, k2=factor * self.k2)

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return self.k2 * mode[0] * x * x

    def displacement_kinks(self, x: Any, v: Any, z: Hidden) -> tuple[Any, ...]:
        return (x,)

    def reach(self, stiffness: float) -> float:
        return np.inf if self.k2 > 0.0 else FAIR_REACH * -stiffness / (2.0 * self.k2)


@dataclasses.dataclass(frozen=True)
class SineStiffness(Law):
    """(k / s) sin(s x): k of either sign [N/m], s [1/m].

    Within one swing of s x = 2 a sine is nearly a straight line, so that a small one could not be told.
    """

    cause: ClassVar[str] = "sine_stiffness"
    shares: ClassVar[tuple[float, float]] = (0.15, LARGEST_SHARE)
    k: float
    s: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        s = float(rng.uniform(0.6, 2.0)) / scene.peak
        return cls(k=either_sign(rng) * rms_force * s / rms(np.sin(s * scene.motion.x)), s=s)

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, k=factor * self.k)

    def fits(self, scene: Scene) -> bool:
        return abs(self.k) < 0.9 * scene.plant.stiffness and 0.5 < self.s * scene.peak < 2.5

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return self.k / self.s * np.sin(self.s * x)


@dataclasses.dataclass(frozen=True)
class BilinearStiffness(KinkedLaw):
    """k (x - knot) where side (x - knot) > 0, else 0: k > 0 [N/m], knot [m], side 1 or -1."""

    cause: ClassVar[str] = "bilinear_stiffness"
    k: float
    knot: float
    side: int

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        knot, side = float(rng.uniform(-0.45, 0.45)) * scene.peak, int(rng.choice((-1, 1)))
        return cls(k=rms_force / rms(np.maximum(side * (scene.motion.x - knot), 0.0)), knot=knot, side=side)

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, k=factor * self.k)

    def fits(self, scene: Scene) -> bool:
        beyond = np.mean(self.side * (scene.motion.x - self.knot) > 0.0)
        return bool(0.02 < beyond < 0.98)

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return self.k * (x - self.knot) if mode[0] == self.side else 0.0 * x

    def displacement_kinks(self, x: Any, v: Any, z: Hidden) -> tuple[Any, ...]:
        return (x - self.knot,)


@dataclasses.dataclass(frozen=True)
class GapLaw(KinkedLaw):
    """A spring k > 0 [N/m] with kinks at x = -gap and x = gap [m]; dz(x) is 0 between them and x -+ gap outside."""

    chaotic: ClassVar[bool] = True
    k: float
    gap: float

    def fits(self, scene: Scene) -> bool:
        return 0.05 < self.gap / scene.peak < 0.9

    def displacement_kinks(self, x: Any, v: Any, z: Hidden) -> tuple[Any, ...]:
        return x - self.gap, x + self.gap

    def beyond(self, x: Any, mode: Mode) -> Any:
        """dz(x) [m]."""
        return x - self.gap if mode[0] > 0 else x + self.gap if mode[1] < 0 else 0.0 * x


def dead_zone(x: FloatArray, gap: float) -> FloatArray:
    """dz(x) along a motion (n,) [m]."""
    return x - np.clip(x, -gap, gap)


@dataclasses.dataclass(frozen=True)
class EndStop(GapLaw):
    """k dz(x): a second spring joins beyond the gap."""

    cause: ClassVar[str] = "end_stop"

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        gap = float(rng.uniform(0.1, 0.75)) * scene.peak
        return cls(k=rms_force / rms(dead_zone(scene.motion.x, gap)), gap=gap)

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, k=factor * self.k)

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return self.k * self.beyond(x, mode)


@dataclasses.dataclass(frozen=True)
class DeadZone(GapLaw):
    """-k (x - dz(x)): most or all of the spring acts only beyond the gap. The size of the effect is that of the gap."""

    cause: ClassVar[str] = "dead_zone"

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        k, x, peak = float(rng.uniform(0.5, 1.0)) * scene.plant.stiffness, scene.motion.x, scene.peak
        return cls(k=k, gap=_gap(lambda gap: k * rms(np.clip(x, -gap, gap)) - rms_force, peak))

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, gap=factor * self.gap)

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return -self.k * (x - self.beyond(x, mode))


@dataclasses.dataclass(frozen=True)
class Saturation(GapLaw):
    """-k dz(x): the force of a good part of the spring stops growing beyond the gap, which sets the effect's size."""

    cause: ClassVar[str] = "saturation"

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        k, x, peak = float(rng.uniform(0.3, 0.95)) * scene.plant.stiffness, scene.motion.x, scene.peak
        return cls(k=k, gap=_gap(lambda gap: k * rms(dead_zone(x, gap)) - rms_force, peak))

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, gap=factor**-0.5 * self.gap)

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return -self.k * self.beyond(x, mode)


def _gap(excess: Any, peak: float) -> float:
    """The gap between 5 and 85 % of the peak at which a force has the wanted size."""
    low, high = 0.05 * peak, 0.85 * peak
    if excess(low) * excess(high) > 0.0:
        raise EscapeError("no gap gives an effect of this size")
    return float(brentq(excess, low, high, rtol=1e-6))  # pyright: ignore[reportArgumentType]


@dataclasses.dataclass(frozen=True)
class DoubleWell(Law):
    """-k_neg x + k3 x^3, k_neg [N/m] above the plant's stiffness, k3 > 0 [N/m^3]: wells on both sides of a hill.

    The motion begins in a well. In half of the cases the wells are near against the motion without the law, so that the
    hill hardly stops it; in the others they are far, and it may stay in one of them.
    """

    cause: ClassVar[str] = "double_well"
    shares: ClassVar[tuple[float, float]] = (SMALLEST_SHARE, 5.0)  # it is larger than the spring that it takes away
    sized: ClassVar[bool] = False
    chaotic: ClassVar[bool] = True
    k_neg: float
    k3: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        stiffness, far = scene.plant.stiffness, bool(rng.random() < 0.5)
        k_neg = float(rng.uniform(1.2, 2.0)) * stiffness
        well = log_uniform(rng, *((0.7, 3.0) if far else (0.1, 0.4))) * scene.peak
        return cls(k_neg=k_neg, k3=(k_neg - stiffness) / well**2)

    def start(self, x: float, v: float, stiffness: float) -> tuple[float, float]:
        """About the bottom of a well, not about the top of the hill."""
        return x + float(np.sqrt((self.k_neg - stiffness) / self.k3)), v

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, k_neg=factor * self.k_neg, k3=factor * self.k3)

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return (self.k3 * x * x - self.k_neg) * x
