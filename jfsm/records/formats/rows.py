"""One run out of a table that holds many, one below the other."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jfsm.records.formats.base import Contents, Lazy
from jfsm.records.formats.lookup import choose, listed, samples_of


def rows_where(contents: Contents, source: str, where: Mapping[str, str | float]) -> Contents:
    """The rows in which every column that is named has its value, with a note of how many they are.

    Raises
    ------
    ValueError
        If a column does not exist, is no single column, is not as long as another, or if no row is left.
    """
    mask = np.empty(0, dtype=bool)
    for name, value in where.items():
        if not isinstance(name, str):
            raise TypeError(f"`where` must name columns, as {{'run': 3}}; one name is {name!r}.")
        column = _column(contents, source, name, value)
        if column.ndim != 1 or (mask.size and column.shape != mask.shape):
            raise ValueError(
                f"`where` must name columns of one length; {name!r} in {source} has shape {column.shape}. "
                f"Name a column of the table."
            )
        mask = mask & (column == value) if mask.size else column == value
        if not mask.any():
            held = listed(np.unique(column).tolist())
            raise ValueError(
                f"`where` must leave rows of {source}; none has {_said(where)}. {name!r} holds {held}. Ask for those."
            )

    def rows(array: Any) -> NDArray[Any]:
        array = np.asarray(array)
        along = [axis for axis, size in enumerate(array.shape) if size == mask.size]
        return np.compress(mask, array, axis=along[0]) if along else array

    note = f"Rows with {_said(where)}: {int(mask.sum())} of {mask.size}."
    return replace(
        contents,
        arrays=Lazy(contents.arrays, lambda name: rows(contents.arrays[name])),
        clocks=Lazy(contents.clocks, lambda name: rows(contents.clocks[name])),
        notes=(*contents.notes, note),
    )


def _column(contents: Contents, source: str, name: str, value: str | float) -> NDArray[Any]:
    choice = choose(contents, source, "where", name)
    if isinstance(value, str) and choice.array in contents.texts:
        return contents.texts[choice.array]
    return samples_of(contents, source, choice)


def _said(where: Mapping[str, str | float]) -> str:
    return " and ".join(f"{name} = {value}" for name, value in where.items())
