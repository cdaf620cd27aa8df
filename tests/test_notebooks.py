"""The notebooks: each is its script, has outputs stored, and runs to the end, where it asserts its numbers."""

import json

import matplotlib.pyplot as plt
import pages
import pytest

FOLDER = pages.ROOT / "notebooks"
NAMES = sorted(path.stem for path in FOLDER.glob("*.ipynb") if path.stem != "paper")  # that one: tests/test_paper.py
QUICK: tuple[str, ...] = ()
LARGEST = 300_000
"""Bytes of a stored notebook."""


def code(name: str) -> list[dict]:
    cells = json.loads((FOLDER / f"{name}.ipynb").read_text(encoding="utf-8"))["cells"]
    return [cell for cell in cells if cell["cell_type"] == "code"]


@pytest.mark.parametrize("name", [pytest.param(n, marks=() if n in QUICK else pytest.mark.slow) for n in NAMES])
def test_every_cell_of_a_notebook_runs_and_its_numbers_are_as_it_asserts(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    if name == "maps":
        pytest.importorskip("sklearn")
    scope: dict[str, object] = {"__name__": "notebook"}
    for cell in code(name):
        exec(compile("".join(cell["source"]), f"notebooks/{name}.ipynb", "exec"), scope)
    plt.close("all")


@pytest.mark.parametrize("name", NAMES)
def test_a_notebook_is_its_script_and_small_and_shows_what_it_printed(name):
    script = (FOLDER / f"{name}.py").read_text(encoding="utf-8")
    cells = ["".join(cell["source"]) for cell in code(name)]
    assert all(cell in script for cell in cells) and "assert " in cells[-1], f"run `python notebooks/make.py {name}`"
    blocks = [part.partition("\n")[2].strip() for part in script.split("# %%") if not part.startswith(" [markdown]")]
    assert cells == [block for block in blocks if block]
    assert sum(bool(cell["outputs"]) for cell in code(name)) >= 3
    assert (FOLDER / f"{name}.ipynb").stat().st_size < LARGEST


def test_every_script_has_a_notebook():
    if not FOLDER.exists():
        pytest.skip("the notebooks are not part of a source distribution")
    assert {path.stem for path in FOLDER.glob("*.py")} - {"make"} == set(NAMES)
