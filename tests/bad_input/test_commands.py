"""Every command line of the table ends with its exit code and one line on standard error, before any calculation."""

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from jfsm._terminal import spelt
from jfsm.cli import app

from .of_commands import LINES, Line, prepare
from .rows import record


@pytest.fixture(autouse=True)
def nothing_is_computed(monkeypatch: pytest.MonkeyPatch) -> None:
    def reached(*_: Any, **__: Any) -> Any:
        raise AssertionError("the calculation begins")

    for place in (
        "jfsm.diagnosis._conduct.Study",
        "jfsm.identification._fit.starts",
        "jfsm.dynamics._simulate._free_run",
    ):
        monkeypatch.setattr(place, reached)


@pytest.mark.parametrize("line", [pytest.param(line, id=line.name) for line in LINES])
def test_a_bad_command_line_ends_in_one_line(line: Line, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    prepare(tmp_path)
    if line.make is not None:
        line.make(tmp_path)
    monkeypatch.chdir(tmp_path)
    before = sorted(os.listdir(tmp_path))
    ended = CliRunner().invoke(app, line.words.split(" "))
    assert ended.exit_code == line.code, ended.output
    (said,) = ended.stderr.splitlines()
    assert said.startswith("jfsm: ") and re.search(line.says, said), said
    assert sorted(os.listdir(tmp_path)) == before


def test_what_a_link_points_at_is_written_and_the_link_stays(tmp_path: Path):
    record().write(tmp_path / "run.csv")
    page, link = tmp_path / "page.html", tmp_path / "link.html"
    page.write_text("old")
    link.symlink_to(page)
    ended = CliRunner().invoke(app, ["inspect", str(tmp_path / "run.csv"), "--report", str(link)])
    assert ended.exit_code == 0, ended.output
    assert link.is_symlink() and page.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")


def test_a_terminal_of_few_signs_shows_everything(tmp_path: Path):
    """In a process of its own, whose streams have an encoding without minus signs."""
    encoding = "cp1252"
    record().write(tmp_path / "run.csv")
    words = [sys.executable, "-m", "jfsm", "inspect", str(tmp_path / "run.csv")]
    ended = subprocess.run(
        words, capture_output=True, env={**os.environ, "PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"}
    )
    assert ended.returncode == 0, ended.stderr.decode(encoding)
    assert "noise" in ended.stdout.decode(encoding) and "To go on" in ended.stdout.decode(encoding)


def test_signs_are_spelt():
    assert spelt("−3.2 ± 0.1 N/m² ≥ 5 µm, Müller …", "ascii") == "-3.2 +- 0.1 N/m^2 >= 5 um, Muller ..."
    assert spelt("3.2 ± 0.1 µm", "cp1252") == "3.2 ± 0.1 µm"
    assert spelt("漢", "ascii") == "?"
