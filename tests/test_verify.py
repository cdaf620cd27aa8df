"""The same answer again: what a diagnosis was made of is written, and making it again is compared with it."""

import copy
import json
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import jax
import numpy as np
import pytest
from typer.testing import CliRunner

import jfsm
from jfsm import Record, Structure
from jfsm.cli import app
from jfsm.diagnosis import Diagnosis, from_files, key_of, model_fingerprint, plain_key, plain_settings, verify
from jfsm.diagnosis._provenance import provenance
from jfsm.diagnosis._verify import compare
from jfsm.records import Reading, file_fingerprint, fingerprint
from jfsm.reporting import render_page

MODEL = Structure.sdof(1.0, 9.0, 0.12)
SETTINGS: dict[str, Any] = dict(
    holdout=0.3, causes=["coulomb"], max_causes=1, since=None, until=None, places=[(0, 1)], reconstruction=None,
    time_limit=None,
)  # fmt: skip


def record(**more: Any) -> Record:
    t = np.arange(60) * 0.1
    given: dict[str, Any] = dict(force=np.sin(t), displacement=0.1 * np.cos(t), at_rest=True)
    return Record(t, **{**given, **more})


def told(of: Any = None, model: Any = MODEL, **settings: Any) -> dict[str, Any]:
    """What a diagnosis would write, as far as it is compared."""
    size = {"value": 0.5, "low": 0.4, "high": 0.6, "unit": "N"}
    found = {"cause": "coulomb", "at": [0, 1], "parameters": {"F": size}}
    made = provenance([of or record()], model, jax.random.key(7), plain_settings(**{**SETTINGS, **settings}))
    return {
        "jfsm": "0", "format": 1, "verdict": "cause", "finished": True, "findings": [found],
        "candidates": [{"cause": "coulomb", "at": [0, 1], "evidence": 123.456}],
        "refitted": {"mass@1": {"given": 1.0, **size}}, "modes": [], "gain": None, "detectable": {},
        "decision": {"checks": [1]}, "evidence": {}, "provenance": made,
    }  # fmt: skip


@pytest.fixture
def again(monkeypatch) -> dict[str, Any]:
    """What the repeated diagnosis says, and what it was called with under "call"."""
    found: dict[str, Any] = told()

    def quick(records: Any, model: Any, **settings: Any) -> Any:
        found["call"] = {"records": records, "model": model, **settings}
        return SimpleNamespace(told=found)

    monkeypatch.setattr("jfsm.diagnosis._verify.diagnose", quick)
    return found


@dataclass(frozen=True)
class Shell:
    """As much of a diagnosis as knows where it comes from."""

    told: dict[str, Any]


def written(tmp_path, d: dict[str, Any]) -> Any:
    path = tmp_path / "run.json"
    path.write_text(json.dumps(d))
    return path


@pytest.mark.parametrize(
    "change",
    [
        {"force": np.cos(np.arange(60) * 0.1)}, {"force": None}, {"at_rest": False}, {"drive": "motion"},
        {"velocity": np.zeros(60)}, {"units": {"force": "V"}}, {"base_acceleration": np.zeros(60)},
        {"displacement": {2: 0.1 * np.cos(np.arange(60) * 0.1)}},
    ],
)  # fmt: skip
def test_a_record_that_differs_in_anything_has_another_fingerprint(change):
    assert fingerprint(record(**change)) != fingerprint(record())


def test_a_name_changes_no_fingerprint_and_the_last_bit_does():
    assert fingerprint(record(name="a")) == fingerprint(record(name="b"))
    force = np.sin(np.arange(60) * 0.1)
    force[30] = np.nextafter(force[30], 1.0)
    assert fingerprint(record(force=force)) != fingerprint(record())
    lost = record().with_lost({}, {("force", 1): np.arange(60) == 3})
    assert fingerprint(lost) != fingerprint(record())


def test_models_that_differ_have_other_fingerprints_also_where_they_are_functions():
    def soft(q, v, force, t, p):
        return force - p["k"] * q

    def hard(q, v, force, t, p):
        return force - p["k"] * q**3

    models = [
        MODEL,
        Structure.sdof(1.0, 9.0, 0.13),
        MODEL.uncertain(stiffness=0.1),
        MODEL + jfsm.Coulomb(1.0, at=(0, 1)),
    ]
    models += [jfsm.Simulation(law, dof=1, parameters={"k": k}) for law in (soft, hard) for k in (1.0, 2.0)]
    models += [jfsm.Simulation.from_runs(lambda r: {"displacement": r.force}),
               jfsm.Simulation.from_runs(lambda r: {"displacement": -r.time})]  # fmt: skip
    assert len({model_fingerprint(model) for model in models}) == len(models)
    assert model_fingerprint(models[4]) == model_fingerprint(jfsm.Simulation(soft, dof=1, parameters={"k": 1.0}))


@pytest.mark.parametrize("key", [jax.random.key(5), jax.random.PRNGKey(5), jax.random.key(5, impl="rbg")])
def test_a_key_comes_back_from_json(key):
    back = key_of(json.loads(json.dumps(plain_key(key))))
    assert back.dtype == key.dtype and bool((back == key).all())


def test_a_reading_comes_back_from_json(tmp_path):
    path = tmp_path / "run.csv"
    np.savetxt(path, [[0.1 * i, i, -i] for i in range(60)], delimiter=",", header="t,a,b", comments="")
    reading = Reading({"displacement": {2: "a"}, "force": "b", "units": {"a": "mm"}, "since": 1.0, "every": 2})
    back = Reading.of_plain(json.loads(json.dumps(reading.plain)))
    assert fingerprint(back.read(path)) == fingerprint(reading.read(path))
    assert back.read(path).time[0] == pytest.approx(1.0)
    with pytest.raises(TypeError, match="there is no option 'unit'"):
        Reading({"unit": "mm"})
    assert Reading({"force": "b", "units": {"a": "mm", "b": "N"}}).without("force").plain == {"units": {"a": "mm"}}


def test_the_same_numbers_are_the_same_bit_for_bit(tmp_path, again):
    found = verify(written(tmp_path, told()), record())
    assert found.same and found.exact and str(found).startswith("The same, bit for bit.")
    call = again["call"]
    assert call["places"] == [(0, 1)] and call["holdout"] == 0.3 and call["causes"] == ["coulomb"]
    assert call["model"].to_toml() == MODEL.to_toml() and bool(call["key"] == jax.random.key(7))


def test_a_last_bit_is_no_matter_on_another_machine_and_one_on_this(tmp_path, again):
    again["refitted"] = copy.deepcopy(again["refitted"])
    again["refitted"]["mass@1"]["value"] = np.nextafter(0.5, 1.0)
    here, elsewhere = told(), told()
    elsewhere["provenance"]["computed_with"] = {**elsewhere["provenance"]["computed_with"], "jax": "0.0"}
    assert not verify(written(tmp_path, here), record()).same
    found = verify(written(tmp_path, elsewhere), record())
    assert found.same and not found.exact and "jax 0.0 → " in str(found)


@pytest.mark.parametrize(
    ("part", "change", "same"),
    [
        ("findings", lambda f: f[0]["parameters"]["F"].update(value=0.509), True),
        ("findings", lambda f: f[0]["parameters"]["F"].update(value=0.511), False),
        ("candidates", lambda c: c[0].update(evidence=123.55), True),
        ("candidates", lambda c: c[0].update(evidence=123.6), False),
        ("candidates", lambda c: c.append({"cause": "maxwell", "at": [0, 1], "evidence": 0.0}), False),
        ("findings", lambda f: f[0].update(cause="stribeck"), False),
        ("refitted", lambda r: r.pop("mass@1"), False),
    ],
)
def test_tolerances_are_those_that_are_stated(part, change, same):
    """0.05 of an interval of 0.2 is 0.01, and 0.1 nats."""
    before, now = told(), told()
    before["provenance"]["computed_with"] = {}
    now[part] = copy.deepcopy(now[part])
    change(now[part])
    assert compare(before, now).same is same


def test_another_record_is_told_before_anything_is_repeated(tmp_path, again):
    found = verify(written(tmp_path, told()), record(at_rest=False))
    assert not found.same and "another one: sha256" in str(found) and "call" not in again


def test_another_model_is_told(tmp_path, again):
    found = verify(written(tmp_path, told()), record(), Structure.sdof(1.0, 9.5, 0.12))
    assert not found.same and "model: another one than in the file" in str(found) and "call" not in again


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda d: d.pop("provenance"), "must say what it was made of"),
        (lambda d: d.update(finished=False), "ended before it was finished"),
        (lambda d: d["provenance"]["model"].update(toml=None), "`model` must be given: .* does not hold it"),
        (lambda d: d["provenance"]["settings"].update(causes=["mine"]), "a cause of its own, mine"),
        (lambda d: d["provenance"]["holdout"].append({"sha256": ""}), "was made with 1 held-out records; got 0"),
    ],
)
def test_what_cannot_be_repeated_is_refused_with_what_to_do(change, words, tmp_path, again):
    d = told()
    change(d)
    with pytest.raises(ValueError, match=words):
        verify(written(tmp_path, d), record())


def test_held_out_records_are_compared_and_passed_on(tmp_path, again):
    held = record(at_rest=False)
    d = told(holdout=held)
    d["provenance"]["holdout"] = provenance([held], MODEL, jax.random.key(0), {})["records"]
    assert verify(written(tmp_path, d), record(), holdout=held).same
    assert again["call"]["holdout"] == [held]
    assert not verify(written(tmp_path, d), record(), holdout=record()).same


def test_the_page_says_what_it_was_made_of(tmp_path):
    path = tmp_path / "<run>.csv"
    np.savetxt(path, [[0.1 * i, i] for i in range(60)], delimiter=",", header="t,y", comments="")
    d = told()
    made = from_files(Shell(d), [path], Reading({"displacement": "y"})).told  # pyright: ignore[reportArgumentType]
    page = render_page(
        {**made, "verdict": "consistent", "findings": [], "candidates": [], "refitted": {}, "decision": {}}
    )
    for words in (fingerprint(record()), file_fingerprint(path), "&lt;run&gt;.csv", "displacement=y", "0 7 (threefry"):
        assert words in page


def test_the_command_reads_files_as_they_were_read(tmp_path, again):
    path = tmp_path / "run.csv"
    np.savetxt(path, [[0.1 * i, np.sin(i), np.cos(i)] for i in range(60)], delimiter=",", header="t,u,y", comments="")
    reading = Reading({"force": "u", "displacement": "y", "units": {"y": "mm"}})
    d = told(reading.read(path))
    d["provenance"] |= {"reading": reading.plain, "files": [{"name": "run.csv", "sha256": file_fingerprint(path)}]}
    result = CliRunner().invoke(app, ["verify", str(written(tmp_path, d)), str(path)])
    assert (result.exit_code, result.stderr) == (0, ""), result.output
    assert result.stdout.startswith("The same, bit for bit.")
    again["verdict"] = "undecided"
    result = CliRunner().invoke(app, ["verify", str(tmp_path / "run.json"), str(path)])
    assert result.exit_code == 1 and result.stdout.startswith("Not the same.")
    result = CliRunner().invoke(app, ["verify", str(tmp_path / "run.json"), str(path), "--displacement", "y"])
    assert result.exit_code == 1 and "another one" in result.stdout


@pytest.mark.slow
def test_a_real_diagnosis_comes_out_the_same(tmp_path):
    rng, t = np.random.default_rng(5), np.arange(600) * 0.05
    force = sum(np.cos(w * t + p) for w, p in zip(np.linspace(1, 6, 12), rng.uniform(0, 6, 12), strict=True))
    drive = Record(t, force=force, displacement=np.zeros(600), at_rest=True)
    x = np.asarray(jfsm.simulate(MODEL + jfsm.Coulomb(0.5, at=(0, 1)), drive).displacement)[:, 0]
    noisy = Record(t, force=force, displacement=x + 0.003 * x.std() * rng.standard_normal(600), at_rest=True)
    d = jfsm.diagnose(noisy, MODEL, causes=["coulomb"], max_causes=1)
    d.to_json(tmp_path / "run.json")
    assert verify(tmp_path / "run.json", noisy).exact
    assert Diagnosis.load(tmp_path / "run.json").data["provenance"] == d.data["provenance"]
    assert replace(d).data == d.data
