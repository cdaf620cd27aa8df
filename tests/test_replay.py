"""`benchmarks/replay.py` judges cards and diagnoses anew, and says of each what it could not do."""

import json
import sys
from pathlib import Path

import pytest
from test_verdict import RIGHT, evidence_of

from benchmarks import replay
from jfsm.diagnosis.evidence.scorecard import REFITTED
from jfsm.diagnosis.verdict.judge import judge


@pytest.fixture
def folder(tmp_path) -> Path:
    """A card with its truth, one along an imposed motion, a diagnosis, and a file of another version."""
    cards = tmp_path / "cards"
    cards.mkdir()
    for name, imposed in (("card", False), ("moved", True)):
        evidence = evidence_of(RIGHT, imposed=imposed)
        decision = judge(evidence)
        if not imposed:  # more than this verdict asked, so that others can be reached
            assert evidence.with_model_error() is None and evidence.held_out(REFITTED) is None
        written = {"decision": decision.plain, "evidence": evidence.plain}
        card = {"name": name, "truth": {"cause": "coulomb", "at": [0, 1]}, "findings": [], **written}
        (cards / f"{name}.json").write_text(json.dumps(card))
        if not imposed:
            (cards / "run.json").write_text(json.dumps({"verdict": "cause", **written}))
    (cards / "old.json").write_text(json.dumps({"name": "old", "decision": {"verdict": "cause"}}))
    return cards


def replayed(monkeypatch, capsys, *arguments: object) -> str:
    monkeypatch.setattr(sys, "argv", ["replay.py", *map(str, arguments)])
    replay.main()
    return capsys.readouterr().out


def refused(monkeypatch, capsys, *arguments: object) -> str:
    with pytest.raises(SystemExit) as stopped:
        replayed(monkeypatch, capsys, *arguments)
    assert stopped.value.code == 2
    return " ".join(capsys.readouterr().err.split())


def test_cards_and_diagnoses_are_judged_and_what_cannot_be_read_is_named(folder, monkeypatch, capsys):
    told = replayed(monkeypatch, capsys, folder)
    assert "old.json: not read" in told and "1 left out" in told
    assert "3 cards, 2 of 2 right as recorded; {'same': 3}" in told
    told = replayed(monkeypatch, capsys, folder / "run.json")
    assert "1 cards, 0 of 0 right as recorded; {'same': 1}" in told and "left out" not in told


@pytest.mark.parametrize(("text", "found"), [("card", 1), ("imposed", 1), ("r", 2)])
def test_cards_are_chosen_by_their_names_or_an_imposed_motion(folder, text, found, monkeypatch, capsys):
    assert f"{found} cards," in replayed(monkeypatch, capsys, folder, "--where", text)


def test_a_change_is_compared_with_the_code_before_it(folder, tmp_path, monkeypatch, capsys):
    kept = tmp_path / "before.json"
    told = replayed(monkeypatch, capsys, folder, "--with", "named=1.1", "class_named=1.1", "--record", kept)
    assert "card: cause coulomb@0-1 -> undecided refitted (lost)" in told
    told = replayed(monkeypatch, capsys, folder, "--with", "named=1.1", "class_named=1.1", "--against", kept)
    assert "'same': 2" in told and "->" not in told
    told = replayed(monkeypatch, capsys, folder, "--against", kept)
    assert "card: undecided refitted -> cause coulomb@0-1 (won)" in told
    (folder / "new.json").write_text((folder / "card.json").read_text())
    assert f"new.json: not in {kept}" in replayed(monkeypatch, capsys, folder, "--against", kept)


def test_named_laws_and_classes_are_counted_by_their_probability(folder, monkeypatch, capsys):
    other = json.loads((folder / "card.json").read_text())
    other["truth"] = {"cause": "cubic_hardening", "at": [0, 1], "parameters": {"k3": 2.0}}
    (folder / "other.json").write_text(json.dumps(other))
    told = replayed(monkeypatch, capsys, folder, "--calibration")
    assert "0.95 to 1.00      3  66.7%        3  66.7%" in told  # the diagnosis has no truth


def test_what_was_not_measured_is_named(folder, monkeypatch, capsys):
    told = replayed(monkeypatch, capsys, folder, "--with", "named=1.1", "class_named=1.1")
    assert "moved: not measured" in told and "'not measured': 1" in told


def test_what_cannot_be_asked_is_refused_in_words(folder, tmp_path, monkeypatch, capsys):
    empty = tmp_path / "empty"
    empty.mkdir()
    assert "holds no cards (*.json)" in refused(monkeypatch, capsys, empty)
    told = refused(monkeypatch, capsys, folder, "--with", "hlf=0.4")
    assert "Did you mean half?" in told and "tempering" in told
    assert "no card is left to judge with 'nowhere' in its name" in refused(
        monkeypatch, capsys, folder, "--where", "nowhere"
    )
