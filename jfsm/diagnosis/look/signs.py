"""The sign of a measured force against what the linear part of a model makes of it."""

from collections.abc import Iterator, Mapping

import numpy as np
from scipy.integrate import cumulative_trapezoid

from ..._result import Check
from ...plant import Channel
from ...records import Pieces, Record
from ..thresholds import THRESHOLDS
from ..verdict.checks import checked
from .spectra import Ratio

_KINDS = ("displacement", "velocity", "acceleration")


def force_signs(record: Record, ratios: Mapping[Channel, Ratio], pieces: Pieces) -> Iterator[Check]:
    """The phase of the motion against the model's, at the points that a force drives.

    A resonance that is elsewhere than in the model turns the phase as well; so the force must also take energy out of
    its point, beyond chance, to be called inverted.
    """
    for kind, j in record.channels:
        seen = next(((k, j) for k in _KINDS if (k, j) in ratios), None)
        if kind != "force" or seen is None:
            continue
        cosine, power = ratios[seen].cosine, taken(record.channels["force", j], record.channels[seen], seen[0], pieces)
        says = f"{seen[0]} {j} follows force {j} with a cosine of {cosine:.2f} to the phase that the model has"
        if cosine > THRESHOLDS.opposed or power < -THRESHOLDS.opposed_power:
            yield checked("follows_model", f"force {j}", max(cosine, min(1.0, -power)), THRESHOLDS.opposed, says)
            continue
        words = (
            f"force {j} has the wrong sign, or all motion of that point has: {says}, and it takes energy out of its "
            f"point (by {power:.3g} standard errors)"
        )
        yield checked("follows_model", f"force {j}", cosine, THRESHOLDS.opposed, words)


def taken(force: np.ndarray, y: np.ndarray, kind: str, pieces: Pieces) -> float:
    """Standard errors by which the mean power of a force at its own point is negative."""
    order = _KINDS.index(kind)
    motion = y - y.mean()
    if order == 2:
        motion = cumulative_trapezoid(motion, dx=pieces.dt, initial=0.0)
    v, f = pieces.spectra(motion - motion.mean(), max(0, 1 - order)), pieces.spectra(force - force.mean())
    power = np.sum((f * v.conj()).real[:, 3:], axis=1)
    scatter = float(np.std(power, ddof=1)) / np.sqrt(power.size / 2.0)  # pieces overlap by half
    return float(-np.mean(power) / max(scatter, 1e-300))
