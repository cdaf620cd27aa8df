"""What a row of the tables of bad input is: what is tried, and what must come back."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import jfsm

N, RATE = 400, 100.0
T = np.arange(N) / RATE
FORCE = np.sin(5 * T) + np.cos(13 * T)
MOTION = np.sin(5 * T - 0.3) + 0.1 * np.cos(13 * T)
NAN, INF = float("nan"), float("inf")
STATES = np.random.default_rng(0).standard_normal((60, 2))
READINGS = STATES[:, 0] + 0.1 * STATES[:, 1]


class ReachedError(BaseException):
    """The calculation would begin now: everything before it let the input pass."""


@dataclass(frozen=True)
class Stage:
    """What rows are tried on: a folder of their own, a record and a structure that are in order."""

    folder: Path

    @property
    def record(self) -> jfsm.Record:
        return record()

    @property
    def model(self) -> jfsm.Structure:
        return jfsm.Structure.sdof(mass=1.0, stiffness=9.0, damping=0.1)

    def file(self, name: str, content: str | bytes) -> Path:
        """A file in the folder."""
        path = self.folder / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return path

    def read(self, path: Path, **asked: Any) -> jfsm.Record:
        return jfsm.read(path, **{"force": "F", "displacement": "x", **asked})


@dataclass(frozen=True)
class Row:
    """One kind of bad input.

    Attributes
    ----------
    name : str
        What it is.
    call : function of a Stage
        The call, or the words of a command line.
    says : str
        What the one message must say, as a regular expression; empty where the answer is right.
    error : class
        What is raised.
    right : function of what the call returns
        Whether that is right, where nothing is refused.
    """

    name: str
    call: Callable[[Stage], Any]
    says: str = ""
    error: type[BaseException] = ValueError
    right: Callable[[Any], Any] | None = None


def refused(name: str, call: Callable[[Stage], Any], says: str, error: type[Exception] = ValueError) -> Row:
    return Row(name, call, says, error)


def passes(name: str, call: Callable[[Stage], Any]) -> Row:
    """Input that looks bad and is good: the calculation begins."""
    return Row(name, call, "", ReachedError)


def right(name: str, call: Callable[[Stage], Any], check: Callable[[Any], Any]) -> Row:
    return Row(name, call, right=check)


def record(**given: Any) -> jfsm.Record:
    """A record in order, but for what is given."""
    time = given.pop("time", T)
    return jfsm.Record(time, **{"force": FORCE, "displacement": MOTION, **given})


def spoilt(values: np.ndarray, place: Any, value: float) -> np.ndarray:
    """The same samples but for one."""
    other = values.copy()
    other[place] = value
    return other


def csv_text(header: str = "time,F,x", columns: Any = (T, FORCE, MOTION), delimiter: str = ",") -> str:
    """A table as text."""
    rows = (delimiter.join(f"{value:.6f}" for value in row) for row in zip(*columns, strict=True))
    return "\n".join([header, *rows]) + "\n"
