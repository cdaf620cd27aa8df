"""The exact motion of a plant: each mode of its law integrated by DOP853 up to its located end."""

import dataclasses

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from .drives import Drive
from .laws.base import FloatArray, Law
from .plants import EscapeError, Motion, Plant, State

RELATIVE_TOLERANCE = 1e-10
# A guard counts as zero at minus this share of the typical velocity: no mode ends at the instant at which it begins.
GUARD_SLACK = 1e-13
# How often per sample a held mass is looked at. Two crossings between looks go unseen; the slip would be below 1e-9.
WATCHES_PER_SAMPLE = 20
# More modes than this between two samples are no motion but a law whose modes follow one another without end.
MODES_PER_SAMPLE = 100


def integrate(
    plant: Plant,
    law: Law,
    drive: Drive,
    start: State,
    time: FloatArray,
    scale: float,
    rtol: float = RELATIVE_TOLERANCE,
) -> Motion:
    """The motion of m x'' + c x' + k x + law = g from `start` on `time` (n,) [s].

    `scale` [m] is a typical displacement, which the absolute tolerances are taken from.

    Raises
    ------
    EscapeError
        If abs(x) passes the law's reach, or the motion cannot be continued.
    RuntimeError
        If the law changes its mode on and on without getting to the next sample.
    """
    run = _Run(plant, law, drive, scale, rtol, watch=float(time[1] - time[0]) / WATCHES_PER_SAMPLE)
    x, v, effect = np.empty((3, time.size))
    here, state, instants = float(time[0]), start, []
    mode = law.first_mode(start[1], float(run.load(here, *start)))
    done = modes = 0
    while done < time.size:
        phase = run.held(here, state, time[done:]) if law.holds(mode) else run.moving(mode, here, state, time[done:])
        piece = slice(done, done + phase.x.size)
        x[piece], v[piece] = phase.x, phase.v
        effect[piece] = law.force(phase.x, phase.v, run.load(time[piece], phase.x, phase.v), mode)
        here, state, done = phase.end, phase.state, piece.stop
        modes = 0 if phase.x.size else modes + 1
        if modes > MODES_PER_SAMPLE:
            raise RuntimeError(
                f"a law's modes must let the motion go on; those of {type(law).__name__} followed one another "
                f"{modes} times at {here} s. Mend its next_mode."
            )
        if done < time.size:
            instants.append(here)
            mode = law.next_mode(mode, float(run.load(here, *state)))
    return Motion(time, x, v, (run.load(time, x, v) - effect) / plant.mass, effect, np.array(instants))


@dataclasses.dataclass(frozen=True)
class _Phase:
    """One mode: its samples (n,), n may be 0; the instant [s] and the state at its end."""

    x: FloatArray
    v: FloatArray
    end: float
    state: State


@dataclasses.dataclass(frozen=True)
class _Run:
    plant: Plant
    law: Law
    drive: Drive
    scale: float
    rtol: float
    watch: float

    def load(self, t, x, v):
        return self.drive(t) - self.plant.damping * v - self.plant.stiffness * x

    def moving(self, mode: int, here: float, state: State, time: FloatArray) -> _Phase:
        m, k, c, drive, force = self.plant.mass, self.plant.stiffness, self.plant.damping, self.drive, self.law.force
        speed, reach = self.plant.omega * self.scale, self.law.reach(self.plant.stiffness)

        def rates(t: float, y: FloatArray) -> State:
            x, v = y.tolist()
            load = float(drive(t)) - c * v - k * x
            return v, (load - force(x, v, load, mode)) / m

        def ends(t: float, y: FloatArray) -> float:
            x, v = y.tolist()
            return self.law.guard(mode, x, v) + GUARD_SLACK * speed

        def escapes(t: float, y: FloatArray) -> float:
            return reach - abs(float(y[0]))

        events = [event for event, wanted in ((ends, not self.law.smooth), (escapes, np.isfinite(reach))) if wanted]
        for event in events:
            event.terminal, event.direction = True, -1.0  # pyright: ignore[reportFunctionMemberAccess]
        solution = solve_ivp(
            rates,
            (here, float(time[-1])),
            np.array(state),
            method="DOP853",
            t_eval=time,
            events=events or None,
            rtol=self.rtol,
            atol=self.rtol * np.array([self.scale, speed]),
        )
        if solution.status < 0:
            raise EscapeError(f"the motion cannot be continued: {solution.message}")
        x, v = solution.y if len(solution.t) else np.empty((2, 0))
        if solution.status == 0:
            return _Phase(x, v, float(time[-1]), (float(x[-1]), float(v[-1])))
        which = next(i for i, instants in enumerate(solution.t_events) if instants.size)
        if events[which] is escapes:
            raise EscapeError("the motion passes the law's reach")
        x_end, v_end = solution.y_events[which][0].tolist()
        return _Phase(x, v, float(solution.t_events[which][0]), (x_end, v_end))

    def held(self, here: float, state: State, time: FloatArray) -> _Phase:
        x, last = state[0], float(time[-1])

        def margin(t):
            return self.law.release(self.load(t, x, 0.0))

        end, left, looks = last, here, 64
        while left < last:
            grid = np.minimum(left + self.watch * np.arange(looks + 1), last)
            loose = np.flatnonzero(margin(grid) < 0.0)
            if loose.size and loose[0] == 0:  # held at the first look only by rounding
                end = here
                break
            if loose.size:
                between = grid[loose[0] - 1 : loose[0] + 1]
                end = float(brentq(margin, *between, xtol=1e-9 * self.watch))  # pyright: ignore[reportArgumentType]
                break
            left, looks = float(grid[-1]), min(2 * looks, 1024)
        samples = int(np.searchsorted(time, end, side="right"))
        return _Phase(np.full(samples, x), np.zeros(samples), end, (x, 0.0))
