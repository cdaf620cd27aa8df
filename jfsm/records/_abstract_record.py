"""The clock of a record, what was read at each instant, and cuts and changes of both."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jfsm.records._advance import advanced
from jfsm.records._channels import (
    Columns,
    as_columns,
    as_instant,
    as_single,
    as_time,
    frozen,
    require_mapping,
)
from jfsm.records._resample import long_gaps, resampled
from jfsm.records._units import KINDS, coherent_units, find_unit

Channel = NDArray[np.float64]
Lost = NDArray[np.bool_]
ChannelArgument = ArrayLike | Mapping[int, ArrayLike] | None
Drive = Literal["force", "motion"]

UNEVEN = 0.05  # relative deviation of a step from the mean step up to which a clock counts as uniform
NOTED = 1e-4  # above this the deviation is mentioned


class AbstractRecord:
    """The measured data of one run, apart from its inspection and its files. Immutable.

    Functions that read a record take this class; `Record` adds them as methods. Parameters and errors are those of
    `Record`.
    """

    def __init__(
        self,
        time: ArrayLike,
        force: ChannelArgument = None,
        displacement: ChannelArgument = None,
        velocity: ChannelArgument = None,
        acceleration: ChannelArgument = None,
        base_acceleration: ArrayLike | None = None,
        *,
        units: Mapping[str, str] | None = None,
        at_rest: bool = False,
        drive: Drive = "force",
        name: str | None = None,
    ):
        if not isinstance(drive, str) or drive not in ("force", "motion"):
            raise ValueError(f'`drive` must be "force" or "motion"; it was {drive!r}. Say which of them is imposed.')
        require_mapping("units", units, "{'force': 'kN'}")
        for kind in units or {}:
            if kind not in ("time", *KINDS):
                raise ValueError(f"`units` must be given by kind, one of time, {', '.join(KINDS)}; it names {kind!r}.")
        stated = {kind: find_unit(unit, kind) for kind, unit in (units or {}).items()}
        factors = {kind: unit.factor for kind, unit in stated.items()}
        self._time = as_time(time, factors.pop("time", 1.0))
        stated.pop("time", None)
        self._units = dict(coherent_units(stated))
        self._written = {kind: str((units or {})[kind]) for kind in stated}
        given = {"force": force, "displacement": displacement, "velocity": velocity, "acceleration": acceleration}
        self._columns: dict[str, Columns] = {
            kind: as_columns(kind, samples, self._time, factors.get(kind, 1.0))
            for kind, samples in given.items()
            if samples is not None
        }
        self._base_acceleration: Channel | None = None
        if base_acceleration is not None:
            factor = factors.get("base_acceleration", 1.0)
            self._base_acceleration = as_single("base_acceleration", base_acceleration, self._time, factor)
        if not isinstance(at_rest, bool | np.bool_):
            raise TypeError(f"`at_rest` must be True or False; it was {at_rest!r}.")
        if name is not None and not isinstance(name, str):
            raise TypeError(f"`name` must be a text; it was {name!r}.")
        self._at_rest = bool(at_rest)
        self._drive: Drive = drive
        self._name = name
        self._begins: np.datetime64 | None = None
        self._notes: tuple[str, ...] = ()
        self._lost: dict[tuple[str, int], Lost] = {}

    @property
    def time(self) -> Channel:
        """(n,) instants [s] on the record's own clock."""
        return self._time

    @property
    def force(self) -> Channel | None:
        """(n, measured dofs) applied force, or None."""
        return self._samples("force")

    @property
    def displacement(self) -> Channel | None:
        """(n, measured dofs) displacement, or None."""
        return self._samples("displacement")

    @property
    def velocity(self) -> Channel | None:
        """(n, measured dofs) velocity, or None."""
        return self._samples("velocity")

    @property
    def acceleration(self) -> Channel | None:
        """(n, measured dofs) acceleration, or None."""
        return self._samples("acceleration")

    @property
    def base_acceleration(self) -> Channel | None:
        """(n,) absolute acceleration of the base, or None."""
        return self._base_acceleration

    @property
    def channels(self) -> Mapping[tuple[str, int], Channel]:
        """Every channel by (kind, dof): force, displacement, velocity, acceleration, each by ascending dof."""
        return MappingProxyType(
            {
                (kind, dof): samples[:, place]
                for kind, (dofs, samples) in self._columns.items()
                for place, dof in enumerate(dofs)
            }
        )

    @property
    def responses(self) -> Mapping[tuple[str, int], Channel]:
        """The channels that are not forces."""
        return MappingProxyType({key: samples for key, samples in self.channels.items() if key[0] != "force"})

    @property
    def answers(self) -> Mapping[tuple[str, int], Channel]:
        """The channels that a simulation has to predict: the responses, or the forces where the motion drives."""
        if self._drive == "force":
            return self.responses
        return MappingProxyType({key: samples for key, samples in self.channels.items() if key[0] == "force"})

    @property
    def units(self) -> Mapping[str, str]:
        """Unit of each kind of channel, also of kinds that were not measured."""
        return MappingProxyType(self._units)

    @property
    def stated(self) -> frozenset[str]:
        """Kinds of channel whose unit was stated; that of the others was assumed."""
        return frozenset(self._written)

    @property
    def written(self) -> Mapping[str, str]:
        """The unit in which the numbers of each kind of channel came, where one was stated: what `units` says is SI."""
        return MappingProxyType(self._written)

    @property
    def dofs(self) -> int:
        """Highest dof that a channel mentions, 0 without channels."""
        return max((dofs[-1] for dofs, _ in self._columns.values()), default=0)

    @property
    def at_rest(self) -> bool:
        """Whether the structure is known to be at rest at the first sample."""
        return self._at_rest

    @property
    def drive(self) -> Drive:
        """What is imposed: "force" or "motion"."""
        return self._drive

    @property
    def driven(self) -> bool:
        """Whether a force, a moving base or an imposed motion drives the structure; it was released otherwise."""
        forces = (y for (kind, _), y in self.channels.items() if kind == "force")
        return self.drive == "motion" or self.base_acceleration is not None or any(np.any(y) for y in forces)

    @property
    def name(self) -> str | None:
        """What the record is called in a report."""
        return self._name

    @property
    def notes(self) -> tuple[str, ...]:
        """What was done to the record or assumed of it, one sentence each."""
        jitter = self._jitter
        if not NOTED < jitter <= UNEVEN:
            return self._notes
        return (*self._notes, f"Time steps differ by up to {jitter:.2%}; they are treated as uniform.")

    @property
    def lost(self) -> Mapping[tuple[str, int], Lost]:
        """(n,) samples that are no readings, by channel (kind, dof); channels without any are left out.

        Those that a mended record bridges; `inspect` names what else may be none.
        """
        return MappingProxyType(self._lost)

    @property
    def begins(self) -> np.datetime64 | None:
        """When the clock reads zero, in UTC or in local time as its recorder has it; None if unknown."""
        return self._begins

    @property
    def dt(self) -> float:
        """Sampling interval [s].

        Raises
        ------
        ValueError
            If steps differ from their mean by more than 5 %.
        """
        mean = self.duration / (len(self) - 1)
        if self._jitter > UNEVEN:
            steps = np.diff(self._time)
            raise ValueError(
                f"`time` must have uniform steps (to {UNEVEN:.0%}); they lie between {steps.min():.6g} and "
                f"{steps.max():.6g} s, {mean:.6g} s on average. Make them so first: "
                f"record.resample({1 / float(np.median(steps)):.6g})."
            )
        return mean

    @property
    def sample_rate(self) -> float:
        """Samples per second [Hz]; errors as `dt`."""
        return 1.0 / self.dt

    @property
    def duration(self) -> float:
        """Time from the first sample to the last [s]."""
        return float(self._time[-1] - self._time[0])

    def __len__(self) -> int:
        return self._time.size

    def __repr__(self) -> str:
        measured = ", ".join(f"{kind} {dof}" for kind, dof in self.channels) or "no channel"
        title = f" {self._name!r}" if self._name else ""
        return f"<Record{title}: {len(self)} samples over {self.duration:.6g} s; {measured}>"

    def __getitem__(self, samples: slice) -> Self:
        """The samples of a slice on the same clock, with a note of what was cut off.

        `at_rest` is kept only by a slice that begins at sample 0.

        Raises
        ------
        TypeError
            If `samples` is not a slice.
        ValueError
            If its step is not 1, or fewer than two samples remain.
        """
        if not isinstance(samples, slice):
            raise TypeError(
                f"A record is sliced, record[a:b]; the index was {samples!r}. For values use record.channels."
            )
        start, stop, step = samples.indices(len(self))
        if step != 1:
            raise ValueError(
                f"A record is sliced with step 1; it was {step}. To lower the rate: record.resample(rate)."
            )
        if stop - start < 2:
            raise ValueError(
                f"A slice must keep at least 2 of the {len(self)} samples; record[{start}:{stop}] does not."
            )
        columns = {kind: (dofs, values[start:stop]) for kind, (dofs, values) in self._columns.items()}
        base = None if self._base_acceleration is None else self._base_acceleration[start:stop]
        time = self._time[start:stop]
        part = self._with(time, columns, base, at_rest=self._at_rest and start == 0)
        part._lost = _where_any({key: lost[start:stop] for key, lost in self._lost.items()})
        if len(part) == len(self):
            return part
        return part.noted(
            f"Samples {start} to {stop - 1} of {len(self)} are kept, t = {time[0]:.6g} to {time[-1]:.6g} s."
        )

    def until(self, time: float) -> Self:
        """The part up to and including this instant [s]; notes and errors as of a slice."""
        return self[: int(np.searchsorted(self._time, as_instant("time", time), side="right"))]

    def since(self, time: float) -> Self:
        """The part from this instant [s] on, itself included; notes and errors as of a slice."""
        return self[int(np.searchsorted(self._time, as_instant("time", time), side="left")) :]

    def between(self, since: float | None = None, until: float | None = None) -> Self:
        """The part from one instant [s] to another, both included, or from the beginning, or to the end.

        Raises
        ------
        ValueError
            If fewer than two samples lie between them.
        """
        if since is None and until is None:
            return self
        first = 0 if since is None else int(np.searchsorted(self._time, as_instant("since", since), side="left"))
        last = (
            len(self) if until is None else int(np.searchsorted(self._time, as_instant("until", until), side="right"))
        )
        if last - first < 2:
            raise ValueError(
                f"`since` and `until` must keep at least 2 samples of a record from {self._time[0]:.6g} to "
                f"{self._time[-1]:.6g} s; they were {since} and {until}. Give instants of its own clock, in seconds."
            )
        return self[first:last]

    def shifted(self, seconds: float) -> Self:
        """The same samples on a clock that reads so many seconds [s] more, or less if negative, with a note.

        For a channel that came late by a known time, ``shifted(-late)``, and for a recorder whose clock began anew.

        Raises
        ------
        ValueError
            If `seconds` is not finite.
        """
        if not np.isfinite(as_instant("seconds", seconds)):
            raise ValueError(f"`seconds` must be a finite time; it was {seconds}. Pass seconds, as 0.0125.")
        other = self._with(frozen(self._time + seconds), self._columns, self._base_acceleration, at_rest=self._at_rest)
        return other.noted(f"The clock was put {'forward' if seconds >= 0 else 'back'} by {abs(seconds):.9g} s.")

    def dated(self, begins: np.datetime64 | str | None) -> Self:
        """The same record, whose clock reads zero at this date, ``"2024-03-05T14:30:00.005"``, or at no known one.

        `jfsm.align` and `jfsm.join` put clocks together by these instants where all records have one.

        Raises
        ------
        ValueError
            If `begins` is no date.
        """
        try:
            instant = None if begins is None else np.datetime64(str(begins), "ns")
        except ValueError as error:
            raise ValueError(f"`begins` must be a date, as 2024-03-05T14:30:00; it was {begins!r}.") from error
        other = self._with(self._time, self._columns, self._base_acceleration, at_rest=self._at_rest)
        other._begins = instant
        return other

    def aligned(self, late: Mapping[tuple[str, int], float]) -> Self:
        """The record with channels put right that are late by a known time, with a note.

        Between samples a channel is band-limited. Samples that are clipped or torn stay as they are.

        Parameters
        ----------
        late : mapping of (kind, dof) to a time
            How late these channels are [s]; negative where they are early.

        Raises
        ------
        ValueError
            If the record has no such channel, a time is not finite or not shorter than the record, or time is uneven.
        """
        columns = {kind: (dofs, values.copy()) for kind, (dofs, values) in self._columns.items()}
        for channel, seconds in late.items():
            if channel not in self.channels:
                raise ValueError(f"`late` names {channel}; the record has {', '.join(map(str, self.channels))}.")
            if not abs(seconds) < self.duration:
                raise ValueError(
                    f"`late` must be shorter than the record of {self.duration:.6g} s; for {channel} it was {seconds}."
                )
            kind, j = channel
            dofs, values = columns[kind]
            values[:, list(dofs).index(j)] = advanced(self.channels[channel], seconds / self.dt, self.dt)
        columns = {kind: (dofs, frozen(values)) for kind, (dofs, values) in columns.items()}
        other = self._with(self._time, columns, self._base_acceleration, at_rest=self._at_rest)
        return other.noted(*(f"{kind} {j} is read {seconds:.4g} s later." for (kind, j), seconds in late.items()))

    def resample(self, rate: float) -> Self:
        """The record on a uniform clock of `rate` samples per second [Hz], without aliasing.

        The clock begins at the first instant. Uneven samples are first interpolated by a cubic spline; then every
        channel passes the same linear-phase filter, so their timing relative to each other is kept. Within gaps of more
        than two samples nothing is known: samples there are in `lost` and take no part in a fit.

        Raises
        ------
        ValueError
            If `rate` is not positive, or leaves fewer than two samples.
        """
        other, note = self._resampled(as_instant("rate", rate))
        return other.noted(note)

    def noted(self, *notes: str) -> Self:
        """The same record with further notes; those it has are not repeated."""
        other = self._with(self._time, self._columns, self._base_acceleration, at_rest=self._at_rest)
        other._notes = tuple(dict.fromkeys((*self._notes, *notes)))
        return other

    def with_lost(
        self,
        bridged: Mapping[tuple[str, int], Channel],
        lost: Mapping[tuple[str, int], Lost],
        base: Channel | None = None,
    ) -> Self:
        """The same record, these channels `bridged` where samples are `lost`, which take no part in any fit."""
        channels = self.channels
        columns = {
            kind: (dofs, frozen(np.array([bridged.get((kind, j), channels[kind, j]) for j in dofs]).T))
            for kind, (dofs, _) in self._columns.items()
        }
        other = self._with(
            self._time, columns, self._base_acceleration if base is None else base, at_rest=self._at_rest
        )
        other._lost = _where_any({**self._lost, **lost})
        return other

    def turned(self, channel: tuple[str, int]) -> Self:
        """The record with the sign of one channel (kind, dof) turned, with a note.

        Raises
        ------
        ValueError
            If the record has no such channel.
        """
        if channel not in self.channels:
            raise ValueError(f"`channel` names {channel}; the record has {', '.join(map(str, self.channels))}.")
        other = self.with_lost({channel: -self.channels[channel]}, {})
        return other.noted(f"The sign of {channel[0]} {channel[1]} was turned.")

    def _samples(self, kind: str) -> Channel | None:
        return self._columns[kind][1] if kind in self._columns else None

    @property
    def _jitter(self) -> float:
        """Largest relative deviation of a step from the mean step."""
        mean = self.duration / (len(self) - 1)
        return float(np.max(np.abs(np.diff(self._time) / mean - 1.0)))

    def _resampled(self, rate: float, span: tuple[float, float] | None = None) -> tuple[Self, str]:
        """The record at `rate` [Hz] over a span of time [s], by default its own, and the note that goes with it."""
        blocks = [values for _, values in self._columns.values()]
        if self._base_acceleration is not None:
            blocks.append(self._base_acceleration[:, None])
        together = np.concatenate(blocks, axis=1) if blocks else np.empty((len(self), 0))
        time, values, note = resampled(self._time, together, rate, self._jitter > UNEVEN, span)
        parts = np.split(values, np.cumsum([block.shape[1] for block in blocks])[:-1], axis=1) if blocks else []
        columns = {
            kind: (dofs, frozen(np.asfortranarray(part)))
            for (kind, (dofs, _)), part in zip(self._columns.items(), parts, strict=False)
        }
        base = None if self._base_acceleration is None else frozen(parts[-1][:, 0].copy())
        other = self.noted(*self.notes)._with(frozen(time), columns, base, at_rest=self._at_rest)
        nearest = np.clip(np.searchsorted(self._time, time), 0, len(self) - 1)
        beside = np.maximum(nearest - 1, 0)
        unknown, words = self._unknown(time)
        nothing = np.zeros(len(self), dtype=bool)
        lost = {key: self._lost.get(key, nothing) for key in self.channels}
        other._lost = _where_any({key: frozen(mask[nearest] | mask[beside] | unknown) for key, mask in lost.items()})
        return other, note + words

    def _unknown(self, time: Channel) -> tuple[Lost, str]:
        """Which instants of another clock lie in long gaps of this one, and what to say of them."""
        gaps = long_gaps(self._time) if self._jitter > UNEVEN else []
        unknown = np.zeros(time.size, dtype=bool)
        for before, after in gaps:
            unknown |= (time > before) & (time < after)
        if not np.any(unknown):
            return unknown, ""
        several, total = "s" if len(gaps) > 1 else "", sum(after - before for before, after in gaps)
        forces = " The force is not known there either." if "force" in self._columns else ""
        return unknown, (
            f" Within {len(gaps)} gap{several} of more than two samples, {total:.6g} s in all, the first from "
            f"t = {gaps[0][0]:.6g} s on, {int(unknown.sum())} samples are not known; they take no part in a "
            f"fit.{forces}"
        )

    def _with(self, time: Channel, columns: dict[str, Columns], base: Channel | None, at_rest: bool) -> Self:
        """The same test with other samples, which are trusted."""
        other = object.__new__(type(self))
        other.__dict__.update(self.__dict__)
        other._time, other._columns, other._base_acceleration, other._at_rest = time, columns, base, at_rest
        other._lost = self._lost if time.size == self._time.size else {}
        return other


def _where_any(lost: Mapping[tuple[str, int], Lost]) -> dict[tuple[str, int], Lost]:
    return {key: mask for key, mask in lost.items() if np.any(mask)}


AnyRecord = TypeVar("AnyRecord", bound=AbstractRecord)
