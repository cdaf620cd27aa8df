"""The documentation: it builds without a warning, has every public name and every cause, and its Python runs."""

import os
import re
import subprocess
import sys
from importlib.util import find_spec

import pages
import pytest

import jfsm

DOCS = pages.ROOT / "docs"
QUICK = ("how-to/records.md", "how-to/export.md")
SLOW = (
    *(f"tutorials/{name}.md" for name in ("decay", "shaker", "damper", "robot", "own-simulation")),
    *(f"how-to/{name}.md" for name in ("maps", "analysis", "black-boxes")),
)
NEEDED = ("mkdocs", "material", "mkdocstrings_handlers", "nbconvert")


@pytest.mark.parametrize("page", [*QUICK, *(pytest.param(page, marks=pytest.mark.slow) for page in SLOW)])
def test_the_python_of_a_page_runs_and_ends_as_the_page_says(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)  # what a page writes it may import
    pages.run(DOCS / page)


@pytest.mark.slow
def test_the_ten_lines_of_the_readme_name_the_cause(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = pages.run(pages.ROOT / "README.md")["d"]
    assert isinstance(found, jfsm.Diagnosis) and found.findings[0].cause == "cubic_hardening"
    assert (tmp_path / "run7.html").stat().st_size > 100_000


def test_every_page_with_python_is_run_by_a_test():
    if not DOCS.exists():
        pytest.skip("the documentation is not part of a source distribution")
    here = {
        page.relative_to(DOCS).as_posix() for folder in ("tutorials", "how-to") for page in DOCS.glob(f"{folder}/*")
    }
    with_python = {page for page in here if page.endswith(".md") and pages.blocks(DOCS / page)}
    assert with_python == {*QUICK, *SLOW}


def test_every_public_name_has_a_place_in_the_reference(monkeypatch):
    if not DOCS.exists():
        pytest.skip("the documentation is not part of a source distribution")
    monkeypatch.syspath_prepend(str(DOCS / "making"))
    import names  # pyright: ignore[reportMissingImports]

    made = names.pages()
    said = [name for text in made.values() for name in re.findall(r"^::: jfsm\.(\w+)$", text, re.MULTILINE)]
    assert sorted(said) == sorted(names.public())
    assert "::: jfsm.Coulomb" in made["reference/laws.md"] and "::: jfsm.Structure" in made["reference/structures.md"]


@pytest.mark.slow
@pytest.mark.skipif(any(find_spec(name) is None for name in NEEDED), reason="needs pip install jfsm[docs]")
def test_the_site_builds_without_a_warning_and_shows_every_name_and_every_cause(tmp_path):
    if not DOCS.exists():
        pytest.skip("the documentation is not part of a source distribution")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path)]
    quiet = os.environ | {"NO_MKDOCS_2_WARNING": "true"}  # the theme's word on what mkdocs is to become
    built = subprocess.run(command, cwd=pages.ROOT, capture_output=True, text=True, env=quiet)
    assert built.returncode == 0, built.stderr
    assert "WARNING" not in built.stdout + built.stderr
    public = re.findall(r" as (\w+)$", (pages.ROOT / "jfsm" / "__init__.pyi").read_text(encoding="utf-8"), re.MULTILINE)
    reference = "".join(page.read_text(encoding="utf-8") for page in (tmp_path / "reference").rglob("*.html"))
    assert [name for name in public if f'id="jfsm.{name}"' not in reference] == []
    for cause in jfsm.causes().values():
        page = (tmp_path / "causes" / cause.family / "index.html").read_text(encoding="utf-8")
        assert f'id="{cause.id}"' in page, cause.id
        assert cause.is_value or (tmp_path / "causes" / f"{cause.id}.png").stat().st_size > 5_000, cause.id
    commands = (tmp_path / "command-line" / "index.html").read_text(encoding="utf-8")
    assert "jfsm diagnose" in commands and "--holdout" in commands
