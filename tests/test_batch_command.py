"""The commands `jfsm batch` and `jfsm verify`: what they take, what they print, and the code they end with."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from jfsm import Record, Structure
from jfsm.cli import app

PAGE = '<html><meta name="generator" content="jfsm"></html>'


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture
def folder(tmp_path) -> Path:
    """Twelve records as run1.csv to run12.csv, and a model."""
    for i in range(1, 13):
        rows = [[0.1 * k, 0.0, i] for k in range(50)]
        np.savetxt(tmp_path / f"run{i}.csv", rows, delimiter=",", header="t,u,y", comments="")
    Structure.sdof(1.0, 9.0, 0.12).save(tmp_path / "m.toml")
    return tmp_path


@pytest.fixture
def seen(monkeypatch) -> dict[str, Any]:
    """What was diagnosed, by name; "verdicts" says with what outcome, consistent where it says nothing."""
    found: dict[str, Any] = {"verdicts": {}, "names": []}

    def quick(record: Record, task: Any) -> Any:
        name = task.source.name
        found["names"].append(name)
        found.update(record=record, settings=task.settings)
        outcome = found["verdicts"].get(name, "consistent")
        if isinstance(outcome, BaseException):
            raise outcome
        finished = not outcome.endswith("…")
        return {"verdict": outcome.rstrip("…"), "findings": [], "finished": finished, "sentence": ""}, PAGE

    monkeypatch.setattr("jfsm.fleet._work.diagnosed", quick)
    return found


def batch(folder: Path, *more: object, pattern: str = "run*.csv") -> Result:
    options = ["--force", "u", "--displacement", "y", "--model", folder / "m.toml", "--out", folder / "out"]
    return run("batch", folder / pattern, *options, *more)


def test_a_pattern_is_taken_in_the_order_of_its_numbers_and_told_on_standard_error(folder, seen):
    result = batch(folder)
    assert result.exit_code == 0, result.output
    assert seen["names"] == [f"run{i}" for i in range(1, 13)]
    assert "12 records are consistent." in result.stdout and "summary.html" in result.stdout
    assert "run7" in result.stderr and "run7" not in result.stdout.partition("Records with")[0]
    assert batch(folder).exit_code == 0 and len(seen["names"]) == 12


@pytest.mark.parametrize(
    ("outcomes", "code"),
    [
        ({"run1": "undecided"}, 1),
        ({"run1": "undecided", "run2": "consistent…"}, 3),
        ({"run1": "undecided…", "run2": None}, 2),
        ({"run1": RuntimeError("a mistake"), "run2": None}, 4),
    ],
)
def test_the_worst_record_gives_the_code(outcomes, code, folder, seen):
    for name in [name for name, outcome in outcomes.items() if outcome is None]:
        (folder / f"{name}.csv").write_text("nothing\n")
    seen["verdicts"] = outcomes
    result = batch(folder)
    assert result.exit_code == code, result.output
    assert (folder / "out" / "summary.json").exists()


def test_an_interrupt_ends_with_its_code_and_the_same_command_goes_on(folder, seen):
    seen["verdicts"]["run3"] = KeyboardInterrupt()
    assert batch(folder).exit_code == 3
    seen["verdicts"].clear()
    assert batch(folder).exit_code == 0
    assert seen["names"] == ["run1", "run2", "run3", *(f"run{i}" for i in range(3, 13))]


def test_options_of_reading_and_of_the_diagnosis_are_passed_on(folder, seen):
    more = ["--unit", "y=mm", "--since", 1, "--every", 2, "--cause", "coulomb", "--max-causes", 1, "--key", 3,
            "--holdout", "none", "--time-limit", 9]  # fmt: skip
    assert batch(folder, *more, pattern="run1.csv").exit_code == 0
    record, settings = seen["record"], seen["settings"]
    assert record.time[0] == pytest.approx(1.0) and record.dt == pytest.approx(0.2)
    assert np.abs(record.displacement).max() < 0.01
    assert (settings["causes"], settings["max_causes"], settings["holdout"]) == (["coulomb"], 1, None)
    assert settings["key"]["data"] == [0, 3] and settings["time_limit"] == 9


@pytest.mark.parametrize(
    ("more", "pattern", "words"),
    [
        ([], "no*.csv", "matches none"),
        (["--cause", "x"], "none.csv", "matches none"),
        (["--every", 0], "run1.csv", "--every must be a whole number from 1 on"),
    ],
)
def test_bad_input_is_refused_before_any_work(more, pattern, words, folder, seen):
    result = batch(folder, *more, pattern=pattern)
    assert result.exit_code == 2 and words in result.stderr and result.stdout == ""
    assert not (folder / "out").exists() and not seen["names"]


def test_results_beside_the_records_are_no_records(folder, seen):
    options = ["--displacement", "y", "--model", folder / "m.toml", "--out", folder]
    for _ in range(2):
        assert run("batch", folder / "*.csv", *options).exit_code == 0
    assert len(seen["names"]) == 12


@pytest.mark.slow
def test_jobs_are_processes_and_what_they_write_verifies(folder):
    rng, t = np.random.default_rng(3), np.arange(500) * 0.05
    for name in ("a", "b"):
        u, x, v, y = rng.standard_normal(500), 0.0, 0.0, []
        for force in u:
            v += 0.05 * (force - 0.3 * v - 9.0 * x)
            x += 0.05 * v
            y.append(x)
        np.savetxt(folder / f"{name}.csv", np.column_stack([t, u, y]), delimiter=",", header="t,u,y", comments="")
    result = batch(folder, "--jobs", 2, "--cause", "coulomb", "--max-causes", 1, pattern="[ab].csv")
    assert result.exit_code in (0, 1), result.output
    result = run("verify", folder / "out" / "records" / "a.json", folder / "a.csv")
    assert result.exit_code == 0 and result.stdout.startswith("The same, bit for bit."), result.output
