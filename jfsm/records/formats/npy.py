"""Single NumPy arrays."""

from pathlib import Path
from typing import ClassVar

import numpy as np

from jfsm.records.formats.base import AbstractFormat, Contents, unique_names


class NpyFormat(AbstractFormat):
    """The columns of one array (``numpy.save``), numbered or by field. Pickled objects are not opened. Read only."""

    name: ClassVar[str] = "array of numpy.save"
    suffixes: ClassVar[tuple[str, ...]] = (".npy",)

    def recognises(self, begins_with: bytes, path: Path) -> bool:
        return begins_with.startswith(b"\x93NUMPY")

    def load(self, path: Path) -> Contents:
        try:
            array = np.load(path, allow_pickle=False)
        except Exception as error:  # of a header that numpy cannot make out, among others
            raise ValueError(
                f"{path.name} must be an array of numbers of numpy.save; it holds objects, or is cut short. Save the "
                f"numbers alone."
            ) from error
        if array.dtype.names:
            return Contents({name: array[name] for name in array.dtype.names})
        if array.ndim not in (1, 2) or array.dtype.kind not in "iufb":
            raise ValueError(
                f"{path.name} must hold columns of real numbers, (n,) or (n, columns); it has shape {array.shape} and "
                f"type {array.dtype}. Save the columns."
            )
        columns = array[:, None] if array.ndim == 1 else array if array.shape[0] >= array.shape[1] else array.T
        names = unique_names([""] * columns.shape[1])
        return Contents({name: columns[:, place] for place, name in enumerate(names)})
