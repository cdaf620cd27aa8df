"""What every hypothesis on a record shares: its noise, its reconstructed drive, its unknown start and offsets."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple, cast

import numpy as np
from jaxtyping import Bool, Float

from ..estimation._filter import ProcessNoise, Readings, Stretch
from ..plant import (
    Channel,
    Course,
    Imposed,
    InterpolatedInput,
    Observation,
    Path,
    Reconstruction,
    Swing,
    bucket,
    check_pair,
    excitation,
    fastest_mode,
    imposed_motion,
    imposed_substeps,
    linear_part,
    lower,
    noise_of,
    observation_of,
    starting_state,
    substeps_for,
    typical_size,
)
from ..records import Record, advanced, clipped, noise_floor, quantisation_step, spikes
from ..structures import EvaluatedMotion, Structure
from ._channels import LEAST_NOISE, driving, forces, readings_of, spread_of
from ._colour import Colour

LEAST_SAMPLES = 32
"""Of a record that is fitted."""
_LEAST_DISTURBANCE = 2e-4
"""Acceleration that is never explained, as a share of its size, white over a radian of the motion."""
_MOSTLY = 0.5
_SAME = 1e-9
"""Rounding, relative."""
_CLEAN = 0.003
"""Noise of a channel, as a share of its spread, up to which its slope is as good as measured."""
_STOPPED = 1 / 3
"""Share of the time in which damping stops a motion, where nothing is elastic, that counts as a period."""
_LEADING, _PERIODS = 1024, 20
"""Samples, the first ones, and periods of the motion in them, that lead to a basin,"""
_LOUD = 0.25
"""where their power is such a share of that of all, at least."""


class DrivingNoise(NamedTuple):
    """Noise of what drives, before any mass is moved by it.

    `by_sample` (dof,) is the variance that smoothing leaves in a sample of the force; `in_motion` (dof,), and `base`
    for the acceleration of the base, that of white noise as strong as what it leaves where the structure moves.
    """

    by_sample: Float[np.ndarray, " dof"]
    in_motion: Float[np.ndarray, " dof"]
    base: float

    def on(self, mass: Float[np.ndarray, "dof dof"]) -> Float[np.ndarray, "dof dof"]:
        """Covariance (dof, dof) of the white forces on these masses: a base moves all through their inertia."""
        inertia = mass.sum(1)
        return np.diag(self.in_motion) + self.base * np.outer(inertia, inertia)

    def shown_by(
        self, channels: tuple[Channel, ...], floor: Float[np.ndarray, " channels"], mass: Float[np.ndarray, "dof dof"]
    ) -> Float[np.ndarray, " channels"]:
        """Variance (channels,) of readings of such noise floors: an acceleration is predicted with the force's own
        noise, less what smoothing took."""
        accelerates = np.array([kind == "acceleration" for kind, _ in channels])
        at = [j - 1 for _, j in channels]
        return floor**2 + np.where(accelerates, self.by_sample[at] / np.diag(mass)[at] ** 2, 0.0)


@dataclass(frozen=True)
class Nuisances:
    """One record as the likelihood sees it; the same object for all hypotheses.

    Attributes
    ----------
    channels : tuple of (kind, degree of freedom)
        Response channels. Where the motion is imposed, all of the record: the readings are those of the force, and the
        motion's channels bring their noise.
    inputs : InterpolatedInput or Imposed
        What is imposed: the force (and the base), or the motion.
    spread : (channels,) array
        Standard deviation of each channel's readings.
    force_floor : (dof,) array, empty where the motion is imposed
        Standard deviation of the white noise of the force's samples.
    base_floor : float
        That of the acceleration of the base.
    driving : DrivingNoise
        Both as smoothing leaves them, whatever masses they move.
    force_covariance : (dof, dof) array
        White noise on the masses as strong as what smoothing leaves of both where the structure moves.
    floor : (channels,) array
        Standard deviation of each channel's white noise; a mere guess where `trusted` is false, because the channel's
        signal fills its band.
    length, omega : float
        Size of the motion [length unit] and its angular frequency [rad/s]: the scales of priors.
    period : float
        Time over which a structure forgets how it moved, as far as a prediction is asked of it [s]: a period, and where
        nothing is elastic as much of the time in which damping stops it.
    crest : float
        Largest reading over the standard deviation, in the channel closest to a displacement.
    x0, v0 : (dof,) arrays
        First guess of the initial state; `at_rest` says that it is known.
    forgiven : float
        Share of the elastic force that no hypothesis has to explain: what all of them lack.
    colour : Colour or None
        Memory of the channels' noise, where it is known to have one.
    swing : Swing or None
        The motion of several masses, where it has been estimated.
    course : Course or None
        The measured motion near which a function of its own is tabulated; None where there is none, or no measured one.
    late : dict
        How late [s] channels of the force were that are in time here, by (kind, degree of freedom).
    stretches : dict
        What programs saw of the record, kept for the next of them.
    """

    record: Record
    channels: tuple[Channel, ...]
    observation: Observation
    inputs: InterpolatedInput | Imposed
    readings: Readings
    noise: ProcessNoise
    driving: DrivingNoise
    force_floor: Float[np.ndarray, " forces"]
    base_floor: float
    force_covariance: Float[np.ndarray, "dof dof"]
    spread: Float[np.ndarray, " channels"]
    floor: Float[np.ndarray, " channels"]
    trusted: Bool[np.ndarray, " channels"]
    length: float
    crest: float
    omega: float
    period: float
    x0: Float[np.ndarray, " dof"]
    v0: Float[np.ndarray, " dof"]
    at_rest: bool
    reconstruction: Reconstruction
    notes: tuple[str, ...]
    path: Path | None = None
    forgiven: float = 0.0
    colour: Colour | None = None
    swing: Swing | None = None
    course: Course | None = None
    late: Mapping[Channel, float] = field(default_factory=dict)
    stretches: dict[int, Stretch] = field(default_factory=dict, init=False, repr=False)
    _heads: dict[int, tuple[Imposed, Readings]] = field(default_factory=dict, init=False, repr=False)

    @property
    def samples(self) -> int:
        return len(self.record)

    @property
    def driven(self) -> bool:
        """Whether a measured force or a moving base drives the record, so that masses show."""
        return isinstance(self.inputs, InterpolatedInput) and bool(self.inputs.force.any() or self.inputs.base.any())

    @property
    def drifts(self) -> bool:
        """Whether nothing elastic holds the structure in place, and damping stops it sooner than it turns back."""
        return self.period * self.omega < 2 * math.pi * (1 - _SAME)

    def weighs(self, structure: Structure) -> bool:
        """Whether the record tells masses: it is driven, or a motion is imposed whose inertia is more than noise."""
        if isinstance(self.inputs, InterpolatedInput):
            return self.driven
        inertia = np.asarray(self.inputs.a)[: self.samples] @ _mass(structure)
        return bool(np.any(np.std(inertia, axis=0) > min(self.floor[self.judged])))

    @property
    def judged(self) -> Bool[np.ndarray, " channels"]:
        """Which of the channels a hypothesis has to predict."""
        return np.array([channel in self.record.answers for channel in self.channels])

    @property
    def memories(self) -> dict[Channel, tuple[float, float]]:
        """Correlation of the noise from sample to sample, and the share of its variance that has it, by channel."""
        if self.colour is None:
            return {}
        pairs = zip(np.asarray(self.colour.memory).tolist(), np.asarray(self.colour.share).tolist(), strict=True)
        return dict(zip((self.channels[c] for c in self.colour.channels), pairs, strict=True))

    @cached_property
    def coarse(self) -> Bool[np.ndarray, " channels"]:
        """Which channels (channels,) err by the steps of their digits more than by noise: again the same where the
        motion is."""
        values = np.asarray(self.readings.values)[: self.samples]
        steps = np.array([quantisation_step(values[:, c]) for c in range(len(self.channels))])
        return steps**2 / 12 > _MOSTLY * self.floor**2

    @cached_property
    def leading(self) -> int:
        """Readings that lead to a basin: the first ones, more of them where the record is quiet at first."""
        values, used = (np.asarray(a)[: self.samples] for a in (self.readings.values, self.readings.use))
        power = np.cumsum(np.sum(used * ((values - values.mean(0)) / self.spread) ** 2, 1))
        count = max(_LEADING, math.ceil(_PERIODS * 2 * math.pi / (self.omega * self.record.dt)))
        while count < self.samples and power[count - 1] / count < _LOUD * power[-1] / self.samples:
            count *= 2
        return min(count, self.samples)

    def elastic_force(self, structure: Structure) -> float:
        """Size of the elastic force, or of the measured one where the motion is imposed."""
        if isinstance(self.inputs, Imposed):
            return float(np.max(self.spread[self.judged]))
        return float(np.mean(np.diag(_mass(structure)))) * self.omega**2 * self.length

    def head(self, until: int) -> tuple[Imposed, Readings]:
        """The motion that is imposed, and the readings, cut to the padded length of the first `until` samples."""
        assert isinstance(self.inputs, Imposed)
        n, r = min(bucket(until), self.inputs.time.shape[0]), self.readings
        if n not in self._heads:
            self._heads[n] = self.inputs.head(n), replace(r, values=r.values[:n], use=r.use[:n], valid=r.valid[:n])
        return self._heads[n]

    def showing(self, values: Float[np.ndarray, "n channels"]) -> "Nuisances":
        """The same record, had its channels shown `values` (n, channels)."""
        course = None if self.course is None else self.course.showing(dict(zip(self.channels, values.T, strict=True)))
        values = np.pad(values, ((0, self.readings.valid.size - len(values)), (0, 0)))
        return replace(self, readings=replace(self.readings, values=values), course=course)

    def with_wandering(self, channels: Sequence[int]) -> "Nuisances":
        """The same record, the zeros of these channels wandering by up to the size of their readings."""
        size, n = self.spread[list(channels)], self.samples
        wander = np.stack([(size / n) ** 2, 3 * size**2 / n**3], 1)
        return replace(self, readings=replace(self.readings, wander=wander, wandering=tuple(channels)))

    def with_colour(self, colour: Colour) -> "Nuisances":
        """The same record, its noise having this colour: no channel alone told how strong it is."""
        picked, louder = list(colour.channels), float(colour.louder)
        readings, floor, trusted = colour.on(self.readings), self.floor.copy(), self.trusted.copy()
        floor[picked], trusted[picked] = np.sqrt(np.asarray(readings.variance)[picked]), False
        return replace(
            self,
            readings=readings,
            floor=floor,
            trusted=trusted,
            noise=colour.of_force(self.noise),
            force_floor=self.force_floor * math.sqrt(louder),
            base_floor=self.base_floor * math.sqrt(louder),
            force_covariance=self.force_covariance * louder,
            colour=colour,
        )

    def in_time(self, record: Record) -> Record:
        """Another record with the channels of the force put in time that were late in this one."""
        return record.aligned({channel: tau for channel, tau in self.late.items() if channel in record.channels})

    def timed(self, reconstruction: Reconstruction, late: Mapping[Channel, float]) -> "Nuisances":
        """The same record, its force so between its samples, and channels of it put in time that are so late [s]."""
        assert isinstance(self.inputs, InterpolatedInput)
        late = {channel: tau for channel, tau in late.items() if channel in self.record.channels}
        record, inputs, dt = self.record.aligned(late), self.inputs, self.record.dt
        force, base = (np.array(drive)[: self.samples, 0] for drive in (inputs.force, inputs.base))
        for (_, j), tau in late.items():
            force[:, j - 1] = advanced(force[:, j - 1], tau / dt, dt)
        length, dof = inputs.time.shape[0], force.shape[1]
        inputs = excitation(record, dof, inputs.substeps, reconstruction, length=length, force=force, base=base)
        every = {channel: self.late.get(channel, 0.0) + late.get(channel, 0.0) for channel in {**self.late, **late}}
        return replace(self, record=record, inputs=inputs, reconstruction=reconstruction, late=every)

    def knowing(self, other: "Nuisances") -> "Nuisances":
        """The same record, with what is known of the same channels of another: which zeros wander, and what noise
        remembers."""
        seen = self if other.colour is None else self.with_colour(other.colour)
        return seen.with_wandering(other.readings.wandering)

    def weighed(self, structure: Structure) -> "Nuisances":
        """The same record, the noise of what drives it moving the masses of another structure."""
        if self.path is not None:
            return self
        mass = _mass(structure)
        covariance = self.driving.on(mass)
        readings = replace(self.readings, variance=self.driving.shown_by(self.channels, self.floor, mass))
        noise = _disturbance(mass, covariance, self.omega, self.length, self.record.dt)
        if self.colour is not None:
            readings, noise = self.colour.on(readings), self.colour.of_force(noise)
            covariance = covariance * float(self.colour.louder)
        return replace(self, readings=readings, noise=noise, force_covariance=covariance)

    def steps_for(self, structures: Sequence[Structure]) -> int:
        """Steps per sample that are short enough for all of these structures."""
        if self.path is not None:
            size = typical_size(self.record)
            return max(imposed_substeps(structure, self.record.dt, size) for structure in structures)
        size = typical_size(self.record) if self.swing is None else self.swing
        return max(substeps_for(structure, self.record.dt, size) for structure in structures)

    def resolving(self, structures: Sequence[Structure], least: int = 1) -> "Nuisances":
        """The same record with steps short enough for all of these structures, so many per sample at `least`."""
        record, inputs = self.record, self.inputs
        need = max(least, self.steps_for(structures))
        if need <= inputs.substeps:
            return self
        if self.path is not None:
            return replace(self, inputs=self.path.imposed(need, inputs.time.shape[0]))
        assert isinstance(inputs, InterpolatedInput)
        force, base = (np.asarray(drive)[: self.samples, 0] for drive in (inputs.force, inputs.base))
        length, dof = inputs.time.shape[0], force.shape[1]
        return replace(
            self, inputs=excitation(record, dof, need, self.reconstruction, length=length, force=force, base=base)
        )


def prepare(record: Record, model: Structure, reconstruction: Reconstruction = "band-limited") -> Nuisances:
    """Nuisances of a record, scaled by the model as it is believed.

    Raises
    ------
    ValueError
        If the record holds nothing to compare with, is shorter than 32 samples, or does not fit the model.
    """
    check_pair(model, record, imposed=True)
    if not record.answers:
        raise ValueError(
            "`record` must hold a response (displacement, velocity or acceleration); it has none to compare with."
            if record.drive == "force"
            else '`record` has drive="motion" and must hold the force that was measured; it has none to compare with.'
        )
    if len(record) < LEAST_SAMPLES:
        raise ValueError(
            f"`record` must hold at least {LEAST_SAMPLES} samples to tell noise from motion; it has {len(record)}."
        )
    if record.drive == "motion":
        return _prepare_imposed(record, model, reconstruction)
    channels = tuple(record.responses)
    seen = readings_of(channels, np.column_stack([record.responses[c] for c in channels]), record.dt, record.lost)
    values, floor, spread = seen.values, seen.floor, np.std(seen.values, axis=0)
    force, words = forces(record, model)
    base = None if record.base_acceleration is None else driving(record.base_acceleration, record.dt)
    omega = fastest_mode(lower(model)) or _rate(values[:, 0], record.dt)
    length, crest = _size(channels, values, spread, omega)
    mass = _mass(model)
    noise = DrivingNoise(force.by_sample, force.in_motion, 0.0 if base is None else base.in_motion)
    covariance = noise.on(mass)
    x0, v0 = _start(record, model, reconstruction, dict(zip(channels, values[0].tolist(), strict=True)))
    return Nuisances(
        record=record,
        channels=channels,
        observation=observation_of(channels, model.dof),
        inputs=_drive(record, model, reconstruction, force.samples, None if base is None else base.samples),
        readings=_padded(values, seen.use, noise.shown_by(channels, floor, mass)),
        noise=_disturbance(mass, covariance, omega, length, record.dt),
        driving=noise,
        force_floor=force.floor,
        base_floor=0.0 if base is None else base.floor,
        force_covariance=covariance,
        spread=spread,
        floor=floor,
        trusted=seen.trusted,
        length=length,
        crest=crest,
        omega=omega,
        period=_period(model, omega),
        x0=x0,
        v0=v0,
        at_rest=record.at_rest,
        reconstruction=reconstruction,
        notes=(*record.notes, *seen.notes, *words),
        course=_course(
            model, record, dict(zip(channels, values.T, strict=True)), bool(np.all(floor < _CLEAN * spread))
        ),
    )


def prepare_all(
    records: Sequence[Record], model: Structure, reconstruction: Reconstruction = "band-limited"
) -> list[Nuisances]:
    """`prepare` of several records, in all of which the same drives.

    Raises
    ------
    ValueError
        As `prepare`, or if the motion drives some of the records only.
    """
    drives = [record.drive for record in records]
    if len(set(drives)) > 1:
        other = drives.index("motion" if drives[0] == "force" else "force")
        raise ValueError(
            f"`record` must hold records that agree in drive; number {other + 1} has {drives[other]}, not {drives[0]}. "
            "Judge them apart."
        )
    return [prepare(record, model, reconstruction) for record in records]


def _prepare_imposed(record: Record, model: Structure, reconstruction: Reconstruction) -> Nuisances:
    """Nuisances of a record whose motion is imposed: its readings are those of the force."""
    channels, path = tuple(record.channels), imposed_motion(record, model)
    values = np.column_stack([record.channels[c] for c in channels])
    spread, floor, trusted, use = spread_of(channels, values), *np.zeros((2, len(channels))), np.zeros_like(values)
    notes = []
    for i, (kind, j) in enumerate(channels):
        found = noise_floor(values[:, i], record.dt)
        trusted[i] = not found.fills_band
        floor[i] = max(noise_of(found, spread[i]), LEAST_NOISE * spread[i])
        if kind == "force":
            lost = clipped(values[:, i])
            # A force that stays at its extremes for most of the time is dry friction, not the end of a range.
            lost = (lost & (np.mean(lost) < _MOSTLY)) | spikes(values[:, i], floor[i])
            use[:, i] = ~(lost | record.lost.get((kind, j), np.zeros_like(lost)))
            if np.any(lost):
                notes.append(f"force {j}: {int(lost.sum())} clipped or torn samples take no part.")
    nearest = [i for i, (kind, _) in enumerate(channels) if kind != "force"][0]
    omega = _rate(values[:, nearest], record.dt)
    motion = [values[:, i : i + 1] for i, (kind, _) in enumerate(channels) if kind != "force"]
    length, crest = _size(channels[nearest:], np.hstack(motion), spread[nearest:], omega)
    none, still = np.zeros(model.dof), cast(Any, np.zeros((model.dof, model.dof)))
    return Nuisances(
        record=record,
        channels=channels,
        observation=observation_of(channels, model.dof),
        inputs=path.imposed(imposed_substeps(model, record.dt, typical_size(record)), bucket(len(record))),
        readings=_padded(values, use, floor**2),
        noise=ProcessNoise(still),
        driving=DrivingNoise(none, none, 0.0),
        force_floor=none[:0],
        base_floor=0.0,
        force_covariance=np.zeros((model.dof, model.dof)),
        spread=spread,
        floor=floor,
        trusted=trusted.astype(bool),
        length=length,
        crest=crest,
        omega=omega,
        period=2 * math.pi / omega,
        x0=none,
        v0=none,
        at_rest=True,
        reconstruction=reconstruction,
        notes=(*record.notes, *path.notes, *notes),
        path=path,
    )


def _course(model: Structure, record: Record, seen: Mapping[Channel, np.ndarray], clean: bool) -> Course | None:
    """The motion near which a function of a model's own is tabulated.

    One that JAX can trace is asked for itself where no channel shows velocities and displacements are not `clean`: a
    table about a motion whose velocity errs much blurs what a law does.
    """
    if model.own is None:
        return None
    found = Course.of(seen, model.dof, record.dt, float(record.time[0]))
    if isinstance(model.own, EvaluatedMotion):
        if found is None:
            raise ValueError(
                "`record` must show the displacement of every coordinate of a simulation by `from_accelerations`; its "
                f"channels are {', '.join(f'{kind} {j}' for kind, j in seen)}. Estimate the motion first "
                "(jfsm.estimate_motion), or write the accelerations with jax.numpy."
            )
        return found
    shows_speed = all(("velocity", j) in seen for j in range(1, model.dof + 1))
    return found if shows_speed or clean else None


def _mass(structure: Structure) -> np.ndarray:
    masses = np.asarray(structure.mass)
    return np.diag(masses) if masses.ndim == 1 else masses


def _padded(values: np.ndarray, use: np.ndarray, variance: np.ndarray) -> Readings:
    """Readings of a length that programs are made for."""
    n, padded = len(values), bucket(len(values))
    fill = ((0, padded - n), (0, 0))
    arrays: dict[str, Any] = {
        "values": np.pad(values, fill),
        "use": np.pad(use, fill),
        "variance": variance,
        "valid": (np.arange(padded) < n).astype(float),
    }
    return Readings(**arrays)


def _disturbance(
    mass: np.ndarray, force_covariance: np.ndarray, omega: float, length: float, dt: float
) -> ProcessNoise:
    """What the noise of what drives and what is never explained do to the velocity in a sample."""
    inverse, size = np.linalg.inv(mass), omega**2 * length
    forced = inverse @ (force_covariance * dt**2) @ inverse.T
    velocity: Any = forced + np.eye(len(mass)) * (_LEAST_DISTURBANCE * size) ** 2 / omega * dt
    return ProcessNoise(velocity)


def _start(
    record: Record, model: Structure, reconstruction: Reconstruction, shown: Mapping[Channel, float]
) -> tuple[np.ndarray, np.ndarray]:
    """First guess of the initial state: what is `shown` first tells more than a model that lacks something."""
    x0, v0 = starting_state(model, record, reconstruction=reconstruction)
    for (kind, j), reading in shown.items():
        if kind != "acceleration" and not record.at_rest:
            (x0 if kind == "displacement" else v0)[j - 1] = reading
    return x0, v0


def _drive(
    record: Record, model: Structure, reconstruction: Reconstruction, force: np.ndarray, base: np.ndarray | None
) -> InterpolatedInput:
    """Drive by these samples of force and base, in steps short enough for the model, as long as the padded readings."""
    substeps = substeps_for(model, record.dt, typical_size(record))
    return excitation(record, model.dof, substeps, reconstruction, length=bucket(len(record)), force=force, base=base)


def _rate(y: np.ndarray, dt: float) -> float:
    """Angular frequency at which a channel goes up and down, where no spring tells one [rad/s]."""
    return float(np.std(np.diff(y)) / (dt * np.std(y)))


def _period(model: Structure, omega: float) -> float:
    """A period of the motion; where nothing is elastic, a part of the time in which damping stops it."""
    plant = linear_part(lower(model))
    rates = np.abs(np.linalg.eigvals(np.linalg.solve(_mass(model), np.asarray(plant.damping))))
    if fastest_mode(plant) > 0 or not np.all(rates > 0):
        return 2 * math.pi / omega
    return _STOPPED / float(np.max(rates))


def _size(channels: tuple[Channel, ...], values: np.ndarray, spread: np.ndarray, omega: float) -> tuple[float, float]:
    """Size of the displacement and its crest factor, from the channel closest to it."""
    power = [("displacement", "velocity", "acceleration").index(kind) for kind, _ in channels]
    i = int(np.argmin(power))
    crest = float(np.max(np.abs(values[:, i] - np.mean(values[:, i])))) / spread[i]
    return float(spread[i] / omega ** power[i]), crest
