"""HDF5 files."""

import contextlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from jfsm.records.formats.base import ABOUT, AbstractFormat, Contents, Lazy

if TYPE_CHECKING:
    import h5py

SIGNATURE = b"\x89HDF\r\n\x1a\n"
NUMERIC = "iufcb"  # kinds of dtype that hold numbers


class Hdf5Format(AbstractFormat):
    """Datasets by path, ``group/name``; a field of a table as ``group/table.field``; units by attribute."""

    name: ClassVar[str] = "HDF5"
    suffixes: ClassVar[tuple[str, ...]] = (".h5", ".hdf5")

    def recognises(self, begins_with: bytes, path: Path) -> bool:
        return any(begins_with[place:].startswith(SIGNATURE) for place in (0, 512, 1024, 2048))

    def load(self, path: Path) -> Contents:
        units: dict[str, str] = {}
        places: dict[str, tuple[str, str | None]] = {}  # name -> dataset and, in a table, field

        def visit(name: str, item: Any) -> None:
            if not hasattr(item, "dtype") or item.shape is None:
                return
            if item.dtype.kind in NUMERIC:
                places[name] = name, None
            for column in item.dtype.names or ():
                if item.dtype[column].kind in NUMERIC:
                    places[f"{name}.{column}"] = name, column
            unit = item.attrs.get("units", item.attrs.get("unit"))
            if isinstance(unit, str | bytes):
                units[name] = unit.decode() if isinstance(unit, bytes) else unit

        with opened(path, f"{path.name} must be an HDF5 file") as file:
            file.visititems(visit)
            about = json.loads(str(file.attrs[ABOUT])) if ABOUT in file.attrs else {}

        def array(name: str) -> np.ndarray:
            place, column = places[name]
            with opened(path, f"{path.name} must be an HDF5 file") as file:
                return dataset(file, place) if column is None else dataset(file, place)[column]

        return Contents(Lazy(places, array), units, about)

    def save(self, path: Path, contents: Contents) -> None:
        import h5py

        with h5py.File(path, "w", track_order=True) as file:
            file.attrs[ABOUT] = json.dumps(dict(contents.about))
            for name, array in contents.arrays.items():
                file.create_dataset(name, data=array)
                file[name].attrs["units"] = contents.units.get(name, "1")


@contextlib.contextmanager
def opened(path: Path, demand: str) -> Iterator["h5py.File"]:
    """The file, open for reading.

    Raises
    ------
    ValueError
        If it is no HDF5 file or a part of one, beginning with `demand`.
    """
    import h5py  # loaded when a file asks for it, so that importing jfsm stays quick

    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise ValueError(
            f"{demand}; it cannot be opened as one ({error}), and may be cut short. Write or copy it again."
        ) from error
    with file:
        yield file


def dataset(file: "h5py.File", name: str) -> np.ndarray:
    """All values of one dataset."""
    return np.asarray(file[name][()])  # pyright: ignore[reportIndexIssue]  # a name that was found to be a dataset
