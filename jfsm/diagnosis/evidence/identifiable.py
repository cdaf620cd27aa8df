"""What the motion of a single record cannot tell apart, however large the difference in evidence.

In one decay amplitude goes with time. Under one steady line whatever a law does goes with that line and its overtones,
as a load of that frequency would, and a delay of the force does what own values do. And a load of the line itself takes
the place of the measured force without that one's noise, so that it is the more probable whatever the cause is.
"""

from collections.abc import Callable, Sequence

import numpy as np

from ...identification import Nuisances
from ...structures import AbstractTerm, PeriodicDisturbance
from .fitted import Trial

_DECAY = "changes with time, which a single decay does not tell from a change with amplitude"
_LINE = "keeps time with the drive, as any law's force does under a single line"
_ALONE = 0.98
"""Share of the force's power within two bins of its strongest line, from which the line is alone."""
_NEAR = 1.0
"""Bins within which a frequency is that of an overtone."""
_OVERTONES = 9


def untold(records: Sequence[Nuisances]) -> Callable[[Trial], str]:
    """Tells of a hypothesis why these records, however well it explains them, do not show it; nothing if they do."""
    if len(records) == 1 and not records[0].driven and records[0].path is None:
        return lambda t: _DECAY if any(effect.cause.family == "time" for effect in t.effects) else ""
    order_of = _orders(records)
    return lambda t: _LINE if any(law.timed and order_of(law) for law in t.laws) else ""


def in_step(records: Sequence[Nuisances]) -> Callable[[Trial], bool]:
    """Tells of a hypothesis whether it has a load of the drive's own line, where that is single."""
    order_of = _orders(records)
    return lambda t: any(isinstance(law, PeriodicDisturbance) and order_of(law) == 1 for law in t.laws)


def _orders(records: Sequence[Nuisances]) -> Callable[[AbstractTerm], int]:
    """Tells of a law which overtone of a single line its frequency is; 0 for none, or where there is no such line."""
    line = single_line(records)
    if line is None:
        return lambda law: 0
    bin_width = 2 * np.pi / records[0].record.duration

    def order_of(law: AbstractTerm) -> int:
        omega = float(getattr(law, "omega", 0.0))
        order = round(omega / line)
        return order if 1 <= order <= _OVERTONES and abs(omega - order * line) < _NEAR * bin_width else 0

    return order_of


def single_line(records: Sequence[Nuisances]) -> float | None:
    """Angular frequency [rad/s] of the only line that drives a single record; None where there is more, or no drive."""
    if len(records) > 1 or records[0].path is not None:
        return None
    nuisances = records[0]
    forces = [y - np.mean(y) for (kind, _), y in nuisances.record.channels.items() if kind == "force"]
    if nuisances.record.base_acceleration is not None:
        forces.append(nuisances.record.base_acceleration - np.mean(nuisances.record.base_acceleration))
    found = []
    for y in filter(np.any, forces):
        power = np.abs(np.fft.rfft(np.hanning(y.size) * y)) ** 2
        k = int(np.argmax(power[1:])) + 1
        near = slice(max(k - 2, 1), k + 3)
        if np.sum(power[near]) < _ALONE * np.sum(power[1:]):
            return None
        found.append(float(np.sum(np.arange(power.size)[near] * power[near]) / np.sum(power[near])))
    if not found or max(found) - min(found) > _NEAR:
        return None
    return 2 * np.pi * found[0] / (forces[0].size * nuisances.record.dt)
