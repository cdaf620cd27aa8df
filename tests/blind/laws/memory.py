"""Links that remember: hysteresis, sliders, viscoelasticity, an attached mass, a force that comes late."""

import dataclasses
from typing import Any, ClassVar, Literal, Self

import numpy as np

from ..arrays import FloatArray
from .base import Hidden, KinkedLaw, Law, Mode, Scene, either_sign, log_uniform, sign
from .damping import Stribeck


@dataclasses.dataclass(frozen=True)
class BoucWen(KinkedLaw):
    """k z, z' = v - beta abs(v) abs(z)^(n-1) z - gamma v abs(z)^n; z stays within (beta + gamma)^(-1/n) [m]."""

    cause: ClassVar[str] = "bouc_wen"
    hidden: ClassVar[tuple[Literal["displacement", "velocity"], ...]] = ("displacement",)
    k: float
    beta: float
    gamma: float
    n: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        z_max = log_uniform(rng, 0.3, 1.2) * scene.x_rms
        n, ratio = float(rng.choice((1.0, 1.5, 2.0))), float(rng.uniform(-0.3, 1.0))  # ratio: gamma / beta
        beta = z_max**-n / (1.0 + ratio)
        return cls(k=rms_force / min(0.7 * z_max, scene.x_rms), beta=beta, gamma=ratio * beta, n=n)

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, k=factor * self.k)

    @property
    def z_max(self) -> float:
        """Bound of abs(z) [m]."""
        return (self.beta + self.gamma) ** (-1.0 / self.n)

    def fits(self, scene: Scene) -> bool:
        return 0.2 < self.z_max / scene.x_rms < 1.6

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return self.k * z[0]

    def hidden_rates(self, x: Any, v: Any, z: Hidden, mode: Mode) -> Hidden:
        way, side = mode
        return (v * (1.0 - (self.beta * way * side + self.gamma) * abs(z[0]) ** self.n),)

    def velocity_kinks(self, x: Any, v: Any, z: Hidden) -> tuple[Any, ...]:
        return (v,)

    def displacement_kinks(self, x: Any, v: Any, z: Hidden) -> tuple[Any, ...]:
        return (z[0],)


@dataclasses.dataclass(frozen=True)
class Jenkins(Law):
    """A spring k [N/m] in series with a slider: k z, abs(z) <= slip [m].

    Mode 0 sticks, z' = v; modes 1 and -1 slide at z = slip and z = -slip.
    """

    cause: ClassVar[str] = "jenkins"
    smooth: ClassVar[bool] = False
    hidden: ClassVar[tuple[Literal["displacement", "velocity"], ...]] = ("displacement",)
    k: float
    slip: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        slip = float(rng.uniform(0.3, 1.1)) * scene.x_rms
        return cls(k=rms_force / min(0.8 * slip, scene.x_rms), slip=slip)

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, k=factor * self.k)

    def fits(self, scene: Scene) -> bool:
        return 0.2 < self.slip / scene.x_rms < 1.5

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return self.k * z[0]

    def hidden_rates(self, x: Any, v: Any, z: Hidden, mode: Mode) -> Hidden:
        return (0.0 * v if mode else v,)

    def confined(self, z: Hidden) -> Hidden:
        return (min(max(z[0], -self.slip), self.slip),)

    def first_mode(self, x: float, v: float, z: Hidden, t: float, load: float) -> Mode:
        return sign(v) if abs(z[0]) >= self.slip and z[0] * v > 0.0 else 0

    def velocity_guards(self, mode: Mode, x: Any, v: Any, z: Hidden) -> tuple[Any, ...]:
        return (mode * v,) if mode else ()

    def displacement_guards(self, mode: Mode, x: Any, v: Any, z: Hidden) -> tuple[Any, ...]:
        return () if mode else (self.slip - z[0], self.slip + z[0])

    def next_mode(self, mode: Mode, which: int, load: float) -> Mode:
        return 0 if mode else (1, -1)[which]


@dataclasses.dataclass(frozen=True)
class FreePlay(Law):
    """k dz(z), z = x - s: a spring k [N/m] behind a gap [m] drags a slider at s by F_plus or back by F_minus [N].

    Mode 0 is inside the gap, 1 and -1 press the spring against the slider at rest, 2 and -2 drag it. The slider starts
    in the middle of its gap.
    """

    cause: ClassVar[str] = "free_play"
    smooth: ClassVar[bool] = False
    hidden: ClassVar[tuple[Literal["displacement", "velocity"], ...]] = ("displacement",)
    k: float
    gap: float
    F_plus: float
    F_minus: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        """A gap of 10 to 40 % of the peak and a spring that yields within another 5 to 30 % of it."""
        gap, stretch, peak = float(rng.uniform(0.1, 0.4)), log_uniform(rng, 0.05, 0.3), scene.peak
        plus, minus = rng.uniform(0.7, 1.4, 2)
        size = 1.5 * rms_force
        return cls(k=size / (stretch * peak), gap=gap * peak, F_plus=float(plus * size), F_minus=float(minus * size))

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, k=factor * self.k, F_plus=factor * self.F_plus, F_minus=factor * self.F_minus)

    def fits(self, scene: Scene) -> bool:
        """Whether the slider is dragged, and the gap is a good part of the motion."""
        high, low = self._bounds
        return high - low < 1.6 * scene.peak and self.gap > 0.05 * scene.peak

    @property
    def _bounds(self) -> tuple[float, float]:
        """Largest and least z [m], where the slider is dragged."""
        return self.gap + self.F_plus / self.k, -self.gap - self.F_minus / self.k

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return self.k * (z[0] - sign(mode) * self.gap) if mode else 0.0 * z[0]

    def hidden_rates(self, x: Any, v: Any, z: Hidden, mode: Mode) -> Hidden:
        return (0.0 * v if abs(mode) == 2 else v,)

    def confined(self, z: Hidden) -> Hidden:
        high, low = self._bounds
        return (min(max(z[0], low), high),)

    def first_mode(self, x: float, v: float, z: Hidden, t: float, load: float) -> Mode:
        high, low = self._bounds
        if abs(z[0]) <= self.gap:
            return 0
        dragged = (z[0] >= high and v > 0.0) or (z[0] <= low and v < 0.0)
        return sign(z[0]) * (2 if dragged else 1)

    def velocity_guards(self, mode: Mode, x: Any, v: Any, z: Hidden) -> tuple[Any, ...]:
        return (sign(mode) * v,) if abs(mode) == 2 else ()

    def displacement_guards(self, mode: Mode, x: Any, v: Any, z: Hidden) -> tuple[Any, ...]:
        if mode == 0:
            return self.gap - z[0], self.gap + z[0]
        if abs(mode) == 1:
            high, low = self._bounds
            return (z[0] - self.gap, high - z[0]) if mode > 0 else (-self.gap - z[0], z[0] - low)
        return ()

    def next_mode(self, mode: Mode, which: int, load: float) -> Mode:
        if mode == 0:
            return (1, -1)[which]
        return sign(mode) * ((0, 2)[which] if abs(mode) == 1 else 1)


@dataclasses.dataclass(frozen=True)
class LuGre(KinkedLaw):
    """sigma0 z + sigma1 z', z' = v - sigma0 abs(v) z / h(v), h = F + (F_static - F) exp(-(v / v_s)^2).

    The bristle bends by 2 to 10 % of the motion before it slides, and swings with 30 to 100 % of critical damping.
    """

    cause: ClassVar[str] = "lugre"
    dry: ClassVar[bool] = True  # its twin is
    slack: ClassVar[float] = 1e-11  # its swings die out, and those left by the integrator's rounding need no events
    hidden: ClassVar[tuple[Literal["displacement", "velocity"], ...]] = ("displacement",)
    F: float
    F_static: float
    v_s: float
    sigma0: float
    sigma1: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        F, ratio, v_s = rms_force, float(rng.uniform(1.1, 2.0)), float(rng.uniform(0.1, 0.5)) * scene.v_rms
        sigma0 = F / (log_uniform(rng, 0.02, 0.1) * scene.x_rms)
        sigma1 = 2.0 * float(rng.uniform(0.3, 1.0)) * float(np.sqrt(sigma0 * scene.plant.mass))
        return cls(F=F, F_static=ratio * F, v_s=v_s, sigma0=sigma0, sigma1=sigma1)

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(
            self, F=factor * self.F, F_static=factor * self.F_static, sigma0=factor * self.sigma0,
            sigma1=factor**0.5 * self.sigma1,
        )  # fmt: skip

    def fits(self, scene: Scene) -> bool:
        return self.F / self.sigma0 < 0.15 * scene.x_rms and 0.07 < self.v_s / scene.v_rms < 0.7

    @property
    def twin(self) -> Law:
        """The same friction without its bristle, which is much stiffer than the plant."""
        return Stribeck(F=self.F, F_static=self.F_static, v_s=self.v_s)

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return self.sigma0 * z[0] + self.sigma1 * self.hidden_rates(x, v, z, mode)[0]

    def hidden_rates(self, x: Any, v: Any, z: Hidden, mode: Mode) -> Hidden:
        h = self.F + (self.F_static - self.F) * np.exp(-((v / self.v_s) ** 2))
        return (v * (1.0 - self.sigma0 * mode[0] * z[0] / h),)

    def velocity_kinks(self, x: Any, v: Any, z: Hidden) -> tuple[Any, ...]:
        return (v,)


@dataclasses.dataclass(frozen=True)
class Maxwell(Law):
    """k z, z' = v - z / tau: a spring [N/m] behind a dashpot, which relaxes within tau [s]."""

    cause: ClassVar[str] = "maxwell"
    hidden: ClassVar[tuple[Literal["displacement", "velocity"], ...]] = ("displacement",)
    k: float
    tau: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        beat = log_uniform(rng, 0.2, 5.0)  # tau times the plant's frequency
        size = beat / np.hypot(1.0, beat) * scene.x_rms
        return cls(k=float(rms_force / size), tau=beat / scene.plant.omega)

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, k=factor * self.k)

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return self.k * z[0]

    def hidden_rates(self, x: Any, v: Any, z: Hidden, mode: Mode) -> Hidden:
        return (v - z[0] / self.tau,)

    def hidden_at_rest(self, x: float, z: Hidden, elapsed: Any) -> Hidden:
        return (z[0] * np.exp(-elapsed / self.tau),)


@dataclasses.dataclass(frozen=True)
class AttachedOscillator(Law):
    """A mass m [kg] on a spring and a damper (omega [rad/s], zeta) of its own rides on the plant's mass.

    Its hidden states are its own displacement and velocity; at the start it moves with its host.
    """

    cause: ClassVar[str] = "attached_oscillator"
    hidden: ClassVar[tuple[Literal["displacement", "velocity"], ...]] = ("displacement", "velocity")
    m: float
    omega: float
    zeta: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        return cls(
            m=log_uniform(rng, 0.03, 0.2) * scene.plant.mass,
            omega=log_uniform(rng, 0.5, 2.0) * scene.plant.omega,
            zeta=log_uniform(rng, 0.005, 0.05),
        )

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, m=factor * self.m)

    def fits(self, scene: Scene) -> bool:
        return 0.03 < self.m / scene.plant.mass < 0.2

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return self.m * self.omega * (self.omega * (x - z[0]) + 2.0 * self.zeta * (v - z[1]))

    def hidden_start(self, x: float, v: float) -> Hidden:
        return (x, v)

    def hidden_rates(self, x: Any, v: Any, z: Hidden, mode: Mode) -> Hidden:
        return (z[1], self.omega * (self.omega * (x - z[0]) + 2.0 * self.zeta * (v - z[1])))

    def hidden_at_rest(self, x: float, z: Hidden, elapsed: Any) -> Hidden:
        """A free decay about x."""
        decay, stretch, rate = self.zeta * self.omega, z[0] - x, z[1]
        omega = self.omega * np.sqrt(1.0 - self.zeta**2)
        size, cos, sin = np.exp(-decay * elapsed), np.cos(omega * elapsed), np.sin(omega * elapsed) / omega
        return (
            x + size * (stretch * cos + (rate + decay * stretch) * sin),
            size * (rate * cos - (decay * rate + self.omega**2 * stretch) * sin),
        )


@dataclasses.dataclass(frozen=True)
class DelayedForce(Law):
    """k x(t - tau), k of either sign [N/m], tau [s]; before the start x is the starting value."""

    cause: ClassVar[str] = "delayed_force"
    k: float
    tau: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        return cls(k=either_sign(rng) * rms_force / scene.x_rms, tau=log_uniform(rng, 0.2, 2.0) / scene.plant.omega)

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, k=factor * self.k)

    @property
    def delay(self) -> float:
        return self.tau

    def fits(self, scene: Scene) -> bool:
        """Whether the plant with it is stable: a force of the spring's sign that comes late feeds the motion."""
        m, c, k = scene.plant.mass, scene.plant.damping, scene.plant.stiffness
        s = 1j * scene.plant.omega
        for _ in range(50):  # Newton on the characteristic equation
            late = self.k * np.exp(-s * self.tau)
            s -= (m * s * s + c * s + k + late) / (2.0 * m * s + c - self.tau * late)
        return bool(s.real < 0.0)

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return self.k * z[0]

    def stops(self, begin: float, end: float) -> FloatArray:
        """Every delay: a step then looks back on finished steps only, and the start's kink lies on their ends."""
        return begin + self.tau * np.arange(1.0, int((end - begin) / self.tau) + 1, dtype=float)
