"""Writing files so that a reader sees the old ones or the new ones, never half of one."""

import errno
import json
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def write_text_atomically(path: str | os.PathLike[str], text: str) -> None:
    """Write `text` as UTF-8; see `write_atomically`."""
    write_atomically({path: text.encode()})


def write_atomically(files: Mapping[str | os.PathLike[str], bytes]) -> None:
    """Write each file to a temporary one beside it, and when all are complete move them into place, in their order.

    What a symbolic link points at is replaced, not the link.

    Raises
    ------
    OSError
        If a folder is missing or cannot be written to, or a path is a folder; of the same kind as the operating
        system's own error, naming the path. Whatever stood there is still there.
    ValueError
        If a path is a device, a pipe or a socket.
    """
    parts: dict[Path, Path] = {}
    target = Path()
    try:
        for path, content in files.items():
            target = replaceable(path)
            handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.", suffix=".part")
            parts[target] = Path(name)
            with os.fdopen(handle, "wb") as stream:
                stream.write(content)
            parts[target].chmod(_permissions(target))
        for target, part in parts.items():
            os.replace(part, target)
    except OSError as error:
        raise naming(target, error) from error
    finally:
        for part in parts.values():
            part.unlink(missing_ok=True)


def as_path(path: Any, name: str = "path") -> Path:
    """A path of the operating system.

    Raises
    ------
    TypeError
        If it is none.
    """
    if isinstance(path, str | os.PathLike):
        return Path(path)
    raise TypeError(f"`{name}` must be a path, as {name}='run7.csv'; it was {path!r}.")


def parsed_json(text: str | bytes) -> Any:
    """What a text of JSON says.

    Raises
    ------
    ValueError
        If it is none, or nested deeper than Python follows.
    """
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None


def replaceable(path: str | os.PathLike[str]) -> Path:
    """The file that a path stands for, behind symbolic links, if a file may be put there.

    Raises
    ------
    ValueError
        If a device, a pipe or a socket stands there, which a file would take the place of.
    """
    target = Path(os.path.realpath(as_path(path)))
    if target.exists() and not (target.is_file() or target.is_dir()):
        raise ValueError(f"`path` must be a file; {path} is a device, a pipe or a socket. Choose another name.")
    return target


def check_writable(path: str | os.PathLike[str]) -> None:
    """Refuse a path that no file can be written to, by writing an empty one beside it, which is taken away again.

    Raises
    ------
    OSError, ValueError
        As of `write_atomically`.
    """
    target = replaceable(path)
    try:
        if target.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        with tempfile.NamedTemporaryFile(dir=target.parent, prefix=f".{target.name}.", suffix=".part"):
            pass
    except OSError as error:
        raise naming(target, error) from error


def _permissions(target: Path) -> int:
    """Those of the file that is replaced, else what a new file gets: temporary files are for their owner alone."""
    if target.exists():
        return target.stat().st_mode & 0o777
    mask = os.umask(0)  # the only way to read it is to set it
    os.umask(mask)
    return 0o666 & ~mask


def naming(target: Path, error: OSError) -> OSError:
    """The error of the operating system in words that name the target."""
    reason = error.strerror or str(error)
    return type(error)(
        error.errno, f"`path` must be a file in a folder that can be written to: {reason}; got", str(target)
    )
