"""Free runs of a structure, driven by what a record says drove it; the force that a motion needs, where that drove."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy.interpolate import CubicSpline

from .._result import Result
from .._types import require_x64
from ..records import Record
from ..structures import (
    AbstractSensor,
    AccelerationBias,
    AccelerationGain,
    ChannelDelay,
    Clipping,
    ForceDelay,
    ForceGain,
    MapTerm,
    Offset,
    Structure,
)
from ..surrogates import AbstractForceStateMap, tabulate
from ._drive import Reconstruction
from ._excitation import bucket, excitation, force_limits, measured_force, substeps_for, typical_size
from ._grid import Fine, punctual, run_grid, true_force
from ._imposed import imposed_motion, imposed_substeps
from ._needed import force_needed
from ._plant import Grid, Plant, lower, readout
from ._reference import run_reference
from ._start import starting_state
from ._stepper import free_acceleration, inverse_mass

_FINER = 4
"""Steps here for each that the likelihood takes: the error of a smooth motion falls with the fourth power."""
_MOST_FINER = 64
"""Steps per sample up to which they are refined so; beyond, they are doubled only."""
_BOUND = 1e6
"""A motion this many times larger than anything that was measured or could be driven has escaped."""


@dataclass(frozen=True)
class Response:
    """Motion of a free run, in the record's datum; or an imposed motion, and the force that it needs.

    Attributes
    ----------
    time : (n,) array
        Instants [s] on the record's clock. A run that diverges ends before its escape, so n may be less than the
        record's.
    displacement, velocity, acceleration : (n, dof) arrays
        Displacement and velocity relative to the base, acceleration absolute; offsets of the channels included.
    result : Result
        How the run ended.
    escape_time : float or None
        Instant [s] at which the motion left every bound; the state there is the last of the arrays.
    solver : str
        ``"reference"`` or ``"grid"``, whichever the motion comes from.
    force : (n, dof) array or None
        Where the motion is imposed: the force that it needs, offset of its channel included. The motion is then the
        record's own, as reconstructed.
    """

    time: np.ndarray
    displacement: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    result: Result
    escape_time: float | None
    solver: str
    _sensors: tuple[AbstractSensor, ...]
    force: np.ndarray | None = None

    def readings(self, record: Record) -> dict[tuple[str, int], np.ndarray]:
        """What the sensors of `record` would show, by channel (kind, degree of freedom): their effects applied.

        It is the channels of the response; where the motion is imposed, those of the force.
        """
        found = {}
        for key in record.answers:
            offset = total(self._sensors, Offset, key)
            y = (
                getattr(self, key[0])[:, key[1] - 1] - offset
            )  # gain and delay act on the motion, the offset comes after
            late = total(self._sensors, ChannelDelay, key) + total(self._sensors, ForceDelay, key)
            if late and y.size > 3:
                y = CubicSpline(self.time, y)(np.clip(self.time - late, self.time[0], self.time[-1]))
            bias = total(self._sensors, AccelerationBias, key)
            gain = total(self._sensors, AccelerationGain, key) + total(self._sensors, ForceGain, key)
            y = (1.0 + gain) * y + offset + bias
            limits = [s.value for s in self._sensors if isinstance(s, Clipping) and s.at == key]
            found[key] = np.clip(y, -min(limits), min(limits)) if limits else y
        return found


def simulate(
    model: Structure,
    record: Record,
    initial_state: Any = None,
    *,
    window: int = 50,
    reconstruction: Reconstruction = "band-limited",
    solver: Literal["reference", "grid"] = "reference",
    tolerance: float = 1e-10,
) -> Response:
    """Free run of `model` under the force (or base motion) of `record`, or the force that its imposed motion needs.

    With ``drive="motion"`` nothing is free: `Response.force` is the force that moves the structure as the record says,
    its inertia included; masses may be 0. Between its samples the motion is one quintic spline through all channels of
    a degree of freedom, its knots chosen by cross-validation. Hidden states are integrated along it, relaxed at the
    start; friction slides with the sign of the speed, and where that is smaller than its error, lies between both
    sides. `initial_state`, `window`, `reconstruction`, `solver` and `tolerance` mean nothing then.

    Parameters
    ----------
    model : Structure
    record : Record
        Its response, if any, is used for the initial state only.
    initial_state : pair of (dof,) arrays, optional
        Displacement and velocity at the first sample. Without it: rest if the record says so; else least squares of
        the structure over the first `window` samples of whatever response there is; else rest.
    window : int
    reconstruction : "band-limited", "linear" or "hold"
        The force between its samples.
    solver : "reference" or "grid"
        ``"reference"``: Tsitouras' 5(4) with step control at `tolerance` where nothing sticks or answers the past.
        ``"grid"``: fixed Runge-Kutta steps with located reversals, of the kind that the likelihood takes but four times
        as many; always where something sticks or answers the past.
    tolerance : float
        Relative, per step, of the motion's size. Over a hundred periods the errors of the steps add up to a thousand
        times as much.

    Returns
    -------
    Response

    Raises
    ------
    ValueError
        If the record names a degree of freedom that the structure lacks, its time is uneven, a mass is zero, or
        `initial_state` has the wrong shape; or, where the motion is imposed, it is not measured at a degree of freedom,
        or an initial state is given.
    """
    require_x64()
    check_pair(model, record, imposed=True)
    model = with_tables(model)
    if record.drive == "motion":
        if initial_state is not None:
            raise ValueError(
                '`initial_state` must be left out where the record has drive="motion": its motion is known throughout.'
            )
        return _imposed_response(model, record)
    channels = tuple(record.responses)
    exact = lower(model, channels)
    fixed = bool(len(exact.friction) or len(exact.delayed))  # what sticks or answers the past has a scheme of its own
    substeps = finer(substeps_for(model, record.dt, typical_size(record)))
    force = measured_force(record, model.dof, force_limits(model))
    fine = excitation(record, model.dof, substeps, reconstruction, length=bucket(len(record)), force=force)
    x0, v0 = starting_state(model, record, initial_state, window=window, reconstruction=reconstruction)
    # The grid run is cheap, and tells where an unstable motion leaves, before any step control meets it.
    start = jnp.asarray(x0), jnp.asarray(v0)
    # What answers the past remembers the motion once per sample of the drive, so here every step is one.
    every = substeps if len(exact.delayed) and solver == "reference" else 1
    plant = lower(model, channels, grid=Grid(record.dt / every, substeps // every))
    run = run_grid(plant, _by_steps(fine) if every > 1 else fine, *start)
    x, v, a = (np.asarray(q)[::every][: len(record)] for q in run)
    escape = int(escapes(motion_bound(plant, fine, record, x0, x), x, v))
    stop, used = (escape if escape < len(record) else None), "grid"
    if stop is None and solver == "reference" and not fixed:
        scale = jnp.maximum(jnp.std(jnp.asarray(x)), 1e-30)
        run = run_reference(exact, fine, *start, jnp.asarray(tolerance, dtype=jnp.float64), scale)
        if bool(run[-1]):
            used = "reference"
            a = np.asarray(_accelerations(exact, fine, *run[:-1]))[: len(record)]
            x, v = (np.asarray(q)[: len(record)] for q in run[:2])
    n = len(record) if stop is None else stop
    if record.base_acceleration is not None:
        a = a + record.base_acceleration[:, None]
    shown = {}
    for kind, values in (("displacement", x), ("velocity", v), ("acceleration", a)):
        shift = np.array([total(model.sensors, Offset, (kind, j + 1)) for j in range(model.dof)])
        shown[kind] = values[:n] + shift
    return Response(
        time=record.time[:n],
        result=Result.successful if stop is None else Result.diverged,
        escape_time=None if stop is None else float(record.time[stop]),
        solver=used,
        _sensors=model.sensors,
        **shown,
    )


def total(sensors: Sequence[AbstractSensor], effect: type[AbstractSensor], channel: tuple[str, int]) -> float:
    """Sum of the effects of one kind on a channel."""
    return sum(s.value for s in sensors if isinstance(s, effect) and s.at == channel)


def with_tables(model: Structure) -> Structure:
    """The structure with every map frozen to a table: in every step a map would cost a thousand times more."""
    terms = [
        tabulate(t.force_map).on(t.at)
        if isinstance(t, MapTerm) and isinstance(t.force_map, AbstractForceStateMap)
        else t
        for t in model.terms
    ]
    return Structure(model.mass, terms, model.sensors, model.trust)


def _imposed_response(model: Structure, record: Record) -> Response:
    """The motion of a record, and the force that it needs."""
    path, channels = imposed_motion(record, model), tuple(record.channels)
    substeps = finer(imposed_substeps(model, record.dt, typical_size(record)))
    # Gain and delay of the force's sensor concern readings only.
    plain = [s for s in model.sensors if not isinstance(s, ForceGain | ForceDelay)]
    structure = Structure(model.mass, model.terms, plain, model.trust)
    plant = lower(structure, channels, grid=Grid(record.dt, substeps))
    force = force_needed(plant, readout(channels, model.dof), path.imposed(substeps, bucket(len(record))))
    return Response(
        record.time, *path.motion(record.time), Result.successful, None, "grid", model.sensors,
        np.asarray(force)[: len(record)],
    )  # fmt: skip


def check_pair(model: Structure, record: Record, *, imposed: bool = False) -> None:
    """Refuse a record and a structure that do not belong together; `imposed` motions only where they are understood."""
    if len(record) < 2:
        raise ValueError(f"`record` must hold at least 2 samples; it has {len(record)}.")
    if record.dofs > model.dof:
        raise ValueError(f"`record` names degree of freedom {record.dofs}; the structure has {model.dof}.")
    if record.drive == "motion":
        if imposed:
            return
        raise ValueError(
            '`record` has drive="motion"; here a force or a moving base must drive. `simulate`, `fit` and `diagnose` '
            'take imposed motions; if the force drives the structure, make the record with drive="force".'
        )
    masses = np.asarray(model.mass)
    if masses.ndim == 1 and np.any(masses == 0):
        raise ValueError(
            f"`mass` must be positive for the structure to move; got {masses.tolist()}. "
            'A mass of 0 is for imposed motion only: make the record with drive="motion" if that is what it is.'
        )


@eqx.filter_jit
def _accelerations(plant: Plant, fine, x, v, z):
    """Accelerations (n, dof) along a motion."""
    minv, fine = inverse_mass(plant), punctual(plant, fine)

    def one(force, base, time, x, v, z):
        return free_acceleration(plant, minv, x, v, z, true_force(plant, force[:1], base[:1])[0], time)

    return jax.vmap(one)(fine.force, fine.base, fine.time, x, v, z)


def finer(substeps: int) -> int:
    """Steps per sample of a run that is to be looked at, from those that the likelihood would take."""
    return max(min(_FINER * substeps, _MOST_FINER), 2 * substeps)


def _by_steps(fine: Fine) -> Fine:
    """The same drive with every step a sample of its own."""
    n, substeps = fine.force.shape[0], fine.substeps
    step = fine.step / substeps
    nodes = 2 * jnp.arange(substeps)[:, None] + jnp.arange(3)[None, :]
    return Fine(
        fine.force[:, nodes].reshape(n * substeps, 3, -1),
        fine.base[:, nodes].reshape(n * substeps, 3),
        (fine.time[:, None] + step * jnp.arange(substeps)[None, :]).reshape(-1),
        step,
    )


def motion_bound(plant: Plant, fine: Fine, record: Record, x0: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Displacement beyond which a run has escaped: far more than was measured, could be driven, or is usual in it.

    The plant's matrices, `x0` (..., dof) and `x` (..., n, dof) may have leading axes, one bound for each.
    """
    measured = max(
        (np.max(np.abs(y)) for (kind, _), y in record.responses.items() if kind == "displacement"), default=0
    )
    stiffness, mass = (np.max(np.abs(np.asarray(q)), axis=(-2, -1)) for q in (plant.stiffness, plant.mass))
    driving = np.max(np.abs(np.asarray(fine.force))) + mass * np.max(np.abs(np.asarray(fine.base)))
    static = driving / np.where(stiffness > 0, stiffness, mass / record.duration**2)
    # With nothing else to compare with, the median of the run has to do.
    own = np.nanmedian(np.abs(np.where(np.isfinite(x), x, np.nan)), axis=(-2, -1))
    sizes = (static, np.max(np.abs(x0), axis=-1), own)
    return _BOUND * np.maximum(np.max(np.stack(np.broadcast_arrays(*sizes)), axis=0), max(measured, 1e-300))


def escapes(bound: np.ndarray, x: np.ndarray, v: np.ndarray) -> np.ndarray:
    """First sample of each run (..., n, dof) beyond its bound; n where there is none."""
    good = np.isfinite(x) & np.isfinite(v) & (np.abs(x) < bound[..., None, None])
    bad = ~np.all(good, axis=-1)
    return np.where(np.any(bad, axis=-1), np.argmax(bad, axis=-1), x.shape[-2])
