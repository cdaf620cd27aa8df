"""The page on files: its examples run, and it names every format."""

import pages
import pytest

from jfsm.records.formats import FORMATS

PAGE = pages.ROOT / "docs" / "files.md"


def test_the_examples_of_the_page_on_files_run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert len(pages.blocks(PAGE)) >= 4
    pages.run(PAGE)
    assert "Counted by the rate that the file states: Sample rate: 200 Hz" in capsys.readouterr().out


def test_the_page_on_files_names_every_format():
    if not PAGE.exists():
        pytest.skip("the documentation is not part of a source distribution")
    text = PAGE.read_text(encoding="utf-8").lower()
    for each in FORMATS:
        for suffix in each.suffixes:
            assert suffix.removeprefix(".") in text, (each.name, suffix)
