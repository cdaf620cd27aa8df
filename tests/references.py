"""Motions computed by SciPy alone, for the tests to hold jfsm's own solvers against."""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.integrate import solve_ivp

Force = Callable[[float], np.ndarray]
Law = Callable[[np.ndarray, np.ndarray], np.ndarray]
MOST_EVENTS = 500


def smooth_motion(
    mass, law: Law, force: Force, time: np.ndarray, x0, v0, tolerance: float = 1e-9
) -> tuple[np.ndarray, np.ndarray]:
    """Displacement and velocity (n, dof) of ``mass a + law(x, v) = force(t)``.

    Integrated from sample to sample, so that a force with a corner or a jump at every sample costs no accuracy; a
    force is asked for just after the sample on which an interval begins.
    """
    inverse = np.linalg.inv(np.atleast_2d(mass))
    dof = len(inverse)

    def slope(t, state):
        return np.concatenate([state[dof:], inverse @ (force(t) - law(state[:dof], state[dof:]))])

    states = [np.concatenate([np.atleast_1d(x0), np.atleast_1d(v0)]).astype(float)]
    for start, end in zip(time[:-1], time[1:], strict=True):
        inside = 1e-9 * (end - start)
        run = solve_ivp(
            slope, (start + inside, end - inside), states[-1], method="DOP853", rtol=tolerance, atol=tolerance
        )
        # What the two slivers left out would have added, to first order.
        states.append(run.y[:, -1] + inside * (slope(start + inside, states[-1]) + slope(end - inside, run.y[:, -1])))
    motion = np.array(states)
    return motion[:, :dof], motion[:, dof:]


def three_tones(t):
    return 4 * np.cos(1.1 * t) + 3 * np.sin(2.3 * t + 1) + 3 * np.cos(3.7 * t + 2)


def driven_readings(law: Law, time: np.ndarray) -> list[np.ndarray]:
    """Force, displacement and velocity (n,), with 1 % noise, of ``a + 9 x + 0.3 v + law(x, v)`` = three tones, from
    rest."""

    def restoring(x, v):
        return 9.0 * x + 0.3 * v + law(x, v)

    x, v = smooth_motion(1.0, restoring, lambda t: np.array([three_tones(t)]), time, 0.0, 0.0, tolerance=1e-7)
    rng = np.random.default_rng(4)
    return [y + 0.01 * np.std(y) * rng.standard_normal(time.size) for y in (three_tones(time), x[:, 0], v[:, 0])]


def sticking_motion(
    mass,
    damping,
    stiffness,
    links,
    limits,
    force: Force,
    time: np.ndarray,
    x0,
    v0,
    law: Law | None = None,
    tolerance=1e-8,
) -> tuple[np.ndarray, np.ndarray, int]:
    """Displacement and velocity (n, dof) with Coulomb friction that sticks, and the number of events.

    `links` (m, dof) are the rows that make the speed of a link of v, `limits` (m,) the friction forces, `law` is what
    acts beside the matrices. Between events (a sliding link comes to rest, a sticking one breaks away) each link
    slides one way or is held, and DOP853 runs on; events are located by its dense output.
    """
    mass, damping, stiffness, links = (np.atleast_2d(a) for a in (mass, damping, stiffness, links))
    limits, inverse, dof = np.ravel(limits).astype(float), np.linalg.inv(mass), len(mass)

    def split(t, state, mode):
        """Acceleration in a mode, and the forces that hold the sticking links."""
        x, v = state[:dof], state[dof:]
        other = 0.0 if law is None else law(x, v)
        a = inverse @ (force(t) - stiffness @ x - damping @ v - other - links.T @ (limits * mode))
        held, stick = np.zeros(len(limits)), mode == 0
        if np.any(stick):
            rows = links[stick]
            held[stick] = np.linalg.solve(rows @ inverse @ rows.T, rows @ a)
        return a - inverse @ links.T @ held, held

    def settled(t, state, mode):
        """The mode in which no sticking link is held by more than its limit."""
        mode = mode.copy()
        for _ in limits:
            excess = np.where(mode == 0, np.abs(split(t, state, mode)[1]) - limits, -np.inf)
            if np.max(excess) <= 0:
                break
            mode[np.argmax(excess)] = np.sign(split(t, state, mode)[1][np.argmax(excess)])
        return mode

    def ends(link, mode) -> Callable[[float, np.ndarray], float]:
        def margin(t, state):
            if mode[link]:
                return float(mode[link] * (links[link] @ state[dof:]))
            return float(limits[link] - abs(split(t, state, mode)[1][link]))

        margin.terminal, margin.direction = True, -1.0  # pyright: ignore[reportFunctionMemberAccess]
        return margin

    now, state = time[0], np.concatenate([np.atleast_1d(x0), np.atleast_1d(v0)]).astype(float)
    mode = settled(now, state, np.sign(links @ state[dof:]))
    found, events = np.full((len(time), 2 * dof), np.nan), 0
    found[0] = state
    while now < time[-1]:
        run = solve_ivp(
            lambda t, state, mode=mode: np.concatenate([state[dof:], split(t, state, mode)[0]]),
            (now, time[-1]),
            state,
            method="DOP853",
            events=[ends(link, mode) for link in range(len(limits))],
            rtol=tolerance,
            atol=tolerance / 100,
            dense_output=True,
            max_step=0.1,
        )
        passed = (time > now) & (time <= run.t[-1])
        if np.any(passed):
            found[passed] = run.sol(time[passed]).T
        now, state = run.t[-1], run.y[:, -1].copy()
        if run.status != 1:
            break
        events += 1
        assert events < MOST_EVENTS, f"friction chatters at t = {now}"
        hit = np.array([len(times) > 0 for times in run.t_events])
        stopped, broken = hit & (mode != 0), hit & (mode == 0)
        mode = np.where(stopped, 0.0, np.where(broken, np.sign(split(now, state, mode)[1]), mode))
        if np.any(stopped):
            rows = links[stopped]
            state[dof:] -= inverse @ rows.T @ np.linalg.solve(rows @ inverse @ rows.T, rows @ state[dof:])
        mode = settled(now, state, mode)
    return found[:, :dof], found[:, dof:], events


def rows(at: Sequence[tuple[int, int]], dof: int) -> np.ndarray:
    """Rows that make the speeds of links of v; 0 is ground."""
    found = np.zeros((len(at), dof))
    for row, (i, j) in zip(found, at, strict=True):
        for end, sign in ((i, -1.0), (j, 1.0)):
            if end:
                row[end - 1] += sign
    return found


def straight(time: np.ndarray, samples: np.ndarray) -> Force:
    """The force that runs straight between its samples (n, dof)."""
    return lambda t: np.array([np.interp(t, time, column) for column in samples.T])


def held(time: np.ndarray, samples: np.ndarray) -> Force:
    """The force that keeps each sample (n, dof) until the next."""
    return lambda t: samples[np.searchsorted(time, t, side="right") - 1]


def between_wells(
    slope: float, curvature: float, damping: float, time: np.ndarray, size: float, omegas: np.ndarray, seed: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Force, displacement and acceleration (n,) of a unit mass on a buckled spring, -slope x + curvature x³.

    It begins at rest in the right well; lines of equal `size` at these `omegas` drive it, their phases drawn.
    """
    phases = np.random.default_rng(seed).uniform(0.0, 2 * np.pi, omegas.size)

    def force(t):
        return size * np.cos(np.multiply.outer(t, omegas) + phases).sum(-1)

    def motion(t, y):
        return [y[1], force(t) - damping * y[1] + slope * y[0] - curvature * y[0] ** 3]

    begin = [np.sqrt(slope / curvature), 0.0]
    y = solve_ivp(motion, (0, time[-1]), begin, t_eval=time, rtol=1e-9, atol=1e-12).y
    return force(time), y[0], np.asarray(motion(time, y)[1])
