"""The records of a batch: each with a name, the name of its files, and the way to read it."""

import hashlib
import json
import os
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Any

from ..records import Reading, Record, file_fingerprint, fingerprint

_LONGEST = 80
"""Characters of the name of a file, without its ending."""
_RESERVED = {"con", "prn", "aux", "nul", *(f"{port}{i}" for port in ("com", "lpt") for i in range(1, 10))}
"""Names that Windows keeps for itself."""


@dataclass(frozen=True)
class Source:
    """A record in a file, with the options that it is read with, or one in memory.

    `slug` is what the files of its result are called, without their endings.
    """

    name: str
    slug: str
    path: str | None = None
    record: Record | None = None
    reading: Reading = Reading()

    @property
    def where(self) -> str:
        """Where it comes from, in words."""
        return self.path or "memory"

    def read(self) -> Record:
        """The record; errors are those of `Reading.read`."""
        if self.record is not None:
            return self.record
        assert self.path is not None
        return self.reading.read(self.path)

    def fingerprint(self) -> str:
        """SHA-256 of the record; of the bytes of a file and of how it is read.

        Raises
        ------
        OSError
            If the file cannot be read.
        """
        if self.record is not None:
            return fingerprint(self.record)
        assert self.path is not None
        how = json.dumps(self.reading.plain, sort_keys=True)
        return hashlib.sha256(f"{file_fingerprint(self.path)} {how}".encode()).hexdigest()


def sources_of(records: Any, reading: Reading) -> list[Source]:
    """The records of a batch with names that differ, in their order.

    Parameters
    ----------
    records : sequence of paths or Records, or mapping of names to these
        Without names, a file goes by its stem, and by as much more of its path as tells it from the others.
    reading : Reading
        How files are read.

    Raises
    ------
    TypeError
        If one is neither a path nor a Record.
    ValueError
        If there is none.
    """
    if isinstance(records, str | os.PathLike | Record):
        records = [records]
    given = _given(records)
    names = list(map(str, records)) if isinstance(records, Mapping) else _names(given)
    return [
        Source(name, slug, None, each)
        if isinstance(each, Record)
        else Source(name, slug, os.fspath(Path(each).absolute()), None, reading)
        for name, slug, each in zip(names, _slugs(names), given, strict=True)
    ]


def _given(records: Any) -> list[Any]:
    """The paths and records, checked; errors as of `sources_of`."""
    if hasattr(records, "dtype") or not isinstance(records, Mapping | Iterable):
        raise TypeError(f"`records` must be paths or records, or a mapping of names to these; got {records!r}.")
    given = list(records.values()) if isinstance(records, Mapping) else list(records)
    if not given:
        raise ValueError("`records` must hold at least one record; it is empty. Look at the pattern of the files.")
    for place, each in enumerate(given):
        if not isinstance(each, str | os.PathLike | Record):
            raise TypeError(f"`records` must be paths or records; number {place + 1} is {each!r}.")
    return given


def _names(given: Sequence[Any]) -> list[str]:
    """Names that differ, as short as they can be."""
    levels = [list(_levels(each, place)) for place, each in enumerate(given, start=1)]
    found = ["" for _ in given]
    for depth in range(max(map(len, levels))):
        tried = [each[min(depth, len(each) - 1)] for each in levels]
        counts = Counter(tried)
        found = [name or (one if counts[one] == 1 else "") for name, one in zip(found, tried, strict=True)]
    return _told_apart([name or each[-1] for name, each in zip(found, levels, strict=True)])


def _levels(given: Any, place: int) -> Iterator[str]:
    """Names of a record from the shortest to the whole path."""
    if isinstance(given, Record):
        yield given.name or f"record {place}"
        return
    path = PurePath(os.path.abspath(given))
    yield path.stem
    yield path.name
    parts = path.parts
    for first in range(len(parts) - 2, 0, -1):
        yield "/".join(parts[first:])


def _told_apart(names: Sequence[str]) -> list[str]:
    """The same names, those that are there already numbered."""
    found: list[str] = []
    for name in names:
        number, one = 1, name
        while one in found:
            number += 1
            one = f"{name} ({number})"
        found.append(one)
    return found


def _slugs(names: Sequence[str]) -> list[str]:
    """Names of files, one each, that every system takes; those that it could mix up end in a digest of the name."""
    plain = [re.sub(r"[^\w.+-]+", "_", name).strip("._") or "record" for name in names]
    counts = Counter(one.casefold() for one in plain)
    return [
        one if one == name and _is_plain(one) and counts[one.casefold()] == 1 else _with_digest(one, name)
        for one, name in zip(plain, names, strict=True)
    ]


def _is_plain(slug: str) -> bool:
    stem = slug.partition(".")[0].casefold()
    return len(slug) <= _LONGEST and stem not in _RESERVED and not slug.casefold().endswith(".failed")


def _with_digest(slug: str, name: str) -> str:
    return f"{slug[:_LONGEST]}-{hashlib.sha256(name.encode()).hexdigest()[:6]}"
