"""The exact motion of a plant: each mode of its law integrated by DOP853 up to its located end."""

import bisect
import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import brentq, minimize_scalar

from .arrays import FloatArray
from .drives import Drive
from .laws import Law
from .laws.base import Hidden, Mode
from .plants import EscapeError, Motion, Plant, State

RELATIVE_TOLERANCE = 1e-11
# How often per sample a held mass is looked at. Two crossings between looks go unseen; the slip would be below 1e-9.
WATCHES_PER_SAMPLE = 20
# How often a guard is looked at within a step, whose ends alone would not show that it was negative for a while.
LOOKS_PER_STEP = 8
# More modes than this between two samples are no motion but a law whose modes follow one another without end.
MODES_PER_SAMPLE = 100
EPS = float(np.finfo(float).eps)


def integrate(
    plant: Plant,
    law: Law,
    drive: Drive,
    start: State,
    time: FloatArray,
    scale: float,
    rtol: float = RELATIVE_TOLERANCE,
    limit: float = np.inf,
) -> Motion:
    """The motion of m x'' + c x' + k x + law = g from `start` on `time` (n,) [s].

    `scale` [m] is a typical displacement, which the absolute tolerances are taken from.

    Raises
    ------
    EscapeError
        If abs(x) passes the law's reach or `limit` [m], or the motion cannot be continued.
    RuntimeError
        If the law changes its mode on and on without getting to the next sample, and is not one that creeps.
    """
    run = Run(plant, law, drive, start, time, scale, rtol, min(law.reach(plant.stiffness), limit))
    y, effect, hidden, instants = follow(run, np.array([*start, *law.hidden_start(*start)]), time)
    x, v = y
    return Motion(time, x, v, (run.load(time, y) - effect) / plant.mass, effect, instants, hidden)


def follow(
    run: "Run", state: FloatArray, time: FloatArray
) -> tuple[FloatArray, FloatArray, tuple[FloatArray, ...], FloatArray]:
    """States (states, n), force of the law (n,), what it remembers, (n,) each, and the instants at which it changes.

    The states are those of the plant alone; `state` holds the law's as well.
    """
    law, here, plain = run.law, float(time[0]), 2 + run.others
    x, v = state[:2].tolist()
    stops = [*law.stops(here, float(time[-1])).tolist(), float(time[-1])]
    mode = law.first_mode(x, v, run.remembered(here, state), here, float(run.load(here, state)))
    pieces, instants = [], []
    done = modes = 0
    while done < time.size:
        until = stops[bisect.bisect_right(stops, here, hi=len(stops) - 1)]
        if law.holds(mode):
            phase = run.held(mode, here, until, state, time[done:])
        else:
            phase = run.moving(mode, here, until, state, time[done:])
        piece = time[done : done + phase.y.shape[1]]
        x, v = phase.y[:2]
        z = run.remembered(piece, phase.y)
        effect = np.broadcast_to(law.force(x, v, z, piece, run.load(piece, phase.y), mode), x.shape)
        pieces.append((*phase.y[:plain], effect, *z))
        here, state, done = phase.end, phase.state, done + piece.size
        modes = 0 if piece.size else modes + 1
        if modes > MODES_PER_SAMPLE:
            if law.creeps:
                raise EscapeError(f"the mass creeps near rest at {here} s, where the law is too stiff to be followed")
            raise RuntimeError(
                f"a law's modes must let the motion go on; those of {type(law).__name__} followed one another "
                f"{modes} times at {here} s. Mend its next_mode."
            )
        if done < time.size:
            if phase.exit is None:
                following = law.mode_after_stop(mode, here)
            else:
                following = law.next_mode(mode, phase.exit, float(run.load_to_hold(here, state, mode)))
            if phase.exit is not None or following != mode:
                instants.append(here)
            mode = following
    rows = tuple(map(np.concatenate, zip(*pieces, strict=True)))
    return np.stack(rows[:plain]), rows[plain], rows[plain + 1 :], np.array(instants)


@dataclasses.dataclass(frozen=True)
class Phase:
    """One mode: its samples (states, n), n may be 0; the instant [s] and the state (states,) at its end.

    `exit` is the number of the guard that ended it, -1 where a held mass was let go, None where it came to a stop.
    """

    y: FloatArray
    end: float
    state: FloatArray
    exit: int | None


class _Past:
    """x [m] at any time up to the end of the last finished step; before the start, the starting value."""

    def __init__(self, begin: float, x: float):
        self.begin, self.x = begin, x
        self.ends: list[float] = []
        self.steps: list[Callable[[Any], FloatArray]] = []

    def append(self, end: float, step: Callable[[Any], FloatArray]) -> None:
        self.ends.append(end)
        self.steps.append(step)

    def __call__(self, t: float) -> float:
        if t <= self.begin:
            return self.x
        # Beyond the last end by rounding only.
        return float(self.steps[min(bisect.bisect_left(self.ends, t), len(self.ends) - 1)](t)[0])


class Run:
    """A plant under way with a law: its states are x and v, those that others add, and the law's hidden ones."""

    others = 0  # states of the plant beside x and v: of the same kinds, in pairs

    def __init__(
        self, plant: Plant, law: Law, drive: Drive, start: State, time: FloatArray, scale: float, rtol: float,
        reach: float,
    ):  # fmt: skip
        self.plant, self.law, self.drive, self.rtol, self.reach = plant, law, drive, rtol, reach
        # The samples may be uneven, and the first two next to one another.
        step = max(time[1] - time[0], 0.5 * (time[-1] - time[0]) / time.size)
        self.watch = float(step) / WATCHES_PER_SAMPLE
        sizes = {"displacement": scale, "velocity": plant.omega * scale}
        self.sizes = sizes
        kinds = ("displacement", "velocity") * (1 + self.others // 2)
        self.atol = rtol * np.array([sizes[kind] for kind in (*kinds, *law.hidden)])
        self.past = _Past(float(time[0]), start[0])
        self.longest = 0.0

    def load(self, t: Any, y: FloatArray) -> Any:
        """What of all other forces the law meets at t, in the states y (states,) or along (states, n) [N]."""
        x, v = y[:2]
        return self.drive(t) - self.plant.damping * v - self.plant.stiffness * x

    def load_to_hold(self, t: Any, y: FloatArray, mode: Mode) -> Any:
        """What a law that holds the mass has to hold at t, in the states y (states,) or along (states, n) [N]."""
        x, v = y[:2]
        return self.law.load_to_hold(x, v, self.remembered(t, y), t, self.load(t, y), mode)

    def remembered(self, t: Any, y: FloatArray) -> Hidden:
        """What the law remembers at t, in the states y (states,) or along (states, n)."""
        if not self.law.delay:
            return tuple(y[2 + self.others :])
        late = np.array([self.past(s) for s in np.ravel(t - self.law.delay).tolist()]).reshape(np.shape(t))
        return *y[2 + self.others :], late

    def rates(self, mode: Mode) -> Callable[[float, FloatArray], Sequence[float]]:
        """Right-hand side within a mode."""
        m, k, c = self.plant.mass, self.plant.stiffness, self.plant.damping
        drive, force, hidden_rates = self.drive, self.law.force, self.law.hidden_rates
        past, delay = self.past, self.law.delay

        def rates(t: float, y: FloatArray) -> Sequence[float]:
            x, v = y.tolist()
            load = float(drive(t)) - c * v - k * x
            return v, (load - force(x, v, (), t, load, mode)) / m

        def with_memory(t: float, y: FloatArray) -> Sequence[float]:
            x, v, *z = y.tolist()
            load = float(drive(t)) - c * v - k * x
            return v, (load - force(x, v, z, t, load, mode)) / m, *hidden_rates(x, v, z, mode)

        def with_delay(t: float, y: FloatArray) -> Sequence[float]:
            x, v, *z = y.tolist()
            z.append(past(t - delay))
            load = float(drive(t)) - c * v - k * x
            return v, (load - force(x, v, z, t, load, mode)) / m, *hidden_rates(x, v, z, mode)

        return with_delay if delay else with_memory if self.law.hidden else rates

    def guards(self, mode: Mode, t: Any, y: Any) -> list[Any]:
        """Guards of a mode, each raised by its slack, at t in the states y (states,) or along (states, n)."""
        x, v, *z = y
        z = z[self.others :]
        speeds = self.law.velocity_guards(mode, x, v, z)
        lengths = self.law.displacement_guards(mode, x, v, z)
        if not speeds and not lengths:
            raise NotImplementedError(f"{type(self.law).__name__} is not smooth and must say where its modes end")
        speed, length = (self.law.slack * self.sizes[kind] for kind in ("velocity", "displacement"))
        return [guard + speed for guard in speeds] + [guard + length for guard in lengths]

    def moving(self, mode: Mode, here: float, until: float, state: FloatArray, time: FloatArray) -> Phase:
        watched = not self.law.smooth
        before = self.guards(mode, here, state.tolist()) if watched else []
        solver = DOP853(
            self.rates(mode), here, state, until, rtol=self.rtol, atol=self.atol,  # pyright: ignore[reportArgumentType]
            # A delay's pieces are many and short: each goes on with the steps of the one before.
            first_step=min(self.longest, until - here) if self.law.delay and self.longest else None,
        )  # fmt: skip
        self.longest = 0.0
        samples, done = [], 0
        while solver.status == "running":
            message = solver.step()
            if solver.status == "failed":
                raise EscapeError(f"the motion cannot be continued: {message}")
            if not abs(solver.y[0]) <= self.reach:
                raise EscapeError("the motion passes the law's reach")
            begin, end = float(solver.t_old), float(solver.t)  # pyright: ignore[reportArgumentType]
            self.longest = max(self.longest, end - begin)
            step = solver.dense_output()
            crossing = None
            if watched:
                after = self.guards(mode, end, solver.y.tolist())
                crossing = self._crossing(mode, step, begin, end, before, after)
                before = after
            if crossing:
                end = crossing[0]
            if self.law.delay:
                self.past.append(end, step)
            passed = int(np.searchsorted(time, end, side="right"))
            if passed > done:
                samples.append(step(time[done:passed]))
                done = passed
            if crossing:
                return Phase(_joined(samples, state.size), end, step(end), crossing[1])
        return Phase(_joined(samples, state.size), until, solver.y, None)

    def _crossing(
        self, mode: Mode, step: Callable[[Any], FloatArray], begin: float, end: float,
        before: Sequence[float], after: Sequence[float],
    ) -> tuple[float, int] | None:  # fmt: skip
        """The first instant within a step at which a guard comes to zero, and which guard."""
        grid = np.linspace(begin, end, LOOKS_PER_STEP + 1)
        values = np.array([np.broadcast_to(guard, grid.shape) for guard in self.guards(mode, grid, step(grid))])
        values[:, 0], values[:, -1] = before, after
        crossings = []
        for which, y in enumerate(values):

            def guard(t: float, which: int = which) -> float:
                return self.guards(mode, t, step(t).tolist())[which]

            if y[0] < 0.0:  # by the rounding of the instant at which the mode began; if it goes on falling, it is over
                if y[-1] < 10.0 * y[0]:
                    crossings.append((begin, which))
                continue
            bracket = _bracket(guard, grid, y)
            if bracket:
                root = brentq(guard, *bracket, xtol=4.0 * EPS, rtol=4.0 * EPS)  # pyright: ignore[reportArgumentType]
                crossings.append((float(root), which))  # pyright: ignore[reportArgumentType]
        return min(crossings, default=None)

    def held(self, mode: Mode, here: float, until: float, state: FloatArray, time: FloatArray) -> Phase:
        x, z = float(state[0]), tuple(state[2:].tolist())

        def still(t):
            """States (states, n) while the mass is held."""
            hidden = self.law.hidden_at_rest(x, z, t - here)
            return np.array([np.broadcast_to(y, np.shape(t)) for y in (x, 0.0, *hidden)])

        def margin(t):
            return self.law.release(self.load_to_hold(t, still(t), mode))

        end, left, looks, let_go = until, here, 64, None
        while left < until:
            grid = np.minimum(left + self.watch * np.arange(looks + 1), until)
            loose = np.flatnonzero(margin(grid) < 0.0)
            if loose.size and loose[0] == 0:  # held at the first look only by rounding
                end, let_go = here, -1
                break
            if loose.size:
                between = grid[loose[0] - 1 : loose[0] + 1]
                end = float(brentq(margin, *between, xtol=1e-9 * self.watch))  # pyright: ignore[reportArgumentType]
                let_go = -1
                break
            left, looks = float(grid[-1]), min(2 * looks, 1024)
        if self.law.delay:
            self.past.append(end, still)
        samples = int(np.searchsorted(time, end, side="right"))
        return Phase(still(time[:samples]), end, still(end), let_go)


def _joined(samples: Sequence[FloatArray], states: int) -> FloatArray:
    return np.concatenate(samples, axis=1) if samples else np.empty((states, 0))


def _bracket(guard: Callable[[float], float], grid: FloatArray, values: FloatArray) -> tuple[float, float] | None:
    """Two times between which a guard, seen as `values` (looks,) on `grid` (looks,), first becomes negative."""
    negative = np.flatnonzero(values[1:] <= 0.0) + 1
    first = int(negative[0]) if negative.size else values.size
    left, middle, right = values[:-2], values[1:-1], values[2:]
    for i in np.flatnonzero((middle <= left) & (middle <= right)).tolist():
        if i + 1 >= first:
            break
        bend = left[i] - 2.0 * middle[i] + right[i]
        # The parabola through three looks tells where it is worth while to search for the bottom between them.
        if bend > 0.0 and (left[i] - right[i]) ** 2 / (8.0 * bend) < 0.5 * middle[i]:
            continue
        bounds, fine = (grid[i], grid[i + 2]), 1e-6 * (grid[-1] - grid[0])
        bottom = minimize_scalar(guard, bounds=bounds, method="bounded", options={"xatol": fine})
        if bottom.fun < 0.0:  # pyright: ignore[reportAttributeAccessIssue]
            return float(grid[i]), float(bottom.x)  # pyright: ignore[reportAttributeAccessIssue]
    if not negative.size:
        return None
    if negative.size == values.size - first:  # a single crossing
        return float(grid[0]), float(grid[-1])
    return float(grid[first - 1]), float(grid[first])
