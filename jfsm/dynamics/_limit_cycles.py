"""Closed orbits that a structure keeps up by itself."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Inexact
from scipy.interpolate import KroghInterpolator
from scipy.optimize import brentq

from .._programs import programs_kept
from .._types import as_array, require_x64
from ..structures import Structure, as_model
from ._field import Field, autonomous_field
from ._fixed_points import search
from ._linearise import is_stable, linearise_field
from ._scales import scales, spread
from ._simulate import with_tables

_STARTS = 64
_REST_STARTS = 64
_WARM_UPS = (0.0, 3.0, 12.0, 48.0)
"""Windows that pass before each look at the motions: a weak attraction takes long."""
_PERIODS = 4.0
"""Length of a window, in periods of the slowest mode."""
_SAMPLES = 1440
"""Steps between the samples of a window or of a period: divisible by the fractions of a period that are looked at."""
_NEAR = 0.1
"""Distance from an earlier passage, in the motion's range, from which Newton's method can close an orbit."""
_LANES = 8
"""Orbits that are closed side by side."""
_ROUGH = 1e-7
_TOLERANCE = 1e-13
_CLOSED = 1e-9
"""Gap of an orbit that counts as closed, in its range."""
_ISOLATED = 1e-5
"""Distance of all other multipliers from 1: an undamped structure has orbits everywhere, none a limit cycle."""
_ITERATIONS = 12
_ESCAPED = 1e3
_MAX_STEPS = 1 << 15


@dataclass(frozen=True, repr=False)
class LimitCycle:
    """An isolated closed orbit.

    Attributes
    ----------
    period : float
        [s].
    amplitude : (dof,) array
        Half the distance between the turning points of each displacement [m].
    multipliers : (2 dof,) array, complex unless all are real
        Floquet multipliers, what a period makes of small disturbances, by falling size. One is 1: a shift in time.
    stable : bool
        Whether all others are smaller than 1.
    orbit : (1441, 1 + 2 dof) array
        Time [s], displacements, velocities over one period, evenly spaced, first and last state alike; it begins where
        the displacement that moves most has its largest value.
    residual : float
        Gap between the first and the last state, in the range of the orbit.
    note : str
        What the theorem of Poincaré and Bendixson says here, or nothing.
    """

    period: float
    amplitude: Float[np.ndarray, " dof"]
    multipliers: Inexact[np.ndarray, " state"]
    stable: bool
    orbit: Float[np.ndarray, "samples columns"]
    residual: float
    note: str

    def __repr__(self) -> str:
        sizes = ", ".join(f"{size:.4g}" for size in self.amplitude)
        return f"<LimitCycle, {'' if self.stable else 'un'}stable, period {self.period:.6g} s, amplitude {sizes} m>"

    def plot(self, ax: Any = None) -> Any:
        """Velocity [m/s] over displacement [m] of each degree of freedom; an unstable orbit broken.

        Parameters
        ----------
        ax : matplotlib axes, optional
            A new figure without them.

        Returns
        -------
        matplotlib axes
        """
        from ..reporting import Line, PanelOf, draw_panels

        dof = self.amplitude.size
        lines = [
            Line(f"degree of freedom {j}", self.orbit[:, j], self.orbit[:, dof + j], "-" if self.stable else "--")
            for j in range(1, dof + 1)
        ]
        return draw_panels([PanelOf("displacement [m]", "velocity [m/s]", lines)], ax)


class Flow(eqx.Module):
    """Rate of the state in units of its size, forward (`sign` 1) or backward (-1) in time."""

    system: Field
    size: Float[Array, " n"]
    sign: Float[Array, ""]

    @property
    def dof(self) -> int:
        return self.system.dof

    def __call__(self, y: Float[Array, " n"]) -> Float[Array, " n"]:
        return self.sign * self.system(self.size * y) / self.size


class Rest(NamedTuple):
    """A point of rest in units of the state's size, and its eigenvalues."""

    state: np.ndarray
    eigenvalues: np.ndarray


@programs_kept()
def limit_cycles(model: Structure, starts: Any = None, *, force: Any = None) -> tuple[LimitCycle, ...]:
    """Isolated closed orbits of a structure left to itself, by rising amplitude.

    Parameters
    ----------
    model : Structure
        Smooth and independent of time. Learned maps act through their tables, so that the digits are the table's.
    starts : (starts, 2 dof) array, optional
        States from which motions set out. When None, 64 of them: two beside each point of rest, the
        others spread over four times the longest length and the highest speed that the numbers of the terms make.
    force : (dof,) array, optional
        A constant force [N].

    Returns
    -------
    tuple of LimitCycle
        Those that some motion approaches, forward in time (stable) or backward (unstable in every direction). With
        more than one degree of freedom a cycle of saddle type is approached by almost no motion and may be missing.
        An empty tuple says that no motion from these starts led to one.

    Raises
    ------
    ValueError
        If a term sticks or depends on time, a mass is zero, or an argument has the wrong form.

    Notes
    -----
    Each motion is followed until it returns near an earlier passage of v = 0; Newton's method on the state there and
    the period, with the Jacobian of the flow from its variational equation, closes the orbit. In the plane the
    non-trivial multiplier is exp ∫ div F dt (Liouville).

    With one degree of freedom the theorem of Poincaré and Bendixson gives existence without any of this: a bounded
    region that no motion leaves and that holds no point of rest, other than ones that repel, holds a closed orbit. In a
    van der Pol oscillator the origin repels and large motions are damped. There is no such theorem beyond the plane.
    """
    require_x64()
    as_model(model)
    system = autonomous_field(with_tables(model), force)
    size, period = _sizes(system, model)
    rest = _points_of_rest(system, model, size)
    first = _starts(rest, size.size) if starts is None else _checked(starts, model.dof) / size
    found: list[tuple[np.ndarray, LimitCycle]] = []
    for sign in (1.0, -1.0):
        flow = Flow(system, jnp.asarray(size), jnp.asarray(sign))
        _approached(flow, first, rest, _PERIODS * period, found)
    return tuple(sorted((cycle for _, cycle in found), key=lambda c: (np.max(c.amplitude), c.period)))


def _checked(starts: Any, dof: int) -> np.ndarray:
    states = as_array(starts, "starts", 2)
    if states.shape[1] != 2 * dof or not len(states):
        raise ValueError(
            f"`starts` must hold one state a row, {dof} displacements, then {dof} velocities; got shape {states.shape}."
        )
    return states


def _sizes(system: Field, model: Structure) -> tuple[np.ndarray, float]:
    """Size of each state of a motion that could be, and the period of its slowest mode."""
    load = np.asarray(system.load)
    rates = np.abs(linearise_field(system, np.zeros(2 * system.dof)).eigenvalues)
    rates = rates[rates > 1e-6 * np.max(rates)] if np.any(rates > 0) else np.ones(1)
    omega = math.exp(np.mean(np.log(rates)))
    length = max([*scales(model, load), *(scales(model, load, time=-1) / omega)], default=1.0)
    return np.repeat([length, length * omega], system.dof), 2 * math.pi / float(np.min(rates))


def _points_of_rest(system: Field, model: Structure, size: np.ndarray) -> list[Rest]:
    """Those that the motions may come near."""
    half = 8.0 * size[: system.dof]
    points, _ = search(system, model, np.stack([-half, half]), _REST_STARTS)
    states = [np.concatenate([x, np.zeros_like(x)]) for x in points]
    return [Rest(y / size, linearise_field(system, y).eigenvalues) for y in states]


def _starts(rest: list[Rest], n: int) -> np.ndarray:
    beside = [point.state + 0.02 * spread(3, n)[1:] for point in rest[: _STARTS // 4]]
    return np.concatenate([*beside, 4.0 * spread(_STARTS + 1, n)[1:]])[:_STARTS]


def _approached(
    flow: Flow, first: np.ndarray, rest: list[Rest], window: float, found: list[tuple[np.ndarray, LimitCycle]]
) -> None:
    """Add the orbits, and cycles, that the motions from `first` approach to those found before."""
    time = np.linspace(0.0, window, _SAMPLES + 1)
    traps = [point.state for point in rest if is_stable(float(flow.sign) * point.eigenvalues)]
    states = np.resize(first, (_STARTS * math.ceil(len(first) / _STARTS), 2 * flow.dof))
    open_ = np.ones(len(states), bool)
    for warm_up in _WARM_UPS:
        runs = _motions(flow, states, warm_up * window, np.full(len(states), window), _ROUGH)
        open_ &= np.all(np.abs(runs) < _ESCAPED, (1, 2))
        for state in traps:
            open_ &= np.max(np.abs(runs[:, -1] - state), 1) > 0.01
        passages: list[Passage] = []
        for lane in np.flatnonzero(open_):
            passage = _recurrence(time, runs[lane])
            if passage and not _known(passage.state, found) and not any(_alike(passage, p) for p in passages):
                passages.append(passage)
        for orbit, cycle in _closed(flow, passages[:_LANES], rest):
            if not _known(orbit[0], found, within=1e-5):
                found.append((orbit, cycle))
        open_ &= np.array([not _known(run[-1], found) for run in runs])
        if not np.any(open_):
            break
        states = np.where(open_[:, None], runs[:, -1], 0.0)


class Passage(NamedTuple):
    """Where velocity `j` passes zero, and how long ago the motion was there before."""

    state: np.ndarray
    period: float
    j: int


def _recurrence(time: np.ndarray, run: np.ndarray) -> Passage | None:
    """The last passage of a motion near which it had passed before, if any."""
    dof = run.shape[1] // 2
    span = np.ptp(run[len(run) // 2 :], 0)
    j = int(np.argmax(span[:dof]))
    v = run[:, dof + j]
    before = np.flatnonzero((v[:-1] > 0) & (v[1:] <= 0))
    if before.size < 2:
        return None
    share = v[before] / (v[before] - v[before + 1])
    states = run[before] + share[:, None] * (run[before + 1] - run[before])
    instants = time[before] + share * (time[1] - time[0])
    near = np.flatnonzero(np.max(np.abs(states[:-1] - states[-1]) / np.maximum(span, 1e-9), 1) < _NEAR)
    return Passage(states[-1], instants[-1] - instants[near[-1]], j) if near.size else None


def _alike(one: Passage, other: Passage) -> bool:
    near = np.max(np.abs(one.state - other.state)) < 1e-3 and abs(one.period - other.period) < 1e-2 * one.period
    return bool(near) and one.j == other.j


def _known(state: np.ndarray, found: list[tuple[np.ndarray, LimitCycle]], within: float = 0.02) -> bool:
    """Whether a state lies on an orbit, in the orbit's range."""
    return any(
        np.min(np.max(np.abs(orbit - state) / np.maximum(np.ptp(orbit, 0), 1e-9), 1)) < within for orbit, _ in found
    )


def _closed(flow: Flow, passages: list[Passage], rest: list[Rest]) -> list[tuple[np.ndarray, LimitCycle]]:
    """Orbits, and cycles, that begin near the passages."""
    orbits, closing, chosen = np.zeros(0), Closing(*[np.zeros(0)] * 6), []
    for _ in range(2):  # the second time from the highest point of the smallest period
        if not passages:
            return []
        padded = passages + [passages[0]] * (_LANES - len(passages))
        states, periods, j = (np.array(column) for column in zip(*padded, strict=True))
        found = _close(flow, states, periods, np.eye(flow.dof)[j])
        begin, periods = np.resize(found.state, (_STARTS, states.shape[1])), np.resize(found.period, _STARTS)
        orbits = _motions(flow, begin, 0.0, periods, _TOLERANCE)[: len(passages)]
        closing = Closing(*(np.asarray(a)[: len(passages)] for a in found))
        good = (closing.gap < _CLOSED) & (closing.moved < 1e-6) & np.all(np.isfinite(orbits), (1, 2))
        good[good] = np.max(np.ptp(orbits[good], 1), 1) > 1e-6
        chosen = [int(k) for k in np.flatnonzero(good) if _isolated(_multipliers(flow, closing, int(k)))]
        passages = [_anchored(orbits[k], closing.period[k]) for k in chosen]
    return [(orbits[k], _cycle(flow, orbits[k], closing, k, rest)) for k in chosen]


def _anchored(orbit: np.ndarray, period: float) -> Passage:
    """Where the widest displacement of an orbit is largest, with the orbit's smallest period."""
    dof, span = orbit.shape[1] // 2, np.ptp(orbit, 0)
    for parts in (5, 4, 3, 2):
        if np.max(np.abs(orbit[_SAMPLES // parts] - orbit[0]) / np.maximum(span, 1e-9)) < 1e-5:
            period = period / parts
            break
    j = int(np.argmax(span[:dof]))
    return Passage(orbit[int(np.argmax(orbit[:, j]))], period, j)


def _multipliers(flow: Flow, closing: "Closing", k: int) -> np.ndarray:
    sign = float(flow.sign)
    if flow.dof == 1:
        values = np.array([1.0, math.exp(sign * closing.growth[k])], complex)
    else:
        values = np.linalg.eigvals(closing.jacobian[k]).astype(complex) ** sign
    return values[np.argsort(-np.abs(values))]


def _isolated(multipliers: np.ndarray) -> bool:
    return bool(np.sort(np.abs(multipliers - 1.0))[1] > _ISOLATED)


def _cycle(flow: Flow, orbit: np.ndarray, closing: "Closing", k: int, rest: list[Rest]) -> LimitCycle:
    dof, size = flow.dof, np.asarray(flow.size)
    forward = orbit if flow.sign > 0 else orbit[::-1]
    multipliers = _multipliers(flow, closing, k)
    others = np.delete(multipliers, np.argmin(np.abs(multipliers - 1.0)))
    stable = bool(np.all(np.abs(others) < 1.0))
    h = closing.period[k] / _SAMPLES * size[-1] / size[0]
    amplitude = [(_highest(x, h * v) + _highest(-x, -h * v)) / 2 for x, v in zip(*np.split(forward.T, 2), strict=True)]
    return LimitCycle(
        period=float(closing.period[k]),
        amplitude=size[:dof] * np.array(amplitude),
        multipliers=multipliers,
        stable=stable,
        orbit=np.column_stack([np.linspace(0.0, closing.period[k], len(orbit)), size * forward]),
        residual=float(closing.gap[k]),
        note=_note(orbit, stable, rest) if dof == 1 else "",
    )


def _highest(x: np.ndarray, v: np.ndarray) -> float:
    """Largest value between samples of a closed curve, from its values and its slopes per sample."""
    nearby = np.arange(-3, 4)
    around = (int(np.argmax(x[:-1])) + nearby) % (x.size - 1)
    curve = KroghInterpolator(np.repeat(nearby, 2), np.column_stack([x[around], v[around]]).ravel())
    return float(curve(brentq(lambda place: float(curve.derivative(place)), -1.0, 1.0, xtol=1e-12)))


def _note(orbit: np.ndarray, stable: bool, rest: list[Rest]) -> str:
    within = [point for point in rest if _winding(orbit - point.state) != 0]
    if not stable or not within or not all(np.all(np.real(point.eigenvalues) > 0) for point in within):
        return ""
    return (
        "Every point of rest within this orbit repels, and no motion crosses it: by the theorem of Poincaré and "
        "Bendixson every motion that starts within ends on a closed orbit."
    )


def _winding(curve: np.ndarray) -> int:
    angle = np.unwrap(np.arctan2(curve[:, 1], curve[:, 0]))
    return round((angle[-1] - angle[0]) / (2 * math.pi))


def _motions(flow: Flow, states: np.ndarray, wait: float, span: np.ndarray, tolerance: float) -> np.ndarray:
    """Motions over a `span` each that begins after a wait, (lanes, samples, n); one that escapes stops there."""
    return np.asarray(_motions_program(flow, states, jnp.asarray(wait), span, jnp.asarray(tolerance)))


@eqx.filter_jit
def _motions_program(flow: Flow, states, wait, span, tolerance):
    def one(state, span):
        instants = wait + jnp.linspace(0.0, 1.0, _SAMPLES + 1) * span
        return _integrate(rate, state, wait + span, diffrax.SaveAt(ts=instants), tolerance)

    def rate(y):
        return jnp.where(jnp.max(jnp.abs(y)) > _ESCAPED, 0.0, flow(y))

    return jax.vmap(one)(states, span)


def _integrate(rate, start, until, saveat, tolerance):
    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(lambda t, y, _: rate(y)),
        diffrax.Dopri8(),
        t0=0.0,
        t1=until,
        dt0=None,
        y0=start,
        saveat=saveat,
        stepsize_controller=diffrax.PIDController(rtol=tolerance, atol=tolerance),
        max_steps=_MAX_STEPS,
        throw=False,
    )
    assert solution.ys is not None
    return solution.ys


class Closing(NamedTuple):
    """Where Newton's method on (state, period) ended.

    `gap` is what the orbit misses and `moved` the last step, both in the state's size; `jacobian` is that of the flow
    over the period, `growth` the integral of its divergence.
    """

    state: Any
    period: Any
    gap: Any
    moved: Any
    jacobian: Any
    growth: Any


@eqx.filter_jit
def _close(flow: Flow, states, periods, rows) -> Closing:
    """Close the orbits that begin at the given states, where the velocity that each row selects is zero.

    The last of Newton's steps keeps the flow's derivative, which tells stability: a root finder, `optimistix.Newton`,
    would throw it away, and every orbit would be gone through once more.
    """
    n = 2 * flow.dof

    def rate(carry):
        y, jacobian, _ = carry
        slope, push = jax.linearize(flow, y)
        matrix = jax.vmap(push, out_axes=1)(jnp.eye(n))
        return slope, matrix @ jacobian, jnp.trace(matrix)

    def one(state, period, row):
        pinned = jnp.concatenate([jnp.zeros_like(row), row])

        def step(carry):
            (y, period, *_), count = carry
            start = (y, jnp.eye(n), jnp.zeros(()))
            ends = _integrate(rate, start, period, diffrax.SaveAt(t1=True), _TOLERANCE)
            end, jacobian, growth = (a[0] for a in ends)
            column = jnp.concatenate([period * flow(end), jnp.zeros(1)])
            bordered = jnp.column_stack([jnp.concatenate([jacobian - jnp.eye(n), pinned[None, :]]), column])
            miss = jnp.concatenate([end - y, jnp.sum(pinned * y)[None]])
            change = -jnp.linalg.solve(bordered, miss)
            moved = jnp.max(jnp.abs(change))
            change = change * jnp.minimum(1.0, 0.3 / moved)
            now = Closing(y + change[:n], period * (1.0 + change[n]), jnp.max(jnp.abs(miss)), moved, jacobian, growth)
            return now, count + 1

        def unsettled(carry):
            now, count = carry
            return (now.moved > 1e-12) & (count < _ITERATIONS)

        far = jnp.full((), jnp.inf)
        begin = Closing(state, period, far, far, jnp.eye(n), jnp.zeros(()))
        return jax.lax.while_loop(unsettled, step, (begin, 0))[0]

    return jax.vmap(one)(states, periods, rows)
