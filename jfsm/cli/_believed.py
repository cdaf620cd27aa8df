"""The model that is believed: a TOML, or the file of another program."""

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ._input import option

if TYPE_CHECKING:
    from ..structures import Runs, Structure

ModelFile = Annotated[Path, option("The model that is believed, as TOML, or as XML of MuJoCo.")]
Joints = Annotated[
    str | None, option("Joints of an XML that move, in the order of the channels: shoulder,elbow; all without it.")
]
Inputs = Annotated[
    str | None,
    option("Inputs of an FMU: force_1=F,base_acceleration=a; 1-2=f_strut takes a force on link 1-2.", "OF=NAME,…"),
]
Outputs = Annotated[
    str | None, option("Outputs of an FMU: displacement_1=x,acceleration_2=body.a; + adds outputs.", "CHANNEL=NAME,…")
]
Parameters = Annotated[str | None, option("Parameters of an FMU: k=20000,c=1500.", "NAME=VALUE,…")]
_XML = (".xml", ".mjcf")
_FMU = ".fmu"
_CHANNEL = re.compile(r"(force|displacement|velocity|acceleration)(?:_(\d+))?")


def load(path: Path, joints: str | None = None) -> "Structure":
    """The structure in a TOML file, or the simulation in an XML."""
    if path.suffix.lower() == _FMU:
        raise ValueError(
            f"--model must be a TOML or an XML of MuJoCo here; {path} is an FMU, which can only be run: give it to "
            "jfsm diagnose."
        )
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


def load_any(
    path: Path, joints: str | None, inputs: str | None, outputs: str | None, parameters: str | None
) -> "Structure | Runs":
    """As `load`, or the FMU in a file."""
    of_fmu = {"--inputs": inputs, "--outputs": outputs, "--parameters": parameters}
    if path.suffix.lower() != _FMU:
        for name, value in of_fmu.items():
            if value is not None:
                raise ValueError(f"{name} must be left out where --model is no FMU; it is {path}.")
        return load(path, joints)
    if joints is not None:
        raise ValueError(f"--joints must be left out where --model is no XML of MuJoCo; it is {path}.")
    from ..adapters import fmu

    force: dict[int, str] = {}
    extra: dict[tuple[int, int], str] = {}
    base = None
    for of, name in _pairs("--inputs", inputs):
        if link := re.fullmatch(r"(\d+)-(\d+)", of):
            extra[int(link[1]), int(link[2])] = name
        elif of == "base_acceleration":
            base = name
        else:
            force[_channel("--inputs", of, ("force",))[1]] = name
    shown: dict[str, dict[int, str]] = {"displacement": {}, "velocity": {}, "acceleration": {}}
    for of, name in _pairs("--outputs", outputs):
        kind, j = _channel("--outputs", of, tuple(shown))
        shown[kind][j] = name
    values = {name: _number(name, value) for name, value in _pairs("--parameters", parameters)}
    return fmu.simulation(
        path,
        force=force,
        base_acceleration=base,
        displacement=shown["displacement"],
        velocity=shown["velocity"],
        acceleration=shown["acceleration"],
        extra=extra,
        parameters=values,
    )


def _pairs(option_name: str, text: str | None) -> list[tuple[str, str]]:
    """What stands on both sides of each =; commas in brackets belong to names."""
    parts = re.split(r",(?![^\[(]*[\])])", text) if text else []
    pairs = [part.partition("=") for part in parts]
    for part, (of, _, name) in zip(parts, pairs, strict=True):
        if not (of.strip() and name.strip()):
            raise ValueError(f"{option_name} must be pairs such as force_1=F,1-2=f_strut; one is {part!r}.")
    return [(of.strip(), name.strip()) for of, _, name in pairs]


def _channel(option_name: str, text: str, kinds: tuple[str, ...]) -> tuple[str, int]:
    """A channel, from ``acceleration_2``."""
    found = _CHANNEL.fullmatch(text)
    if not found or found[1] not in kinds:
        raise ValueError(
            f"{option_name} must give channels such as {kinds[0]}_1 or {kinds[0]}_2"
            f"{', base_acceleration, or links such as 1-2' if kinds == ('force',) else ''}; one is {text!r}."
        )
    return found[1], int(found[2] or 1)


def _number(name: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"--parameters must be numbers; {name} is {text!r}.") from None


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
