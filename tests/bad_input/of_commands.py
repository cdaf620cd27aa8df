"""Command lines that cannot be, each with the one line that must come back."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np

import jfsm

from .rows import FORCE, MOTION, T, csv_text, record, spoilt


class Line(NamedTuple):
    """A command line: its name, its words, what is said on standard error, and the exit code."""

    name: str
    words: str
    says: str
    code: int = 2
    make: Callable[[Path], Any] | None = None
    """What else lies in the folder."""


def prepare(folder: Path) -> None:
    """Two runs, a model, and a model of masses alone."""
    record().write(folder / "run.csv")
    other(folder)
    jfsm.Structure.sdof(mass=1.0, stiffness=9.0, damping=0.1).save(folder / "m.toml")
    (folder / "mass.toml").write_text("mass = [1.0]\n")


def other(folder: Path, **given: Any) -> None:
    record(force=1.1 * FORCE + 0.01, displacement=0.9 * MOTION[::-1].copy(), **given).write(folder / "other.csv")


def _pipe(folder: Path) -> None:
    os.mkfifo(folder / "pipe")
    (folder / "link").symlink_to(folder / "pipe")


def _text(name: str, content: str) -> Callable[[Path], Any]:
    return lambda folder: (folder / name).write_text(content)


def _enormous(folder: Path) -> None:
    with h5py.File(folder / "bomb.h5", "w") as file:
        file["time"], file["displacement"] = T, MOTION
        file.create_dataset("force", (10**11,), "f8", chunks=(10**6,), compression="gzip")


def _outside(folder: Path) -> None:
    (folder / "secret").write_bytes(np.arange(400.0).tobytes())
    with h5py.File(folder / "a.h5", "w") as file:
        file["time"], file["displacement"] = T, MOTION
        file.create_dataset("force", (400,), "f8", external=[("secret", 0, h5py.h5f.UNLIMITED)])


def _columns(header: str, force: np.ndarray) -> Callable[[Path], Any]:
    return _text("a.csv", csv_text(header, (T, force, MOTION)))


DIAGNOSE = "diagnose run.csv --model m.toml"

LINES = [
    Line("no such record", "inspect gone.csv", r"No such file or directory: gone\.csv"),
    Line("an empty record", "inspect a.csv", r"a\.csv is empty\. Write or copy it again", make=_text("a.csv", "")),
    Line("a record of text", "inspect a.csv", r"a\.csv must hold columns of numbers", make=_text("a.csv", "hello\n")),
    Line("JSON nested deeply", "inspect a.json", r"a\.json must be JSON; it is nested too deeply", make=_text("a.json", "[" * 100_000)),
    Line("a dataset of 800 GB", "inspect bomb.h5 --force force", r"bomb\.h5 must take at most 4 GB .*JFSM_LARGEST_GB=881", make=_enormous),
    Line("numbers outside the file", "inspect a.h5 --force force", r"--force must name a channel .*stored outside the file", make=_outside),
    Line("a lost reading", "inspect a.csv --force F --displacement x", r"must be finite; 1 of 400", make=_columns("time,F,x", spoilt(FORCE, 7, float("nan")))),
    Line("two columns of one name", "inspect a.csv --force F", r"--force must name one channel of a\.csv", make=_columns("time,F,F", FORCE)),
    Line("a huge degree of freedom", "inspect run.csv --force force_1 --displacement 1000000000000=displacement_1", r"--displacement given by dof counts degrees of freedom, 10000 at most; one key is 1000000000000"),
    Line("a unit of nothing", "inspect run.csv --unit force_1=furlong", r"must be a unit of force or torque"),
    Line("a rate of text", "inspect run.csv --resample fast", r"--resample must be a rate in Hz or auto; it was 'fast'"),
    Line("a rate beyond memory", "inspect run.csv --resample 1e15", r"--rate must leave at most 1e\+08 samples|--resample must leave"),
    Line("a page onto a pipe", "inspect run.csv --report pipe", r"--report must be a file; .*pipe is a device, a pipe or a socket\. Choose", make=_pipe),
    Line("a page onto a link to a pipe", "inspect run.csv --report link", r"--report must be a file; .*link is a device, a pipe or a socket", make=_pipe),
    Line("numbers onto a pipe", f"{DIAGNOSE} --json pipe", r"--json must be a file; ", make=_pipe),
    Line("motion onto a pipe", "simulate run.csv --model m.toml --out pipe", r"--out must be a file; ", make=_pipe),
    Line("a page into no folder", "inspect run.csv --report no/page.html", r"--report must be a file in a folder that exists; .*Make the folder first"),
    Line("a page where none can be", f"{DIAGNOSE} --report /proc/page.html", r"--report must be a file that can be written; it was /proc/page\.html \(.*\)\. Choose another place"),
    Line("a page of a long name", f"{DIAGNOSE} --report {'a' * 250}.html", r"--report must be a file that can be written; .*\(File name too long\)"),
    Line("motion of no format", "simulate run.csv --model m.toml --out x.pdf", r"must end in one of .*it was 'x\.pdf'\. Choose another ending"),
    Line("no model file", "fit run.csv --model no.toml --out f.toml", r"There is no model file .*no\.toml"),
    Line("a record for the model", "fit run.csv --model run.csv --out f.toml", r"run\.csv is not a TOML file"),
    Line("a model for the record", "diagnose m.toml --model run.csv", r"m\.toml must hold columns of numbers"),
    Line("a model nested deeply", "diagnose run.csv --model deep.toml", r"deep\.toml is not the TOML file of a model: it is nested too deeply", make=_text("deep.toml", "a=" + "[" * 5000)),
    Line("a model of masses alone", "diagnose run.csv --model mass.toml", r"--model must have a term, such as a spring or a dashpot"),
    Line("neither model nor run", "diagnose run.csv", r"--model or --simulated must be given"),
    Line("the record held out", f"{DIAGNOSE} --holdout run.csv", r"--holdout must hold readings that are not fitted; its record 1 holds readings of record 1"),
    Line("a copy of the record held out", f"{DIAGNOSE} --holdout copy.csv", r"--holdout must hold readings that are not fitted", make=lambda folder: record().write(folder / "copy.csv")),
    Line("a run in volts held out", f"{DIAGNOSE} --holdout other.csv", r"--holdout must hold records of one set of units", make=lambda folder: other(folder, units={"force": "V", "displacement": "V"})),
    Line("a record twice", "diagnose run.csv run.csv --model m.toml", r"holds readings of record 1, which would count twice\. Leave one"),
    Line("a record twice in a fit", "fit run.csv run.csv --model m.toml --out f.toml", r"which would count twice"),
    Line("a share of 2", f"{DIAGNOSE} --holdout 2", r"--holdout as a share must lie between 0 and 1"),
    Line("a share of text", f"{DIAGNOSE} --holdout most", r"--holdout must be a share such as 0\.3, none, or files; it was 'most'"),
    Line("an unknown cause", f"{DIAGNOSE} --cause kulomb", r"--cause must name causes .*Did you mean coulomb"),
    Line("no time", f"{DIAGNOSE} --time-limit 0", r"--time-limit must be positive, in seconds"),
    Line("a key below zero", f"{DIAGNOSE} --key -1", r"--key must be a whole number from 0 to 9223372036854775807; it was -1"),
    Line("a key beyond all", f"{DIAGNOSE} --key {10**20}", r"--key must be a whole number from 0"),
    Line("a span of nothing", f"{DIAGNOSE} --since 2 --until 1", r"--since and --until must keep at least 2 samples"),
    Line("a number that stays", "fit run.csv --model m.toml --out f.toml --fixed foo", r"--fixed names 'foo', which the structure does not have"),
    Line("another drive", "inspect run.csv --drive wind", r'--drive must be "force" or "motion"; it was \'wind\''),
    Line("an unknown method", "map run.csv --model m.toml --method foo", r'--method must be "rkpm", "kriging" or "joint"'),
    Line("a file of laws that is none", f"{DIAGNOSE} --laws m.toml", r"A file of laws must end in \.py; it was m\.toml"),
    Line("no files", "batch nope* --model m.toml --out b", r"FILES must be files, or a pattern .*'nope\*' matches none"),
    Line("a file for a folder", "batch run.csv --model m.toml --out m.toml", r"`out` must be a folder; .*m\.toml is a file"),
    Line("a record for a diagnosis", "why run.csv", r"run\.csv must be what `jfsm diagnose --json run\.csv` writes"),
    Line("a diagnosis nested deeply", "why d.json", r"it is nested too deeply", make=_text("d.json", "[" * 100_000)),
    Line("records for diagnoses", "compare run.csv other.csv", r"run\.csv must be what `jfsm diagnose --json"),
    Line("a record to verify with", "verify run.csv run.csv", r"run\.csv must be what `jfsm diagnose --json"),
    Line("a model of no spring", "model --mass 1", r"--stiffness or --frequency must be given"),
    Line("a mass of text", "model --mass a --stiffness 1", r"--mass must be a number, or numbers with commas"),
    Line("no such cause", "causes kulomb", r"There is no cause 'kulomb'\. Did you mean coulomb"),
]  # fmt: skip
