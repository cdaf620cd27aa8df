"""What tells records and files apart: a digest of their content."""

import hashlib
import os
from collections.abc import Iterator

import numpy as np

from jfsm.records._abstract_record import AbstractRecord

_PIECE = 1 << 20
"""Bytes of a file that are read at once."""


def fingerprint(record: AbstractRecord) -> str:
    """SHA-256 of what was measured, as 64 hexadecimal digits: equal for equal records, whatever they are called.

    It counts the clock, every channel with its unit, lost samples, rest at the start and what drives, to the last bit.
    The name and the notes do not count.
    """
    digest = hashlib.sha256()
    for head, content in _parts(record):
        digest.update(f"{head}\0".encode())
        if content is not None:
            digest.update(np.ascontiguousarray(content).astype(content.dtype.newbyteorder("<"), copy=False).tobytes())
    return digest.hexdigest()


def file_fingerprint(path: str | os.PathLike[str]) -> str:
    """SHA-256 of the bytes of a file, as 64 hexadecimal digits.

    Raises
    ------
    OSError
        If it cannot be read.
    """
    digest = hashlib.sha256()
    with open(path, "rb") as stream:
        while piece := stream.read(_PIECE):
            digest.update(piece)
    return digest.hexdigest()


def _parts(record: AbstractRecord) -> Iterator[tuple[str, np.ndarray | None]]:
    """What counts, each part with a head that says what and how long it is."""
    yield f"drive {record.drive}, at rest {record.at_rest}", None
    yield f"time {record.time.size}", record.time
    for (kind, dof), samples in sorted(record.channels.items()):
        yield f"{kind} {dof} [{record.units[kind]}]", samples
    if record.base_acceleration is not None:
        yield f"base [{record.units['base_acceleration']}]", record.base_acceleration
    for (kind, dof), lost in sorted(record.lost.items()):
        yield f"lost {kind} {dof}", np.packbits(lost)
