"""What a file holds, and what a format must do to be read and written."""

import abc
import importlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

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


class StatedRate(NamedTuple):
    """A sampling rate [Hz] and the words in which the file states it."""

    hertz: float
    words: str


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
    aliases : mapping of text to names
        What else the file calls its arrays (a whole heading, a label). A text that stands for several is none's name.
    rate : StatedRate or None
        Samples per second of all channels that have no instants.
    begins : datetime64 or None
        The instant at which the clocks of the file read zero.
    runs : sequence of Contents
        Where the file holds several tables, each of them, with its `title`; `arrays` is then empty.
    runs_are : "run" or "sheet"
        What they are called.
    title : str
        What tells this one of several from the others, as "400 rows from line 23 on".
    """

    arrays: Mapping[str, NDArray[Any]]
    units: Mapping[str, str] = field(default_factory=dict)
    about: Mapping[str, Any] = field(default_factory=dict)
    clocks: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    kinds: Mapping[str, str] = field(default_factory=dict)
    points: Mapping[str, tuple[int, int]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    texts: Mapping[str, NDArray[np.str_]] = field(default_factory=dict)
    aliases: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    rate: StatedRate | None = None
    begins: np.datetime64 | None = None
    runs: tuple["Contents", ...] = ()
    runs_are: str = "run"
    title: str = ""


class AbstractFormat(abc.ABC):
    """One kind of file.

    A reader reads samples when they are asked for, says in `notes` what it skips or assumes, writes nothing beside the
    file, asks nothing and evaluates no text; a file that it cannot read it refuses in one sentence.
    """

    name: ClassVar[str]
    """What such a file is called in a message."""
    suffixes: ClassVar[tuple[str, ...]]
    """Endings that mean this format where a record is written."""

    @abc.abstractmethod
    def recognises(self, begins_with: bytes, path: Path) -> bool:
        """Whether a file whose first bytes (4096, or all) are these is of this kind, whatever its ending."""

    @abc.abstractmethod
    def load(self, path: Path) -> Contents:
        """Everything numeric in the file."""

    def save(self, path: Path, contents: Contents) -> None:
        """Write the contents so that `load` gives them back exactly.

        Raises
        ------
        ValueError
            If the format is only read.
        """
        raise ValueError(
            f"`path` must end in a format that can be written; {path.suffix} is only read. Write .h5 or .uff."
        )


ABOUT = "jfsm_record"  # the name under which binary formats keep `units` and `about`, as JSON


def unique_names(names: Iterable[str]) -> list[str]:
    """Names for columns that may have none or share one: empty ones are numbered, later twins get a suffix."""
    unique: dict[str, None] = {}
    for place, name in enumerate(names, start=1):
        key = name or f"column {place}"
        unique[key if key not in unique else f"{key} ({place})"] = None
    return list(unique)


def left_out(names: Sequence[str], shown: int = 6) -> tuple[str, ...]:
    """The note on what a reader leaves out, each with its reason; none if it reads everything."""
    more = f" and {len(names) - shown} more" if len(names) > shown else ""
    return (f"Left out: {', '.join(names[:shown])}{more}.",) if names else ()


def told_apart(given: Sequence[str]) -> tuple[list[str], dict[str, tuple[str, ...]]]:
    """Names for columns of which several share one: all of these are numbered, and what each shared name stands for."""
    seen: dict[str, int] = {}
    numbered = []
    for name in given:
        seen[name] = seen.get(name, 0) + 1
        numbered.append(f"{name} ({seen[name]})" if name and given.count(name) > 1 else name)
    names, shared = unique_names(numbered), {}
    for name, text in zip(names, given, strict=True):
        shared.setdefault(text, []).append(name)
    return names, {text: tuple(several) for text, several in shared.items() if text and len(several) > 1}


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
