"""Pictures of single objects for a notebook or a script: lines over lines, and maps, on axes of matplotlib."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

_WIDTH, _HEIGHT = 7.0, 2.2
"""Inches of a figure that is made here, of each panel."""


class Line(NamedTuple):
    """One line: what it is called (empty: nothing), its points, and how it is drawn, as ``"--"``."""

    label: str
    x: ArrayLike
    y: ArrayLike
    style: str = "-"


class PanelOf(NamedTuple):
    """Lines on one pair of axes, with what stands along them, units included."""

    x: str
    y: str
    lines: Sequence[Line]


def axes_for(count: int, ax: Any = None) -> np.ndarray:
    """So many axes: those given, or new ones of a figure of pyplot, one below another.

    Raises
    ------
    ValueError
        If another number of axes was given.
    """
    if ax is None:
        import matplotlib.pyplot as plt

        size = (_WIDTH, max(_HEIGHT * count, 3.2))
        return plt.subplots(count, 1, figsize=size, layout="constrained", squeeze=False)[1][:, 0]
    given = np.atleast_1d(np.asarray(ax, dtype=object)).ravel()
    if given.size != count:
        raise ValueError(f"`ax` must be {count} axes, as plt.subplots({count})[1] gives; got {given.size}.")
    return given


def draw_panels(panels: Sequence[PanelOf], ax: Any = None) -> Any:
    """The axes with the panels drawn: one, or an array of several."""
    axes = axes_for(len(panels), ax)
    for panel, on in zip(panels, axes, strict=True):
        for i, line in enumerate(panel.lines):
            colour = f"C{[each.label for each in panel.lines].index(line.label)}" if line.label else f"C{i}"
            first = line.label and line.label not in [each.label for each in panel.lines[:i]]
            on.plot(line.x, line.y, line.style, color=colour, linewidth=1.0, label=line.label if first else None)
        on.set(xlabel=panel.x, ylabel=panel.y)
        if len({line.label for line in panel.lines if line.label}) > 1:
            on.legend()
    return axes[0] if len(axes) == 1 else axes


def draw_surface(x: np.ndarray, y: np.ndarray, values: np.ndarray, labels: tuple[str, str, str], ax: Any = None) -> Any:
    """The axes with values (x, y) as colours, and their scale."""
    [on] = axes_for(1, ax)
    largest = float(np.nanmax(np.abs(values)))
    drawn = on.pcolormesh(x, y, values.T, cmap="RdBu_r", vmin=-largest, vmax=largest, shading="gouraud")
    on.figure.colorbar(drawn, ax=on, label=labels[2])
    on.set(xlabel=labels[0], ylabel=labels[1])
    return on


def draw_intervals(names: Sequence[str], low: ArrayLike, high: ArrayLike, label: str, ax: Any = None) -> Any:
    """The axes with an interval for each name, about zero."""
    [on] = axes_for(1, ax)
    rows = np.arange(len(names))[::-1]
    on.hlines(rows, low, high, linewidth=3.0)
    on.axvline(0.0, color="0.5", linewidth=0.6)
    on.set_yticks(rows, names)
    on.set_xlabel(label)
    return on
