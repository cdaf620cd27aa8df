"""Where exported texts go."""

import re
import warnings
from pathlib import Path
from typing import Any

from ..._files import as_path, write_text_atomically
from .equations import Equations

_FUNCTION = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,62}")


def exported(equations: Equations, text: str, path: Any) -> str:
    """The text, written to `path` unless that is None; warns whoever calls the structure's method of the notes."""
    for note in equations.notes:
        warnings.warn(f"In the exported text {note}", stacklevel=4)  # equinox puts a frame around methods
    if path is not None:
        write_text_atomically(as_path(path), text)
    return text


def function_name(path: str | Path | None) -> str:
    """What MATLAB calls the function in a file.

    Raises
    ------
    ValueError
        If it cannot call it so.
    """
    if path is None:
        return "equation_of_motion"
    target = as_path(path)
    if target.suffix != ".m" or not _FUNCTION.fullmatch(target.stem):
        raise ValueError(
            "`path` must be a name that MATLAB can call, such as model.m: letters, digits and underscores before .m; "
            f"got {str(path)!r}."
        )
    return target.stem
