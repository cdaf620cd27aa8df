"""Text of oscilloscopes that no general rule divides: Tektronix with its header beside the data, Rigol counting."""

import re
from pathlib import Path
from typing import ClassVar

import numpy as np

from jfsm.records._units import is_unit
from jfsm.records.formats.base import AbstractFormat, Contents
from jfsm.records.formats.numbers import is_number, number
from jfsm.records.formats.text.lines import TextFile, encoding_of


def _rows(path: Path) -> list[list[str]]:
    return [
        [field.strip().strip('"') for field in line.split(",")] for _, line in TextFile(path).lines() if line.strip()
    ]


class TektronixFormat(AbstractFormat):
    """The one channel of a csv that has its header in the first three columns of the rows. Read only."""

    name: ClassVar[str] = "Tektronix csv"
    suffixes: ClassVar[tuple[str, ...]] = ()

    def recognises(self, begins_with: bytes, path: Path) -> bool:
        if not encoding_of(begins_with):
            return False
        first = begins_with.decode("latin-1").splitlines()[0].lstrip("\ufeffï»¿")
        return re.match(r'"?Record Length"?,', first) is not None and len(first.split(",")) >= 5

    def load(self, path: Path) -> Contents:
        rows = _rows(path)
        head = {row[0]: row[1] for row in rows if row[0] and len(row) > 1}
        bad = [place for place, row in enumerate(rows, start=1) if not all(map(is_number, row[3:5])) or len(row) < 5]
        if bad:
            raise ValueError(
                f"{path.name} must hold an instant and a sample in the fourth and fifth field of every row; line "
                f"{bad[0]} does not. Repair or remove that line."
            )
        instants, samples = (np.array([number(row[place]) for row in rows]) for place in (3, 4))
        name = head.get("Source", "") or "channel"
        announced = head.get("Record Length", "")
        notes: list[str] = []
        if is_number(announced) and int(number(announced)) != len(rows):
            notes.append(f"The file announces {int(number(announced))} samples; {len(rows)} stand in it.")
        probe = head.get("Probe Atten", "")
        if is_number(probe) and number(probe) != 1:
            notes.append(f"The file states a probe of {number(probe):g}; scopes have it in their numbers already.")
        units = {name: head.get("Vertical Units", ""), "time": head.get("Horizontal Units", "")}
        return Contents(
            {"time": instants, name: samples},
            {key: unit for key, unit in units.items() if is_unit(unit)},
            notes=tuple(notes),
        )


class RigolFormat(AbstractFormat):
    """Channels of a csv that counts samples and states start and step in its second row. Read only."""

    name: ClassVar[str] = "Rigol csv"
    suffixes: ClassVar[tuple[str, ...]] = ()

    def recognises(self, begins_with: bytes, path: Path) -> bool:
        if not encoding_of(begins_with):
            return False
        lines = begins_with.decode("latin-1").lstrip("ï»¿").splitlines()
        return re.match(r"X,.*\bStart,\s*Increment", lines[0]) is not None and lines[1:2] != []

    def load(self, path: Path) -> Contents:
        names, units, *data = _rows(path)
        start, increment = names.index("Start"), names.index("Increment")
        channels = {name: place for place, name in enumerate(names) if name and place not in (0, start, increment)}
        bad = [
            at
            for at, row in enumerate(data, start=3)
            if not all(is_number(row[p]) for p in channels.values() if p < len(row))
        ]
        if bad or not all(is_number(units[place]) for place in (start, increment)):
            raise ValueError(
                f"{path.name} must hold numbers in its rows, and Start and Increment in the second; line "
                f"{bad[0] if bad else 2} does not. Repair or remove that line."
            )
        first, step = number(units[start]), number(units[increment])
        clock = first + step * np.array([number(row[0]) for row in data])
        return Contents(
            {name: np.array([number(row[place]) for row in data]) for name, place in channels.items()},
            {name: units[place] for name, place in channels.items() if units[place]},
            clocks=dict.fromkeys(channels, clock),
        )
