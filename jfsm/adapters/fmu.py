"""Functional mock-up units (FMI 2.0, co-simulation) as simulations that can be run.

An FMU holds its inputs from one communication point to the next, so that it gets what they are in the middle of each
step; samples at the beginning would make every force half a step late. What it shows is put in time: some outputs
belong to the beginning of a step, and an acceleration that a force reaches at once belongs to the force that was held.
"""

import difflib
import hashlib
import io
import math
import pickle
import shutil
import subprocess
import sys
import tempfile
import weakref
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.interpolate import CubicSpline

from ..plant import Reconstruction, excitation
from ..records import Record, find_unit
from ..structures import Runs, Structure

Names = str | Sequence[str] | Mapping[int, str]
"""Names of variables as those of channels: one, several from degree of freedom 1 on, or by degree of freedom."""

_TINY = 1e-6
"""A step of next to nothing, in communication steps, after which outputs belong to the state as it is."""
_PROBES = 25
"""Instants of a run at which such a step is taken."""
_STALE = 1e-3
"""Change of an output in such a step, in its largest change in a whole one, from which it was late."""
_READ_BACK = 1e-9
"""Relative difference between a number that was set and the one that is read back that is rounding."""
_SAID = 500
"""Last letters of what an FMU said that are shown where it fails."""
_NO_DERIVATIVE = 0.05
"""Departure of an acceleration from the derivative of its motion, in its spread, from which it is another one's."""


def simulation(
    path: str | Path,
    *,
    force: Names | None = None,
    base_acceleration: str | None = None,
    given: Mapping[str, float | Callable[[Record], Any]] | None = None,
    displacement: Names | None = None,
    velocity: Names | None = None,
    acceleration: Names | None = None,
    extra: Mapping[tuple[int, int], str] | None = None,
    parameters: Mapping[str, float] | None = None,
    step: float | None = None,
    form: Structure | None = None,
) -> Runs:
    """A co-simulation FMU as a simulation that can be run, for `diagnose`.

    Parameters
    ----------
    path : path
        File of the FMU, of FMI 2.0.
    force, base_acceleration : names, optional
        Inputs that take the record's forces, and the acceleration of its base: ``force="F"``, ``{2: "F2"}``.
    given : mapping of input to number or function, optional
        Inputs that no channel holds: a number, or a function of the record that gives samples (n,), as
        ``{"road": lambda record: road(record.time)}``. All others stay as the FMU has them.
    displacement, velocity, acceleration : names, optional
        Outputs by degree of freedom, ``{1: "wheel.s", 2: "wheel.s + travel"}``; + adds outputs. They need not have been
        measured.
    extra : mapping of link to input, optional
        Inputs that take a force on a link, ``{(1, 2): "f_strut"}``, positive where it pushes degree of freedom 2 and
        pulls 1. What is found is then run in the FMU itself.
    parameters : mapping of name to number, optional
        Parameters and start values. They are read back, and it is an error if one did not go in.
    step : float, optional
        Communication step [s], at most; a sample has a whole number of them. By default the FMU's own.
    form : Structure, optional
        Masses and links that it has, whose values need not be right; see `jfsm.Simulation.from_runs`.

    Returns
    -------
    Runs

    Raises
    ------
    ImportError
        If fmpy is not installed.
    ValueError
        If the file is no co-simulation FMU of FMI 2.0, a name is none of its variables, or a unit is none of the kind;
        at a run, if a parameter does not go in, the FMU stops, or an output cannot be put in time.

    Examples
    --------
    >>> box = jfsm.adapters.fmu.simulation("device.fmu", force="F", displacement="x", extra={(0, 1): "F"})
    >>> d = jfsm.diagnose(record, box)
    """
    inputs = {("force", j): name for j, name in _numbered(force).items()}
    if base_acceleration is not None:
        inputs["base_acceleration", 0] = base_acceleration
    outputs = {
        (kind, j): name
        for kind, names in (("displacement", displacement), ("velocity", velocity), ("acceleration", acceleration))
        for j, name in _numbered(names).items()
    }
    box = _Box(Path(path), inputs, given or {}, outputs, extra or {}, parameters or {}, step)
    return Runs(box, box.places, form)


def _numbered(names: Names | None) -> dict[int, str]:
    """Names by degree of freedom."""
    if names is None:
        return {}
    if isinstance(names, Mapping):
        return dict(names)
    return dict(enumerate([names] if isinstance(names, str) else names, 1))


class _Input(NamedTuple):
    """What goes into an input: the channel, number, function or link, and how much of its unit is one of SI."""

    name: str
    of: Any
    scale: float


class _Output(NamedTuple):
    """Variables whose sum is a channel, with the size of their units."""

    channel: tuple[str, int]
    parts: tuple[tuple[str, float], ...]


class _Timing(NamedTuple):
    """Outputs that are a step `late`, how much of each input they let `through` at once, and whether they show the one
    that is held `now`, or that of the step before, where they are late."""

    late: Bool[np.ndarray, " outputs"]
    through: Float[np.ndarray, "outputs inputs"]
    now: Bool[np.ndarray, "outputs inputs"]


class _Box:
    """An FMU, unpacked, with what its variables stand for."""

    def __init__(
        self,
        path: Path,
        inputs: Mapping[tuple[str, int], str],
        given: Mapping[str, Any],
        outputs: Mapping[tuple[str, int], str],
        extra: Mapping[tuple[int, int], str],
        parameters: Mapping[str, float],
        step: float | None,
    ):
        if not path.is_file():
            raise ValueError(f"`path` must be the file of an FMU; there is no {path}.")
        self._path, self._fmpy = path, _package()
        self._described = _description(self._fmpy, path)
        self._known = {variable.name: variable for variable in self._described.modelVariables}
        self._inputs = [self._input(name, channel, channel[0]) for channel, name in inputs.items()]
        self._inputs += [self._input(name, of, None) for name, of in given.items()]
        self._extra = [self._input(name, link, "force") for link, name in extra.items()]
        self._outputs = [self._output(channel, text) for channel, text in outputs.items()]
        if not self._outputs:
            raise ValueError(
                f"`displacement`, `velocity` or `acceleration` must name an output of {path.name}: "
                f"{', '.join(self._of('output')) or 'it has none'}."
            )
        self._parameters = {self._variable(name, "parameters").name: value for name, value in parameters.items()}
        self._step = step
        self._timings: dict[float, _Timing] = {}

    def __repr__(self) -> str:
        return self._path.name

    __name__ = property(__repr__)

    @property
    def digest(self) -> bytes:
        """What it is made of: the file, and what its variables stand for."""
        sources = [one._replace(of="function") if callable(one.of) else one for one in (*self._inputs, *self._extra)]
        told = sources, self._outputs, self._parameters, self._step
        return hashlib.sha256(self._path.read_bytes() + repr(told).encode()).digest()

    @property
    def places(self) -> tuple[tuple[int, int], ...]:
        return tuple(one.of for one in self._extra)

    @cached_property
    def _unpacked(self) -> str:
        folder = tempfile.mkdtemp(prefix="jfsm-fmu-")
        weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
        self._fmpy.extract(str(self._path), unzipdir=folder)
        return folder

    # Names

    def _of(self, causality: str) -> list[str]:
        return [name for name, variable in self._known.items() if variable.causality == causality]

    def _variable(self, name: str, argument: str) -> Any:
        if name not in self._known:
            small = {known.lower(): known for known in self._known}
            near = [small[one] for one in difflib.get_close_matches(name.lower(), small, 3, 0.5)]
            meant = f"did you mean {' or '.join(near)}?" if near else f"it has {', '.join(list(self._known)[:20])}."
            raise ValueError(f"`{argument}` must name variables of {self._path.name}; {name!r} is none: {meant}")
        return self._known[name]

    def _input(self, name: str, of: Any, kind: str | None) -> _Input:
        argument = "given" if kind is None else "extra" if isinstance(of[0], int) else kind
        variable = self._variable(name, argument)
        if variable.causality != "input" or variable.type != "Real":
            raise ValueError(
                f"`{argument}` must name real inputs of {self._path.name}: {', '.join(self._of('input')) or 'none'}; "
                f"{name} is a {variable.type} {variable.causality}."
            )
        return _Input(name, of, 1.0 if kind is None else self._size(variable, kind))

    def _output(self, channel: tuple[str, int], text: str) -> _Output:
        names = [text] if text in self._known else [part.strip() for part in text.split("+")]
        variables = [self._variable(name, channel[0]) for name in names]
        return _Output(channel, tuple((one.name, self._size(one, channel[0])) for one in variables))

    def _size(self, variable: Any, kind: str) -> float:
        """How many of SI are one of the unit that the FMU states for a variable, which is to be of a kind."""
        unit = variable.unit or getattr(variable.declaredType, "unit", None)
        if not unit:
            return 1.0
        try:
            return find_unit(unit, kind).factor
        except ValueError as error:
            raise ValueError(f"`{kind}`: {variable.name} of {self._path.name} is in {unit}. {error}") from error

    # Runs

    def __call__(self, record: Record, extra: Mapping[tuple[int, int], Any] | None = None) -> Record:
        steps, h = self._steps(record)
        held, at_points = self._driven(record, extra, steps)
        timing = self._timings.get(h)
        if timing is None:
            timing = self._timings[h] = self._timing(held, at_points, float(record.time[0]), h)
        raw = self._run(held, at_points, float(record.time[0]), h)[0]
        moved = self._in_time(raw, timing, held, at_points)
        columns: dict[str, dict[int, np.ndarray]] = {}
        motion = {one.channel: moved[:, i] for i, one in enumerate(self._outputs)}
        self._prove(motion, record, h)
        for (kind, j), samples in motion.items():
            columns.setdefault(kind, {})[j] = samples[: steps * (len(record) - 1) + 1 : steps]
        units = {kind: record.units[kind] for kind in columns}
        made = Record(record.time, units=units, at_rest=record.at_rest, **columns)  # pyright: ignore[reportArgumentType]
        return made.noted(*self._notes(timing))

    def _steps(self, record: Record) -> tuple[int, float]:
        """Communication steps per sample, and their length [s]."""
        own = self._described.defaultExperiment
        stated = float(own.stepSize) if own is not None and own.stepSize else None
        wanted = self._step or stated or record.dt
        if not wanted > 0:
            raise ValueError(f"`step` must be a positive time in seconds; got {wanted}.")
        steps = max(1, math.ceil(record.dt / wanted - 1e-6))
        if stated is not None and not self._varies and abs(record.dt / steps - stated) > 1e-6 * stated:
            raise ValueError(
                f"{self._path.name} takes steps of {stated:g} s alone; the record's sample of {record.dt:g} s is no "
                "multiple of that. Bring the record to another rate: record.resample(rate)."
            )
        return steps, record.dt / steps

    @property
    def _varies(self) -> bool:
        return bool(self._described.coSimulation.canHandleVariableCommunicationStepSize)

    def _driven(self, record: Record, extra: Mapping[tuple[int, int], Any] | None, steps: int) -> tuple[Any, Any]:
        """Inputs (steps, inputs) as they are held, and (steps + 1, inputs) at the communication points."""
        named = {one.of for one in self._inputs}
        for channel in record.channels:
            if channel[0] == "force" and channel not in named and np.any(record.channels[channel]):
                raise ValueError(
                    f"`force` must say which input takes force {channel[1]} of the record: "
                    f"{', '.join(self._of('input')) or 'there is none'}."
                )
        smooth = [self._samples(one, record) / one.scale for one in self._inputs]
        forces = extra or {}
        added = [np.asarray(forces.get(one.of, np.zeros(len(record)))) / one.scale for one in self._extra]
        ways: list[tuple[list[np.ndarray], Reconstruction]] = [(smooth, "band-limited"), (added, "linear")]
        none = np.zeros(len(record))
        parts = [
            excitation(record, len(columns), steps, way, force=np.stack(columns, -1), base=none).force
            for columns, way in ways
            if columns
        ]
        each = np.concatenate([np.asarray(part) for part in parts], -1) if parts else np.zeros((len(record), 3, 0))
        both = each @ self._sums
        inside = both[: len(record) - 1]
        held = inside[:, 1::2].reshape(-1, both.shape[-1])
        points = np.concatenate([inside[:, :-1:2].reshape(-1, both.shape[-1]), inside[-1:, -1]])
        return held, points

    def _samples(self, one: _Input, record: Record) -> np.ndarray:
        """Samples (n,) that go into an input, in SI."""
        n = len(record)
        if callable(one.of):
            found = np.asarray(one.of(record), float)
            if found.shape != (n,) or not np.all(np.isfinite(found)):
                raise ValueError(
                    f"`given` must give finite samples ({n},) for {one.name}, one per instant; it gives {found.shape}."
                )
            return found
        if not isinstance(one.of, tuple):
            return np.full(n, float(one.of))
        samples = record.base_acceleration if one.of[0] == "base_acceleration" else record.channels.get(one.of)
        if samples is None:
            raise ValueError(f"The record must hold {one.of[0]} {one.of[1]}, which goes into {one.name}; it does not.")
        return np.asarray(samples)

    def _run(self, held: Any, points: Any, begin: float, h: float, probes: Sequence[int] = ()) -> tuple[Any, Any]:
        """Outputs (steps + 2, outputs) of a run at the communication points and one step beyond, for those that are
        late, and what is seen in steps of next to nothing after some (probes, inputs + 1, 2, outputs)."""
        names = [name for one in self._outputs for name, _ in one.parts]
        job = {
            "folder": self._unpacked,
            "guid": self._described.guid,
            "identifier": self._described.coSimulation.modelIdentifier,
            "parameters": [(name, *self._reference(name), value) for name, value in self._parameters.items()],
            "inputs": [self._known[name].valueReference for name in self._names],
            "outputs": [self._known[name].valueReference for name in names],
            "first": points[0],
            "held": np.concatenate([held, points[-1:]]),
            "begin": begin,
            "step": h,
            "tiny": _TINY * h if self._varies else 0.0,
            "probes": list(probes),
            "changes": self._spread(points),
        }
        found = self._done(job)
        for (name, value), is_now in zip(self._parameters.items(), found["stated"], strict=True):
            if not abs(is_now - value) <= _READ_BACK * max(abs(is_now), abs(value)):
                raise ValueError(
                    f"`parameters` must go into {self._path.name}; {name} was set to {value:g} and is {is_now:g}. It "
                    "takes parameters that are not fixed, and start values, before a run begins."
                )
        sums = np.zeros((len(names), len(self._outputs)))
        sizes = [(i, size) for i, one in enumerate(self._outputs) for _, size in one.parts]
        for row, (i, size) in zip(sums, sizes, strict=True):
            row[i] = size
        rows = found["rows"] @ sums
        if not np.all(np.isfinite(rows)):
            first = int(np.argmax(~np.all(np.isfinite(rows), axis=1)))
            raise ValueError(
                f"{self._path.name} must give finite outputs; from t = {begin + first * h:g} s on they are not. "
                "Check its start values, and try a smaller `step`."
            )
        return rows, found["seen"] @ sums if probes else found["seen"]

    def _reference(self, name: str) -> tuple[str, int]:
        return self._known[name].type, self._known[name].valueReference

    def _done(self, job: Mapping[str, Any]) -> dict[str, np.ndarray]:
        """What came of a run, which has a process to itself: an FMU may bring down the one that it is in."""
        script = str(Path(__file__).with_name("_fmu_run.py"))
        ran = subprocess.run([sys.executable, "-P", script], input=pickle.dumps(job), capture_output=True, check=False)
        said = ran.stderr.decode(errors="replace").strip()[-_SAID:]
        if ran.returncode or not ran.stdout:
            raise ValueError(
                f"{self._path.name} must come to the end of a run; it brought its process down (exit status "
                f"{ran.returncode}).{f' It says: {said}' if said else ''}"
            )
        with np.load(io.BytesIO(ran.stdout), allow_pickle=False) as archive:
            found = dict(archive)
        if "refused" in found:
            raise ValueError(f"{self._path.name} must {found['refused']}{f' It says: {said}' if said else ''}")
        return found

    @cached_property
    def _names(self) -> list[str]:
        """Inputs that something goes into, each once: forces of a channel and of a place may share one."""
        return list(dict.fromkeys(one.name for one in (*self._inputs, *self._extra)))

    @property
    def _sums(self) -> np.ndarray:
        """Which of the sources (rows) go into which input (columns)."""
        sources = [one.name for one in (*self._inputs, *self._extra)]
        return np.array([[source == name for name in self._names] for source in sources], float).reshape(
            len(sources), len(self._names)
        )

    @staticmethod
    def _spread(points: Any) -> np.ndarray:
        spread = np.std(points, axis=0)
        return np.where(spread > 0, spread, 1.0)

    # What belongs to which instant

    def _timing(self, held: Any, points: Any, begin: float, h: float) -> _Timing:
        """Which outputs are late, and what they show of the inputs at once, by steps of next to nothing."""
        inputs, outputs = points.shape[1], len(self._outputs)
        if not self._varies:
            return _Timing(np.zeros(outputs, bool), np.zeros((outputs, inputs)), np.ones((outputs, inputs), bool))
        at = np.unique(np.linspace(1, len(held), _PROBES + 2)[1:-1].astype(int)).tolist()
        rows, seen = self._run(held, points, begin, h, at)  # seen: instant, input, step of next to nothing, output
        most = np.max(np.abs(np.diff(rows, axis=0)), axis=0)
        late = np.max(np.abs(seen[:, 0, 1] - rows[at]), axis=0) > _STALE * np.maximum(most, 1e-300)
        first, second = (np.mean(seen[:, 1:, k] - seen[:, :1, 1], axis=0) for k in range(2))
        now = np.abs(first) > np.abs(second) / 2
        return _Timing(late, (second / self._spread(points)[:, None]).T, now.T)

    def _in_time(self, raw: Any, timing: _Timing, held: Any, points: Any) -> Float[np.ndarray, "steps outputs"]:
        """Outputs at the communication points, under what the inputs are then."""
        n = len(points)
        before, after = np.concatenate([points[:1], held]), np.concatenate([held, points[-1:]])
        moved = np.where(timing.late, np.concatenate([raw[:1], raw[2 : n + 1]]), raw[:n])
        shown = np.where(timing.late[:, None] & timing.now, after[:, None, :], before[:, None, :])
        shown[0] = points[0]
        return moved + np.sum(timing.through * (points[:, None, :] - shown), -1)

    def _prove(self, motion: Mapping[tuple[str, int], np.ndarray], record: Record, h: float) -> None:
        """Refuse an acceleration that is not that of the motion beside it, or that nothing puts in time."""
        for (kind, j), a in motion.items():
            if kind != "acceleration":
                continue
            beside = next((lower for lower in ("velocity", "displacement") if (lower, j) in motion), None)
            if beside is None and not self._varies:
                raise ValueError(
                    f"`acceleration` must have a `displacement` or `velocity` beside it at degree of freedom {j}: "
                    f"{self._path.name} takes no steps of another length, so that nothing else tells to which instant "
                    "it belongs."
                )
            if beside is not None:
                _prove_derivative(a, motion[beside, j], beside, j, record, h)

    def _notes(self, timing: _Timing) -> list[str]:
        pairs = zip(self._outputs, timing.late, strict=True)
        late = [f"{one.channel[0]} {one.channel[1]}" for one, is_late in pairs if is_late]
        said = list[str]()
        free = [name for name in self._of("input") if name not in self._names]
        if not self._varies:
            said.append(
                f"{self._path.name} takes steps of one length: whether its outputs belong to the end of a step cannot "
                "be seen."
            )
        if late:
            said.append(f"{self._path.name} shows {', '.join(late)} as of the beginning of a step; it was put in time.")
        if free:
            said.append(f"Inputs of {self._path.name} that nothing was said of stay as it has them: {', '.join(free)}.")
        return said


def _prove_derivative(a: np.ndarray, moved: np.ndarray, beside: str, j: int, record: Record, h: float) -> None:
    """Refuse an acceleration that is not the derivative of a displacement or velocity, at the communication points."""
    time = h * np.arange(len(a))
    relative = CubicSpline(time, moved)(time, 2 if beside == "displacement" else 1)
    base = record.base_acceleration
    expected = relative + (0.0 if base is None else CubicSpline(record.time - record.time[0], base)(time))
    now, later = a[2:-2] - expected[2:-2], a[3:-1] - expected[2:-2]
    allowed = _NO_DERIVATIVE * max(np.std(relative[2:-2]), np.std(expected[2:-2]))
    if np.std(now) > allowed:
        why = "it is a step late" if np.std(later) < np.std(now) / 2 else "it is that of another motion"
        raise ValueError(
            f"`acceleration` of degree of freedom {j} must be the derivative of its {beside}; {why}. Leave it out, and "
            f"compare the {beside}."
        )


def _package() -> Any:
    try:
        import fmpy
    except ImportError as error:
        raise ImportError("fmpy is needed to run FMUs: pip install jfsm[fmu]") from error
    return fmpy


def _description(fmpy: Any, path: Path) -> Any:
    """What an FMU says of itself, if it can be co-simulated here."""
    try:
        found = fmpy.read_model_description(str(path), validate=False)
    except Exception as error:
        raise ValueError(f"`path` must be the file of an FMU; {path} is none: {error}") from error
    if found.fmiVersion != "2.0" or found.coSimulation is None:
        kind = "co-simulation" if found.coSimulation is not None else "model exchange"
        raise ValueError(
            f"`path` must be an FMU for co-simulation of FMI 2.0; {path.name} is one for {kind} of FMI "
            f"{found.fmiVersion}. Export it again for co-simulation, version 2.0."
        )
    return found
