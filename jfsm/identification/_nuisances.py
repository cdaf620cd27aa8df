"""What every hypothesis on a record shares: its noise, its reconstructed drive, its unknown start and offsets."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np

from ..dynamics._drive import Reconstruction
from ..dynamics._excitation import (
    bucket,
    excitation,
    fastest_mode,
    force_limits,
    measured_force,
    substeps_for,
    typical_speed,
)
from ..dynamics._grid import Fine
from ..dynamics._plant import Channel, Readout, lower, readout
from ..dynamics._simulate import check_pair
from ..dynamics._start import starting_state
from ..estimation._filter import ProcessNoise, Readings
from ..records import Record, clipped, noise_floor, spikes
from ..structures import Structure

_LEAST_NOISE = 1e-4
"""Noise of a channel as a share of its size, at least: below it the integration error would be taken for physics."""
_LEAST_DISTURBANCE = 2e-4
"""Acceleration that is never explained, as a share of its size, white over a radian of the motion."""
_BAND_LIMITED = 1e-3
"""Noise of a channel whose signal fills its band, as a share of its size: nothing in it tells."""
_FINEST = 2
"""Samples per knot at which a spline's residual holds signal as well."""
_OVERSAMPLED = 3
"""Samples per knot from which a spline's curve may stand for the force: the band above holds noise only."""


@dataclass(frozen=True)
class Nuisances:
    """One record as the likelihood sees it; the same object for all hypotheses.

    Attributes
    ----------
    channels : tuple of (kind, degree of freedom)
        Response channels.
    spread : (channels,) array
        Standard deviation of each channel's readings.
    force_variance : (dof,) array
        White noise of the force's samples.
    floor : (channels,) array
        Standard deviation of each channel's white noise; a mere guess where `trusted` is false, because the channel's
        signal fills its band.
    length, omega : float
        Size of the motion [length unit] and its angular frequency [rad/s]: the scales of priors.
    crest : float
        Largest reading over the standard deviation, in the channel closest to a displacement.
    x0, v0 : (dof,) arrays
        First guess of the initial state; `at_rest` says that it is known.
    """

    record: Record
    channels: tuple[Channel, ...]
    show: Readout
    fine: Fine
    readings: Readings
    noise: ProcessNoise
    force_variance: np.ndarray
    spread: np.ndarray
    floor: np.ndarray
    trusted: np.ndarray
    length: float
    crest: float
    omega: float
    x0: np.ndarray
    v0: np.ndarray
    at_rest: bool
    reconstruction: Reconstruction
    notes: tuple[str, ...]

    @property
    def samples(self) -> int:
        return len(self.record)

    def head(self, until: int) -> tuple[Fine, Readings]:
        """Drive and readings cut to the padded length of the first `until` samples."""
        n, r, f = min(bucket(until), self.fine.time.shape[0]), self.readings, self.fine
        readings = Readings(r.values[:n], r.use[:n], r.variance, r.valid[:n])
        return Fine(f.force[:n], f.base[:n], f.time[:n], f.step), readings

    def resolving(self, structures: Sequence[Structure]) -> "Nuisances":
        """The same record with steps short enough for all of these structures."""
        record, fine = self.record, self.fine
        speed = typical_speed(record)
        need = max(substeps_for(structure, record.dt, speed) for structure in structures)
        if need <= fine.substeps:
            return self
        samples = np.asarray(fine.force)[: self.samples, 0]
        length = fine.time.shape[0]
        finer = excitation(record, samples.shape[1], need, self.reconstruction, length=length, force=samples)
        return replace(self, fine=finer)


def prepare(
    record: Record,
    model: Structure,
    reconstruction: Reconstruction = "band-limited",
    *,
    weighed: Structure | None = None,
) -> Nuisances:
    """Nuisances of a record, scaled by the model as it is believed.

    The noise of the force moves the masses of `weighed`, where these are known better than the model's.

    Raises
    ------
    ValueError
        If the record holds no response, is shorter than 32 samples, or does not fit the model.
    """
    check_pair(model, record)
    if not record.responses:
        raise ValueError(
            "`record` must hold a response (displacement, velocity or acceleration); it has none to compare with."
        )
    if len(record) < 32:
        raise ValueError(f"`record` must hold at least 32 samples to tell noise from motion; it has {len(record)}.")
    channels = tuple(record.responses)
    values = np.column_stack([record.responses[c] for c in channels])
    spread = np.std(values, axis=0)
    for channel, size in zip(channels, spread, strict=True):
        if size == 0:
            raise ValueError(f"`{channel[0]}` {channel[1]} is constant; leave a dead channel out of the record.")
    use, floor, trusted, torn = _noise(channels, values, spread, record.dt)
    force, force_variance, share, words = _force(record, model)
    omega = fastest_mode(lower(model)) or _rate(values[:, 0], record.dt)
    length, crest = _size(channels, values, spread, omega)
    masses = np.asarray((weighed or model).mass)
    mass = np.diag(masses) if masses.ndim == 1 else masses
    variance = floor**2
    for i, (kind, j) in enumerate(channels):
        if kind == "acceleration":  # an acceleration is predicted with the force's own noise, less what smoothing took
            variance[i] += force_variance[j - 1] * share[j - 1] / mass[j - 1, j - 1] ** 2
    x0, v0 = _start(record, model, reconstruction)
    return Nuisances(
        record=record,
        channels=channels,
        show=readout(channels, model.dof),
        fine=_drive(record, model, reconstruction, force),
        readings=_padded(values, use, variance),
        noise=_disturbance(mass, force_variance, omega, length, record.dt),
        force_variance=force_variance,
        spread=spread,
        floor=floor,
        trusted=trusted,
        length=length,
        crest=crest,
        omega=omega,
        x0=x0,
        v0=v0,
        at_rest=record.at_rest,
        reconstruction=reconstruction,
        notes=(*record.notes, *torn, *words),
    )


def _noise(
    channels: tuple[Channel, ...], values: np.ndarray, spread: np.ndarray, dt: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[str]]:
    """Which readings (n, channels) take part, standard deviation of each channel's noise, whether it is trusted, and
    notes."""
    use, floor, trusted = np.ones_like(values), np.zeros(len(channels)), np.zeros(len(channels), dtype=bool)
    notes = []
    for i, (kind, j) in enumerate(channels):
        found = noise_floor(values[:, i], dt)
        trusted[i] = found.spacing > _FINEST
        std = found.std if trusted[i] else min(found.std, _BAND_LIMITED * spread[i])
        floor[i] = max(std, _LEAST_NOISE * spread[i])
        lost = clipped(values[:, i]) | spikes(values[:, i], floor[i])
        if np.any(lost):
            use[lost, i] = 0.0
            notes.append(f"{kind} {j}: {int(lost.sum())} clipped or torn samples take no part.")
    return use, floor, trusted, notes


def _padded(values: np.ndarray, use: np.ndarray, variance: np.ndarray) -> Readings:
    """Readings of a length that programs are made for."""
    n, padded = len(values), bucket(len(values))
    fill = ((0, padded - n), (0, 0))
    return Readings(
        values=jnp.asarray(np.pad(values, fill)),
        use=jnp.asarray(np.pad(use, fill)),
        variance=jnp.asarray(variance),
        valid=jnp.asarray(np.arange(padded) < n, dtype=jnp.float64),
    )


def _disturbance(mass: np.ndarray, force_variance: np.ndarray, omega: float, length: float, dt: float) -> ProcessNoise:
    """What the noise of the force and what is never explained do to the velocity in a sample."""
    inverse, size = np.linalg.inv(mass), omega**2 * length
    forced = inverse @ np.diag(force_variance * dt**2) @ inverse.T
    return ProcessNoise(jnp.asarray(forced + np.eye(len(mass)) * (_LEAST_DISTURBANCE * size) ** 2 / omega * dt))


def _start(record: Record, model: Structure, reconstruction: Reconstruction) -> tuple[np.ndarray, np.ndarray]:
    """First guess of the initial state: what is measured tells more than a model that lacks something."""
    x0, v0 = starting_state(model, record, reconstruction=reconstruction)
    for (kind, j), samples in record.responses.items():
        if kind != "acceleration" and not record.at_rest:
            (x0 if kind == "displacement" else v0)[j - 1] = samples[0]
    return x0, v0


def _drive(record: Record, model: Structure, reconstruction: Reconstruction, force: np.ndarray) -> Fine:
    """Drive by these samples of the force, in steps short enough for the model, as long as the padded readings."""
    substeps = substeps_for(model, record.dt, typical_speed(record))
    return excitation(record, model.dof, substeps, reconstruction, length=bucket(len(record)), force=force)


def _rate(y: np.ndarray, dt: float) -> float:
    """Angular frequency at which a channel goes up and down, where no spring tells one [rad/s]."""
    return float(np.std(np.diff(y)) / (dt * np.std(y)))


def _force(record: Record, model: Structure) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[str]]:
    """Force samples to run with, variance of their noise, share of it left in them, and notes.

    Where the force is smooth on its own grid, its noise is smoothed away; where it fills the band, the spline's
    residual is signal, and the noise is taken as a thousandth of the force.
    """
    restored, dof, notes = force_limits(model), model.dof, []
    force = measured_force(record, dof, restored)
    variance, share = np.zeros(dof), np.ones(dof)
    for (kind, j), samples in record.channels.items():
        if kind != "force":
            continue
        if not np.any(force[:, j - 1]):
            if np.any(samples):
                notes.append(f"force {j} holds nothing but noise and counts as zero.")
            continue
        if (kind, j) not in restored and np.any(clipped(samples)):
            notes.append(
                f"force {j} looks clipped; its true peaks are not known, which shows as an unexplained effect."
            )
        floor = noise_floor(force[:, j - 1], record.dt)
        if floor.spacing >= _OVERSAMPLED:
            force[:, j - 1] = floor.smooth
            variance[j - 1], share[j - 1] = floor.std**2, floor.effective_parameters / samples.size
        else:
            variance[j - 1] = (_BAND_LIMITED * float(np.std(samples))) ** 2
    return force, variance, share, notes


def _size(channels: tuple[Channel, ...], values: np.ndarray, spread: np.ndarray, omega: float) -> tuple[float, float]:
    """Size of the displacement and its crest factor, from the channel closest to it."""
    power = [("displacement", "velocity", "acceleration").index(kind) for kind, _ in channels]
    i = int(np.argmin(power))
    crest = float(np.max(np.abs(values[:, i] - np.mean(values[:, i])))) / spread[i]
    return float(spread[i] / omega ** power[i]), crest
