"""Where in its phase plane a channel has been: what a record can tell of a force, it tells there."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jfsm.records._tapers import Samples

CELLS = 10  # across


@dataclass(frozen=True)
class PhasePlane:
    """A channel against its rate of change, both about their middle.

    Attributes
    ----------
    centre : float
        Mean of the channel, in its unit.
    reach, rate_reach : float
        Largest distance from the mean, in the channel's unit, and largest rate of change, in its unit per second.
    time : (10, 10) float array
        Share of the samples in each cell, by value and by rate, which reach from −reach to +reach.
    coverage : float
        Share of the cells within the disc (an ellipse with these half axes) that are entered at all.
    """

    centre: float
    reach: float
    rate_reach: float
    time: NDArray[np.float64]
    coverage: float


def phase_plane(y: Samples, dt: float) -> PhasePlane:
    """Where a smooth channel (n,) sampled every `dt` seconds has been."""
    places = np.stack([y - y.mean(), np.gradient(y, dt)])
    reach = np.maximum(np.abs(places).max(axis=1), 1e-300)
    cells, edges, _ = np.histogram2d(*(places / reach[:, None]), bins=CELLS, range=[[-1.0, 1.0], [-1.0, 1.0]])
    centre = 0.5 * (edges[1:] + edges[:-1])
    entered = cells[np.hypot(*np.meshgrid(centre, centre)) <= 1.0] > 0
    return PhasePlane(float(y.mean()), float(reach[0]), float(reach[1]), cells / y.size, float(entered.mean()))
