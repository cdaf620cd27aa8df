"""A missing force over time, over frequency, and beside its own past."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import FigureBase

from jfsm.reporting._canvas import AFTER, FLOOR, INK, label, log_axis
from jfsm.reporting._curves import curve, envelope, peak
from jfsm.reporting._quantities import number, quantity, scale_for

COLUMNS = 900


def draw_course(figure: FigureBase, course: Mapping[str, Any], unit: str | None) -> None:
    """The force with twice its standard error above; its density, and what it owes to its past, below."""
    time, force, error = (curve(course[part]) for part in ("time", "force", "error"))
    factor, shown = scale_for(peak(force), unit)
    grid = figure.add_gridspec(2, 2)
    above = figure.add_subplot(grid[0, :])
    above.fill_between(time, (force - 2 * error) / factor, (force + 2 * error) / factor, color=FLOOR, alpha=0.5, lw=0.0)
    above.plot(*envelope(time, force / factor, COLUMNS), color=INK, linewidth=0.8)
    label(above, "time [s]", f"residual force [{shown}]")
    left = figure.add_subplot(grid[1, 0])
    density = np.sqrt(curve(course["density"])) / factor
    left.plot(curve(course["frequency"]), density, color=INK, linewidth=0.9)
    log_axis(left, "y")
    label(left, "frequency [Hz]", f"[{shown}/√Hz]")
    right = figure.add_subplot(grid[1, 1])
    right.axhspan(-course["chance"], course["chance"], color=FLOOR, alpha=0.5, linewidth=0.0)
    right.plot(curve(course["lag"]), curve(course["correlation"]), color=AFTER, linewidth=1.2)
    label(right, "past [periods]", "what a map leaves")


def describe_course(course: Mapping[str, Any], unit: str | None) -> str:
    """The picture in words."""
    force, error, density = (curve(course[part]) for part in ("force", "error", "density"))
    strongest = number(float(curve(course["frequency"])[int(np.argmax(density))]))
    correlation = float(np.max(np.abs(curve(course["correlation"]))))
    return (
        f"Residual force over time, up to {quantity(peak(force), unit)}, with a standard error of "
        f"{quantity(float(np.median(error)), unit)}; strongest at {strongest} Hz; what a map leaves is correlated with "
        f"its own past by up to {number(correlation)}, chance by {number(course['chance'])}."
    )
