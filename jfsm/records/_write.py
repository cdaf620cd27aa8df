"""A record as a file."""

import contextlib
import os
import uuid
from pathlib import Path

from jfsm._files import naming, replaceable
from jfsm.records._abstract_record import AbstractRecord
from jfsm.records._contents import contents_of
from jfsm.records.formats import format_to_write


def write(record: AbstractRecord, path: Path) -> None:
    """Write a record in the format of the suffix; the file replaces an older one only when it is complete."""
    file_format = format_to_write(path)
    target = replaceable(path)
    # A name beside the target, so that the last step is a rename; same suffix, for libraries that append a missing one.
    unfinished = target.with_name(f".{target.stem}-{uuid.uuid4().hex}{path.suffix}")
    try:
        file_format.save(unfinished, contents_of(record))
        os.replace(unfinished, target)
    except OSError as error:
        raise naming(target, error) from error
    finally:
        with contextlib.suppress(FileNotFoundError):
            unfinished.unlink()
