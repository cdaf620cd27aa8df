"""One mass on a spring and a damper, its motion, and a quick sketch of it."""

import dataclasses
from typing import TypeAlias

import numpy as np

from .drives import Drive
from .laws.base import FloatArray, Law, rms

State: TypeAlias = tuple[float, float]  # x [m], v [m/s]


class EscapeError(ArithmeticError):
    """The motion left the region in which the plant is a fair question."""


@dataclasses.dataclass(frozen=True)
class Plant:
    """Mass [kg], stiffness [N/m], damping [N s/m]."""

    mass: float
    stiffness: float
    damping: float

    @property
    def omega(self) -> float:
        """Undamped natural frequency [rad/s]."""
        return float(np.sqrt(self.stiffness / self.mass))

    @property
    def damping_ratio(self) -> float:
        return self.damping / (2.0 * self.mass * self.omega)


@dataclasses.dataclass(frozen=True)
class Motion:
    """A motion on its sample times, (n,) in SI; `instants` (events,) [s] is when the law changed its mode."""

    time: FloatArray
    x: FloatArray
    v: FloatArray
    acceleration: FloatArray
    effect: FloatArray
    instants: FloatArray

    def shares(self, plant: Plant) -> tuple[float, float]:
        """Rms of the effect over rms of the linear link's force; the same for what no other k and c could take up."""
        link = rms(plant.stiffness * self.x + plant.damping * self.v)
        if link == 0.0:  # stuck where it stood
            return np.inf, np.inf
        # Both columns are forces, so that the least squares are well conditioned in any units.
        basis = np.stack([plant.stiffness * self.x, plant.mass * plant.omega * self.v], axis=1)
        left = self.effect - basis @ np.linalg.lstsq(basis, self.effect, rcond=None)[0]
        return rms(self.effect) / link, rms(left) / link


def sketch(plant: Plant, law: Law, drive: Drive, start: State, time: FloatArray) -> Motion:
    """The motion of m x'' + c x' + k x + law = g by one Runge-Kutta step a sample, blind to the ends of modes.

    A per cent of error at a tenth of the price of the exact motion: good for choosing the size of an effect.

    Raises
    ------
    EscapeError
        If abs(x) passes the law's reach.
    """
    m, k, c, dt = plant.mass, plant.stiffness, plant.damping, float(time[1] - time[0])
    whole = drive(np.append(time, time[-1] + dt)).tolist()
    half = drive(time + 0.5 * dt).tolist()
    reach, force, first_mode = law.reach(k), law.force, law.first_mode

    def acceleration(g: float, x: float, v: float) -> float:
        load = g - c * v - k * x
        return (load - force(x, v, load, first_mode(v, load))) / m

    x, v = start
    rows = []
    for i in range(time.size):
        a1 = acceleration(whole[i], x, v)
        rows.append((x, v, a1))
        v2 = v + 0.5 * dt * a1
        a2 = acceleration(half[i], x + 0.5 * dt * v, v2)
        v3 = v + 0.5 * dt * a2
        a3 = acceleration(half[i], x + 0.5 * dt * v2, v3)
        v4 = v + dt * a3
        a4 = acceleration(whole[i + 1], x + dt * v3, v4)
        x += dt / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4)
        v += dt / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
        if not abs(x) <= reach:
            raise EscapeError("the sketched motion passes the law's reach")
    xs, vs, accelerations = np.array(rows).T
    effect = np.array(whole[:-1]) - c * vs - k * xs - m * accelerations
    return Motion(time, xs, vs, accelerations, effect, np.empty(0))
