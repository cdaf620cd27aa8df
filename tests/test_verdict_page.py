"""How a verdict is reached, in words: the page that is made from the code, and what `why` shows."""

import importlib.util
import json
import re
from pathlib import Path

import pytest
from test_verdict import RIGHT, card, evidence_of, judged
from typer.testing import CliRunner

from jfsm._format import FORMAT
from jfsm.cli import app
from jfsm.diagnosis.thresholds import THRESHOLDS
from jfsm.diagnosis.verdict.checks import CHECKS
from jfsm.diagnosis.verdict.judge import judge
from jfsm.reporting import why_text
from jfsm.reporting._checks import decisive_checks

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
MAPPED = "refitted with a map"
UNDECIDED = {
    "format": FORMAT,
    "verdict": "undecided",
    "sentence": "Something is wrong.",
    "decision": {
        "winner": "refitted",
        "checks": [
            row("better_than_given", "model", True, "gains 900 nats over the model as given", "detected"),
            row("better_than_refit", "coulomb@0-1", True, "gains 20 nats over the model refitted"),
            row("leaves_only_noise", "coulomb@0-1", False, "its innovations correlate by 0.9", "sufficient"),
            STOPPED,
            row("better_than_refit", "accel_gain@acceleration:1", False, "gains 1 nats over the model refitted"),
        ],
        "factors": {
            "refitted": [{"name": "share among the alternatives", "size": 0.001}],
            "coulomb@0-1": [{"name": "share among the alternatives", "size": 0.5}, {"name": "shape", "size": 0.5}],
            "jenkins@0-1": [{"name": "share among the alternatives", "size": 0.1}],
        },
        "reasons": {
            "coulomb@0-1": "explains less than half",
            MAPPED: "adds -5% of the error",
            "stribeck@0-1": "not fitted: other laws explain more",
        },
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
    told = (
        "Probability of Coulomb friction at link ground–1: 25 % = 0.500 (share among the alternatives) × 0.500 (shape)"
    )
    assert told in text and text.count("Probability") == 1
    assert "gains 900 nats over the model as given" in text and "1 nats" not in text


@pytest.mark.parametrize(
    ("cause", "words"),
    [
        ("coulomb", "explains 31 % of what the model leaves"),
        ("accel_gain", "gains 1 nats over the model refitted"),
        ("stribeck", "not fitted: other laws explain more"),
        ("Coulomb", "explains 31 % of what the model leaves"),
        ("Coulomb friction", "explains 31 % of what the model leaves"),
        ("accel-gain", "accelerometer gain at acceleration channel 1"),
        ("Map", "the model refitted, with a map: adds −5 % of the error"),
        ("refitted", "the model refitted: less probable than Coulomb friction at link ground–1"),
        ("jenkins@0-1", "Jenkins slider at link ground–1: less probable than Coulomb friction"),
        ("model", "the model\n"),
    ],
)
def test_why_tells_what_became_of_a_cause(numbers, cause: str, words: str):
    shown = CliRunner().invoke(app, ["why", str(numbers), cause])
    text = shown.output if words.endswith("\n") else " ".join(shown.output.split())
    assert shown.exit_code == 0 and words in text and "rests on it" not in text


def test_a_check_that_chooses_the_path_is_no_failure_unless_it_stopped_the_verdict(numbers):
    def mark(d: dict) -> str:
        return next(line for line in why_text(d).splitlines() if " leaves_only_noise " in line).split()[0]

    path = UNDECIDED["decision"]["checks"][2]
    stopped = {**UNDECIDED, "decision": {**UNDECIDED["decision"], "stopped_by": path}}
    assert (mark(UNDECIDED), mark(stopped)) == ("·", "✗")


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({}, "Most probable law: Coulomb friction at link ground–1 (25 %). Not named: explains 31 % of what the model "
         "leaves."),
        ({"near": ["jenkins@0-1"]}, "Nearest law: Jenkins slider at link ground–1 (10 %). Not named: is like dry "
         "friction; and a map would explain 98 %. As a class: closes −129 % of the error; 50 % are needed."),
        ({"factors": {"coulomb@0-1": [{"name": "share", "size": 0.6}, {"name": "refused", "size": 0.0}]}},
         "Most probable law: Coulomb friction at link ground–1 (60 % before it was refused). Not named: explains 31 %"),
        ({"factors": {}, "explained": {"stribeck@0-1": 0.3, "coulomb@0-1": 0.2, MAPPED: 0.9}},
         "The law that explains most: Stribeck friction at link ground–1 (30 % of what the refitted model "
         "leaves). Not named: not fitted: other laws explain more."),
        ({"factors": {}, "explained": {"coulomb@0-1": -0.2}}, ""),
    ],
)  # fmt: skip
@pytest.mark.parametrize("verdict", ["undecided", "unnamed", "parameters"])
def test_where_no_cause_is_named_the_nearest_law_is_and_all_that_it_failed_in_order(changes, line, verdict):
    more = [
        row("map_adds_little", "jenkins@0-1", True, "a map would explain 9%", "sufficient"),
        row("no_simpler_law_as_good", "jenkins@0-1", False, "is like dry friction", "named"),
        row("map_adds_little", "jenkins@0-1", False, "a map would explain 98%", "sufficient"),
        row("class_closes_half", "jenkins@0-1", False, "closes -129% of the error; 50% are needed", "confirmed"),
    ]
    checks = [*UNDECIDED["decision"]["checks"], *more]
    decision = {**UNDECIDED["decision"], "checks": checks, **changes}
    text = " ".join(why_text({"verdict": verdict, "decision": decision}).split())
    if not line or verdict == "parameters":
        assert "Most probable" not in text and "Nearest" not in text and "explains most" not in text
    else:
        assert line in text


def test_checks_of_a_judgement_that_was_reached_anew_do_not_decide():
    decision = {**UNDECIDED["decision"], "since": 3, "stopped_by": None, "near": ["coulomb@0-1"]}
    told = {of["says"] for of in decisive_checks({"verdict": "undecided", "decision": decision})}
    assert told == {"gains 900 nats over the model as given", STOPPED["says"]}


def test_a_decision_can_be_read_and_a_written_one_judged_again(tmp_path):
    evidence = evidence_of(RIGHT)
    decision = judge(evidence)
    assert "Probability of Coulomb friction at link ground–1: 99." in decision.why()
    assert "explains half" in decision.why("coulomb") or "at least 50 %" in decision.why("coulomb")
    path = tmp_path / "run.json"
    path.write_text(
        json.dumps({"format": FORMAT, "verdict": "cause", "decision": decision.plain, "evidence": evidence.plain})
    )

    def again(*changed: str) -> tuple[int, str]:
        shown = CliRunner().invoke(app, ["why", str(path), *(part for each in changed for part in ("--with", each))])
        return shown.exit_code, " ".join(shown.output.split())

    code, text = again("half=0.4")
    assert code == 0 and text.startswith("Judged again with half=0.4; the file says cause. Verdict: cause.")
    assert "at least 40 % is needed" in text
    code, text = again("better=1", "half=0.4")
    assert code == 2 and "name=value" in text and "'better=1'" in text and "tempering" in text
    code, text = again("hal=0.4")
    assert code == 2 and "Did you mean half? Names: " in text and "significant, searched," in text
    code, text = again("half=most")
    assert code == 2 and "must be a number" in text
    code, text = again("significant=1e9")  # then the model error would be admitted, and nobody asked for it
    assert code == 2 and "not measured" in text and "thresholds.py" in text


def test_what_has_no_evidence_cannot_be_judged_again(numbers):
    shown = CliRunner().invoke(app, ["why", str(numbers), "--with", "half=0.4"])
    assert shown.exit_code == 2 and "no 'evidence' that can be judged" in " ".join(shown.output.split())


def test_the_judgement_that_stands_begins_where_that_before_it_ends():
    early, late = card(900.0, 0.004, "coulomb"), card(9000.0, 0.004, "coulomb")
    before = judged(early)
    decision = judged(early, with_model_error=evidence_of(late, model_error=0.01), clipped=(("force", 1),))
    assert before.since == 0 and decision.since == len(before.checks) + 1


def test_why_of_a_cause_that_is_not_there_names_those_that_come_close(numbers):
    shown = CliRunner().invoke(app, ["why", str(numbers), "colomb"])
    assert shown.exit_code == 2 and "coulomb" in shown.output


def test_why_of_a_file_without_checks_is_refused(tmp_path):
    path = tmp_path / "old.json"
    path.write_text('{"verdict": "cause"}', encoding="utf-8")
    shown = CliRunner().invoke(app, ["why", str(path)])
    assert shown.exit_code == 2 and "jfsm diagnose --json" in " ".join(shown.output.split())


@pytest.mark.parametrize("written", [{}, {"format": FORMAT + 1}], ids=["none", "newer"])
def test_what_another_version_wrote_is_refused_with_what_to_do(tmp_path, written: dict):
    path = tmp_path / "run.json"
    path.write_text(json.dumps({**UNDECIDED, "format": None, **written, "jfsm": "0.3"}), encoding="utf-8")
    shown = CliRunner().invoke(app, ["why", str(path)])
    words = " ".join(shown.output.split())
    assert shown.exit_code == 2 and "another one wrote it" in words and "diagnose the record again" in words
