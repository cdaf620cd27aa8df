"""NumPy archives."""

import json
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from jfsm.records.formats.base import ABOUT, AbstractFormat, Contents, left_out
from jfsm.records.formats.expansion import OversizeError, require_room, unpacked_size


class NpzFormat(AbstractFormat):
    """Arrays by name (``numpy.savez``). Pickled objects are not opened."""

    name: ClassVar[str] = "archive of numpy.savez"
    suffixes: ClassVar[tuple[str, ...]] = (".npz",)

    def recognises(self, begins_with: bytes, path: Path) -> bool:
        return begins_with.startswith(b"PK\x03\x04") and b".npy" in begins_with[:256]

    def load(self, path: Path) -> Contents:
        try:
            require_room(unpacked_size(path), path)
            arrays, remarks, objects = _arrays(path)
        except OversizeError:
            raise
        except Exception as error:  # of numpy, zip and zlib; numpy's words are about pickles
            raise ValueError(
                f"{path.name} must be an archive of numpy.savez; it cannot be opened as one, and may be cut short. "
                f"Write or copy it again."
            ) from error
        notes = left_out([f"{name} (Python objects, which are not opened)" for name in objects])
        return Contents(arrays, remarks.pop("units", {}), remarks, notes=notes)

    def save(self, path: Path, contents: Contents) -> None:
        remarks = json.dumps({"units": dict(contents.units), **contents.about})
        with path.open("wb") as stream:
            np.savez(stream, allow_pickle=False, **contents.arrays, **{ABOUT: np.array(remarks)})


def _arrays(path: Path) -> tuple[dict[str, np.ndarray], dict[str, Any], list[str]]:
    """Arrays of an archive by name, what `save` noted beside them, and the names of what holds objects."""
    arrays, remarks, objects = {}, {}, []
    with path.open("rb") as stream, np.load(stream, allow_pickle=False) as archive:
        for name in archive.files:
            try:
                array = archive[name]
            except ValueError:  # an object array: running a stranger's pickle is not reading data
                objects.append(name)
                continue
            if name == ABOUT:
                remarks = json.loads(str(array))
            else:
                arrays[name] = array
    return arrays, remarks, objects
