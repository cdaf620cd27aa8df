"""A page made again from the file of its numbers."""

import json
from pathlib import Path

from jfsm.reporting._inspection_page import render_inspection
from jfsm.reporting._page import render_page


def render_json(path: str | Path) -> str:
    """The page of what ``Diagnosis.to_json`` wrote, or of the dictionary of an inspection as JSON.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it holds neither, or is cut short.
    """
    target = Path(path)
    try:
        d = json.loads(target.read_text(encoding="utf-8"))
        if not isinstance(d, dict) or not ("verdict" in d or "comparisons" in d):
            raise ValueError("it has no verdict")
        return render_page(d) if "verdict" in d else render_inspection(d)
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise ValueError(
            f"{target} must be what `jfsm diagnose --json {target.name}` writes; it cannot be shown as such "
            f"({type(error).__name__}: {error}). It may be cut short, or be another file. Write or copy it again."
        ) from error
