"""A record in the units of its motion, with what is believed of its numbers beforehand."""

from collections.abc import Sequence
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from ..plant import Plant, bucket, direction, fastest_mode, lower, measured_force
from ..records import Record, clipped, noise_floor, spikes
from ..structures import Structure
from ._observable import Place, told_apart
from ._resonator import Data, Kind, Numbers

_RESPONSES = ("displacement", "velocity", "acceleration")
_OVERSAMPLED = 3
"""Samples per knot from which a spline's curve may stand for a force."""
_LEAST_NOISE = 1e-4
_FULL_BAND = 1e-3
"""Noise of a force whose signal fills its band, as a share of its size at most: nothing in it tells."""
_WIDE, _AT_REST = 10.0, 1e-6
"""Standard deviation of the first state beforehand, in sizes of the motion."""
STEADY = -30.0
"""Logarithm of the wandering of a bias that does not wander."""


@dataclass(frozen=True)
class Part:
    """Degrees of freedom that are estimated together, in units of the motion's size `length` and rate `omega`.

    `dofs` are the degrees of freedom, `channels` those of the record that show them, `sizes` their units; `drive`
    (n, inputs) are the measured forces in units of their size, and `rough` the standard deviations of their white
    noise, known to a factor exp(`vague`). `gain` tells how they enter where that is not learned, `matrices` stiffness
    and damping. `lever` (dof, loads) tells how random forces enter; they have one size where the channels do not tell
    them apart (`alike`).
    """

    dofs: tuple[int, ...]
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
    lever: np.ndarray
    alike: bool
    matrices: tuple[np.ndarray, np.ndarray] | None
    at_rest: bool

    @classmethod
    def of_dof(cls, record: Record, j: int) -> "Part":
        """One degree of freedom by itself."""
        return cls._of(record, (j,), None, np.eye(1), alike=False)

    @classmethod
    def of_model(cls, record: Record, model: Structure, loads: Sequence[Place]) -> "Part":
        """All degrees of freedom of a structure, random forces on the links `loads`."""
        dofs, plant = tuple(range(1, model.dof + 1)), lower(model, tuple(record.responses))
        alike = not np.all(told_apart(model, tuple(record.responses), loads))
        return cls._of(record, dofs, plant, levers(model, loads)[0], alike)

    @classmethod
    def _of(cls, record: Record, dofs: tuple[int, ...], plant: Plant | None, lever: np.ndarray, alike: bool) -> "Part":
        channels = tuple(c for c in record.responses if c[1] in dofs)
        n, dt = len(record), record.dt
        base = np.zeros(n) if record.base_acceleration is None else record.base_acceleration
        seen = np.column_stack([record.responses[c] for c in channels])
        force, rough, vague = _forces(record, record.dofs if plant is None else plant.dof)
        minv = matrices = None
        if plant is not None:
            minv = np.linalg.inv(np.asarray(plant.mass))
            matrices = (minv @ np.asarray(plant.stiffness), minv @ np.asarray(plant.damping))
            seen = (seen - np.asarray(plant.channel_offset)) / (1 + np.asarray(plant.channel_gain))
            force = (force - np.asarray(plant.force_offset)) / (1 + np.asarray(plant.force_gain))
        floors = [noise_floor(seen[:, i], dt) for i in range(len(channels))]
        smooth = [floor.smooth - np.mean(floor.smooth) for floor in floors]
        rate = np.median([np.std(np.diff(y)) / (dt * max(np.std(y), 1e-300)) for y in smooth])
        omega = float(rate) if plant is None else fastest_mode(plant)
        omega = min(max(omega, 2 * np.pi / (n * dt)), np.pi / dt)
        spread = np.maximum(np.std(seen, 0), 1e-300)
        orders = np.array([_RESPONSES.index(kind) for kind, _ in channels])
        length = float(np.median(spread / omega**orders))
        sizes = length * omega**orders
        least = _LEAST_NOISE * spread
        noise = np.array([max(floor.std, low) for floor, low in zip(floors, least, strict=True)])
        spiky = np.column_stack([spikes(y, s) for y, s in zip(seen.T, noise, strict=True)])
        use = np.column_stack([~clipped(y, torn) for y, torn in zip(seen.T, spiky.T, strict=True)]) & ~spiky
        for i, channel in enumerate(channels):
            use[:, i] &= ~record.lost.get(channel, np.zeros(len(record), dtype=bool))
        absolute = orders == 2  # an accelerometer shows the base's motion as well
        acts = np.std(force, 0) > 0
        size = np.std(force, 0)[acts]
        gain = np.zeros((len(dofs), len(size))) if minv is None else minv[:, acts] * size / (length * omega**2)
        doubt = np.array([3.0 if floor.fills_band else 0.2 for floor in floors])
        return cls(
            dofs, channels, omega, length, dt, (seen - base[:, None] * absolute) / sizes, use.astype(float), spiky,
            sizes, noise / sizes, doubt, force[:, acts] / size, rough[acts] / size, vague[acts],
            base / (length * omega**2), gain, lever, alike, matrices, record.at_rest,
        )  # fmt: skip

    def kind(self, smoothness: int) -> Kind:
        channels = tuple((_RESPONSES.index(kind), self.dofs.index(j)) for kind, j in self.channels)
        dof, loads = self.lever.shape
        return Kind(channels, dof, self.drive.shape[1], self.matrices is None, loads, self.alike, smoothness)

    def data(self, count: int, swell: np.ndarray) -> Data:
        """The first `count` samples, padded to the length that programs are made for."""
        fill = ((0, bucket(count) - count), (0, 0))
        dof = len(self.dofs)
        k, c = (np.zeros((dof, dof)),) * 2 if self.matrices is None else self.matrices
        columns = (self.seen, self.use, self.drive, self.base[:, None], swell[:, None])
        seen, use, drive, base, swell = (np.pad(q[:count], fill) for q in columns)
        numbers = (
            seen, use, drive, base, swell[:, 0], self.dt * self.omega, _AT_REST if self.at_rest else _WIDE,
            self.lever, k / self.omega**2, c / self.omega, self.gain,
        )  # fmt: skip
        return Data(*(jnp.asarray(q) for q in numbers))

    @property
    def beliefs(self) -> tuple[Numbers, Numbers, Numbers, Numbers]:
        """Centre and width of what is believed beforehand, least and largest values.

        Little is, but of the noise, where the channel itself shows it.
        """
        kind = self.kind(0)
        dof, loads, inputs = kind.dof, 1 if kind.alike else kind.loads, kind.inputs
        free = dof if kind.learned else 0
        channels, biased = len(kind.channels), len(kind.biased)
        shapes = ((free,), (free,), (free, inputs), (), (loads,), (inputs,), (dof,), (channels,), (biased,))

        def all_of(*values):
            return Numbers(*(np.broadcast_to(value, shape) for value, shape in zip(values, shapes, strict=True)))

        step, force, noise = float(np.log(self.dt * self.omega)), np.log(self.rough), np.log(self.noise)
        return (
            all_of(0.0, -2.0, 0.0, 0.0, -1.0, force, step - 7.0, noise, -4.0),
            all_of(2.0, 2.0, 3.0, 2.0, 3.0, self.vague, 3.0, self.doubt, 3.0),
            all_of(-6.0, -10.0, -30.0, step, -10.0, force - 7.0, step - 16.0, noise - 4.0, -12.0),
            all_of(4.0, 2.0, 30.0, 5.0, 4.0, force + 7.0, step, noise + 4.0, 0.0),
        )


def levers(model: Structure, loads: Sequence[Place]) -> tuple[np.ndarray, np.ndarray]:
    """Accelerations (dof, loads) by a force on each link, each of size 1, and the forces [N] that do so (loads,)."""
    effect = np.linalg.solve(np.asarray(lower(model).mass), np.array([direction(at, model.dof) for at in loads]).T)
    force = 1 / np.linalg.norm(effect, axis=0)
    return effect * force, force


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
            if floor.fills_band or floor.silent:
                rough[j], vague[j] = min(floor.std, _FULL_BAND * np.std(force[:, j])), 3.0
            elif floor.spacing < _OVERSAMPLED:
                rough[j] = floor.std
            else:
                force[:, j] = floor.smooth
                rough[j] = floor.std * np.sqrt(floor.effective_parameters / len(record))
            rough[j] = max(rough[j], _LEAST_NOISE * np.std(force[:, j]))
    return force, rough, vague
