"""Writing a file so that a reader sees the old one or the new one, never half of it."""

import os
import tempfile
from pathlib import Path


def write_text_atomically(path: str | os.PathLike[str], text: str) -> None:
    """Write `text` as UTF-8 to a temporary file beside `path`, then move it there in one step.

    Raises
    ------
    OSError
        If the folder is missing or cannot be written to, or `path` is a folder; of the same kind as the operating
        system's own error, naming `path`. Whatever stood at `path` is still there.
    """
    target = Path(path)
    try:
        handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.", suffix=".part")
    except OSError as error:
        raise _naming(target, error) from error
    part = Path(name)
    try:
        with os.fdopen(handle, "w", encoding="utf-8", newline="\n") as stream:
            stream.write(text)
        part.chmod(_permissions(target))
        os.replace(part, target)
    except OSError as error:
        raise _naming(target, error) from error
    finally:
        part.unlink(missing_ok=True)


def _permissions(target: Path) -> int:
    """Those of the file that is replaced, else what a new file gets: temporary files are for their owner alone."""
    if target.exists():
        return target.stat().st_mode & 0o777
    mask = os.umask(0)  # the only way to read it is to set it
    os.umask(mask)
    return 0o666 & ~mask


def _naming(target: Path, error: OSError) -> OSError:
    reason = error.strerror or str(error)
    return type(error)(
        error.errno, f"`path` must be a file in a folder that can be written to: {reason}; got", str(target)
    )
