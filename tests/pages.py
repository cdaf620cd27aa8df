"""The Python on a page of the documentation, to be run as a reader would: block after block in one session."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


def blocks(page: Path) -> list[str]:
    """Every block of Python on a page. A source distribution leaves pages out: the test is skipped there."""
    if not page.exists():
        pytest.skip("the documentation is not part of a source distribution")
    return re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)


def run(page: Path) -> dict[str, object]:
    """Names after every block was run; they write into the current folder."""
    scope: dict[str, object] = {"__name__": "page"}
    for block in blocks(page):
        exec(compile(block, str(page.relative_to(ROOT)), "exec"), scope)
    return scope
