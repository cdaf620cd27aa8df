"""What the maker's library says of a Dewesoft file: run as a program, for the library may end its process.

python -P dewesoft_library.py list ANSWER FILE         channels, units and starts as JSON
python -P dewesoft_library.py read ANSWER FILE KEY     instants and numbers of one channel, one behind the other
"""

import json
import sys
from pathlib import Path
from typing import Any

_NUMBERS = {"Byte", "ShortInt", "SmallInt", "Word", "Integer", "Single", "Int64", "Double", "Longword"}


def _left_out(channel: Any) -> str:
    """Why a channel is no row of numbers over time; empty if it is one."""
    kind = channel.data_type.name.removeprefix("dt")
    if kind not in _NUMBERS:
        return f"numbers of kind {kind}"
    if channel.array_size != 1:
        return f"{channel.array_size} numbers at a time"
    if channel.channel_type.name == "DW_CH_TYPE_SV":
        return "one value"
    if channel.channel_index.startswith("CAN"):
        return "messages of a bus"
    return "" if channel.number_of_samples > 1 else "no samples"


def _listed(file: Any) -> dict[str, Any]:
    channels = []
    for key, channel in file.items():
        try:
            left_out = _left_out(channel)
            rate = 0.0 if left_out else float(channel.sample_rate)
        except Exception as error:  # whatever the library cannot do with a channel
            left_out, rate = f"not read: {error}", 0.0
        name = (channel.long_name or channel.name).strip()
        channels.append(
            {"key": key, "name": name, "unit": channel.unit.strip(" -"), "rate": rate, "left_out": left_out}
        )
    starts = {"measuring": file.info.start_measure_time, "storing": file.info.start_store_time}
    return {"channels": channels} | {name: start.replace(tzinfo=None).isoformat() for name, start in starts.items()}


def _main(what: str, answer: str, path: str, key: str = "") -> None:
    import dwdatareader  # pyright: ignore[reportMissingImports]  # an extra

    with dwdatareader.DWFile(path) as file:
        if what == "list":
            Path(answer).write_text(json.dumps(_listed(file)))
            return
        instants, values = file[key].scaled()
        Path(answer).write_bytes(instants.astype("f8").tobytes() + values.astype("f8").tobytes())


if __name__ == "__main__":
    _main(*sys.argv[1:])
