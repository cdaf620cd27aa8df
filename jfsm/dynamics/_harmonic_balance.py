"""Periodic motion as a sum of harmonics, followed along a curve of frequency or amplitude."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.optimize import brentq

from .._result import Result
from .._types import as_array, require_x64
from ..structures import Structure
from ._field import Field, autonomous_field
from ._linearise import linearise_field
from ._simulate import with_tables

_ITERATIONS = 12
_QUICK = 4
_SLOW = 7
_SETTLED = 1e-9
"""Last Newton step of a point that counts as found; being quadratic, it leaves rounding alone."""
_SMALLEST = 1e-6
_BEND = 0.9
"""Least cosine between neighbouring tangents: a sharper turn may be a jump to another curve."""
_ANGLE = 0.1
"""Largest angle of the fastest mode per step of the linearised motion [rad]."""
_STEPS = (64, 1 << 14)
_BATCH = 64
_LADDER = 12


@dataclass(frozen=True)
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

    frequency: np.ndarray
    amplitude: np.ndarray
    phase: np.ndarray
    stable: np.ndarray
    coefficients: np.ndarray
    folds: np.ndarray
    result: Result

    def motion(self, point: int, samples: int = 256) -> np.ndarray:
        """Displacements (samples, dof) over one period of a point, evenly spaced from where the force is largest."""
        harmonics = self.coefficients.shape[1] // 2
        return _tables(harmonics, samples)[0] @ self.coefficients[point]


@dataclass(frozen=True)
class Backbone:
    """Free periodic motion of the undamped structure in one of its modes.

    Attributes
    ----------
    frequency : (points,) array
        ω [rad/s].
    amplitude : (points,) array
        Half the distance between the turning points of the degree of freedom asked for [m].
    coefficients : (points, harmonics + 1, dof) array
        Mean, then cosines [m]: the motion begins at a turning point.
    result : Result
        Whether all amplitudes were reached.
    """

    frequency: np.ndarray
    amplitude: np.ndarray
    coefficients: np.ndarray
    result: Result


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
    _check(harmonics=harmonics, step=step, max_points=max_points, amplitude=amplitude)
    if not 1 <= at <= model.dof:
        raise ValueError(f"`at` must be a degree of freedom from 1 to {model.dof}; got {at}.")
    system = autonomous_field(with_tables(model))
    rest = _displacement(around, model.dof)
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


def backbone(
    model: Structure, amplitudes: Any, at: int = 1, mode: int = 1, harmonics: int = 7, *, around: Any = None
) -> Backbone:
    """Frequency of free vibration in one mode against its amplitude (a nonlinear normal mode).

    Parameters
    ----------
    model : Structure
        Smooth and independent of time. Its forces at rest count, f(x, 0): what depends on velocity is left out.
    amplitudes : (points,) array
        Ascending and positive: half the distance between the turning points of degree of freedom `at` [m].
    at : int
        Degree of freedom whose amplitude is meant, counted from 1.
    mode : int
        Mode that the curve begins in at small amplitude, counted from 1 by frequency.
    harmonics : int
        Number of harmonics beside the mean.
    around : (dof,) array, optional
        Stable displacement about which to vibrate [m]; the origin when None.

    Returns
    -------
    Backbone
        Up to the amplitude where the curve could not be followed further, which `result` tells: there it may turn back
        in amplitude, as at an internal resonance.

    Raises
    ------
    ValueError
        If a term sticks or depends on time, a mass is zero, an argument is out of its range, or the mode does not
        oscillate.
    """
    require_x64()
    _check(harmonics=harmonics)
    sizes = as_array(amplitudes, "amplitudes", 1)
    if not sizes.size or np.any(np.diff(sizes) <= 0) or sizes[0] <= 0:
        raise ValueError(f"`amplitudes` must be positive and ascend; got {sizes.tolist()}.")
    for name, number in (("at", at), ("mode", mode)):
        if not 1 <= number <= model.dof:
            raise ValueError(f"`{name}` must be a degree of freedom from 1 to {model.dof}; got {number}.")
    system = autonomous_field(with_tables(model))
    rest = _displacement(around, model.dof)
    omega, shape = _mode(system, rest, mode)
    if abs(shape[at - 1]) < 1e-9 * np.max(np.abs(shape)):
        raise ValueError(f"`at` must move in the mode; degree of freedom {at} stands still in mode {mode}.")
    length = float(sizes[0])
    balance = FreeBalance(
        system, harmonics, jnp.asarray(length), jnp.asarray(omega), jnp.max(jnp.abs(system.mass)) * omega**2 * length
    )
    begin = np.zeros((harmonics + 1, model.dof))
    begin[0], begin[1] = rest / length, shape / shape[at - 1]
    row = np.zeros_like(begin)
    row[1::2, at - 1] = 1.0
    row = np.append(row, 0.0)
    points: list[np.ndarray] = []
    for point in _rising(balance, np.append(begin, 1.0), row, sizes / length):
        points.append(point)
    found = np.array(points).reshape(-1, row.size)
    return Backbone(
        frequency=omega * found[:, -1],
        amplitude=sizes[: len(found)],
        coefficients=length * found[:, :-1].reshape(len(found), -1, model.dof),
        result=Result.successful if len(found) == len(sizes) else Result.unfinished,
    )


def _check(**arguments: float) -> None:
    for name, value in arguments.items():
        if not (value > 0 and math.isfinite(value)):
            raise ValueError(f"`{name}` must be positive; got {value!r}.")


def _displacement(around: Any, dof: int) -> np.ndarray:
    if around is None:
        return np.zeros(dof)
    rest = np.atleast_1d(as_array(around, "around", (0, 1)))
    if rest.shape != (dof,):
        raise ValueError(f"`around` must hold one displacement per degree of freedom ({dof}); got {rest.size}.")
    return rest


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


def _mode(system: Field, rest: np.ndarray, mode: int) -> tuple[float, np.ndarray]:
    """Frequency and shape of a mode of the undamped structure for small motion."""
    linear = linearise_field(system, np.append(rest, 0.0 * rest))
    squares, shapes = np.linalg.eig(np.linalg.solve(linear.mass, linear.stiffness))
    place = np.argsort(np.real(squares))[mode - 1]
    square = complex(squares[place])
    if abs(square.imag) > 1e-9 * abs(square) or square.real <= 0:
        raise ValueError(
            f"`mode` must oscillate for small motion; mode {mode} has ω² = {square.real:.6g}. "
            "Say by `around` about which stable point of rest to vibrate."
        )
    return math.sqrt(square.real), np.real(shapes[:, place])


def _tables(harmonics: int, samples: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean, cosines and sines at the samples of a period (samples, 2 harmonics + 1), and their derivatives."""
    angle = 2 * math.pi * np.arange(samples)[:, None] / samples
    h = np.arange(1, harmonics + 1)
    cosine, sine, zero = np.cos(h * angle), np.sin(h * angle), np.zeros((samples, 1))
    first = np.hstack([zero, -h * sine, h * cosine])
    return np.hstack([zero + 1.0, cosine, sine]), first, np.hstack([zero, -h * h * cosine, -h * h * sine])


def _samples(harmonics: int) -> int:
    return 8 * (harmonics + 1)


def _projection(values: Float[Array, "samples m"]) -> Float[Array, "m samples"]:
    """Coefficients from samples of a period, for harmonics that the samples resolve."""
    return values.T / jnp.sum(values**2, 0)[:, None]


class ForcedBalance(eqx.Module):
    """What harmonics do not balance, of q = (coefficients of displacement, frequency), all in units of their size."""

    system: Field
    harmonics: int = eqx.field(static=True)
    length: Float[Array, ""]
    omega: Float[Array, ""]
    drive: Float[Array, " dof"]

    def __call__(self, q: Float[Array, " n"]) -> Float[Array, " m"]:
        values, first, second = (jnp.asarray(a) for a in _tables(self.harmonics, _samples(self.harmonics)))
        coefficients, omega = self.split(q)
        x, v = values @ coefficients, omega * (first @ coefficients)
        inertia = omega**2 * (second @ coefficients) @ self.system.mass
        left = jax.vmap(self.system.force)(x, v) + inertia - values[:, 1:2] * self.drive[None, :]
        return (_projection(values) @ left / jnp.max(jnp.abs(self.drive))).ravel()

    def split(self, q: Float[Array, " n"]) -> tuple[Float[Array, "m dof"], Float[Array, ""]]:
        """Coefficients and frequency with their units."""
        return self.length * q[:-1].reshape(-1, self.system.dof), self.omega * q[-1]


class FreeBalance(eqx.Module):
    """The same without force, velocity and sines: an undamped motion that begins at a turning point."""

    system: Field
    harmonics: int = eqx.field(static=True)
    length: Float[Array, ""]
    omega: Float[Array, ""]
    force: Float[Array, ""]

    def __call__(self, q: Float[Array, " n"]) -> Float[Array, " m"]:
        tables = _tables(self.harmonics, _samples(self.harmonics))
        values, _, second = (jnp.asarray(a[:, : self.harmonics + 1]) for a in tables)
        coefficients, omega = self.length * q[:-1].reshape(-1, self.system.dof), self.omega * q[-1]
        inertia = omega**2 * (second @ coefficients) @ self.system.mass
        left = jax.vmap(lambda x: self.system.force(x, jnp.zeros_like(x)))(values @ coefficients) + inertia
        return (_projection(values) @ left / self.force).ravel()


class Solved(NamedTuple):
    """A point, the curve's direction there, the last step of Newton's method, and how many there were."""

    q: np.ndarray
    tangent: np.ndarray
    moved: float
    count: int

    @property
    def ok(self) -> bool:
        return bool(self.moved < _SETTLED) and bool(np.all(np.isfinite(self.tangent)))


def _solve(balance, guess: np.ndarray, row: np.ndarray, target: float) -> Solved:
    """The point of the curve at which row·q is `target`."""
    q, tangent, moved, count = _newton(balance, jnp.asarray(guess), jnp.asarray(row), jnp.asarray(float(target)))
    return Solved(np.asarray(q), np.asarray(tangent), float(moved), int(count))


@eqx.filter_jit
def _newton(balance, guess, row, target):
    def bordered(q):
        return jnp.concatenate([jax.jacfwd(balance)(q), row[None, :]])

    def step(carry):
        q, _, count = carry
        change = jnp.linalg.solve(bordered(q), jnp.concatenate([balance(q), (row @ q - target)[None]]))
        size = jnp.max(jnp.abs(q[balance.system.dof :]))  # of the motion; the mean may be larger
        return q - change, jnp.max(jnp.abs(change)) / size, count + 1

    def unsettled(carry):
        _, moved, count = carry
        return (moved > _SETTLED) & (count < _ITERATIONS)

    q, moved, count = jax.lax.while_loop(unsettled, step, (guess, jnp.full((), jnp.inf), 0))
    return q, jnp.linalg.solve(bordered(q), jnp.zeros_like(q).at[-1].set(1.0)), moved, count


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
    solved = _solve(balance, guess, row, guess[-1])
    if solved.ok:
        return solved
    q = guess
    for share in np.geomspace(1e-2, 1.0, _LADDER):
        weaker = eqx.tree_at(lambda b: b.drive, balance, share * balance.drive)
        solved = _solve(weaker, q, row, guess[-1])
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
            last = _solve(balance, guess, pinned, low if guess[-1] < low else high)
            if last.ok:
                return np.array([*points, last.q]), np.array(folds, int), Result.successful
        row = weights**2 * tangent
        there = _solve(balance, guess, row, row @ guess)
        turn = _cosine(weights * tangent, weights * there.tangent)
        if not there.ok or there.count > _SLOW or turn < _BEND:
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
        return _solve(balance, guess, row, row @ guess)

    share = brentq(lambda share: float(ahead(share).tangent[-1]), 0.0, 1.0, xtol=1e-13)
    return ahead(share).q


def _rising(balance: FreeBalance, guess: np.ndarray, row: np.ndarray, sizes: np.ndarray) -> Iterator[np.ndarray]:
    """The motion at each amplitude, reached from a small one in steps as long as Newton's method allows."""
    rest = guess.copy()
    rest[balance.system.dof : -1] = 0.0
    amplitude = 1e-3 * float(sizes[0])
    here = _solve(balance, rest + amplitude * (guess - rest), row, amplitude)
    ratio = 2.0
    for size in sizes:
        while here.ok and amplitude < size:
            ahead = min(size, amplitude * ratio)
            there = _solve(balance, here.q + (ahead - amplitude) * here.tangent, row, ahead)
            if there.ok and there.count <= _SLOW:
                here, amplitude, ratio = there, ahead, min(2.0, ratio * 1.2)
            elif ratio < 1.0 + 1e-4:
                return
            else:
                ratio = math.sqrt(ratio)
        if not here.ok:
            return
        yield here.q


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
    values, first, _ = _tables(balance.harmonics, 2 * steps)
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
