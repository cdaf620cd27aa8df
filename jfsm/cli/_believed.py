"""The model that is believed: a TOML, or the file of another program."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ._input import option

if TYPE_CHECKING:
    from ..structures import Structure

ModelFile = Annotated[Path, option("The model that is believed, as TOML, or as XML of MuJoCo.")]
Joints = Annotated[
    str | None, option("Joints of an XML that move, in the order of the channels: shoulder,elbow; all without it.")
]
_XML = (".xml", ".mjcf")


def load(path: Path, joints: str | None = None) -> "Structure":
    """The structure in a TOML file, or the simulation in an XML."""
    if path.suffix.lower() in _XML:
        from ..adapters import mujoco

        return mujoco.simulation(path, _named(joints))
    if joints is not None:
        raise ValueError(f"--joints must be left out where --model is no XML of MuJoCo; it is {path}.")
    from ..structures import Structure

    try:
        return Structure.load(path)
    except TypeError as error:  # a text where a number belongs
        raise ValueError(f"{path}: {error}") from error


def save(found: "Structure", out: Path, given: Path | None, joints: str | None = None) -> None:
    """Write a structure as the file that was given, with what was found."""
    if given is None or given.suffix.lower() not in _XML:
        found.save(out)
        return
    from ..adapters import mujoco
    from ..reporting import write_text_atomically

    written = mujoco.written(given, found, _named(joints))
    write_text_atomically(out, written.xml)
    for term in written.left:
        typer.echo(f"No attribute of a joint stands for {term}: it is not in {out}.")


def _named(joints: str | None) -> list[str] | None:
    return None if joints is None else [name.strip() for name in joints.split(",")]
