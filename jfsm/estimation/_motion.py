"""Displacement, velocity and acceleration from whatever was measured of them.

The smoother of paper eqs. 70-71 drives a double integrator by one measured acceleration. Here every channel is a
reading, and the motion is that of a resonator with a random force, as a structure's is, so that a channel that is
missing can be told from the others. All its numbers (stiffness, damping, how the measured force enters, size and memory
of the random force, noise of each channel) are the most probable ones of the record.
"""

from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import minimize

from .._types import require_x64
from ..dynamics import lower
from ..dynamics._excitation import bucket, measured_force
from ..dynamics._simulate import check_pair
from ..records import Record, clipped, noise_floor, spikes
from ..structures import Structure
from ._resonator import Data, Kind, Numbers, cost, motion

_RESPONSES = ("displacement", "velocity", "acceleration")
_LEARNED = 8192
"""Samples, the first ones, that the numbers are learned from."""
_SHORTEST = 32
_FINEST, _OVERSAMPLED = 2, 3
"""Samples per knot of a spline: its residual holds signal too; from here on its curve may stand for a force."""
_LEAST_NOISE = 1e-4
_FULL_BAND = 1e-3
"""Noise of a force whose signal fills its band, as a share of its size at most: nothing in it tells."""
_SMOOTHNESS = (0, 2)
"""Derivatives that the random force may have."""
_CYCLES = (1.0, 4.0)
"""Cycles of the motion over which the random force may swell or fade."""
_LEAST_SWELL = 1e-4
_SEARCH = {"maxiter": 80, "ftol": 1e-8}
_NO_VALUE = 1e20
_STRANGE = 5.0
"""Standard errors from which a spike is no part of the motion."""
_WIDE, _AT_REST = 10.0, 1e-6
"""Standard deviation of the first state beforehand, in sizes of the motion."""


@dataclass(frozen=True)
class Motion:
    """Smoothed motion of a record, with its error.

    Attributes
    ----------
    time : (n,) array
        Instants [s].
    displacement, velocity, acceleration : (n, dof) arrays
        Displacement and velocity relative to the base, acceleration absolute, as in the record.
    covariance : (n, dof, 3, 3) array
        Of (displacement, velocity, acceleration) of each degree of freedom.
    noise : dict of kind to (measured dofs,) array
        Standard deviation of the white noise of each channel.
    bias : dict of (kind, dof) to float
        Constant that a velocity or an acceleration channel shows beside the motion.
    """

    time: np.ndarray
    displacement: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    covariance: np.ndarray
    noise: dict[str, np.ndarray]
    bias: dict[tuple[str, int], float]

    @property
    def std(self) -> np.ndarray:
        """Standard error (n, dof, 3) of displacement, velocity and acceleration."""
        return np.sqrt(np.maximum(np.diagonal(self.covariance, axis1=2, axis2=3), 0.0))


def estimate_motion(record: Record, model: Structure | None = None) -> Motion:
    """Displacement, velocity and acceleration at every sample, from any mix of them, with their covariance.

    Parameters
    ----------
    record : Record
        With at least one response; at least 32 samples, evenly spaced.
    model : Structure, optional
        Its masses and linear springs and dashpots tie the degrees of freedom together, so that one that is not
        measured can be estimated; all else it leaves to the random force. Without it every degree of freedom is a
        resonator of its own, whose numbers are learned from the record.

    Returns
    -------
    Motion

    Raises
    ------
    ValueError
        If the record has no response, is short or unevenly sampled, a degree of freedom is measured by nothing and no
        model is given, or what is measured does not tell the motion of the model.

    Notes
    -----
    The random force is a process of Matérn's family with ν = 1/2 or 5/2, whichever makes the record more probable: the
    rougher follows the jumps that dry friction makes, and leaves a wider error band elsewhere. Where a motion
    grows or dies away, the random force does so with it.
    """
    require_x64()
    if not record.responses:
        raise ValueError(
            "`record` must hold a response (displacement, velocity or acceleration); it has none to start from."
        )
    if len(record) < _SHORTEST:
        raise ValueError(f"`record` must hold at least {_SHORTEST} samples; it has {len(record)}.")
    dof = record.dofs if model is None else model.dof
    if model is not None:
        check_pair(model, record)
        return _together(record, [_Part.of_model(record, model)], dof)
    for j in range(1, dof + 1):
        if not any(place == j for _, place in record.responses):
            raise ValueError(
                f"`model` must be given where a degree of freedom is measured by nothing; {j} is not. "
                "Pass the structure, whose links tell what moves it."
            )
    return _together(record, [_Part.of_dof(record, j) for j in range(1, dof + 1)], dof)


@dataclass(frozen=True)
class _Part:
    """Degrees of freedom that are estimated together, in units of the motion's size `length` and rate `omega`.

    `places` are the degrees of freedom, `channels` those of the record that show them, `sizes` their units; `drive`
    (n, inputs) are the measured forces in units of their size, and `rough` the standard deviations of their white
    noise, known to a factor exp(`vague`). `gain` tells how they enter where that is not learned, `matrices` stiffness
    and damping.
    """

    places: tuple[int, ...]
    channels: tuple[tuple[str, int], ...]
    omega: float
    length: float
    dt: float
    seen: np.ndarray
    use: np.ndarray
    spiky: np.ndarray
    sizes: np.ndarray
    noise: np.ndarray
    doubt: np.ndarray
    drive: np.ndarray
    rough: np.ndarray
    vague: np.ndarray
    base: np.ndarray
    gain: np.ndarray
    matrices: tuple[np.ndarray, np.ndarray] | None
    at_rest: bool

    @classmethod
    def of_dof(cls, record: Record, place: int) -> "_Part":
        return cls._of(record, (place,), None, None)

    @classmethod
    def of_model(cls, record: Record, model: Structure) -> "_Part":
        plant = lower(model)
        minv = np.linalg.inv(np.asarray(plant.mass))
        matrices = (minv @ np.asarray(plant.stiffness), minv @ np.asarray(plant.damping))
        return cls._of(record, tuple(range(1, model.dof + 1)), minv, matrices)

    @classmethod
    def _of(cls, record: Record, places: tuple[int, ...], minv: np.ndarray | None, matrices) -> "_Part":
        channels = tuple(c for c in record.responses if c[1] in places)
        n, dt = len(record), record.dt
        base = np.zeros(n) if record.base_acceleration is None else record.base_acceleration
        seen = np.column_stack([record.responses[c] for c in channels])
        floors = [noise_floor(seen[:, i], dt) for i in range(len(channels))]
        smooth = [floor.smooth - np.mean(floor.smooth) for floor in floors]
        rate = np.median([np.std(np.diff(y)) / (dt * max(np.std(y), 1e-300)) for y in smooth])
        omega = float(rate) if matrices is None else float(np.sqrt(np.max(np.abs(np.linalg.eigvals(matrices[0])))))
        omega = min(max(omega, 2 * np.pi / (n * dt)), np.pi / dt)
        spread = np.maximum(np.std(seen, 0), 1e-300)
        orders = np.array([_RESPONSES.index(kind) for kind, _ in channels])
        length = float(np.median(spread / omega**orders))
        sizes = length * omega**orders
        least = _LEAST_NOISE * spread
        noise = np.array([max(floor.std, low) for floor, low in zip(floors, least, strict=True)])
        spiky = np.column_stack([spikes(y, s) for y, s in zip(seen.T, noise, strict=True)])
        use = np.column_stack([~clipped(y) for y in seen.T]) & ~spiky
        absolute = orders == 2  # an accelerometer shows the base's motion as well
        force, rough, vague = _forces(record, record.dofs if minv is None else len(minv))
        acts = np.std(force, 0) > 0
        size = np.std(force, 0)[acts]
        gain = np.zeros((len(places), len(size))) if minv is None else minv[:, acts] * size / (length * omega**2)
        doubt = np.array([0.2 if floor.spacing > _FINEST else 3.0 for floor in floors])
        return cls(
            places, channels, omega, length, dt, (seen - base[:, None] * absolute) / sizes, use.astype(float), spiky,
            sizes, noise / sizes, doubt, force[:, acts] / size, rough[acts] / size, vague[acts],
            base / (length * omega**2), gain, matrices, record.at_rest,
        )  # fmt: skip

    def kind(self, smoothness: int) -> Kind:
        channels = tuple((_RESPONSES.index(kind), self.places.index(j)) for kind, j in self.channels)
        return Kind(channels, len(self.places), self.drive.shape[1], self.matrices is None, smoothness)

    def data(self, count: int, swell: np.ndarray) -> Data:
        """The first `count` samples, padded to the length that programs are made for."""
        fill = ((0, bucket(count) - count), (0, 0))
        dof = len(self.places)
        k, c = (np.zeros((dof, dof)),) * 2 if self.matrices is None else self.matrices
        columns = (self.seen, self.use, self.drive, self.base[:, None], swell[:, None])
        seen, use, drive, base, swell = (np.pad(q[:count], fill) for q in columns)
        numbers = (
            seen, use, drive, base, swell[:, 0], self.dt * self.omega, _AT_REST if self.at_rest else _WIDE,
            k / self.omega**2, c / self.omega, self.gain,
        )  # fmt: skip
        return Data(*(jnp.asarray(q) for q in numbers))

    @property
    def beliefs(self) -> tuple[Numbers, Numbers, Numbers, Numbers]:
        """Centre and width of what is believed beforehand, least and largest values.

        Little is, but of the noise, where the channel itself shows it.
        """
        dof, channels, inputs = len(self.places), len(self.channels), self.drive.shape[1]
        free = dof if self.matrices is None else 0
        shapes = ((free,), (free,), (free, inputs), (), (dof,), (inputs,), (dof,), (channels,))

        def all_of(*values):
            return Numbers(*(np.broadcast_to(value, shape) for value, shape in zip(values, shapes, strict=True)))

        step, force, noise = float(np.log(self.dt * self.omega)), np.log(self.rough), np.log(self.noise)
        return (
            all_of(0.0, -2.0, 0.0, 0.0, -1.0, force, step - 7.0, noise),
            all_of(2.0, 2.0, 3.0, 2.0, 3.0, self.vague, 3.0, self.doubt),
            all_of(-6.0, -10.0, -30.0, step, -10.0, force - 7.0, step - 16.0, noise - 4.0),
            all_of(4.0, 2.0, 30.0, 5.0, 4.0, force + 7.0, step, noise + 4.0),
        )


def _forces(record: Record, dof: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Force samples (n, dof), smoothed where their noise shows above the signal's band; the standard deviation of the
    noise that is left, and the doubt about its logarithm."""
    rough, vague = np.ones(dof), np.ones(dof)
    if record.drive == "motion":
        return np.zeros((len(record), dof)), rough, vague
    force = measured_force(record, dof)
    for j in range(dof):
        if np.any(force[:, j]):
            floor = noise_floor(force[:, j], record.dt)
            if floor.spacing >= _OVERSAMPLED:
                force[:, j] = floor.smooth
                rough[j], vague[j] = floor.std * np.sqrt(floor.effective_parameters / len(record)), 1.0
            else:
                rough[j], vague[j] = min(floor.std, _FULL_BAND * np.std(force[:, j])), 3.0
            rough[j] = max(rough[j], _LEAST_NOISE * np.std(force[:, j]))
    return force, rough, vague


def _together(record: Record, parts: list[_Part], dof: int) -> Motion:
    """The estimates of all parts, in the record's units."""
    n = len(record)
    states, covariance = np.zeros((3, n, dof)), np.zeros((n, dof, 3, 3))
    noise: dict[tuple[str, int], float] = {}
    bias: dict[tuple[str, int], float] = {}
    for part in parts:
        mean, spread, offset, levels = _estimate(part)
        units = part.length * part.omega ** np.arange(3)
        for i, j in enumerate(part.places):
            rows = slice(3 * i, 3 * i + 3)
            states[:, :, j - 1] = (mean[:, rows] * units).T
            covariance[:, j - 1] = spread[:, rows, rows] * np.outer(units, units)
        noise |= dict(zip(part.channels, (levels * part.sizes).tolist(), strict=True))
        bias |= {c: b for c, b in zip(part.channels, (offset * part.sizes).tolist(), strict=True) if b}
    base = 0.0 if record.base_acceleration is None else record.base_acceleration[:, None]
    kinds = dict.fromkeys(kind for kind, _ in record.responses)
    by_kind = {kind: np.array([noise[c] for c in record.responses if c[0] == kind]) for kind in kinds}
    return Motion(record.time, states[0], states[1], states[2] + base, covariance, by_kind, bias)


def _estimate(part: _Part) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Mean and covariance of (x, v, a) of every degree of freedom, biases and noise levels, in units of the motion."""
    n, dof = len(part.seen), len(part.places)
    begin, even = part.beliefs[0].packed, np.ones(n)
    best = min((_learned(part, part.kind(p), begin, even) for p in _SMOOTHNESS), key=lambda found: found.cost)
    best = _swollen(part, best)
    mean, covariance = _smoothed(part, best)
    if np.any(part.spiky):
        part = _believing(part, best, mean, covariance)
        mean, covariance = _smoothed(part, best)
    count, biased = 3 * dof, best.kind.biased
    bias = np.zeros(len(part.channels))
    bias[list(biased)] = mean[0, count : count + len(biased)]
    noise = np.exp(Numbers.unpacked(jnp.asarray(best.theta), best.kind).noise)
    return mean[:, :count], covariance[:, :count, :count], bias, noise


@dataclass(frozen=True)
class _Learned:
    """Most probable numbers of one kind of model, and how improbable they make the record."""

    cost: float
    kind: Kind
    theta: np.ndarray
    swell: np.ndarray


def _learned(part: _Part, kind: Kind, begin: np.ndarray, swell: np.ndarray, price: float = 0.0) -> _Learned:
    centre, width, low, high = (numbers.packed for numbers in part.beliefs)
    head = part.data(min(len(part.seen), _LEARNED), swell)

    def cost_of(theta):
        value, slope = cost(jnp.asarray(theta), head, jnp.asarray(centre), jnp.asarray(width), kind=kind)
        if not np.isfinite(value):  # numbers that the filter cannot run with; the search turns back
            return _NO_VALUE, np.zeros(theta.size)
        return float(value), np.asarray(slope)

    bounds = list(zip(low, high, strict=True))
    best = minimize(cost_of, np.clip(begin, low, high), jac=True, method="L-BFGS-B", bounds=bounds, options=_SEARCH)
    return _Learned(float(best.fun) + price, kind, best.x, swell)


def _smoothed(part: _Part, found: _Learned) -> tuple[np.ndarray, np.ndarray]:
    n = len(part.seen)
    mean, covariance = motion(jnp.asarray(found.theta), part.data(n, found.swell), kind=found.kind)
    return np.asarray(mean)[:n], np.asarray(covariance)[:n]


def _believing(part: _Part, found: _Learned, mean: np.ndarray, covariance: np.ndarray) -> _Part:
    """The part with those spikes counted that may be motion, as the kicks of dry friction are."""
    use = part.use.copy()
    noise = np.exp(Numbers.unpacked(jnp.asarray(found.theta), found.kind).noise)
    for i, (order, j) in enumerate(found.kind.channels):
        place = 3 * j + order
        expected = mean[:, place]
        if i in found.kind.biased:
            expected = expected + mean[:, 3 * found.kind.dof + found.kind.biased.index(i)]
        strange = np.abs(part.seen[:, i] - expected) > _STRANGE * np.sqrt(covariance[:, place, place] + noise[i] ** 2)
        use[part.spiky[:, i] & ~strange, i] = 1.0
    return replace(part, use=use)


def _swollen(part: _Part, found: _Learned) -> _Learned:
    """The same with a random force that swells and fades as the one found does, if that is more probable."""
    n, dof = len(part.seen), found.kind.dof
    mean, covariance = _smoothed(part, found)
    size = np.exp(Numbers.unpacked(jnp.asarray(found.theta), found.kind).size)
    spread = np.diagonal(covariance[:, -dof:, -dof:], axis1=1, axis2=2)
    power = np.mean((mean[:, -dof:] ** 2 + spread) / size**2, 1)
    best = found
    for cycles in _CYCLES:
        window = cycles * 2 * np.pi / (part.omega * part.dt)
        local = gaussian_filter1d(power, window, mode="nearest")
        swell = np.maximum(local / np.mean(local), _LEAST_SWELL)
        # What is free to swell fits better by chance: half a nat for every window.
        best = min(best, _learned(part, found.kind, found.theta, swell, 0.5 * n / window), key=lambda each: each.cost)
    return best
