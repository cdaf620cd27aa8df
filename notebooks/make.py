"""Makes notebooks from the percent scripts beside them, runs them, and stores what they show.

python notebooks/make.py                    all of them
python notebooks/make.py first_diagnosis    one
"""

import re
import sys
from pathlib import Path

import nbformat
from jupyter_client import KernelManager
from nbclient import NotebookClient
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

FOLDER = Path(__file__).resolve().parent
_NOTED = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}}


def cells(script: str) -> list[tuple[str, str]]:
    """Kind ("markdown" or "code") and text of every cell of a percent script."""
    found = []
    for part in re.split(r"^# %%", script, flags=re.MULTILINE)[1:]:
        head, _, body = part.partition("\n")
        if "[markdown]" in head:
            found.append(("markdown", re.sub(r"^# ?", "", body, flags=re.MULTILINE).strip()))
        else:
            found.append(("code", body.strip()))
    return found


def make(script: Path) -> None:
    """Write the notebook of a script, with what its cells show; nothing is written where a cell fails."""
    new = {"markdown": new_markdown_cell, "code": new_code_cell}
    made = [new[kind](text) for kind, text in cells(script.read_text(encoding="utf-8"))]
    for number, cell in enumerate(made):
        cell["id"] = f"cell-{number}"
    notebook = new_notebook(cells=made, metadata=_NOTED)
    NotebookClient(notebook, timeout=1800, km=KernelManager(transport="ipc")).execute()
    for cell in notebook.cells:
        cell.metadata.clear()  # when it ran
    notebook.metadata = nbformat.from_dict(_NOTED | {"language_info": {"name": "python"}})
    nbformat.write(notebook, script.with_suffix(".ipynb"))


if __name__ == "__main__":
    chosen = sys.argv[1:] or sorted(path.stem for path in FOLDER.glob("*.py") if path.stem != "make")
    for name in chosen:
        make(FOLDER / f"{name}.py")
        print(name, flush=True)
