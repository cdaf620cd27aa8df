"""Where a diagnosis comes from: what it was made of, with which settings, by what; enough to make it again."""

import hashlib
import os
import platform
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from importlib.metadata import version
from pathlib import Path
from types import CodeType
from typing import Any

import jax
import numpy as np

from ..records import Reading, Record, file_fingerprint, fingerprint, records_of
from ..structures import CauseLike, Runs, Structure, causes_of
from ._diagnosis import Diagnosis
from .report.plain_data import jfsm_version, written_model

_COUNTED = ("jax", "jaxlib", "numpy", "scipy", "equinox", "diffrax", "optimistix", "lineax")
"""Packages on which the last bits of a number may depend."""


def provenance(
    records: Sequence[Record],
    model: Any,
    key: jax.Array,
    settings: Mapping[str, Any],
    *,
    holdout: Any = None,
    simulated: Any = None,
) -> dict[str, Any]:
    """What a diagnosis was made of, as plain types: digests of its records, its model, settings and key, and by what.

    `files` and `reading` are None until `from_files` fills them: a record does not know the file that it came from.
    """
    return {
        "jfsm": jfsm_version(),
        "records": [plain_input(record) for record in records],
        "files": None,
        "reading": None,
        "holdout": [plain_input(record) for record in _records(holdout)],
        "simulated": [plain_input(record) for record in _records(simulated)],
        "model": {"sha256": model_fingerprint(model), "toml": toml_of(model)},
        "settings": dict(settings),
        "key": plain_key(key),
        "computed_with": dict(computed_with()),
    }


def from_files(d: Diagnosis, paths: Sequence[str | Path], reading: Reading) -> Diagnosis:
    """The same diagnosis, which says from which files its records were read, and how.

    Raises
    ------
    OSError
        If a file cannot be read any more.
    """
    files = [{"name": Path(path).name, "sha256": file_fingerprint(path)} for path in paths]
    told = {**d.told["provenance"], "files": files, "reading": reading.plain}
    return replace(d, told={**d.told, "provenance": told})


def _records(given: Any) -> list[Record]:
    """The records that are given; none for a share, or for nothing."""
    return [] if given is None or isinstance(given, int | float) else records_of(given)


def plain_input(record: Record) -> dict[str, Any]:
    """A record in short: its name, its length, when it began, and its fingerprint."""
    begins = None if record.begins is None else str(record.begins)
    return {"name": record.name, "samples": len(record), "begins": begins, "sha256": fingerprint(record)}


def plain_settings(
    *,
    holdout: Any,
    causes: Sequence[CauseLike] | None,
    max_causes: int,
    since: float | None,
    until: float | None,
    places: Sequence[tuple[int, int]] | None,
    reconstruction: str | None,
    time_limit: float | None,
) -> dict[str, Any]:
    """Arguments of `diagnose` as plain types; held-out records are "records", causes go by their ids."""
    share = holdout if holdout is None or isinstance(holdout, int | float) else "records"
    return {
        "holdout": share,
        "causes": None if causes is None else [cause.id for item in causes for cause in causes_of(item)],
        "max_causes": max_causes,
        "since": since,
        "until": until,
        "places": None if places is None else [list(place) for place in places],
        "reconstruction": reconstruction,
        "time_limit": time_limit,
    }


def plain_key(key: jax.Array) -> dict[str, Any]:
    """A key of `jax.random` as plain types."""
    typed = jax.numpy.issubdtype(key.dtype, jax.dtypes.prng_key)
    data = jax.random.key_data(key) if typed else key
    return {"impl": str(jax.random.key_impl(key)) if typed else None, "data": np.asarray(data).ravel().tolist()}


def key_of(written: Mapping[str, Any]) -> jax.Array:
    """The key that `plain_key` wrote."""
    data = jax.numpy.asarray(np.asarray(written["data"], np.uint32))
    return data if written["impl"] is None else jax.random.wrap_key_data(data, impl=written["impl"])


def toml_of(model: Any) -> str | None:
    """A model as the text of its file; None where it has no such text."""
    return written_model(model) if isinstance(model, Structure) else None


def model_fingerprint(model: Any) -> str | None:
    """SHA-256 of a model: of the text of its file, else of its numbers and the code of its functions; None without one.

    Of a function its own code counts, not that of what it calls.
    """
    if model is None:
        return None
    digest = hashlib.sha256()
    text = toml_of(model)
    for part in [text.encode()] if text is not None else _parts(model):
        digest.update(part + b"\0")
    return digest.hexdigest()


def _parts(model: Any) -> Iterator[bytes]:
    """A model in pieces: what it says of itself, its numbers, its function."""
    yield type(model).__qualname__.encode()
    if isinstance(model, Structure):
        yield "\n".join(model.describe()).encode()
        yield repr(model.trust).encode()
        for leaf in jax.tree.leaves(model):
            yield np.asarray(leaf).tobytes() if hasattr(leaf, "dtype") else repr(leaf).encode()
    if isinstance(model, Runs):
        yield repr(model.places).encode()
        yield "\n".join(model.form.describe() if model.form is not None else ()).encode()
    function = model.own.function if isinstance(model, Structure) and model.own else getattr(model, "_run", None)
    if (code := getattr(function, "__code__", None)) is not None:
        yield from _code(code)
    if isinstance(digest := getattr(function, "digest", None), bytes):
        yield digest


def _code(code: CodeType) -> Iterator[bytes]:
    """The code of a function, with that of the functions inside it."""
    yield code.co_code
    yield " ".join(code.co_names).encode()
    for constant in code.co_consts:
        yield from _code(constant) if isinstance(constant, CodeType) else [repr(constant).encode()]


@cache
def computed_with() -> tuple[tuple[str, Any], ...]:
    """The machine and the packages on which the last bits of a number depend, by name."""
    machine = {
        "system": platform.system(),
        "machine": platform.machine(),
        "processor": _processor(),
        "cores": os.cpu_count(),
        "backend": jax.default_backend(),
        "python": platform.python_version(),
    }
    return (*machine.items(), *((name, version(name)) for name in _COUNTED))


def _processor() -> str:
    """What the processor calls itself, where the system tells."""
    told = Path("/proc/cpuinfo")
    try:
        lines = told.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return platform.processor()
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.processor())
