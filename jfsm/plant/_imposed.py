r"""The motion that a rig imposes, between its samples, with its measurement error.

All channels of a degree of freedom are readings of one quintic spline and its derivatives,

    x(t) = Σ c_i B_i(t),     c = argmin Σ_channels Σ_samples (y - x^(order))² / σ²,

with uniform knots. Their spacing minimises the generalised cross-validation score. If a single channel fills
its band, the spline interpolates its samples.

The coefficients' error is Gaussian, its covariance the inverse of the normal matrix A. That is banded: with A = U Uᵀ, U
an upper triangle, Uᵀ δc = w is a recursion forward in time, by which a filter can follow the error.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float
from scipy.interpolate import BSpline
from scipy.linalg import cholesky_banded, solveh_banded
from scipy.sparse import csr_array, diags_array

from .._types import Array
from ..records import NoiseFloor, Record, bridged, noise_floor, spikes
from ..structures import AbstractSensor, AccelerationBias, AccelerationGain, ChannelDelay, Offset, Structure
from ._excitation import Size, substeps_for

_DEGREE = 5
_ACTIVE = _DEGREE + 1
"""Coefficients that act at an instant."""
_SPACINGS = (1, 2, 3, 4, 6, 9, 14, 24, 60, 200)
"""Samples between knots that are tried."""
_FINEST = 2
"""Spacing at which a single channel is no longer smoothed."""
_SHORTEST = 16
_LEAST_NOISE, _BAND_LIMITED = 1e-6, 1e-3
"""Noise of a channel as a share of its size: at least, and at most where its signal fills the band."""
_SHIFTED = 0.01
"""Constant of a velocity or an acceleration, as a share of its size, from which it is mentioned."""
_HEAVY = 1e30
"""Mass that no force of a structure moves, so that only the rates of its hidden states remain."""
_ORDERS = {"displacement": 0, "velocity": 1, "acceleration": 2}


class MotionError(eqx.Module):
    """Error of an imposed motion as a process in time, that of the six coefficients that act at a sample.

    `rows` (n, dof, 3, 6) make x, v and a of them. Where `enters` (n, dof), a new coefficient takes the place of the
    oldest: `follow` (n, dof, 5) of those before it, and noise of variance `fresh` (n, dof). `start` (dof, 6, 6) is
    their covariance at the first sample.
    """

    rows: Float[Array, "n dof 3 6"]
    enters: Bool[Array, "n dof"]
    follow: Float[Array, "n dof 5"]
    fresh: Float[Array, "n dof"]
    start: Float[Array, "dof 6 6"]

    def head(self, n: int) -> "MotionError":
        """The first `n` samples."""
        return MotionError(self.rows[:n], self.enters[:n], self.follow[:n], self.fresh[:n], self.start)


class Imposed(eqx.Module):
    """An imposed motion between consecutive samples, on half steps.

    `x` and `v` (n, 2 substeps + 1, dof) belong to the interval after each sample, `a` (n, dof) and `speed_std`
    (n, dof), the standard error of the velocity, to the sample.
    """

    x: Float[Array, "n halves dof"]
    v: Float[Array, "n halves dof"]
    a: Float[Array, "n dof"]
    speed_std: Float[Array, "n dof"]
    error: MotionError
    time: Float[Array, " n"]
    step: Float[Array, ""]

    @property
    def substeps(self) -> int:
        return (self.x.shape[1] - 1) // 2

    def head(self, n: int) -> "Imposed":
        """The first `n` samples."""
        return Imposed(
            self.x[:n], self.v[:n], self.a[:n], self.speed_std[:n], self.error.head(n), self.time[:n], self.step
        )


class _Trace(NamedTuple):
    """`MotionError` of one degree of freedom, and the standard error (n,) of its velocity."""

    rows: Float[np.ndarray, "n 3 6"]
    enters: Bool[np.ndarray, " n"]
    follow: Float[np.ndarray, "n 5"]
    fresh: Float[np.ndarray, " n"]
    speed_std: Float[np.ndarray, " n"]
    start: Float[np.ndarray, "6 6"]


@dataclass(frozen=True)
class Path:
    """The motion of a record as splines, one of the displacement of each degree of freedom.

    `notes` name the assumptions.
    """

    record: Record
    splines: tuple[BSpline, ...]
    errors: tuple[_Trace, ...]
    notes: tuple[str, ...]

    def motion(
        self, time: Float[np.ndarray, "*instants"]
    ) -> tuple[
        Float[np.ndarray, "*instants dof"], Float[np.ndarray, "*instants dof"], Float[np.ndarray, "*instants dof"]
    ]:
        """Displacement, velocity and acceleration (..., dof) at any instants of the record."""
        x, v, a = (np.stack([s(time, nu) for s in self.splines], -1) for nu in range(3))
        return x, v, a

    def imposed(self, substeps: int, length: int | None = None) -> Imposed:
        """The motion on half steps, padded to `length` samples with zeros."""
        record, n = self.record, len(self.record)
        padded = n if length is None else length
        ahead = np.arange(2 * substeps + 1) / (2 * substeps)
        begin = record.time[0] + record.dt * np.arange(n)
        x, v, a = self.motion(np.minimum(begin[:, None] + record.dt * ahead, begin[-1]))

        def filled(q: np.ndarray) -> Array:
            return jnp.asarray(np.pad(q, ((0, padded - n), *((0, 0),) * (q.ndim - 1))))

        *along, start = (np.stack(q) for q in zip(*self.errors, strict=True))
        rows, enters, follow, fresh, speed_std = (filled(q.swapaxes(0, 1)) for q in along)
        return Imposed(
            x=filled(x),
            v=filled(v),
            a=filled(a[:, 0]),
            speed_std=speed_std,
            error=MotionError(rows, enters, follow, fresh, jnp.asarray(start)),
            time=jnp.asarray(record.time[0] + record.dt * np.arange(padded)),
            step=jnp.asarray(record.dt),
        )


def imposed_motion(record: Record, structure: Structure) -> Path:
    """The motion of a record whose motion drives.

    The channels are corrected for the gains, offsets and delays of the structure, except for offsets of displacements,
    which belong to the plant. If the displacement is measured, the mean of its derivative replaces that of the velocity
    or acceleration. Without a displacement the velocity is integrated, with zero mean.

    Raises
    ------
    ValueError
        If a degree of freedom is measured by neither displacement nor velocity, the record is shorter than 16 samples,
        or it has a moving base.
    """
    if record.base_acceleration is not None:
        raise ValueError(
            '`record` has drive="motion" and a base_acceleration; an imposed motion is relative to ground. '
            "Leave the base out, and give the motion of both ends of the component as degrees of freedom."
        )
    if len(record) < _SHORTEST:
        raise ValueError(f'`record` with drive="motion" must hold at least {_SHORTEST} samples; it has {len(record)}.')
    splines, errors, notes = [], [], []
    for j in range(1, structure.dof + 1):
        kinds = [kind for kind in _ORDERS if (kind, j) in record.channels]
        if not kinds or kinds[0] == "acceleration":
            raise ValueError(
                f'`record` has drive="motion", so it must hold the displacement of every degree of freedom (or its '
                f"velocity); it has neither of {j}. Measure it, or leave that degree of freedom out of the model."
            )
        measured = [_channel(record, (kind, j), structure.sensors, notes) for kind in kinds]
        spline, error = _fitted(measured, record, notes)
        splines.append(spline)
        errors.append(error)
    return Path(record, tuple(splines), tuple(errors), tuple(notes))


def imposed_substeps(structure: Structure, dt: float, size: Size) -> int:
    """Steps per sample that the hidden states of a structure need along a motion of about this size."""
    return substeps_for(Structure(np.full(structure.dof, _HEAVY), structure.terms), dt, size)


def noise_of(floor: NoiseFloor, size: float) -> float:
    """Noise of a channel; if its signal fills the band, the part of the floor that is surely noise."""
    if not floor.fills_band:
        return floor.std
    return max(min(floor.std, _BAND_LIMITED * size), floor.std - 2 * floor.std_error)


class _Reading(NamedTuple):
    """A channel of a degree of freedom: instants in samples, values, and standard deviation of its noise."""

    places: np.ndarray
    values: np.ndarray
    noise: float


class _Rows(NamedTuple):
    """Equations for the coefficients of a spline, each in units of its own error."""

    matrix: csr_array
    wanted: np.ndarray


def _channel(
    record: Record, channel: tuple[str, int], sensors: Sequence[AbstractSensor], notes: list[str]
) -> tuple[str, _Reading]:
    def stated(*effects: type[AbstractSensor]) -> float:
        return sum(s.value for s in sensors if s.at == channel and isinstance(s, effects))

    constant = 0.0 if channel[0] == "displacement" else stated(Offset, AccelerationBias)
    y = (record.channels[channel] - constant) / (1.0 + stated(AccelerationGain))
    floor, size = noise_floor(y, record.dt), float(np.std(y))
    if size == 0:
        raise ValueError(f"`{channel[0]}` {channel[1]} is constant; where the motion drives, it must move.")
    noise = max(noise_of(floor, size), _LEAST_NOISE * size)
    torn = spikes(y, noise)
    if np.any(torn):
        y = bridged(y, torn)
        notes.append(f"{channel[0]} {channel[1]}: {int(torn.sum())} torn samples are interpolated.")
    return channel[0], _Reading(np.arange(y.size) - stated(ChannelDelay) / record.dt, y, noise)


def _fitted(measured: list[tuple[str, _Reading]], record: Record, notes: list[str]) -> tuple[BSpline, _Trace]:
    """Spline of the displacement, and its error."""
    n, dt, lowest = len(record), record.dt, _ORDERS[measured[0][0]]
    orders = [_ORDERS[kind] - lowest for kind, _ in measured]
    readings = [reading for _, reading in measured]
    if lowest == 0 and len(measured) > 1:
        alone = _best(readings[:1], [0], n, dt)[0]
        inside = slice(n // 20, n - n // 20)
        for i, (kind, reading) in enumerate(measured[1:], 1):
            constant = float(np.mean((reading.values - alone(np.arange(n) * dt, orders[i]))[inside]))
            readings[i] = reading._replace(values=reading.values - constant)
            if abs(constant) > _SHIFTED * np.std(reading.values):
                notes.append(f"{kind}: a constant of {constant:.3g} beside the displacement's derivative is left out.")
    spline, spacing = _best(readings, orders, n, dt)
    error = _trace(readings, orders, lowest, n, dt, spacing)
    shifted = BSpline(spline.t + record.time[0], spline.c, spline.k)
    if lowest:
        notes.append("Without a displacement the velocity is integrated; its mean displacement counts as zero.")
        shifted = shifted.antiderivative()
        mean = float(np.mean(shifted(record.time)))
        shifted = BSpline(shifted.t, shifted.c - mean, shifted.k)
    return shifted, error


def _knots(n: int, spacing: int) -> np.ndarray:
    """Knots in samples; at a spacing of one as many coefficients as samples (not-a-knot)."""
    inner = np.arange(3.0, n - 3) if spacing == 1 else np.linspace(0, n - 1, max((n - 1) // spacing, 1) + 1)[1:-1]
    return np.concatenate([np.zeros(_ACTIVE), inner, np.full(_ACTIVE, n - 1.0)])


def _basis(places: np.ndarray, knots: np.ndarray, order: int) -> csr_array:
    """Derivatives of order `order` of the basis, per sample, at `places` (samples): sparse (places, coefficients)."""
    degree, t = _DEGREE, knots
    down = diags_array(np.ones(t.size - degree - 1), format="csr")
    for _ in range(order):
        weight = degree / (t[degree + 1 : -1] - t[1 : -degree - 1])
        size = weight.size
        difference = _difference(size)
        down = diags_array(weight) @ difference @ down
        degree, t = degree - 1, t[1:-1]
    inside = np.clip(places, t[0], t[-1])
    return csr_array(BSpline.design_matrix(inside, t, degree)) @ down


def _difference(size: int) -> csr_array:
    """Matrix (size, size + 1) of the differences of neighbours."""
    rows = np.repeat(np.arange(size), 2)
    columns = rows + np.tile([0, 1], size)
    return csr_array((np.tile([-1.0, 1.0], size), (rows, columns)), shape=(size, size + 1))


def _weighted(readings: Sequence[_Reading], orders: Sequence[int], knots: np.ndarray, dt: float) -> list[_Rows]:
    """Equations of every channel in units of its noise; those of instants beyond the record are empty."""
    found = []
    for reading, order in zip(readings, orders, strict=True):
        inside = (reading.places >= 0) & (reading.places <= knots[-1])
        matrix = diags_array(inside / (reading.noise * dt**order)) @ _basis(reading.places, knots, order)
        found.append(_Rows(csr_array(matrix), inside * reading.values / reading.noise))
    return found


def _best(readings: Sequence[_Reading], orders: Sequence[int], n: int, dt: float) -> tuple[BSpline, int]:
    """Spline of the smallest cross-validation score, and its spacing."""
    alone = len(readings) == 1
    best = (np.inf, 1, np.zeros(0))
    for spacing in _SPACINGS[1 if alone else 0 :]:
        knots = _knots(n, spacing)
        freedom = len(readings) * n - (knots.size - _ACTIVE)
        if freedom < n // 4:
            continue
        rows = _weighted(readings, orders, knots, dt)
        c = _solved(rows)
        score = sum(float(np.sum((r.matrix @ c - r.wanted) ** 2)) for r in rows) / freedom**2
        if score < best[0]:
            best = (score, spacing, c)
    _, spacing, c = best
    if alone and spacing == _FINEST:
        spacing, c = 1, _solved(_weighted(readings, orders, _knots(n, 1), dt))
    return BSpline(_knots(n, spacing) * dt, c, _DEGREE), spacing


def _solved(rows: Sequence[_Rows]) -> np.ndarray:
    return solveh_banded(_bands(rows), np.sum([r.matrix.T @ r.wanted for r in rows], axis=0))


def _bands(rows: Sequence[_Rows]) -> np.ndarray:
    """Normal matrix of least squares in the upper banded form."""
    normals = [(r.matrix.T @ r.matrix).todia() for r in rows]
    bands = np.zeros((_ACTIVE, normals[0].data.shape[1]))
    for normal in normals:
        for offset, diagonal in zip(normal.offsets, normal.data, strict=True):
            if offset >= 0:
                bands[_DEGREE - offset, : diagonal.size] += diagonal
    return bands


def _trace(readings: Sequence[_Reading], orders: Sequence[int], lowest: int, n: int, dt: float, spacing: int) -> _Trace:
    """Error of the spline, coefficient by coefficient."""
    knots = _knots(n, spacing)
    size = knots.size - _ACTIVE
    # U read backwards is the lower triangle of A read backwards; `back[k, i]` is U[i - k, i].
    bands = _bands(_weighted(readings, orders, knots, dt))
    back = cholesky_banded(bands[::-1, ::-1], lower=True)[:, ::-1]
    follow, fresh = np.zeros((size, _DEGREE)), 1.0 / back[0] ** 2
    for k in range(1, _ACTIVE):
        follow[k:, _DEGREE - k] = -back[k, k:] / back[0, k:]
    covariances, covariance = [], np.zeros((_ACTIVE, _ACTIVE))
    for i in range(size):
        across = covariance[1:, 1:] @ follow[i]
        covariance = np.block([[covariance[1:, 1:], across[:, None]], [across[None, :], follow[i] @ across + fresh[i]]])
        covariances.append(covariance)
    samples = np.arange(n)
    last = np.clip(np.searchsorted(knots, samples, side="right") - 1, _DEGREE, size - 1)
    active = last[:, None] + np.arange(-_DEGREE, 1)
    rows = np.zeros((n, 3, _ACTIVE))
    for order in range(lowest, 3):
        basis = _basis(samples, knots, order - lowest).toarray() / dt ** (order - lowest)
        rows[:, order] = basis[samples[:, None], active]
    v = rows[:, 1]
    speed_variance = np.einsum("ni,nij,nj->n", v, np.array(covariances)[last], v)
    enters = np.diff(last, prepend=last[0]) > 0
    speed_std = np.sqrt(np.maximum(speed_variance, 0.0))
    return _Trace(rows, enters, follow[last], fresh[last], speed_std, covariances[last[0]])
