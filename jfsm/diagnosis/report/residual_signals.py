"""A missing force over time, frequency and past, for the report: plain lists."""

from typing import Any

import numpy as np
from scipy.signal import welch

from ..evidence.missing_force import Residual

_SHOWN = 2000
"""Readings over time."""
_SEGMENT = 512
"""Readings of a segment of the spectrum, at most."""
_PERIODS = 4.0
"""Past that is looked at, in periods of the structure."""
_LAGS = 200
_CHANCE = 1.96
"""Standard deviations of a correlation that chance stays within, 19 times in 20."""


def course(found: Residual, start: float, dt: float, period: float) -> dict[str, Any]:
    """Force with its standard error over time, its density over frequency, and what it owes to its past.

    The last is the correlation with itself of what the map leaves, which is error, correlated over a part of a period,
    where the force is a matter of displacement and velocity; of the force itself where there is no map.
    """
    n = min(found.force.size, _SHOWN)
    force = found.force - np.mean(found.force)
    frequency, density = welch(force, 1 / dt, nperseg=min(_SEGMENT, force.size), detrend="constant")
    left = found.force
    if found.force_map is not None:
        left = left - np.asarray(found.force_map.evaluate(np.column_stack([found.displacement, found.velocity])))
    left = left - np.mean(left)
    most = min(int(_PERIODS * period / dt), left.size // 2)
    lags = np.unique(np.linspace(1, max(most, 1), _LAGS).astype(int))
    power = max(float(left @ left), np.finfo(float).tiny)
    correlation = [float(left[lag:] @ left[:-lag]) / power for lag in lags]
    return {
        "time": (start + dt * np.arange(n)).tolist(),
        "force": found.force[:n].tolist(),
        "error": found.std[:n].tolist(),
        "frequency": frequency[1:].tolist(),
        "density": density[1:].tolist(),
        "lag": (lags * dt / period).tolist(),
        "correlation": correlation,
        "chance": _CHANCE / np.sqrt(left.size),
    }
