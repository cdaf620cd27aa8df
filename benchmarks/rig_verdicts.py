"""What the command line says of measured rigs whose defects are known, each with a page.

    python benchmarks/rig_verdicts.py [RIG ...] [--data DIR] [--out DIR]

Each rig is put into a folder as its owner would have it, a record and a rough model; `jfsm fit` finds the model's own
values (of the roll decay from the owner's potential-flow simulation), and `jfsm diagnose` judges it. A line: verdict,
causes, error on held-out readings before and after, seconds.

silverbox: a cubic spring. bouc_wen: memory, no map of displacement and velocity. emps: friction. roll_decay: quadratic
damping beside what the simulation has. springs, coupled_springs, and the balls: nothing that the record could support.
"""

import argparse
import functools
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import jax
import numpy as np

jax.config.update("jax_enable_x64", True)

import jfsm  # noqa: E402  (after double precision is on)

COMMAND = (sys.executable, "-c", "from jfsm.cli import app; app()")


class Rig(NamedTuple):
    """A record with the model that is believed, up to its own values, which are those of `fitted_to`."""

    record: jfsm.Record
    believed: jfsm.Structure
    held: jfsm.Record | float = 0.3
    fitted_to: jfsm.Record | None = None


def silverbox(data: Path) -> Rig:
    units = {"u": "V", "y": "V"}
    path = data / "silverbox" / "silverbox_multisine.npz"
    record = jfsm.read(path, force="u", displacement="y", units=units)
    omega = 2 * np.pi * 69.0
    return Rig(record[:8000], jfsm.Structure.sdof(1 / omega**2, 1.0, 0.1 / omega), record[66_000:])


def bouc_wen(data: Path) -> Rig:
    """The mean of the steady periods."""
    loaded = np.load(data / "bouc_wen" / "boucwen_multisine.npz")
    u, y = (loaded[name].ravel()[8192:].reshape(4, 8192).mean(0) for name in ("u_train", "y_train"))
    return Rig(jfsm.Record(np.arange(8192) / 750.0, u, y), jfsm.Structure.sdof(2.0, 1e5, 10.0))


def emps(data: Path) -> Rig:
    units, drive = {"displacement": "m"}, {"vir": "0.0284490 V/N"}
    path = data / "emps" / "DATA_EMPS.mat"
    record = jfsm.read(path, force="vir", displacement="qm", units=units, sensitivity=drive).resample(250.0)
    axis = jfsm.Structure([95.0], [jfsm.LinearDamping(200.0, at=(0, 1)), jfsm.Preload(1.0, at=(0, 1))])
    return Rig(record, axis, 0.4)


def roll_decay(data: Path) -> Rig:
    """The simulation knows waves, no viscosity; a unit inertia."""
    folder = data / "roll_decay_kvlcc2"
    measured = jfsm.read(folder / "test_21338_0kn.npz", displacement="phi", units={"phi": "rad"})
    simulated = jfsm.read(folder / "simulation_fnpf_0kn.npz", displacement="phi", units={"phi": "rad"})
    omega = 2 * np.pi / 2.53
    lever = jfsm.CubicStiffness(0.5 * omega**2, at=(0, 1))
    believed = jfsm.Structure.sdof(1.0, omega**2, 0.005 * omega) + lever
    return Rig(measured.since(8.3).until(72.3).resample(50.0), believed, 0.4, simulated)


def springs(data: Path) -> Rig:
    path = data / "motion_capture_sl" / "real_linear_h_1.txt"
    record = jfsm.read(path, time="column 2", displacement="column 3", velocity="column 4")
    return Rig(record, jfsm.Structure.sdof(1.0, (2 * np.pi * 0.4) ** 2, 0.05))


def coupled_springs(data: Path) -> Rig:
    path = data / "motion_capture_sl" / "real_double_linear_h_1.txt"
    places, speeds = ["column 3", "column 4"], ["column 5", "column 6"]
    record = jfsm.read(path, time="column 2", displacement=places, velocity=speeds)
    return Rig(record, jfsm.Structure.chain([1.0, 1.0], [20.0, 20.0], [0.05, 0.05]))


def ball(data: Path, name: str) -> Rig:
    """One drop fitted, the other held out, filmed at uneven steps; a unit mass that nothing but its weight pulls."""
    first, second = (
        jfsm.read(
            data / "ball_drops" / "ball_drops.csv", time="time_s", displacement="height_m", velocity="velocity_m_s",
            where={"ball": name, "drop": drop},
        ).resample(15.0)
        for drop in (1, 2)
    )  # fmt: skip
    return Rig(first, jfsm.Structure([1.0], [jfsm.Preload(9.81, at=(0, 1))]), second)


RIGS: dict[str, Callable[[Path], Rig]] = {
    "silverbox": silverbox, "bouc_wen": bouc_wen, "emps": emps, "roll_decay": roll_decay, "springs": springs,
    "coupled_springs": coupled_springs,
    **{name.lower().replace(" ", "_"): functools.partial(ball, name=name)
       for name in ("Golf Ball", "Bowling Ball", "Baseball")},
}  # fmt: skip


def written(record: jfsm.Record, path: Path) -> list[str]:
    """The record in a file, and the command line's words for it."""
    record.write(path)
    return [str(path)]


def command(*words: str) -> str:
    """What the command line prints; a verdict other than `consistent` ends it with 1."""
    done = subprocess.run([*COMMAND, *words], capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1):
        raise RuntimeError(f"jfsm {' '.join(words)} ended with {done.returncode}: {done.stderr}")
    return done.stdout


def judged(rig: Rig, folder: Path) -> dict:
    """The verdict of the command line, which leaves its page in the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    rough, model, page, numbers = (str(folder / f) for f in ("rough.toml", "model.toml", "page.html", "verdict.json"))
    rig.believed.save(rough)
    record = written(rig.record, folder / "record.npz")
    known = record if rig.fitted_to is None else written(rig.fitted_to, folder / "fitted.npz")
    command("fit", *known, "--model", rough, "--out", model)
    held = written(rig.held, folder / "held.npz")[0] if isinstance(rig.held, jfsm.Record) else str(rig.held)
    outputs = ("--report", page, "--json", numbers, "--holdout", held, "--key", "0")
    (folder / "said.txt").write_text(command("diagnose", *record, "--model", model, *outputs))
    return json.loads(Path(numbers).read_text())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rigs", nargs="*", default="all", choices=["all", *RIGS], metavar="RIG")
    default = Path(os.environ.get("JFSM_DATA", Path(__file__).resolve().parents[2] / "shared" / "data"))
    parser.add_argument("--data", type=Path, default=default)
    parser.add_argument("--out", type=Path, default=Path("rig_verdicts"), help="folder of records, models and pages")
    given = parser.parse_args()
    for name in RIGS if "all" in given.rigs else given.rigs:
        begun = time.perf_counter()
        try:
            said = judged(RIGS[name](given.data), given.out / name)
        except RuntimeError as problem:  # the other rigs are judged all the same
            print(f"{name:16s} {problem}", flush=True)
            continue
        causes = [f"{f['cause']} {f['probability']:.2f} {[r['cause'] for r in f['rivals']]}" for f in said["findings"]]
        errors = [
            f"{channel}: {c['before']:.3g} -> {c['after']:.3g} {c['unit']} (refitted {c['refitted']:.3g})"
            for channel, c in said["gain"]["channels"].items()
        ]
        seconds = time.perf_counter() - begun
        print(f"{name:16s} {said['verdict']:10s} {', '.join(causes)}  {'; '.join(errors)}  {seconds:.0f} s", flush=True)


if __name__ == "__main__":
    main()
