"""The code of a page of the documentation, to be run as a reader would: block after block in one session."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"


def text_of(page: str | Path) -> str:
    """A page, by a path of which a relative one begins at the documentation. A source distribution leaves pages out:
    the test is skipped there."""
    if not (DOCS / page).exists():
        pytest.skip("the documentation is not part of a source distribution")
    return (DOCS / page).read_text(encoding="utf-8")


def blocks(page: str | Path, language: str = "python") -> list[str]:
    """The fenced blocks of a language in a page, in order."""
    return re.findall(rf"^```{language}\n(.*?)^```$", text_of(page), flags=re.MULTILINE | re.DOTALL)


def run(page: str | Path) -> dict[str, object]:
    """Names after every block of Python was run; they write into the current folder."""
    scope: dict[str, object] = {"__name__": "page"}
    for block in blocks(page):
        exec(compile(block, str(page), "exec"), scope)
    return scope


def table(page: str | Path, heading: str) -> list[list[str]]:
    """The rows of the first table whose head begins with `heading`."""
    lines = text_of(page).splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith(f"| {heading}"))
    rows = []
    for line in lines[first + 2 :]:
        if not line.startswith("|"):
            break
        rows.append([cell.strip() for cell in line.strip("|").split("|")])
    return rows
