"""The notebooks as pages, with the outputs that they are stored with."""

from pathlib import Path

import nbformat
from nbconvert import MarkdownExporter

FOLDER = Path(__file__).resolve().parents[2] / "notebooks"


def pages() -> dict[str, str | bytes]:
    """A page and the pictures of every notebook, by address."""
    made: dict[str, str | bytes] = {"notebooks/index.md": ""}
    rows = []
    for path in sorted(FOLDER.glob("*.ipynb")):
        notebook = nbformat.read(path, as_version=4)
        resources = {"output_files_dir": path.stem, "unique_key": path.stem}
        text, found = MarkdownExporter().from_notebook_node(notebook, resources)
        made[f"notebooks/{path.stem}.md"] = text
        made |= {f"notebooks/{name}": data for name, data in found["outputs"].items()}
        title = text.lstrip().splitlines()[0].lstrip("# ")
        rows.append(f"- [{title}]({path.stem}.md): `notebooks/{path.name}`")
    head = "# Notebooks\n\nEach was run as it is shown, and is run again by the tests.\n\n"
    made["notebooks/index.md"] = head + "\n".join(rows) + "\n"
    return made
