"""Which channel of a file a caller means."""

import difflib
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from jfsm.records._units import KINDS
from jfsm.records.formats.base import Contents

ChannelName = str | Sequence[str] | Mapping[int, str] | None

_OWN_NAME = re.compile(rf"^({'|'.join(KINDS)})(?:_(\d+))?$")
_COLUMN = re.compile(r"^(?P<name>.+)\[(?P<column>\d+)\]$")
_POINT = re.compile(r"^(?P<node>\d+:)(?P<sign>[+-])(?P<axis>R?[XYZ].*)$")


class Choice(NamedTuple):
    """One channel that a caller asked for.

    Attributes
    ----------
    kind : str
        What it is to be in the record.
    name : str
        What the caller calls it.
    array : str
        Name of the array in the file.
    column : int or None
        Column of that array, from 0; None for all of it.
    sign : float
        −1 where the file has the channel in the opposite direction.
    """

    kind: str
    name: str
    array: str
    column: int | None
    sign: float


def choose(contents: Contents, source: str, kind: str, name: str) -> Choice:
    """The channel of that name; a direction that the file has the other way round is taken with the opposite sign.

    Raises
    ------
    ValueError
        If there is none.
    """
    match = None if name in contents.arrays or name in contents.aliases else _COLUMN.match(name)
    base, column = (match["name"], int(match["column"])) if match else (name, None)
    meant = _meant(contents, base)
    if len(meant) > 1:
        raise ValueError(
            f"`{kind}` must name one channel of {source}; {name!r} may be {' or '.join(map(repr, meant))}. Name one of "
            f"them."
        )
    for array, sign in ((meant[0] if meant else base, 1.0), (_reversed(base), -1.0)):
        for candidate in (array, f"{array} {kind}"):
            if candidate in contents.arrays:
                return Choice(kind, name, candidate, column, sign)
    close = difflib.get_close_matches(base, contents.arrays, n=1)
    hint = f" Did you mean {close[0]!r}?" if close else ""
    skipped = next((note for note in contents.notes if re.search(rf"(?<!\w){re.escape(base)}(?!\w)", note)), None)
    hint = f" {skipped}" if skipped is not None else hint
    raise ValueError(
        f"`{kind}` must name a channel of {source}, which holds {listed(contents.arrays)}; it was "
        f"{name!r}.{hint}{_why(contents, base)}"
    )


def _why(contents: Contents, name: str) -> str:
    """What the reader says of a name that it left out."""
    said = [
        note for note in contents.notes if "eft out" in note and re.search(rf"(?<!\w){re.escape(name)}(?!\w)", note)
    ]
    return f" {said[0]}" if said else ""


def _meant(contents: Contents, text: str) -> tuple[str, ...]:
    """The arrays that a text may stand for: by name, what else the file calls them, number from 1, or end of a name."""
    if text in contents.arrays:
        return (text,)
    if text in contents.aliases:
        return contents.aliases[text]
    text = re.sub(r"\((\d+)\)", r"{\1}", text) if "{1}" in "".join(contents.arrays) else text  # runs(2) of MATLAB
    if text in contents.arrays:
        return (text,)
    if text.isdigit() and 1 <= int(text) <= len(contents.arrays):
        return (list(contents.arrays)[int(text) - 1],)
    return tuple(name for name in contents.arrays if name.endswith((f"/{text}", f".{text}")))


def samples_of(contents: Contents, source: str, choice: Choice) -> NDArray[Any]:
    """One channel, or a matrix of channels with the samples first.

    Raises
    ------
    ValueError
        If the column does not exist.
    """
    array = np.asarray(contents.arrays[choice.array])
    if array.ndim == 2 and array.shape[0] < array.shape[1]:
        array = array.T  # there are always more samples than channels
    if array.ndim == 2 and array.shape[1] == 1:
        array = array[:, 0]
    if choice.column is not None:
        if array.ndim != 2 or choice.column >= array.shape[1]:
            raise ValueError(
                f"`{choice.kind}` must name a column that exists; {choice.array!r} in {source} has shape "
                f"{array.shape}, and {choice.name!r} was asked for. Columns count from 0."
            )
        array = array[:, choice.column]
    return -array if choice.sign < 0 else array


def own_names(contents: Contents, source: str) -> dict[str, ChannelName]:
    """Channels that carry the names of kinds, as in a file that `Record.write` made, else those of known kind.

    Raises
    ------
    ValueError
        If the file says of no channel what it measures.
    """
    found: dict[str, Any] = {}
    for name in contents.arrays:
        match = _OWN_NAME.match(name)
        if match and match[1] == "base_acceleration":
            found[match[1]] = name
        elif match and match[2] is None:
            found[match[1]] = name  # the whole of a matrix, so not under a dof
        elif match:
            found.setdefault(match[1], {})[int(match[2])] = name
    found = found or _by_kind(contents)
    if not found and not contents.about:
        raise ValueError(
            f'{source} must be told which channel is what, as force="...", displacement="..."; '
            f"it holds {listed(contents.arrays)}."
        )
    return found


def dofs_of_points(contents: Contents) -> dict[tuple[int, int], int]:
    """Dof of each node and direction at which the file says that something was measured, in that order, from 1."""
    measured = {(node, abs(way)) for name, (node, way) in contents.points.items() if name in contents.kinds}
    return {point: dof for dof, point in enumerate(sorted(measured), start=1)}


def _by_kind(contents: Contents) -> dict[str, Any]:
    """Channels of known kind; nothing when two of one kind were measured at one place."""
    dofs = dofs_of_points(contents)
    found: dict[str, Any] = {}
    for name, kind in contents.kinds.items():
        if kind == "base_acceleration":
            if kind in found:
                return {}
            found[kind] = name
            continue
        of_kind = found.setdefault(kind, {})
        node, way = contents.points.get(name, (0, 0))
        dof = dofs[node, abs(way)] if name in contents.points else len(of_kind) + 1
        if dof in of_kind:
            return {}
        of_kind[dof] = _reversed(name) if way < 0 else name
    return found


def _reversed(name: str) -> str:
    """The name of the opposite direction, ``3:-Z`` for ``3:+Z``; names without a direction as they are."""
    match = _POINT.match(name)
    return f"{match['node']}{'-' if match['sign'] == '+' else '+'}{match['axis']}" if match else name


def listed(names: Iterable[str]) -> str:
    """Names for a message, the first thirty of many."""
    shown = [repr(name) for name in names]
    return ", ".join(shown[:30]) + (f" and {len(shown) - 30} more" if len(shown) > 30 else "") if shown else "nothing"
