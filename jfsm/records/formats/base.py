"""What a file holds, and what a format must do to be read and written."""

import abc
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray


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
    """

    arrays: Mapping[str, NDArray[Any]]
    units: Mapping[str, str] = field(default_factory=dict)
    about: Mapping[str, Any] = field(default_factory=dict)


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


def column_names(names: list[str], arrays: list[np.ndarray]) -> dict[str, np.ndarray]:
    """Names for columns that may have none or share one: empty ones are numbered, later twins get a suffix."""
    named: dict[str, np.ndarray] = {}
    for place, (name, array) in enumerate(zip(names, arrays, strict=True), start=1):
        key = name or f"column {place}"
        named[key if key not in named else f"{key} ({place})"] = array
    return named
