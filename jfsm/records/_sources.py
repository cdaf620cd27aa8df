"""What a record may be made from: a file, a table in memory, a list of channels."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

from jfsm.records._abstract_record import AnyRecord
from jfsm.records._channels import require_mapping
from jfsm.records._contents import Asked, record_of
from jfsm.records.formats import format_of
from jfsm.records.formats.base import Contents
from jfsm.records.formats.frames import contents_of_frame, is_frame
from jfsm.records.formats.rows import rows_where
from jfsm.records.formats.runs import Run, chosen_run
from jfsm.records.formats.sep005 import contents_of_channels


def record_from(
    make: type[AnyRecord], source: Any, asked: Asked, where: Mapping[str, str | float] | None = None, sheet: Run = None
) -> AnyRecord:
    """A `make`, the class of the record, from whatever holds its channels; errors are those of `read`."""
    for name, which in (("run", asked.run), ("sheet", sheet)):
        if which is not None and not isinstance(which, int | str):
            raise TypeError(f"`{name}` must be a number from 1 on, or a title; got {which!r}.")
    require_mapping("where", where, "{'run': 3}")
    contents, called, default_name = opened(source)
    contents, run = chosen_run(contents, called, asked.run, sheet)
    return record_of(
        make,
        rows_where(contents, called, where) if where else contents,
        called,
        replace(asked, run=run),
        default_name,
    )


def opened(source: Any) -> tuple[Contents, str, str | None]:
    """What a source holds, what messages call it, and the name of a record of it."""
    if isinstance(source, str | PathLike):
        path = Path(source)
        return format_of(path).load(path), path.name, path.stem
    if is_frame(source):
        return contents_of_frame(source), f"the {type(source).__name__}", None
    if isinstance(source, Mapping | Iterable) and not hasattr(source, "dtype"):
        return contents_of_channels(source), "`channels`", None
    raise TypeError(
        f"`source` must be the path of a file, a DataFrame, a Dataset of xarray, or a list of channels after SEP 5; it "
        f"was {type(source).__name__}. For arrays: jfsm.Record(time, force=...)."
    )
