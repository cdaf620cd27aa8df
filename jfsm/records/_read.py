"""A record from a file: which of its arrays is what."""

import difflib
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jfsm.records._record import Drive, Record
from jfsm.records._units import KINDS
from jfsm.records.formats import Contents, format_of

ChannelName = str | Sequence[str] | Mapping[int, str] | None

TIME_NAMES = ("time", "t")
RATE_NAMES = ("fs", "sample_rate")  # Hz
STEP_NAMES = ("dt",)  # s
_OWN_NAME = re.compile(rf"^({'|'.join(KINDS)})(?:_(\d+))?$")
_COLUMN = re.compile(r"^(?P<name>.+)\[(?P<column>\d+)\]$")


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
    rate: float | None = None,
    at_rest: bool | None = None,
    drive: Drive | None = None,
    name: str | None = None,
) -> Record:
    """The record in a file.

    Parameters
    ----------
    path : str or Path
        A file of text (csv, txt, dat, tsv), NumPy (npz) or MATLAB (mat).
    time : str, optional
        Name of the column of instants; otherwise ``time`` or ``t`` is looked for, then a single number ``fs`` [Hz] or
        ``dt`` [s].
    force, displacement, velocity, acceleration : str, sequence of str, or {dof: str}, optional
        Name of the channel: the head of a column (``column 3`` where it has none), a variable, a field
        ``struct.field``. The columns of a matrix (n, dof) are taken together, or one by one as ``name[0]``,
        ``name[1]``. Without any name the columns called ``force``, ``displacement_2`` and the like are taken, as
        `Record.write` calls them.
    base_acceleration : str, optional
        Name of the channel.
    units : mapping, optional
        Unit of each channel by the name it has in the file, or by its kind. What the file itself states is the default.
    rate : float, optional
        Samples per second [Hz] of a file without instants; the clock then begins at 0.
    at_rest, drive, name : optional
        As for `Record`. By default what the file says, otherwise not at rest, driven by force, and the file's name.

    Returns
    -------
    Record

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If the format is not known, a name is not in the file, no clock is found, or the numbers make no `Record`.

    Notes
    -----
    For anything more involved (input and output in two files, a run cut out of a long table) load the arrays and call
    `Record` with them::

        force, motion = scipy.io.loadmat("input.mat"), scipy.io.loadmat("output.mat")
        samples = np.arange(force["u"].size) / force["fs"].item()
        record = Record(samples, force=force["u"].ravel(), displacement=motion["y"].ravel())
    """
    path = Path(path)
    contents = format_of(path).load(path)
    wanted: dict[str, ChannelName] = {
        "force": force,
        "displacement": displacement,
        "velocity": velocity,
        "acceleration": acceleration,
        "base_acceleration": base_acceleration,
    }
    wanted = {kind: names for kind, names in wanted.items() if names is not None} or _own_names(contents, path)
    channels: dict[str, Any] = {}
    used: dict[str, list[str]] = {}
    for kind, names in wanted.items():
        channels[kind], used[kind] = _pick(contents, path, kind, names)
    clock, clock_name = _clock(contents, path, time, rate, channels)
    if clock_name is not None:
        used["time"] = [clock_name]
    record = Record(
        clock,
        **channels,
        units=_units_by_kind(contents, used, units or {}),
        at_rest=contents.about.get("at_rest", False) if at_rest is None else at_rest,
        drive=drive or contents.about.get("drive", "force"),
        name=contents.about.get("name", path.stem) if name is None else name,
    )
    return record.noted(*contents.about.get("notes", ()))


def _own_names(contents: Contents, path: Path) -> dict[str, ChannelName]:
    """Channels that carry the names of kinds, as in a file that `Record.write` made."""
    found: dict[str, Any] = {}
    for name in contents.arrays:
        match = _OWN_NAME.match(name)
        if match and match[1] == "base_acceleration":
            found[match[1]] = name
        elif match and match[2] is None:
            found[match[1]] = name  # the whole of a matrix, so not under a dof
        elif match:
            found.setdefault(match[1], {})[int(match[2])] = name
    if not found and not contents.about:
        raise ValueError(
            f"{path.name} must be told which channel is what, as in read(path, force=..., displacement=...); "
            f"it holds {_listed(contents.arrays)}."
        )
    return found


def _pick(contents: Contents, path: Path, kind: str, names: ChannelName) -> tuple[Any, list[str]]:
    """The argument of `Record` for one kind, and the names that went into it."""
    if isinstance(names, str):
        return _array(contents, path, kind, names), [names]
    if isinstance(names, Mapping):
        return {dof: _array(contents, path, kind, name) for dof, name in names.items()}, list(names.values())
    chosen = list(names or ())
    return {dof: _array(contents, path, kind, name) for dof, name in enumerate(chosen, start=1)}, chosen


def _array(contents: Contents, path: Path, kind: str, name: str) -> NDArray[Any]:
    """One channel, or a matrix of channels with the samples first."""
    match = _COLUMN.match(name)
    if name in contents.arrays or match is None:
        base, column = name, None
    else:
        base, column = match["name"], int(match["column"])
    if base not in contents.arrays:
        close = difflib.get_close_matches(base, contents.arrays, n=1)
        hint = f" Did you mean {close[0]!r}?" if close else ""
        raise ValueError(
            f"`{kind}` must name a channel of {path.name}, which holds {_listed(contents.arrays)}; "
            f"it was {name!r}.{hint}"
        )
    array = np.asarray(contents.arrays[base])
    if array.ndim == 2 and array.shape[0] < array.shape[1]:
        array = array.T  # there are always more samples than channels
    if array.ndim == 2 and array.shape[1] == 1:
        array = array[:, 0]
    if column is None:
        return array
    if array.ndim != 2 or column >= array.shape[1]:
        raise ValueError(
            f"`{kind}` must name a column that exists; {base!r} in {path.name} has shape {array.shape}, and {name!r} "
            f"was asked for. Columns count from 0."
        )
    return array[:, column]


def _clock(
    contents: Contents, path: Path, time: str | None, rate: float | None, channels: Mapping[str, Any]
) -> tuple[NDArray[np.float64], str | None]:
    """Instants, and the name of the column they come from (None when they are counted)."""
    if time is not None and rate is not None:
        raise ValueError(f"`time` and `rate` cannot both be given; they were {time!r} and {rate}. Leave one out.")
    if rate is None:
        names = [time] if time is not None else _found(contents, TIME_NAMES, single=False)
        if names:
            return _array(contents, path, "time", names[0]), names[0]
        for name in _found(contents, RATE_NAMES, single=True):
            rate = float(np.asarray(contents.arrays[name]).item())
        for name in _found(contents, STEP_NAMES, single=True) if rate is None else ():
            rate = 1.0 / float(np.asarray(contents.arrays[name]).item())
    if rate is None:
        raise ValueError(
            f"{path.name} must say when its samples were taken; it holds {_listed(contents.arrays)}. "
            f'Pass time="..." or rate=... [Hz].'
        )
    if not (np.isfinite(rate) and rate > 0):
        raise ValueError(f"`rate` must be a positive number of samples per second; it was {rate}. Pass rate=... [Hz].")
    first = next(iter(channels.values()), np.empty(0))
    if isinstance(first, Mapping):
        first = next(iter(first.values()), np.empty(0))
    return np.arange(np.shape(first)[0]) / rate, None


def _found(contents: Contents, names: Iterable[str], single: bool) -> list[str]:
    """Names of arrays called so, in any case of letters: single numbers, or columns."""
    lower = {name.lower(): name for name in reversed(list(contents.arrays))}
    present = [lower[name] for name in names if name in lower]
    return [name for name in present if (np.size(contents.arrays[name]) == 1) == single]


def _units_by_kind(contents: Contents, used: Mapping[str, Sequence[str]], units: Mapping[str, str]) -> dict[str, str]:
    """One unit for each kind, from what the caller says and else from what the file states."""
    names = [name for chosen in used.values() for name in chosen]
    for key in units:
        if key not in names and key not in used:
            raise ValueError(
                f"`units` must name channels that are read, one of {_listed([*names, *used])}; it names {key!r}. "
                f"Use the name that the channel has in the file."
            )
    result: dict[str, str] = {}
    for kind, chosen in used.items():
        stated = {name: units.get(name, units.get(kind, contents.units.get(name))) for name in chosen}
        if len(set(stated.values())) > 1:
            raise ValueError(
                f"`units` must be the same for all channels of a kind; those of {kind} are {stated}. "
                f"Convert one, or read them into two records."
            )
        unit = next(iter(stated.values()))
        if unit is not None:
            result[kind] = unit
    return result


def _listed(names: Iterable[str]) -> str:
    shown = [repr(name) for name in names]
    return ", ".join(shown[:30]) + (f" and {len(shown) - 30} more" if len(shown) > 30 else "") if shown else "nothing"
