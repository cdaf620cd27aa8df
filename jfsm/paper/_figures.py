"""The paper's figures: phase planes, force state maps as surfaces, sections through them."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.figure import Figure

from ..dynamics import simulate
from ..records import Record
from ..reporting._canvas import AFTER, BEFORE, INK, MEASURED, house_style, label
from ..structures import Structure
from ..surrogates import RKPM, AbstractForceStateMap
from ._rows import Drawing
from ._simulated import Run

GRID = 60
"""Points of a surface or a section along each axis."""
UNITS = ("x [m]", "v [m/s]")


def save_drawing(draw: Drawing, path: Path) -> Path:
    """A drawing as a PNG file."""
    with house_style():
        figure = Figure(layout="constrained")
        draw(figure)
        figure.savefig(path, dpi=120, facecolor="white")
    return path


def draw_example(x: Float[np.ndarray, "n 1"], force: Float[np.ndarray, " n"], plain: RKPM, enriched: RKPM) -> Drawing:
    """A force of one coordinate, its map with and without enrichment, the whole and about each discontinuity."""

    def draw(figure: Figure) -> None:
        places = [float(line.offset) for line in enriched.rule.across]  # pyright: ignore[reportAttributeAccessIssue]
        figure.set_size_inches(4.0 * (1 + len(places)), 3.2)
        windows = [(x[0, 0], x[-1, 0]), *((place - 0.12, place + 0.12) for place in sorted(places))]
        for axes, (low, high) in zip(figure.subplots(1, len(windows), squeeze=False)[0], windows, strict=True):
            fine = np.linspace(max(low, x[0, 0]), min(high, x[-1, 0]), 400)[:, None]
            inside = (x[:, 0] >= low) & (x[:, 0] <= high)
            axes.plot(x[inside, 0], force[inside], ".", color=MEASURED, label="readings")
            axes.plot(fine, plain.evaluate(fine), color=BEFORE, label="without enrichment")
            axes.plot(fine, enriched.evaluate(fine), color=AFTER, label="with enrichment")
            label(axes, "x [m]", "f [N]")
        figure.axes[0].legend()

    return draw


def draw_shape_functions(units: RKPM, nodes: Sequence[int]) -> Drawing:
    """Shape functions ψ_i (28) and θ_i (45) of some nodes, from a map of one output per node that is 1 there."""

    def draw(figure: Figure) -> None:
        figure.set_size_inches(8.0, 3.2)
        x = np.asarray(units.nodes.states)[list(nodes), 0]
        fine = np.linspace(x[0] - 0.1, x[-1] + 0.1, 800)[:, None]
        found = np.asarray(units.evaluate_derivatives(fine, ((0,), (1,))))[:, :, list(nodes)]
        for axes, curves, name in zip(figure.subplots(1, 2), np.moveaxis(found, 1, 0), ("ψ", "θ [1/m]"), strict=True):
            axes.plot(fine, curves)
            label(axes, "x [m]", name)

    return draw


def draw_map(run: Run, force_map: AbstractForceStateMap, title: str, across: bool = False) -> Drawing:
    """Phase plane, map as a surface over the visited box, section at v = 0 and, with `across`, that at x = 0."""

    def draw(figure: Figure) -> None:
        columns = 4 if across else 3
        figure.set_size_inches(3.8 * columns, 3.4)
        figure.suptitle(title)
        plane = figure.add_subplot(1, columns, 1)
        plane.plot(*run.states.T, color=AFTER, linewidth=0.5)
        plane.locator_params(axis="x", nbins=5)
        label(plane, *UNITS)
        grid = np.stack(np.meshgrid(*(_range(force_map, axis, GRID) for axis in (0, 1))), axis=-1)
        states = grid.reshape(-1, 2)
        surface = np.where(force_map.visited(states), force_map.evaluate(states), np.nan).reshape(GRID, GRID)
        axes: Any = figure.add_subplot(1, columns, 2, projection="3d")
        axes.plot_surface(grid[..., 0], grid[..., 1], surface, cmap="viridis", linewidth=0)
        axes.set(xlabel=UNITS[0], ylabel=UNITS[1], zlabel="f [N]")
        for column in range(3, columns + 1):
            _section(figure.add_subplot(1, columns, column), run, force_map, axis=column - 3)

    return draw


def _section(axes: Any, run: Run, force_map: AbstractForceStateMap, axis: int) -> None:
    """The map along one axis through the origin, and the truth."""
    states = np.zeros((4 * GRID, 2))
    states[:, axis] = _range(force_map, axis, 4 * GRID)
    visited = force_map.visited(states)
    axes.plot(
        states[visited, axis], run.true_force(states[visited]), color=INK, linewidth=2.5, alpha=0.4, label="truth"
    )
    axes.plot(states[visited, axis], force_map.evaluate(states[visited]), color=AFTER, label="map")
    axes.locator_params(axis="x", nbins=5)
    label(axes, UNITS[axis], f"f at {'v' if axis == 0 else 'x'} = 0 [N]")
    axes.legend()


def _range(force_map: AbstractForceStateMap, axis: int, count: int) -> np.ndarray:
    """Even steps over the visited range of one column."""
    low, high = np.asarray(force_map.box)[:, axis]
    return np.linspace(low, high, count)


def draw_orders(run: Run, maps: dict[int, RKPM]) -> Drawing:
    """Sections at v = 0 of maps of several orders, Figure 10 (c) to (f)."""

    def draw(figure: Figure) -> None:
        figure.set_size_inches(3.6 * len(maps), 3.2)
        panels = np.atleast_1d(figure.subplots(1, len(maps)))
        for axes, (order, force_map) in zip(panels, maps.items(), strict=True):
            _section(axes, run, force_map, axis=0)
            axes.set_title(f"order {order}")

    return draw


def draw_free_vibration(run: Run, force_map: AbstractForceStateMap, duration: float = 12.0) -> Drawing:
    """Free motions of the structure and of its map from one start, Figure 12 (c)."""

    def draw(figure: Figure) -> None:
        figure.set_size_inches(4.2, 3.4)
        time = np.linspace(0.0, duration, 1200)
        axes = figure.subplots()
        start = ([0.5], [0.0])
        for structure, colour, style, name in (
            (run.structure, INK, "-", "truth"),
            (Structure(run.structure.mass, [force_map.on()]), AFTER, "--", "map"),
        ):
            free = simulate(structure, Record(time, force=np.zeros(time.size)), start)
            axes.plot(free.displacement[:, 0], free.velocity[:, 0], style, color=colour, label=name)
        label(axes, *UNITS)
        axes.legend()

    return draw


def draw_section_of_chain(run: Run, force_map: AbstractForceStateMap) -> Drawing:
    """Force on the first mass along its velocity, all else zero, Figure 24."""

    def draw(figure: Figure) -> None:
        figure.set_size_inches(4.2, 3.2)
        axes = figure.subplots()
        states = np.zeros((4 * GRID, 4))
        states[:, 2] = _range(force_map, 2, 4 * GRID)
        axes.plot(states[:, 2], np.asarray(force_map.evaluate(states))[:, 0], color=AFTER)
        label(axes, "v1 [m/s]", "f1 [N]")

    return draw
