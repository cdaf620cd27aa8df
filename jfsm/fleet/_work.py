"""The work on one record of a batch: read, diagnose, write. It runs in whatever process an executor has."""

import os
import pickle
import sys
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..records import Record
from ._folder import Folder, Stamp
from ._options import Settings
from ._outcome import Failure, Row, failed_row, row_of
from ._source import Source

MOST_MAPS = 25_000
"""Maps of memory, of which every compiled program takes some, from which programs are let go: Linux ends a process that
has 65 530."""


@dataclass(frozen=True)
class Believed:
    """A model on its way to another process, which may not know doubles before it arrives."""

    model: Any

    def __reduce__(self) -> tuple[Callable[[bytes], "Believed"], tuple[bytes]]:
        return _unpacked, (pickle.dumps(self.model),)


def _unpacked(content: bytes) -> Believed:
    settle_doubles()
    return Believed(pickle.loads(content))


@dataclass(frozen=True)
class Task:
    """What a worker needs to know: the record, the model, the settings, and where the result goes."""

    source: Source
    stamp: Stamp
    model: Believed
    settings: Settings
    folder: Folder

    def failed(self, failure: Failure) -> Row:
        """The row of a record without a result."""
        return failed_row(self.source.name, self.source.slug, self.source.where, failure)


def work(task: Task) -> Row:
    """Diagnose a record, write what comes out, and give the row of the summary. It raises nothing but an interrupt."""
    settle_doubles()
    source = task.source
    try:
        task.folder.check_free(source.slug)
        found = _outcome(task)
        if isinstance(found, Failure):
            if found.kind != "not done":
                task.folder.write_failure(source.slug, source.name, task.stamp, found)
            return task.failed(found)
        numbers, page = found
        task.folder.write_result(source.slug, source.name, task.stamp, numbers, page)
        return row_of(source.name, source.slug, source.where, numbers)
    except OSError as error:  # the result cannot be written
        return task.failed(Failure("not done", _words(error)))
    finally:
        let_programs_go()


def _outcome(task: Task) -> tuple[dict[str, Any], str] | Failure:
    """The numbers of a diagnosis and its page, or why there are none."""
    try:
        record = task.source.read()
        if task.source.fingerprint() != task.stamp.input:
            return Failure("not done", f"{task.source.where} changed while the batch ran; run it again.")
    except Exception as error:  # whatever a file holds
        return Failure("unreadable", _words(error))
    try:
        return diagnosed(record, task)
    except (ValueError, TypeError) as error:
        if _is_ours(error):
            return Failure("refused", _words(error))
        return _internal(error)
    except Exception as error:
        return _internal(error)


def diagnosed(record: Record, task: Task) -> tuple[dict[str, Any], str]:
    """The numbers of a record's diagnosis, and its page."""
    from ..diagnosis import diagnose, from_files
    from ..reporting import render_page

    d = diagnose(record, task.model.model, progress=False, **task.settings.arguments)
    if task.source.path is not None:
        d = from_files(d, [task.source.path], task.source.reading)
    return d.data, render_page(d.data)


def _is_ours(error: Exception) -> bool:
    """Whether jfsm itself refuses something, in words; an error from a library underneath is a mistake of jfsm."""
    *_, (frame, _) = traceback.walk_tb(error.__traceback__)
    return (frame.f_globals.get("__package__") or "").split(".")[0] == "jfsm"


def _internal(error: Exception) -> Failure:
    return Failure("internal", _words(error), "".join(traceback.format_exception(error)))


def _words(error: Exception) -> str:
    """An error in one line; one without words by its name."""
    if isinstance(error, OSError) and error.strerror:
        return f"{error.strerror}: {error.filename}"
    words = " ".join(str(error).split())
    return words if words and isinstance(error, ValueError) else f"{type(error).__name__}: {words}".rstrip(": ")


def settle_doubles() -> None:
    """Double precision in a process that has not begun to compute."""
    if "jax" not in sys.modules:
        os.environ["JAX_ENABLE_X64"] = "1"
    import jax

    if not jax.config.jax_enable_x64:  # pyright: ignore[reportAttributeAccessIssue]
        jax.config.update("jax_enable_x64", True)


def let_programs_go() -> None:
    """Forget compiled programs before they fill the process's table of maps, where there is one."""
    maps = Path("/proc/self/maps")
    if "jax" not in sys.modules or not maps.exists() or maps.read_bytes().count(b"\n") < MOST_MAPS:
        return
    import jax

    from .._traced import clear_programs

    clear_programs()
    jax.clear_caches()
