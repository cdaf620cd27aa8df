"""Channels that their recorder clipped, which the record itself shows before anything is fitted."""

from collections.abc import Iterator, Sequence

import numpy as np

from ..._result import Estimate
from ...identification import LEAST_SAMPLES
from ...records import Record, defects
from ...structures import Clipping, Structure, causes
from .._finding import Finding
from ..hypotheses.law_classes import SENSOR

_NOTICEABLE = 0.002
"""Share of a channel's samples, from which clipping is a finding."""
_SAME = 1e-9
"""Rounding, relative."""


def limited(records: Sequence[Record], model: Structure) -> list[Clipping]:
    """The clipped channels of which the model knows nothing, with their limits; those cut off alike on both sides.

    Where a motion is imposed none is clipped: friction alone may hold the force at one level, and a rig its motion. Nor
    is any of a record that is too short to be fitted.
    """
    known = {s.at for s in model.sensors if isinstance(s, Clipping)}
    found: dict[tuple[str, int], float] = {}
    for record in (r for r in records if r.drive == "force" and len(r) >= LEAST_SAMPLES):
        for channel, limit in _limits(record):
            found[channel] = max(limit, found.get(channel, 0.0))
    return [Clipping(limit, at=channel) for channel, limit in found.items() if channel not in known]


def _limits(record: Record) -> Iterator[tuple[tuple[str, int], float]]:
    """The channels of which enough readings are cut off at one size, with that size."""
    for channel, samples in record.channels.items():
        cut, torn = defects(samples, record.dt)
        size = float(np.max(np.abs(samples[~torn])))
        if cut.mean() > _NOTICEABLE and np.all(np.abs(samples[cut]) >= size * (1 - _SAME)):
            yield channel, size


def clipped_channel(sensor: Clipping, unit: str) -> Finding:
    """A clipped channel as a finding."""
    limit, cause = sensor.value, causes()["clipping"]
    estimate = Estimate(limit, limit * (1 - _SAME), limit * (1 + _SAME), unit)
    return Finding.of_sensor(cause, sensor.at, "limit", estimate, cause.sentence, SENSOR)
