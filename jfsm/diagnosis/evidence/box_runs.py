"""A simulation that can only be run, run with what was found that it lacks.

The force of what was found depends on the motion, which only a run shows. Feeding it back until it no longer changes
diverges where damping is light. A structure that stands for the simulation moves nearly as it does; what it does
differently is a force on it, and with that force it is solved together with what was found. Of that solution the force
is taken for the next run.

References
----------
K. Böhmer, P. W. Hemker, H. J. Stetter, The defect correction approach, in Defect Correction Methods, Computing
Supplementum 5, 1984.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.interpolate import make_interp_spline

from ..._result import Result
from ...dynamics import Response, simulate
from ...identification import Nuisances
from ...plant import Reconstruction, direction, force_along, lower, measured_force
from ...records import Record
from ...structures import Offset, Runs, Structure
from ..channels.drift import steady
from .between_samples import as_samples, between_samples
from .free_runs import ChannelGain, Gain, StructureOf, blocks_of, interval_of
from .split import HeldOut

_MOST = 12
"""Runs in which the motion has to come to rest."""
_RESTS = 5e-3
"""Change of the motion from one run to the next, in its size, below which it has."""
_ELSEWHERE = 0.1
"""Share of the force that may act where the simulation takes none, and is left out."""
_GROWN = 1e3
"""Size of a motion, in that of the plain run, beyond which the runs part for good."""

States = Float[np.ndarray, "n dof"]


class NotRun(Exception):
    """Why a simulation could not be run with what was found, as the end of a sentence."""


class Extended(NamedTuple):
    """Displacement of a simulation with what was found, the runs that it took, and the change in the last of them."""

    displacement: States
    made: Record
    runs: int
    change: float


class _HeldOut(NamedTuple):
    """A record with what was held out of it, the run with what was found, the errors and the curves of both runs."""

    record: Record
    extended: Extended
    off: list[dict[tuple[str, int], np.ndarray]]
    curves: dict[str, dict[tuple[str, int], np.ndarray]]

    @property
    def squares(self) -> list[dict[tuple[str, int], float]]:
        """Mean square errors by channel, before and after."""
        return [{c: float(np.mean(e**2)) for c, e in errors.items()} for errors in self.off]


@dataclass(frozen=True)
class Box:
    """A simulation that can only be run, the structure that stands for it, how it takes a force between samples, and
    the records from their first samples."""

    runs: Runs
    stand_in: Structure
    drive: Reconstruction
    whole: Sequence[Record]

    def gain(
        self,
        extended: StructureOf,
        held: Sequence[HeldOut],
        by_stand_in: Gain,
        curves: Sequence[Mapping],
        fitted: Nuisances,
    ) -> tuple[Gain, list[dict], str]:
        """Gain of the simulation itself in place of that of its stand-in, the curves behind it, and what is said of it.

        What noise leaves is as it is for the stand-in. There are no refitted values: those are the stand-in's.

        Raises
        ------
        NotRun
            If the simulation cannot be run with what was found.
        """
        if by_stand_in.horizon is not None:
            astray = "its stand-in does not follow the whole motion"
            raise NotRun(astray if by_stand_in.astray else "noise alone makes its runs part")
        found = [self._held_out(part, extended(part.of), fitted) for part in held]
        blocks = [block for one in found for block in blocks_of(one.off, fitted.period / one.record.dt)]
        gain = _gain(by_stand_in, [one.squares for one in found], np.stack(blocks))
        shown = [{**curve, **one.curves} for curve, one in zip(curves, found, strict=True)]
        runs, change = sum(one.extended.runs for one in found), max(one.extended.change for one in found)
        said = (
            f"The gain is that of the simulation itself, run with the force that it lacks: {runs} runs, the last of "
            f"which moved it by {change:.1%}."
        )
        return gain, shown, said

    def _held_out(self, part: HeldOut, structure: Structure, fitted: Nuisances) -> "_HeldOut":
        """Runs over what was held out, the simulation as it is and with what a structure has beyond the stand-in."""
        whole = part.record if part.of is None else self.whole[part.of]
        take, wandering = _samples(whole, part), [fitted.channels[c] for c in fitted.readings.wandering]
        found = self.extended(structure, whole)
        runs = (
            _readings(self.stand_in, self.plain(whole), whole, part.record),
            _readings(structure, found.made, whole, part.record),
        )
        curves = [{c: y[take] for c, y in run.items()} for run in runs]
        off = [{c: run[c] - y[part.begin :] for c, y in part.record.answers.items()} for run in curves]
        off = [errors | {c: steady(errors[c]) for c in wandering} for errors in off]
        return _HeldOut(whole, found, off, {"before": curves[0], "after": curves[1]})

    def plain(self, record: Record) -> Record:
        """The simulation as it is."""
        return self.runs.of(record)

    def extended(self, structure: Structure, record: Record) -> Extended:
        """A run with what the structure has beyond the stand-in, by defect correction.

        Raises
        ------
        NotRun
            If that acts where the simulation takes no force, a run does not show the motion, or runs do not settle.
        """
        if record.drive == "motion":
            raise NotRun("its motion is imposed")
        ours, whole = self.stand_in.having(sensors=()), _driven_as(structure)
        force = measured_force(record, ours.dof)
        made = self.plain(record)
        plain = moved = _displacement(made, ours.dof)
        start = plain[0], _rates(record, plain)[0][0]
        given, change, settling = np.zeros_like(force), math.inf, _Settling()
        for run in range(1, _MOST + 1):
            alone = self._run(ours, record, start, force + given)
            lacking = _force_between(ours, record, alone, moved)
            finely, driving = between_samples(record, force + lacking, self.drive)
            together = self._run(whole, finely, start, driving, "linear")
            wanted = as_samples(_inertia(ours, finely, together) - driving, held=self.drive == "hold")
            extra, given = self._at_places(record, settling.next(given, wanted))
            made = _under(self.runs, record, extra)
            before, moved = moved, _displacement(made, ours.dof)
            size = float(np.sqrt(np.mean(moved**2)))
            if not size < _GROWN * float(np.sqrt(np.mean(plain**2))):
                raise NotRun(f"its motion grew without bound in {run} runs")
            change = float(np.sqrt(np.mean((moved - before) ** 2))) / max(size, 1e-300)
            if change < _RESTS:
                return Extended(moved, made, run, change)
        raise NotRun(f"it did not settle: the last of {_MOST} runs still moved it by {change:.1%}")

    def _run(
        self, model: Structure, record: Record, start: tuple, force: States, way: Reconstruction | None = None
    ) -> Response:
        response = simulate(model, record, start, force=force, reconstruction=way or self.drive, solver="grid")
        if not response.result.ok:
            raise NotRun("the structure that stands for it diverges with it")
        return response

    def _at_places(self, record: Record, wanted: States) -> tuple[dict[tuple[int, int], np.ndarray], States]:
        """A force (n, dof) as forces at the places of the simulation, and what these come to."""
        dof = wanted.shape[1]
        channels = [(0, j) for (kind, j) in record.channels if kind == "force"]
        places = list(dict.fromkeys([*self.runs.places, *channels]))
        rows = np.array([direction(place, dof) for place in places]).reshape(len(places), dof)
        shares = wanted @ np.linalg.pinv(rows)
        given = shares @ rows
        left = np.linalg.norm(wanted - given) / max(float(np.linalg.norm(wanted)), 1e-300)
        if left > _ELSEWHERE:
            taken = ", ".join(f"{i}–{j}" for i, j in places) or "nowhere"
            raise NotRun(f"{left:.0%} of the force acts where it takes none; it takes forces at {taken}")
        return dict(zip(places, shares.T, strict=True)), given


class _Settling:
    """The next point of an iteration, from all before: that whose change would be least if changes were linear.

    References
    ----------
    D. G. Anderson, Iterative procedures for nonlinear integral equations, J. ACM 12 (1965) 547-560.
    """

    def __init__(self):
        self._points: list[np.ndarray] = []
        self._changes: list[np.ndarray] = []

    def next(self, point: States, found: States) -> States:
        """The next point after one and what was found from it."""
        self._points.append(found)
        self._changes.append(found - point)
        by_change, by_point = (
            np.array([(one - other).ravel() for one, other in zip(all[1:], all[:-1], strict=True)]).T
            for all in (self._changes, self._points)
        )
        if len(self._points) == 1:
            return found
        shares = np.linalg.lstsq(by_change, self._changes[-1].ravel(), rcond=1e-6)[0]
        return found - (by_point @ shares).reshape(found.shape)


def _under(runs: Runs, record: Record, extra: Mapping[tuple[int, int], np.ndarray]) -> Record:
    """A run under forces at places, or in channels, where it has no such place."""
    columns: dict = {}
    for (kind, j), y in record.channels.items():
        more = extra[0, j] if kind == "force" and (0, j) not in runs.places else 0.0
        columns.setdefault(kind, {})[j] = np.asarray(y) + more
    units = {kind: record.units[kind] for kind in columns}
    driven = Record(
        record.time, base_acceleration=record.base_acceleration, units=units, at_rest=record.at_rest, **columns
    )
    at_places = {place: force for place, force in extra.items() if place in runs.places}
    return runs.of(driven, at_places or None)


def _driven_as(structure: Structure) -> Structure:
    """The structure with what its sensors make of the force that drives it, and nothing else of theirs."""
    return structure.having(sensors=[s for s in structure.sensors if s.at[0] == "force" and not isinstance(s, Offset)])


def _displacement(made: Record, dof: int) -> States:
    """Displacement (n, dof) that a run shows."""
    found = [made.channels.get(("displacement", j)) for j in range(1, dof + 1)]
    if any(one is None for one in found):
        missing = next(j for j, one in enumerate(found, 1) if one is None)
        raise NotRun(f"its run does not show the displacement of degree of freedom {missing}")
    return np.stack([np.asarray(one) for one in found], -1)


def _rates(record: Record, x: States) -> tuple[States, States]:
    """Velocity and acceleration (n, dof) of a motion that is free of noise."""
    spline = make_interp_spline(record.time, x, k=5)
    return spline(record.time, 1), spline(record.time, 2)


def _force_between(ours: Structure, record: Record, alone: Response, moved: States) -> States:
    """The force (n, dof) that makes a structure move as the simulation does and not as it does alone."""
    x = np.asarray(alone.displacement)
    v, a = _rates(record, moved - x)
    there = _restoring(ours, record, moved, np.asarray(alone.velocity) + v)
    return a @ _mass(ours).T + there - _restoring(ours, record, x, np.asarray(alone.velocity))


def _inertia(ours: Structure, record: Record, response: Response) -> States:
    """All that a structure sets against what drives it (n, dof), along a motion."""
    x, v, a = (np.asarray(q) for q in (response.displacement, response.velocity, response.acceleration))
    return a @ _mass(ours).T + _restoring(ours, record, x, v)


def _mass(structure: Structure) -> np.ndarray:
    mass = np.asarray(structure.mass)
    return np.diag(mass) if mass.ndim == 1 else mass


def _restoring(structure: Structure, record: Record, x: States, v: States) -> States:
    """Force (n, dof) of springs, dashpots and laws along a motion."""
    plant = lower(structure)
    linear = x @ np.asarray(plant.stiffness).T + v @ np.asarray(plant.damping).T
    return linear + np.asarray(force_along(plant, jnp.asarray(x), jnp.asarray(v), jnp.asarray(record.time)))


def _readings(structure: Structure, made: Record, whole: Record, shown: Record) -> dict[tuple[str, int], np.ndarray]:
    """What the sensors of a structure would show of a run, in the channels of a record."""
    motion = {kind: np.zeros((len(whole), structure.dof)) for kind in ("displacement", "velocity", "acceleration")}
    for kind, j in shown.answers:
        offset = sum(float(s.value) for s in structure.sensors if isinstance(s, Offset) and s.at == (kind, j))
        motion[kind][:, j - 1] = _channel(made, whole, kind, j) + offset
    run = Response(
        time=np.asarray(whole.time),
        displacement=motion["displacement"],
        velocity=motion["velocity"],
        acceleration=motion["acceleration"],
        result=Result.successful,
        escape_time=None,
        solver="the simulation's own",
        _sensors=structure.sensors,
    )
    return run.readings(shown)


def _channel(made: Record, whole: Record, kind: str, j: int) -> np.ndarray:
    """A channel of a run, from its displacement where it does not show it."""
    if (kind, j) in made.channels:
        return np.asarray(made.channels[kind, j])
    if ("displacement", j) not in made.channels:
        raise NotRun(f"its run does not show {kind} {j}")
    v, a = _rates(whole, np.asarray(made.channels["displacement", j])[:, None])
    base = 0.0 if whole.base_acceleration is None else np.asarray(whole.base_acceleration)
    return v[:, 0] if kind == "velocity" else a[:, 0] + base


def _samples(whole: Record, part: HeldOut) -> np.ndarray:
    """Samples of a record, from its first one on, that were held out."""
    wanted = part.record.time[part.begin :]
    found = np.searchsorted(whole.time, wanted - whole.dt / 2)
    if found[-1] >= len(whole) or np.max(np.abs(whole.time[found] - wanted)) > 0.01 * whole.dt:
        raise NotRun("what was held out is on another clock")
    return found


def _gain(by_stand_in: Gain, squares: Sequence[Sequence[Mapping]], blocks: np.ndarray) -> Gain:
    """The gain with other errors before and after."""
    channels: dict[str, ChannelGain] = {}
    for name, one in by_stand_in.channels.items():
        kind, dof = name.rsplit(" ", 1)
        before, after = (
            math.sqrt(float(np.mean([each[i][kind, int(dof)] for each in squares if (kind, int(dof)) in each[i]])))
            for i in range(2)
        )
        channels[name] = replace(one, before=before, refitted=before, after=after, beyond_refit=False)
    total = {
        name: math.sqrt(float(np.mean([(getattr(c, name) / c.spread) ** 2 for c in channels.values()])))
        for name in ("before", "after")
    }
    spreads = np.array([c.spread for c in channels.values()])
    return replace(
        by_stand_in, **total, refitted=total["before"], channels=channels, beyond_refit=False,
        interval=interval_of(np.mean(blocks / spreads**2, -1), by_stand_in.floor, np.random.default_rng(0)),
    )  # fmt: skip
