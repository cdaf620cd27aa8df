"""Random wrong arguments of the public functions, and random command lines: what becomes of them.

python -m bad_input.arguments 1000 1000     so many calls in Python, so many command lines; in the folder `tests`

Counted are: right (refused nothing that is wrong, or the calculation would have begun), clear (one message of jfsm that
names the argument, the option or the file), unclear (a message that does not), trace (anything else) and hang.
"""

# pyright: reportArgumentType=false, reportCallIssue=false
# Wrong types are what is tried.

import collections
import os
import re
import shlex
import signal
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple
from unittest.mock import patch

import jax
import numpy as np
from typer.testing import CliRunner

import jfsm

from .of_commands import prepare
from .rows import FORCE, MOTION, NAN, READINGS, STATES, ReachedError, T, record

LONGEST = 60
"""Seconds after which a call hangs."""
COSTLY = (
    "jfsm.diagnosis._conduct.Study", "jfsm.diagnosis._diagnose.stand_in", "jfsm.identification._fit.starts",
    "jfsm.dynamics._simulate._free_run", "jfsm.dynamics._simulate._imposed_response", "jfsm.estimation._motion._Estimate.of",
    "jfsm.dynamics._simulate.starting_state", "jfsm.surrogates.kriging.kriging.fit_part",
)  # fmt: skip
"""Where calculations begin."""


class Tried(NamedTuple):
    """A call, what became of it, and the words for that."""

    call: str
    outcome: str
    says: str


def _wrong(rng: np.random.Generator) -> Any:
    """A value that is, as a rule, none for any argument."""
    values: list[Any] = [
        None, True, 0, -1, 2, 1.5, NAN, float("inf"), 10**12, 1j, "", "a", "mass", "x" * 5000, b"x", [], [1], [None], (), (1, 2),
        {}, {"a": 1}, {1: 2}, object(), np.array(3.0), np.zeros((2, 2)), np.full(400, NAN), np.array(["a"]), T[::-1],
        Path("none.csv"), int, record(), [record()], jfsm.Structure.sdof(1.0, 9.0, 0.1), jax.random.key(0), np.datetime64("2024"),
        range(3), {"displacement": MOTION}, slice(3), jfsm.LinearStiffness(1.0, at=(0, 1)), np.zeros(0), FORCE.astype(object),
    ]  # fmt: skip
    return values[int(rng.integers(len(values)))]


def _calls(folder: Path) -> dict[str, tuple[Callable[..., Any], dict[str, Any]]]:
    """Functions by name, each with arguments that are in order."""
    sdof = jfsm.Structure.sdof(1.0, 9.0, 0.1)
    samples = {
        "time": T,
        "force": FORCE,
        "displacement": MOTION,
        "units": {"force": "N"},
        "at_rest": False,
        "drive": "force",
        "name": "a",
    }
    names = {
        "time": "time",
        "force": "force_1",
        "displacement": "displacement_1",
        "velocity": None,
        "base_acceleration": None,
        "units": {"force_1": "N"},
        "sensitivity": None,
        "rate": None,
        "where": None,
        "run": None,
        "sheet": None,
        "at_rest": None,
        "drive": None,
        "name": "a",
    }
    pair = {"record": record(), "model": sdof}
    searched = {
        "holdout": 0.3,
        "causes": ["coulomb"],
        "max_causes": 2,
        "key": None,
        "since": None,
        "until": None,
        "places": None,
        "reconstruction": None,
        "simulated": None,
        "time_limit": None,
        "progress": False,
    }
    return {
        "Record": (jfsm.Record, samples),
        "read": (jfsm.read, {"source": folder / "run.csv", **names}),
        "Structure": (jfsm.Structure, {"mass": [1.0], "terms": [jfsm.LinearStiffness(9.0, at=(0, 1))], "sensors": (), "trust": ()}),
        "Structure.sdof": (jfsm.Structure.sdof, {"mass": 1.0, "stiffness": 9.0, "damping": 0.1}),
        "Structure.chain": (jfsm.Structure.chain, {"mass": [1.0, 1.0], "stiffness": [9.0, 9.0], "damping": None}),
        "Structure.from_matrices": (jfsm.Structure.from_matrices, {"mass": np.eye(2), "stiffness": np.eye(2), "damping": np.eye(2)}),
        "LinearStiffness": (jfsm.LinearStiffness, {"k": 9.0, "at": (0, 1)}),
        "simulate": (jfsm.simulate, {**pair, "initial_state": None, "force": None, "window": 50, "reconstruction": "linear", "solver": "grid", "tolerance": 1e-10}),
        "fit": (jfsm.fit, {**pair, "fixed": ("mass",), "bounds": None, "since": None, "until": None, "reconstruction": "linear"}),
        "diagnose": (jfsm.diagnose, {**pair, **searched}),
        "diagnose_many": (jfsm.diagnose_many, {"records": [record()], "model": sdof, "out": folder / "out", "executor": None, **{k: v for k, v in searched.items() if k != "simulated"}}),
        "estimate_motion": (jfsm.estimate_motion, {**pair, "places": None}),
        "map_force": (jfsm.map_force, {**pair, "mass": None, "at": None, "method": "rkpm", "order": None}),
        "RKPM.fit": (jfsm.RKPM.fit, {"states": STATES, "force": READINGS, "order": 2, "neighbours": None, "window": None, "dilation": 1.0, "across": (), "robust": False}),
        "Kriging.fit": (jfsm.Kriging.fit, {"states": STATES, "force": READINGS, "correlation": jfsm.Gaussian(), "trend": "linear", "nugget": 1e-6}),
    }  # fmt: skip


def in_python(count: int, folder: Path, seed: int = 0) -> Iterator[Tried]:
    """So many calls with one or two wrong arguments."""
    calls, rng = _calls(folder), np.random.default_rng(seed)
    for _ in range(count):
        name = str(rng.choice(list(calls)))
        function, arguments = calls[name]
        chosen = [str(each) for each in rng.choice(list(arguments), int(rng.integers(1, 3)), replace=False)]
        wrong = {each: _wrong(rng) for each in chosen}
        said = ", ".join(f"{each}={' '.join(repr(value).split())[:60]}" for each, value in wrong.items())
        yield Tried(f"{name}({said})", *_outcome(lambda f=function, a=arguments, w=wrong: f(**{**a, **w}), chosen))


def _outcome(call: Callable[[], Any], names: list[str]) -> tuple[str, str]:
    try:
        with _within(LONGEST), warnings.catch_warnings():
            warnings.simplefilter("error")
            call()
        return "right", "done"
    except ReachedError:
        return "right", "begins"
    except _HangError:
        return "hang", ""
    except (ValueError, TypeError, OSError, ModuleNotFoundError) as error:
        *_, (frame, _) = traceback.walk_tb(error.__traceback__)
        inside = str(frame.f_globals.get("__name__", "")).startswith("jfsm")
        words = " ".join(str(error).split())
        if not (inside or isinstance(error, OSError)):
            return "trace", "".join(traceback.format_exception(error)[-3:])
        native = re.search(
            r"not supported between|has no attribute|object is not|unpack|could not be safely|unexpected keyword", words
        )
        return (
            "clear"
            if not native and re.search(r"`|\.csv|arameter|wrong way round|directory|name too long", words)
            else "unclear"
        ), words
    except Exception as error:
        return "trace", "".join(traceback.format_exception(error)[-3:])


COMMANDS = {
    "inspect": "{record}", "simulate": "{record} --model {model} --out {out}", "fit": "{record} --model {model} --out {out}",
    "diagnose": "{record} --model {model}", "map": "{record} --model {model}", "batch": "{record} --model {model} --out {out}",
    "why": "{json}", "report": "{json} --report {out}", "compare": "{json} {json}", "verify": "{json} {record}",
    "model": "--mass {value} --stiffness {value}", "terms": "{value}", "causes": "{value}",
    "export": "{model} --out {out}",
}  # fmt: skip
OPTIONS = (
    "--force --displacement --velocity --acceleration --base-acceleration --time --rate --unit --where --sensitivity --run "
    "--sheet --since --until --resample --every --at-rest --drive --report --json --extended --out --out-units --holdout "
    "--cause --laws --joints --max-causes --time-limit --key --fixed --mass --at --method --order --simulated --jobs --with "
    "--damping --frequency --damping-ratio --stick-speed --nothing"
).split()  # fmt: skip
VALUES = (
    "a 0 -1 1.5 nan inf 1e400 1000000000000 force_1 displacement_1 2=force_1 1000000000000=displacement_1 0=force_1 time run.csv "
    "other.csv m.toml mass.toml gone.csv deep.json deep.toml bytes.bin . pipe out.csv out.html no/out.html force_1=kN "
    "displacement_1=furlong force_1=100 = a=b none given in,lbf motion force hold coulomb kulomb 0-1 0-9 rkpm kriging auto ä % * "
    "[red] {0} $HOME mass stiffness@0-1.k 99999999999999999999"
).split()  # fmt: skip


def on_the_command_line(count: int, seed: int = 0) -> Iterator[Tried]:
    """So many command lines, in a folder that lies ready and is the current one."""
    rng = np.random.default_rng(seed)

    def one(values: Any) -> str:
        return str(rng.choice(list(values)))

    for _ in range(count):
        command = one(COMMANDS)
        places = {"record": "run.csv", "model": "m.toml", "out": "out.csv", "json": "d.json", "value": "1"}
        if rng.random() < 0.4:
            places[one(places)] = one(VALUES)
        words = [command, *COMMANDS[command].format(**places).split(" ")]
        for _ in range(int(rng.integers(0, 4))):
            option = one(OPTIONS)
            words += [option] if option == "--at-rest" else [option, one(VALUES)]
        yield Tried(shlex.join(words), *_ended(words))


def _ended(words: list[str]) -> tuple[str, str]:
    from jfsm.cli import app

    try:
        with _within(LONGEST):
            ended = CliRunner().invoke(app, words)
    except ReachedError:
        return "right", "begins"
    except _HangError:
        return "hang", ""
    said = " ".join((ended.stderr or ended.stdout).split())
    if ended.exit_code in (0, 1, 3) and not (ended.exception and not isinstance(ended.exception, SystemExit)):
        return "right", f"exit {ended.exit_code}"
    if ended.exit_code != 2:
        return "trace", said or "".join(traceback.format_exception(ended.exception)[-3:])
    if said.startswith("Usage:"):
        return "clear", said
    native = re.search(r"not supported between|has no attribute|object is not|unpack|could not be safely", said)
    clear = not native and re.search(r"--[a-z]|RECORD|FILES|\.\w{3,4}\b|`|JSON|There is no|directory", said)
    return ("clear" if clear else "unclear"), said


class _HangError(BaseException):
    pass


class _within:
    """So many seconds, on the main thread of a system that has alarms."""

    def __init__(self, seconds: int):
        self._seconds = seconds

    def __enter__(self) -> None:
        signal.signal(signal.SIGALRM, self._over)
        signal.alarm(self._seconds)

    def __exit__(self, *_: object) -> None:
        signal.alarm(0)

    @staticmethod
    def _over(*_: object) -> None:
        raise _HangError


def tried(python: int, commands: int, seed: int = 0) -> Iterator[Tried]:
    """So many calls and command lines, nothing costly among them, in a folder of their own."""

    def reached(*_: Any, **__: Any) -> Any:
        raise ReachedError

    before = os.getcwd()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        patches = [patch(name, reached) for name in COSTLY]
        for each in patches:
            each.start()
        try:
            os.chdir(folder)
            prepare(folder)
            os.mkfifo("pipe")
            Path("deep.json").write_text("[" * 100_000)
            Path("deep.toml").write_text("a=" + "[" * 5000)
            Path("bytes.bin").write_bytes(bytes(range(256)) * 20)
            Path("d.json").write_text("{}")
            yield from in_python(python, folder, seed)
            yield from on_the_command_line(commands, seed)
        finally:
            for each in patches:
                each.stop()
            os.chdir(before)


if __name__ == "__main__":
    jax.config.update("jax_enable_x64", True)
    tally: dict[str, collections.Counter[str]] = collections.defaultdict(collections.Counter)
    for one in tried(int(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else 0):
        kind = "Python" if "(" in one.call.split(" ")[0] else "command line"
        tally[kind][one.outcome] += 1
        if one.outcome in ("unclear", "trace", "hang") or "--show" in sys.argv:
            print(f"{one.outcome}: {one.call[:200]}\n    {one.says[-400:]}", flush=True)
    for kind, counts in tally.items():
        print(f"{kind}: {sum(counts.values())} tried, {dict(counts)}")
