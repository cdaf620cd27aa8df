"""What a file holds, and what a format must do to be read and written."""

import abc
import importlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray


class Lazy(Mapping[str, NDArray[Any]]):
    """Arrays by name that are read, or refused, when they are asked for."""

    def __init__(self, names: Iterable[str], load: Callable[[str], NDArray[Any]]):
        self._names = dict.fromkeys(names)
        self._load = load

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name not in self._names:
            raise KeyError(name)
        return self._load(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def __contains__(self, name: object) -> bool:
        return name in self._names  # the inherited test would read the array


@dataclass(frozen=True)
class Contents:
    """Named arrays of one file, before anyone has said what they mean.

    Attributes
    ----------
    arrays : mapping of name to array
        Whatever numbers the file holds: columns, matrices of columns, single numbers.
    units : mapping of name to text
        Units that the file states, as written.
    about : mapping
        What a file written by `Record.write` says of the record as a whole (at_rest, drive, name, notes); else empty.
    clocks : mapping of name to (n,) array
        Instants [s] of channels that carry a clock of their own.
    kinds : mapping of name to kind
        What a channel measures ("force", "acceleration", ...), where the file says so.
    points : mapping of name to (node, direction)
        Where a channel measures, where the file says so: directions 1, 2, 3 are translations along X, Y, Z and 4, 5, 6
        rotations about them, negative ones the other way.
    notes : sequence of str
        What else the file says that a reader of the record should know, one sentence each.
    texts : mapping of name to (n,) array of str
        Columns as written, of a table in which some may be text.
    """

    arrays: Mapping[str, NDArray[Any]]
    units: Mapping[str, str] = field(default_factory=dict)
    about: Mapping[str, Any] = field(default_factory=dict)
    clocks: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    kinds: Mapping[str, str] = field(default_factory=dict)
    points: Mapping[str, tuple[int, int]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    texts: Mapping[str, NDArray[np.str_]] = field(default_factory=dict)


class AbstractFormat(abc.ABC):
    """One kind of file."""

    suffixes: ClassVar[tuple[str, ...]]

    @abc.abstractmethod
    def load(self, path: Path) -> Contents:
        """Everything numeric in the file."""

    @abc.abstractmethod
    def save(self, path: Path, contents: Contents) -> None:
        """Write the contents so that `load` gives them back exactly."""


ABOUT = "jfsm_record"  # the name under which binary formats keep `units` and `about`, as JSON


def unique_names(names: Iterable[str]) -> list[str]:
    """Names for columns that may have none or share one: empty ones are numbered, later twins get a suffix."""
    unique: dict[str, None] = {}
    for place, name in enumerate(names, start=1):
        key = name or f"column {place}"
        unique[key if key not in unique else f"{key} ({place})"] = None
    return list(unique)


_AXES = ("", "X", "Y", "Z", "RX", "RY", "RZ")  # by the number of a direction


def point_name(node: int, direction: int) -> str:
    """A node and what is measured there: ``3:+Z``, ``3:-RX``, or ``3`` for a scalar; empty without either."""
    axis = _AXES[abs(direction)] if abs(direction) < len(_AXES) else ""
    return f"{node}:{'-' if direction < 0 else '+'}{axis}" if axis else str(node or "")


def optional_package(module: str, extra: str, path: Path) -> Any:
    """A package that only one format needs, imported when a file of that format is read.

    Raises
    ------
    ModuleNotFoundError
        If it is not installed, with the line that installs it.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"{path.name} is read by the package {module}, which is not installed. Run `pip install jfsm[{extra}]`."
        ) from error


def read_only(path: Path) -> ValueError:
    """The refusal to write a format that is only read."""
    return ValueError(
        f"`path` must end in a format that can be written; {path.suffix} is only read. Write .h5 or .uff."
    )
