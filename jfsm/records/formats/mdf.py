"""ASAM MDF files, through asammdf (an optional extra, for its licence is the LGPL)."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from jfsm.records.formats.base import AbstractFormat, Contents, Lazy, optional_package, unique_names

DAY = 86_400  # s


class MdfFormat(AbstractFormat):
    """Channels by name, with the unit and clock of each. Read only."""

    name: ClassVar[str] = "MDF"
    suffixes: ClassVar[tuple[str, ...]] = (".mf4", ".mdf")

    def recognises(self, begins_with: bytes, path: Path) -> bool:
        return begins_with.startswith((b"MDF     ", b"UnFinMF "))

    def load(self, path: Path) -> Contents:
        mdf: Any = optional_package("asammdf", "mf4", path).MDF
        try:
            with mdf(path) as file:
                places = [
                    (group, index)
                    for group, members in enumerate(file.groups)
                    for index, channel in enumerate(members.channels)
                    if index != file.masters_db.get(group)
                ]
                labels = [file.groups[group].channels[index].name for group, index in places]
                started = file.header.start_time
                stated = [file.get_channel_unit(group=group, index=index) for group, index in places]
        except Exception as error:  # whatever the reader stumbles over in bytes that are no such file
            raise ValueError(
                f"{path.name} must be an MDF file; it cannot be opened as one ({error}), and may be cut short. "
                f"Write or copy it again."
            ) from error
        begins = _in_utc(started)
        names = unique_names(labels)
        where = dict(zip(names, places, strict=True))

        def samples(name: str) -> np.ndarray:
            group, index = where[name]
            with mdf(path) as file:
                return np.array(file.get(group=group, index=index).samples)

        def clock(name: str) -> np.ndarray:
            group, index = where[name]
            with mdf(path) as file:
                return np.array(file.get(group=group, index=index).timestamps)

        units = {name: unit for name, unit in zip(names, stated, strict=True) if unit}
        return Contents(Lazy(names, samples), units, clocks=Lazy(names, clock), begins=begins)


def _in_utc(started: datetime) -> np.datetime64 | None:
    """When a file began; None for the first instant of 1970, which stands for none."""
    started = started.astimezone(UTC).replace(tzinfo=None) if started.tzinfo else started
    return np.datetime64(started, "ns") if started.timestamp() > DAY else None
