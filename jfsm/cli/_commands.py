"""The commands."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ._believed import Inputs, Joints, ModelFile, Outputs, Parameters, load, load_any, save
from ._command import FOUND, NOT_FINISHED, command
from ._input import (
    Channels,
    RecordFile,
    RecordFiles,
    Seed,
    ShownUnits,
    check_outputs,
    is_even,
    link,
    option,
    random_key,
    shown_units,
    takes_record,
)
from ._laws import OwnLaws, causes_named, run_laws
from ._output import progress, said_in_options, say, show_listing, show_table

if TYPE_CHECKING:
    import jax

    from ..diagnosis import Diagnosis
    from ..paper import Study


@command
@takes_record
def inspect(
    source: RecordFile,
    report: Annotated[Path | None, option("Write the page here, as HTML.")] = None,
    out_units: ShownUnits = None,
) -> None:
    """Show what a record holds, and what is odd about it; of a file whose channels have no kinds, the channels."""
    check_outputs({"--report": report}, [source.record])
    if (found := source.listing(source.record)) is not None:
        asked = None if out_units == "given" else shown_units(out_units)
        found, proposal = found.in_units(asked), source.proposal("diagnose", found.proposed)
        if report is not None:
            with said_in_options():
                found.report(report, proposal)
        show_listing(found, proposal)
        if later := source.given_but("time", "rate", "run", "sheet"):
            say(f"channels must be named for {', '.join(later)}; the numbers above are of all that the file holds")
        return
    record = source.read()
    units, inspection = shown_units(out_units, record), record.inspect()
    if report is not None:
        inspection.report(report, units)
    with said_in_options():
        inspection.print(units)  # last, so that a reader who closes the pipe loses no file
    typer.echo(f"To go on: {source.proposal('diagnose', even=is_even(record))}")


@command
@takes_record
def simulate(
    source: RecordFile,
    model: ModelFile,
    out: Annotated[Path, option("Write the motion here, as a csv, txt, npz or mat file.")],
    laws: OwnLaws = None,
    joints: Joints = None,
) -> None:
    """Run a model freely under the force of a record, and write its motion as a record.

    With --drive motion, the force that the record's motion needs.
    """
    from ..dynamics import simulate
    from ..records import format_to_write

    check_outputs({"--out": out}, [source.record, model])
    format_to_write(out)
    run_laws(laws)
    record = source.read()
    response = simulate(load(model, joints), record)
    if not response.result.ok:
        say(f"At t = {response.escape_time:.6g} s {response.result.value}. Nothing was written.")
        raise typer.Exit(NOT_FINISHED)
    response.to_record().write(out)
    what = "motion" if response.force is None else "force of the motion"
    typer.echo(f"The {what} of {len(response.time)} samples is in {out}.")


@command
@takes_record
def fit(
    source: RecordFiles,
    model: ModelFile,
    out: Annotated[Path, option("Write the fitted model here, as the model is given.")],
    fixed: Annotated[list[str] | None, option("What stays as it is: mass, stiffness@0-1.k; repeatable.")] = None,
    laws: OwnLaws = None,
    joints: Joints = None,
    out_units: ShownUnits = None,
) -> None:
    """Fit a model's own values to a record, or to several at once."""
    from ..identification import fit
    from ..records import out_units as units_of
    from ..reporting import in_shown_unit, shown_in

    check_outputs({"--out": out}, [*source.records, model])
    run_laws(laws)
    records, given = source.read(), load(model, joints)
    asked = shown_units(out_units, records[0])
    with progress() as tell:
        tell("fitting", 0, 1)
        found = fit(given, records, fixed=tuple(fixed or ()))
    rows, in_units = [], records[0].units
    for path, value in found.values.items():
        low, high = found.intervals[path]
        with shown_in(units_of(asked)):
            size, unit = in_shown_unit(given.entries()[path][0].unit(in_units["force"], in_units["displacement"]))
        before, value, low, high = (f"{each / size:.6g}" for each in (given.values()[path], value, low, high))
        rows.append((path, before, value, f"[{low}, {high}]", unit))
    show_table("Fitted values", ("value", "given", "fitted", "95 % interval", "unit"), rows)
    modes = [
        (f"mode {number}, {what}", f"{size * one.value:.6g}", f"[{size * one.low:.6g}, {size * one.high:.6g}]", unit)
        for number, mode in enumerate(found.modes, start=1)
        for what, one, size, unit in (
            ("frequency", mode.frequency, 1, "Hz"),
            ("damping ratio", mode.damping_ratio, 100, "%"),
        )
    ]
    if modes:
        show_table("Frequency and damping", ("linear part", "fitted", "95 % interval", "unit"), modes)
    for words in (*found.identifiability, *filter(None, [found.missing])):
        typer.echo(words)
    save(found.structure, out, model, joints)
    typer.echo(f"The fitted model is in {out}.")
    if not found.result.ok:
        say(f"The fit {found.result.value}.")
        raise typer.Exit(FOUND)


@command
@takes_record
def diagnose(
    source: RecordFiles,
    model: Annotated[
        Path | None, option("The model that is believed, TOML, XML of MuJoCo or FMU; without it, give --simulated.")
    ] = None,
    simulated: Annotated[
        Path | None,
        option("Output of a simulation that is no TOML: its run, channels called as in the record.", "FILE"),
    ] = None,
    holdout: Annotated[
        list[str] | None,
        option(
            "Share of the record that is held out (0.3 without it), none, or a file; repeat for more.", "SHARE|FILE"
        ),
    ] = None,
    report: Annotated[Path | None, option("Write the page here, as HTML.")] = None,
    json: Annotated[Path | None, option("Write every number here, as JSON.")] = None,
    extended: Annotated[Path | None, option("Write the mended model here, as it was given; maps go beside it.")] = None,
    cause: Annotated[
        list[str] | None,
        typer.Option(
            help="Look for this cause (`jfsm causes` lists them), or for a law of your own, as mylaws.py:TanhSpring; "
            "repeat for more."
        ),
    ] = None,
    laws: OwnLaws = None,
    joints: Joints = None,
    inputs: Inputs = None,
    outputs: Outputs = None,
    parameters: Parameters = None,
    max_causes: Annotated[int, typer.Option(help="Effects that may act at once: 1, or 2.", min=1, max=2)] = 2,
    what_next: Annotated[
        bool, typer.Option("--next", help="Also say what test would tell the two likeliest causes apart.")
    ] = False,
    why: Annotated[bool, typer.Option("--why", help="Also show the checks that decided the verdict.")] = False,
    time_limit: Annotated[
        float | None, option("Seconds after which the best verdict so far is given; so does Ctrl-C.", "SECONDS")
    ] = None,
    key: Seed = None,
    out_units: ShownUnits = None,
) -> None:
    """Say what a model gets wrong about a record, why, and what mending it is worth.

    Of several records, one verdict that holds on all.
    """
    from ..diagnosis import diagnose, from_files

    if model is None and simulated is None:
        raise ValueError("--model or --simulated must be given: what the simulation is, or what it makes of the test.")
    given = [path for path in (model, simulated) if path is not None]
    files = [*source.records, *given, *(Path(text) for text in holdout or ())]
    check_outputs({"--report": report, "--json": json, "--extended": extended}, files)
    run_laws(laws)
    causes, records, held = causes_named(cause), source.read(), source.held_out(holdout)
    believed = None if model is None else load_any(model, joints, inputs, outputs, parameters)
    run = None if simulated is None else source.read_simulated(simulated)
    units = shown_units(out_units, records[0])
    with progress() as tell:
        d = diagnose(
            records,
            believed,
            holdout=held,
            causes=causes,
            max_causes=max_causes,
            key=random_key(key),
            simulated=run,
            time_limit=time_limit,
            progress=tell,
        )
    if report is not None or json is not None:
        d = from_files(d, source.records, source.reading(cut=True))
    if report is not None:
        d.report(report, units)
    if json is not None:
        d.to_json(json)
    if extended is not None:
        save(d.extended, extended, model, joints)
    with said_in_options():
        d.print(units)  # last, so that a reader who closes the pipe loses no file
    if why:
        typer.echo(d.why())
    if not d.finished:
        raise typer.Exit(NOT_FINISHED)
    if what_next:
        _say_what_next(d, random_key(key))
    if d.verdict != "consistent":
        raise typer.Exit(FOUND)


@command
@takes_record
def map(
    source: RecordFile,
    model: Annotated[Path | None, option("Map what this model lacks, as TOML; else all of the force.")] = None,
    mass: Annotated[float | None, option("Mass of a single degree of freedom, without a model.", "KG")] = None,
    at: Annotated[str | None, option("The link, where the model has several; 0 is ground.", "I-J")] = None,
    laws: OwnLaws = None,
    method: Annotated[
        str, typer.Option(help="What learns the map: rkpm, kriging, or joint: kriging with the motion.")
    ] = "rkpm",
    order: Annotated[int | None, option("Order of its polynomials; chosen by the readings without it.")] = None,
    out: Annotated[Path | None, option("Write the map here, as npz.")] = None,
    report: Annotated[Path | None, option("Write the page here, as HTML.")] = None,
    out_units: ShownUnits = None,
) -> None:
    """Map the force of a record, or what a model lacks of it, over displacement and velocity."""
    from ..mapping import map_force

    inputs = [source.record] if model is None else [source.record, model]
    check_outputs({"--out": out, "--report": report}, inputs)
    run_laws(laws)
    record, believed, place = source.read(), None if model is None else load(model), link(at)
    units = shown_units(out_units, record)
    with progress() as tell:
        tell("the motion and the map", 0, 1)
        found = map_force(record, believed, mass, place, method, order)
    if out is not None:
        found.force_map.save(out)
    if report is not None:
        found.report(report, units)
    with said_in_options():
        found.print(units)  # last, so that a reader who closes the pipe loses no file


@command
def report(
    numbers: Annotated[
        Path, typer.Argument(metavar="JSON", help="What `jfsm diagnose --json` wrote.", show_default=False)
    ],
    report: Annotated[Path, option("Write the page here, as HTML.")],
    out_units: ShownUnits = None,
) -> None:
    """Make the page of a diagnosis again from its numbers."""
    from ..records import out_units as units_of
    from ..reporting import render_json, shown_in, write_text_atomically

    check_outputs({"--report": report}, [numbers])
    with shown_in(units_of(shown_units(out_units))):
        write_text_atomically(report, render_json(numbers))
    typer.echo(f"The page is {report.resolve()}.")


@command
def why(
    numbers: Annotated[
        Path, typer.Argument(metavar="JSON", help="What `jfsm diagnose --json` wrote.", show_default=False)
    ],
    cause: Annotated[
        str | None, typer.Argument(metavar="CAUSE", help="What became of this cause; the verdict without it.")
    ] = None,
    changed: Annotated[
        list[str] | None,
        typer.Option("--with", metavar="NAME=VALUE", help="Judge again with this threshold; repeat for more."),
    ] = None,
) -> None:
    """Show the checks that decided a verdict, or what became of one cause."""
    from ..reporting import print_why, read_diagnosis

    d = read_diagnosis(numbers)
    if changed:
        d = _judged_again(d, changed)
    try:
        print_why(d, cause)
    except LookupError as error:
        raise ValueError(str(error.args[0])) from None


def _judged_again(d: dict[str, Any], changed: list[str]) -> dict[str, Any]:
    """What was written, with the verdict that other thresholds give."""
    from ..diagnosis import Thresholds, judge_again

    decision = judge_again(d, Thresholds().changed(changed))
    typer.echo(f"Judged again with {', '.join(changed)}; the file says {d['verdict']}.")
    return {"verdict": decision.verdict, "decision": decision.plain}


@command
@takes_record
def demo(
    source: Channels,
    data: Annotated[
        Path | None,
        option("Diagnose this file instead of the made-up record, as Silverbox: force u, displacement y if not named."),
    ] = None,
    report: Annotated[Path, typer.Option(help="Where the page goes, as HTML.")] = Path("jfsm-demo.html"),
    key: Annotated[int, typer.Option(help="Seed of the made-up record and of the few random draws.", min=0)] = 0,
) -> None:
    """Show a whole diagnosis: of a made-up record that hides an effect, or of a measured one."""
    from ..demo import hidden_friction, measured
    from ..diagnosis import diagnose

    check_outputs({"--report": report}, [] if data is None else [data])
    with progress() as tell:
        tell("the record and the linear model", 0, 1)
        if data is None:
            shown = hidden_friction(key)
        else:
            named = replace(source, force=source.force or ["u"], displacement=source.displacement or ["y"])
            shown = measured(named.read_file(data, cut=True))
        typer.echo(shown.introduction + "\n")
        d = diagnose(shown.record, shown.model, holdout=shown.holdout, key=random_key(key), progress=tell)
    d.report(report)
    d.print()
    if shown.hidden is not None:
        typer.echo(shown.hidden)
    typer.echo(f"The page is {report.resolve()}.")
    if not d.finished:
        raise typer.Exit(NOT_FINISHED)


@command
def paper(
    section: Annotated[
        list[str] | None, option("Repeat this section alone: 2, 3, 4, 5 or noise; repeat for more.", "SECTION")
    ] = None,
    figures: Annotated[Path | None, option("Draw the figures into this folder, as PNG.", "DIR")] = None,
    json: Annotated[Path | None, option("Write every number here, as JSON.")] = None,
) -> None:
    """Repeat the study of the paper this grew from: its numbers beside ours and the truth.

    Every table is shown and written as soon as it is done.
    """
    from ..paper import study

    check_outputs({"--json": json}, [])
    if figures is not None:
        figures.mkdir(parents=True, exist_ok=True)  # before any work: what stands in its way is refused

    def found(part: "Study", so_far: "Study") -> None:
        if json is not None:
            so_far.to_json(json)
        if figures is not None:
            part.figures(figures)
        for table in (table for outcome in part.sections.values() for table in outcome.tables()):
            show_table(table.title, table.headings, table.rows)
            for note in table.notes:
                typer.echo(f"  {note}.")
            typer.echo()

    with progress() as tell:
        study(section, tell, found)
    typer.echo("! marks what the paper prints otherwise than the truth is; errors are relative.")


def _say_what_next(d: "Diagnosis", key: "jax.Array | None") -> None:
    """Tests that would tell the two likeliest causes apart, as a table."""
    with progress() as tell:
        found = d.next_tests(key, tell)
    if not found:
        typer.echo("There are no two causes that a test could tell apart.")
        return
    rows = [(f"{p.nats:.0f}", f"x {p.reach:.2g}", p.what) for p in found]
    one, other = found[0].rivals
    show_table(f"What to measure next, to tell {one} from {other}", ("nats", "response", "test"), rows)
    if not found[0].tells:
        typer.echo("None of them would.")
