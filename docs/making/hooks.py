"""What mkdocs calls: pages that are made from the code, so that they cannot fall behind it.

The folder of pages stays as it is; what is made here lives in the build alone.
"""

import sys
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(Path(__file__).parent)]

import jax  # noqa: E402

jax.config.update("jax_enable_x64", True)

import causes  # noqa: E402
import commands  # noqa: E402
import names  # noqa: E402
import notebook_pages  # noqa: E402

MAKERS = {"causes/": causes.pages, "reference/": names.pages, "notebooks/": notebook_pages.pages}
"""What stands in the navigation for pages that are made, and what makes them: text or a picture by its address."""


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add what is made, and its places in the navigation."""
    entries: dict[str, list[Any]] = {}
    for folder, make in MAKERS.items():
        made = make()
        for address, content in made.items():
            files.append(File.generated(config, address, content=content))
        entries[folder] = [address for address in made if address.endswith(".md")]
    files.append(File.generated(config, "command-line.md", content=commands.page()))
    config.nav = _filled(config.nav, entries)
    return files


def _filled(nav: Any, entries: dict[str, list[Any]]) -> Any:
    """The navigation with lists of pages where it names a folder that is made."""
    if isinstance(nav, list):
        return [_filled(part, entries) for part in nav]
    if isinstance(nav, dict):
        return {name: _filled(part, entries) for name, part in nav.items()}
    return entries.get(nav, nav)
