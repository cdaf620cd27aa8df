"""Where a diagnosis comes from, as a table: what it was made of, with which settings, by what."""

from collections.abc import Iterator, Mapping
from typing import Any

from jfsm.reporting._tables import Table

Dictionary = Mapping[str, Any]

_PACKAGES = ("python", "jax", "jaxlib", "numpy", "scipy", "equinox", "diffrax", "optimistix", "lineax")


def provenance_table(made: Dictionary) -> Table:
    """What ``provenance`` of ``Diagnosis.to_json`` holds, in words; without it no rows."""
    rows = tuple(_rows(made)) if made else ()
    return Table("What it was made of", ("", "value"), rows, frozenset({0, 1}))


def _rows(made: Dictionary) -> Iterator[tuple[str, str]]:
    for what, records in (("record", "records"), ("held-out record", "holdout"), ("simulated run", "simulated")):
        for one in made[records]:
            name = f"{one['name']}, " if one["name"] else ""
            yield what, f"{name}{one['samples']} samples, sha256 {one['sha256']}"
    for one in made["files"] or ():
        yield "file", f"{one['name']}, sha256 {one['sha256']}"
    if made["reading"]:
        yield "read with", _listed(made["reading"])
    yield "model", f"sha256 {made['model']['sha256']}"
    yield "settings", _listed(made["settings"])
    yield "key", f"{' '.join(map(str, made['key']['data']))} ({made['key']['impl'] or 'raw'})"
    by = made["computed_with"]
    yield "jfsm", made["jfsm"]
    yield "with", ", ".join(f"{name} {by[name]}" for name in _PACKAGES if name in by)
    yield "on", f"{by['system']} {by['machine']}, {by['processor']}, {by['cores']} cores, {by['backend']}"


def _listed(options: Dictionary) -> str:
    return ", ".join(f"{name}={value}" for name, value in options.items() if value is not None)
