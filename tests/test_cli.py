"""The command line: what it prints, what it writes, and the code it ends with."""

import errno
import html
import json
import math
import os
import re
import signal
import subprocess
import sys
from pathlib import Path
from time import sleep
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from typer.testing import CliRunner, Result

from jfsm import Polynomial, Record, Structure, load_map, read
from jfsm.cli import app
from jfsm.cli._input import in_options
from jfsm.diagnosis import Proposal
from jfsm.records import listing

MASS, STIFFNESS, DAMPING = 2.0, 1800.0, 3.0
RATE, SAMPLES = 100.0, 500


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def flat(text: str) -> str:
    """A printed text without the breaks of its lines."""
    return " ".join(text.split())


def refusal(*arguments: object) -> str:
    """What a command says that refuses its input: one line on standard error, and nothing else anywhere."""
    result = run(*arguments)
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    (line,) = result.stderr.splitlines()
    assert line.startswith("jfsm: ")
    return line


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A record of a linear oscillator as `run.csv` (columns t, u, y in mm), its model, and a model that is stiffer."""
    place = tmp_path_factory.mktemp("cli")
    rng = np.random.default_rng(11)
    omega, phase = 2 * math.pi * np.linspace(1.0, 10.0, 25), rng.uniform(0, 2 * math.pi, 25)

    def force(t):
        return np.cos(np.multiply.outer(t, omega) + phase).sum(-1)

    def rate(t, state):
        return [state[1], (force(t) - DAMPING * state[1] - STIFFNESS * state[0]) / MASS]

    time = np.arange(SAMPLES) / RATE
    x = solve_ivp(rate, (0, time[-1]), [0, 0], t_eval=time, rtol=1e-10, atol=1e-13).y[0]
    noisy = [y + 0.01 * np.std(y) * rng.standard_normal(SAMPLES) for y in (force(time), 1e3 * x)]
    np.savetxt(place / "run.csv", np.column_stack([time, *noisy]), delimiter=",", header="t,u,y", comments="")
    Structure.sdof(MASS, STIFFNESS, DAMPING).save(place / "model.toml")
    Structure.sdof(MASS, 1.3 * STIFFNESS, DAMPING).save(place / "stiff.toml")
    return place


@pytest.fixture
def channels(folder) -> list[object]:
    return [folder / "run.csv", "--force", "u", "--displacement", "y", "--unit", "u=N", "--unit", "y=mm"]


class FakeDiagnosis(SimpleNamespace):
    """Stands for a diagnosis where only what the command makes of it is of interest."""

    finished = True

    def print(self, units: Any = None) -> None:
        print(f"verdict: {self.verdict}{f' in {units}' if units else ''}")


def answer(monkeypatch, verdict: str = "consistent") -> dict[str, Any]:
    """Lets `diagnose` return this verdict at once; what it was called with appears in the dictionary."""
    seen: dict[str, Any] = {}

    def quick(records, model, holdout, causes, max_causes, key, simulated, time_limit, progress):
        seen.update(records=records, model=model, holdout=holdout, causes=causes, max_causes=max_causes, key=key)
        seen.update(simulated=simulated, time_limit=time_limit)
        for step, what in enumerate(("looking: here", "looking: there", "deciding"), start=1):
            progress(what, step, 4)
        return FakeDiagnosis(verdict=verdict)

    monkeypatch.setattr("jfsm.diagnosis.diagnose", quick)
    return seen


def test_help_names_every_command():
    result = run("--help")
    assert result.exit_code == 0
    for name in (
        "inspect",
        "simulate",
        "fit",
        "diagnose",
        "batch",
        "verify",
        "map",
        "causes",
        "report",
        "demo",
        "paper",
    ):
        assert name in result.stdout


def test_a_record_is_inspected_in_the_units_that_are_given(channels):
    result = run("inspect", *channels)
    assert (result.exit_code, result.stderr) == (0, "")
    assert "500 samples" in result.stdout
    assert "displacement 1" in flat(result.stdout) or "displac" in result.stdout


def test_of_a_record_the_part_between_two_instants_is_read(channels):
    result = run("inspect", *channels, "--since", 1.0, "--until", 3.0)
    assert (result.exit_code, result.stderr) == (0, "")
    assert "500 samples" not in result.stdout and "are kept, t = 1 to 3 s" in flat(result.stdout)
    result = run("inspect", *channels, "--since", 1000.0)
    assert result.exit_code == 2
    assert "--since and --until must keep at least 2 samples" in flat(result.stderr)


def test_results_are_shown_in_the_units_that_are_asked_for(channels, folder, tmp_path, monkeypatch):
    page, table = tmp_path / "page.html", re.compile(r"displacement 1 +in\b")
    result = run("inspect", *channels, "--out-units", "in,lbf", "--report", page)
    assert (result.exit_code, result.stderr) == (0, "")
    assert table.search(result.stdout) and re.search(r"force 1 +lbf\b", result.stdout) and ">lbf<" in page.read_text()
    result = run("inspect", *channels, "--out-units", "given")
    assert re.search(r"displacement 1 +mm\b", result.stdout)
    assert "--out-units must be units of length" in refusal("inspect", *channels, "--out-units", "furlong")
    answer(monkeypatch)
    result = run("diagnose", *channels, "--model", folder / "model.toml", "--out-units", "in,lbf")
    assert "consistent in in,lbf" in result.stdout
    text = refusal("diagnose", *channels, "--model", folder / "model.toml", "--out-units", "in,mm")
    assert "in and mm both stand for m" in text


def test_an_inspection_is_written_as_a_page(channels, tmp_path):
    result = run("inspect", *channels, "--report", tmp_path / "page.html")
    assert (result.exit_code, result.stderr) == (0, "")
    page = (tmp_path / "page.html").read_text()
    assert page.startswith("<!DOCTYPE html>") and "displacement 1" in page
    assert "displacement 1" in flat(result.stdout)


def test_a_rate_stands_for_a_clock(tmp_path):
    np.savez(tmp_path / "run.npz", u=np.sin(np.arange(100.0)), y=np.cos(np.arange(100.0)))
    result = run("inspect", tmp_path / "run.npz", "--force", "u", "--displacement", "y", "--rate", 610.35)
    assert result.exit_code == 0
    assert "610.35 Hz" in result.stdout


@pytest.mark.parametrize(
    ("names", "dofs"),
    [
        (["1=a", "2=b"], {1: "a", 2: "b"}),
        (["3=a", "1=b"], {3: "a", 1: "b"}),
        (["a", "b"], {1: "a", 2: "b"}),
        (["b"], {1: "b"}),
    ],
)
def test_several_degrees_of_freedom_are_numbered_or_in_their_order(names, dofs, folder, tmp_path, monkeypatch):
    time = np.arange(100) / RATE
    waves = {"a": np.sin(9 * time), "b": np.cos(7 * time)}
    np.savez(tmp_path / "run.npz", t=time, a=waves["a"], b=waves["b"])
    seen = answer(monkeypatch)
    options = [part for name in names for part in ("--displacement", name)]
    assert run("diagnose", tmp_path / "run.npz", *options, "--model", folder / "model.toml").exit_code == 0
    assert list(seen["records"][0].channels) == [("displacement", dof) for dof in sorted(dofs)]
    for dof, name in dofs.items():
        np.testing.assert_array_equal(seen["records"][0].channels["displacement", dof], waves[name])


def test_every_kind_of_channel_has_its_option(folder, tmp_path, monkeypatch):
    time = np.arange(100) / RATE
    kinds = ("force", "displacement", "velocity", "acceleration")
    header = ",".join(["clock", "base", *(f"my_{kind}" for kind in kinds)])
    columns = [time, np.sin(time), *(np.sin(i + time) for i in range(len(kinds)))]
    np.savetxt(tmp_path / "run.csv", np.column_stack(columns), "%.17g", ",", header=header, comments="")
    seen = answer(monkeypatch)
    options = [part for kind in kinds for part in (f"--{kind}", f"my_{kind}")]
    more = ["--base-acceleration", "base", "--time", "clock", "--at-rest"]
    assert run("diagnose", tmp_path / "run.csv", *options, *more, "--model", folder / "model.toml").exit_code == 0
    record = seen["records"][0]
    assert record.at_rest
    np.testing.assert_array_equal(record.time, time)
    np.testing.assert_array_equal(record.base_acceleration, np.sin(time))
    for i, kind in enumerate(kinds):
        np.testing.assert_array_equal(record.channels[kind, 1], np.sin(i + time))


@pytest.mark.parametrize(
    ("verdict", "code"), [("consistent", 0), ("parameters", 1), ("cause", 1), ("unnamed", 1), ("undecided", 1)]
)
def test_only_a_consistent_model_ends_with_zero(verdict, code, channels, folder, monkeypatch):
    answer(monkeypatch, verdict)
    result = run("diagnose", *channels, "--model", folder / "model.toml")
    assert (result.exit_code, result.stdout) == (code, f"verdict: {verdict}\n")


@pytest.mark.parametrize(("words", "held"), [((), 0.3), (("--holdout", "none"), None), (("--holdout", "0.2"), 0.2)])
def test_what_is_held_out_is_a_share_or_nothing(words, held, channels, folder, monkeypatch):
    seen = answer(monkeypatch)
    assert run("diagnose", *channels, "--model", folder / "model.toml", *words).exit_code == 0
    assert seen["holdout"] == held


def test_several_files_are_fitted_and_held_out_with_the_same_channels(channels, folder, tmp_path, monkeypatch):
    lines = (folder / "run.csv").read_text().splitlines()
    files = {samples: tmp_path / f"{samples}.csv" for samples in (100, 120, 140)}
    for samples, path in files.items():
        path.write_text("\n".join(lines[: samples + 1]))
    seen = answer(monkeypatch)
    held = ("--holdout", files[120], "--holdout", files[140])
    assert run("diagnose", *channels, files[100], "--model", folder / "model.toml", *held).exit_code == 0
    whole, short = seen["records"]
    assert [len(record) for record in (short, *seen["holdout"])] == [100, 120, 140]
    for record in (short, *seen["holdout"]):
        np.testing.assert_array_equal(record.displacement, whole.displacement[: len(record)])


def test_a_model_is_fitted_to_several_records_at_once(channels, folder, tmp_path):
    rng = np.random.default_rng(12)
    head, *rows = (folder / "run.csv").read_text().splitlines()[:301]
    cells = [row.split(",") for row in rows]
    again = [f"{t},{u},{float(y) + 0.02 * rng.standard_normal()}" for t, u, y in cells]  # the same test once more
    (tmp_path / "short.csv").write_text("\n".join([head, *again]))
    fits = {}
    for name, more in {"one": (), "both": (tmp_path / "short.csv",)}.items():
        assert run("fit", *channels, *more, "--model", folder / "stiff.toml", "--out", tmp_path / name).exit_code == 0
        fits[name] = Structure.load(tmp_path / name).values()["stiffness@0-1.k"]
    true = Structure.load(folder / "model.toml").values()["stiffness@0-1.k"]
    assert fits["both"] != fits["one"]
    assert fits["both"] == pytest.approx(true, rel=0.01)


def test_a_seed_is_passed_on_and_none_is_made_up(channels, folder, monkeypatch):
    import jax

    seen = answer(monkeypatch)
    run("diagnose", *channels, "--model", folder / "model.toml")
    assert seen["key"] is None
    run("diagnose", *channels, "--model", folder / "model.toml", "--key", 7)
    assert seen["key"] == jax.random.key(7)


def test_a_bar_is_shown_on_a_terminal_and_a_line_for_every_stage_on_a_pipe(channels, folder, monkeypatch):
    answer(monkeypatch)
    piped = run("diagnose", *channels, "--model", folder / "model.toml").stderr
    assert piped == "jfsm: 0 s: looking\njfsm: 0 s: deciding\n"
    monkeypatch.setenv("TTY_COMPATIBLE", "1")
    shown = run("diagnose", *channels, "--model", folder / "model.toml")
    assert "3/4" in shown.stderr and "deciding" in shown.stderr
    assert shown.stdout == "verdict: consistent\n"


@pytest.mark.parametrize(("nats", "last"), [(28.0, None), (2.0, "None of them would."), (None, "no two causes")])
def test_what_to_measure_next_is_said_after_the_verdict(nats, last, channels, folder, monkeypatch):
    record, rivals = read(*channels[:1], force="u", displacement="y"), ("coulomb", "lugre")
    tests = [] if nats is None else [
        Proposal("the same force at 2 times the size", nats, nats, 1.87, rivals, record),
        Proposal("the same force at 0.5 times the size", -1.0, -1.0, 0.5, rivals, record),
    ]  # fmt: skip
    d = FakeDiagnosis(verdict="cause", next_tests=lambda key, progress: tests)
    monkeypatch.setattr("jfsm.diagnosis.diagnose", lambda *arguments, **options: d)
    result = run("diagnose", *channels, "--model", folder / "model.toml", "--next")
    assert (result.exit_code, result.stderr) == (1, "")
    verdict, *lines = result.stdout.splitlines()
    assert verdict == "verdict: cause" and (nats is None) == ("coulomb from lugre" not in result.stdout)
    if nats is not None:
        (row,) = [line.split() for line in lines if "2 times" in line]
        assert row[:4] == [f"{nats:.0f}", "x", "1.9", "the"]
    assert last is None or last in lines[-1]


def test_an_interrupted_diagnosis_says_so_and_leaves_no_file(channels, folder, tmp_path, monkeypatch):
    def interrupted(*arguments, **options):
        raise KeyboardInterrupt

    monkeypatch.setattr("jfsm.diagnosis.diagnose", interrupted)
    outputs = ["--report", tmp_path / "page.html", "--json", tmp_path / "d.json"]
    result = run("diagnose", *channels, "--model", folder / "model.toml", *outputs)
    assert result.exit_code == 3
    assert result.stderr == "jfsm: Stopped before the end; no file was left half written.\n"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("mistake", "name"),
    [
        (lambda: "a" + 1, "TypeError"),  # pyright: ignore
        (lambda: np.ones(3) + np.ones(2), "ValueError"),
        (lambda: {}["nobody knows"], "KeyError"),
        (lambda: 1 / 0, "ZeroDivisionError"),
    ],
)
def test_a_mistake_of_jfsm_ends_in_one_line_and_a_code_of_its_own(mistake, name, channels, folder, monkeypatch):
    monkeypatch.setattr("jfsm.diagnosis.diagnose", lambda *arguments, **options: mistake())
    command = ("diagnose", *channels, "--model", folder / "model.toml")
    result = run(*command)
    assert result.exit_code == 4 and result.stderr.count("\n") == 1
    assert result.stderr.startswith(f"jfsm: Internal error, a mistake of jfsm and not of the input: {name}: ")
    assert "Traceback" not in result.stderr
    monkeypatch.setenv("JFSM_TRACEBACK", "1")
    assert "Traceback" in run(*command).stderr


def test_a_diagnosis_that_is_not_finished_is_written_and_has_its_own_code(channels, folder, tmp_path, monkeypatch):
    unfinished = FakeDiagnosis(verdict="cause", finished=False, to_json=lambda path: path.write_text("{}"))

    def quick(*arguments, time_limit, **options):
        assert time_limit == 30.0
        return unfinished

    monkeypatch.setattr("jfsm.diagnosis.diagnose", quick)
    monkeypatch.setattr("jfsm.diagnosis.from_files", lambda d, paths, reading: d)
    outputs = ["--json", tmp_path / "d.json", "--time-limit", 30, "--next"]
    result = run("diagnose", *channels, "--model", folder / "model.toml", *outputs)
    assert (result.exit_code, result.stdout) == (3, "verdict: cause\n")
    assert (tmp_path / "d.json").exists()


@pytest.mark.slow  # it waits for a compiler that may swallow an interrupt
def test_a_process_that_is_interrupted_at_work_ends_with_its_own_code(tmp_path):
    process = subprocess.Popen(
        [sys.executable, "-m", "jfsm.cli", "demo", "--report", str(tmp_path / "page.html")],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=Path(__file__).resolve().parents[1],
    )  # fmt: skip
    assert process.stdout is not None
    assert process.stdout.readline().startswith("A made-up record")
    sleep(1.0)  # by then the first program is being traced
    errors = ""
    for _ in range(20):  # an interrupt that meets a callback of the compiler is lost: a person presses the keys again
        process.send_signal(signal.SIGINT)
        try:
            _, errors = process.communicate(timeout=3)
            break
        except subprocess.TimeoutExpired:
            continue
    process.kill()
    process.wait()
    assert process.returncode == 3
    assert errors.endswith("jfsm: Stopped before the end; no file was left half written.\n")
    assert list(tmp_path.iterdir()) == []


def test_a_missing_record_is_named(folder):
    text = refusal("inspect", folder / "gone.csv", "--displacement", "y")
    assert text == f"jfsm: No such file or directory: {folder / 'gone.csv'}"


def test_an_unknown_channel_is_named_beside_those_that_exist(folder):
    text = refusal("inspect", folder / "run.csv", "--displacement", "Y")
    assert "--displacement must name a channel of run.csv, which holds 't', 'u', 'y'; it was 'Y'" in text


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--displacement", "1=y", "--displacement", "u"], "--displacement must give each degree of freedom once"),
        (["--displacement", "1=y", "--displacement", "1=u"], "as 1=x1 and 2=x2, or none at all; it was 1=y, 1=u."),
        (["--displacement", "y", "--unit", "mm"], "--unit must be a channel and its unit, as y=mm; it was 'mm'."),
        (["--displacement", "y", "--unit", "=mm"], "--unit must be a channel and its unit, as y=mm; it was 'mm'."),
        (["--displacement", "y", "--unit", "y=parsec"], "it was 'parsec'"),
        (
            ["--displacement", "y", "--where", "t"],
            "--where must be a column and its value, as run=3, each column once; it was t.",
        ),
        (["--displacement", "y", "--where", "t=0", "--where", "t=1"], "each column once; it was t=0, t=1."),
        (["--displacement", "y", "--where", "run=3"], "--where must name a channel of run.csv"),
        (["--displacement", "0=y"], "dof"),
    ],
)
def test_channel_options_that_mean_nothing_are_refused(options, words, folder):
    assert words in refusal("inspect", folder / "run.csv", *options)


@pytest.mark.parametrize("name", ["run.npz", "run.mat", "run.csv"])
@pytest.mark.parametrize("content", [b"", b"nonsense", b"PK\x03\x04nonsense"])
def test_a_damaged_record_is_refused_in_words(name, content, tmp_path):
    (tmp_path / name).write_bytes(content)
    assert re.search(
        rf"{name} (must|is) .*(again|Unpack|Export)", refusal("inspect", tmp_path / name, "--displacement", "y")
    )


def test_numbers_that_are_none_are_refused(tmp_path):
    np.savez(tmp_path / "run.npz", t=np.arange(40.0), y=np.array(["a"] * 40))
    assert f"{tmp_path / 'run.npz'}: " in refusal("inspect", tmp_path / "run.npz", "--displacement", "y")


@pytest.mark.parametrize(
    ("toml", "words"),
    [
        ("mass = [1.0", "is not a TOML file"),
        ("stiffness = 3.0", "unknown entry 'stiffness'"),
        ('mass = ["heavy"]', "`mass` must hold real numbers"),
        ('mass = [1.0]\n[[term]]\nkind = "spring"\nat = [0, 1]\nk = 3.0', "`kind` must be one of stiffness"),
    ],
)
def test_a_model_file_that_holds_no_model_is_refused(toml, words, channels, tmp_path):
    model = tmp_path / "model.toml"
    model.write_text(toml)
    text = refusal("diagnose", *channels, "--model", model)
    assert words in text and str(model) in text


def test_a_missing_model_file_is_named(channels, tmp_path):
    text = refusal("diagnose", *channels, "--model", tmp_path / "gone.toml")
    assert f"There is no model file {tmp_path / 'gone.toml'}" in text


def test_a_model_or_the_output_of_a_simulation_is_asked_for(channels, tmp_path):
    text = refusal("diagnose", *channels)
    assert text.startswith("jfsm: --model or --simulated must be given")
    gone = tmp_path / "gone.csv"
    assert f"No such file or directory: {gone}" in refusal("diagnose", *channels, "--simulated", gone)
    here = channels[0]
    assert "is an input of this command" in refusal("diagnose", *channels, "--simulated", here, "--json", here)


@pytest.mark.parametrize("header", ["t,y", "t,u,y"])
def test_the_output_of_a_simulation_may_leave_out_what_drives_it(header, channels, tmp_path, monkeypatch):
    time = np.arange(50) / RATE
    columns = {"t": time, "u": np.cos(time), "y": 1000 * np.sin(time)}
    table = np.column_stack([columns[name] for name in header.split(",")])
    np.savetxt(tmp_path / "output.csv", table, "%.17g", ",", header=header, comments="")
    seen = answer(monkeypatch)
    assert run("diagnose", *channels, "--simulated", tmp_path / "output.csv").exit_code == 0
    assert seen["model"] is None
    np.testing.assert_allclose(seen["simulated"].channels["displacement", 1], np.sin(time), atol=1e-12)  # from mm
    assert (("force", 1) in seen["simulated"].channels) == ("u" in header)


def test_a_holdout_that_is_neither_share_nor_file_is_refused(channels, folder):
    text = refusal("diagnose", *channels, "--model", folder / "model.toml", "--holdout", "some")
    assert "--holdout must be a share such as 0.3, none, or files; it was 'some'." in text
    text = refusal("diagnose", *channels, "--model", folder / "model.toml", "--holdout", "1.5")
    assert "--holdout as a share must lie between 0 and 1" in text


@pytest.mark.parametrize(
    ("command", "option", "name"),
    [
        ("simulate", "--out", "run.csv"),
        ("fit", "--out", "model.toml"),
        ("inspect", "--report", "run.csv"),
        ("diagnose", "--report", "run.csv"),
        ("diagnose", "--json", "model.toml"),
        ("diagnose", "--extended", "model.toml"),
        ("diagnose", "--report", "second.csv"),
    ],
)
def test_no_input_is_written_over(command, option, name, channels, folder):
    second = folder / "second.csv"
    second.write_bytes((folder / "run.csv").read_bytes())
    before = (folder / name).read_bytes()
    more = [] if command == "inspect" else ["--model", folder / "model.toml"]
    more += ["--holdout", second] if command == "diagnose" else []
    through = folder / "." / ".." / folder.name / name  # another way to write the same place
    text = refusal(command, *channels, *more, option, through)
    assert f"{option} must not be a file that is needed: {through} is an input of this command." in text
    assert (folder / name).read_bytes() == before


def test_two_outputs_cannot_share_a_file(channels, folder, tmp_path):
    both = tmp_path / "out"
    text = refusal("diagnose", *channels, "--model", folder / "model.toml", "--report", both, "--json", both)
    assert f"--json must not be a file that is needed: {both} is --report already." in text


def test_an_output_needs_a_folder_before_anything_is_computed(channels, folder, tmp_path):
    for target in (tmp_path / "gone" / "page.html", tmp_path):
        text = refusal("diagnose", *channels, "--model", folder / "model.toml", "--report", target)
        assert f"--report must be a file in a folder that exists; it was {target}." in text


def test_a_simulated_motion_reads_back_as_a_record(channels, folder, tmp_path):
    out = tmp_path / "motion.npz"
    result = run("simulate", *channels, "--at-rest", "--model", folder / "model.toml", "--out", out)
    assert (result.exit_code, result.stderr) == (0, "")
    motion, seen = read(out), read(folder / "run.csv", force="u", displacement="y", units={"y": "mm"})
    assert list(motion.channels) == [(kind, 1) for kind in ("force", "displacement", "velocity", "acceleration")]
    assert motion.at_rest and motion.units["displacement"] == "m"
    assert motion.displacement is not None and seen.displacement is not None
    error = np.std(motion.displacement - seen.displacement) / np.std(seen.displacement)
    assert error < 0.03  # 1 % noise on the displacement and on the force that drives it


def test_a_motion_that_runs_away_is_not_written(folder, channels, tmp_path):
    (tmp_path / "model.toml").write_text(
        'mass = [2.0]\n[[term]]\nkind = "stiffness"\nat = [0, 1]\nk = 1800.0\n'
        '[[term]]\nkind = "damping"\nat = [0, 1]\nc = -300.0\n'
    )
    result = run("simulate", *channels, "--model", tmp_path / "model.toml", "--out", tmp_path / "motion.csv")
    assert result.exit_code == 3
    assert "s the simulated motion left every bound" in result.stderr and "Nothing was written." in result.stderr
    assert not (tmp_path / "motion.csv").exists()


def test_a_fit_is_printed_with_intervals_and_written_as_a_model(channels, folder, tmp_path):
    out = tmp_path / "fitted.toml"
    given = Structure.load(folder / "stiff.toml").values()
    command = ("fit", *channels, "--at-rest", "--model", folder / "stiff.toml", "--out", out, "--fixed", "mass")
    result = run(*command, "--out-units", "in")
    assert (result.exit_code, result.stderr) == (0, "")
    fitted = Structure.load(out).values()
    assert fitted["mass@1"] == given["mass@1"]
    assert fitted["stiffness@0-1.k"] == pytest.approx(STIFFNESS, rel=0.01)
    assert "stiffness@0-1.k" in result.stdout and "mass@1" not in result.stdout
    shown = re.search(r"stiffness@0-1\.k +\S+ +(\S+) .*N/in", result.stdout)
    assert shown and float(shown[1]) == pytest.approx(STIFFNESS * 0.0254, rel=0.01)
    hertz = re.search(r"mode 1, frequency +(\S+) .*Hz", result.stdout)
    assert hertz and float(hertz[1]) == pytest.approx(math.sqrt(STIFFNESS / MASS) / (2 * math.pi), rel=0.005)
    share = re.search(r"mode 1, damping ratio +(\S+) .*%", result.stdout)
    assert share and float(share[1]) == pytest.approx(50 * DAMPING / math.sqrt(STIFFNESS * MASS), rel=0.1)


def test_a_name_that_cannot_be_fixed_is_refused(channels, folder, tmp_path):
    text = refusal(
        "fit", *channels, "--model", folder / "model.toml", "--out", tmp_path / "fitted.toml", "--fixed", "colour"
    )
    assert "--fixed names 'colour', which the structure does not have" in text
    assert not (tmp_path / "fitted.toml").exists()


def test_a_model_that_is_right_and_one_that_is_too_stiff_are_told_apart(channels, folder, tmp_path):
    few = [word for cause in ("cubic_hardening", "coulomb", "force_gain") for word in ("--cause", cause)]
    right = run("diagnose", *channels, "--at-rest", "--model", folder / "model.toml", "--key", 1, *few)
    assert right.exit_code == 0, right.output
    assert all(line.startswith("jfsm: ") for line in right.stderr.splitlines()), right.stderr  # stages, and no warning
    page, numbers, mended = (tmp_path / name for name in ("page.html", "d.json", "mended.toml"))
    page.write_text("of yesterday")
    outputs = ["--report", page, "--json", numbers, "--extended", mended]
    wrong = run("diagnose", *channels, "--at-rest", "--model", folder / "stiff.toml", "--key", 1, *few, *outputs)
    assert wrong.exit_code == 1, wrong.output
    assert json.loads(numbers.read_text(encoding="utf-8"))["verdict"] == "parameters"
    assert page.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    assert Structure.load(mended).values()["stiffness@0-1.k"] == pytest.approx(STIFFNESS, rel=0.02)
    again = run("report", numbers, "--report", tmp_path / "again.html")
    assert (again.exit_code, again.stderr) == (0, "")
    assert f"The page is {tmp_path / 'again.html'}." in again.stdout
    assert (tmp_path / "again.html").read_bytes() == page.read_bytes()


def test_a_mended_model_keeps_its_map_in_a_file_beside_it(channels, folder, tmp_path, monkeypatch):
    states = np.random.default_rng(1).uniform(-1, 1, (40, 2))
    mended = Structure.load(folder / "model.toml") + Polynomial.fit(states, states[:, 0] ** 3).on((0, 1))
    found = FakeDiagnosis(verdict="unnamed", extended=mended)
    monkeypatch.setattr("jfsm.diagnosis.diagnose", lambda *arguments, **options: found)
    result = run("diagnose", *channels, "--model", folder / "model.toml", "--extended", tmp_path / "mended.toml")
    assert (result.exit_code, result.stderr) == (1, "")
    assert {path.name for path in tmp_path.iterdir()} == {"mended.toml", "mended.map.npz"}
    assert Structure.load(tmp_path / "mended.toml").terms[-1].kind == "map"


def test_a_diagnosis_looks_for_the_causes_that_it_is_asked_for(folder, channels, monkeypatch):
    seen = answer(monkeypatch)
    run("diagnose", *channels, "--model", folder / "model.toml")
    assert (seen["causes"], seen["max_causes"]) == (None, 2)
    run("diagnose", *channels, "--model", folder / "model.toml", "--cause", "jenkins", "--cause", "maxwell")
    assert seen["causes"] == ["jenkins", "maxwell"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('{"verdict": "cause", "find', "It may be cut short, or be another file. Write or copy it again."),
        ("", "It may be cut short"),
        ("\xff", "It may be cut short"),
        ("[1, 2]", "it has no verdict"),
        ('{"a": 1}', "it has no verdict"),
        ('{"verdict": "good"}', "its 'verdict' was 'good'"),
        ('{"verdict": "cause", "findings": 3}', "(TypeError: "),
        ('{"verdict": "cause", "findings": ["cubic"]}', "(TypeError: "),
    ],
)
def test_a_file_that_holds_no_diagnosis_gives_no_page(text, words, tmp_path):
    (tmp_path / "d.json").write_bytes(text.encode("latin-1"))
    line = refusal("report", tmp_path / "d.json", "--report", tmp_path / "page.html")
    assert f"{tmp_path / 'd.json'} must be what `jfsm diagnose --json d.json` writes" in line and words in line
    assert [path.name for path in tmp_path.iterdir()] == ["d.json"]


def test_the_numbers_of_a_page_are_not_written_over_and_have_to_be_there(tmp_path):
    (tmp_path / "d.json").write_text("{}")
    line = refusal("report", tmp_path / "d.json", "--report", tmp_path / "d.json")
    assert "--report must not be a file that is needed" in line
    line = refusal("report", tmp_path / "none.json", "--report", tmp_path / "page.html")
    assert line == f"jfsm: No such file or directory: {tmp_path / 'none.json'}"


def test_an_inspection_as_json_gives_its_page(channels, folder, tmp_path):
    inspection = read(folder / "run.csv", force="u", displacement="y", units={"u": "N", "y": "mm"}).inspect()
    (tmp_path / "inspection.json").write_text(json.dumps(inspection.to_dict()))
    assert run("report", tmp_path / "inspection.json", "--report", tmp_path / "page.html").exit_code == 0
    assert "displacement 1" in (tmp_path / "page.html").read_text()


@pytest.mark.slow
def test_a_force_is_mapped_printed_shown_and_written(channels, folder, tmp_path):
    out, page = tmp_path / "map.npz", tmp_path / "page.html"
    result = run("map", *channels, "--mass", MASS, "--order", 1, "--out", out, "--report", page)
    assert (result.exit_code, result.stderr) == (0, "")
    told = flat(result.stdout)
    for words in (
        "RKPM, order 1",
        "Leave-one-out error",
        "stiffness dF/dx",
        "N/m",
        "damping dF/dv",
        "N s/m",
        "Visited",
    ):
        assert words in told
    assert "cubic" not in told  # a map of order 1 has no third derivative
    text = page.read_text(encoding="utf-8")
    assert text.startswith("<!DOCTYPE html>") and text.count("<svg") == 2 and "stiffness dF/dx" in text
    assert load_map(out).gradient([0.0, 0.0])[0] == pytest.approx(STIFFNESS, rel=0.1)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ([], "--model or --mass must be given, and not both"),
        (["--mass", 2.0, "--model", "model.toml"], "--model or --mass must be given, and not both"),
        (["--mass", -2.0], "`mass` must be positive; got -2"),
        (["--mass", 2.0, "--at", "1"], "--at must be two degrees of freedom, as 0-1, where 0 is ground; it was '1'."),
        (["--mass", 2.0, "--at", "1-2"], "--model must be given for the link (1, 2)"),
        (["--mass", 2.0, "--method", "splines"], '--method must be "rkpm", "kriging" or "joint"; got \'splines\'.'),
        (["--mass", 2.0, "--order", 0], "--order must be an integer of 1 or more; got 0."),
        (["--mass", 2.0, "--out", "run.csv"], "--out must not be a file that is needed"),
    ],
)
def test_a_map_that_cannot_be_is_refused(options, words, channels, folder, monkeypatch):
    monkeypatch.chdir(folder)
    before = (folder / "run.csv").read_bytes()
    assert words in refusal("map", *channels, *options)
    assert (folder / "run.csv").read_bytes() == before


def test_causes_are_listed_with_their_parameters():
    from jfsm import causes

    result = run("causes")
    assert result.exit_code == 0
    for name, cause in causes().items():
        (row,) = (line for line in result.stdout.splitlines() if line.split()[:1] == [name])
        assert cause.effect.parameters[0].name in row.replace(",", " ").replace(":", " ").split()


def test_a_demonstration_does_not_write_over_its_data(folder):
    before = (folder / "run.csv").read_bytes()
    text = refusal("demo", "--data", folder / "run.csv", "--report", folder / "run.csv")
    assert "--report must not be a file that is needed" in text
    assert (folder / "run.csv").read_bytes() == before


def test_a_demonstration_names_the_channel_that_its_data_lack(folder, tmp_path):
    text = refusal("demo", "--data", folder / "run.csv", "--displacement", "x", "--report", tmp_path / "page.html")
    assert "--displacement must name a channel of run.csv" in text


def test_a_demonstration_ends_with_zero_and_says_where_its_page_is(tmp_path, monkeypatch):
    seen: dict[str, Any] = {}

    def quick(record, model, holdout, key, progress):
        seen.update(record=record, holdout=holdout)
        return FakeDiagnosis(verdict="cause", report=lambda path: Path(path).write_text("page"))

    monkeypatch.setattr("jfsm.diagnosis.diagnose", quick)
    monkeypatch.chdir(tmp_path)
    result = run("demo")
    assert (result.exit_code, result.stderr) == (0, "")
    assert f"The page is {tmp_path / 'jfsm-demo.html'}." in result.stdout
    assert (tmp_path / "jfsm-demo.html").read_text() == "page"
    before, _, after = result.stdout.partition("verdict: cause")
    assert "Coulomb" not in before and "Coulomb friction of" in after
    assert isinstance(seen["record"], Record) and seen["holdout"] == 0.3


def test_a_reader_who_leaves_early_costs_no_file_and_gets_no_complaint(channels, folder, tmp_path, monkeypatch):
    def leave(units):
        raise BrokenPipeError(errno.EPIPE, "Broken pipe")

    def numbers(path):
        path.write_text("{}")

    found = SimpleNamespace(verdict="consistent", print=leave, to_json=numbers)
    monkeypatch.setattr("jfsm.diagnosis.from_files", lambda d, paths, reading: d)
    monkeypatch.setattr("jfsm.diagnosis.diagnose", lambda *arguments, **options: found)
    result = run("diagnose", *channels, "--model", folder / "model.toml", "--json", tmp_path / "d.json")
    assert (result.exit_code, result.stderr) == (1, "")
    assert (tmp_path / "d.json").exists()


@pytest.mark.parametrize(("words", "code"), [(["--help"], 0), (["diagnose"], 2), (["inspect", "run.csv", "--no"], 2)])
def test_help_and_mistyped_options_wait_for_nothing(words, code):
    program = (
        "import sys; from jfsm.cli import app\n"
        f"try: app({words!r})\n"
        "except SystemExit as end: code = end.code\n"
        "heavy = sorted({'jax', 'numpy', 'scipy', 'matplotlib'} & set(sys.modules))\n"
        f"sys.exit(0 if code == {code} and not heavy else ('loaded', heavy, 'ended with', code))"
    )
    finished = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, cwd=Path(__file__).resolve().parents[1]
    )
    assert finished.returncode == 0, finished.stderr


def test_an_inspection_waits_for_no_jax(channels):
    program = (
        "import sys; from jfsm.cli import app\n"
        f"try: app({['inspect', *map(str, channels)]!r})\n"
        "except SystemExit as end: sys.exit(end.code or 'jax' in sys.modules)"
    )
    finished = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, cwd=Path(__file__).resolve().parents[1]
    )
    assert finished.returncode == 0, finished.stderr


def test_a_process_needs_no_setting_beforehand(channels, folder, tmp_path):
    environment = {name: value for name, value in os.environ.items() if not name.startswith("JAX_")}
    environment["XDG_CACHE_HOME"] = str(tmp_path)
    environment["JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS"] = "0"  # a fast machine compiles these within the default
    out = tmp_path / "motion.csv"
    words = ["simulate", *channels, "--at-rest", "--model", folder / "model.toml", "--out", out]
    finished = subprocess.run(
        [sys.executable, "-m", "jfsm.cli", *map(str, words)],
        capture_output=True, text=True, env=environment, cwd=Path(__file__).resolve().parents[1],
    )  # fmt: skip
    assert (finished.returncode, finished.stderr) == (0, "")
    assert len(read(out)) == SAMPLES
    if sys.platform == "linux":  # elsewhere a user's caches are in another place
        assert list((tmp_path / "jfsm").glob("*cache")), "compiled programs were not kept for the next call"


def test_one_run_is_taken_out_of_a_long_table(tmp_path):
    time = np.arange(200) / 100
    rows = [f"B,{k},{t:.2f},{k * math.sin(9 * t):.6f}" for k in (1, 2) for t in time]
    path = tmp_path / "campaign.csv"
    path.write_text("specimen,run,t,y\n" + "\n".join(rows) + "\n", encoding="utf-8")
    told = flat(run("inspect", path, "--displacement", "y", "--where", "run=2", "--where", "specimen=B").output)
    assert "Rows with run = 2.0 and specimen = B: 200 of 400." in told


def _runs(path):
    rows = "".join(f"{0.1 * i:.1f},{i},{2 * i}\n" for i in range(12))
    path.write_text("time [s],F [kN],x [mV]\n" + rows + rows)
    return path


def test_refusals_of_a_file_speak_of_options(tmp_path):
    path = _runs(tmp_path / "a.log")
    assert "--run must name one of the 2 runs of a.log" in (line := refusal("inspect", path, "--force", "F"))
    assert line.endswith("Pass --run 1 or another.")
    (tmp_path / "b.csv").write_text("F,x\n1,2\n2,3\n3,4\n")
    assert refusal("inspect", tmp_path / "b.csv", "--force", "F").endswith("Pass --time NAME or --rate HZ.")
    (tmp_path / "c.csv").write_text("t,F [EU]\n1,2\n2,3\n3,4\n")
    assert "Say which is meant by --unit 'F=UNIT'" in refusal("inspect", tmp_path / "c.csv", "--force", "F")
    uneven = "".join(f"{i + 0.3 * (i % 2)},{i}\n" for i in range(12))
    (tmp_path / "d.csv").write_text("t [s],F\n" + uneven)
    Structure.sdof(1.0, 9.0, 0.1).save(tmp_path / "m.toml")
    options = ["--force", "F", "--model", tmp_path / "m.toml", "--out", tmp_path / "o.csv"]
    text = refusal("simulate", tmp_path / "d.csv", *options)
    assert re.search(r"Make them so first: --resample [\d.]+, or --resample auto\.", text)
    text = refusal("simulate", tmp_path / "b.csv", *options[2:], "--rate", 10)
    assert "as --force NAME, --displacement NAME" in text


def test_runs_sensitivities_cuts_and_rates_are_options(tmp_path):
    path = _runs(tmp_path / "a.log")
    options = ["--force", "F", "--displacement", "3", "--sensitivity", "3=2 mV/mm", "--run", 2]
    result = run("inspect", path, *options, "--since", 0.2, "--until", 0.9, "--resample", "auto")
    assert (result.exit_code, result.stderr) == (0, "")
    words = flat(result.stdout)
    assert "8 samples, 0.7000 s, 10 Hz" in words and "Run 2 of 2" in words
    assert "--resample must be a rate in Hz or auto; it was 'often'" in refusal(
        "inspect", path, *options, "--resample", "often"
    )
    assert "--sensitivity must be a channel and its sensitivity" in refusal(
        "inspect", path, "--force", "F", "--sensitivity", "x"
    )


def test_a_package_that_is_missing_is_a_refusal(tmp_path, monkeypatch):
    def missing(module):
        raise ModuleNotFoundError(module)

    monkeypatch.setattr("jfsm.records.formats.base.importlib.import_module", missing)
    (tmp_path / "a.tdms").write_bytes(b"TDSm" + bytes(40))
    assert "pip install jfsm[tdms]" in refusal("inspect", tmp_path / "a.tdms", "--force", "F")


def test_a_file_that_says_nothing_of_its_channels_is_listed_with_the_command_to_go_on_with(tmp_path):
    rows = "".join(f"{0.01 * i:.2f},{i},{2 * i},{3 - i},{i % 7}\n" for i in range(40))
    path = tmp_path / "press run.log"
    path.write_text("time [s],Kraft [kN],Weg [mm],LVDT (V),temp [C]\n" + rows)
    result = run("inspect", path)
    assert (result.exit_code, result.stderr) == (0, "")
    assert re.search(r"2 +Kraft +kN +force +40 +100 +0.39 +0 to 39\b", result.stdout)
    assert re.search(r"LVDT +V +displacement +40 +100 +0.39 +-36 to 3\b", result.stdout)
    assert re.search(r"temp +C +- +40 ", result.stdout)
    proposal = " ".join(result.stdout.partition("To go on: ")[2].split())
    assert proposal == f"jfsm diagnose '{path}' --force Kraft --displacement Weg --model MODEL.toml"
    assert "must say when" not in result.stdout
    result = run("inspect", path, "--out-units", "in,lbf")
    assert (result.exit_code, result.stderr) == (0, "")
    assert re.search(r"2 +Kraft +lbf +force +40 +100 +0.39 +0 to 8768\b", result.stdout)
    assert re.search(r"LVDT +V +displacement +40 +100 +0.39 +-36 to 3\b", result.stdout)
    result = run("inspect", path, "--since", "0.1", "--every", "2")
    assert "channels must be named for --since, --every" in flat(result.stderr)
    assert "furlong" in refusal("inspect", path, "--out-units", "furlong")


def test_a_file_that_says_nothing_of_its_channels_has_a_page_with_a_picture_of_each(tmp_path):
    rows = "".join(f"{0.01 * i:.2f},{i},{2 * i},{'' if 5 < i < 9 else i % 7}\n" for i in range(3000))
    path = tmp_path / "<press>.log"
    path.write_text("# Rig 7\ntime [s],Kraft [kN],Weg [mm],$b$ & c\n" + rows)
    result = run("inspect", path, "--report", tmp_path / "page.html")
    assert (result.exit_code, result.stderr) == (0, "")
    source = (tmp_path / "page.html").read_text(encoding="utf-8")
    page, told = html.unescape(source), flat(html.unescape(re.sub(r"<[^>]*>", " ", source)))
    assert "2 Kraft kN force 3000 100 29.99 0 2999" in told and "$b$ & c – – 3000 100 29.99 0 6" in told
    assert f"To go on: jfsm diagnose '{path}' --force Kraft --displacement Weg --model MODEL.toml" in page
    assert page.count('id="channels-axes_') == 3 and "&lt;press&gt;" in source
    assert "Kraft from 0 to 2999 kN" in page and "line 1 '# Rig 7'" in page
    force, _, last = (channel.outline for channel in listing(path).channels)
    assert len(force) <= 1000 and force[0].tolist() == [0.0, 0.0] and force[-1].tolist() == [29.99, 2999.0]
    assert last[:, 1].min() == 0 and last[:, 1].max() == 6


def test_long_names_are_listed_whole(tmp_path):
    name = "Laser at the tip of the cantilever, seen from above, " * 3 + "1"
    (tmp_path / "a.csv").write_text(f'time [s],"{name} [mm]"\n' + "".join(f"{0.1 * i:.1f},{i}\n" for i in range(9)))
    line = next(line for line in run("inspect", tmp_path / "a.csv").stdout.splitlines() if name in line)
    assert line.split()[-5:] == ["10", "0.8", "0", "to", "8"]


def test_a_file_without_a_clock_is_listed_with_what_is_missing(tmp_path):
    (tmp_path / "b.csv").write_text("aux,other\n1,2\n2,3\n3,4\n")
    words = flat(run("inspect", tmp_path / "b.csv").stdout)
    assert "Pass --time NAME or --rate HZ." in words and "Add --force NAME, --displacement NAME" in words


def test_an_inspection_ends_with_the_command_to_go_on_with(channels, folder):
    result = run("inspect", *channels, "--until", 3.0, "--at-rest")
    assert " ".join(result.stdout.split()).endswith(
        f"To go on: jfsm diagnose {folder / 'run.csv'} --force u --displacement y --unit u=N --unit y=mm --until 3.0 "
        f"--at-rest --model MODEL.toml"
    )


def test_the_command_to_go_on_with_makes_an_uneven_clock_uniform(tmp_path):
    time = 0.01 * np.arange(60) + np.where(np.arange(60) % 3, 0.0, 2e-3)
    text = "time [s],F [N],x [mm]\n" + "".join(f"{t:.4f},{np.sin(5 * t):.5f},{np.cos(5 * t):.5f}\n" for t in time)
    (tmp_path / "a.csv").write_text(text)
    told = flat(run("inspect", tmp_path / "a.csv", "--force", "F", "--displacement", "x").stdout)
    assert told.endswith("--force F --displacement x --resample auto --model MODEL.toml")
    told = flat(run("inspect", tmp_path / "a.csv", "--force", "F", "--displacement", "x", "--resample", 100).stdout)
    assert told.endswith("--force F --displacement x --resample 100 --model MODEL.toml")


def test_every_so_manieth_sample_is_kept_without_aliasing(channels):
    result = run("inspect", *channels, "--every", 5)
    assert (result.exit_code, result.stderr) == (0, "")
    assert "100 samples" in flat(result.stdout)
    assert f"Resampled from {RATE:.6g} to {RATE / 5:.6g} Hz" in flat(result.stdout)
    text = refusal("inspect", *channels, "--every", 5, "--resample", "auto")
    assert "--every must be a whole number from 1 on, and given without --resample; it was 5 beside" in text
    assert "it was 0. Give one" in refusal("inspect", *channels, "--every", 0)


def test_what_is_noted_is_said_in_options(tmp_path):
    rows = "".join(f"{0.01 * i:.2f},{i % 5}\n" for i in range(40))
    (tmp_path / "a.csv").write_text("time [s],force_kN\n" + rows)
    words = flat(run("inspect", tmp_path / "a.csv", "--force", "force_kN").stdout)
    assert "by its name; --unit says otherwise" in words


@pytest.mark.parametrize("command", ["inspect", "simulate", "fit", "diagnose", "map"])
def test_every_command_that_reads_takes_the_same_options(command):
    shown = run(command, "--help").stdout
    for option in "time rate unit where sensitivity run sheet since until resample every".split():
        assert f"--{option}" in shown


@pytest.mark.parametrize(
    ("message", "words"),
    [
        ("`since` and `until` must keep", "--since and --until must keep"),
        ('`record` has drive="motion"; here', "RECORD has --drive motion; here"),
        ("State it: units={...}.", "State it: --unit NAME=UNIT."),
        ("`max_causes` must be at least 1", "--max-causes must be at least 1"),
        ("`time_limit` must be positive", "--time-limit must be positive"),
        ("`causes` must name causes", "--cause must name causes"),
        ("made with `at_rest=True`;", "made with --at-rest;"),
        ("the first is used. Pass time='t 2' if", "the first is used. Pass --time 't 2' if"),
        ("to one clock by jfsm.align(records); or", "to one clock by jfsm.align(records) in Python; or"),
        ("`model` must hold no friction", "--model must hold no friction"),
        ("`holdout` as a share must", "--holdout as a share must"),
    ],
)
def test_messages_name_options(message, words):
    assert in_options(message) == words
