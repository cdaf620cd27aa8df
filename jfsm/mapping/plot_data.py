"""A force over the state of its link as pages draw it: plain lists."""

from typing import Any

import numpy as np

from .._types import evenly_taken
from ..surrogates import AbstractForceStateMap

GRID = 41
"""Points of a map along each axis."""
_POINTS = 1500


def shown_points(
    at: tuple[int, int], displacement: np.ndarray, velocity: np.ndarray, force: np.ndarray, units: Any
) -> dict[str, Any]:
    """Readings of the force, with their units."""
    take = evenly_taken(force.size, _POINTS)
    return {
        "at": list(at),
        "displacement": displacement[take].tolist(),
        "velocity": velocity[take].tolist(),
        "force": force[take].tolist(),
        "unit": {k: units[k] for k in ("displacement", "velocity", "force")},
    }


def shown_map(force_map: AbstractForceStateMap, x: np.ndarray, v: np.ndarray) -> dict[str, Any]:
    """The map on a grid, and where the record has been."""
    states = np.stack(np.meshgrid(x, v, indexing="ij"), -1).reshape(-1, 2)
    shape = (x.size, v.size)
    return {
        "displacement": x.tolist(),
        "velocity": v.tolist(),
        "force": np.asarray(force_map.evaluate(states)).reshape(shape).tolist(),
        "visited": np.asarray(force_map.visited(states)).reshape(shape).tolist(),
    }
