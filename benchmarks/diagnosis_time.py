"""What a diagnosis costs, and of what: processor time, compilation, memory.

    python benchmarks/diagnosis_time.py [--rows typical demo] [--lengths] [--json FILE] [--cases FILE] [--data DIR]

Every row is run three times: *cold* in a fresh process with no program on disk; then *second*, another record of the
same kind in that process, as a folder of files is worked through; and *disk*, the first record again in a fresh process
that finds the programs of the former on disk. A model that its owner would fit first (the rigs, the circuit) is fitted
within the time that counts. The made-up records are SciPy's. `lengths` diagnoses sixty records of as many lengths in
one process, for few causes, and tells how its memory grows from the tenth to the last.

Compilation and tracing are JAX's own durations, on the wall and summed over threads: on a busy machine they exceed the
processor time. Programs that come from disk count as programs; of those over 0.2 s there is hardly any.
"""

import argparse
import gc
import importlib.util
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np
from scipy.integrate import solve_ivp

jax.config.update("jax_enable_x64", True)

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

import jfsm  # noqa: E402  (after double precision is on, from this checkout)
from benchmarks import rig_verdicts, silverbox  # noqa: E402
from jfsm.demo import hidden_friction  # noqa: E402

LARGE = 0.2
"""Seconds from which a compilation counts as a large one."""
STEP, SAMPLES, FEWER = 0.05, 3000, 20
FEW = ("cubic_hardening", "coulomb", "quadratic_damping")
LENGTHS = range(400, 1000, 10)
SETTLED = 10
"""Records after which a process holds what every diagnosis needs."""

Law = Callable[[np.ndarray, np.ndarray], np.ndarray]
Work = Callable[[], str]


class Where(NamedTuple):
    """Folder of measured records, and the file that makes records of trouble."""

    data: Path
    cases: Path


# Records


def chain(masses: int, law: Law, noise_seed: int, samples: int = SAMPLES) -> jfsm.Record:
    """Equal masses in a row from the ground, twelve tones on the first, `law` of the last link beside its spring.

    One per cent noise on force, displacement and acceleration. The drive is always the same one.
    """
    drawn = np.random.default_rng(7)
    omegas, phases = drawn.uniform(0.5, 7.0, 12), drawn.uniform(0, 2 * np.pi, 12)

    def force(t):
        return 2 * np.cos(np.multiply.outer(t, omegas) + phases).sum(-1)

    def acceleration(t, x, v):
        d, w = np.diff(x, prepend=0), np.diff(v, prepend=0)
        links = 9.0 * d + 0.3 * w
        links[-1] += law(d[-1], w[-1])
        net = np.append(links[1:], 0.0) - links
        net[0] += force(t)
        return net

    def rate(t, y):
        return np.concatenate([y[masses:], acceleration(t, y[:masses], y[masses:])])

    t = np.arange(samples) * STEP
    y = solve_ivp(rate, (0, t[-1]), np.zeros(2 * masses), t_eval=t, rtol=1e-9, atol=1e-11, max_step=0.02).y.T
    a = np.array([acceleration(*at) for at in zip(t, y[:, :masses], y[:, masses:], strict=True)])
    rng = np.random.default_rng(noise_seed)
    g, x, a = (q + 0.01 * q.std(0) * rng.standard_normal(q.shape) for q in (force(t), y[:, :masses], a))
    return jfsm.Record(t, force={1: g}, displacement=x, acceleration=a, at_rest=True)


def believed(masses: int) -> jfsm.Structure:
    """The linear chain, its values slightly off."""
    return jfsm.Structure.chain([1.0] * masses, [1.01 * 9.0] * masses, [0.9 * 0.3] * masses)


def friction(d, w):
    return 1.5 * np.tanh(w / 0.1)


def hardening(d, w):
    return 1.0 * d**3


def both(d, w):
    return friction(d, w) + hardening(d, w)


# Work


def said(d: jfsm.Diagnosis) -> str:
    """The verdict in a line."""
    causes = [f"{f.cause} {'-'.join(map(str, f.at))} {f.probability:.3f}" for f in d.findings]
    return ": ".join([d.verdict, *([", ".join(causes)] if causes else [])])


def diagnosed(record: Any, model: Any, holdout: Any = 0.3) -> str:
    return said(jfsm.diagnose(record, model, holdout=holdout, key=jax.random.key(0), progress=False))


def shorter(record: Any) -> Any:
    """A record, or several, as another file would be."""
    return record[:-FEWER] if isinstance(record, jfsm.Record) else [one[:-FEWER] for one in record]


def made_up(masses: int, law: Law, seed: int = 1) -> Callable[[Where], list[Work]]:
    def row(where: Where) -> list[Work]:
        first, second = chain(masses, law, seed), chain(masses, law, seed + 10, SAMPLES - FEWER)
        return [partial(diagnosed, record, believed(masses)) for record in (first, second)]

    return row


def case(name: str) -> Callable[[Where], list[Work]]:
    def row(where: Where) -> list[Work]:
        made = getattr(loaded(where.cases), name)()
        return [partial(diagnosed, r, made.model, made.holdout) for r in (made.record, shorter(made.record))]

    return row


def loaded(path: Path) -> Any:
    """The module of a file."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def rig(name: str) -> Callable[[Where], list[Work]]:
    def row(where: Where) -> list[Work]:
        given = rig_verdicts.RIGS[name](where.data)

        def work(record) -> str:
            model = jfsm.fit(given.believed, given.fitted_to or record).structure
            return diagnosed(record, model, given.held)

        return [partial(work, record) for record in (given.record, shorter(given.record))]

    return row


def circuit(where: Where) -> list[Work]:
    low, record = silverbox.low_level(where.data), silverbox.multisine(where.data)

    def work(training: jfsm.Record) -> str:
        linear = jfsm.fit(silverbox.first_guess(low), low).structure
        return diagnosed(training, linear, record[-silverbox.TEST :])

    training = record[: silverbox.TRAINING]
    return [partial(work, record) for record in (training, shorter(training))]


def demo(where: Where) -> list[Work]:
    shown = [hidden_friction(seed) for seed in (0, 1)]
    return [partial(diagnosed, one.record, one.model, one.holdout) for one in shown]


def paper(where: Where) -> list[Work]:
    """The second time is the same study again."""

    def work() -> str:
        done = jfsm.paper.study()
        errors = [row.error for outcome in done.sections.values() for row in outcome.rows if row.error is not None]
        return f"{len(errors)} numbers with a truth"

    return [work, work]


ROWS: dict[str, Callable[[Where], list[Work]]] = {
    "typical": made_up(1, friction),
    "next_seed": made_up(1, friction, seed=2),
    "pair": made_up(1, both),
    "two_dof": made_up(2, hardening),
    "held_force": case("held_force"),
    "five_masses": case("five_masses"),
    "five_storeys": case("five_storeys"),
    "silverbox": circuit,
    "roll_decay": rig("roll_decay"),
    "pendulum": rig("pendulum"),
    "bouc_wen": rig("bouc_wen"),
    "silverbox_levels": rig("silverbox_levels"),
    "demo": demo,
    "paper": paper,
}
NEEDS = {
    **dict.fromkeys(("held_force", "five_masses", "five_storeys"), "cases"),
    **dict.fromkeys(("silverbox", "roll_decay", "pendulum", "bouc_wen", "silverbox_levels"), "data"),
}


# Measuring, in a process of its own


class Clock:
    """Durations that JAX tells of, since the last start."""

    def __init__(self):
        jax.monitoring.register_event_duration_secs_listener(self._told)
        self.start()

    def start(self) -> None:
        self.compiled: list[float] = []
        self.traced = 0.0
        self._begun = time.process_time(), time.perf_counter()

    def _told(self, event: str, duration_secs: float, **_: Any) -> None:
        if event == "/jax/core/compile/backend_compile_duration":
            self.compiled.append(duration_secs)
        elif event in ("/jax/core/compile/jaxpr_trace_duration", "/jax/core/compile/jaxpr_to_mlir_module_duration"):
            self.traced += duration_secs

    def read(self) -> dict[str, float]:
        cpu, wall = self._begun
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return {
            "cpu": time.process_time() - cpu,
            "wall": time.perf_counter() - wall,
            "compile": sum(self.compiled),
            "trace": self.traced,
            "programs": len(self.compiled),
            "large": sum(seconds > LARGE for seconds in self.compiled),
            "peak_gb": peak * (1 if sys.platform == "darwin" else 1024) / 1e9,
        }


def measure(row: str, where: Where, times: int) -> Iterator[dict[str, Any]]:
    """Each of the first `times` pieces of work of a row, one after the other."""
    clock, works = Clock(), ROWS[row](where)
    for work in works[:times]:
        clock.start()
        verdict = work()
        yield clock.read() | {"said": verdict}


def resident() -> int:
    """Bytes of this process in memory (Linux)."""
    gc.collect()
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def growth() -> dict[str, float]:
    """Memory after the tenth and after the last of sixty records of as many lengths."""
    held = []
    for length in LENGTHS:
        record = chain(1, friction, length, length)
        jfsm.diagnose(record, believed(1), causes=FEW, max_causes=1, key=jax.random.key(0), progress=False)
        held.append(resident() / 1e9)
    return {"settled_gb": held[SETTLED - 1], "last_gb": held[-1], "growth": held[-1] / held[SETTLED - 1] - 1}


def in_process(words: Sequence[str], programs: str) -> Any:
    """What this file prints last, as JSON, when a fresh process runs it with `words` and that folder of programs."""
    settings = {"JAX_COMPILATION_CACHE_DIR": programs, "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": str(LARGE)}
    call, environment = [sys.executable, __file__, *words], os.environ | settings
    done = subprocess.run(call, capture_output=True, text=True, check=False, env=environment)
    if done.returncode:
        return {"failed": (done.stderr.strip().splitlines() or [f"ended with {done.returncode}"])[-1]}
    return json.loads(done.stdout.splitlines()[-1])


# The table

COLUMNS = {
    "cpu": "CPU [s]", "wall": "wall [s]", "compile": "compile [s]", "trace": "trace [s]", "programs": "programs",
    "large": "over 0.2 s", "peak_gb": "peak [GB]",
}  # fmt: skip


def cell(name: str, value: float) -> str:
    return str(value) if name in ("programs", "large") else f"{value:.2f}" if name == "peak_gb" else f"{value:.1f}"


def table(results: dict[str, dict[str, Any]]) -> str:
    """Markdown."""
    lines = ["| row | run | " + " | ".join(COLUMNS.values()) + " | verdict |"]
    lines.append("|---|---|" + "--:|" * len(COLUMNS) + "---|")
    for row, runs in results.items():
        for run, read in runs.items():
            cells = [cell(name, read[name]) if name in read else "" for name in COLUMNS]
            lines.append(f"| {row} | {run} | {' | '.join(cells)} | {read.get('said') or read['failed']} |")
    return "\n".join(lines)


def compare(row: str, where: Where) -> dict[str, Any]:
    """Cold, second, and from disk."""
    words = ["--cases", str(where.cases), "--data", str(where.data), "--measure", row]
    with tempfile.TemporaryDirectory(prefix="jfsm-programs-") as programs:
        fresh = in_process([*words, "--times", "2"], programs)
        if "failed" in fresh:
            return {"cold": fresh}
        again = in_process([*words, "--times", "1"], programs)
    cold, second = fresh["runs"]
    return {"cold": cold, "disk": again["runs"][0] if "runs" in again else again, "second": second}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", nargs="*", choices=ROWS, default=list(ROWS), metavar="ROW", help=", ".join(ROWS))
    parser.add_argument("--lengths", action="store_true", help="growth of memory over sixty lengths, too")
    parser.add_argument("--json", type=Path, help="write every number here")
    shared = ROOT.parent / "shared"
    parser.add_argument("--cases", type=Path, default=shared / "field" / "cases.py", help="file that makes records")
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("JFSM_DATA", shared / "data")))
    parser.add_argument("--measure", choices=[*ROWS, "lengths"], help=argparse.SUPPRESS)
    parser.add_argument("--times", type=int, default=2, help=argparse.SUPPRESS)
    given = parser.parse_args()
    where = Where(given.data, given.cases)
    if given.measure:
        found = growth() if given.measure == "lengths" else {"runs": list(measure(given.measure, where, given.times))}
        print(json.dumps(found))
        return

    results: dict[str, dict[str, Any]] = {}
    written = {"jax": jax.__version__, "cores": os.cpu_count(), "rows": results}

    def write() -> None:
        if given.json:
            given.json.write_text(json.dumps(written, indent=1))

    for row in given.rows:
        if row in NEEDS and not (path := getattr(where, NEEDS[row])).exists():
            print(f"{row}: left out, {path} is not there", flush=True)
            continue
        results[row] = compare(row, where)
        cold = results[row]["cold"]
        print(f"{row}: {cold.get('said') or cold['failed']}", flush=True)
        write()
    print("\n" + table(results))
    if given.lengths:
        with tempfile.TemporaryDirectory(prefix="jfsm-programs-") as programs:
            written["lengths"] = lengths = in_process(["--measure", "lengths"], programs)
        told = "{settled_gb:.2f} GB after the tenth, {last_gb:.2f} GB after the last, {growth:+.0%}"
        print(f"\n{len(LENGTHS)} records of as many lengths: {lengths.get('failed') or told.format(**lengths)}")
        write()


if __name__ == "__main__":
    main()
