"""The sections of the paper that are repeated, and what came out of them."""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from .._programs import programs_kept
from .._types import require_x64
from ..reporting import write_text_atomically
from ._cases import section_4
from ._examples import section_2, section_3
from ._figures import save_drawing
from ._kriging import section_5
from ._noise import section_noise
from ._rows import Outcome, Tell, joined

SECTIONS: dict[str, Callable[[Tell], Iterator[Outcome]]] = {
    "2": section_2,
    "3": section_3,
    "4": section_4,
    "5": section_5,
    "noise": section_noise,
}
"""What can be asked for, in the order of the paper; each yields its tables one by one."""


@dataclass(frozen=True)
class Study:
    """The outcome of each section, by its name in `SECTIONS`."""

    sections: dict[str, Outcome]

    def to_json(self, path: str | Path) -> None:
        """Every row of every section as JSON.

        Raises
        ------
        OSError
            If the file cannot be written.
        """
        plain = {name: outcome.plain() for name, outcome in self.sections.items()}
        write_text_atomically(path, json.dumps(plain, indent=1, ensure_ascii=False) + "\n")

    def figures(self, folder: str | Path, progress: Tell = lambda what, done, total: None) -> list[Path]:
        """The drawings as PNG files, named after the paper's figures; the folder is made where it is missing.

        Raises
        ------
        OSError
            If the folder cannot be made or written to.
        """
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        drawings = {name: draw for outcome in self.sections.values() for name, draw in outcome.drawings.items()}
        written = []
        for done, (name, draw) in enumerate(drawings.items()):
            progress(name.replace("_", " "), done, len(drawings))
            written.append(save_drawing(draw, folder / f"{name}.png"))
        return written


@programs_kept()
def study(
    sections: Sequence[str] | None = None,
    progress: Tell = lambda what, done, total: None,
    found: Callable[["Study", "Study"], None] = lambda part, so_far: None,
) -> Study:
    """Repeat the paper's study.

    Parameters
    ----------
    sections : sequence of str, optional
        Names in `SECTIONS`; all when None.
    progress : function, optional
        Called with what is done, steps done and steps in all of the section.
    found : function, optional
        Called with every part as soon as it is done, and with all that is done so far.

    Raises
    ------
    ValueError
        If a section is unknown, or JAX is not set to double precision.
    """
    require_x64()
    wanted = tuple(SECTIONS) if sections is None else tuple(dict.fromkeys(sections))
    for name in wanted:
        if name not in SECTIONS:
            raise ValueError(f"`sections` must be among {', '.join(SECTIONS)}; one is {name!r}.")
    so_far = Study({})
    for name, run in SECTIONS.items():
        for part in run(progress) if name in wanted else ():
            before = so_far.sections.get(name, Outcome())
            so_far = Study({**so_far.sections, name: joined(before, part)})
            found(Study({name: part}), so_far)
    return so_far
