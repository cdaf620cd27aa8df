"""A structure as a TOML file, its maps in files beside it."""

import io
import os
import re
import tomllib
from collections.abc import Callable
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import tomli_w

from .._files import as_path
from .._map_reader import read_map
from ..reporting import write_atomically
from ._definition import own_laws
from ._sensors import SENSORS
from .terms import TERMS, MapTerm

if TYPE_CHECKING:
    from ._structure import Structure

_NUMBER = r"[-+.\w]+"
_LIST = re.compile(rf"\[\n(?:\s+{_NUMBER},\n)+\s*\]")
"""A list of numbers that takes a line for each of them."""


def save(structure: "Structure", path: str | Path) -> None:
    """Write `structure` to `path`, and each map beside it as ``<stem>.map.npz``; no file is left half written.

    Raises
    ------
    ValueError
        If a term holds a map that cannot be written: a function of yours, or one made of such.
    """
    target = as_path(path)
    maps: dict[str | os.PathLike[str], bytes] = {}

    def beside(term: MapTerm) -> str:
        place = target.with_name(f"{target.stem}.map{len(maps) + 1 if maps else ''}.npz")
        maps[place] = _written(term)
        return place.name

    text = _text(structure, beside)
    write_atomically({**maps, target: text.encode()})


def dumps(structure: "Structure") -> str:
    """The text of the file of a structure without maps.

    Raises
    ------
    ValueError
        If a term holds a map, whose numbers need a file of their own.
    """

    def nowhere(term: MapTerm) -> str:
        raise ValueError(f"A structure with a map, at {term.place}, needs files: Structure.save(path) writes them.")

    return _text(structure, nowhere)


def _text(structure: "Structure", beside: Callable[[MapTerm], str]) -> str:
    """The TOML of a structure; `beside` gives the name of the file that holds a map."""
    data: dict[str, Any] = {"mass": np.asarray(structure.mass).tolist()}
    if structure.commands:
        data["commands"] = list(structure.commands)
    if structure.trust:
        data["uncertain"] = dict(structure.trust)
    for key, parts in (("term", structure.terms), ("sensor", structure.sensors)):
        rows = []
        for part in parts:
            row = {"kind": part.kind, "at": list(part.at)}
            if isinstance(part, MapTerm):
                rows.append({**row, "file": beside(part)})
            elif part.parameters:
                rows.append({**row, **{p.name: float(getattr(part, p.name)) for p in part.parameters}})
            else:
                raise ValueError(f"A structure with a {part.kind} cannot be written as TOML: it has no numbers.")
        if rows:
            data[key] = rows
    return _LIST.sub(lambda found: f"[{', '.join(re.findall(_NUMBER, found[0]))}]", tomli_w.dumps(data))


def _written(term: MapTerm) -> bytes:
    """The file of a map."""
    if not hasattr(term.force_map, "save"):
        raise ValueError(
            f"A structure can be written if its maps are those of jfsm, such as RKPM.fit(states, force).on(at=(0, 1)); "
            f"the map at {term.place} is {term.force_map!r}."
        )
    stream = io.BytesIO()
    term.force_map.save(stream)
    return stream.getvalue()


def load(path: str | Path) -> "Structure":
    """Read a structure from `path`.

    Raises
    ------
    FileNotFoundError
        If there is no such file, or not the file of a map.
    ValueError
        If the file is not TOML, lacks `mass`, or holds an unknown kind or parameter, a value that cannot be, or a file
        that is no map; names the entry.
    """
    target = as_path(path)
    if not target.is_file():
        raise FileNotFoundError(f"There is no model file {target}; write one with `Structure.save(path)`.")
    try:
        text = target.read_text(encoding="utf-8-sig")  # Windows begins a text with a mark
    except UnicodeDecodeError as error:
        raise ValueError(f"{target} is not a TOML file: {error}.") from None
    return loads(text, target)


def loads(text: str, target: Path) -> "Structure":
    """The structure in the text of a file `target`, beside which its maps are.

    Raises
    ------
    FileNotFoundError, ValueError
        As of `load`.
    """
    from ._structure import Structure

    try:
        data = tomllib.loads(text)
    except RecursionError:
        raise ValueError(f"{target} is not the TOML file of a model: it is nested too deeply.") from None
    except ValueError as error:  # of TOML, and of numbers with thousands of digits
        raise ValueError(f"{target} is not a TOML file: {error}.") from None
    unknown = set(data) - {"mass", "commands", "term", "sensor", "uncertain"}
    if unknown:
        raise ValueError(
            f"{target}: unknown entry {sorted(unknown)[0]!r}; a model has mass, commands, term, sensor, uncertain."
        )
    if "mass" not in data:
        raise ValueError(f"{target}: `mass` is missing; write e.g. mass = [1.0].")
    terms, sensors = (
        [_part(row, classes, target, f"{target}, {key} {n}") for n, row in enumerate(_rows(data, key, target), 1)]
        for key, classes in (("term", (*TERMS, MapTerm, *own_laws().values())), ("sensor", SENSORS))
    )
    trust = data.get("uncertain", {})
    if not isinstance(trust, dict) or not all(type(share) in (int, float) for share in trust.values()):
        raise ValueError(f"{target}: [uncertain] must hold shares such as stiffness = 0.05; got {trust!r}.")
    try:
        return Structure(data["mass"], terms, sensors, commands=_listed(data, target)).uncertain(**trust)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{target}: {error}") from None


def _listed(data: dict[str, Any], target: Path) -> list[Any]:
    """The degrees of freedom that are commanded."""
    found = data.get("commands", [])
    if not isinstance(found, list):
        raise ValueError(
            f"{target}: `commands` must be a list of degrees of freedom, as commands = [1]; got {found!r}."
        )
    return found


def _rows(data: dict[str, Any], key: str, target: Path) -> list[dict[str, Any]]:
    rows = data.get(key, [])
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise ValueError(f"{target}: {key}s stand under [[{key}]], in double brackets, once for each; got {rows!r}.")
    return rows


def _part(row: dict[str, Any], classes: tuple[type, ...], target: Path, where: str) -> Any:
    kinds = {cls.kind: cls for cls in classes}
    row = dict(row)
    kind, at = row.pop("kind", None), row.pop("at", None)
    if kind not in kinds:
        close = [f"Did you mean {near}? " for near in get_close_matches(str(kind), kinds, 1)]
        raise ValueError(
            f"{where}: `kind` must be one of {', '.join(kinds)}; got {kind!r}. {''.join(close)}A law of your own is "
            "known once its class is defined: import its file first."
        )
    names = ["file"] if kind == MapTerm.kind else [p.name for p in kinds[kind].parameters]
    if set(row) != set(names):
        raise ValueError(f"{where}: {kind} takes {', '.join(names)}; got {', '.join(row) or 'nothing'}.")
    try:
        return _map(row["file"], target).on(at) if kind == MapTerm.kind else kinds[kind](**row, at=at)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{where}: {error}") from None


def _map(file: Any, target: Path) -> Any:
    """The map in a file beside the TOML."""
    if not isinstance(file, str):
        raise TypeError(f'`file` must name the file of a map, as file = "model.map.npz"; got {file!r}.')
    return read_map(target.parent / file)
