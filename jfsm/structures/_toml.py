"""A structure as a TOML file."""

import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import tomli_w

from ..reporting import write_text_atomically
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
    write_text_atomically(path, tomli_w.dumps(data))


def load(path: str | Path) -> "Structure":
    """Read a structure from `path`.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If the file is not TOML, lacks `mass`, or holds an unknown kind or parameter, or a value that cannot be;
        names the entry.
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
    terms, sensors = (
        [_part(row, classes, f"{target}, {key} {n}") for n, row in enumerate(_rows(data, key, target), 1)]
        for key, classes in (("term", TERMS), ("sensor", SENSORS))
    )
    trust = data.get("uncertain", {})
    if not isinstance(trust, dict) or not all(type(share) in (int, float) for share in trust.values()):
        raise ValueError(f"{target}: [uncertain] must hold shares such as stiffness = 0.05; got {trust!r}.")
    try:
        return Structure(data["mass"], terms, sensors).uncertain(**trust)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{target}: {error}") from None


def _rows(data: dict[str, Any], key: str, target: Path) -> list[dict[str, Any]]:
    rows = data.get(key, [])
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise ValueError(f"{target}: {key}s stand under [[{key}]], in double brackets, once for each; got {rows!r}.")
    return rows


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
