"""The page on files: its examples run, and it names every format."""

import re
from pathlib import Path

import pytest

from jfsm.records.formats import FORMATS

PAGE = Path(__file__).parent.parent / "docs" / "files.md"


def test_the_examples_of_the_page_on_files_run(tmp_path, monkeypatch, capsys):
    if not PAGE.exists():
        pytest.skip("the documentation is not part of a source distribution")
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert len(blocks) >= 4
    scope: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, "docs/files.md", "exec"), scope)
    assert "Counted by the rate that the file states: Sample rate: 200 Hz" in capsys.readouterr().out


def test_the_page_on_files_names_every_format():
    if not PAGE.exists():
        pytest.skip("the documentation is not part of a source distribution")
    text = PAGE.read_text(encoding="utf-8").lower()
    for each in FORMATS:
        for suffix in each.suffixes:
            assert suffix.removeprefix(".") in text, (each.name, suffix)
