"""A structure as a TOML file."""

import os
import tempfile
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import tomli_w

from ._sensors import SENSORS
from .terms import TERMS

if TYPE_CHECKING:
    from ._structure import Structure


def save(structure: "Structure", path: str | Path) -> None:
    """Write `structure` to `path`; the file appears whole or not at all.

    Raises
    ------
    ValueError
        If the structure holds a map: a map is its data, and TOML is for numbers that a person reads.
    """
    data: dict[str, Any] = {"mass": np.asarray(structure.mass).tolist()}
    if structure.trust:
        data["uncertain"] = dict(structure.trust)
    for key, parts in (("term", structure.terms), ("sensor", structure.sensors)):
        rows = []
        for part in parts:
            if not part.parameters:
                raise ValueError(
                    f"A structure with a {part.kind} cannot be written as TOML; keep the record and fit the map again."
                )
            numbers = {p.name: float(getattr(part, p.name)) for p in part.parameters}
            rows.append({"kind": part.kind, "at": list(part.at), **numbers})
        if rows:
            data[key] = rows
    target = Path(path)
    handle, temporary = tempfile.mkstemp(dir=target.parent, prefix=target.name, suffix=".part")
    try:
        with os.fdopen(handle, "wb") as file:
            tomli_w.dump(data, file)
        os.replace(temporary, target)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def load(path: str | Path) -> "Structure":
    """Read a structure from `path`.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If the file is not TOML, lacks `mass`, or holds an unknown kind or parameter; names the entry.
    """
    from ._structure import Structure

    target = Path(path)
    if not target.is_file():
        raise FileNotFoundError(f"There is no model file {target}; write one with `Structure.save(path)`.")
    try:
        data = tomllib.loads(target.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{target} is not a TOML file: {error}.") from None
    unknown = set(data) - {"mass", "term", "sensor", "uncertain"}
    if unknown:
        raise ValueError(f"{target}: unknown entry {sorted(unknown)[0]!r}; a model has mass, term, sensor, uncertain.")
    if "mass" not in data:
        raise ValueError(f"{target}: `mass` is missing; write e.g. mass = [1.0].")
    terms = [_part(row, TERMS, f"{target}, term {n}") for n, row in enumerate(data.get("term", []), 1)]
    sensors = [_part(row, SENSORS, f"{target}, sensor {n}") for n, row in enumerate(data.get("sensor", []), 1)]
    return Structure(data["mass"], terms, sensors, data.get("uncertain", {}))


def _part(row: dict[str, Any], classes: tuple[type, ...], where: str) -> Any:
    kinds = {cls.kind: cls for cls in classes}
    row = dict(row)
    kind, at = row.pop("kind", None), row.pop("at", None)
    if kind not in kinds:
        raise ValueError(f"{where}: `kind` must be one of {', '.join(kinds)}; got {kind!r}.")
    names = [p.name for p in kinds[kind].parameters]
    if set(row) != set(names):
        raise ValueError(f"{where}: {kind} takes {', '.join(names)}; got {', '.join(row) or 'nothing'}.")
    try:
        return kinds[kind](**row, at=at)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{where}: {error}") from None
