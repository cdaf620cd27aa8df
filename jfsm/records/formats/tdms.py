"""National Instruments TDMS files, through npTDMS (an optional extra, for its licence is the LGPL)."""

from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from jfsm.records.formats.base import AbstractFormat, Contents, Lazy, optional_package

STEP, START, OFFSET = "wf_increment", "wf_start_time", "wf_start_offset"  # properties of a channel that has a clock


class TdmsFormat(AbstractFormat):
    """Channels by ``group/channel``, with the unit and clock that each of them states. Read only."""

    name: ClassVar[str] = "TDMS"
    suffixes: ClassVar[tuple[str, ...]] = (".tdms",)

    def recognises(self, begins_with: bytes, path: Path) -> bool:
        return begins_with.startswith((b"TDSm", b"TDSh"))

    def load(self, path: Path) -> Contents:
        tdms: Any = optional_package("nptdms", "tdms", path).TdmsFile
        try:
            file = tdms.read_metadata(path)
        except Exception as error:  # whatever the reader stumbles over in bytes that are no such file
            raise ValueError(
                f"{path.name} must be a TDMS file; it cannot be opened as one ({error}), and may be cut short. "
                f"Write or copy it again."
            ) from error
        if not file.groups() or file.file_status.incomplete_final_segment:
            raise ValueError(
                f"{path.name} must be a whole TDMS file; it holds no channels, or its last segment is cut short. "
                f"Write or copy it again."
            )
        channels = {
            f"{group.name}/{channel.name}": channel
            for group in file.groups()
            for channel in group.channels()
            if channel.dtype.kind in "iufb"
        }

        def samples(name: str) -> np.ndarray:
            with tdms.open(path) as opened:
                group, channel = channels[name].group_name, channels[name].name
                return np.asarray(opened[group][channel][:])

        starts = {
            name: np.datetime64(channel.properties[START]).astype("datetime64[ns]")
            for name, channel in channels.items()
            if START in channel.properties and STEP in channel.properties
        }
        begins = min(starts.values(), default=None)

        def clock(name: str) -> np.ndarray:
            channel = channels[name]
            start = float(channel.properties.get(OFFSET, 0.0))
            if begins is not None and name in starts:
                start += float((starts[name] - begins) / np.timedelta64(1, "ns")) * 1e-9
            return start + np.arange(len(channel)) * float(channel.properties[STEP])

        skipped = [
            f"{group.name}/{channel.name}"
            for group in file.groups()
            for channel in group.channels()
            if f"{group.name}/{channel.name}" not in channels
        ]
        notes = [f"Not numbers, and left out: {', '.join(skipped[:6])}."] if skipped else []
        if len(set(starts.values())) > 1:
            notes.append(
                "The channels of the file began at different instants; their clocks count from the first of them."
            )

        units = {name: str(channel.properties.get("unit_string", "")) for name, channel in channels.items()}
        return Contents(
            Lazy(channels, samples),
            {name: unit for name, unit in units.items() if unit},
            clocks=Lazy([name for name, channel in channels.items() if STEP in channel.properties], clock),
            notes=tuple(notes),
            begins=begins,
        )
