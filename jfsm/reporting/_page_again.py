"""A page made again from the file of its numbers."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from jfsm._files import as_path, parsed_json
from jfsm._format import FORMAT
from jfsm.reporting._inspection_page import render_inspection
from jfsm.reporting._page import render_page

T = TypeVar("T")


def render_json(path: str | Path) -> str:
    """The page of what ``Diagnosis.to_json`` wrote, or of the dictionary of an inspection as JSON.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it holds neither, or is cut short.
    """
    return _shown(path, lambda d: render_page(d) if "verdict" in d else render_inspection(d))


def read_diagnosis(path: str | Path) -> dict[str, Any]:
    """What ``Diagnosis.to_json`` wrote.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it does not hold the numbers of a diagnosis with its checks, is cut short, or another version wrote it.
    """

    def checked(d: dict[str, Any]) -> dict[str, Any]:
        if not d["decision"]["checks"]:
            raise ValueError("it has no checks")
        return d

    d = _shown(path, checked)
    if d.get("format") != FORMAT:
        raise ValueError(
            f"{path} must be what this version of jfsm writes (format {FORMAT}); another one wrote it (format "
            f"{d.get('format')}, jfsm {d.get('jfsm')}). Its verdict can be read, not explained or judged again: "
            "diagnose the record again with --json."
        )
    return d


def _shown(path: str | Path, show: Callable[[dict[str, Any]], T]) -> T:
    target = as_path(path)
    try:
        d = parsed_json(target.read_bytes())
        if not isinstance(d, dict) or not ("verdict" in d or "comparisons" in d):
            raise ValueError("it has no verdict")
        return show(d)
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise ValueError(
            f"{target} must be what `jfsm diagnose --json {target.name}` writes; it cannot be shown as such "
            f"({type(error).__name__}: {error}). It may be cut short, or be another file. Write or copy it again."
        ) from error
