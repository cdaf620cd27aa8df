"""What the command line says of measured rigs whose defects are known, each with a page.

    python benchmarks/rig_verdicts.py [RIG ...] [--data DIR] [--out DIR]

Each rig is put into a folder as its owner would have it, a record and a rough model; `jfsm fit` finds the model's own
values (of the roll decay from the owner's potential-flow simulation), and `jfsm diagnose` judges it. A line: verdict,
causes, error on held-out readings before and after, seconds.

silverbox, silverbox_levels: a cubic spring. bouc_wen: memory, no map of displacement and velocity. emps: friction.
roll_decay: quadratic damping beside what the simulation has. pendulum: softening, as a sine. mr_damper: a step in
velocity with a loop. friction_damper: memory. arm: friction in both joints. beam: a joint that depends on amplitude.
f16: nothing beyond other modes. springs, coupled_springs, and the balls: nothing that the record could support.
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
from scipy.io import loadmat
from scipy.signal import butter, savgol_filter, sosfiltfilt

jax.config.update("jax_enable_x64", True)

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import jfsm  # noqa: E402  (after double precision is on)
from benchmarks.rig_records import arm_two_joint, pendulum_large_angle  # noqa: E402  (needs the line above)

COMMAND = (sys.executable, "-c", "from jfsm.cli import app; app()")


class Rig(NamedTuple):
    """A record with the model that is believed, up to its own values, which are those of `fitted_to`."""

    record: jfsm.Record | list[jfsm.Record]
    believed: jfsm.Structure
    held: jfsm.Record | list[jfsm.Record] | float = 0.3
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
    force, displacement = (loaded[name].ravel() for name in ("u_train", "y_train"))
    record = jfsm.Record(np.arange(force.size) / 750.0, force, displacement)
    return Rig(record.folded(8192, transient=1), jfsm.Structure.sdof(2.0, 1e5, 10.0))


def emps(data: Path) -> Rig:
    units, drive = {"displacement": "m"}, {"vir": "0.0284490 V/N"}
    path = data / "emps" / "DATA_EMPS.mat"
    record = jfsm.read(path, force="vir", displacement="qm", units=units, sensitivity=drive).resample(250.0)
    axis = jfsm.Structure([95.0], [jfsm.LinearDamping(200.0, at=(0, 1)), jfsm.Preload(1.0, at=(0, 1))])
    return Rig(record, axis, 0.4)


def roll_decay(data: Path) -> Rig:
    """The simulation, over the same minute, knows waves, no viscosity; a unit inertia."""
    folder = data / "roll_decay_kvlcc2"
    measured = jfsm.read(folder / "test_21338_0kn.npz", displacement="phi", units={"phi": "rad"})
    simulated = jfsm.read(folder / "simulation_fnpf_0kn.npz", displacement="phi", units={"phi": "rad"})
    omega = 2 * np.pi / 2.53
    lever = jfsm.CubicStiffness(0.5 * omega**2, at=(0, 1))
    believed = jfsm.Structure.sdof(1.0, omega**2, 0.005 * omega) + lever
    measured, simulated = (record.since(8.3).until(72.3) for record in (measured, simulated))
    return Rig(measured.resample(50.0), believed, 0.4, simulated)


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


def silverbox_levels(data: Path) -> Rig:
    """The mean of the steady periods at 100 mV fitted, at 50 mV held out; every second sample."""

    def level(millivolts: int) -> jfsm.Record:
        folder = data / "silverbox_levels"
        drive = jfsm.read(folder / f"SNJP_um_full_FNSI_{millivolts}.mat", force="um", units={"um": "V"})
        answer = folder / f"SNJP_ym_full_FNSI_{millivolts}.mat"
        seen = jfsm.read(answer, displacement="ym", units={"ym": "V"}, rate=drive.sample_rate)
        return jfsm.align([drive, seen]).folded(transient=5).resample(drive.sample_rate / 2)

    omega = 2 * np.pi * 69.0
    return Rig(level(100), jfsm.Structure.sdof(1 / omega**2, 1.0, 0.1 / omega), level(50))


def pendulum(data: Path) -> Rig:
    """36 s fitted, the next 36 s held out; a unit inertia that is believed to swing as at small angles."""
    record = pendulum_large_angle(data / "pendulum_large_angle").resample(100.0)
    begin = record.time[0]
    held = record.since(begin + 36.0).until(begin + 72.0)
    return Rig(record.until(begin + 36.0), jfsm.Structure.sdof(1.0, 6.0**2, 0.05), held)


def device(stiffness: float, damping: float) -> jfsm.Structure:
    """A spring and a dashpot without a mass, of which nothing is known."""
    parts = [jfsm.LinearStiffness(stiffness, at=(0, 1)), jfsm.LinearDamping(damping, at=(0, 1))]
    return jfsm.Structure([0.0], parts).uncertain(stiffness=1.0, damping=1.0)


def mr_damper(data: Path) -> Rig:
    """At the highest current; one record fitted, three held out."""
    path, units = data / "mr_damper" / "mr_series_B.npz", {"displacement": "mm", "force": "N"}

    def run(number: int) -> jfsm.Record:
        x, force = f"x_B_{number}", f"F_B_{number}"
        return jfsm.read(path, displacement=x, force=force, units=units, rate=100.0, drive="motion").since(1.0)

    return Rig(run(1), device(5e3, 5e3), [run(3), run(5), run(10)])


def friction_damper(data: Path) -> Rig:
    """At 1 Hz; half an inch and an inch and a half fitted, an inch held out; every fourth sample."""
    path = data / "friction_damper_brfd" / "brfd_harmonic_36lb.npz"
    units = {"displacement": "in", "force": "kip", "velocity": "in/s"}

    def run(inches: str) -> jfsm.Record:
        x, force, v = (f"f1Hz_a{inches}in[{column}]" for column in range(3))
        record = jfsm.read(path, displacement=x, force=force, velocity=v, units=units, rate=1024.0, drive="motion")
        return record.resample(256.0)

    return Rig([run("0p5"), run("1p5")], device(3e5, 1e5), run("1"))


def arm(data: Path) -> Rig:
    """Both joints of an arm along its own motion, less the torque of rigid links and weight."""
    record = arm_two_joint(data / "arm_two_joint").resample(500.0)
    units = {kind: record.units[kind] for kind in ("force", "displacement", "velocity")}
    torque, angle, speed = (np.asarray(y) for y in (record.force, record.displacement, record.velocity))
    rest = torque - rigid_torque(torque, angle, speed, record.dt)
    left = jfsm.Record(record.time, force=rest, displacement=angle, velocity=speed, units=units, drive="motion")
    joints = [jfsm.LinearDamping(0.01, at=at) for at in ((0, 1), (0, 2))]
    return Rig(left, jfsm.Structure([0.0, 0.0], joints).uncertain(damping=1.0))


def rigid_torque(torque: np.ndarray, angle: np.ndarray, speed: np.ndarray, dt: float) -> np.ndarray:
    """Torque (n, 2) of two rigid links and their weight, as least squares beside dry friction tell it."""
    w, a = (np.asarray(savgol_filter(speed, 61, 2, deriv=order, delta=dt, axis=0)) for order in (0, 1))
    none, cos, sin = np.zeros(len(w)), np.cos(angle[:, 1]), np.sin(angle[:, 1])
    tip = angle[:, 0] + angle[:, 1]
    rigid = [  # inertia of both links, their coupling, inertia of the second and of its drive, weight of both
        (a[:, 0], none),
        (cos * (2 * a[:, 0] + a[:, 1]) - sin * w[:, 1] * (2 * w[:, 0] + w[:, 1]), cos * a[:, 0] + sin * w[:, 0] ** 2),
        (a[:, 0] + a[:, 1], a[:, 0] + a[:, 1]),
        (none, a[:, 1]),
        (np.sin(angle[:, 0]), none),
        (np.sin(tip), np.sin(tip)),
    ]
    dry = [(np.sign(w[:, 0]), none), (none, np.sign(w[:, 1]))]
    columns = np.stack([np.concatenate(pair) for pair in (*rigid, *dry)], 1)
    numbers = np.linalg.lstsq(columns, np.concatenate([torque[:, 0], torque[:, 1]]), rcond=None)[0]
    return (columns[:, : len(rigid)] @ numbers[: len(rigid)]).reshape(2, -1).T


def beam(data: Path) -> Rig:
    """The first bending mode of a bolted beam as it rings down, filtered out of an accelerometer; a unit mass."""
    struck = loadmat(data / "brake_reuss_beam" / "HammerImpact.mat", squeeze_me=True)["HIdata"]
    time, a = (np.asarray(struck[name].item(), float) for name in ("time", "acc1"))
    mode = sosfiltfilt(butter(4, (60.0, 110.0), "bandpass", fs=12800.0, output="sos"), a)
    kept = slice(np.searchsorted(time, 0.1), np.searchsorted(time, 3.1), 16)
    omega = 2 * np.pi * 80.5
    record = jfsm.Record(time[kept], acceleration=mode[kept], units={"acceleration": "m/s^2"})
    return Rig(record, jfsm.Structure.sdof(1.0, omega**2, 0.003 * omega))


def f16(data: Path) -> Rig:
    """The wing's side of the payload's mount as the shaker moves it, believed to have one mode; the mean of the steady
    periods."""
    loaded = np.load(data / "f16_gvt" / "f16_fullmsine_level1.npz")
    force, wing = loaded["force"], loaded["acc"][:, 1]
    record = jfsm.Record(np.arange(force.size) / 400.0, force, acceleration=wing, units={"acceleration": "m/s^2"})
    mass, omega = 185.0, 2 * np.pi * 7.32
    steady = record.folded(8192, transient=1)
    return Rig(steady.resample(100.0), jfsm.Structure.sdof(mass, mass * omega**2, 0.02 * mass * omega))


RIGS: dict[str, Callable[[Path], Rig]] = {
    "silverbox": silverbox, "silverbox_levels": silverbox_levels, "bouc_wen": bouc_wen, "emps": emps,
    "roll_decay": roll_decay, "pendulum": pendulum, "mr_damper": mr_damper, "friction_damper": friction_damper,
    "arm": arm, "beam": beam, "f16": f16, "springs": springs, "coupled_springs": coupled_springs,
    **{name.lower().replace(" ", "_"): functools.partial(ball, name=name)
       for name in ("Golf Ball", "Bowling Ball", "Baseball")},
}  # fmt: skip


def written(records: jfsm.Record | list[jfsm.Record], folder: Path) -> list[str]:
    """The records in files of a folder, and the command line's words for them."""
    folder.mkdir(exist_ok=True)
    paths = []
    for number, record in enumerate([records] if isinstance(records, jfsm.Record) else records, start=1):
        paths.append(str(folder / f"{number}.npz"))
        record.write(paths[-1])
    return paths


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
    records = written(rig.record, folder / "records")
    known = records if rig.fitted_to is None else written(rig.fitted_to, folder / "fitted")
    command("fit", *known, "--model", rough, "--out", model)
    held = [str(rig.held)] if isinstance(rig.held, float | int) else written(rig.held, folder / "held")
    outputs = (
        "--report",
        page,
        "--json",
        numbers,
        "--key",
        "0",
        *(word for one in held for word in ("--holdout", one)),
    )
    (folder / "said.txt").write_text(command("diagnose", *records, "--model", model, *outputs))
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
