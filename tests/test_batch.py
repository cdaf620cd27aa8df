"""Many records: what lies in the folder of a batch, whatever ends it, and what is done again."""

import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import jax
import numpy as np
import pytest
from filelock import FileLock

import jfsm
from jfsm import Record, Structure, diagnose_many
from jfsm.fleet import Batch, _work, sources_of
from jfsm.records import Reading

MODEL = Structure.sdof(1.0, 9.0, 0.12)


def numbers(verdict: str = "consistent", force: float | None = None) -> dict[str, Any]:
    """What stands for the numbers of a diagnosis; with a friction, if its size is given."""
    size = {"value": force, "low": 0.9 * (force or 0), "high": 1.1 * (force or 0), "unit": "N"}
    found = dict(cause="coulomb", family="damping", at=[0, 1], kind="dry friction", law_open=False, probability=0.99)
    findings = [] if force is None else [{**found, "parameters": {"F": size}, "members": {"coulomb": 0.99}}]
    return {"verdict": verdict, "findings": findings, "finished": True, "sentence": f"It is {verdict}."}


@pytest.fixture
def done(monkeypatch) -> list[str]:
    """Names of the records that were diagnosed, each of which is consistent at once."""
    names: list[str] = []

    def quick(record: Record, task: Any) -> tuple[dict[str, Any], str]:
        names.append(task.source.name)
        return numbers(), '<html><meta name="generator" content="jfsm"></html>'

    monkeypatch.setattr("jfsm.fleet._work.diagnosed", quick)
    return names


def record(value: float = 0.0, name: str | None = None) -> Record:
    return Record(np.arange(50) * 0.1, displacement=np.full(50, value), name=name)


@pytest.fixture
def files(tmp_path) -> list[Path]:
    """Three files of one record each."""
    place = tmp_path / "runs"
    place.mkdir()
    paths = [place / f"run{i}.csv" for i in (1, 2, 3)]
    for i, path in enumerate(paths):
        write(path, i)
    return paths


def write(path: Path, value: float) -> None:
    np.savetxt(path, [[0.1 * i, value + i % 3] for i in range(50)], delimiter=",", header="t,y", comments="")


def batch(files: Any, out: Path, model: Structure = MODEL, executor: Any = None, **options: Any) -> Batch:
    return diagnose_many(files, model, out, executor, displacement="y", **options)


def test_every_record_has_numbers_and_a_page_and_all_have_a_summary(files, tmp_path, done):
    found = batch(files, tmp_path / "out")
    assert [one.name for one in found.results] == done == ["run1", "run2", "run3"]
    written = sorted(path.relative_to(tmp_path / "out").as_posix() for path in (tmp_path / "out").rglob("*.*"))
    results = [f"records/run{i}.{ending}" for i in (1, 2, 3) for ending in ("html", "json")]
    summary = ["batch.json", "summary.csv", "summary.html", "summary.json"]
    assert [name for name in written if not name.startswith(".")] == sorted([*summary, *results])
    assert Batch.load(tmp_path / "out").data == found.data
    assert found["run2"].verdict == "consistent" and "3 records are consistent." == found.sentence


def test_what_stands_is_not_done_again(files, tmp_path, done):
    batch(files[:2], tmp_path / "out")
    before = (tmp_path / "out" / "records" / "run1.json").stat()
    found = batch(files, tmp_path / "out")
    assert done == ["run1", "run2", "run3"] and len(found) == 3
    assert (tmp_path / "out" / "records" / "run1.json").stat() == before


def test_what_was_made_from_something_else_is_made_again(files, tmp_path, done, monkeypatch):
    def again(model: Structure = MODEL, **options: Any) -> list[str]:
        done.clear()
        batch(files, tmp_path / "out", model, **options)
        return done.copy()

    everything = ["run1", "run2", "run3"]
    assert again() == everything and again() == []
    write(files[1], 17.0)
    assert again() == ["run2"]
    assert again(Structure.sdof(1.0, 9.5, 0.12)) == everything
    assert again(max_causes=1) == everything
    assert again(units={"y": "mm"}) == everything
    assert again(key=jax.random.key(3)) == everything and again(key=jax.random.key(3)) == []
    monkeypatch.setattr("jfsm.fleet._many.jfsm_version", lambda: "another")
    assert again(key=jax.random.key(3)) == everything


def test_an_unfinished_write_or_a_missing_page_costs_no_more_than_its_record(files, tmp_path, done):
    out = tmp_path / "out"
    batch(files, out)
    leftover, foreign = out / "records" / ".run1.json.abc123.part", out / ".mine.part"
    leftover.write_text('{"verdict": "con')
    foreign.write_text("mine")
    (out / "records" / "run2.json").unlink()  # ended between the page and the numbers
    (out / "records" / "run3.json").write_text("")  # the machine lost its power
    done.clear()
    batch(files, out)
    assert done == ["run2", "run3"] and not leftover.exists() and foreign.read_text() == "mine"


def test_a_page_that_is_gone_is_made_from_the_numbers(files, tmp_path, done):
    out = tmp_path / "out"
    batch(files, out)
    (out / "records" / "run1.html").unlink()
    done.clear()
    batch(files, out)
    assert not done and "It is consistent" in (out / "records" / "run1.html").read_text()


def test_a_broken_record_is_written_down_and_passed_over(files, tmp_path, done):
    files[1].write_text("t,y\n0,1\n")
    missing = tmp_path / "runs" / "run0.csv"
    found = batch([missing, *files], tmp_path / "out")
    assert done == ["run1", "run3"]
    assert {one.name: one.failure for one in found.failures} == {"run0": "unreadable", "run2": "unreadable"}
    assert "No such file" in found["run0"].message
    noted = json.loads((tmp_path / "out" / "records" / "run2.failed.json").read_text())
    assert noted["failed"]["message"] == found["run2"].message and found["run2"].message
    assert "2 of 4 records have no diagnosis" in found.sentence
    with pytest.raises(ValueError, match=r"run2 has no diagnosis \(unreadable\)"):
        found["run2"].load()


@pytest.mark.parametrize(
    ("error", "kind", "tries"), [("ours", "refused", 1), ("theirs", "internal", 2), ("memory", "internal", 2)]
)
def test_a_refusal_stands_and_an_internal_error_is_tried_again(error, kind, tries, files, tmp_path, monkeypatch):
    seen = []

    def broken(record: Record, task: Any) -> Any:
        seen.append(task.source.name)
        if error == "ours":
            record.between(5.0, 4.0)
        if error == "theirs":
            np.linalg.inv(np.zeros((2, 3)))
        raise MemoryError

    monkeypatch.setattr("jfsm.fleet._work.diagnosed", broken)
    for _ in range(2):
        found = batch(files[:1], tmp_path / "out")
        assert found["run1"].failure == kind and found["run1"].message
    assert len(seen) == tries
    noted = json.loads((tmp_path / "out" / "records" / "run1.failed.json").read_text())
    assert ("Traceback" in noted["failed"]["traceback"]) == (kind == "internal")


def test_a_record_that_is_mended_loses_its_failure_and_one_that_breaks_keeps_its_result(files, tmp_path, done):
    out, good = tmp_path / "out", files[0].read_text()
    files[0].write_text("t,y\n0,1\n")
    batch(files, out)
    files[0].write_text(good)
    assert not batch(files, out).failures
    assert not (out / "records" / "run1.failed.json").exists()
    files[0].unlink()
    assert batch(files, out)["run1"].failure == "unreadable"
    assert (out / "records" / "run1.json").exists()
    files[0].write_text(good)
    done.clear()
    assert not batch(files, out).failures and not done


def test_a_file_that_changes_while_it_is_read_gives_no_result(files, tmp_path, done, monkeypatch):
    read = Reading.read

    def changing(self: Reading, path: Any) -> Record:
        write(Path(path), 5.0)
        return read(self, path)

    monkeypatch.setattr(Reading, "read", changing)
    found = batch(files[:1], tmp_path / "out")
    assert found["run1"].failure == "not done" and "changed while the batch ran" in found["run1"].message
    assert not done


def test_other_files_in_the_folder_stay_as_they_are(files, tmp_path, done):
    out = tmp_path / "out"
    out.mkdir()
    (out / "notes.txt").write_text("mine")
    batch(files, out)
    (out / "records" / "run4.json").write_text('{"mine": 4}')
    write(files[0].with_name("run4.csv"), 4)
    found = batch([*files, files[0].with_name("run4.csv")], out)
    assert found["run4"].failure == "not done" and "run4.json must not be written over" in found["run4"].message
    assert (out / "records" / "run4.json").read_text() == '{"mine": 4}' and (out / "notes.txt").read_text() == "mine"


@pytest.mark.parametrize("name", ["summary.csv", "records/a.txt", "batch.json"])
def test_a_folder_whose_files_have_the_names_of_the_summary_is_refused(name, files, tmp_path, done):
    path = tmp_path / "out" / name
    path.parent.mkdir(parents=True)
    path.write_text("mine")
    with pytest.raises(ValueError, match=r"`out` must be a folder in which .* may be written"):
        batch(files, tmp_path / "out")
    assert path.read_text() == "mine" and not done


def test_a_file_is_no_folder(files, tmp_path, done):
    with pytest.raises(ValueError, match="`out` must be a folder; .* is a file"):
        batch(files, files[0])


def test_one_batch_at_a_time_writes_into_a_folder(files, tmp_path, done):
    batch(files, tmp_path / "out")
    with (
        FileLock(tmp_path / "out" / ".batch.lock"),
        pytest.raises(ValueError, match="`out` must not be in use by another batch"),
    ):
        batch(files, tmp_path / "out")
    batch(files, tmp_path / "out")


def test_an_interrupt_keeps_what_is_done(files, tmp_path, done, monkeypatch):
    quick = _work.diagnosed

    def interrupted(record: Record, task: Any) -> Any:
        if task.source.name == "run2":
            raise KeyboardInterrupt
        return quick(record, task)

    monkeypatch.setattr("jfsm.fleet._work.diagnosed", interrupted)
    with pytest.raises(KeyboardInterrupt):
        batch(files, tmp_path / "out")
    assert done == ["run1"] and not (tmp_path / "out" / "summary.json").exists()
    monkeypatch.setattr("jfsm.fleet._work.diagnosed", quick)
    batch(files, tmp_path / "out")
    assert done == ["run1", "run2", "run3"]


def test_changes_since_the_last_batch_are_said(files, tmp_path, done, monkeypatch):
    out = tmp_path / "out"
    assert batch(files, out).changes == []
    assert batch(files, out).changes == []

    def friction(record: Record, task: Any) -> Any:
        return numbers("cause", 0.5), ""

    monkeypatch.setattr("jfsm.fleet._work.diagnosed", friction)
    write(files[1], 9.0)
    write(files[0].with_name("run4.csv"), 9.0)
    found = batch([*files[1:], files[0].with_name("run4.csv")], out)
    assert found.changes == [
        {"record": "run2", "before": "consistent", "now": "cause: coulomb@0-1"},
        {"record": "run4", "before": None, "now": "cause: coulomb@0-1"},
        {"record": "run1", "before": "consistent", "now": None},
    ]
    assert "run2: consistent → cause: coulomb@0-1" in (out / "summary.html").read_text()


def test_any_executor_does_the_work_and_results_keep_their_order(files, tmp_path, done):
    with ThreadPoolExecutor(3) as threads:
        found = batch(files, tmp_path / "out", executor=threads)
    assert sorted(done) == [one.name for one in found.results] == ["run1", "run2", "run3"]
    assert not found.failures


def test_a_client_of_dask_is_asked_for_its_executor(files, tmp_path, done):
    class Client:
        def get_executor(self, pure: bool) -> ThreadPoolExecutor:
            assert not pure
            return threads

    with ThreadPoolExecutor(1) as threads:
        batch(files, tmp_path / "out", executor=Client())
    assert done == ["run1", "run2", "run3"]


def test_records_in_memory_are_told_apart_by_their_content(tmp_path, done):
    diagnose_many({"a": record(1.0), "b": record(2.0)}, MODEL, tmp_path / "out")
    diagnose_many({"a": record(1.0), "b": record(3.0)}, MODEL, tmp_path / "out")
    assert done == ["a", "b", "b"]


def test_progress_is_told_by_record(files, tmp_path, done):
    told: list[Any] = []
    batch(files[:1], tmp_path / "out")
    batch(files[:2], tmp_path / "out", progress=lambda *step: told.append(step))
    assert told == [("1 of 2 records stand from before", 1, 2), ("run2: consistent", 2, 2)]


@pytest.mark.parametrize(
    ("given", "names"),
    [
        (["a/run.csv", "b/run.csv"], ["a/run.csv", "b/run.csv"]),
        (["a/run.csv", "a/run.mat", "a/x.csv"], ["run.csv", "run.mat", "x"]),
        ([record(name="A"), record(name="A"), record()], ["A", "A (2)", "record 3"]),
        ({"left": "a/run.csv", "right": "b/run.csv"}, ["left", "right"]),
    ],
)
def test_names_tell_records_apart(given, names):
    assert [source.name for source in sources_of(given, Reading())] == names


def test_names_of_files_are_plain_and_differ_on_every_system():
    names = ["../../etc/passwd", "Run", "run", "CON", "a b", "a_b", "x" * 200, "<b>", "…", "y.failed", ".hidden"]
    slugs = [source.slug for source in sources_of({name: record() for name in names}, Reading())]
    assert len({slug.casefold() for slug in slugs}) == len(names)
    assert all(slug == Path(slug).name and len(slug) < 100 and not slug.startswith(".") for slug in slugs)
    assert "con" not in [slug.casefold() for slug in slugs] and not any(slug.endswith(".failed") for slug in slugs)


@pytest.mark.parametrize(
    ("records", "options", "error", "words"),
    [
        ([], {}, ValueError, "`records` must hold at least one record"),
        (3, {}, TypeError, "`records` must be paths or records"),
        (["a.csv", 3], {}, TypeError, "`records` must be paths or records; number 2 is 3"),
        (["a.csv"], {"displacment": "y"}, TypeError, "not 'displacment'. Did you mean displacement?"),
        (["a.csv"], {"executor": 0}, ValueError, "`executor` as a number of processes must be at least 1; got 0"),
        (["a.csv"], {"executor": "x"}, TypeError, "`executor` must be an executor of concurrent.futures"),
        (["a.csv"], {"model": "m.toml"}, TypeError, "`model` must be a structure"),
    ],
)
def test_a_wrong_argument_is_named(records, options, error, words, tmp_path):
    with pytest.raises(error, match=words):
        call: Any = {"model": MODEL, "out": tmp_path / "out", **options}
        diagnose_many(records, **call)
    assert not (tmp_path / "out").exists()


def test_a_model_that_cannot_travel_is_refused_before_any_work(files, tmp_path):
    model = jfsm.Simulation(lambda q, v, force, t, p: force - p["k"] * q, dof=1, parameters={"k": 9.0})
    with pytest.raises(ValueError, match="`model` must be something that can be sent to another process"):
        batch(files, tmp_path / "out", model, executor=2)


def test_kills_at_random_moments_lose_double_and_halve_nothing(tmp_path):
    script = Path(__file__).resolve().parents[1] / "benchmarks" / "trust.py"
    run = subprocess.run(
        [sys.executable, str(script), "--kills", "4", "--records", "8"],
        capture_output=True, text=True, timeout=300, env={**os.environ, "TMPDIR": str(tmp_path)},
    )  # fmt: skip
    assert run.returncode == 0, run.stdout + run.stderr
    assert "4 kills" in run.stdout and "lost 0, made again 0, cut short 0" in run.stdout


@pytest.mark.slow
def test_two_real_records_go_through_two_processes_as_through_one(tmp_path):
    rng, t = np.random.default_rng(5), np.arange(600) * 0.05
    force = sum(np.cos(w * t + p) for w, p in zip(np.linspace(1, 6, 12), rng.uniform(0, 6, 12), strict=True))
    drive = Record(t, force=force, displacement=np.zeros(600), at_rest=True)
    records = {}
    for name, size in (("with", 0.5), ("without", 0.0)):
        rig = MODEL + jfsm.Coulomb(size, at=(0, 1)) if size else MODEL
        x = np.asarray(jfsm.simulate(rig, drive).displacement)[:, 0]
        noisy = x + 0.003 * x.std() * rng.standard_normal(600)
        records[name] = Record(t, force=force, displacement=noisy, at_rest=True)
    options: Any = dict(causes=["coulomb"], key=jax.random.key(0), max_causes=1)
    here = diagnose_many(records, MODEL, tmp_path / "here", **options)
    there = diagnose_many(records, MODEL, tmp_path / "there", 2, **options)
    assert [one.verdict for one in here.results] == ["cause", "consistent"]
    assert here.data["records"] == there.data["records"]
    assert here["with"].load().findings[0].cause == "coulomb"
