"""jfsm: what a simulation gets wrong, the name of the cause, and the gain of mending it.

The public names are listed in ``__init__.pyi``. Each is imported when it is first asked for: help on the command line,
or a record that is only read, need not wait for JAX.
"""

import ast
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any

from jfsm import _map_reader

_ROOMS = {
    name.asname or name.name: line.module
    for line in ast.parse(Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")).body
    if isinstance(line, ast.ImportFrom)
    for name in line.names
}
"""The room of each public name; None for a public name that is a room."""

__all__ = list(_ROOMS)  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return version(__name__)
    if name in _ROOMS.values() or name in _ROOMS and _ROOMS[name] is None:
        return import_module(f"{__name__}.{name}")
    if name not in _ROOMS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = getattr(import_module(f"{__name__}.{_ROOMS[name]}"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


def _read_map(path: Path) -> Any:
    from jfsm.surrogates import load_map  # with JAX, which waits until there is a map to read

    return load_map(path)


_map_reader.set_map_reader(_read_map)
