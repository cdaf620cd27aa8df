"""What docs/security.md promises: a file from a stranger runs nothing, reaches nothing else, and fills nothing."""

import ast
import os
import pickle
import socket
import zipfile
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import scipy.io

import jfsm
from jfsm.records.formats import expansion
from jfsm.records.formats.expansion import OversizeError, require_room

from .of_commands import prepare
from .rows import FORCE, MOTION, T, csv_text, record

PACKAGE = Path(jfsm.__file__).parent
ALLOWED = {
    ("cli/_laws.py", ".exec_module"),  # laws of the user's own, from files that the command line names
    ("fleet/_work.py", "pickle"),  # a model on its way to a process of the user's own
    ("fleet/_many.py", "pickle"),  # whether it can go there
    ("adapters/fmu.py", "pickle"),  # what a process of its own is to run
    ("adapters/_fmu_run.py", "pickle"),
    ("adapters/fmu.py", ".extract"),  # an FMU, which is a program and is run
}
RUNS_TEXT = {"eval", "exec", "compile", "__import__", ".exec_module", "run_path", ".run_path", ".run_module"}
REACHES = {"socket", "urllib.request", "http", "http.client", "requests", "ftplib", "smtplib", "xmlrpc", "webbrowser"}
UNPACKS = {".extract", ".extractall", ".unpack_archive", "unpack_archive"}
PICKLES = {"pickle", "cPickle", "dill", "cloudpickle", "shelve", "marshal", "joblib"}


@cache
def _source() -> dict[str, list[ast.AST]]:
    """The modules of jfsm by name, as the nodes of their syntax."""
    paths = sorted(PACKAGE.rglob("*.py"))
    return {p.relative_to(PACKAGE).as_posix(): list(ast.walk(ast.parse(p.read_bytes()))) for p in paths}


def _uses(nodes: list[ast.AST]) -> set[str]:
    """Names of everything that a module calls or imports."""
    found: set[str] = set()
    for node in nodes:
        if isinstance(node, ast.Import):
            found.update(name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            found.update({node.module, *(f"{node.module}.{name.name}" for name in node.names)})
        elif isinstance(node, ast.Call):
            found.add(f".{node.func.attr}" if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", ""))
    return found


def test_no_module_pickles_runs_text_reaches_out_or_unpacks_into_folders():
    for name, nodes in _source().items():
        for used in (RUNS_TEXT | REACHES | UNPACKS | PICKLES) & _uses(nodes):
            assert (name, used) in ALLOWED, f"{name} uses {used}"


def test_every_array_of_numpy_is_loaded_without_pickles():
    for name, nodes in _source().items():
        for node in nodes:
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "np.load":
                assert any(k.arg == "allow_pickle" and ast.unparse(k.value) == "False" for k in node.keywords), name


class _Bomb:
    """An object whose unpickling writes a file."""

    def __init__(self, place: Path):
        self.place = place

    def __reduce__(self):
        return os.mkdir, (str(self.place),)


@pytest.mark.parametrize("suffix", [".npy", ".npz", ".pkl", ".mat"])
def test_a_pickle_is_not_opened_whatever_it_is_called(suffix: str, tmp_path: Path):
    path, place = tmp_path / f"a{suffix}", tmp_path / "ran"
    bomb = np.array([_Bomb(place)], dtype=object)
    if suffix == ".npy":
        np.save(path, bomb, allow_pickle=True)
    elif suffix == ".npz":
        np.savez(path, time=T, F=bomb, x=MOTION)
    else:
        path.write_bytes(pickle.dumps(_Bomb(place)))
    with pytest.raises(ValueError, match=path.name):
        jfsm.read(path, force="F", displacement="x")
    with pytest.raises(ValueError, match=path.name):
        jfsm.load_map(path)
    assert not place.exists()


TEXTS = ["__import__('os').mkdir('ran')", "=cmd|'/c calc'!A0", "{{7*7}}", "$(mkdir ran)", "`mkdir ran`", "%s%n"]


@pytest.mark.parametrize("text", TEXTS)
def test_text_of_a_file_is_never_run(text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "a.csv"
    path.write_text(csv_text(f'time,"{text}",x'))
    read = jfsm.read(path, force=text, displacement="x", units={text: "N"})
    jfsm.Record(T, FORCE, MOTION, name=text).write(tmp_path / "b.csv")
    (tmp_path / "m.toml").write_text(f"mass = [1.0]\n[[term]]\nkind = '''{text}'''\nat = [0, 1]\n")
    with pytest.raises(ValueError, match="`kind` must be one of"):
        jfsm.Structure.load(tmp_path / "m.toml")
    assert len(read) == T.size and sorted(os.listdir(tmp_path)) == ["a.csv", "b.csv", "m.toml"]


def test_names_are_escaped_in_pages(tmp_path: Path):
    name = "<script>alert(1)</script>"
    record(name=name).inspect().report(tmp_path / "a.html")
    page = (tmp_path / "a.html").read_text(encoding="utf-8")
    assert name not in page and "&lt;script&gt;" in page
    assert "http://" not in page.replace("http://www.w3.org", "") and "<link" not in page and "src=" not in page


def test_no_connection_is_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("a connection")

    monkeypatch.setattr(socket.socket, "connect", refuse)
    monkeypatch.setattr(socket, "create_connection", refuse)
    prepare(tmp_path)
    jfsm.read(tmp_path / "run.csv").inspect()
    for source in ("http://example.org/run.csv", "ftp://example.org/run.csv", "s3://a/b.parquet"):
        with pytest.raises(FileNotFoundError):
            jfsm.read(source)


def test_an_archive_writes_nothing(tmp_path: Path):
    path = tmp_path / "inside" / "a.npz"
    path.parent.mkdir()
    np.savez(path, **{"time": T, "../../out": FORCE, "/tmp/x": MOTION})
    read = jfsm.read(path, force="../../out", displacement="/tmp/x")
    assert np.array_equal(read.channels["force", 1], FORCE)
    assert sorted(p.relative_to(tmp_path).as_posix() for p in tmp_path.rglob("*")) == ["inside", "inside/a.npz"]


def test_a_map_of_a_model_lies_beside_it(tmp_path: Path):
    """A model may name a file; what it names is read as a map, and as nothing else."""
    (tmp_path / "secret.txt").write_text("secret")
    (tmp_path / "m.toml").write_text('mass = [1.0]\n[[term]]\nkind = "map"\nat = [0, 1]\nfile = "secret.txt"\n')
    with pytest.raises(ValueError, match="must be a map that") as caught:
        jfsm.Structure.load(tmp_path / "m.toml")
    assert "secret\n" not in str(caught.value)


def test_what_is_compressed_is_measured_before_it_is_unpacked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Against a limit of 10 MB, that the cases stay small."""
    monkeypatch.setenv(expansion.LIMIT, "0.01")
    zeros = np.zeros(2_000_000)
    np.savez_compressed(tmp_path / "a.npz", time=zeros, force=zeros)
    scipy.io.savemat(tmp_path / "a.mat", {"time": zeros, "force": zeros}, do_compression=True)
    import h5py
    import pyarrow
    import pyarrow.parquet

    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name in ("time", "force"):
            file.create_dataset(name, data=zeros, compression="gzip")
    pyarrow.parquet.write_table(pyarrow.table({"time": zeros, "force": zeros}), tmp_path / "a.parquet")
    for path in sorted(tmp_path.iterdir()):
        assert path.stat().st_size < 100_000
        with pytest.raises(
            OversizeError, match=rf"{path.name} must take at most 0\.01 GB of memory .*JFSM_LARGEST_GB=1 "
        ):
            jfsm.read(path, force="force")


def test_a_workbook_is_measured_by_its_sheets(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    import openpyxl

    book = openpyxl.Workbook()
    assert book.active is not None
    book.active.append(["time", "F"])
    book.save(tmp_path / "a.xlsx")
    with zipfile.ZipFile(tmp_path / "a.xlsx") as source, zipfile.ZipFile(tmp_path / "b.xlsx", "w", 8) as bomb:
        for name in source.namelist():
            content = source.read(name)
            if name.endswith("sheet1.xml"):
                content = content.replace(b"</sheetData>", b"<row><c><v>0</v></c></row>" * 500_000 + b"</sheetData>")
            bomb.writestr(name, content)
    monkeypatch.setenv(expansion.LIMIT, "0.01")
    with pytest.raises(OversizeError, match=r"b\.xlsx must take at most 0\.01 GB"):
        jfsm.read(tmp_path / "b.xlsx", force="F")


def test_the_limit_can_be_raised(monkeypatch: pytest.MonkeyPatch):
    path = Path("a.npz")
    with pytest.raises(OversizeError, match=r"a\.npz must take at most 4 GB .*set JFSM_LARGEST_GB=6 "):
        require_room(5e9, path)
    monkeypatch.setenv(expansion.LIMIT, "6")
    require_room(5e9, path)
    for wrong in ("much", "-1", "nan", "0"):
        monkeypatch.setenv(expansion.LIMIT, wrong)
        with pytest.raises(
            OversizeError, match=f"JFSM_LARGEST_GB must be a positive number of GB, as 16; it was '{wrong}'"
        ):
            require_room(1.0, path)


def test_what_is_written_has_the_rights_of_a_new_file(tmp_path: Path):
    jfsm.Structure.sdof(1.0, 9.0, 0.1).save(tmp_path / "a.toml")
    (tmp_path / "b").write_text("")
    assert (tmp_path / "a.toml").stat().st_mode & 0o777 == (tmp_path / "b").stat().st_mode & 0o777
    assert sorted(os.listdir(tmp_path)) == ["a.toml", "b"]
