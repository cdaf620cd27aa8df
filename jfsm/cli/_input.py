"""What a command is given: records with their channels, models, and where the results go."""

import functools
import re
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from inspect import Parameter, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Self

import typer

from .._files import check_writable

if TYPE_CHECKING:
    import jax

    from ..records import Listing, OutUnits, Reading, Record


def option(text: str, metavar: str | None = None, panel: str | None = None) -> Any:
    return typer.Option(help=text, metavar=metavar, rich_help_panel=panel, show_default=False)


def argument(metavar: str, text: str) -> Any:
    return typer.Argument(metavar=metavar, help=text, show_default=False)


CHANNELS = "Channels of the record"
"""The panel of the help in which they stand."""

_FORMATS = "text, spreadsheet, MATLAB, HDF5, TDMS, ...; told by what it holds (docs/files.md)."

Names = Annotated[list[str] | None, option("Name in the file; once per degree of freedom.", "[DOF=]NAME", CHANNELS)]
Units = Annotated[list[str] | None, option("Unit of a channel, as y=mm; once per channel.", "NAME=UNIT", CHANNELS)]
Where = Annotated[
    list[str] | None, option("Rows of a long table to take, as run=3; once per column.", "NAME=VALUE", CHANNELS)
]
Rate = Annotated[float | None, option("Samples per second of a file without a clock.", "HZ", CHANNELS)]
ShownUnits = Annotated[
    str | None,
    option("Show results in these units, as in,lbf,deg, or in those of the record (given).", "UNITS|given"),
]
Seed = Annotated[int | None, option("Seed of the few random draws; without it, another one every time.")]


def _dashed(name: str) -> str:
    return name.replace("_", "-")


@dataclass(frozen=True, kw_only=True)
class Channels:
    """What the channels of a file are called: the options that every command with records shares."""

    force: Names = None
    displacement: Names = None
    velocity: Names = None
    acceleration: Names = None
    base_acceleration: Annotated[str | None, option("Name in the file.", "NAME", CHANNELS)] = None
    time: Annotated[str | None, option("Name of the column of instants.", "NAME", CHANNELS)] = None
    rate: Rate = None
    unit: Units = None
    where: Where = None
    sensitivity: Annotated[
        list[str] | None,
        option("Of a channel in raw units, as 'a1=100 mV/g'; once per channel.", "NAME=TEXT", CHANNELS),
    ] = None
    run: Annotated[str | None, option("Which of several runs in the file, from 1.", "NUMBER", CHANNELS)] = None
    sheet: Annotated[str | None, option("Which sheet of a spreadsheet.", "NAME", CHANNELS)] = None
    since: Annotated[float | None, option("Leave out what comes before this instant.", "SECONDS", CHANNELS)] = None
    until: Annotated[float | None, option("Leave out what comes after this instant.", "SECONDS", CHANNELS)] = None
    resample: Annotated[
        str | None,
        option("Bring the record to this rate, or to that of its median step (auto).", "HZ|auto", CHANNELS),
    ] = None
    every: Annotated[
        int | None,
        option("Bring the record to a rate so many times lower, without aliasing.", "NUMBER", CHANNELS),
    ] = None
    at_rest: Annotated[
        bool, typer.Option("--at-rest", help="At rest at the first sample.", rich_help_panel=CHANNELS)
    ] = False
    drive: Annotated[
        str | None, option("What is imposed: force, or motion (a component on a rig).", "force|motion", CHANNELS)
    ] = None

    def reading(self, *, cut: bool = False) -> "Reading":
        """How files are read with these options; with `cut` between the instants that were given."""
        from ..records import Reading

        kinds = {kind: _channel_names(kind, getattr(self, kind)) for kind in _KINDS.split("|")}
        cuts = {"since": self.since, "until": self.until} if cut else {}
        asked = dict(
            **kinds,
            base_acceleration=self.base_acceleration,
            time=self.time,
            rate=self.rate,
            units=units(self.unit),
            where=_where(self.where),
            sensitivity=_sensitivities(self.sensitivity),
            run=self.run,
            sheet=self.sheet,
            at_rest=self.at_rest or None,  # without the option, what the file says
            drive=self.drive,  # refused there unless it is one of the two
            every=_every(self.every, self.resample),
            resample=None if self.resample is None else _rate(self.resample),
            **cuts,
        )
        return Reading({name: value for name, value in asked.items() if value is not None})

    def read_file(self, path: Path, *, cut: bool = False) -> "Record":
        """The record in a file, or with `cut` the part of it between the instants that were given."""
        return read_as(self.reading(cut=cut), path)

    def held_out(self, given: Sequence[str] | None) -> "float | list[Record] | None":
        """A share, nothing, or the records in other files."""
        match given:
            case None | []:
                return 0.3
            case ["none"]:
                return None
            case [text] if not Path(text).is_file():
                try:
                    return float(text)
                except ValueError:
                    pass
        for text in given:
            if not Path(text).is_file():
                raise ValueError(f"--holdout must be a share such as 0.3, none, or files; it was {text!r}.")
        return [self.read_file(Path(text)) for text in given]

    def read_simulated(self, path: Path) -> "Record":
        """The output of a simulation in a file, which may leave out what drove it."""
        try:
            return self.read_file(path, cut=True)
        except ValueError:
            answer = self._without_drive()
            if answer == self:
                raise
            try:
                return answer.read_file(path, cut=True)
            except ValueError:
                pass
            raise

    def _without_drive(self) -> Self:
        """The channels but for forces and the base, and but for what is said of these."""
        driving = {name.rpartition("=")[2] for name in [*(self.force or ()), self.base_acceleration or ""]}

        def others(given: list[str] | None) -> list[str] | None:
            return [text for text in given or () if text.partition("=")[0] not in driving] or None

        return replace(
            self, force=None, base_acceleration=None, unit=others(self.unit), sensitivity=others(self.sensitivity)
        )

    def listing(self, path: Path) -> "Listing | None":
        """What a file holds of which nothing was asked for and which does not say itself what is what; else None."""
        from ..records import listing

        if any((self.force, self.displacement, self.velocity, self.acceleration, self.base_acceleration)):
            return None
        found = listing(path, time=self.time, rate=self.rate, run=self.run, sheet=self.sheet)
        return None if found.told else found

    def given_but(self, *names: str) -> list[str]:
        """The options that were given beside these, by their names alone."""
        others = (field.name for field in fields(Channels) if field.name not in names)
        return [f"--{_dashed(name)}" for name in others if getattr(self, name) not in (None, False)]

    def given(self) -> list[str]:
        """The options that were given, as they would be typed."""
        words = list[str]()
        for field in fields(Channels):
            value, name = getattr(self, field.name), f"--{_dashed(field.name)}"
            if value is True:
                words.append(name)
            elif value not in (None, False):
                words += [
                    word for each in (value if isinstance(value, list) else [value]) for word in (name, f"{each}")
                ]
        return words


@dataclass(frozen=True, kw_only=True)
class RecordFile(Channels):
    """A file, and what its channels are called."""

    record: Annotated[Path, argument("RECORD", f"The record: {_FORMATS}")]

    def proposal(self, command: str, names: Mapping[str, Sequence[str]] | None = None, *, even: bool = True) -> str:
        """The command line that does something with the record, its channels those of these `names`, its clock made
        uniform if it is not `even`."""
        channels = [word for kind, of in (names or {}).items() for name in of for word in (f"--{_dashed(kind)}", name)]
        uniform = [] if even else ["--resample", "auto"]
        words = ["jfsm", command, str(self.record), *channels, *self.given(), *uniform]
        model = ["--model", "MODEL.toml"] if command == "diagnose" else []
        return shlex.join([*words, *model])

    def read(self) -> "Record":
        """The record in the file."""
        return self.read_file(self.record, cut=True)


@dataclass(frozen=True, kw_only=True)
class RecordFiles(Channels):
    """Files whose channels are called alike: levels, repeats or starts of one test."""

    records: Annotated[list[Path], argument("RECORD", f"One record, or several of one test: {_FORMATS}")]

    def read(self) -> "list[Record]":
        """The records in the files."""
        return [self.read_file(path, cut=True) for path in self.records]


def read_as(reading: "Reading", path: Path) -> "Record":
    """The record in a file, read so."""
    try:
        return reading.read(path)
    except TypeError as error:  # from what the file holds; a TypeError of any later step is a mistake of ours
        raise ValueError(f"{path}: {error}") from error


def takes_record(function: Callable[..., None]) -> Callable[..., None]:
    """The command with the options of `RecordFile` or `RecordFiles` in place of its first parameter, which is one."""
    first, *own = signature(function).parameters.values()
    shared = signature(first.annotation).parameters
    parameters = [p.replace(kind=Parameter.KEYWORD_ONLY) for p in (*shared.values(), *own)]

    @functools.wraps(function)
    def run(**options: Any) -> None:
        given = first.annotation(**{name: options.pop(name) for name in shared})
        function(**{first.name: given}, **options)

    # This is where typer looks for what to parse.
    run.__signature__ = signature(function).replace(parameters=parameters)  # pyright: ignore[reportAttributeAccessIssue]
    run.__annotations__ = {p.name: p.annotation for p in parameters}
    return run


def is_even(record: "Record") -> bool:
    """Whether the clock of a record is uniform, as a model needs it."""
    try:
        _ = record.dt
    except ValueError:
        return False
    return True


def random_key(seed: int | None) -> "jax.Array | None":
    import jax

    if seed is not None and not 0 <= seed < 2**63:
        raise ValueError(f"--key must be a whole number from 0 to {2**63 - 1}; it was {seed}.")
    return None if seed is None else jax.random.key(seed)


def link(text: str | None) -> tuple[int, int] | None:
    """A link, from ``0-1``."""
    if text is None:
        return None
    ends = re.fullmatch(r"(\d+)-(\d+)", text)
    if not ends:
        raise ValueError(f"--at must be two degrees of freedom, as 0-1, where 0 is ground; it was {text!r}.")
    return int(ends[1]), int(ends[2])


def units(given: Sequence[str] | None) -> dict[str, str] | None:
    """Units by channel, from ``y=mm``."""
    pairs = [text.rpartition("=") for text in given or ()]
    for name, _, unit in pairs:
        if not (name and unit):
            raise ValueError(f"--unit must be a channel and its unit, as y=mm; it was {name or unit!r}.")
    return {name: unit for name, _, unit in pairs} or None


def check_outputs(outputs: Mapping[str, Path | None], inputs: Sequence[Path]) -> None:
    """Refuse, before any work, what would end in a lost input or in no output."""
    taken = {path.resolve(): "is an input of this command" for path in inputs}
    for name, path in outputs.items():
        if path is None:
            continue
        place = path.resolve()
        if place in taken:
            raise ValueError(f"{name} must not be a file that is needed: {path} {taken[place]}. Choose another name.")
        if place.is_dir() or not place.parent.is_dir():
            raise ValueError(f"{name} must be a file in a folder that exists; it was {path}. Make the folder first.")
        try:
            check_writable(path)
        except OSError as error:
            why = getattr(error.__cause__, "strerror", None) or error
            raise ValueError(
                f"{name} must be a file that can be written; it was {path} ({why}). Choose another place."
            ) from error
        except ValueError as error:
            raise ValueError(f"{error}".replace("`path`", name)) from error
        taken[place] = f"is {name} already"


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


def in_options(message: str) -> str:
    """A message in the words of the command line: ``--time NAME`` for ``time="..."``, ``--unit y=mm`` for units."""
    for pattern, replacement in _IN_OPTIONS:
        message = re.sub(pattern, replacement, message)
    return message


_KINDS = "force|displacement|velocity|acceleration"
_SAME = "time|rate|run|sheet|where|sensitivity|since|until|drive|fixed|holdout|method|order"
_IN_OPTIONS = (
    (r"`units` to show results in", "--out-units"),
    (r"\bunits=\{'([^']*)': '([^']*)'\}", r"--unit '\1=\2'"),
    (r"\bunits=\{'([^']*)': \.\.\.\}", r"--unit '\1=UNIT'"),
    (r"\bunits=\{\.\.\.\}", "--unit NAME=UNIT"),
    (r"\bunits= ", "--unit "),
    (r"\btime='([^']*)'", r"--time '\1'"),
    (r"\btime=\"\.\.\.\"", "--time NAME"),
    (r"\brate=\.\.\. \[Hz\]", "--rate HZ"),
    (rf'\b({_KINDS})="\.\.\."', r"--\1 NAME"),
    (r'\bdrive="(force|motion)"', r"--drive \1"),
    (r"`?\bat_rest=True`?", "--at-rest"),
    (r"\bPass (run|sheet)=(\d+)", r"Pass --\1 \2"),
    (r"\brecord\.resample\(rate\)", "--resample HZ"),
    (r"\brecord\.resample\(([^)]*)\)", r"--resample \1, or --resample auto"),
    (r"(\b(?:jfsm|record)\.[a-z]+\([^)]*\))(?! in Python)", r"\1 in Python"),
    (r"`units`", "--unit"),
    (r"`causes`", "--cause"),
    (r"`path` must be a name that MATLAB", "--out must be a name that MATLAB"),
    (r"`at` must (say which|be a) link", r"--at must \1 link"),
    (r"`(base_acceleration|max_causes|time_limit|stick_speed)`", lambda match: f"--{_dashed(match[1])}"),
    (rf"`({_KINDS}|{_SAME})`", r"--\1"),
    (r"^`record`", "RECORD"),
    (r"`record`", "the record"),
    (r"`model`", "--model"),
    (r"--model or `mass`", "--model or --mass"),
    (r"`at` must name a link", "--at must name a link"),
)


def _sensitivities(given: Sequence[str] | None) -> dict[str, str] | None:
    """Sensitivities by channel, from ``a1=100 mV/g``."""
    pairs = [text.partition("=") for text in given or ()]
    for name, _, text in pairs:
        if not (name and text):
            raise ValueError(f"--sensitivity must be a channel and its sensitivity, as 'a1=100 mV/g'; it was {name!r}.")
    return {name: text for name, _, text in pairs} or None


def _rate(text: str) -> "float | str":
    """The rate that is asked for; that of the median step has a name."""
    if text == "auto":
        return text
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"--resample must be a rate in Hz or auto; it was {text!r}.") from None


def _every(every: int | None, resample: str | None) -> int | None:
    """Of so many samples one is kept."""
    if every is not None and (every < 1 or resample is not None):
        raise ValueError(
            f"--every must be a whole number from 1 on, and given without --resample; it was {every}"
            f"{'' if resample is None else f' beside --resample {resample}'}. Give one of them."
        )
    return every


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


def shown_units(text: str | None, record: "Record | None" = None) -> "OutUnits":
    """Units to show results in: those that are asked for, or those that the record came in; checked."""
    from ..records import out_units

    asked = record.written if text == "given" and record is not None else text
    out_units(asked)
    return asked
