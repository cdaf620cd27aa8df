"""Commands about models: one made from numbers, and what may be in one."""

from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ._believed import load
from ._command import command
from ._input import check_outputs, link, option
from ._laws import OwnLaws, run_laws
from ._output import say, show_table

if TYPE_CHECKING:
    from ..structures import Cause, Structure


@command
def model(
    mass: Annotated[str | None, option("Mass in kg, or masses of a chain: 1,2.", "KG[,KG...]")] = None,
    stiffness: Annotated[
        str | None, option("Spring of each mass to the one before, the first to ground.", "N/M[,...]")
    ] = None,
    damping: Annotated[str | None, option("Dashpot beside each spring; none without it.", "NS/M[,...]")] = None,
    frequency: Annotated[
        float | None, option("Natural frequency of a single mass, in place of its stiffness.", "HZ")
    ] = None,
    damping_ratio: Annotated[
        float | None, option("Damping ratio of a single mass, in place of its damping: 0.02.", "RATIO")
    ] = None,
    out: Annotated[Path | None, option("Write the model here; to standard output without it.")] = None,
) -> None:
    """Make a model file from masses, springs and dashpots, or from frequency and damping ratio.

    Without --mass, a mass of 1 kg.
    """
    from .._files import write_text_atomically

    check_outputs({"--out": out}, [])
    made = _made(_numbers("mass", mass), _numbers("stiffness", stiffness), _numbers("damping", damping), frequency,
                 damping_ratio)  # fmt: skip
    text = "".join(f"# {line}\n" for line in repr(made).splitlines()) + made.to_toml()
    if out is None:
        typer.echo(text, nl=False)
        return
    write_text_atomically(out, text)
    typer.echo(f"The model is in {out}.")


def _made(
    mass: list[float] | None,
    stiffness: list[float] | None,
    damping: list[float] | None,
    frequency: float | None,
    ratio: float | None,
) -> "Structure":
    """A chain from what was given."""
    import math

    from ..structures import Structure

    if (stiffness is None) == (frequency is None):
        raise ValueError("--stiffness or --frequency must be given, and not both.")
    if damping is not None and ratio is not None:
        raise ValueError("--damping and --damping-ratio must not both be given.")
    masses = mass or [1.0] * len(stiffness or [1.0])
    if len(masses) > 1 and (frequency is not None or ratio is not None):
        raise ValueError(
            "--frequency and --damping-ratio are those of a single mass; give --stiffness and --damping for each of "
            f"the {len(masses)}."
        )
    for name, value in (("frequency", frequency), ("damping-ratio", ratio)):
        if value is not None and not (math.isfinite(value) and value >= 0 and (value > 0 or name != "frequency")):
            raise ValueError(f"--{name} must be a positive number; it was {value:g}.")
    springs = stiffness or [masses[0] * (2 * math.pi * (frequency or 0.0)) ** 2]
    dashpots = [2 * ratio * math.sqrt(springs[0] * masses[0])] if ratio is not None else damping
    return Structure.chain(masses, springs, dashpots)


def _numbers(name: str, text: str | None) -> list[float] | None:
    """Numbers between commas."""
    if text is None:
        return None
    try:
        return [float(each) for each in text.split(",")]
    except ValueError:
        raise ValueError(
            f"--{name} must be a number, or numbers with commas between, as 1,2.5; it was {text!r}."
        ) from None


_MOST_POINTS = 10_000
"""Along one side of a table."""
_Range = Annotated[str | None, option("Of a table: from, to, and how many: =-0.01:0.01:41.", "LOW:HIGH:COUNT")]


@command
def export(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="A model file, TOML.", show_default=False)],
    out: Annotated[Path, option("Write this: .py for Python, .m for MATLAB, .csv for a table of a link's force.")],
    stick_speed: Annotated[
        float | None, option("Speed below which friction that sticks is smooth in .py and .m, in m/s.", "M/S")
    ] = None,
    at: Annotated[str | None, option("Link of the table: 0-1; the only one without it.", "I-J")] = None,
    displacement: _Range = None,
    velocity: _Range = None,
    laws: OwnLaws = None,
) -> None:
    """Write a model as Python or MATLAB that needs no jfsm, or the force of a link as a table."""
    from .._files import write_text_atomically
    from ..structures import equations_of, function_name, matlab_text, python_text, table_of

    check_outputs({"--out": out}, [model])
    run_laws(laws)
    structure, kind = load(model), out.suffix.lower()
    if kind == ".csv":
        if displacement is None:
            raise ValueError("--displacement must be given for a table, as --displacement=-0.01:0.01:41.")
        d, w = _axis("displacement", displacement), _axis("velocity", velocity or "0:0:1")
        table_of(structure.terms, d, w, link(at)).write(out)
    elif kind in (".py", ".m"):
        equations = equations_of(structure, stick_speed)
        text = python_text(equations) if kind == ".py" else matlab_text(equations, function_name(out))
        write_text_atomically(out, text)
        for note in equations.notes:
            say(f"in {out}, {note}")
    else:
        raise ValueError(f"--out must end in .py, .m or .csv; it was {out}.")
    typer.echo(f"The {'table' if kind == '.csv' else 'model'} is in {out}.")


def _axis(name: str, text: str) -> Any:
    """Equal steps from LOW:HIGH:COUNT."""
    import numpy as np

    try:
        low, high, count = text.split(":")
        ends, points = (float(low), float(high)), int(count)
    except ValueError:
        raise ValueError(f"--{name} must be LOW:HIGH:COUNT, as -0.01:0.01:41; it was {text!r}.") from None
    if not 1 <= points <= _MOST_POINTS:
        raise ValueError(f"--{name} must have 1 to {_MOST_POINTS} points; it was {text!r}.")
    return np.linspace(*ends, points)


_Name = Annotated[str | None, typer.Argument(metavar="NAME", help="Show this one alone, in full.", show_default=False)]


_Json = Annotated[Path, typer.Argument(help="What `jfsm diagnose --json` wrote.", show_default=False)]


@command
def compare(first: _Json, second: _Json) -> None:
    """Show two diagnoses side by side: verdicts, causes, sizes, own values and errors."""
    from ..diagnosis import compare_numbers
    from ..reporting import read_diagnosis

    names = ("first", "second") if first.stem == second.stem else (first.stem, second.stem)
    found = compare_numbers(read_diagnosis(first), read_diagnosis(second), names)
    for section in dict.fromkeys(row.section for row in found.rows):
        rows = [cells for row, cells in zip(found.rows, found.cells(), strict=True) if row.section == section]
        show_table(section.capitalize(), ("", *names, "unit", ""), rows)


@command
def terms(kind: _Name = None) -> None:
    """List what a model file may hold: kinds of terms and sensor effects, their parameters and formulas."""
    from ..structures import SENSORS, TERMS, formula_of

    if kind is not None:
        _show_kind(_found(kind, {each.kind: each for each in (*TERMS, *SENSORS)}, "kind", "terms"))
        return
    for title, places, classes in (("Terms", "between (i, j), 0 is ground", TERMS),
                                   ("Sensor effects", 'of a channel, ("force", 1)', SENSORS)):  # fmt: skip
        rows = [(each.kind, f"{_with_units(each.parameters)}: {formula_of(each)}") for each in classes]
        show_table(f"{title}, {places}", ("kind", "parameters, what it is"), rows)


def _show_kind(law: Any) -> None:
    """A kind in full, with its entry of a model file."""
    from ..structures import AbstractTerm, formula_of

    _show_parameters(f"{law.kind}: {formula_of(law)}", law)
    is_term = issubclass(law, AbstractTerm)
    key, at = ("term", "[0, 1]") if is_term else ("sensor", f'["{law.channels[0]}", 1]')
    numbers = "".join(f"{p.name} = 1.0\n" for p in law.parameters)
    typer.echo(f'In a model file:\n\n[[{key}]]\nkind = "{law.kind}"\nat = {at}\n{numbers}')


@command
def causes(cause: _Name = None) -> None:
    """List the catalogue of causes, or show one: formula, parameters, and what it is confused with."""
    from ..structures import causes

    known = causes()
    if cause is not None:
        _show_cause(_found(cause, known, "cause", "causes"))
        return
    for family in dict.fromkeys(each.family for each in known.values()):
        rows = [
            (each.id, f"{', '.join(p.name for p in each.effect.parameters)}: {each.sentence}")
            for each in known.values()
            if each.family == family
        ]
        show_table(family.capitalize(), ("cause", "parameters and what it is"), rows)


def _show_cause(cause: "Cause") -> None:
    """A cause in full."""
    from ..diagnosis import confused_with
    from ..structures import formula_of

    typer.echo(f"{cause.id} ({cause.family}): {cause.label}; {cause.sentence}.")
    if cause.sign:
        first = cause.effect.parameters[0].name
        typer.echo(f"{first} is {'positive' if cause.sign > 0 else 'negative'}.")
    _show_parameters(formula_of(cause.effect), cause.effect)
    for words in confused_with(cause):
        typer.echo(f"{words}")


def _show_parameters(title: str, law: Any) -> None:
    rows = [(p.name, p.unit(), p.meaning) for p in law.parameters]
    show_table(title, ("parameter", "unit", "meaning"), rows)


def _with_units(parameters: Sequence[Any]) -> str:
    return ", ".join(p.name if p.unit() == "1" else f"{p.name} [{p.unit()}]" for p in parameters)


def _found(name: str, known: Any, what: str, listing: str) -> Any:
    """What a name names, of the known ones."""
    if name in known:
        return known[name]
    close = get_close_matches(name, known, 3)
    meant = f"Did you mean {' or '.join(close)}? " if close else ""
    raise ValueError(f"There is no {what} {name!r}. {meant}`jfsm {listing}` lists them all.")
