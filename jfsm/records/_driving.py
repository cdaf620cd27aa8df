"""What a channel that drives tells of the drive, and of its own noise."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jfsm.records._noise_floor import noise_floor
from jfsm.records._tones import tones

OVERSAMPLED = 3
"""Samples per knot from which a spline's curve may stand for the drive: the band above holds noise only."""
UNTOLD = 1e-3
"""Noise of a channel that does not tell it, as a share of the channel's standard deviation."""
LEAST = 1e-4
"""Noise of a channel that is not smoothed, as a share of its standard deviation, at least."""


class Driving(NamedTuple):
    """Samples (n,) of a channel that drives, to run with, and their noise.

    `floor` is the standard deviation with which they were measured; `by_sample` the variance that smoothing leaves in a
    sample, and `in_motion` that of white noise as strong as what it leaves where the structure moves. The channel tells
    its noise if `told`; it is an assumption otherwise.
    """

    samples: NDArray[np.float64]
    floor: float
    by_sample: float
    in_motion: float
    told: bool


def driving(samples: NDArray[np.float64], dt: float) -> Driving:
    """What drives, as a channel (n,) tells it.

    Where it is smooth on its own grid, its noise is smoothed away. A spline leaves all of it in the band of the motion,
    a sum of tones next to nothing. A signal that reaches farther up stays as it was measured; if it fills the band,
    nothing tells its noise, which is taken as a thousandth of it.
    """
    floor = noise_floor(samples, dt)
    told = not (floor.fills_band or floor.silent)
    if not told or floor.spacing < OVERSAMPLED:
        size = float(np.std(samples))
        std = max(floor.std, LEAST * size) if told else UNTOLD * size
        return Driving(samples, std, std**2, std**2, told)
    few = tones(samples, floor)
    parameters = floor.effective_parameters if few is None else few.parameters
    by_sample = floor.std**2 * parameters / samples.size
    curve, in_motion = (floor.smooth, floor.std**2) if few is None else (few.curve, by_sample)
    return Driving(curve, floor.std, by_sample, in_motion, told)
