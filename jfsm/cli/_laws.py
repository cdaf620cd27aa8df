"""Laws of the user's own, from Python files that are named."""

import importlib.util
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from ._input import option

if TYPE_CHECKING:
    from ..structures import CauseLike

OwnLaws = Annotated[
    list[Path] | None, option("Python file with laws of your own that the model holds; repeat for more.", "FILE.py")
]


def run_laws(paths: Sequence[Path] | None) -> None:
    """Run files of laws, so that models that hold them can be read."""
    for path in paths or ():
        laws_of(path)


def causes_named(given: Sequence[str] | None) -> "list[CauseLike] | None":
    """Causes by their ids, and laws as ``mylaws.py:TanhSpring``; of a file alone, all of its laws."""
    if not given:
        return None
    found: list[CauseLike] = []
    for text in given:
        file, colon, name = text.rpartition(":")
        if colon and file.endswith(".py"):
            found.append(_law(Path(file), name))
        elif text.endswith(".py"):
            found.extend(laws_of(Path(text)).values())
        else:
            found.append(text)
    return found


def _law(path: Path, name: str) -> Any:
    laws = laws_of(path)
    if name not in laws:
        raise ValueError(f"--cause must name a law in {path}, which holds {', '.join(laws)}; it was {name!r}.")
    return laws[name]


def laws_of(path: Path) -> dict[str, Any]:
    """The laws that a Python file defines, by the names of their classes.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If it cannot be run, or defines no law.
    """
    from ..structures import own_laws

    if not path.is_file():
        raise FileNotFoundError(f"There is no file of laws {path}.")
    if path.suffix != ".py":
        raise ValueError(
            f"A file of laws must end in .py; it was {path}. Laws are classes of Python (docs/own-laws.md)."
        )
    module = _run(path.resolve())
    laws = {law.__name__: law for law in own_laws().values() if law.__module__ == module}
    if not laws:
        raise ValueError(
            f"{path} defines no law of its own: a class that derives from jfsm.AbstractTerm (docs/own-laws.md)."
        )
    return laws


def _run(path: Path) -> str:
    """The name of the module that a file is run as; once for each file."""
    name = path.stem
    known = sys.modules.get(name)
    if known is not None and getattr(known, "__file__", None) == str(path):
        return name
    if known is not None or not name.isidentifier():  # not in place of another module
        name = f"laws_in_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        del sys.modules[name]
        raise ValueError(f"{path.name} cannot be used: {type(error).__name__}: {error}") from error
    return name
