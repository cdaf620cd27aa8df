"""The force that the simulation leaves over: along each axis of the state, and as a map over the plane."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from jfsm.reporting._canvas import AFTER, FLOOR, INK, PAPER, dots, key_above, label
from jfsm.reporting._curves import Curve, curve, peak
from jfsm.reporting._quantities import Scale, quantity, scale_for
from jfsm.reporting._wording import capitalised

AXES = {"displacement": "velocity", "velocity": "displacement"}  # an axis, and the other one
NEAR_ZERO = 0.2  # of the other axis' peak: points that the law's line, drawn for 0 there, should meet
MOST_POINTS = 4000
LEVELS = 15
ZERO_LINE = "#3a444e"  # crosses the pale middle of the colours, in a dark theme too


RESIDUAL, LAW = "residual force", "named law"


def draw_residual(
    figure: FigureBase,
    residual: Mapping[str, Any],
    law: Mapping[str, Any] | None,
    name: str = RESIDUAL,
    line_name: str = LAW,
) -> None:
    """Points of a force against displacement and against velocity, the line of a law or a map over them.

    A line has a band where its error is given.
    """
    both = [figure.add_subplot(1, 2, place) for place in (1, 2)]
    draw_residual_on(both, residual, law, name, line_name)


def draw_residual_on(
    both: Sequence[Axes],
    residual: Mapping[str, Any],
    law: Mapping[str, Any] | None,
    name: str = RESIDUAL,
    line_name: str = LAW,
) -> None:
    """`draw_residual` on two axes."""
    force, units = curve(residual["force"]), residual.get("unit") or {}
    force_scale = scale_for(peak(force), units.get("force"))
    for axes, (axis, other) in zip(both, AXES.items(), strict=True):
        scale = scale_for(peak(curve(residual[axis])), units.get(axis))
        points = curve(residual[axis]) / scale.factor, force / force_scale.factor
        _draw_points(axes, *points, curve(residual[other]), other)
        if law and law.get(f"force_of_{axis}"):
            along, line = curve(law[axis]) / scale.factor, curve(law[f"force_of_{axis}"]) / force_scale.factor
            if f"error_of_{axis}" in law:
                half = curve(law[f"error_of_{axis}"]) / force_scale.factor
                axes.fill_between(along, line - half, line + half, color=AFTER, alpha=0.25, linewidth=0.0)
            axes.plot(along, line, color=AFTER, linewidth=2.0, label=line_name)
        label(axes, f"{axis} [{scale.unit}]", f"{name} [{force_scale.unit}]")
        key_above(axes, 3)


def _draw_points(axes: Axes, along: Curve, force: Curve, across: Curve, other: str) -> None:
    """Where the other axis is near 0 the points are strong: these are the ones to compare with the line."""
    step = max(1, -(-force.size // MOST_POINTS))
    near = np.abs(across) <= NEAR_ZERO * peak(across)
    for chosen, colour, text in ((~near, FLOOR, "all"), (near, INK, f"{other} near 0")):
        dots(axes, along[chosen][::step], force[chosen][::step], colour, text)
    axes.autoscale_view()


def describe_residual(
    residual: Mapping[str, Any], law: Mapping[str, Any] | None, name: str = RESIDUAL, line_name: str = LAW
) -> str:
    """The picture in words."""
    units = residual.get("unit") or {}
    reach = [f"{axis} up to {quantity(peak(curve(residual[axis])), units.get(axis))}" for axis in AXES]
    force = quantity(peak(curve(residual["force"])), units.get("force"))
    line = f" The {line_name} is drawn through the points." if law else ""
    return f"{capitalised(name)}, up to {force}, against {reach[0]} and against {reach[1]}.{line}"


def draw_map(
    figure: FigureBase,
    force_map: Mapping[str, Any],
    units: Mapping[str, str],
    name: str = RESIDUAL,
    readings: Mapping[str, Any] | None = None,
    edges: Sequence[Mapping[str, Any]] = (),
) -> None:
    """Filled contours of a force over displacement and velocity; pale where the record never was.

    With the states of its readings as dots, and lines where it jumps or kinks, if these are given.
    """
    x, v, force = (curve(force_map[part]) for part in ("displacement", "velocity", "force"))
    scales = [
        _scale(values, units.get(kind)) for values, kind in ((x, "displacement"), (v, "velocity"), (force, "force"))
    ]
    x, v, force = (values / scale.factor for values, scale in zip((x, v, force), scales, strict=True))
    visited = np.array(force_map["visited"], dtype=bool) if force_map.get("visited") else np.ones(force.shape, bool)
    # The colours serve the visited region: a map extrapolates to forces that would drown it.
    limit = peak(force[visited]) or peak(force) or 1.0
    levels = np.linspace(-limit, limit, LEVELS)
    axes = figure.add_subplot()
    shown = np.clip(force, -limit, limit).T
    filled = axes.contourf(x, v, shown, levels=levels, cmap="RdBu_r")
    axes.contour(x, v, shown, levels=[0.0], colors=ZERO_LINE, linewidths=0.9)
    if visited.any() and not visited.all():
        axes.contourf(x, v, visited.T.astype(float), levels=[-1.0, 0.5], colors=PAPER, alpha=0.7)
        axes.contour(x, v, visited.T.astype(float), levels=[0.5], colors=INK, linewidths=0.8, linestyles="dashed")
    if readings:
        x, v = (curve(readings[kind]) / scale.factor for kind, scale in zip(AXES, scales, strict=False))
        dots(axes, x, v, INK, "", width=1.0)
    for edge in edges:
        across = axes.axvline if edge["axis"] == "displacement" else axes.axhline
        across(edge["offset"] / scales[list(AXES).index(edge["axis"])].factor, color=INK, linewidth=1.2, linestyle=":")
    bar = figure.colorbar(filled, ax=axes, pad=0.02, ticks=levels[:: (LEVELS - 1) // 2])
    bar.set_label(f"{name} [{scales[2].unit}]")
    bar.outline.set_visible(False)  # pyright: ignore[reportCallIssue]
    axes.grid(False)
    label(axes, f"displacement [{scales[0].unit}]", f"velocity [{scales[1].unit}]")


def describe_map(force_map: Mapping[str, Any], units: Mapping[str, str], name: str = RESIDUAL) -> str:
    """The picture in words."""
    visited = force_map.get("visited")
    share = f"; the record visited {100 * np.mean(visited):.0f} % of the plane shown" if visited else ""
    force = curve(force_map["force"])
    low, high = (quantity(float(bound), units.get("force")) for bound in (np.nanmin(force), np.nanmax(force)))
    return f"Map of the {name} over displacement and velocity, from {low} to {high}{share}."


def _scale(values: Curve, unit: str | None) -> Scale:
    return scale_for(peak(values), unit)
