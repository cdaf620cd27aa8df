"""Response to a harmonic force, followed along its curve of frequency."""

import math
from dataclasses import dataclass
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.optimize import brentq

from .._programs import programs_kept
from .._result import Result
from .._types import require_x64
from ..structures import Structure, as_model
from ._field import Field, autonomous_field
from ._harmonic_balance import ForcedBalance, Solved, check_positive, displacement, solve, tables
from ._linearise import linearise_field
from ._simulate import with_tables

_QUICK = 4
_SMALLEST = 1e-6
_BEND = 0.9
"""Least cosine between neighbouring tangents: a sharper turn may be a jump to another curve."""
_ANGLE = 0.1
"""Largest angle of the fastest mode per step of the linearised motion [rad]."""
_STEPS = (64, 1 << 14)
_BATCH = 64
_LADDER = 12


@dataclass(frozen=True, repr=False)
class ForcedResponse:
    """Periodic response to amplitude·cos(ωt) along its curve, through the folds.

    Attributes
    ----------
    frequency : (points,) array
        ω [rad/s], in the order of the curve: past a fold it turns back.
    amplitude : (points, dof) array
        Of the fundamental [m]; `motion` has all harmonics.
    phase : (points, dof) array
        Lag φ of the fundamental, A cos(ωt - φ), in [0, 2π) [rad].
    stable : (points,) bool array
        Whether every small disturbance dies out: all Floquet multipliers smaller than 1. Without damping none does.
    coefficients : (points, 2 harmonics + 1, dof) array
        Mean, then cosines, then sines [m].
    folds : (folds,) int array
        Points at which the frequency turns, located to rounding.
    result : Result
        Whether the curve reached an end of the range.
    """

    frequency: Float[np.ndarray, " points"]
    amplitude: Float[np.ndarray, "points dof"]
    phase: Float[np.ndarray, "points dof"]
    stable: Bool[np.ndarray, " points"]
    coefficients: Float[np.ndarray, "points harmonics dof"]
    folds: Int[np.ndarray, " folds"]
    result: Result

    def __repr__(self) -> str:
        low, high = (np.array([self.frequency.min(), self.frequency.max()]) / (2 * np.pi)).tolist()
        unstable = int(np.sum(~self.stable))
        return (
            f"<ForcedResponse, {self.frequency.size} points from {low:.4g} to {high:.4g} Hz, {self.folds.size} folds, "
            f"{unstable} points unstable>"
        )

    def plot(self, ax: Any = None) -> Any:
        """Amplitude [m] over frequency [Hz], unstable parts broken.

        Parameters
        ----------
        ax : matplotlib axes, optional
            A new figure without them.

        Returns
        -------
        matplotlib axes
        """
        from ..reporting import Line, PanelOf, draw_panels

        lines = [
            Line(f"displacement {j + 1}", self.frequency / (2 * np.pi), np.where(keep, column, np.nan), style)
            for j, column in enumerate(self.amplitude.T)
            for keep, style in ((_reaching(self.stable), "-"), (~self.stable, "--"))
        ]
        return draw_panels([PanelOf("frequency [Hz]", "amplitude [m]", lines)], ax)

    def to_dataframe(self) -> Any:
        """The curve as a DataFrame of pandas, which must be installed: frequency [Hz], amplitudes [m], phases [rad]."""
        import pandas as pd

        columns: dict[str, Any] = {"frequency_hz": self.frequency / (2 * np.pi)}
        for j in range(self.amplitude.shape[1]):
            columns |= {f"amplitude_{j + 1}": self.amplitude[:, j], f"phase_{j + 1}": self.phase[:, j]}
        return pd.DataFrame({**columns, "stable": self.stable})

    def motion(self, point: int, samples: int = 256) -> Float[np.ndarray, "samples dof"]:
        """Displacements (samples, dof) over one period of a point, evenly spaced from where the force is largest."""
        harmonics = self.coefficients.shape[1] // 2
        return tables(harmonics, samples)[0] @ self.coefficients[point]


def _reaching(stable: Bool[np.ndarray, " points"]) -> Bool[np.ndarray, " points"]:
    """Stable points and their neighbours, so that the parts of a drawn curve meet."""
    reached = stable.copy()
    reached[1:] |= stable[:-1]
    reached[:-1] |= stable[1:]
    return reached


@programs_kept()
def forced_response(
    model: Structure,
    amplitude: float,
    at: int = 1,
    frequencies: tuple[float, float] | None = None,
    harmonics: int = 7,
    *,
    around: Any = None,
    step: float = 0.05,
    max_points: int = 4000,
) -> ForcedResponse:
    r"""Periodic response to a harmonic force against its frequency, by harmonic balance and continuation.

    Parameters
    ----------
    model : Structure
        Smooth and independent of time. Learned maps act through their tables.
    amplitude : float
        Of the force amplitude·cos(ωt) [N].
    at : int
        Degree of freedom that is forced, counted from 1.
    frequencies : pair (low, high)
        Where the curve begins, and where it ends unless it leaves through `low` [rad/s]. When None, a fifth of the
        lowest natural frequency to twice the highest.
    harmonics : int
        Number of harmonics beside the mean.
    around : (dof,) array, optional
        Displacement about which to vibrate [m], such as that of a fixed point; the origin when None.
    step : float
        Largest change from one point to the next: of the coefficients in their own size, of the frequency in the range.
    max_points : int

    Returns
    -------
    ForcedResponse

    Raises
    ------
    ValueError
        If a term sticks or depends on time, a mass is zero, or an argument is out of its range.
    RuntimeError
        If no periodic motion is found at the lowest frequency.

    Notes
    -----
    The residual is formed in time and balanced in harmonics [1]_, its Jacobian is exact by forward differentiation, and
    the curve is followed by its pseudo-arclength. Laws that are polynomials up to degree seven are balanced without
    aliasing. Stability is that of the linearised motion over a period of the balanced one; with too few harmonics it
    changes beside a fold instead of at it. Branches that part from the curve (subharmonics, broken symmetry) and closed
    curves apart from it are not followed.

    References
    ----------
    .. [1] T. M. Cameron, J. H. Griffin, J. Appl. Mech. 56 (1989) 149-154.
    """
    require_x64()
    as_model(model)
    check_positive(harmonics=harmonics, step=step, max_points=max_points, amplitude=amplitude)
    if not 1 <= at <= model.dof:
        raise ValueError(f"`at` must be a degree of freedom from 1 to {model.dof}; got {at}.")
    if model.own is not None:
        raise ValueError(
            "`model` must be a structure of masses and terms here; got a simulation, whose mass may change with its "
            "state. Follow its motion with `jfsm.simulate` until it repeats."
        )
    system = autonomous_field(with_tables(model))
    rest = displacement(around, model.dof)
    low, high = _range(frequencies, system, rest)
    balance, guess = _forced(system, amplitude, at, harmonics, low, rest)
    pinned = np.zeros(guess.size)
    pinned[-1] = 1.0
    solved = _ladder(balance, guess, pinned)
    if solved is None:
        raise RuntimeError(
            f"No periodic motion was found at the lowest of `frequencies`, {low:.6g} rad/s. "
            "Begin elsewhere, take more `harmonics`, or say by `around` about which point of rest to vibrate."
        )
    points, folds, result = _follow(balance, solved, (low, high), step, max_points)
    frequency, coefficients = points[:, -1] * balance.omega, points[:, :-1].reshape(len(points), -1, model.dof)
    coefficients = coefficients * float(balance.length)
    cosine, sine = coefficients[:, 1], coefficients[:, 1 + harmonics]
    return ForcedResponse(
        frequency=np.asarray(frequency),
        amplitude=np.hypot(cosine, sine),
        phase=np.arctan2(sine, cosine) % (2 * math.pi),
        stable=_stable(balance, points, rest, low),
        coefficients=coefficients,
        folds=folds,
        result=result,
    )


def _range(frequencies: Any, system: Field, rest: np.ndarray) -> tuple[float, float]:
    if frequencies is None:
        natural = linearise_field(system, np.append(rest, 0.0 * rest)).frequencies
        return 0.2 * float(natural[0]), 2.0 * float(natural[-1])
    try:
        low, high = (float(f) for f in frequencies)
    except (TypeError, ValueError):
        raise ValueError(f"`frequencies` must be a pair (low, high) in rad/s; got {frequencies!r}.") from None
    if not 0 < low < high < math.inf:
        raise ValueError(f"`frequencies` must be positive, low below high; got {frequencies!r}.")
    return low, high


def _forced(system: Field, amplitude: float, at: int, harmonics: int, omega: float, rest: np.ndarray):
    """The balance, and the linear response at a frequency."""
    linear = linearise_field(system, np.append(rest, 0.0 * rest))
    drive = np.zeros(system.dof)
    drive[at - 1] = amplitude
    dynamic = linear.stiffness - omega**2 * linear.mass + 1j * omega * linear.damping
    response = np.linalg.solve(dynamic, drive.astype(complex))
    length = float(np.max(np.abs(response)))
    guess = np.zeros((2 * harmonics + 1, system.dof))
    guess[0], guess[1], guess[1 + harmonics] = rest, response.real, -response.imag
    balance = ForcedBalance(system, harmonics, jnp.asarray(length), jnp.asarray(omega), jnp.asarray(drive))
    return balance, np.append(guess / length, 1.0)


def _ladder(balance: ForcedBalance, guess: np.ndarray, row: np.ndarray) -> Solved | None:
    """The response at full force: at once, or from a small force upward."""
    solved = solve(balance, guess, row, guess[-1])
    if solved.ok:
        return solved
    q = guess
    for share in np.geomspace(1e-2, 1.0, _LADDER):
        weaker = eqx.tree_at(lambda b: b.drive, balance, share * balance.drive)
        solved = solve(weaker, q, row, guess[-1])
        if not solved.ok:
            return None
        q = solved.q
    return solved


def _follow(balance: ForcedBalance, begin: Solved, ends: tuple[float, float], step: float, max_points: int):
    """Points along the curve from its first one towards higher frequency, the folds among them, and how it ended."""
    omega = float(balance.omega)
    low, high = ends[0] / omega, ends[1] / omega
    points, folds = [begin.q], []
    here, size = begin, step / 4
    forward = np.zeros_like(begin.q)
    forward[-1] = 1.0
    pinned = forward.copy()
    while len(points) < max_points:
        moving = np.linalg.norm(here.q[balance.system.dof : -1])  # the mean may be large beside the motion
        weights = np.append(np.full(here.q.size - 1, 1.0 / moving), 1.0 / (high - low))
        tangent = here.tangent / np.linalg.norm(weights * here.tangent)
        tangent = tangent * np.sign(np.sum(weights**2 * tangent * forward))
        guess = here.q + size * tangent
        if not low <= guess[-1] <= high:
            last = solve(balance, guess, pinned, low if guess[-1] < low else high)
            if last.ok:
                return np.array([*points, last.q]), np.array(folds, int), Result.successful
        row = weights**2 * tangent
        there = solve(balance, guess, row, row @ guess)
        turn = _cosine(weights * tangent, weights * there.tangent)
        if not there.easy or turn < _BEND:
            size /= 2
            if size < _SMALLEST:
                break
            continue
        if tangent[-1] * there.tangent[-1] < 0:  # `there.tangent` points onward: its row is this tangent
            fold = _fold(balance, here, tangent, row, size)
            folds.append(len(points))
            points.append(fold)
        points.append(there.q)
        here, forward = there, tangent
        size = min(step, size * (1.5 if there.count <= _QUICK else 1.0))
    return np.array(points), np.array(folds, int), Result.unfinished


def _cosine(one: np.ndarray, other: np.ndarray) -> float:
    return float(one @ other / (np.linalg.norm(one) * np.linalg.norm(other)))


def _fold(balance: ForcedBalance, here: Solved, tangent: np.ndarray, row: np.ndarray, size: float) -> np.ndarray:
    """Where the frequency turns, less than `size` ahead."""

    def ahead(share):
        guess = here.q + share * size * tangent
        return solve(balance, guess, row, row @ guess)

    share = brentq(lambda share: float(ahead(share).tangent[-1]), 0.0, 1.0, xtol=1e-13)
    return ahead(share).q


def _stable(balance: ForcedBalance, points: np.ndarray, rest: np.ndarray, low: float) -> np.ndarray:
    fastest = float(np.max(linearise_field(balance.system, np.append(rest, 0.0 * rest)).frequencies))
    least = max(2 * math.pi * max(fastest / low, balance.harmonics) / _ANGLE, _STEPS[0])
    steps = min(2 ** math.ceil(math.log2(least)), _STEPS[1])
    padded = np.resize(points, (_BATCH * math.ceil(len(points) / _BATCH), points.shape[1]))
    batches = padded.reshape(-1, _BATCH, points.shape[1])
    largest = [np.max(np.abs(np.linalg.eigvals(np.asarray(_monodromy(balance, b, steps)))), 1) for b in batches]
    return np.concatenate(largest)[: len(points)] < 1.0


@eqx.filter_jit
def _monodromy(balance: ForcedBalance, points, steps: int):
    """What a period makes of small disturbances (points, n, n), by Runge-Kutta steps of the linearised motion."""
    values, first, _ = tables(balance.harmonics, 2 * steps)
    n = 2 * balance.system.dof

    def one(q):
        coefficients, omega = balance.split(q)
        states = jnp.concatenate([values @ coefficients, omega * (first @ coefficients)], 1)
        slopes = jax.vmap(jax.jacfwd(balance.system))(states)
        h = 2 * math.pi / omega / steps
        begin, middle, end = slopes[0::2], slopes[1::2], jnp.roll(slopes[0::2], -1, 0)

        def advance(y, abc):
            a, b, c = abc
            k1 = a @ y
            k2 = b @ (y + h / 2 * k1)
            k3 = b @ (y + h / 2 * k2)
            return y + h / 6 * (k1 + 2 * k2 + 2 * k3 + c @ (y + h * k3)), None

        return jax.lax.scan(advance, jnp.eye(n), (begin, middle, end))[0]

    return jax.vmap(one)(points)
