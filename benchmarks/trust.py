"""Kills a batch at random moments, goes on with it, and counts what is lost, made again or cut short.

    python benchmarks/trust.py                     100 kills of batches of 40 with a stand-in for the diagnosis
    python benchmarks/trust.py --real --kills 3    the diagnosis itself, of short records of one degree of freedom

A process that is killed by SIGKILL may lose the record under way; what it had written before must be there, whole, and
must not be made again. When a batch has come to its end, the next one begins in another folder. The processes are forks
of this one, so that a kill costs no import of JAX; Linux and macOS only. Ends with 1 if anything is lost.
"""

import argparse
import json
import os
import random
import signal
import sys
import tempfile
import time
import warnings
from pathlib import Path
from typing import Any

import jax

jax.config.update("jax_enable_x64", True)
import numpy as np  # noqa: E402

from jfsm import Record, Structure  # noqa: E402
from jfsm.fleet import Batch, Settings, _work, many, sources_of  # noqa: E402
from jfsm.records import Reading  # noqa: E402

SAMPLES, PAUSE = 300, 0.002
"""Of a record; seconds of the work on it that stand for a diagnosis."""


def stand_in(record: Record, task: Any) -> tuple[dict[str, Any], str]:
    """What looks like a diagnosis, of the size of one."""
    time.sleep(PAUSE * random.uniform(0.5, 1.5))
    filler = np.arange(5000.0).tolist()
    numbers = {"verdict": "consistent", "findings": [], "finished": True, "sentence": "", "curves": filler}
    return numbers, f'<html><meta name="generator" content="jfsm">{"x" * 100_000}</html>'


def write_records(folder: Path, count: int) -> list[Path]:
    """Files of a linear oscillator under noise."""
    rng, paths = np.random.default_rng(0), []
    for number in range(count):
        t, u, x, v = 0.05 * np.arange(SAMPLES), rng.standard_normal(SAMPLES), 0.0, 0.0
        y = []
        for force in u:
            v += 0.05 * (force - 0.3 * v - 9.0 * x)
            x += 0.05 * v
            y.append(x)
        paths.append(folder / f"run{number}.csv")
        np.savetxt(paths[-1], np.column_stack([t, u, y]), delimiter=",", header="t,u,y", comments="")
    return paths


def run_batch(paths: list[Path], out: Path, real: bool) -> Batch:
    reading = Reading({"force": "u", "displacement": "y"})
    settings = Settings.of(causes=["coulomb"] if real else None, max_causes=1, key=jax.random.key(0))
    return many(sources_of(paths, reading), Structure.sdof(1.0, 9.0, 0.3), out, None, settings, False)


def killed(paths: list[Path], out: Path, after: float, real: bool) -> bool:
    """Whether a batch in a process of its own was killed after so many seconds, or came to its end before."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of threads that a fork does not take along: nothing here waits for them
        child = os.fork()
    if child == 0:
        code = 1
        try:
            run_batch(paths, out, real)
            code = 0
        finally:
            os._exit(code)
    end = time.monotonic() + after
    while time.monotonic() < end:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            assert status == 0, f"a batch ended with {status}"
            return False
        time.sleep(0.0005)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return True


def whole(out: Path) -> dict[str, tuple[int, int]]:
    """Results that are there, each with its inode and its instant: another one was made again. A broken one raises."""
    found = {}
    for path in (out / "records").glob("[!.]*.json"):
        assert json.loads(path.read_text())["verdict"], path
        assert path.with_suffix(".html").read_text().endswith("</html>"), path
        found[path.name] = (path.stat().st_ino, path.stat().st_mtime_ns)
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--records", type=int, default=40)
    parser.add_argument("--real", action="store_true", help="the diagnosis itself instead of a stand-in")
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    if not asked.real:
        _work.diagnosed = stand_in
    random.seed(asked.seed)
    begin = time.monotonic()
    with tempfile.TemporaryDirectory() as place:
        paths = write_records(Path(place), asked.records)
        start = time.monotonic()
        assert killed(paths, Path(place) / "timed", 3600.0, asked.real) is False
        length = time.monotonic() - start
        kills = batches = lost = again = cut = 0
        under_way = list[int]()
        out, before = Path(place) / "batch0", dict[str, tuple[int, int]]()
        ended = False
        while kills < asked.kills or not ended:
            # Short enough that a batch takes several kills, and any moment of it may be the last.
            after = random.uniform(0.0, 0.7 * length) if kills < asked.kills else 3600.0
            ended = not killed(paths, out, after, asked.real)
            kills += not ended
            try:
                now = whole(out)
            except (AssertionError, ValueError, KeyError, OSError):
                cut += 1
                now = before
            lost += sum(name not in now for name in before)
            again += sum(name in now and now[name] != stat for name, stat in before.items())
            under_way.append(len(list((out / "records").glob(".*.part"))))
            before = now
            if ended:
                summary = Batch.load(out)
                lost += asked.records - len(now) + len(summary.failures) + asked.records - len(summary)
                again += len(list((out / "records").glob("*"))) - 2 * asked.records  # a leftover counts as doubled
                batches, before = batches + 1, {}
                out = Path(place) / f"batch{batches}"
    print(
        f"{kills} kills of {batches} batches of {asked.records} records, {sum(map(bool, under_way))} of them amid a "
        f"write: lost {lost}, made again {again}, cut short {cut}. {time.monotonic() - begin:.0f} s; a batch alone "
        f"takes {length:.2f} s."
    )
    return int(bool(lost or again or cut))


if __name__ == "__main__":
    sys.exit(main())
