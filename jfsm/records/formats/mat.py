"""MATLAB files, of version 7.3 (which are HDF5) and before."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import scipy.io

from jfsm.records.formats.base import ABOUT, AbstractFormat, Contents, Lazy
from jfsm.records.formats.hdf5 import NUMERIC, dataset, opened


class MatFormat(AbstractFormat):
    """Variables by name; a field of a struct as ``struct.field``."""

    name: ClassVar[str] = "MATLAB"
    suffixes: ClassVar[tuple[str, ...]] = (".mat",)

    def recognises(self, begins_with: bytes, path: Path) -> bool:
        return begins_with.startswith(b"MATLAB ") or _is_version_4(begins_with)

    def load(self, path: Path) -> Contents:
        try:
            variables = scipy.io.loadmat(path, squeeze_me=True, struct_as_record=False)
        except NotImplementedError:
            return _version_7_3(path)
        except Exception as error:  # whatever the reader stumbles over in bytes that are no such file
            raise ValueError(
                f"{path.name} must be a MATLAB file; it cannot be opened as one ({error}), and may be cut short. "
                f"Write or copy it again."
            ) from error
        remarks = json.loads(str(variables.pop(ABOUT))) if ABOUT in variables else {}
        arrays: dict[str, np.ndarray] = {}
        units: dict[str, str] = {}
        for name, value in variables.items():
            if not name.startswith("__"):
                for path_name, leaf in _leaves(name, value):
                    arrays[path_name] = np.asarray(leaf)
        units.update(remarks.pop("units", {}))
        return Contents(arrays, units, remarks)

    def save(self, path: Path, contents: Contents) -> None:
        remarks = json.dumps({"units": dict(contents.units), **contents.about})
        variables = {name: np.atleast_1d(array) for name, array in contents.arrays.items()}
        scipy.io.savemat(path, {**variables, ABOUT: remarks}, oned_as="column", do_compression=True)


def _is_version_4(begins_with: bytes) -> bool:
    """Whether a file begins with the header of a matrix of MATLAB 4, whose files have no mark of their own.

    Five integers: the type (thousands for the byte order, tens for the number format), rows, columns, whether complex,
    and the length of a name that ends in a zero.
    """
    for order in ("little", "big"):
        kind, rows, columns, imaginary, length = (
            int.from_bytes(begins_with[at : at + 4], order) for at in range(0, 20, 4)
        )
        if kind in (0, 10, 20, 30, 40, 50, 1000, 1010, 1020, 1030, 1040, 1050) and imaginary in (0, 1):
            name = begins_with[20 : 20 + length]
            if 0 < length < 64 and rows and columns and name.endswith(b"\0") and name[:-1].isalnum():
                return True
    return False


def _leaves(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """The numeric arrays below a variable, with their dotted names."""
    if hasattr(value, "_fieldnames"):
        for field in value._fieldnames:
            yield from _leaves(f"{name}.{field}", getattr(value, field))
    elif isinstance(value, int | float | np.ndarray | np.number) and np.asarray(value).dtype.kind in NUMERIC:
        yield name, value


def _version_7_3(path: Path) -> Contents:
    """The same names and shapes as from an older file: MATLAB keeps structs as groups, and arrays transposed."""
    demand = f"{path.name} must be a MATLAB file"
    places: dict[str, str] = {}

    def visit(place: str, item: Any) -> None:
        if not hasattr(item, "dtype") or item.dtype.kind not in NUMERIC or place.startswith("#"):
            return  # groups, cells, and what MATLAB files away under #refs#
        is_text = item.attrs.get("MATLAB_class", b"double") in (b"char", "char")
        is_sparse = "MATLAB_sparse" in item.parent.attrs  # its parts are indices and values
        if not (is_text or is_sparse or "MATLAB_empty" in item.attrs):
            places[place.replace("/", ".")] = place

    with opened(path, demand) as file:
        file.visititems(visit)

    def array(name: str) -> np.ndarray:
        with opened(path, demand) as file:
            return np.squeeze(dataset(file, places[name]).T)

    return Contents(Lazy(places, array))
