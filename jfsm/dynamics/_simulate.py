"""Free runs of a structure, driven by what a record says drove it; the force that a motion needs, where that drove."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple, get_args

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from .._programs import programs_kept
from .._result import Result
from .._types import HostArray, as_numbers, is_traced, known, require_x64
from ..plant import (
    Grid,
    InterpolatedInput,
    Plant,
    Reconstruction,
    alone,
    bucket,
    check_pair,
    check_reconstruction,
    check_window,
    excitation,
    force_limits,
    force_needed,
    free_acceleration,
    imposed_motion,
    imposed_substeps,
    inverse_mass,
    lower,
    measured_force,
    observation_of,
    run_again,
    run_by_itself,
    run_grid,
    run_strided,
    starting_state,
    substeps_for,
    true_force,
    typical_size,
    undelayed,
)
from ..records import Record, as_record, mended
from ..structures import (
    AbstractFriction,
    AbstractSensor,
    AccelerationBias,
    AccelerationGain,
    ChannelDelay,
    Clipping,
    EvaluatedMotion,
    ForceDelay,
    ForceGain,
    MapTerm,
    Offset,
    Structure,
    as_model,
    check_order,
)
from ..surrogates import AbstractForceStateMap, tabulate
from ._agreement import Agreement, agreement
from ._reference import STEPS_OF_DRIVE, coarser, run_reference

Solver = Literal["reference", "grid"]

_FINER = 4
"""Steps here for each that the likelihood takes: the error of a smooth motion falls with the fourth power."""
_MOST_FINER = 64
"""Steps per sample up to which they are refined so; beyond, they are doubled only."""
_GROWTH = 4
"""How many times as many steps a run takes once more where its error is larger than wanted."""
_WANTED = 1e-3
"""Error of a run, in standard deviations of its motion, beyond which it is made once more, more finely."""
_LOOSER = 100.0
"""Tolerance of the run that a run with step control is compared with, over its own."""
_LOOSE_SHARE = 0.1
"""Error of the tighter run over the difference of both: a hundredth by the tolerance, a 64th by the drive, and room."""
_TIGHTEST, _LOOSEST = 1e-14, 1e-2
_BOUND = 1e6
"""A motion this many times larger than anything that was measured or could be driven has escaped."""


@dataclass(frozen=True, repr=False)
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
    error : (dof,) array or None
        Estimated largest error [m] of the displacement of each degree of freedom, from a second run that was made more
        coarsely: how far the arrays are from the motion of this structure under this reconstructed force. It says
        nothing of the model, nor of what the force does between its samples. None where the motion is imposed.
    agreed_until : float or None
        Instant [s] up to which both runs agree, to a tenth of the motion's standard deviation. None where they do
        throughout; else the motion is sensitive, chaotic perhaps, and what follows is one of many motions.
    """

    time: Float[HostArray, " n"]
    displacement: Float[HostArray, "n dof"]
    velocity: Float[HostArray, "n dof"]
    acceleration: Float[HostArray, "n dof"]
    result: Result
    escape_time: float | None
    solver: str
    _sensors: tuple[AbstractSensor, ...]
    force: Float[HostArray, "n dof"] | None = None
    error: Float[HostArray, " dof"] | None = None
    agreed_until: float | None = None
    _record: Record | None = None
    _given: Any = None

    def __repr__(self) -> str:
        n, dof = self.displacement.shape
        end = f"escaped at {self.escape_time:.6g} s" if self.escape_time is not None else f"{self.time[-1]:.6g} s"
        return f"<Response, {n} samples of {dof} degree{'s' * (dof > 1)} of freedom, {end}, {self.solver} solver>"

    def _repr_html_(self) -> str:
        """The motion's sizes, for a notebook."""
        from ..reporting import channel_table

        named = ((f"{kind} {j + 1}", unit, y[:, j]) for kind, unit, y in self._motion() for j in range(y.shape[1]))
        return channel_table(repr(self).strip("<>"), named)

    def plot(self, ax: Any = None) -> Any:
        """Displacement, velocity and acceleration over time, and the force where motion drives.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Three, or four with the force; a new figure without them.

        Returns
        -------
        array of matplotlib axes
        """
        from ..reporting import Line, PanelOf, draw_panels

        panels = []
        for kind, unit, values in self._motion():
            lines = [Line(f"{kind} {j + 1}", self.time, values[:, j]) for j in range(values.shape[1])]
            panels.append(PanelOf("time [s]", f"{kind} [{unit}]", lines))
        return draw_panels(panels, ax)

    def _motion(self) -> list[tuple[str, str, Any]]:
        """What there is of motion and force, each with its unit."""
        si = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2", "force": "N"}
        units = si if self._record is None else {**si, **self._record.units}
        return [(kind, units[kind], getattr(self, kind)) for kind in si if getattr(self, kind) is not None]

    def to_dataframe(self) -> Any:
        """The motion as a DataFrame of pandas, which must be installed, over the instants [s]."""
        return self.to_record().to_dataframe()

    def to_record(self) -> Record:
        """The run as a record, as if everything had been measured: its motion and what drove it, in its units.

        Where the motion was imposed, the force that it needs. A run that diverged ends before its escape.

        Raises
        ------
        ValueError
            If the response was not made by `simulate`, or ended before its second sample.
        """
        if self._record is None:
            raise ValueError(
                "`response` must come from jfsm.simulate to be a record; this one was made by hand. Make the record "
                "from its arrays: jfsm.Record(time, displacement=...)."
            )
        of, n = self._record, len(self.time)
        force = {j: samples[:n] for (kind, j), samples in of.channels.items() if kind == "force"} or None
        base = of.base_acceleration
        record = Record(
            self.time,
            force=self.force if self.force is not None else force if self._given is None else self._given[:n],
            displacement=self.displacement,
            velocity=self.velocity,
            acceleration=self.acceleration,
            base_acceleration=None if base is None else base[:n],
            units=of.units,
            at_rest=of.at_rest,
            drive=of.drive,
            name=f"{of.name}, simulated" if of.name else "simulated",
        )
        return record.noted("Simulated by jfsm.")

    @property
    def accuracy(self) -> str:
        """How good the run is, in words."""
        if self.error is None:
            return "The motion is imposed; nothing runs free."
        sizes = ", ".join(f"{error:.2g}" for error in self.error)
        if self.agreed_until is None:
            return f"The displacement is good to {sizes} (in its unit, one value per degree of freedom)."
        return (
            f"Two runs of different steps agree until t = {self.agreed_until:.6g} s and then part: the motion is "
            "sensitive to the smallest change, and beyond that instant only its character can be trusted. "
            "Compare statistics there, or run shorter stretches from measured states."
        )

    def readings(self, record: Record) -> dict[tuple[str, int], Float[np.ndarray, " n"]]:
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


@programs_kept()
def simulate(
    model: Structure,
    record: Record,
    initial_state: Any = None,
    *,
    force: Any = None,
    window: int = 50,
    reconstruction: Reconstruction = "band-limited",
    solver: Solver = "reference",
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
    force : (n,) or (n, dof) array, optional
        Samples that drive in place of the record's; a single column acts on the first degree of freedom.
    window : int
    reconstruction : "band-limited", "linear" or "hold"
        The force between its samples.
    solver : "reference" or "grid"
        ``"reference"``: Tsitouras' 5(4) with step control at `tolerance` where nothing sticks or answers the past.
        ``"grid"``: fixed Runge-Kutta steps with located reversals, of the kind that the likelihood takes but four times
        as many; always where something sticks or answers the past. Where two runs differ by more than a thousandth of
        the motion, either is made once more, with a hundredth of the tolerance or four times the steps.
    tolerance : float
        Relative, per step, of the motion's size. Over a hundred periods the errors of the steps add up to a thousand
        times as much; `Response.error` estimates what they come to.

    Returns
    -------
    Response

    Raises
    ------
    ValueError
        If the record names a degree of freedom that the structure lacks, its time is uneven, a mass is zero,
        `initial_state` or `force` has the wrong shape, or there is no such solver or tolerance; or, where the motion is
        imposed, it is not measured at a degree of freedom, or an initial state or a force is given.
    TypeError
        If `jax.jit` or `jax.vmap` hides the numbers by which steps are chosen, or a map's are to be differentiated.

    Notes
    -----
    `jax.grad`, `jax.jvp`, `jax.jacfwd` and `jax.jacrev` may be taken of a call: by the numbers of the structure, by
    `force` and by `initial_state`. The motion then comes from the grid, as JAX arrays, in steps chosen for the numbers
    as they are, and the derivative is exactly that of this run. The start must be known: given, or at rest.
    """
    require_x64()
    check_order("jfsm.simulate(model, record)", model, record)
    as_model(model)
    as_record(record)
    check_scheme(solver, tolerance)
    check_reconstruction(reconstruction)
    check_window(window)
    check_pair(model, record, imposed=True)
    record = mended(record)
    model = with_tables(model)
    if record.drive == "motion":
        if initial_state is not None:
            raise ValueError(
                '`initial_state` must be left out where the record has drive="motion": its motion is known throughout.'
            )
        if force is not None:
            raise ValueError('`force` must be left out where the record has drive="motion": it is what is looked for.')
        return _imposed_response(model, record)
    if is_traced((model, force, initial_state)):
        return _traced_response(model, record, initial_state, force, reconstruction)
    samples = _force_samples(model, record, force)
    start = starting_state(model, record, initial_state, window=window, reconstruction=reconstruction)
    run = _free_run(model, record, samples, start, reconstruction, solver, tolerance)
    return _response(model, record, run, None if force is None else samples)


def _traced_response(model: Structure, record: Record, initial_state: Any, force: Any, reconstruction) -> Response:
    """A run whose derivatives are asked for: on the grid, in steps that were chosen for the numbers as they are."""
    if initial_state is None and record.responses and not record.at_rest:
        raise ValueError(
            "`initial_state` must be given where derivatives are asked for, or the record be made with `at_rest=True`; "
            "it was left out, and a start that is fitted to the response would move with the model unseen."
        )
    what = "The numbers of `model`, `force` and `initial_state`"
    model_now, force_now, state_now = known(model, what), known(force, what), known(initial_state, what)
    now = starting_state(model_now, record, state_now)
    samples = _force_samples(model_now, record, force_now)
    chosen = _free_run(model_now, record, samples, now, reconstruction, "grid", 1.0)
    plant = alone(lower(model, grid=_steps_of(record.dt, chosen.substeps), rolled=True))
    every = chosen.substeps if len(plant.delayed) else 1
    if force is not None:
        samples = _by_dof(force, record, model.dof)
    inputs = excitation(record, model.dof, chosen.substeps, reconstruction, length=bucket(len(record)), force=samples)
    start = now if initial_state is None else tuple(jnp.atleast_1d(jnp.asarray(q, dtype=float)) for q in initial_state)
    x, v, a = run_again(plant, inputs.by_steps() if every > 1 else inputs, *(jnp.asarray(q) for q in start))
    shown = slice(0, len(record) * every, every)
    return _response(model, record, chosen._replace(motion=(x[shown], v[shown], a[shown])))


class _Run(NamedTuple):
    """Displacement, velocity and relative acceleration (n, dof) of a free run, where it ended, and how good it is."""

    motion: tuple[Any, Any, Any]
    stop: int | None
    solver: str
    substeps: int
    agreement: Agreement


def _free_run(
    model: Structure, record: Record, force: np.ndarray, start: tuple, reconstruction, solver: str, tolerance: float
) -> _Run:
    """The run of a structure with known numbers from a known start, under samples of the force (n, dof)."""
    sticks = any(isinstance(t, AbstractFriction) for t in model.terms)
    own_scheme = sticks or any(t.delay is not None for t in model.terms) or isinstance(model.own, EvaluatedMotion)

    def drive(substeps: int) -> InterpolatedInput:
        return excitation(record, model.dof, substeps, reconstruction, length=bucket(len(record)), force=force)

    substeps = finer(substeps_for(model, record.dt, typical_size(record)))
    # The grid run is cheap, and tells where an unstable motion leaves, before any step control meets it.
    better = _grid_run(model, record, drive(substeps), start)
    if better.stop is None and solver == "reference" and not own_scheme:
        inputs = drive(max(substeps, STEPS_OF_DRIVE))
        found = _controlled_run(model, record, inputs, start, better, tolerance)
        if found is not None:
            return found._replace(substeps=substeps)
    coarse = _grid_run(model, record, drive(substeps), start, stride=2)
    run, ratio = _judged(better, coarse, 2), min(_GROWTH, _MOST_FINER // substeps)
    if ratio > 1 and not run.agreement.within(_WANTED, run.motion[0][: run.stop], better.usual):
        finest = _grid_run(model, record, drive(ratio * substeps), start)
        run = _judged(finest, better, ratio)
    return run


class _GridRun(NamedTuple):
    motion: tuple[np.ndarray, np.ndarray, np.ndarray]
    stop: int | None
    substeps: int
    usual: float
    """Displacement [m] that is usual for what drives."""


def _grid_run(model: Structure, record: Record, inputs: InterpolatedInput, start: tuple, stride: int = 1) -> _GridRun:
    """A run in fixed steps, or in those `stride` times as long: both by one program."""
    plant, n, every = lower(model, grid=Grid(record.dt, inputs.substeps // stride)), len(record), 1
    begin = tuple(jnp.asarray(q) for q in start)
    if len(plant.delayed):
        # What answers the past remembers the motion once per sample of the drive, so here every step is one.
        every, length = inputs.substeps // stride, inputs.force.shape[0] * inputs.substeps
        reach = lower(model, grid=_steps_of(record.dt, inputs.substeps)).reach
        motion = run_grid(replace(plant, reach=reach), inputs.by_steps(stride, length), *begin)
    elif isinstance(plant.own, EvaluatedMotion):
        motion = run_by_itself(plant, inputs.strided(stride), n, *start)
    else:
        motion = run_strided(plant, inputs, jnp.asarray(stride), *begin)
    x, v, a = (np.asarray(q)[: n * every : every] for q in motion)
    bound = motion_bound(plant, inputs, record, np.asarray(start[0]), x)
    escape = int(escapes(bound, x, v))
    return _GridRun((x, v, a), escape if escape < n else None, inputs.substeps // stride, float(bound) / _BOUND)


def _judged(run: _GridRun, coarse: _GridRun, ratio: int) -> _Run:
    """A run on the grid with its error, from one whose steps were `ratio` times as long."""
    # The method is of order four where the motion is smooth. Kinks that no step knows of cost it two orders, and what
    # is left varies from one to the next: as much is allowed for as a method of order one would need.
    share = 1.0 / (ratio - 1)
    found = agreement(run.motion[0][: run.stop], coarse.motion[0][: run.stop], share, run.usual)
    return _Run(run.motion, run.stop, "grid", run.substeps, found)


def _controlled_run(
    model: Structure, record: Record, inputs: InterpolatedInput, start: tuple, on_grid: _GridRun, tolerance: float
) -> _Run | None:
    """A run with step control, sharpened once where it is not good enough; None if step control did not get through."""
    exact, n = lower(model), len(record)
    scale = jnp.maximum(jnp.std(jnp.asarray(on_grid.motion[0])), 1e-30)
    (x0, v0), coarse, found = (jnp.asarray(q) for q in start), coarser(inputs), None
    for tight in (tolerance, max(tolerance / _LOOSER, _TIGHTEST)):
        run = run_reference(exact, inputs, x0, v0, jnp.asarray(tight), scale)
        loose = run_reference(exact, coarse, x0, v0, jnp.asarray(min(tight * _LOOSER, 0.1)), scale)
        if not bool(run[-1]):
            break
        x, v = (np.asarray(q)[:n] for q in run[:2])
        a = np.asarray(_accelerations(exact, inputs, *run[:-1]))[:n]
        near = agreement(x, np.asarray(loose[0])[:n], _LOOSE_SHARE, on_grid.usual)
        found = _Run((x, v, a), None, "reference", on_grid.substeps, near)
        if near.within(_WANTED, x, on_grid.usual):
            break
    return found


def _response(model: Structure, record: Record, run: _Run, given: np.ndarray | None = None) -> Response:
    """What a run shows: in the record's datum, up to its escape; `given` is the force in place of the record's."""
    n = len(record) if run.stop is None else run.stop
    x, v, a = run.motion
    if record.base_acceleration is not None:
        a = a + record.base_acceleration[:, None]
    shown = {}
    for kind, values in (("displacement", x), ("velocity", v), ("acceleration", a)):
        shift = [total(model.sensors, Offset, (kind, j + 1)) for j in range(model.dof)]
        row = jnp.stack([jnp.asarray(q) for q in shift]) if is_traced(shift) else np.array(shift)
        shown[kind] = values[:n] + row[None, :]
    parted = run.agreement.parted
    return Response(
        time=record.time[:n],
        result=Result.successful if run.stop is None else Result.diverged,
        escape_time=None if run.stop is None else float(record.time[run.stop]),
        solver=run.solver,
        _sensors=model.sensors,
        error=run.agreement.error,
        agreed_until=None if parted is None else float(record.time[max(parted - 1, 0)]),
        _record=record,
        _given=given,
        **shown,
    )


def _steps_of(dt: float, substeps: int) -> Grid:
    """The grid of a run whose every step is a sample."""
    return Grid(dt / substeps, 1)


def _force_samples(model: Structure, record: Record, force: Any) -> np.ndarray:
    """Samples of the force (n, dof): those given, else the record's."""
    if force is None:
        return measured_force(record, model.dof, force_limits(model))
    return _by_dof(force, record, model.dof)


def _by_dof(force: Any, record: Record, dof: int) -> Any:
    """A given force as (n, dof); of one column if it has one, at the first degree of freedom."""
    samples = as_numbers(force, "force", (1, 2))
    samples = samples[:, None] if samples.ndim == 1 else samples
    if samples.shape not in {(len(record), 1), (len(record), dof)}:
        raise ValueError(
            f"`force` must have one row per sample of `record` and one column, or one per degree of freedom, "
            f"({len(record)}, {dof}); got {samples.shape}. Leave it out to take the record's own."
        )
    xp = jnp if is_traced(samples) else np
    return xp.pad(samples, ((0, 0), (0, dof - samples.shape[1])))


def check_scheme(solver: Any, tolerance: Any) -> None:
    """Refuse a solver that there is not, or a tolerance that step control cannot keep."""
    if not isinstance(solver, str) or solver not in get_args(Solver):
        raise ValueError(f'`solver` must be "reference" or "grid"; got {solver!r}. Leave it out for "reference".')
    number = isinstance(tolerance, int | float | np.number) and not isinstance(tolerance, bool)
    if not number or not _TIGHTEST <= tolerance <= _LOOSEST:
        raise ValueError(
            f"`tolerance` must be a number from {_TIGHTEST:g} to {_LOOSEST:g}: the relative error of a step, which "
            f"rounding bounds below; got {tolerance!r}. Leave it out for 1e-10."
        )


def total(sensors: Sequence[AbstractSensor], effect: type[AbstractSensor], channel: tuple[str, int]) -> float:
    """Sum of the effects of one kind on a channel."""
    return sum(s.value for s in sensors if isinstance(s, effect) and s.at == channel)


def with_tables(model: Structure) -> Structure:
    """The structure with every map frozen to a table: in every step a map would cost a thousand times more."""
    maps = [t.force_map for t in model.terms if isinstance(t, MapTerm)]
    if is_traced([m for m in maps if isinstance(m, AbstractForceStateMap)]):
        raise TypeError(
            "`model` must hold maps of known numbers: each is frozen to a table, which has no derivative by them; "
            "one of a map is traced. Differentiate by the structure's other numbers, or put in a law of your own, "
            "`MapTerm(function, at=(0, 1))` with an equinox module for a function of the state."
        )
    terms = [
        tabulate(t.force_map).on(t.at)
        if isinstance(t, MapTerm) and isinstance(t.force_map, AbstractForceStateMap)
        else t
        for t in model.terms
    ]
    return model.having(terms=terms)


def _imposed_response(model: Structure, record: Record) -> Response:
    """The motion of a record, and the force that it needs."""
    path, channels = imposed_motion(record, model), tuple(record.channels)
    substeps = finer(imposed_substeps(model, record.dt, typical_size(record)))
    # Gain and delay of the force's sensor concern readings only.
    plain = [s for s in model.sensors if not isinstance(s, ForceGain | ForceDelay)]
    plant = lower(model.having(sensors=plain), channels, grid=Grid(record.dt, substeps))
    force = force_needed(plant, observation_of(channels, model.dof), path.imposed(substeps, bucket(len(record))))
    return Response(
        record.time, *path.motion(record.time), Result.successful, None, "grid", model.sensors,
        np.asarray(force)[: len(record)], _record=record,
    )  # fmt: skip


@eqx.filter_jit
def _accelerations(plant: Plant, inputs, x, v, z):
    """Accelerations (n, dof) along a motion."""
    minv, inputs = inverse_mass(plant), undelayed(plant, inputs)

    def one(force, base, time, x, v, z):
        return free_acceleration(plant, minv, x, v, z, true_force(plant, force[:1], base[:1])[0], time)

    return jax.vmap(one)(inputs.force, inputs.base, inputs.time, x, v, z)


def finer(substeps: int) -> int:
    """Steps per sample of a run that is to be looked at, from those that the likelihood would take."""
    return max(min(_FINER * substeps, _MOST_FINER), 2 * substeps)


def motion_bound(plant: Plant, inputs: InterpolatedInput, record: Record, x0: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Displacement beyond which a run has escaped: far more than was measured, could be driven, or is usual in it.

    The plant's matrices, `x0` (..., dof) and `x` (..., n, dof) may have leading axes, one bound for each.
    """
    measured = max(
        (np.max(np.abs(y)) for (kind, _), y in record.responses.items() if kind == "displacement"), default=0
    )
    stiffness, mass = (np.max(np.abs(np.asarray(q)), axis=(-2, -1)) for q in (plant.stiffness, plant.mass))
    driving = np.max(np.abs(np.asarray(inputs.force))) + mass * np.max(np.abs(np.asarray(inputs.base)))
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
