"""National Instruments TDMS files, through npTDMS (an optional extra, for its licence is the LGPL)."""

from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from jfsm.records.formats.base import AbstractFormat, Contents, Lazy, optional_package

STEP = "wf_increment"  # property of a channel that has a clock [s]


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

        def clock(name: str) -> np.ndarray:
            channel = channels[name]
            start = float(channel.properties.get("wf_start_offset", 0.0))
            return start + np.arange(len(channel)) * float(channel.properties[STEP])

        units = {name: str(channel.properties.get("unit_string", "")) for name, channel in channels.items()}
        return Contents(
            Lazy(channels, samples),
            {name: unit for name, unit in units.items() if unit},
            clocks=Lazy([name for name, channel in channels.items() if STEP in channel.properties], clock),
        )
