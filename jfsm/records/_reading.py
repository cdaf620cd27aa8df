"""How a file is read: the options of `read` with the cuts that follow, as plain data that can be kept and repeated."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np

from jfsm.records._read import read
from jfsm.records._record import Record

READ = (
    "time", "force", "displacement", "velocity", "acceleration", "base_acceleration", "units", "sensitivity", "rate",
    "where", "run", "sheet", "at_rest", "drive",
)  # fmt: skip
"""Options of `read` that may be the same for many files."""
CUTS = ("since", "until", "resample", "every")
"""What may be done with a record that was read, in this order."""


@dataclass(frozen=True)
class Reading:
    """Options of `jfsm.read`, and what is done with the record then; what is None counts as left out.

    Beside the options of `jfsm.read` these are `since` and `until` [s], `resample`, a rate [Hz] or "auto" for that of
    the median step, and `every`, a whole number of samples of which one is kept, without aliasing.

    >>> Reading({"force": "u", "displacement": "y", "units": {"y": "mm"}}).read("run7.csv")  # doctest: +SKIP
    """

    options: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self):
        unknown = [name for name in self.options if name not in (*READ, *CUTS)]
        if unknown:
            raise TypeError(f"Files are read with {', '.join((*READ, *CUTS))}; there is no option {unknown[0]!r}.")

    def read(self, path: str | os.PathLike[str]) -> Record:
        """The record in a file; errors are those of `jfsm.read`, `Record.between` and `Record.resample`."""
        asked = self.plain
        record = read(path, **{name: asked[name] for name in READ if name in asked})
        if "since" in asked or "until" in asked:
            record = record.between(asked.get("since"), asked.get("until"))
        if "every" in asked:
            return record.resample(record.sample_rate / asked["every"])
        rate = asked.get("resample")
        return record if rate is None else record.resample(_median_rate(record) if rate == "auto" else rate)

    def without(self, *names: str) -> Self:
        """The same without these options, and without units and sensitivities of the channels that they name."""
        gone = {f"{self.options[name]}" for name in names if name in self.options}
        kept = {name: value for name, value in self.options.items() if name not in names}
        for name in ("units", "sensitivity"):
            if kept.get(name):
                kept[name] = {of: unit for of, unit in kept[name].items() if of not in gone}
        return type(self)(kept)

    @property
    def plain(self) -> dict[str, Any]:
        """The options that are given, as `of_plain` takes them and JSON writes them."""
        return {name: _plain(value) for name, value in self.options.items() if value is not None}

    @classmethod
    def of_plain(cls, written: Mapping[str, Any]) -> Self:
        """What `plain` gave, also when it went through JSON, which makes texts of the numbers of channels."""
        return cls({name: _numbered(value) if name not in _BY_NAME else value for name, value in written.items()})


_BY_NAME = ("units", "sensitivity", "where")


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    return value.item() if isinstance(value, np.generic) else value


def _numbered(value: Any) -> Any:
    """Channels by degree of freedom have numbers again."""
    return {int(dof): name for dof, name in value.items()} if isinstance(value, Mapping) else value


def _median_rate(record: Record) -> float:
    steps = np.sort(np.diff(record.time))
    return 1.0 / float(steps[steps.size // 2])
