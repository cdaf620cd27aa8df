"""The folder of a batch: what lies where, what counts as done, and who may write."""

import json
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from filelock import FileLock, Timeout

from .._files import parsed_json
from ..reporting import render_page, write_atomically
from ._outcome import Failure

MARK, SUMMARIES = "batch.json", ("summary.json", "summary.csv", "summary.html")
_MARKED = {"jfsm_batch": 1}
_LOCK = ".batch.lock"
_PART_OF_RESULT = re.compile(r"\..+\.(json|html)\.\w+\.part")
_PART_OF_SUMMARY = re.compile(r"\.(batch\.json|summary\.(json|csv|html))\.\w+\.part")
"""Files that were being written when a batch ended."""
_MADE_BY_US = b'<meta name="generator" content="jfsm">'
_HEAD = 4000
"""Bytes of a page in which it says what made it."""


class Stamp(NamedTuple):
    """What a result was made from; another one makes another result. Digests, and the version of jfsm."""

    input: str
    model: str | None
    settings: str
    version: str


class Standing(NamedTuple):
    """What lies in the folder for a record: the numbers of its diagnosis, or why it has none; both None where nothing
    counts."""

    numbers: dict[str, Any] | None = None
    failure: Failure | None = None


class TakenError(OSError):
    """A file that is not of a batch lies where a result belongs."""


@dataclass(frozen=True)
class Folder:
    """A folder of results: ``records/NAME.json`` with its page, or ``records/NAME.failed.json``; a summary of all."""

    path: str

    def of(self, slug: str, ending: str) -> Path:
        """A file of a record, by its ending: "json", "html" or "failed.json"."""
        return Path(self.path) / "records" / f"{slug}.{ending}"

    def standing(self, slug: str, stamp: Stamp) -> Standing:
        """What was made for a record from the same input, model, settings and version; its page is there then.

        A file that is cut short or is none of a batch counts as nothing.
        """
        numbers = _stamped(self.of(slug, "json"), stamp)
        if numbers is not None and "verdict" in numbers:
            if not self.of(slug, "html").exists():
                write_atomically({self.of(slug, "html"): render_page(numbers).encode()})
            return Standing(numbers=numbers)
        failed = _stamped(self.of(slug, "failed.json"), stamp)
        if failed is None or "failed" not in failed:
            return Standing()
        failure = Failure(**failed["failed"])
        return Standing(failure=failure) if failure.stands else Standing()

    def write_result(self, slug: str, name: str, stamp: Stamp, numbers: Mapping[str, Any], page: str) -> None:
        """Put a result in place, its page first: it counts from the moment when its numbers are there.

        Raises
        ------
        TakenError
            If a file that no batch wrote has one of the names.
        OSError
            If it cannot be written.
        """
        self.check_free(slug)
        stamped = {**numbers, "batch": {"name": name, "stamp": stamp._asdict()}}
        content = json.dumps(stamped, indent=1, allow_nan=False).encode()
        write_atomically({self.of(slug, "html"): page.encode(), self.of(slug, "json"): content})
        self.of(slug, "failed.json").unlink(missing_ok=True)

    def write_failure(self, slug: str, name: str, stamp: Stamp, failure: Failure) -> None:
        """Put in place why a record has no result; one that an earlier input had stays. Errors as above."""
        self.check_free(slug)
        noted = {"batch": {"name": name, "stamp": stamp._asdict()}, "failed": failure._asdict()}
        write_atomically({self.of(slug, "failed.json"): json.dumps(noted, indent=1).encode()})

    def check_free(self, slug: str) -> None:
        """Refuse to write where a file lies that no batch wrote."""
        for ending in ("json", "html", "failed.json"):
            path = self.of(slug, ending)
            if path.exists() and not _is_ours(path):
                raise TakenError(
                    f"{path} must not be written over: it is not a result of a batch. Move it, or choose another `out`."
                )

    def summary(self) -> dict[str, Any] | None:
        """The summary of the last batch that came to its end; None without one that can be read."""
        return _loaded(Path(self.path) / "summary.json")

    def write_summary(self, json_text: str, csv_text: str, page: str) -> None:
        """Put the summary in place, its numbers last."""
        texts = {"summary.csv": csv_text, "summary.html": page, "summary.json": json_text}
        write_atomically({Path(self.path) / name: text.encode() for name, text in texts.items()})

    @contextmanager
    def held(self) -> Iterator[None]:
        """While this lasts, no other batch writes into the folder; it is made, marked and cleared of leftovers.

        The system lets go of it when the process ends, however it ends.

        Raises
        ------
        ValueError
            If another batch holds it, or files that no batch wrote have the names of its own.
        OSError
            If it cannot be written to.
        """
        root = Path(self.path)
        if root.exists() and not root.is_dir():
            raise ValueError(f"`out` must be a folder; {root} is a file. Choose another name.")
        self._check_unmarked(root)
        root.mkdir(parents=True, exist_ok=True)
        lock = FileLock(root / _LOCK)
        try:
            lock.acquire(timeout=0)
        except Timeout:
            raise ValueError(
                f"`out` must not be in use by another batch, and {root} is. Wait for its end, or choose another folder."
            ) from None
        try:
            self._begin(root)
            yield
        finally:
            lock.release()

    def _check_unmarked(self, root: Path) -> None:
        """Refuse a folder whose files have the names of ours and are not."""
        if _loaded(root / MARK) == _MARKED:
            return
        if taken := [name for name in (MARK, "records", *SUMMARIES) if (root / name).exists()]:
            raise ValueError(
                f"`out` must be a folder in which {', '.join(taken)} may be written; {root} holds something of that "
                "name which no batch wrote. Choose another folder."
            )

    def _begin(self, root: Path) -> None:
        if _loaded(root / MARK) != _MARKED:
            write_atomically({root / MARK: json.dumps(_MARKED).encode()})
        (root / "records").mkdir(exist_ok=True)
        for folder, names in ((root, _PART_OF_SUMMARY), (root / "records", _PART_OF_RESULT)):
            for path in folder.iterdir():
                if names.fullmatch(path.name):
                    path.unlink(missing_ok=True)


def _stamped(path: Path, stamp: Stamp) -> dict[str, Any] | None:
    """What a file of a batch holds, if it was made from the same; else None."""
    found = _loaded(path)
    noted = found.get("batch") if found else None
    return found if isinstance(noted, dict) and noted.get("stamp") == stamp._asdict() else None


def _loaded(path: Path) -> dict[str, Any] | None:
    """The dictionary in a file; None where there is none."""
    try:
        found = parsed_json(path.read_bytes())
    except (OSError, ValueError):
        return None
    return found if isinstance(found, dict) else None


def _is_ours(path: Path) -> bool:
    """Whether a batch wrote a file, or nothing is in it that could be lost."""
    if not path.stat().st_size:
        return True
    if path.suffix == ".html":
        with open(path, "rb") as stream:
            return _MADE_BY_US in stream.read(_HEAD)
    return isinstance((_loaded(path) or {}).get("batch"), dict)
