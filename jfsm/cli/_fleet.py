"""The commands for many records, and for the same answer again."""

import glob
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ._believed import Joints, ModelFile, load
from ._command import BAD_INPUT, FOUND, INTERNAL, NOT_FINISHED, command
from ._input import (
    Channels,
    Seed,
    ShownUnits,
    argument,
    option,
    random_key,
    read_as,
    shown_units,
    takes_record,
)
from ._output import progress, said_in_options

if TYPE_CHECKING:
    from ..fleet import Batch
    from ..records import Reading, Record


@dataclass(frozen=True, kw_only=True)
class RecordPatterns(Channels):
    """Files of many records whose channels are called alike."""

    records: Annotated[list[str], argument("FILES", "The records: files, or patterns as 'runs/*.csv'.")]

    @property
    def paths(self) -> list[Path]:
        """The files, each once, those of a pattern in the order of their names, their numbers as numbers."""
        found = [path for text in self.records for path in _matched(text)]
        return list(dict.fromkeys(found))


@dataclass(frozen=True, kw_only=True)
class Diagnosed(Channels):
    """A diagnosis, and the files that it was made of."""

    numbers: Annotated[Path, argument("JSON", "What `jfsm diagnose --json` or `jfsm batch` wrote.")]
    records: Annotated[list[Path], argument("RECORD", "The record that was diagnosed, or the several, in their order.")]

    def reading_of(self, made: "Mapping[str, Any]") -> "Reading":
        """How the files are read: as it is said here, or else as it was done when the diagnosis was made."""
        from ..records import Reading

        given = self.reading(cut=True)
        return given if given.plain or not made.get("reading") else Reading.of_plain(made["reading"])


@command
@takes_record
def batch(
    source: RecordPatterns,
    model: ModelFile,
    out: Annotated[Path, option("The folder of the results; what is done there already is not done again.", "DIR")],
    jobs: Annotated[int, typer.Option(help="Processes that work side by side.", min=1)] = 1,
    holdout: Annotated[
        list[str] | None,
        option("Share of each record that is held out (0.3 without it), none, or a file for all.", "SHARE|FILE"),
    ] = None,
    cause: Annotated[
        list[str] | None, typer.Option(help="Look for this cause (`jfsm causes` lists them); repeat for more.")
    ] = None,
    max_causes: Annotated[int, typer.Option(help="Effects that may act at once: 1, or 2.", min=1, max=2)] = 2,
    time_limit: Annotated[
        float | None, option("Seconds for each record, after which its best verdict so far is given.", "SECONDS")
    ] = None,
    key: Seed = None,
    joints: Joints = None,
    out_units: ShownUnits = None,
) -> None:
    """Diagnose many records with one model, each by itself, and say what they have in common.

    Results are written as they come. The same command goes on where it was stopped.
    """
    from ..fleet import Settings, many, sources_of

    table = (out / "summary.csv").resolve()  # of the batch before, where results go beside the records
    inputs = sources_of([path for path in source.paths if path.resolve() != table], source.reading(cut=True))
    believed, held, asked = load(model, joints), source.held_out(holdout), shown_units(out_units)
    settings = Settings.of(
        holdout=held, causes=cause, max_causes=max_causes, time_limit=time_limit, key=random_key(key)
    )
    with progress() as tell:
        found = many(inputs, believed, out, None if jobs == 1 else jobs, settings, tell)
    with said_in_options():
        found.print(asked)
    typer.echo(f"The summary is {(out / 'summary.html').resolve()}.")
    if code := _code(found):
        raise typer.Exit(code)


@command
@takes_record
def verify(
    source: Diagnosed,
    model: Annotated[Path | None, option("The model, as TOML; by default the one in the JSON.")] = None,
    holdout: Annotated[list[Path] | None, option("A file that was held out; repeat for more.", "FILE")] = None,
    simulated: Annotated[Path | None, option("The output of the simulation, where that was given.", "FILE")] = None,
) -> None:
    """Make a diagnosis again from its record, and say whether it comes out the same.

    Files are read as the JSON says that they were; channels and the like need not be given again.
    """
    from ..diagnosis import verify
    from ..reporting import read_diagnosis

    reading = source.reading_of(read_diagnosis(source.numbers).get("provenance") or {})
    held = [read_as(reading.without("since", "until"), path) for path in holdout or ()]
    run = None if simulated is None else _read_simulated(reading, simulated)
    records = [read_as(reading, path) for path in source.records]
    believed = None if model is None else load(model)
    with progress() as tell:
        found = verify(source.numbers, records, believed, holdout=held or None, simulated=run, progress=tell)
    typer.echo(str(found))
    if not found.same:
        raise typer.Exit(FOUND)


def _read_simulated(reading: "Reading", path: Path) -> "Record":
    """The output of a simulation, which may leave out what drove it."""
    try:
        return read_as(reading, path)
    except ValueError:
        return read_as(reading.without("force", "base_acceleration"), path)


def _code(batch: "Batch") -> int:
    """The exit code of a batch: that of its worst record."""
    failures = {one.failure for one in batch.failures}
    if "internal" in failures:
        return INTERNAL
    if failures & {"unreadable", "refused"}:
        return BAD_INPUT
    if failures or not all(one.finished for one in batch.results):
        return NOT_FINISHED
    return 0 if all(one.verdict == "consistent" for one in batch.results) else FOUND


def _matched(text: str) -> list[Path]:
    """The files of a pattern, or the one of that name."""
    if Path(text).is_file():
        return [Path(text)]
    found = [Path(name) for name in glob.glob(text, recursive=True)]
    files = sorted((path for path in found if path.is_file()), key=_by_numbers)
    if not files:
        raise ValueError(f"FILES must be files, or a pattern in quotes that matches some; {text!r} matches none.")
    return files


def _by_numbers(path: Path) -> list[tuple[int, int, str]]:
    """run2 comes before run10."""
    parts = re.split(r"(\d+)", str(path))
    return [(1, int(part), "") if part.isdigit() else (0, 0, part) for part in parts]
