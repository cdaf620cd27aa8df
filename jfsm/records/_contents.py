"""A record from the contents of a file, and as such: which of the arrays is what."""

import contextlib
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from jfsm.records._abstract_record import AbstractRecord, AnyRecord, Drive
from jfsm.records._channels import require_mapping
from jfsm.records._repeats import repetition
from jfsm.records._units import KINDS, find_sensitivity, find_unit
from jfsm.records.formats.base import Contents, point_name
from jfsm.records.formats.clocks import Clock, clock_of
from jfsm.records.formats.lookup import (
    ChannelName,
    Choice,
    choose,
    dofs_of_points,
    listed,
    own_names,
    samples_of,
)
from jfsm.records.formats.runs import Run, run_of_clock
from jfsm.records.formats.ticks import beginnings


def contents_of(record: AbstractRecord) -> Contents:
    """The record as named columns: ``time``, ``displacement_1``, ``base_acceleration``."""
    arrays: dict[str, Any] = {"time": record.time}
    units = {"time": "s"}
    for (kind, dof), samples in record.channels.items():
        arrays[f"{kind}_{dof}"] = samples
        units[f"{kind}_{dof}"] = record.units[kind]
    if record.base_acceleration is not None:
        arrays["base_acceleration"] = np.asarray(record.base_acceleration)
        units["base_acceleration"] = record.units["base_acceleration"]
    about = {
        "at_rest": record.at_rest,
        "drive": record.drive,
        "name": record.name,
        "notes": list(record._notes),
    }
    if record.begins is not None:
        about["begins"] = str(record.begins)
    return Contents(arrays, units, about)


@dataclass(frozen=True, kw_only=True)
class Asked:
    """What a caller says of the channels of a file: arguments of `read`, under their names there.

    `wanted` holds the names of each kind of channel, in their order.
    """

    wanted: Sequence[ChannelName]
    units: Mapping[str, str] | None = None
    sensitivity: Mapping[str, str] | None = None
    time: str | None = None
    rate: float | None = None
    run: Run = None
    at_rest: bool | None = None
    drive: Drive | None = None
    name: str | None = None


def record_of(
    make: type[AnyRecord], contents: Contents, source: str, asked: Asked, default_name: str | None = None
) -> AnyRecord:
    """A `make`, the class of the record, from contents that messages call `source`.

    Errors are those of `read`.
    """
    _require_words(asked)
    chosen = {kind: _by_dof(contents, source, kind, names) for kind, names in _names(contents, source, asked).items()}
    every = [choice for choices in chosen.values() for choice in choices.values()]
    units, sensitivity = asked.units or {}, asked.sensitivity or {}
    clock = clock_of(contents, source, every, asked.time, asked.rate, units)
    _require_read("units", units, [*every, *clock.columns])
    _require_read("sensitivity", sensitivity, every)
    scales = {choice: _scale(contents, source, choice, units, sensitivity) for choice in every}
    part, told = _part(source, clock, asked.run)
    record = make(
        clock.seconds[part],
        **{kind: _samples(contents, source, choices, clock, scales, part) for kind, choices in chosen.items()},
        units=_one_for_each_kind(source, {choice: scale.unit for choice, scale in scales.items()}),
        **_of_the_whole(contents, asked, default_name),
    )
    notes = [*contents.about.get("notes", ()), *contents.notes, *clock.notes, *_of_the_start(clock), *told]
    notes += _of_units(scales, record.units, said=not contents.about)
    notes += _held(source, {choice.name: samples_of(contents, source, choice) for choice in every})
    if contents.points and not contents.about and not any(asked.wanted):
        notes.append(_of_the_points(contents))
    begins = contents.about.get("begins") if clock.begins is None else str(clock.begins)
    return record.dated(begins).noted(*notes)


def _names(contents: Contents, source: str, asked: Asked) -> Mapping[str, ChannelName]:
    """Names of channels by kind: those that are asked for, else those that the file says the kind of."""
    named = {kind: names for kind, names in zip(KINDS, asked.wanted, strict=True) if names is not None}
    return named or own_names(contents, source)


def _of_the_whole(contents: Contents, asked: Asked, default_name: str | None) -> dict[str, Any]:
    """What is to be known of the record as a whole: as the caller says, else as the file does."""
    about = contents.about
    return {
        "at_rest": about.get("at_rest", False) if asked.at_rest is None else asked.at_rest,
        "drive": asked.drive or about.get("drive", "force"),
        "name": about.get("name", default_name) if asked.name is None else asked.name,
    }


def _of_the_start(clock: Clock) -> Iterator[str]:
    if clock.begins is not None:
        yield f"The clock reads zero at {str(clock.begins).replace('T', ' ')}."


def _of_the_points(contents: Contents) -> str:
    numbered = (f"{dof} is {point_name(*point)}" for point, dof in dofs_of_points(contents).items())
    return f"Degrees of freedom by node and direction: {', '.join(numbered)}."


class _Scale(NamedTuple):
    """The unit of a channel, None if nothing says it, and what its numbers are to be multiplied by before."""

    unit: str | None
    factor: float | None = None
    from_name: bool = False


def _scale(
    contents: Contents, source: str, choice: Choice, units: Mapping[str, str], sensitivity: Mapping[str, str]
) -> _Scale:
    """What the caller, the file and the name say of the unit of a channel, in this order."""
    stated, from_name = _unit(contents, source, choice, units), False
    if stated is None:
        stated = _unit_in_name(choice)
        from_name = stated is not None
    given = _said(sensitivity, choice)
    if given is None:
        return _Scale(stated, None, from_name)
    sensor = find_sensitivity(given, choice.name, choice.kind)
    written, reading = find_unit(stated or sensor.reading, choice.kind), find_unit(sensor.reading, choice.kind)
    _require_raw(choice, stated, written.coherent, reading.coherent)
    return _Scale(sensor.unit, written.factor / (sensor.size * reading.factor), from_name)


def _of_units(scales: Mapping[Choice, _Scale], units: Mapping[str, str], said: bool) -> Iterator[str]:
    """What units were taken from names, and, unless the file tells of itself, from nowhere."""
    for choice, scale in scales.items():
        if scale.from_name:
            yield f"{choice.array!r} is taken to be in {scale.unit}, by its name; units= says otherwise."
    assumed = [choice for choice, scale in scales.items() if scale.unit is None]
    if assumed and said:
        yield _assumed(assumed, units)


def _part(source: str, clock: Clock, run: Run) -> tuple[slice, list[str]]:
    """The samples of the run that is asked for, and what to say of it."""
    begun = beginnings(clock.seconds)
    if begun.size == 1 and run is None:
        return slice(None), []
    part = run_of_clock(source, clock.seconds, begun.tolist(), run)
    if part == slice(None):
        return part, []
    number = begun.tolist().index(part.start) + 1
    return part, [f"Run {number} of {begun.size} that follow one another in {source}."]


def _samples(
    contents: Contents,
    source: str,
    choices: Mapping[int | None, Choice],
    clock: Clock,
    scales: Mapping[Choice, _Scale],
    part: slice,
) -> Any:
    """The channels of one kind by dof, or all of them in one array, over one run."""
    arrays: dict[int | None, Any] = {}
    for dof, choice in choices.items():
        samples, factor = clock.of_samples(samples_of(contents, source, choice)), scales[choice].factor
        samples = samples if factor is None else samples * factor
        arrays[dof] = samples[part] if np.shape(samples)[:1] == clock.seconds.shape else samples
    return arrays[None] if None in arrays else arrays


def _assumed(choices: Sequence[Choice], units: Mapping[str, str]) -> str:
    """What units channels are taken to be in."""
    said = ", ".join(f"{choice.name!r} is taken to be in {units[choice.kind]}" for choice in choices[:6])
    return f"Units are not stated: {said}{f', and {len(choices) - 6} more' if len(choices) > 6 else ''}."


def _held(source: str, samples: Mapping[str, Any]) -> list[str]:
    """Columns that hold each value for several rows, where others do not."""
    columns = {
        name: np.asarray(column) for name, column in samples.items() if column.ndim == 1 and column.dtype.kind in "iuf"
    }
    moves = {name: np.count_nonzero(column[1:] != column[:-1]) for name, column in columns.items()}
    lengths = {
        name: repetition(column) if len(columns) > 1 and moves[name] < 0.6 * column.size else 1
        for name, column in columns.items()
    }
    if len(set(lengths.values())) < 2:
        return []
    return [
        f"{name!r} holds every value for {length} samples: it was sampled more slowly than the others."
        for name, length in lengths.items()
        if length > 1
    ]


def _require_words(asked: Asked) -> None:
    """Refuse what is no name where one is asked for."""
    require_mapping("units", asked.units, "{'F': 'kN'}")
    require_mapping("sensitivity", asked.sensitivity, "{'a1': '100 mV/g'}")
    for name, given in (("time", asked.time), ("base_acceleration", asked.wanted[-1])):
        if given is not None and not isinstance(given, str):
            raise TypeError(f"`{name}` must be the name of a channel; got {given!r}.")


def _by_dof(contents: Contents, source: str, kind: str, names: ChannelName) -> dict[int | None, Choice]:
    """What was asked for by dof, under None where one name stands for all of a kind."""
    by_dof: Mapping[Any, str]
    given = [names] if isinstance(names, str) else names.values() if isinstance(names, Mapping) else names
    listed = isinstance(given, Iterable) and not hasattr(given, "dtype") and all(isinstance(n, str) for n in given)
    if given is not None and not listed:
        raise TypeError(f"`{kind}` must be the name of a channel, a list of names, or names by dof; got {names!r}.")
    if isinstance(names, str):
        by_dof = {None: names}
    elif isinstance(names, Mapping):
        by_dof = names
    else:
        by_dof = dict(enumerate(names or (), start=1))
    return {dof: choose(contents, source, kind, name) for dof, name in by_dof.items()}


def _said(by_name: Mapping[str, str], choice: Choice) -> str | None:
    """What a mapping says of a channel: by the caller's name, the file's, or the kind."""
    return next((by_name[key] for key in (choice.name, choice.array, choice.kind) if key in by_name), None)


def _require_read(argument: str, by_name: Mapping[str, str], used: Sequence[Choice]) -> None:
    known = dict.fromkeys(key for choice in used for key in (choice.name, choice.array, choice.kind))
    for key in by_name:
        if key not in known:
            raise ValueError(
                f"`{argument}` must name channels that are read, one of {listed(known)}; it names {key!r}. "
                f"Use the name that the channel has in the file."
            )


def _require_raw(choice: Choice, unit: str | None, written: str, reading: str) -> None:
    if written != reading:
        raise ValueError(
            f"`sensitivity` of {choice.name} must be given for numbers in {reading}; they are in {unit}. Leave the "
            f"sensitivity out, or correct the unit by units={{{choice.name!r}: {reading!r}}}."
        )


def _unit(contents: Contents, source: str, choice: Choice, units: Mapping[str, str]) -> str | None:
    """Unit of a channel, from what the caller says and else from what the file states."""
    given = _said(units, choice)
    of_column = None if choice.column is None else contents.units.get(f"{choice.array}[{choice.column}]")
    stated = of_column or contents.units.get(choice.array)
    if given is not None or stated is None:
        return given
    try:
        find_unit(stated, choice.kind)
    except ValueError as error:
        raise ValueError(
            f"{source} must state a unit of {choice.kind} for {choice.name!r}; it states {stated!r}. Say which is "
            f"meant by units={{{choice.name!r}: ...}}, or read the channel as what it is."
        ) from error
    return stated


_IN_NAME = re.compile(r"[_\s.-](?P<unit>[A-Za-zµ°]{2,}(?:[_/]?s(?:ec)?[\^]?2?)?)$")
_WORDS = ("in", "min", "rad", "amp", "px", "as", "dm")  # rather words than units at the end of a name


def _unit_in_name(choice: Choice) -> str | None:
    """The unit that ends a channel's name, as of ``force_kN`` and ``x_mm``, if it is one of its kind."""
    match = _IN_NAME.search(choice.array)
    if match is None or match["unit"].lower() in _WORDS:
        return None
    for unit in (match["unit"], match["unit"].replace("_", "/")):
        with contextlib.suppress(ValueError):
            find_unit(unit, choice.kind)
            return unit
    return None


def _one_for_each_kind(source: str, stated: Mapping[Choice, str | None]) -> dict[str, str]:
    result: dict[str, str] = {}
    for kind in dict.fromkeys(choice.kind for choice in stated):
        of_kind = {choice.name: unit for choice, unit in stated.items() if choice.kind == kind}
        if len(set(of_kind.values())) > 1:
            raise ValueError(
                f"`units` must be the same for all channels of a kind; those of {kind} are {of_kind} in "
                f"{source}. Convert one, or read them into two records."
            )
        unit = next(iter(of_kind.values()))
        if unit is not None:
            result[kind] = unit
    return result
