"""Exact motion of a chain of masses with one hidden law at a link, by SciPy alone.

Where a law has a kink, and where friction holds or lets go, the integration ends on that instant and goes on from it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from tests.blind.drives import SumOfSines

FloatArray = NDArray[np.float64]
Drive = Callable[[Any], Any]
Side = tuple[float, ...]
"""On which side of each kink the motion is, -1 or 1; of friction also 0, where it holds."""

TOLERANCE = 1e-9
LOOKS = 4
"""Looks per sample at the speed of a mass that slides, at the load on one that is held, and at the way to a stop."""
MEMORY = ("bouc_wen",)


@dataclass(frozen=True)
class Chain:
    """Masses in a row; spring and dashpot i join mass i - 1 (ground for the first) to mass i, (dof,) each."""

    mass: FloatArray
    stiffness: FloatArray
    damping: FloatArray

    @property
    def modes(self) -> FloatArray:
        """Undamped angular frequencies (dof,), ascending [rad/s]."""
        root = 1 / np.sqrt(self.mass)
        return np.sqrt(np.linalg.eigvalsh(root[:, None] * (self.links.T * self.stiffness @ self.links) * root))

    @property
    def links(self) -> FloatArray:
        """(dof, dof): what every link is stretched by each mass's displacement."""
        return np.eye(self.mass.size) - np.eye(self.mass.size, k=-1)


@dataclass(frozen=True)
class Law:
    """A law of the catalogue at link number `link`, with the numbers of its formula."""

    cause: str
    link: int
    parameters: dict[str, float]

    def kinks(self, d, w, z) -> tuple:
        """What is zero where the formula changes."""
        if self.cause in ("quadratic_damping", "coulomb"):
            return (w,)
        if self.cause == "bouc_wen":
            return w, z
        if self.cause == "end_stop":
            return d - self.parameters["gap"], d + self.parameters["gap"]
        return ()

    def force(self, d, w, z, side: Sequence):
        """Force that resists the stretch, on one side of every kink."""
        p = self.parameters
        if self.cause == "cubic_hardening":
            return p["k3"] * d**3
        if self.cause == "quintic_stiffness":
            return p["k5"] * d**5
        if self.cause == "double_well":
            return -p["k_neg"] * d + p["k3"] * d**3
        if self.cause == "quadratic_damping":
            return p["c2"] * w**2 * side[0]
        if self.cause == "coulomb":
            return p["F"] * side[0] + 0 * w
        if self.cause == "bouc_wen":
            return p["k"] * z
        if self.cause == "end_stop":
            return p["k"] * ((d - p["gap"]) * (side[0] > 0) + (d + p["gap"]) * (side[1] < 0))
        return 0 * d

    def rate(self, w, z, side: Side):
        """Rate of what a law remembers."""
        p = self.parameters
        return w - p["beta"] * side[0] * w * z - p["gamma"] * w * side[1] * z

    def scaled(self, factor: float) -> "Law":
        """The same shape of another size."""
        size = ("k3", "k5", "c2", "F", "k")
        return replace(self, parameters={n: v * factor if n in size else v for n, v in self.parameters.items()})


class Motion(NamedTuple):
    """Motion relative to the base, (n, dof) each, and the hidden law's force (n,)."""

    x: FloatArray
    v: FloatArray
    a: FloatArray
    effect: FloatArray


class _Run:
    """The equations on one side of every kink."""

    def __init__(self, chain: Chain, law: Law, force: Drive, base: Drive):
        self.chain, self.law, self.drive, self.base = chain, law, force, base
        self.dof, self.row = chain.mass.size, chain.links[law.link]
        links, mass = chain.links, chain.mass[:, None]
        self.k = links.T * chain.stiffness @ links / mass
        self.c = links.T * chain.damping @ links / mass
        self.pull = self.row / chain.mass  # acceleration that a unit of the law's force takes away
        self.input = np.zeros(self.dof)
        self.input[-1] = 1 / chain.mass[-1]

    def parts(self, y):
        """Stretch of the law's link, its rate and what the law remembers."""
        z = y[2 * self.dof] if len(y) > 2 * self.dof else 0.0
        return self.row @ y[: self.dof], self.row @ y[self.dof : 2 * self.dof], z

    def free(self, t, y):
        """Accelerations relative to the base without the law."""
        x, v = y[: self.dof], y[self.dof : 2 * self.dof]
        one = np.ones(self.dof) if np.ndim(t) == 0 else np.ones((self.dof, 1))
        into = self.input if np.ndim(t) == 0 else self.input[:, None]
        return into * self.drive(t) - one * self.base(t) - self.k @ x - self.c @ v

    def holding(self, t, y):
        """Force that keeps the link's rate as it is."""
        return (self.row @ self.free(t, y)) / (self.row @ self.pull)

    def law_force(self, t, y, side: Side):
        if self.held(side):
            return self.holding(t, y)
        return self.law.force(*self.parts(y), side)

    def held(self, side: Side) -> bool:
        return self.law.cause == "coulomb" and side[0] == 0

    def rates(self, t, y, side: Side):
        a = self.free(t, y) - self.pull * self.law_force(t, y, side)
        out = [y[self.dof : 2 * self.dof], a]
        if len(y) > 2 * self.dof:
            _, w, z = self.parts(y)
            out.append(np.array([self.law.rate(w, z, side)]))
        return np.concatenate(out)

    def ends(self, side: Side, begun: float):
        """Events that end this side, on which the motion is since it began, whatever rounding says of that instant."""

        def event(index: int):
            def guard(t, y):
                if self.held(side):
                    return self.law.parameters["F"] - abs(self.holding(t, y))
                return self.law.kinks(*self.parts(y))[index] if t > begun else side[index]

            guard.terminal, guard.direction = True, -1.0 if self.held(side) else -side[index]
            return guard

        return [event(index) for index in range(len(side))]

    def after(self, t: float, y: FloatArray, side: Side, which: int) -> Side:
        """The side on which the motion goes on when guard number `which` came to zero."""
        if self.law.cause != "coulomb":
            return tuple(-s if i == which else s for i, s in enumerate(side))
        holding = float(self.holding(t, y))
        if not self.held(side) and abs(holding) <= self.law.parameters["F"]:
            return (0.0,)
        return (float(np.sign(holding)),)

    def first(self, t: float, y: FloatArray) -> Side:
        kinks = self.law.kinks(*self.parts(y))
        if self.law.cause == "coulomb" and kinks[0] == 0:
            return self.after(t, y, (1.0,), 0)
        return tuple(1.0 if kink >= 0 else -1.0 for kink in kinks)


def nothing(t):
    """No drive."""
    return 0.0 * t


def move(
    chain: Chain, law: Law, time: FloatArray, start: tuple[FloatArray, FloatArray], force: Drive = nothing,
    base: Drive = nothing, size: float = 1.0,
) -> Motion:  # fmt: skip
    """Motion of the chain from `start` on, `force` on its last mass and `base` the base's acceleration.

    `size` is a typical displacement; absolute errors are measured by it.
    """
    still = not np.any(start)
    if law.cause == "coulomb" and chain.mass.size == 1 and isinstance(force, SumOfSines) and base is nothing and still:
        return slide(chain, law.parameters["F"], time, force)
    run = _Run(chain, law, force, base)
    y = np.concatenate([*start, [0.0] if law.cause in MEMORY else []])
    speed = size * chain.modes[0]
    errors = TOLERANCE * np.concatenate([np.full(run.dof, size), np.full(run.dof, speed), np.full(y.size % 2, size)])
    t, done, side = float(time[0]), 0, run.first(float(time[0]), y)
    states, effects, a = [], [], []
    while done < time.size:
        found = solve_ivp(
            partial(run.rates, side=side), (t, float(time[-1])), y, "DOP853", time[done:],
            events=run.ends(side, t) or None, rtol=TOLERANCE, atol=errors,
            # what is held has no error, and its steps would pass over what lets it go; those of a mass that is free,
            # over a stop that it touches
            max_step=(time[1] - time[0]) / LOOKS if run.held(side) or law.cause == "end_stop" else np.inf,
        )  # fmt: skip
        if found.status < 0:
            raise ArithmeticError(f"the motion cannot be continued: {found.message}")
        if np.size(found.y):
            piece = time[done : done + found.t.size]
            effect = np.broadcast_to(run.law_force(piece, found.y, side), piece.shape)
            states.append(found.y)
            effects.append(effect)
            a.append(run.free(piece, found.y) - run.pull[:, None] * effect)
            done += piece.size
        if found.status == 0:
            break
        which = next(i for i, instants in enumerate(found.t_events) if instants.size)
        t, y = float(found.t_events[which][0]), found.y_events[which][0].copy()
        side = run.after(t, y, side, which)
        if run.held(side):  # exactly at rest
            y[run.dof : 2 * run.dof] -= run.pull * (run.parts(y)[1] / (run.row @ run.pull))
    y = np.concatenate(states, axis=1).T
    return Motion(y[:, : run.dof], y[:, run.dof : 2 * run.dof], np.concatenate(a, axis=1).T, np.concatenate(effects))


_AHEAD = 64
_AT_ONCE = 4096
_CLOSER = 17
_ROUNDING = 1e-14


def slide(chain: Chain, limit: float, time: FloatArray, force: SumOfSines) -> Motion:
    """Motion of one mass on dry friction from rest: between two changes of its direction it is known in closed form."""
    (m,), (k,), (c,) = chain.mass, chain.stiffness, chain.damping
    swing = _Swing(float(m), float(k), float(c), force)
    look = np.linspace(time[0], time[-1], LOOKS * (time.size - 1) + 1)
    chunks = np.array_split(look, max(look.size // _AT_ONCE, 1))
    x_forced, v_forced = (np.concatenate(part) for part in zip(*map(swing.forced, chunks), strict=True))
    load = np.concatenate([force(part) for part in chunks])
    x, v, effect = np.zeros((3, look.size))
    dust = 1e-9 * float(time[1] - time[0])
    here, place, done, ended = float(look[0]), 0.0, 0, True
    side = float(np.sign(load[0])) if abs(load[0]) > limit else 0.0
    while ended:
        swing.let_go(here, place, -limit * side / k)
        ended = False
        while done < look.size and not ended:
            ahead = slice(done, min(done + _AHEAD, look.size))
            if side:
                shift, rate = swing.free(look[ahead])
                x[ahead], v[ahead], effect[ahead] = x_forced[ahead] + shift, v_forced[ahead] + rate, side * limit
                over = np.flatnonzero((side * v[ahead] < 0) & (look[ahead] > here + dust))
            else:
                x[ahead], v[ahead], effect[ahead] = place, 0.0, load[ahead] - k * place
                over = np.flatnonzero(np.abs(effect[ahead]) > limit)
            ended = over.size > 0
            done = done + int(over[0]) if ended else ahead.stop
        if not ended:
            break
        before, after = max(here, float(look[max(done - 1, 0)])), float(look[done])
        if side:
            here = swing.stop(before, after, side)
            place = swing.place(here)
            holding = float(force(here)) - k * place
            side = 0.0 if abs(holding) <= limit else float(np.sign(holding))
        else:
            side = float(np.sign(effect[done]))
            here = _instant(partial(_beyond, force, side, limit + side * k * place), before, after)
    a = (load - k * x - c * v - effect) / m
    x, v, a, effect = (y[::LOOKS] for y in (x, v, a, effect))
    return Motion(x[:, None], v[:, None], a[:, None], effect)


class _Swing:
    """A linear mass under a sum of sines and a constant force, let go at some place."""

    def __init__(self, m: float, k: float, c: float, force: SumOfSines):
        self.drive = force
        self.answer = force.amplitude * np.exp(1j * force.phase) / (k - m * force.omega**2 + 1j * c * force.omega)
        self.decay, self.omega = c / (2 * m), float(np.sqrt(k / m - (c / (2 * m)) ** 2))

    def forced(self, t) -> tuple:
        """Displacement and velocity once it has swung in, without the constant force."""
        turned = self.answer * np.exp(1j * np.multiply.outer(t, self.drive.omega))
        return turned.real.sum(-1), (1j * self.drive.omega * turned).real.sum(-1)

    def let_go(self, here: float, place: float, aside: float) -> None:
        """From rest at `place`; the constant force moves its rest by `aside`."""
        x, v = self.forced(here)
        self.here, self.aside, self.first = here, aside, place - x - aside
        self.second = (self.decay * self.first - v) / self.omega

    def free(self, t) -> tuple:
        """What letting go and the constant force add to displacement and velocity."""
        s = t - self.here
        fade, cos, sin = np.exp(-self.decay * s), np.cos(self.omega * s), np.sin(self.omega * s)
        y = fade * (self.first * cos + self.second * sin)
        return y + self.aside, fade * self.omega * (self.second * cos - self.first * sin) - self.decay * y

    def place(self, t: float) -> float:
        return float(self.forced(t)[0] + self.free(t)[0])

    def speed(self, t):
        return self.forced(t)[1] + self.free(t)[1]

    def stop(self, before: float, after: float, side: float) -> float:
        """When its speed is zero, last before it turns against `side`."""
        closer = np.linspace(before, after, _CLOSER)
        onward = np.flatnonzero(side * self.speed(closer)[:-1] > 0)
        if not onward.size:
            return before
        last = int(onward[-1])
        return _instant(self.speed, float(closer[last]), float(closer[last + 1]))


def _beyond(force: Drive, side: float, limit: float, t: float) -> float:
    return side * float(force(t)) - limit


def _instant(what: Callable[[float], Any], before: float, after: float) -> float:
    return float(brentq(what, before, after, xtol=_ROUNDING))  # pyright: ignore[reportArgumentType]
