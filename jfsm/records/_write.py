"""A record as a file."""

import contextlib
import os
import uuid
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from jfsm.records.formats import Contents, format_of

if TYPE_CHECKING:
    from jfsm.records._record import Record


def write(record: "Record", path: Path) -> None:
    """Write a record in the format of the suffix; the file replaces an older one only when it is complete."""
    file_format = format_of(path)
    # A name beside the target, so that the last step is a rename; same suffix, for libraries that append a missing one.
    unfinished = path.with_name(f".{path.stem}-{uuid.uuid4().hex}{path.suffix}")
    try:
        file_format.save(unfinished, contents_of(record))
        os.replace(unfinished, path)
    finally:
        with contextlib.suppress(FileNotFoundError):
            unfinished.unlink()


def contents_of(record: "Record") -> Contents:
    """The record as named columns: ``time``, ``displacement_1``, ``base_acceleration``."""
    arrays: dict[str, Any] = {"time": record.time}
    units = {"time": "s"}
    for (kind, dof), samples in record.channels.items():
        arrays[f"{kind}_{dof}"] = samples
        units[f"{kind}_{dof}"] = record.units[kind]
    if record.base_acceleration is not None:
        arrays["base_acceleration"] = np.asarray(record.base_acceleration)
        units["base_acceleration"] = record.units["base_acceleration"]
    about = {
        "at_rest": record.at_rest,
        "drive": record.drive,
        "name": record.name,
        "notes": list(record._notes),
    }
    return Contents(arrays, units, about)
