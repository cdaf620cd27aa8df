"""The reader of map files, for rooms above the one that knows maps.

A structure may hold a map, and a room above cannot import the room of maps. The front door, which every import of jfsm
passes, hands the reader over; so a structure with a map loads whichever name is imported first.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

Reader = Callable[[Path], Any]
_readers: dict[str, Reader] = {}


def set_map_reader(reader: Reader) -> None:
    """Make `reader` the one that reads map files."""
    _readers["map"] = reader


def read_map(path: Path) -> Any:
    """Read the map in a file; errors are those of `jfsm.load_map`."""
    return _readers["map"](path)
