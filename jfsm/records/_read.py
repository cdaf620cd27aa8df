"""A record from a file: which of its arrays is what."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from jfsm.records._record import Drive, Record
from jfsm.records._units import KINDS, find_sensitivity, find_unit
from jfsm.records.formats import Contents, format_of
from jfsm.records.formats.base import point_name
from jfsm.records.formats.clocks import clock_of
from jfsm.records.formats.lookup import (
    ChannelName,
    Choice,
    choose,
    dofs_of_points,
    listed,
    own_names,
    samples_of,
)
from jfsm.records.formats.rows import rows_where


def read(
    path: str | Path,
    *,
    time: str | None = None,
    force: ChannelName = None,
    displacement: ChannelName = None,
    velocity: ChannelName = None,
    acceleration: ChannelName = None,
    base_acceleration: str | None = None,
    units: Mapping[str, str] | None = None,
    sensitivity: Mapping[str, str] | None = None,
    rate: float | None = None,
    where: Mapping[str, str | float] | None = None,
    at_rest: bool | None = None,
    drive: Drive | None = None,
    name: str | None = None,
) -> Record:
    """The record in a file.

    Parameters
    ----------
    path : str or Path
        A file of text (csv, txt, dat, tsv), NumPy (npz), MATLAB (mat), HDF5 (h5, hdf5), a universal file (uff, unv),
        or with the extras ``jfsm[tdms]`` and ``jfsm[mf4]`` of National Instruments (tdms) and ASAM (mf4, mdf).
    time : str, optional
        Name of the column of instants; otherwise the clock that the channels have in the file, then ``time`` or ``t``
        is looked for, then a single number ``fs`` [Hz] or ``dt`` [s]: beside the channels first, then at the top.
    force, displacement, velocity, acceleration : str, sequence of str, or {dof: str}, optional
        Name of the channel: the head of a column (``column 3`` where it has none), a variable, a field
        ``struct.field``, a dataset ``group/name``, a node and direction ``3:+Z`` (with the opposite sign if the file
        has it as ``3:-Z``). The columns of a matrix (n, dof) are taken together, or one by one as ``name[0]``,
        ``name[1]``. Without any name the columns called ``force``, ``displacement_2`` and the like are taken, as
        `Record.write` calls them, or all that a universal file says the kind of, their dofs numbered by node.
    base_acceleration : str, optional
        Name of the channel.
    units : mapping, optional
        Unit of each channel by the name it has in the file, or by its kind. What the file itself states is the default.
    sensitivity : mapping, optional
        Of a channel that the file has in raw units, by its name or kind: ``{"a1": "100 mV/g", "force": "2.25 mV/N"}``.
        The numbers are in the raw unit of the sensitivity (mV) unless the file or `units` says another (V).
    rate : float, optional
        Samples per second [Hz] of a file without instants; the clock then begins at 0.
    where : mapping of column to value, optional
        Which rows of a long table to take, as ``{"specimen": "B", "run": 3}``; columns of text may be named, too.
    at_rest, drive, name : optional
        As for `Record`. By default what the file says, otherwise not at rest, driven by force, and the file's name.

    Returns
    -------
    Record

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ModuleNotFoundError
        If its format needs an extra that is not installed.
    ValueError
        If the format is not known, a name is not in the file, no row is left by `where`, no clock is found, channels
        have clocks that differ, or the numbers make no `Record`.

    Notes
    -----
    Input and output in two files, or channels of one file on clocks of their own, are read into a record each and
    brought to one clock; pieces of one run are joined::

        record = jfsm.align([jfsm.read("input.mat", force="u"), jfsm.read("output.mat", displacement="y")])
        record = jfsm.join([jfsm.read(path, force="u", displacement="y") for path in ("run_1.csv", "run_2.csv")])

    For anything more involved load the arrays and call `Record` with them.
    """
    path = Path(path)
    file_format = format_of(path)
    with path.open("rb"):
        pass  # a file that is missing or locked is reported as such, whatever a library would make of it
    contents = file_format.load(path)
    return record_of(
        rows_where(contents, path.name, where) if where else contents,
        path.name,
        (force, displacement, velocity, acceleration, base_acceleration),
        time=time,
        units=units or {},
        sensitivity=sensitivity or {},
        rate=rate,
        at_rest=at_rest,
        drive=drive,
        name=name,
        default_name=path.stem,
    )


def record_of(
    contents: Contents,
    source: str,
    wanted: Sequence[ChannelName],
    *,
    units: Mapping[str, str],
    sensitivity: Mapping[str, str],
    time: str | None = None,
    rate: float | None = None,
    at_rest: bool | None = None,
    drive: Drive | None = None,
    name: str | None = None,
    default_name: str | None = None,
) -> Record:
    """The record in contents that messages call `source`; `wanted` holds the names of each kind, in their order.

    The other arguments and errors are those of `read`.
    """
    named = {kind: names for kind, names in zip(KINDS, wanted, strict=True) if names is not None}
    chosen = {
        kind: _by_dof(contents, source, kind, names) for kind, names in (named or own_names(contents, source)).items()
    }
    every = [choice for choices in chosen.values() for choice in choices.values()]
    clock, column = clock_of(contents, source, every, time, rate)
    used = every if column is None else [*every, column]
    _require_read("units", units, used)
    _require_read("sensitivity", sensitivity, every)
    stated = {choice: _unit(contents, source, choice, units) for choice in used}
    factors: dict[Choice, float] = {}
    for choice in every:
        given = _said(sensitivity, choice)
        if given is not None:
            sensor = find_sensitivity(given, choice.name, choice.kind)
            written = find_unit(stated[choice] or sensor.reading, choice.kind)
            factors[choice] = written.factor / (sensor.size * find_unit(sensor.reading, choice.kind).factor)
            _require_raw(choice, stated[choice], written.coherent, find_unit(sensor.reading, choice.kind).coherent)
            stated[choice] = sensor.unit
    channels: dict[str, Any] = {}
    for kind, choices in chosen.items():
        arrays = {dof: samples_of(contents, source, choice) for dof, choice in choices.items()}
        for dof in arrays:
            if choices[dof] in factors:
                arrays[dof] = arrays[dof] * factors[choices[dof]]
        channels[kind] = arrays if None not in arrays else arrays[None]
    record = Record(
        clock,
        **channels,
        units=_one_for_each_kind(source, stated),
        at_rest=contents.about.get("at_rest", False) if at_rest is None else at_rest,
        drive=drive or contents.about.get("drive", "force"),
        name=contents.about.get("name", default_name) if name is None else name,
    )
    notes = [*contents.about.get("notes", ()), *contents.notes]
    if not named and contents.points and not contents.about:
        numbered = (f"{dof} is {point_name(*point)}" for point, dof in dofs_of_points(contents).items())
        notes.append(f"Degrees of freedom by node and direction: {', '.join(numbered)}.")
    return record.noted(*notes)


def _by_dof(contents: Contents, source: str, kind: str, names: ChannelName) -> dict[int | None, Choice]:
    """What was asked for by dof, under None where one name stands for all of a kind."""
    by_dof: Mapping[Any, str]
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
    stated = contents.units.get(choice.array)
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
