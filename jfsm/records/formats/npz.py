"""NumPy archives."""

import json
from pathlib import Path
from typing import ClassVar

import numpy as np

from jfsm.records.formats.base import ABOUT, AbstractFormat, Contents


class NpzFormat(AbstractFormat):
    """Arrays by name (``numpy.savez``). Pickled objects are not opened."""

    suffixes: ClassVar[tuple[str, ...]] = (".npz",)

    def load(self, path: Path) -> Contents:
        arrays, remarks = {}, {}
        with np.load(path, allow_pickle=False) as archive:
            for name in archive.files:
                try:
                    array = archive[name]
                except ValueError:  # an object array: running a stranger's pickle is not reading data
                    continue
                if name == ABOUT:
                    remarks = json.loads(str(array))
                else:
                    arrays[name] = array
        return Contents(arrays, remarks.pop("units", {}), remarks)

    def save(self, path: Path, contents: Contents) -> None:
        remarks = json.dumps({"units": dict(contents.units), **contents.about})
        with path.open("wb") as stream:
            np.savez(stream, allow_pickle=False, **contents.arrays, **{ABOUT: np.array(remarks)})
