"""Writing files so that a reader sees the old ones or the new ones, never half of one."""

import os
import tempfile
from collections.abc import Mapping
from pathlib import Path


def write_text_atomically(path: str | os.PathLike[str], text: str) -> None:
    """Write `text` as UTF-8; see `write_atomically`."""
    write_atomically({path: text.encode()})


def write_atomically(files: Mapping[str | os.PathLike[str], bytes]) -> None:
    """Write each file to a temporary one beside it, and when all are complete move them into place, in their order.

    Raises
    ------
    OSError
        If a folder is missing or cannot be written to, or a path is a folder; of the same kind as the operating
        system's own error, naming the path. Whatever stood there is still there.
    """
    parts: dict[Path, Path] = {}
    target = Path()
    try:
        for path, content in files.items():
            target = Path(path)
            handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.", suffix=".part")
            parts[target] = Path(name)
            with os.fdopen(handle, "wb") as stream:
                stream.write(content)
            parts[target].chmod(_permissions(target))
        for target, part in parts.items():
            os.replace(part, target)
    except OSError as error:
        raise _naming(target, error) from error
    finally:
        for part in parts.values():
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
