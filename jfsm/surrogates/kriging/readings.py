"""Readings of a kriging map: checked, and merged in bins where they are too many for an exact fit."""

import os
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._readings import check_shapes, check_varied

MATRICES = 8
"""Matrices of the size of K that one evaluation of likelihood and gradient holds at once."""

MEMORY_SHARE = 0.8


class Checked(NamedTuple):
    """States, force with a trailing axis of outputs, and the noise of each reading relative to the others."""

    states: NDArray[np.float64]
    force: NDArray[np.float64]
    relative_noise: NDArray[np.float64]


def check_readings(states: Any, force: Any, size: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """States (n, dim) and force (n,) or (n, outputs) for a trend of `size` functions.

    Raises
    ------
    TypeError, ValueError
        If shapes disagree, values are not finite, a column is constant, or there are too few.
    """
    states, force = check_shapes(states, force)
    if len(states) <= size:
        raise ValueError(
            f"`states` must hold more points than the trend has functions, {size} in {states.shape[1]} columns; "
            f"got {len(states)}. Add data or take a simpler trend, such as `trend='constant'`."
        )
    check_varied(states)
    return states, np.asarray(force)


def check_memory(points: int) -> None:
    """Refuse what would not fit before any work is done.

    Raises
    ------
    MemoryError
        With the memory needed, the memory there is, and the number of points that would fit.
    """
    if not hasattr(os, "sysconf"):
        return
    there = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    if memory_needed(points) > MEMORY_SHARE * there:
        fitting = int((MEMORY_SHARE * there / memory_needed(1)) ** 0.5)
        raise MemoryError(
            f"An exact map of {points} points needs {memory_needed(points) / 2**30:.1f} GiB, and this machine has "
            f"{there / 2**30:.1f} GiB. Set `points` to {fitting // 100 * 100} or less: more are merged to means."
        )


def memory_needed(points: int) -> int:
    """Bytes that the likelihood of so many points and its gradient take."""
    return 8 * MATRICES * points**2


def merge(readings: Checked, points: int) -> Checked:
    """Means over cells of the finest regular grid of which at most `points` hold readings; the fullest are halved until
    there are as many as `points`.

    Every number of points has its own programs. Of readings in fewer places fewer are left.

    Notes
    -----
    A mean of c equal readings has 1/c of their noise, so that every reading counts. What is lost is the change of the
    force within a cell beyond its linear part. The work grows like n log n, the memory like n.
    """
    lower = readings.states.min(axis=0)
    place = (readings.states - lower) / (readings.states.max(axis=0) - lower)
    few, many = 1, points + 1  # cells per axis: `few` fit, `many` do not
    while many - few > 1:
        middle = (few + many) // 2
        if len(np.unique(_cells(place, middle))) <= points:
            few = middle
        else:
            many = middle
    cell, before = np.unique(_cells(place, few), return_inverse=True)[1], 0
    while before < (count := int(cell.max()) + 1) < points:
        cell, before = _halved(place, cell, points - count), count
    weight = 1.0 / readings.relative_noise
    total = np.bincount(cell, weight)

    def mean(columns: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.stack([np.bincount(cell, weight * column) / total for column in columns.T], axis=1)

    return Checked(mean(readings.states), mean(readings.force), 1.0 / total)


def _halved(place: NDArray[np.float64], cell: NDArray[np.int64], most: int) -> NDArray[np.int64]:
    """Cells (n,), up to `most` of them, the fullest, halved across their longer side; equal states stay together."""
    count = np.bincount(cell)
    mean = np.stack([np.bincount(cell, column) / count for column in place.T], axis=1)
    apart = np.square(place - mean[cell])
    width = np.stack([np.bincount(cell, column) for column in apart.T], axis=1)
    wide = np.flatnonzero(np.any(width > 0, axis=1))
    chosen = wide[np.argsort(-count[wide], kind="stable")[:most]]
    number = np.full(len(count), -1)
    number[chosen] = len(count) + np.arange(len(chosen))
    rows, axis = np.arange(len(cell)), np.argmax(width, axis=1)[cell]
    upper = (number[cell] >= 0) & (place[rows, axis] > mean[cell, axis])
    return np.unique(np.where(upper, number[cell], cell), return_inverse=True)[1]


def _cells(place: NDArray[np.float64], per_axis: int) -> NDArray[np.int64]:
    """Number of the cell of each row of `place`, whose columns run from 0 to 1."""
    number = np.zeros(len(place), dtype=np.int64)
    for column in place.T:
        # wraps around beyond 2⁶³ cells, which merges cells that are far apart only by an unlikely chance
        number = number * per_axis + np.minimum((column * per_axis).astype(np.int64), per_axis - 1)
    return number
