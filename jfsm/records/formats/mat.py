"""MATLAB files up to version 7."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import scipy.io

from jfsm.records.formats.base import ABOUT, AbstractFormat, Contents


class MatFormat(AbstractFormat):
    """Variables by name; a field of a struct as ``struct.field``."""

    suffixes: ClassVar[tuple[str, ...]] = (".mat",)

    def load(self, path: Path) -> Contents:
        try:
            variables = scipy.io.loadmat(path, squeeze_me=True, struct_as_record=False)
        except NotImplementedError as error:
            raise ValueError(
                f"{path.name} must be a MATLAB file of version 7 or earlier; it is of version 7.3, which is HDF5. "
                f'Save it in MATLAB with save(..., "-v7").'
            ) from error
        except OSError:
            raise
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


def _leaves(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """The numeric arrays below a variable, with their dotted names."""
    if hasattr(value, "_fieldnames"):
        for field in value._fieldnames:
            yield from _leaves(f"{name}.{field}", getattr(value, field))
    elif isinstance(value, int | float | np.ndarray | np.number) and np.asarray(value).dtype.kind in "iufcb":
        yield name, value
