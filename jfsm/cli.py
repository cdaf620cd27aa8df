"""The command line: it parses, calls and prints.

Exit codes: 0 consistent (or done, where nothing is judged), 1 anything found or undecided, 2 bad input, 3 not finished.
Whatever is slow to import is imported by the command that needs it.
"""

import functools
import os
import re
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from inspect import Parameter, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from platformdirs import user_cache_path

if TYPE_CHECKING:
    import jax

    from .diagnosis import Diagnosis
    from .records import Record
    from .structures import Structure

FOUND, BAD_INPUT, NOT_FINISHED = 1, 2, 3

_PACE = 600.0
"""Seconds over which the time left is judged: one step of a diagnosis may compile for half a minute."""

_WORTH_KEEPING = "0.2"
"""Seconds of compilation from which a program is kept for the next call."""

app = typer.Typer(
    help="What a simulation gets wrong against a measured record, the name of the cause, and the gain of mending it.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


def _option(text: str, metavar: str | None = None, panel: str | None = None) -> Any:
    return typer.Option(help=text, metavar=metavar, rich_help_panel=panel, show_default=False)


_CHANNELS = "Channels of the record"
Names = Annotated[list[str] | None, _option("Name in the file; once per degree of freedom.", "[DOF=]NAME", _CHANNELS)]
Units = Annotated[list[str] | None, _option("Unit of a channel, as y=mm; once per channel.", "NAME=UNIT", _CHANNELS)]
Where = Annotated[
    list[str] | None, _option("Rows of a long table to take, as run=3; once per column.", "NAME=VALUE", _CHANNELS)
]
Rate = Annotated[float | None, _option("Samples per second of a file without a clock.", "HZ", _CHANNELS)]
ModelFile = Annotated[Path, _option("The model that is believed, as TOML.")]
Seed = Annotated[int | None, _option("Seed of the few random draws; without it, another one every time.")]


def command(function: Callable[..., None]) -> Callable[..., None]:
    """A command that owns its process: doubles from here on, and an exit code for every way to end."""

    @functools.wraps(function)
    def run(**options: Any) -> None:
        try:
            _settle_jax()
            function(**options)
        except BrokenPipeError:  # whoever read the output has seen enough; typer ends such a process in silence
            raise
        except (ValueError, OSError) as error:
            if not _is_refusal(error):
                raise
            _say(_words(error))
            raise typer.Exit(BAD_INPUT) from None
        except KeyboardInterrupt:
            _say("Stopped before the end; no file was left half written.")
            raise typer.Exit(NOT_FINISHED) from None

    return app.command()(run)


def _settle_jax() -> None:
    """Double precision from here on, and compiled programs kept for the next call; JAX itself is loaded where needed.

    `JAX_COMPILATION_CACHE_DIR` says where they are kept, `JAX_ENABLE_COMPILATION_CACHE=0` that they are not.
    """
    if "jax" in sys.modules:
        sys.modules["jax"].config.update("jax_enable_x64", True)
        return
    # Read when it is loaded.
    os.environ["JAX_ENABLE_X64"] = "1"
    os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(user_cache_path("jfsm")))
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", _WORTH_KEEPING)


@dataclass(frozen=True)
class RecordFile:
    """A file, and what its channels are called: the options that every command with a record shares."""

    record: Annotated[Path, typer.Argument(metavar="RECORD", help="A csv, txt, npz or mat file.", show_default=False)]
    force: Names = None
    displacement: Names = None
    velocity: Names = None
    acceleration: Names = None
    base_acceleration: Annotated[str | None, _option("Name in the file.", "NAME", _CHANNELS)] = None
    time: Annotated[str | None, _option("Name of the column of instants.", "NAME", _CHANNELS)] = None
    rate: Rate = None
    unit: Units = None
    where: Where = None
    at_rest: Annotated[
        bool, typer.Option("--at-rest", help="At rest at the first sample.", rich_help_panel=_CHANNELS)
    ] = False
    drive: Annotated[
        str | None, _option("What is imposed: force, or motion (a component on a rig).", "force|motion", _CHANNELS)
    ] = None

    def read(self) -> "Record":
        """The record in the file."""
        from .records import read

        try:
            return read(
                self.record,
                force=_channel_names("force", self.force),
                displacement=_channel_names("displacement", self.displacement),
                velocity=_channel_names("velocity", self.velocity),
                acceleration=_channel_names("acceleration", self.acceleration),
                base_acceleration=self.base_acceleration,
                time=self.time,
                rate=self.rate,
                units=_units(self.unit),
                where=_where(self.where),
                at_rest=self.at_rest or None,  # without the option, what the file says
                drive=self.drive,  # pyright: ignore[reportArgumentType]  # refused there unless it is one of the two
            )
        except TypeError as error:  # from what the file holds; a TypeError of any later step is a mistake of ours
            raise ValueError(f"{self.record}: {error}") from error


def takes_record(function: Callable[..., None]) -> Callable[..., None]:
    """The command with RECORD and its channel options in place of its first parameter, a `RecordFile`."""
    shared = signature(RecordFile).parameters
    first, *own = signature(function).parameters.values()
    parameters = [p.replace(kind=Parameter.KEYWORD_ONLY) for p in (*shared.values(), *own)]

    @functools.wraps(function)
    def run(**options: Any) -> None:
        given = RecordFile(**{name: options.pop(name) for name in shared})
        function(**{first.name: given}, **options)

    # This is where typer looks for what to parse.
    run.__signature__ = signature(function).replace(parameters=parameters)  # pyright: ignore[reportAttributeAccessIssue]
    run.__annotations__ = {p.name: p.annotation for p in parameters}
    return run


@command
@takes_record
def inspect(
    source: RecordFile, report: Annotated[Path | None, _option("Write the page here, as HTML.")] = None
) -> None:
    """Show what a record holds, and what is odd about it."""
    _check_outputs({"--report": report}, [source.record])
    inspection = source.read().inspect()
    if report is not None:
        inspection.report(report)
    inspection.print()  # last, so that a reader who closes the pipe loses no file


@command
@takes_record
def simulate(
    source: RecordFile,
    model: ModelFile,
    out: Annotated[Path, _option("Write the motion here, as a csv, txt, npz or mat file.")],
) -> None:
    """Run a model freely under the force of a record, and write its motion as a record.

    With --drive motion, the force that the record's motion needs.
    """
    from .dynamics import simulate
    from .records import Record

    _check_outputs({"--out": out}, [source.record, model])
    record = source.read()
    response = simulate(_load(model), record)
    if not response.result.ok:
        _say(f"At t = {response.escape_time:.6g} s {response.result.value}. Nothing was written.")
        raise typer.Exit(NOT_FINISHED)
    forces = {dof: samples for (kind, dof), samples in record.channels.items() if kind == "force"}
    Record(
        response.time,
        force=(forces or None) if response.force is None else response.force,
        displacement=response.displacement,
        velocity=response.velocity,
        acceleration=response.acceleration,
        base_acceleration=record.base_acceleration,
        units=record.units,
        at_rest=record.at_rest,
        drive=record.drive,
        name=f"{record.name}, simulated",
    ).write(out)
    what = "motion" if response.force is None else "force of the motion"
    typer.echo(f"The {what} of {len(response.time)} samples is in {out}.")


@command
@takes_record
def fit(
    source: RecordFile,
    model: ModelFile,
    out: Annotated[Path, _option("Write the fitted model here, as TOML.")],
    fixed: Annotated[list[str] | None, _option("What stays as it is: mass, stiffness@0-1.k; repeatable.")] = None,
) -> None:
    """Fit a model's own values to a record."""
    from .identification import fit

    _check_outputs({"--out": out}, [source.record, model])
    record, given = source.read(), _load(model)
    with _progress() as tell:
        tell("fitting", 0, 1)
        found = fit(given, record, fixed=tuple(fixed or ()))
    rows = []
    for path, value in found.values.items():
        unit = given.entries()[path][0].unit(record.units["force"], record.units["displacement"])
        low, high = found.intervals[path]
        rows.append((path, f"{given.values()[path]:.6g}", f"{value:.6g}", f"[{low:.6g}, {high:.6g}]", unit))
    _table("Fitted values", ("value", "given", "fitted", "95 % interval", "unit"), rows)
    for words in found.identifiability:
        typer.echo(words)
    found.structure.save(out)
    typer.echo(f"The fitted model is in {out}.")
    if not found.result.ok:
        _say(f"The fit {found.result.value}.")
        raise typer.Exit(FOUND)


@command
@takes_record
def diagnose(
    source: RecordFile,
    model: ModelFile,
    holdout: Annotated[str, typer.Option(help="Share of the record that is held out, a second file, or none.")] = "0.3",
    report: Annotated[Path | None, _option("Write the page here, as HTML.")] = None,
    json: Annotated[Path | None, _option("Write every number here, as JSON.")] = None,
    extended: Annotated[Path | None, _option("Write the mended model here, as TOML; a map goes beside it.")] = None,
    cause: Annotated[
        list[str] | None, typer.Option(help="Look for this cause (`jfsm causes` lists them); repeat for more.")
    ] = None,
    max_causes: Annotated[int, typer.Option(help="Effects that may act at once: 1, or 2.", min=1, max=2)] = 2,
    what_next: Annotated[
        bool, typer.Option("--next", help="Also say what test would tell the two likeliest causes apart.")
    ] = False,
    key: Seed = None,
) -> None:
    """Say what a model gets wrong about a record, why, and what mending it is worth."""
    from .diagnosis import diagnose

    inputs = [source.record, model, Path(holdout)]
    _check_outputs({"--report": report, "--json": json, "--extended": extended}, inputs)
    record, held, believed = source.read(), _holdout(holdout, source), _load(model)
    with _progress() as tell:
        d = diagnose(record, believed, holdout=held, causes=cause, max_causes=max_causes, key=_key(key), progress=tell)
    if report is not None:
        d.report(report)
    if json is not None:
        d.to_json(json)
    if extended is not None:
        d.extended.save(extended)
    d.print()  # last, so that a reader who closes the pipe loses no file
    if what_next:
        _say_what_next(d, _key(key))
    if d.verdict != "consistent":
        raise typer.Exit(FOUND)


@command
@takes_record
def map(
    source: RecordFile,
    model: Annotated[Path | None, _option("Map what this model lacks, as TOML; else all of the force.")] = None,
    mass: Annotated[float | None, _option("Mass of a single degree of freedom, without a model.", "KG")] = None,
    at: Annotated[str | None, _option("The link, where the model has several; 0 is ground.", "I-J")] = None,
    method: Annotated[
        str, typer.Option(help="What learns the map: rkpm, kriging, or joint: kriging with the motion.")
    ] = "rkpm",
    order: Annotated[int | None, _option("Order of its polynomials; chosen by the readings without it.")] = None,
    out: Annotated[Path | None, _option("Write the map here, as npz.")] = None,
    report: Annotated[Path | None, _option("Write the page here, as HTML.")] = None,
) -> None:
    """Map the force of a record, or what a model lacks of it, over displacement and velocity."""
    from .diagnosis import map_force

    inputs = [source.record] if model is None else [source.record, model]
    _check_outputs({"--out": out, "--report": report}, inputs)
    record, believed, link = source.read(), None if model is None else _load(model), _link(at)
    with _progress() as tell:
        tell("the motion and the map", 0, 1)
        found = map_force(record, believed, mass, link, method, order)
    if out is not None:
        found.force_map.save(out)
    if report is not None:
        found.report(report)
    found.print()  # last, so that a reader who closes the pipe loses no file


@command
def report(
    numbers: Annotated[
        Path, typer.Argument(metavar="JSON", help="What `jfsm diagnose --json` wrote.", show_default=False)
    ],
    report: Annotated[Path, _option("Write the page here, as HTML.")],
) -> None:
    """Make the page of a diagnosis again from its numbers."""
    from .reporting import render_json, write_text_atomically

    _check_outputs({"--report": report}, [numbers])
    write_text_atomically(report, render_json(numbers))
    typer.echo(f"The page is {report.resolve()}.")


@command
def causes() -> None:
    """List the catalogue of causes."""
    from .structures import causes

    for family in dict.fromkeys(cause.family for cause in causes().values()):
        rows = [
            (cause.id, f"{', '.join(p.name for p in cause.effect.parameters)}: {cause.sentence}")
            for cause in causes().values()
            if cause.family == family
        ]
        _table(family.capitalize(), ("cause", "parameters and what it is"), rows)


@command
def demo(
    data: Annotated[Path | None, _option("Diagnose this file instead of the made-up record, as Silverbox.")] = None,
    force: Annotated[str, typer.Option(help="Name of the force in --data.", rich_help_panel=_CHANNELS)] = "u",
    displacement: Annotated[
        str, typer.Option(help="Name of the displacement in --data.", rich_help_panel=_CHANNELS)
    ] = "y",
    unit: Units = None,
    rate: Rate = None,
    report: Annotated[Path, typer.Option(help="Where the page goes, as HTML.")] = Path("jfsm-demo.html"),
    key: Annotated[int, typer.Option(help="Seed of the made-up record and of the few random draws.", min=0)] = 0,
) -> None:
    """Show a whole diagnosis: of a made-up record that hides an effect, or of a measured one."""
    from .demo import hidden_friction, measured
    from .diagnosis import diagnose

    _check_outputs({"--report": report}, [] if data is None else [data])
    with _progress() as tell:
        tell("the record and the linear model", 0, 1)
        if data is None:
            shown = hidden_friction(key)
        else:
            shown = measured(data, force=force, displacement=displacement, units=_units(unit), rate=rate)
        typer.echo(shown.introduction + "\n")
        d = diagnose(shown.record, shown.model, holdout=shown.holdout, key=_key(key), progress=tell)
    d.report(report)
    d.print()
    if shown.hidden is not None:
        typer.echo(shown.hidden)
    typer.echo(f"The page is {report.resolve()}.")


@command
def paper(
    section: Annotated[
        list[str] | None, _option("Repeat this section alone: 2, 3, 4, 5 or noise; repeat for more.", "SECTION")
    ] = None,
    figures: Annotated[Path | None, _option("Draw the figures into this folder, as PNG.", "DIR")] = None,
    json: Annotated[Path | None, _option("Write every number here, as JSON.")] = None,
) -> None:
    """Repeat the study of the paper this grew from: its numbers beside ours and the truth."""
    from .paper import study

    _check_outputs({"--json": json}, [])
    if figures is not None:
        figures.mkdir(parents=True, exist_ok=True)  # before any work: what stands in its way is refused
    with _progress() as tell:
        found = study(section, tell)
        if figures is not None:
            found.figures(figures, tell)
    if json is not None:
        found.to_json(json)
    for outcome in found.sections.values():
        for table in outcome.tables():
            _table(table.title, table.headings, table.rows)
            for note in table.notes:
                typer.echo(f"  {note}.")
            typer.echo()
    typer.echo("! marks what the paper prints otherwise than the truth is; errors are relative.")


@contextmanager
def _progress() -> Iterator[Callable[[str, int, int], None]]:
    """A function that moves a bar on standard error: what is done, steps done, steps in all. Silent off a terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    with Progress(
        SpinnerColumn(),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.description}"),
        console=console,
        transient=True,
        disable=not console.is_terminal,
        speed_estimate_period=_PACE,
    ) as bar:
        task = bar.add_task("", total=None)

        def tell(what: str, done: int, total: int) -> None:
            bar.update(task, description=what, completed=done, total=total)

        yield tell


def _say_what_next(d: "Diagnosis", key: "jax.Array | None") -> None:
    """Tests that would tell the two likeliest causes apart, as a table."""
    with _progress() as tell:
        found = d.next_tests(key, tell)
    if not found:
        typer.echo("There are no two causes that a test could tell apart.")
        return
    rows = [(f"{p.nats:.0f}", f"x {p.reach:.2g}", p.what) for p in found]
    one, other = found[0].rivals
    _table(f"What to measure next, to tell {one} from {other}", ("nats", "response", "test"), rows)
    if not found[0].tells:
        typer.echo("None of them would.")


def _table(title: str, headings: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(title=title, title_justify="left", box=SIMPLE_HEAD)
    for heading in headings[:-1]:
        table.add_column(heading, no_wrap=True)
    table.add_column(headings[-1])
    for row in rows:
        table.add_row(*(Text(cell) for cell in row))  # as text: a bracket in a unit or an interval is not markup
    Console().print(table)


def _say(message: str) -> None:
    """One paragraph on standard error."""
    typer.echo(f"jfsm: {' '.join(message.split())}", err=True)


def _is_refusal(error: Exception) -> bool:
    """Whether an error is about the input: of the operating system, or raised by jfsm in words.

    A ValueError from a library underneath is a mistake of jfsm, whose traceback is wanted.
    """
    *_, (frame, _) = traceback.walk_tb(error.__traceback__)
    package = frame.f_globals.get("__package__") or ""
    return isinstance(error, OSError) or package.split(".")[0] == "jfsm"


def _words(error: Exception) -> str:
    """What went wrong; of an error of the operating system without its number."""
    if isinstance(error, OSError) and error.strerror:
        return f"{error.strerror}: {error.filename}"
    return str(error)


def _check_outputs(outputs: Mapping[str, Path | None], inputs: Sequence[Path]) -> None:
    """Refuse, before any work, what would end in a lost input or in no output."""
    taken = {path.resolve(): "is an input of this command" for path in inputs}
    for option, path in outputs.items():
        if path is None:
            continue
        place = path.resolve()
        if place in taken:
            raise ValueError(f"{option} must not be a file that is needed: {path} {taken[place]}. Choose another name.")
        if place.is_dir() or not place.parent.is_dir():
            raise ValueError(f"{option} must be a file in a folder that exists; it was {path}. Make the folder first.")
        taken[place] = f"is {option} already"


def _channel_names(kind: str, given: Sequence[str] | None) -> str | list[str] | dict[int, str] | None:
    """Names of the channels of a kind, as `jfsm.read` takes them; those written ``2=x2`` by degree of freedom."""
    if not given:
        return None
    numbered = [re.fullmatch(r"(\d+)=(.+)", text) for text in given]
    if not any(numbered):
        return given[0] if len(given) == 1 else list(given)
    names = {int(match[1]): match[2] for match in numbered if match}
    if len(names) < len(given):
        raise ValueError(
            f"--{kind} must give each degree of freedom once, as 1=x1 and 2=x2, or none at all; it was "
            f"{', '.join(given)}."
        )
    return names


def _units(given: Sequence[str] | None) -> dict[str, str] | None:
    """Units by channel, from ``y=mm``."""
    pairs = [text.rpartition("=") for text in given or ()]
    for name, _, unit in pairs:
        if not (name and unit):
            raise ValueError(f"--unit must be a channel and its unit, as y=mm; it was {name or unit!r}.")
    return {name: unit for name, _, unit in pairs} or None


def _where(given: Sequence[str] | None) -> dict[str, str | float] | None:
    """Values by column, from ``run=3`` and ``specimen=B``; what can be a number is one."""
    found: dict[str, str | float] = {}
    for text in given or ():
        name, _, value = text.partition("=")
        if not (name and value) or name in found:
            raise ValueError(
                f"--where must be a column and its value, as run=3, each column once; it was {', '.join(given or ())}."
            )
        try:
            found[name] = float(value)
        except ValueError:
            found[name] = value
    return found or None


def _link(text: str | None) -> tuple[int, int] | None:
    """A link, from ``0-1``."""
    if text is None:
        return None
    ends = re.fullmatch(r"(\d+)-(\d+)", text)
    if not ends:
        raise ValueError(f"--at must be two degrees of freedom, as 0-1, where 0 is ground; it was {text!r}.")
    return int(ends[1]), int(ends[2])


def _holdout(text: str, source: RecordFile) -> "float | Record | None":
    """A share, nothing, or another file with the same channels."""
    if text == "none":
        return None
    try:
        return float(text)
    except ValueError:
        if not Path(text).is_file():
            raise ValueError(f"--holdout must be a share such as 0.3, a file, or none; it was {text!r}.") from None
        return replace(source, record=Path(text)).read()


def _load(path: Path) -> "Structure":
    from .structures import Structure

    try:
        return Structure.load(path)
    except TypeError as error:  # a text where a number belongs
        raise ValueError(f"{path}: {error}") from error


def _key(seed: int | None) -> "jax.Array | None":
    import jax

    return None if seed is None else jax.random.key(seed)


def main() -> None:
    """The program ``jfsm``."""
    try:
        app()
    except SystemExit as end:
        if end.code == NOT_FINISHED:
            # Amid tracing an interrupt leaves jaxlib in a state that crashes when it is torn down, which would turn
            # the exit code into that of a segmentation fault. Everything has been said: leave at once.
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(NOT_FINISHED)
        raise


if __name__ == "__main__":
    main()
