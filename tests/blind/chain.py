"""Exact motion of two masses in a chain with a law at one of its links or masses."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh, expm

from .arrays import FloatArray
from .challenge import LARGEST_PARTING, SMALL_SHIFT
from .drives import Drive
from .exact import RELATIVE_TOLERANCE, Phase, Run, follow
from .laws import Law
from .laws.base import Mode
from .plants import EscapeError, Motion, Plant

Link: TypeAlias = tuple[int, int]
ChainState: TypeAlias = tuple[tuple[float, float], tuple[float, float]]  # x [m] and v [m/s] of both masses

REST: ChainState = ((0.0, 0.0), (0.0, 0.0))


@dataclasses.dataclass(frozen=True)
class Chain:
    """Masses (2,) [kg], and stiffness [N/m] and damping [N s/m] of each link; ground is 0."""

    mass: tuple[float, float]
    stiffness: dict[Link, float]
    damping: dict[Link, float]

    @property
    def links(self) -> tuple[Link, ...]:
        return tuple(self.stiffness)

    @property
    def matrices(self) -> tuple[FloatArray, FloatArray]:
        """Stiffness and damping, (2, 2)."""
        k, c = (
            sum((value * np.outer(across(at), across(at)) for at, value in values.items()), np.zeros((2, 2)))
            for values in (self.stiffness, self.damping)
        )
        return k, c

    @property
    def omega(self) -> FloatArray:
        """Undamped natural frequencies (2,) [rad/s], ascending."""
        return np.sqrt(eigh(self.matrices[0], np.diag(self.mass), eigvals_only=True))

    @property
    def damping_ratio(self) -> float:
        """That of the first mode."""
        omega, shapes = eigh(self.matrices[0], np.diag(self.mass))
        return float(shapes[:, 0] @ self.matrices[1] @ shapes[:, 0] / (2.0 * np.sqrt(omega[0])))

    def around(self, at: Link) -> Plant:
        """The plant that a law at a link meets: the link's values, or where there is none all that holds its end."""
        mass = 1.0 / float(np.sum(across(at) ** 2 / np.array(self.mass)))
        if at in self.stiffness:
            return Plant(mass, self.stiffness[at], self.damping[at])
        k, c = (float(values[at[1] - 1, at[1] - 1]) for values in self.matrices)
        return Plant(mass, k, c)

    def believed(self, at: Link, plant: Plant) -> "Chain":
        """The chain with a link's values."""
        return Chain(self.mass, {**self.stiffness, at: plant.stiffness}, {**self.damping, at: plant.damping})


def across(at: Link) -> FloatArray:
    """What a link's stretch is of the displacements of both masses, (2,)."""
    return np.array([float(j == at[1]) - float(j == at[0]) for j in (1, 2)])


@dataclasses.dataclass(frozen=True)
class ChainMotion:
    """The motion of both masses on its sample times, (n, 2) in SI; `link` is that of the law's link."""

    time: FloatArray
    x: FloatArray
    v: FloatArray
    acceleration: FloatArray
    link: Motion

    @property
    def state(self) -> ChainState:
        """At the first sample."""
        (x1, x2), (v1, v2) = self.x[0].tolist(), self.v[0].tolist()
        return (x1, x2), (v1, v2)

    @property
    def responses(self) -> dict[str, FloatArray]:
        """By kind of channel, (n, 2)."""
        return {"displacement": self.x, "velocity": self.v, "acceleration": self.acceleration}

    def picked(self, samples: NDArray[np.intp]) -> "ChainMotion":
        """At some of its samples (n,) alone, given by their numbers."""
        time, link = self.time[samples], self.link
        hidden = tuple(z[samples] for z in link.hidden)
        rows = (link.x[samples], link.v[samples], link.acceleration[samples], link.effect[samples])
        there = Motion(time, *rows, link.instants[link.instants >= time[0]], hidden)
        return ChainMotion(time, self.x[samples], self.v[samples], self.acceleration[samples], there)


class LinkedPlant:
    """A chain seen from one link: as a plant whose displacement is the link's stretch, and one coordinate beside it.

    The other coordinate is the one whose acceleration the force of the link does not enter.
    """

    def __init__(self, chain: Chain, at: Link, driven: int):
        masses, b = np.array(chain.mass), across(at)
        self.mass = 1.0 / float(np.sum(b**2 / masses))
        aside = masses / masses.sum() if 0 not in at else 1.0 - b
        self.coordinates = np.stack([b, aside])  # of x1 and x2
        self.places = np.linalg.inv(self.coordinates)
        out = np.stack([self.mass * b, aside]) / masses  # the rows' forces: on the link [N], on the coordinate [N/kg]
        k, c = chain.matrices
        k, c = out @ k @ self.places, out @ c @ self.places
        self.numbers = [(float(out[i, driven - 1]), *k[i].tolist(), *c[i].tolist()) for i in (0, 1)]
        self.omega = float(chain.omega[-1])  # the scale of velocities

    def loads(self, g: Any, d: Any, w: Any, q: Any, r: Any) -> tuple[Any, Any]:
        """What the law meets [N], and the acceleration of the other coordinate; d, w, q and r are the states."""
        (g1, k1, k2, c1, c2), (g3, k3, k4, c3, c4) = self.numbers
        return g1 * g - k1 * d - k2 * q - c1 * w - c2 * r, g3 * g - k3 * d - k4 * q - c3 * w - c4 * r

    def start(self, start: ChainState) -> tuple[float, float, float, float]:
        """d, w, q and r of a state."""
        (d, q), (w, r) = (self.coordinates @ np.array(start).T).T.tolist()
        return d, w, q, r

    def motion(self, time: FloatArray, y: FloatArray, g: FloatArray, effect: FloatArray, *more: Any) -> ChainMotion:
        """The motion of states (4, n) under a drive and a law's force, (n,) each [N]."""
        load, aside = self.loads(g, *y)
        acceleration = (load - effect) / self.mass
        x, v, a = (
            np.asarray(np.stack(pair, axis=1) @ self.places.T, float)
            for pair in ((y[0], y[2]), (y[1], y[3]), (acceleration, aside))
        )
        return ChainMotion(time, x, v, a, Motion(time, y[0], y[1], acceleration, effect, *more))


class _ChainRun(Run):
    """A mode that holds the link still goes on with the other coordinate, and ends where the law lets go."""

    others = 2
    plant: Any

    def load(self, t: Any, y: FloatArray) -> Any:
        return self.plant.loads(self.drive(t), *y[:4])[0]

    def rates(self, mode: Mode) -> Callable[[float, FloatArray], Sequence[float]]:
        drive, force, hidden_rates, loads, m = (
            self.drive, self.law.force, self.law.hidden_rates, self.plant.loads, self.plant.mass,
        )  # fmt: skip
        past, delay = self.past, self.law.delay

        def rates(t: float, y: FloatArray) -> Sequence[float]:
            d, w, q, r, *z = y.tolist()
            if delay:
                z.append(past(t - delay))
            load, aside = loads(float(drive(t)), d, w, q, r)
            return w, (load - force(d, w, z, t, load, mode)) / m, r, aside, *hidden_rates(d, w, z, mode)

        return rates

    def guards(self, mode: Mode, t: Any, y: Any) -> list[Any]:
        if not self.law.holds(mode):
            return super().guards(mode, t, y)
        return [self.law.release(self.load_to_hold(t, np.asarray(y), mode))]

    def held(self, mode: Mode, here: float, until: float, state: FloatArray, time: FloatArray) -> Phase:
        still = state.copy()
        still[1] = 0.0
        phase = self.moving(mode, here, until, still, time)
        return phase if phase.exit is None else dataclasses.replace(phase, exit=-1)


def integrate(
    chain: Chain, at: Link, law: Law, driven: int, drive: Drive, start: ChainState, time: FloatArray, scale: float,
    rtol: float = RELATIVE_TOLERANCE, limit: float = np.inf,
) -> ChainMotion:  # fmt: skip
    """The exact motion of M x'' + C x' + K x + law = g on `time` (n,) [s], the law at a link, the drive on a mass.

    `scale` [m] is a typical stretch of the link, and `limit` [m] the largest one.

    Raises
    ------
    EscapeError
        If the stretch passes the law's reach or `limit`, or the motion cannot be continued.
    """
    plant = LinkedPlant(chain, at, driven)
    begin, reach = plant.start(start), min(law.reach(chain.around(at).stiffness), limit)
    run = _ChainRun(plant, law, drive, begin[:2], time, scale, rtol, reach)  # pyright: ignore[reportArgumentType]
    y, effect, hidden, instants = follow(run, np.array([*begin, *law.hidden_start(*begin[:2])]), time)
    return plant.motion(time, y, drive(time), effect, instants, hidden)


def sketch(
    chain: Chain, at: Link, law: Law, driven: int, drive: Drive, start: ChainState, time: FloatArray,
    limit: float = np.inf,
) -> ChainMotion:  # fmt: skip
    """The motion by one Runge-Kutta step a sample, blind to the ends of modes; good for choosing sizes.

    Raises
    ------
    EscapeError
        If the stretch of the law's link passes the law's reach or `limit` [m].
    """
    law, plant = law.twin, LinkedPlant(chain, at, driven)
    dt = float(time[1] - time[0])
    drives = drive(np.arange(2 * time.size + 1) * (0.5 * dt) + time[0]).tolist()
    reach, delay = min(law.reach(chain.around(at).stiffness), limit), law.delay / dt
    past: list[float] = []

    def late(half_steps: int) -> tuple[float, ...]:
        """What a law with a delay remembers: the stretch, between or beyond the points so far."""
        if not delay:
            return ()
        steps = min(max(0.5 * half_steps - delay, 0.0), len(past) - 1.0)
        i = int(steps)
        return (past[i] if i + 1 == len(past) else past[i] + (steps - i) * (past[i + 1] - past[i]),)

    def rates(i: int, y: Sequence[float]) -> tuple[list[float], float]:
        """Rates at so many half steps from the start, and the law's force."""
        d, w, q, r, *z = y
        t = float(time[0]) + 0.5 * dt * i
        load, aside = plant.loads(drives[i], d, w, q, r)
        z = (*z, *late(i))
        mode = law.first_mode(d, w, z, t, load)
        force = law.force(d, w, z, t, load, mode)
        return [w, (load - force) / plant.mass, r, aside, *law.hidden_rates(d, w, z, mode)], float(force)

    def moved(y: Sequence[float], h: float, rate: Sequence[float]) -> list[float]:
        new = [a + h * b for a, b in zip(y, rate, strict=True)]
        return [*new[:4], *law.confined(new[4:])] if len(new) > 4 else new

    begin = plant.start(start)
    y = [*begin, *law.hidden_start(*begin[:2])]
    rows = []
    for i in range(time.size):
        past.append(y[0])
        k1, force = rates(2 * i, y)
        rows.append((*y, *late(2 * i), force))
        k2, _ = rates(2 * i + 1, moved(y, 0.5 * dt, k1))
        k3, _ = rates(2 * i + 1, moved(y, 0.5 * dt, k2))
        k4, _ = rates(2 * i + 2, moved(y, dt, k3))
        y = moved(y, dt / 6.0, [p + 2.0 * (q + r) + s for p, q, r, s in zip(k1, k2, k3, k4, strict=True)])
        if not abs(y[0]) <= reach:
            raise EscapeError("the sketched motion passes the law's reach")
    *states, effect = np.array(rows).T
    return plant.motion(time, np.array(states[:4]), drive(time), effect, np.empty(0), tuple(states[4:]))


def trusted_motion(
    chain: Chain, at: Link, law: Law, driven: int, drive: Drive, start: ChainState, time: FloatArray, scale: float,
    limit: float,
) -> ChainMotion:  # fmt: skip
    """The exact motion, within `limit` [m] of stretch; `scale` [m] is a typical stretch.

    Raises
    ------
    EscapeError
        If it passes the limit, or parts from a near one so fast that it cannot be trusted.
    """
    motion = integrate(chain, at, law, driven, drive, start, time, scale, limit=limit)
    if law.chaotic:
        shift = SMALL_SHIFT * scale
        (x1, x2), v = start
        near = integrate(chain, at, law, driven, drive, ((x1 + shift, x2 - shift), v), time, scale, 1e-8, limit)
        if float(np.abs(motion.x - near.x).max()) > LARGEST_PARTING * shift:
            raise EscapeError("motions from starts a small shift apart go so far apart that neither can be trusted")
    return motion


def responses(chain: Chain, forces: FloatArray, begin: FloatArray, step: float) -> dict[str, FloatArray]:
    """Responses of a linear chain to forces (n, 2, columns) [N], linear between samples, from states (4, columns)."""
    k, c = chain.matrices
    inverse, zero = np.diag(1.0 / np.array(chain.mass)), np.zeros((2, 2))
    a = np.block([[zero, np.eye(2)], [-inverse @ k, -inverse @ c]])
    block = np.zeros((8, 8))
    block[:4, :4], block[2:4, 4:6], block[4:6, 6:] = step * a, step * inverse, np.eye(2)
    exponential = expm(block)
    after = exponential[:4, 6:]
    inputs = (exponential[:4, 4:6] - after) @ forces[:-1] + after @ forces[1:]
    states = np.empty((forces.shape[0], 4, forces.shape[2]))
    states[0] = begin
    for i, entering in enumerate(inputs):
        states[i + 1] = exponential[:4, :4] @ states[i] + entering
    acceleration = (a @ states)[:, 2:] + inverse @ forces
    return {"displacement": states[:, :2], "velocity": states[:, 2:], "acceleration": acceleration}
