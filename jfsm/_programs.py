"""Compiled programs outlive their process: they are kept on disk for the next one that needs the same.

JAX does the keeping; here it is said where, from what time of compilation on, and up to what size.
"""

import functools
import itertools
import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from platformdirs import user_cache_path

_WORTH_KEEPING = 0.2
"""Seconds of compilation from which a program is kept."""
_MOST = 500_000_000
"""Bytes in the user's cache folder from which the programs that were not used for longest go. JAX's own bound,
`jax_compilation_cache_max_size`, needs a package that JAX does not bring, and fails on programs kept without it."""
TRACED = "-traced"
"""Ending of the files of traced programs; those of compiled ones are JAX's."""
_UNCHOSEN = {"jax_compilation_cache_dir": None, "jax_persistent_cache_min_compile_time_secs": 1.0}
"""What JAX's settings are where nobody chose."""

_lock = threading.Lock()
_inside = 0
_before: dict[str, str | float | None] = {}


@functools.cache
def settings() -> dict[str, str | float]:
    """JAX's settings by which programs are kept in the user's cache folder; none where nothing can be written there.

    The folder is made, and what was not used for long goes where it has grown too large.
    """
    folder = user_cache_path("jfsm")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        make_room(folder)
    except OSError:
        return {}
    if not os.access(folder, os.W_OK):
        return {}
    return {"jax_compilation_cache_dir": str(folder), "jax_persistent_cache_min_compile_time_secs": _WORTH_KEEPING}


def _kept(folder: Path) -> Iterator[Path]:
    """Files of programs."""
    return itertools.chain(folder.glob("*-cache"), folder.glob("*" + TRACED))


def make_room(folder: Path, most: int = _MOST) -> None:
    """Delete files of a folder, beginning with those not used for longest, until it holds no more than `most` bytes."""
    files = [(max(f.stat().st_atime_ns, f.stat().st_mtime_ns), f.stat().st_size, f) for f in _kept(folder)]
    size = sum(bytes_ for _, bytes_, _ in files)
    for _, bytes_, path in sorted(files):
        if size <= most:
            return
        with suppress(OSError):  # another process deleted it, or reads it
            path.unlink()
        size -= bytes_


@contextmanager
def programs_kept() -> Iterator[None]:
    """While this lasts, programs are kept in the user's cache folder and taken from there; for calls that compile.

    A folder that the user chose (``jax_compilation_cache_dir``) stays the one, and ``jax_enable_compilation_cache``
    set to False keeps nothing. JAX's settings belong to the process: they are put back when the last of several calls
    that overlap has ended, and JAX is told to let go of the folder.
    """
    _begin()
    try:
        yield
    finally:
        _end()


def _begin() -> None:
    global _inside
    import jax  # the command line reads the settings before it needs JAX
    from jax.experimental.compilation_cache.compilation_cache import reset_cache

    with _lock:
        _inside += 1
        chosen = jax.config.values
        if _inside > 1 or chosen["jax_compilation_cache_dir"] is not None or not chosen["jax_enable_compilation_cache"]:
            return
        for name, value in settings().items():
            if chosen[name] == _UNCHOSEN[name]:
                _before[name] = chosen[name]
                jax.config.update(name, value)
        reset_cache()


def _end() -> None:
    global _inside
    import jax
    from jax.experimental.compilation_cache.compilation_cache import reset_cache

    with _lock:
        _inside -= 1
        if _inside or not _before:
            return
        for name, value in _before.items():
            jax.config.update(name, value)
        _before.clear()
        reset_cache()
