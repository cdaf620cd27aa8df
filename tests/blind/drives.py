"""Forces on the mass: smooth functions of time, so that the truth between samples is known."""

import dataclasses
from collections.abc import Callable
from typing import Any, Protocol, Self

import numpy as np

from .arrays import FloatArray


class Drive(Protocol):
    """A force g(t) [N]; called with one time [s] or with (n,) times, it returns as many values."""

    def __call__(self, t: Any) -> Any: ...

    def scaled(self, factor: float) -> Self: ...


@dataclasses.dataclass(frozen=True)
class Silence:
    """No force: a free decay."""

    def __call__(self, t: Any) -> Any:
        return 0.0 * t

    def scaled(self, factor: float) -> Self:
        return self


@dataclasses.dataclass(frozen=True)
class SumOfSines:
    """sum_i amplitude_i cos(omega_i t + phase_i); all (lines,), in N, rad/s and rad."""

    amplitude: FloatArray
    omega: FloatArray
    phase: FloatArray

    def __call__(self, t: Any) -> Any:
        if isinstance(t, float):  # the integrator's call, where an outer product costs more than the cosines
            return np.cos(t * self.omega + self.phase) @ self.amplitude
        return np.cos(np.multiply.outer(t, self.omega) + self.phase) @ self.amplitude

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, amplitude=factor * self.amplitude)


@dataclasses.dataclass(frozen=True)
class Sweep:
    """amplitude cos(phase + omega t + rate t^2 / 2): N, rad, rad/s and rad/s^2."""

    amplitude: float
    omega: float
    rate: float
    phase: float

    def __call__(self, t: Any) -> Any:
        return self.amplitude * np.cos(self.phase + (self.omega + 0.5 * self.rate * t) * t)

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, amplitude=factor * self.amplitude)


def draw_multisine(rng: np.random.Generator, omega_0: float, duration: float) -> SumOfSines:
    """10 to 40 lines of equal amplitude on the grid of the record's own period, up to 2.5 times the mode."""
    step = 2.0 * np.pi / duration
    grid = np.arange(np.ceil(0.15 * omega_0 / step), np.floor(rng.uniform(1.6, 2.5) * omega_0 / step))
    lines = min(int(rng.integers(10, 41)), grid.size)
    return SumOfSines(
        amplitude=np.ones(lines),
        omega=np.multiply(step, rng.choice(grid, size=lines, replace=False)),
        phase=rng.uniform(0.0, 2.0 * np.pi, lines),
    )


def draw_noise(rng: np.random.Generator, omega_0: float, duration: float) -> SumOfSines:
    """Gaussian noise of flat spectrum up to 1.5 to 3 times the mode, never repeating: 100 lines off any grid."""
    lines = 100
    edges = np.linspace(0.05, rng.uniform(1.5, 3.0), lines + 1) * omega_0
    return SumOfSines(
        amplitude=rng.rayleigh(size=lines),
        omega=rng.uniform(edges[:-1], edges[1:]),
        phase=rng.uniform(0.0, 2.0 * np.pi, lines),
    )


def draw_sweep(rng: np.random.Generator, omega_0: float, duration: float) -> Sweep:
    """Linear in frequency through the mode, upwards or downwards."""
    ends = np.array([rng.uniform(0.3, 0.6), rng.uniform(1.5, 2.2)]) * omega_0
    first, last = rng.permutation(ends)
    return Sweep(1.0, float(first), float((last - first) / duration), float(rng.uniform(0.0, 2.0 * np.pi)))


def draw_harmonic(rng: np.random.Generator, omega_0: float, duration: float) -> SumOfSines:
    """One line between half and one and a half times the mode."""
    return SumOfSines(np.ones(1), rng.uniform(0.5, 1.5, 1) * omega_0, rng.uniform(0.0, 2.0 * np.pi, 1))


def draw_free_decay(rng: np.random.Generator, omega_0: float, duration: float) -> Silence:
    return Silence()


DRIVES: dict[str, Callable[[np.random.Generator, float, float], Drive]] = {
    "multisine": draw_multisine,
    "noise": draw_noise,
    "sweep": draw_sweep,
    "free_decay": draw_free_decay,
    "harmonic": draw_harmonic,
}
