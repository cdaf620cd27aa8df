r"""Displacement, velocity and acceleration from whatever was measured of them.

    ẍ = -K x - C ẋ + B g - r,     r: a random force with a memory,     y = (x, v, ẍ) + bias + noise

The smoother of paper eqs. 70-71 drives a double integrator by one measured acceleration. Here every channel is a
reading, and the motion is that of a resonator with a random force, as a structure's is, so that a channel that is
missing can be told from the others. All its numbers (stiffness, damping, how the measured force enters, size and memory
of the random force, noise of each channel) are the most probable ones of the record.
"""

from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.optimize import minimize

from .._types import require_x64
from ..dynamics import lower
from ..dynamics._excitation import bucket, measured_force
from ..dynamics._simulate import check_pair
from ..records import Record, clipped, noise_floor, spikes
from ..structures import Structure
from ._kalman import LinearModel, log_likelihood, smoothed

_RESPONSES = ("displacement", "velocity", "acceleration")
_LEARNED = 8192
"""Samples, the first ones, that the numbers are learned from."""
_SHORTEST = 32
_FINEST, _OVERSAMPLED = 2, 3
"""Samples per knot of a spline: its residual holds signal too; from here on its curve may stand for a force."""
_LEAST_NOISE = 1e-4
_FULL_BAND = 1e-3
"""Noise of a force whose signal fills its band, as a share of its size at most: nothing in it tells."""
_SEARCH = {"maxiter": 80, "ftol": 1e-8}
_BIAS, _WIDE, _AT_REST = 0.3, 10.0, 1e-6
"""Standard deviations beforehand: of a bias in sizes of its channel, of the first state in sizes of the motion."""


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
        return np.sqrt(np.diagonal(self.covariance, axis1=2, axis2=3))


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
    The random force is a process of Matérn's family with ν = 1/2 or 3/2, whichever makes the record more probable: the
    rougher follows the jumps that dry friction makes, and leaves a wider error band elsewhere.
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


class _Kind(NamedTuple):
    """What a compiled program is made for.

    `channels` are the order of differentiation and the index of the degree of freedom of each; `learned` tells whether
    stiffness, damping and gains are among the numbers; `smooth`, which random force there is.
    """

    channels: tuple[tuple[int, int], ...]
    dof: int
    inputs: int
    learned: bool
    smooth: bool


class _Numbers(NamedTuple):
    """What is learned; logarithms but for `gain`, in units of the motion's size and rate."""

    stiffness: Any
    damping: Any
    gain: Any
    memory: Any
    size: Any
    noise: Any

    @classmethod
    def unpacked(cls, theta: Array, kind: _Kind) -> "_Numbers":
        """The numbers from one vector."""
        free = kind.dof if kind.learned else 0
        sizes = (free, free, free * kind.inputs, 1, kind.dof, len(kind.channels))
        k, c, gain, memory, size, noise = jnp.split(theta, np.cumsum(sizes)[:-1].tolist())
        return cls(k, c, gain.reshape(free, kind.inputs), memory[0], size, noise)

    @property
    def packed(self) -> np.ndarray:
        return np.concatenate([np.ravel(q) for q in self])


@dataclass(frozen=True)
class _Part:
    """Degrees of freedom that are estimated together, in units of the motion's size `length` and rate `omega`.

    `places` are the degrees of freedom, `channels` those of the record that show them, `sizes` their units; `drive`
    (n, inputs) enters the motion by the learned gains if `matrices` is None, else as the accelerations that it is;
    `blur` is the covariance of its own white noise.
    """

    places: tuple[int, ...]
    channels: tuple[tuple[str, int], ...]
    omega: float
    length: float
    dt: float
    seen: np.ndarray
    use: np.ndarray
    sizes: np.ndarray
    noise: np.ndarray
    doubt: np.ndarray
    drive: np.ndarray
    blur: np.ndarray
    base: np.ndarray
    matrices: tuple[np.ndarray, np.ndarray] | None
    at_rest: bool

    @classmethod
    def of_dof(cls, record: Record, place: int) -> "_Part":
        force, variance = _forces(record, record.dofs)
        acts = np.std(force, 0) > 0
        size = np.std(force, 0)[acts]
        return cls._of(record, (place,), force[:, acts] / size, np.diag(variance[acts] / size**2), None)

    @classmethod
    def of_model(cls, record: Record, model: Structure) -> "_Part":
        plant = lower(model)
        minv = np.linalg.inv(np.asarray(plant.mass))
        force, variance = _forces(record, model.dof)
        return cls._of(
            record,
            tuple(range(1, model.dof + 1)),
            force @ minv.T,
            minv @ np.diag(variance) @ minv.T,
            (minv @ np.asarray(plant.stiffness), minv @ np.asarray(plant.damping)),
        )

    @classmethod
    def _of(cls, record: Record, places: tuple[int, ...], drive: np.ndarray, blur: np.ndarray, matrices) -> "_Part":
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
        use = np.column_stack([~(clipped(y) | spikes(y, s)) for y, s in zip(seen.T, noise, strict=True)])
        absolute = orders == 2  # an accelerometer shows the base's motion as well
        unit = 1.0 if matrices is None else length * omega**2
        doubt = np.array([0.2 if floor.spacing > _FINEST else 3.0 for floor in floors])
        return cls(
            places, channels, omega, length, dt, (seen - base[:, None] * absolute) / sizes, use.astype(float), sizes,
            noise / sizes, doubt, drive / unit, blur / unit**2, base / (length * omega**2), matrices, record.at_rest,
        )  # fmt: skip

    def kind(self, smooth: bool) -> _Kind:
        channels = tuple((_RESPONSES.index(kind), self.places.index(j)) for kind, j in self.channels)
        return _Kind(channels, len(self.places), self.drive.shape[1], self.matrices is None, smooth)

    def data(self, count: int) -> "_Data":
        """The first `count` samples, padded to the length that programs are made for."""
        fill = ((0, bucket(count) - count), (0, 0))
        dof = len(self.places)
        k, c = (np.zeros((dof, dof)),) * 2 if self.matrices is None else self.matrices
        return _Data(
            *(jnp.asarray(np.pad(q[:count], fill)) for q in (self.seen, self.use, self.drive, self.base[:, None])),
            blur=jnp.asarray(self.blur),
            step=jnp.asarray(self.dt * self.omega),
            first=jnp.asarray(_AT_REST if self.at_rest else _WIDE),
            stiffness=jnp.asarray(k / self.omega**2),
            damping=jnp.asarray(c / self.omega),
        )

    @property
    def beliefs(self) -> tuple[_Numbers, _Numbers, _Numbers, _Numbers]:
        """Centre and width of what is believed beforehand, least and largest values.

        Little is, but of the noise, where the channel itself shows it.
        """
        dof, channels = len(self.places), len(self.channels)
        free = dof if self.matrices is None else 0
        shapes = ((free,), (free,), (free, self.drive.shape[1]), (), (dof,), (channels,))

        def all_of(*values):
            return _Numbers(*(np.broadcast_to(value, shape) for value, shape in zip(values, shapes, strict=True)))

        step, noise = float(np.log(self.dt * self.omega)), np.log(self.noise)
        return (
            all_of(0.0, -2.0, 0.0, 0.0, -1.0, noise),
            all_of(2.0, 2.0, 3.0, 2.0, 3.0, self.doubt),
            all_of(-6.0, -10.0, -30.0, step, -10.0, noise - 4.0),
            all_of(4.0, 2.0, 30.0, 5.0, 4.0, noise + 4.0),
        )


class _Data(NamedTuple):
    """Readings, which of them count, what drives, the base; noise of the drive, the step, and what is not learned."""

    seen: Float[Array, "n channels"]
    use: Float[Array, "n channels"]
    drive: Float[Array, "n inputs"]
    base: Float[Array, "n 1"]
    blur: Float[Array, "inputs inputs"]
    step: Float[Array, ""]
    first: Float[Array, ""]
    stiffness: Float[Array, "dof dof"]
    damping: Float[Array, "dof dof"]


def _forces(record: Record, dof: int) -> tuple[np.ndarray, np.ndarray]:
    """Force samples (n, dof), smoothed where their noise shows above the signal's band, and the variance it leaves."""
    variance = np.zeros(dof)
    if record.drive == "motion":
        return np.zeros((len(record), dof)), variance
    force = measured_force(record, dof)
    for j in range(dof):
        if np.any(force[:, j]):
            floor = noise_floor(force[:, j], record.dt)
            if floor.spacing >= _OVERSAMPLED:
                force[:, j] = floor.smooth
                variance[j] = floor.std**2 * floor.effective_parameters / len(record)
            else:
                variance[j] = min(floor.std, _FULL_BAND * np.std(force[:, j])) ** 2
    return force, variance


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
    n = len(part.seen)
    head = part.data(min(n, _LEARNED))
    centre, width, low, high = (numbers.packed for numbers in part.beliefs)
    found = []
    for smooth in (False, True):
        kind = part.kind(smooth)

        def cost(theta, kind=kind):
            value, slope = _cost(jnp.asarray(theta), head, jnp.asarray(centre), jnp.asarray(width), kind=kind)
            return float(value), np.asarray(slope)

        bounds = list(zip(low, high, strict=True))
        best = minimize(cost, np.clip(centre, low, high), jac=True, method="L-BFGS-B", bounds=bounds, options=_SEARCH)
        found.append((best.fun, kind, best.x))
    _, kind, theta = min(found, key=lambda item: item[0])
    mean, covariance = (np.asarray(q)[:n] for q in _motion(jnp.asarray(theta), part.data(n), kind=kind))
    count = 3 * kind.dof
    noise = np.exp(_Numbers.unpacked(jnp.asarray(theta), kind).noise)
    return mean[:, :count], covariance[:, :count, :count], mean[0, count:], noise


class _Built(NamedTuple):
    """A linear model; how a driving acceleration, its slope and its bend enter it; rows of (x, v, a) and of biases."""

    linear: LinearModel
    enter: Float[Array, "state three_dof"]
    watch: Float[Array, "watched state"]


def _built(numbers: _Numbers, blur, data: _Data, kind: _Kind) -> _Built:
    dof, dt, eye = kind.dof, data.step, jnp.eye(kind.dof)
    k, c = data.stiffness, data.damping
    if kind.learned:
        k, c = jnp.diag(jnp.exp(numbers.stiffness)), jnp.diag(jnp.exp(numbers.damping))
    size, tau = jnp.exp(numbers.size), jnp.exp(numbers.memory)
    if kind.smooth:  # Matérn 3/2: the random force and its rate
        rate = jnp.sqrt(3.0) / tau
        memory = jnp.block([[0 * eye, eye], [-(rate**2) * eye, -2 * rate * eye]])
        density = jnp.concatenate([0 * size, 4 * rate**3 * size**2])
        stationary = jnp.concatenate([size**2, (rate * size) ** 2])
    else:  # Matérn 1/2: Ornstein and Uhlenbeck's
        memory, density, stationary = -eye / tau, 2 * size**2 / tau, size**2
    extra = density.size
    n = 2 * dof + extra
    a = jnp.zeros((n, n)).at[:dof, dof : 2 * dof].set(eye).at[2 * dof :, 2 * dof :].set(memory)
    a = a.at[dof : 2 * dof].set(jnp.concatenate([-k, -c, -eye, jnp.zeros((dof, extra - dof))], 1))
    # C. F. Van Loan, IEEE Trans. Autom. Control 23 (1978) 395-404: the covariance that a step adds.
    spread = jnp.diag(jnp.concatenate([jnp.zeros(2 * dof), density]))
    loan = jax.scipy.linalg.expm(dt * jnp.block([[-a, spread], [jnp.zeros((n, n)), a.T]]))
    step = loan[n:, n:].T
    added = step @ loan[:n, n:]
    # The drive is a parabola between samples: x' = a x + enter u, with u, u' and u'' at the start of the step.
    held = jnp.zeros((n + 3 * dof, n + 3 * dof)).at[:n, :n].set(dt * a)
    held = held.at[dof : 2 * dof, n : n + dof].set(dt * eye)
    held = held.at[n : n + dof, n + dof : n + 2 * dof].set(eye).at[n + dof : n + 2 * dof, n + 2 * dof :].set(eye)
    enter = jax.scipy.linalg.expm(held)[:n, n:]
    shown = jnp.stack([jnp.eye(n)[:dof], jnp.eye(n)[dof : 2 * dof], a[dof : 2 * dof]])
    rows = jnp.stack([shown[order, j] for order, j in kind.channels])
    channels = len(kind.channels)
    biased = jnp.diag(jnp.array([float(order > 0) for order, _ in kind.channels]))
    start = jnp.concatenate([jnp.full(2 * dof, data.first**2), stationary, jnp.full(channels, _BIAS**2)])
    fill = (0, channels)
    linear = LinearModel(
        step=jnp.eye(n + channels).at[:n, :n].set(step),
        noise=jnp.pad((added + added.T) / 2, (fill, fill)).at[dof : 2 * dof, dof : 2 * dof].add(dt**2 * blur),
        rows=jnp.concatenate([rows, biased], 1),
        variance=jnp.exp(2 * numbers.noise) + jnp.stack([blur[j, j] * (order == 2) for order, j in kind.channels]),
        start=jnp.diag(start),
    )
    watch = jnp.zeros((3 * dof + channels, n + channels)).at[3 * dof :, n:].set(biased)
    watch = watch.at[: 3 * dof, :n].set(shown.transpose(1, 0, 2).reshape(3 * dof, n))
    return _Built(linear, jnp.pad(enter, (fill, (0, 0))), watch)


class _Driven(NamedTuple):
    """What is built; the acceleration that drives and its noise; what it adds over every step; readings without it."""

    built: _Built
    push: Float[Array, "n dof"]
    blur: Float[Array, "dof dof"]
    pushed: Float[Array, "n state"]
    seen: Float[Array, "n channels"]


def _driven(theta: Array, data: _Data, kind: _Kind) -> _Driven:
    numbers = _Numbers.unpacked(theta, kind)
    push, blur = data.drive, data.blur
    if kind.learned:
        push, blur = push @ numbers.gain.T, numbers.gain @ blur @ numbers.gain.T
    push = push - data.base
    built = _built(numbers, blur, data, kind)
    after = jnp.concatenate([push[1:], push[-1:]])
    bend = jnp.concatenate([push[:1], push[:-1]]) - 2 * push + after
    bend = (bend + jnp.concatenate([bend[1:], bend[-1:]])) / 2
    pushed = jnp.concatenate([push, after - push - bend / 2, bend], 1) @ built.enter.T
    at_once = jnp.stack([push[:, j] * (order == 2) for order, j in kind.channels], 1)
    return _Driven(built, push, blur, pushed, data.seen - at_once)


@partial(jax.jit, static_argnames="kind")
def _cost(theta: Array, data: _Data, centre: Array, width: Array, *, kind: _Kind):
    """Minus log-posterior of the numbers, and its slope."""

    def cost(theta):
        d = _driven(theta, data, kind)
        likelihood = log_likelihood(d.built.linear, d.pushed, d.seen, data.use)
        return 0.5 * jnp.sum(((theta - centre) / width) ** 2) - likelihood

    return jax.value_and_grad(cost)(theta)


@partial(jax.jit, static_argnames="kind")
def _motion(theta: Array, data: _Data, *, kind: _Kind):
    """Mean and covariance of (x, v, a) of every degree of freedom, and then of the biases."""
    d = _driven(theta, data, kind)
    mean, covariance = smoothed(d.built.linear, d.pushed, d.seen, data.use, d.built.watch)
    own = slice(2, 3 * kind.dof, 3)
    return mean.at[:, own].add(d.push), covariance.at[:, own, own].add(d.blur)
