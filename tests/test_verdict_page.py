"""How a verdict is reached, in words: the page that is made from the code, and what `why` shows."""

import importlib.util
import json
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from jfsm.cli import app
from jfsm.diagnosis.thresholds import THRESHOLDS
from jfsm.diagnosis.verdict.checks import CHECKS

DOCS = Path(__file__).resolve().parents[1] / "docs"
PACKAGE = Path(__file__).resolve().parents[1] / "jfsm"
# Where checks are made; those that the record alone tells are in a file of its room.
MADE_IN = (*(PACKAGE / "diagnosis" / "verdict").glob("*.py"), *(PACKAGE / "diagnosis" / "look").glob("*.py"))
ALONE = PACKAGE / "records" / "_look.py"


def test_the_page_is_what_the_code_says():
    spec = importlib.util.spec_from_file_location("verdict_page", DOCS / "verdict.py")
    assert spec is not None and spec.loader is not None
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    assert (DOCS / "verdict.md").read_text(encoding="utf-8") == made.page(), "run `python docs/verdict.py`"


def test_every_check_is_made_somewhere_and_its_limits_are_thresholds():
    code = "\n".join(path.read_text(encoding="utf-8") for path in (*MADE_IN, ALONE) if path.name != "checks.py")
    made = set(re.findall(r'check(?:ed)?\(\s*"(\w+)"', code))
    assert made == set(CHECKS)
    assert {limit for kind in CHECKS.values() for limit in kind.limits} == set(THRESHOLDS.explained())


def row(name: str, of: str, passed: bool, says: str, stage: str = "admissible") -> dict:
    return {
        "stage": stage, "name": name, "of": of, "measured": 0.31, "relation": ">=", "threshold": 0.5,
        "unit": "share of excess power", "passed": passed, "says": says,
    }  # fmt: skip


STOPPED = row("explains_half_of_excess", "coulomb@0-1", False, "explains 31% of what the model leaves")
UNDECIDED = {
    "verdict": "undecided",
    "sentence": "Something is wrong.",
    "decision": {
        "winner": "refitted",
        "checks": [
            row("better_than_given", "model", True, "gains 900 nats over the model as given", "detected"),
            row("better_than_refit", "coulomb@0-1", True, "gains 20 nats over the model refitted"),
            STOPPED,
            row("better_than_refit", "accel_gain@acceleration:1", False, "gains 1 nats over the model refitted"),
        ],
        "factors": {
            "refitted": [{"name": "share among the alternatives", "size": 0.5}, {"name": "shape", "size": 0.5}]
        },
        "reasons": {"coulomb@0-1": "explains less than half", "stribeck@0-1": "not fitted: other laws explain more"},
        "stopped_by": STOPPED,
    },
}


@pytest.fixture
def numbers(tmp_path) -> Path:
    path = tmp_path / "run.json"
    path.write_text(json.dumps(UNDECIDED), encoding="utf-8")
    return path


def test_why_names_the_check_that_stopped_a_verdict_and_the_factors_of_its_probability(numbers):
    shown = CliRunner().invoke(app, ["why", str(numbers)])
    assert shown.exit_code == 0
    text = " ".join(shown.output.split())
    assert "Stopped by the check `explains_half_of_excess` of Coulomb friction" in text
    assert "Probability 25 % = 0.500 (share among the alternatives) × 0.500 (shape)" in text
    assert "gains 900 nats over the model as given" in text and "1 nats" not in text


@pytest.mark.parametrize(
    ("cause", "words"),
    [
        ("coulomb", "explains 31% of what the model leaves"),
        ("accel_gain", "gains 1 nats over the model refitted"),
        ("stribeck", "not fitted: other laws explain more"),
        ("refitted", "the verdict rests on it"),
    ],
)
def test_why_tells_what_became_of_a_cause(numbers, cause: str, words: str):
    shown = CliRunner().invoke(app, ["why", str(numbers), cause])
    assert shown.exit_code == 0 and words in " ".join(shown.output.split())


def test_why_of_a_cause_that_is_not_there_names_those_that_come_close(numbers):
    shown = CliRunner().invoke(app, ["why", str(numbers), "colomb"])
    assert shown.exit_code == 2 and "coulomb" in shown.output


def test_why_of_a_file_without_checks_is_refused(tmp_path):
    path = tmp_path / "old.json"
    path.write_text('{"verdict": "cause"}', encoding="utf-8")
    shown = CliRunner().invoke(app, ["why", str(path)])
    assert shown.exit_code == 2 and "jfsm diagnose --json" in " ".join(shown.output.split())
