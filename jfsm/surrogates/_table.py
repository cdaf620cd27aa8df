"""A map of one displacement and one velocity frozen to a table, for simulation in constant time per call."""

from pathlib import Path
from typing import Any, BinaryIO

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float

from .._types import as_array
from ..structures import MapTerm
from ._map import AbstractForceStateMap

NODES = 96
"""Nodes per axis unless asked otherwise: one size for all, so that one compiled program serves every table."""


class HermiteTable(eqx.Module):
    """Bicubic Hermite interpolation of a force state map on a regular grid; build it with `tabulate`.

    Outside the box the force is that at the nearest point of the box: it stays bounded, and its derivative across
    the edge is zero there. `inside` tells a motion that left.
    """

    jets: Float[Array, "4 nodes nodes"]
    """Force, its two slopes per cell and its twist per cell [N], at every node."""
    lower: Float[Array, " 2"]
    step: Float[Array, " 2"]
    error: Float[Array, ""]
    """Largest difference from the map, in its unit, at midpoints of cells that were visited."""
    box_error: Float[Array, ""]
    """The same at all midpoints, where the map extrapolates too."""

    def __call__(self, d: Float[ArrayLike, "..."], w: Float[ArrayLike, ""] | None = None) -> Float[Array, ""]:
        """Force at displacement `d` and velocity `w`; `d` alone may be a state (2,), as for any map."""
        state = jnp.asarray(d) if w is None else jnp.stack([d, w])
        return _interpolate(self.jets, self.lower, self.step, state)

    def inside(self, d: Float[Array, ""], w: Float[Array, ""]) -> Bool[Array, ""]:
        """Whether the state lies in the box, where the table follows the map."""
        place = (jnp.stack([d, w]) - self.lower) / self.step
        return jnp.all((place >= 0.0) & (place <= self.jets.shape[1] - 1))

    def on(self, at: tuple[int, int] = (0, 1)) -> MapTerm:
        """This table as a term of a structure, on the link `at`."""
        return MapTerm(self, at=at)

    def save(self, file: str | Path | BinaryIO) -> None:
        """Write the table as any map: an npz file that `jfsm.load_map` reads."""
        from ._map_file import save_map

        save_map(self, file)


def _interpolate(
    jets: Float[Array, "4 nodes nodes"], lower: Float[Array, " 2"], step: Float[Array, " 2"], state: Float[Array, " 2"]
) -> Float[Array, ""]:
    cells = jets.shape[1] - 1
    place = jnp.clip((state - lower) / step, 0.0, cells)
    cell = jnp.minimum(place.astype(int), cells - 1)
    (value_d, slope_d), (value_w, slope_w) = (_hermite(place[axis] - cell[axis]) for axis in (0, 1))
    corners = jax.lax.dynamic_slice(jets, (0, cell[0], cell[1]), (4, 2, 2))
    weights = jnp.stack(
        [jnp.outer(a, b) for a, b in ((value_d, value_w), (slope_d, value_w), (value_d, slope_w), (slope_d, slope_w))]
    )
    return jnp.sum(weights * corners)


def _hermite(u: Float[Array, ""]) -> Float[Array, "2 2"]:
    """Weights of the values (first row) and of the slopes per cell (second) at the two ends of a cell, u in [0, 1]."""
    value = u * u * (3.0 - 2.0 * u)
    return jnp.stack([1.0 - value, value, u * (1.0 - u) ** 2, u * u * (u - 1.0)]).reshape(2, 2)


def tabulate(force_map: AbstractForceStateMap, box: Any = None, nodes: int = NODES) -> HermiteTable:
    """Table of a two-column, one-output map from its own values and derivatives.

    Parameters
    ----------
    force_map : AbstractForceStateMap
        Over one displacement and one velocity.
    box : (2, 2) array, optional
        Lowest (first row) and highest displacement and velocity; the visited box when None.
    nodes : int
        Nodes per axis. Every size compiles programs of its own.

    Returns
    -------
    HermiteTable
        With its error measured against the map at the cell midpoints, where it is largest for smooth maps.

    Raises
    ------
    ValueError
        If the map has other columns or outputs, or the box is empty.

    Notes
    -----
    Needs the mixed second derivative, hence a map of order 2 or more.
    """
    if force_map.dim != 2:
        raise ValueError(f"`force_map` must have two columns, displacement and velocity; it has {force_map.dim}.")
    if nodes < 2:
        raise ValueError(f"`nodes` must be 2 or more; got {nodes}.")
    limits = as_array(force_map.box if box is None else box, "box", 2)
    if limits.shape != (2, 2) or not np.all(limits[0] < limits[1]):
        raise ValueError(
            "`box` must be (2, 2), a row of lower and a row of higher limits of (displacement, velocity); "
            f"got {limits.tolist()}."
        )
    step = (limits[1] - limits[0]) / (nodes - 1)
    axes = np.linspace(limits[0], limits[1], nodes)
    derivatives = np.asarray(force_map.evaluate_derivatives(_grid(axes), ((0, 0), (1, 0), (0, 1), (1, 1))))
    if derivatives.ndim != 2:
        raise ValueError(f"`force_map` must have one output; it has {derivatives.shape[2]}. Fit one map per output.")
    per_cell = derivatives * np.array([1.0, step[0], step[1], step.prod()])
    jets = jnp.asarray(per_cell.T.reshape(4, nodes, nodes))
    lower, steps = jnp.asarray(limits[0]), jnp.asarray(step)
    midpoints = _grid(axes[:-1] + step / 2.0)
    error = np.abs(
        np.asarray(_interpolate_many(jets, lower, steps, jnp.asarray(midpoints)) - force_map.evaluate(midpoints))
    )
    visited_error = np.max(error, initial=0.0, where=force_map.visited(midpoints))
    return HermiteTable(jets, lower, steps, jnp.asarray(visited_error), jnp.asarray(error.max()))


def _grid(axes: np.ndarray) -> np.ndarray:
    """All pairs of the two columns of `axes`, the second one running fastest."""
    return np.stack(np.meshgrid(axes[:, 0], axes[:, 1], indexing="ij"), axis=-1).reshape(-1, 2)


_interpolate_many = jax.jit(jax.vmap(_interpolate, in_axes=(None, None, None, 0)))
