"""What a MATLAB 7.3 file holds, which is HDF5: the same structs, cells, texts and arrays as SciPy finds in older files.

After the attributes that MATLAB sets: ``MATLAB_class``, ``MATLAB_empty``, ``MATLAB_sparse``, ``MATLAB_object_decode``.
A struct is a group, an array of structs a group of references; a cell holds references; arrays are transposed.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from jfsm.records.formats.hdf5 import NUMERIC, dataset, is_elsewhere, longer_than_stated, opened, whole
from jfsm.records.formats.hdf5_texts import text_of


class Struct:
    """A struct, its fields as attributes, as SciPy has it."""

    def __init__(self, fields: Mapping[str, Any]):
        self._fieldnames = list(fields)
        vars(self).update(fields)


class Unread:
    """Something that is not read, and what it is."""

    def __init__(self, what: str):
        self.what = what


class Late:
    """An array of numbers that is read when NumPy asks for it."""

    def __init__(self, path: Path, demand: str, item: Any):
        self._path, self._demand, self._place = path, demand, item.name
        self.shape = tuple(size for size in reversed(item.shape) if size != 1)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        with opened(self._path, self._demand) as file:
            values = np.squeeze(dataset(file, self._place).T)
        return values if dtype is None else values.astype(dtype)


def variables(path: Path) -> tuple[dict[str, Any], str]:
    """The variables of a file by name, and a remark on its length, empty where that is as stated.

    Variables are structs, object arrays of cells, texts, and arrays that are read later.

    Raises
    ------
    ValueError
        If it is no such file, or parts of it cannot be read.
    """
    demand = f"{path.name} must be a MATLAB file"
    with opened(path, demand) as file:
        names = (name for name in _inside(file) if not name.startswith("#"))
        return {name: _value(file[name], path, demand) for name in names}, longer_than_stated(file, path)


def _inside(group: Any) -> list[str]:
    """The names in a group of what lies in this file."""
    import h5py

    return [name for name in group if isinstance(group.get(name, getlink=True), h5py.HardLink)]


def _value(item: Any, path: Path, demand: str) -> Any:
    kind = text_of(item, "MATLAB_class")
    if "MATLAB_sparse" in item.attrs:
        return Unread("a sparse matrix")
    if "MATLAB_object_decode" in item.attrs:
        return Unread(f"an object of class {kind}")
    if not hasattr(item, "dtype"):
        return _struct({name: item[name] for name in _inside(item)}, item.file, path, demand)
    if "MATLAB_empty" in item.attrs or item.shape is None:
        return np.empty(0)
    if is_elsewhere(item):
        return Unread("stored outside the file")
    if item.dtype.kind == "O":
        return _cells([_value(item.file[one], path, demand) for one in _references(item)])
    if kind == "char" and item.dtype.kind in "ui":
        return "".join(map(chr, whole(item).T.ravel(order="F").tolist()))
    return Late(path, demand, item) if item.dtype.kind in NUMERIC else Unread(kind or str(item.dtype))


def _struct(fields: Mapping[str, Any], file: Any, path: Path, demand: str) -> Any:
    """A struct, or an array of structs, whose fields are references without a class of their own."""
    if fields and all(
        hasattr(field, "dtype") and field.dtype.kind == "O" and "MATLAB_class" not in field.attrs
        for field in fields.values()
    ):
        columns = {name: [file[one] for one in _references(field)] for name, field in fields.items()}
        rows = (dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True))
        return _cells([Struct({name: _value(one, path, demand) for name, one in row.items()}) for row in rows])
    return Struct({name: _value(field, path, demand) for name, field in fields.items()})


def _references(item: Any) -> list[Any]:
    """What a dataset of references refers to, in MATLAB's order."""
    return whole(item).T.ravel(order="F").tolist()


def _cells(values: list[Any]) -> np.ndarray:
    cells = np.empty(len(values), dtype=object)
    for place, value in enumerate(values):
        cells[place] = value
    return cells
