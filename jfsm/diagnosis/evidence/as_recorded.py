"""What it changes in the runs of a model when a force acts at other times than it was recorded."""

import numpy as np

from ...identification import Nuisances
from ...plant import Reconstruction
from ...structures import Structure
from .course import Course, in_parts, stretches_of, window_of


def change_by_times(model: Structure, seen: Nuisances, assumed: Reconstruction) -> float:
    """Change of a model's free run, as a share of the signal, in the channel that changes most; 0 where a force acts as
    it was recorded and goes between its samples as is `assumed`."""
    if not seen.late and seen.reconstruction == assumed:
        return 0.0
    record, period = seen.record, seen.period / seen.record.dt
    recorded = record.aligned({channel: -tau for channel, tau in seen.late.items()})
    stretches = stretches_of(record, in_parts(seen))
    window = window_of(min(s.stop - s.start for s in stretches), period)
    course = Course(record, 0, stretches, window, np.arange(len(record)), ())
    in_time = course.run(model, record, seen.reconstruction)
    as_it_was = course.run(model, recorded, assumed)
    shares = [np.std(in_time[c] - as_it_was[c]) / np.std(y) for c, y in record.answers.items()]
    return float(np.max(shares))
