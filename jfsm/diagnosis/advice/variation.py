"""Variations of a recorded test: the drive louder, faster or shifted, another channel measured, a longer record."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...identification import Nuisances
from ...records import Record

LEVELS, _SPEEDS, _SHIFTS = (0.25, 0.5, 2.0, 4.0), (0.35, 0.7, 1.4), (0.5, -0.5)
"""How much larger and faster the drive of a test may be, and the constant force that is added, in its rms."""
_KINDS = ("displacement", "velocity", "acceleration")


@dataclass(frozen=True)
class Variation:
    """A record at hand, changed: drive times `level`, `speed` times as fast, constant forces of `shift` times its rms,
    and channels of another kind; the drive there and back, until it is `length` times as long."""

    level: float = 1.0
    speed: float = 1.0
    shift: float = 0.0
    kind: str = ""
    length: int = 1

    def words(self, record: Record) -> str:
        """What to do, as a sentence without a stop."""
        longer = f", there and back until it is {self.length} times as long" if self.length > 1 else ""
        return self._what(record) + longer

    def _what(self, record: Record) -> str:
        shaken = record.drive == "motion" or record.base_acceleration is not None
        drive = "the same motion" if shaken else "the same force" if record.driven else "a release"
        if self.kind:
            return f"the same test with the {self.kind} measured as well"
        if self.shift:
            forces = [
                f"{self.shift * _rms(y):+.3g} {record.units['force']}"
                for (kind, _), y in record.channels.items()
                if kind == "force"
            ]
            return f"{drive} with a constant force of {' and '.join(forces)} added"
        if self.speed != 1.0:
            return f"{drive} played {self.speed:g} times as fast"
        return f"{drive} {'from' if drive == 'a release' else 'at'} {self.level:g} times the size"


def variations(nuisances: Nuisances) -> list[Variation]:
    """Tests that could be made with the structure of a record."""
    record = nuisances.record
    levels = [Variation(level=level) for level in LEVELS]
    if record.drive == "motion":
        return levels
    speeds = [Variation(speed=speed) for speed in _SPEEDS] if record.driven else []
    shifts = [Variation(shift=shift) for shift in _SHIFTS] if _has_force(record) else []
    measured = {kind for kind, _ in nuisances.channels}
    return [*levels, *speeds, *shifts, *(Variation(kind=kind) for kind in _KINDS if kind not in measured)]


def _has_force(record: Record) -> bool:
    return any(kind == "force" and np.any(y) for (kind, _), y in record.channels.items())


def planned_record(record: Record, test: Variation, *, known: bool = True) -> Record:
    """Time and drive of a test, from rest where anything drives, with channels that hold nothing yet.

    Where it rests is not `known` where that may be in one well or another.
    """
    time = record.time[0] + record.dt * np.arange(test.length * len(record)) / test.speed
    channels: dict[str, Any] = {}
    for (kind, j), y in record.channels.items():
        shift = test.shift * _rms(y) if kind == "force" else 0.0
        if (kind != "force") == (record.drive == "motion"):
            planned = _there_and_back(test.level * y + shift, test.length)
        else:
            planned = np.zeros(time.size)
        channels.setdefault(kind, {})[j] = planned
    if test.kind:
        channels[test.kind] = {j: np.zeros(time.size) for j in sorted({j for kind, j in record.responses})}
    base = record.base_acceleration
    if base is not None:
        channels["base_acceleration"] = _there_and_back(test.level * base, test.length)
    return Record(time, **channels, at_rest=record.driven and known, drive=record.drive, units=dict(record.units))


def _there_and_back(y: np.ndarray, times: int) -> np.ndarray:
    """A signal as often as `times`, every second time backwards."""
    return np.concatenate([y[::-1] if turn % 2 else y for turn in range(times)])


def _rms(y: np.ndarray) -> float:
    return math.sqrt(float(np.mean(y**2)))
