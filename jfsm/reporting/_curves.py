"""Curves for drawing: arrays from lists, fewer points, a stretch worth a closer look."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Curve = NDArray[np.float64]


def curve(values: Sequence[Any] | None) -> Curve:
    """Float array of a list in which None, as JSON has it, is a gap."""
    return np.array([] if values is None else values, dtype=np.float64)


def first_channels(curves: Mapping[str, Any], most: int) -> tuple[dict[str, Any], str]:
    """The same curves with the first channels alone, and a sentence that says so where some are left out."""
    channels = curves["channels"]
    words = f" {most} of {len(channels)} channels are shown." if most < len(channels) else ""
    return {**curves, "channels": dict(list(channels.items())[:most])}, words


def rms(values: Curve) -> float | None:
    """Root mean square of what is there; None if nothing is."""
    there = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(there**2))) if there.size else None


def peak(*curves: Curve) -> float:
    """Largest magnitude in any of the curves; 0 where there is none."""
    return max((float(np.nanmax(np.abs(c))) for c in curves if np.isfinite(c).any()), default=0.0)


def envelope(x: Curve, y: Curve, columns: int = 1200, log: bool = False) -> tuple[Curve, Curve]:
    """At most two points a column, the lowest and the highest: looks the same as all points in a line drawing.

    Columns are equally wide; with `log`, on a logarithmic axis of which `x` is a uniform grid from near 0.
    """
    if x.size <= 2 * columns:
        return x, y
    spaced = np.geomspace(1, x.size, columns) - 1 if log else np.linspace(0, x.size, columns + 1)
    edges = np.append(np.unique(spaced.astype(int)[:-1]), x.size)
    filled = np.where(np.isfinite(y), y, 0.0)
    kept = [
        first + at
        for first, last in zip(edges[:-1], edges[1:], strict=True)
        for at in sorted({int(np.argmin(filled[first:last])), int(np.argmax(filled[first:last]))})
    ]
    return x[kept], y[kept]


def loudest_stretch(y: Curve, periods: int = 6) -> slice | None:
    """Samples of about so many periods around the largest value; None if that is most of the curve anyway."""
    centred = np.where(np.isfinite(y), y, 0.0) - np.nanmean(y) if np.isfinite(y).any() else np.zeros(y.size)
    # Noise crosses zero often; half of the rms on either side has to be passed for a crossing to count.
    threshold = 0.5 * np.sqrt(np.mean(centred**2)) if y.size else 0.0
    sides = np.sign(centred)[np.abs(centred) > threshold]
    turns = np.count_nonzero(np.diff(sides))
    if turns < 4 * periods:
        return None
    length = round(2 * periods * y.size / turns)
    first = int(np.clip(np.argmax(np.abs(centred)) - length // 2, 0, y.size - length))
    return slice(first, first + length)
