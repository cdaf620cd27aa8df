"""Fifteen measured rigs, each read in the fewest lines its owner would need, inspected, and shown on a line.

    python benchmarks/rig_records.py [RIG ...] [--data DIR] [--page]

A line: samples, rate, channels, noise level of each, and the number of warnings; --page prints the findings as well.
"""

import argparse
import os
from collections.abc import Callable
from pathlib import Path

import jfsm


def arm_two_joint(data: Path) -> jfsm.Record:
    units = {"force": "N m", "displacement": "rad", "velocity": "rad/s"}
    path = data / "arm_154220.npz"
    return jfsm.read(path, force="tau_meas", displacement="pos_meas", velocity="vel_meas", units=units)


def ball_drops(data: Path) -> jfsm.Record:
    path, one = data / "ball_drops.csv", {"ball": "Whiffle Ball 1", "drop": 1}
    return jfsm.read(path, time="time_s", displacement="height_m", velocity="velocity_m_s", where=one)


def bouc_wen(data: Path) -> jfsm.Record:
    units = {"force": "N", "displacement": "m"}
    return jfsm.read(data / "boucwen_multisine.npz", force="u_train", displacement="y_train", units=units)


def brake_reuss_beam(data: Path) -> jfsm.Record:
    names = ["HIdata.acc1", "HIdata.acc2", "HIdata.acc3"]
    return jfsm.read(data / "HammerImpact.mat", acceleration=names, units={"acceleration": "m/s^2"})


def coupled_drives(data: Path) -> jfsm.Record:
    units = {"force": "V", "velocity": "V"}
    return jfsm.read(data / "coupled_drives_train.npz", force="u12", velocity="z12", units=units)


def double_pendulum(data: Path) -> jfsm.Record:
    markers = ["px[2]", "px[3]", "px[4]", "px[5]"]  # x and y of elbow and tip
    return jfsm.read(data / "run_00.npz", displacement=markers, units={"displacement": "px"})


def emps(data: Path) -> jfsm.Record:
    units, drive = {"displacement": "m"}, {"vir": "0.0284490 V/N"}  # 1/gtau: the drive's voltage for a newton
    return jfsm.read(data / "DATA_EMPS.mat", force="vir", displacement="qm", units=units, sensitivity=drive)


def f16_gvt(data: Path) -> jfsm.Record:
    units = {"force": "N", "acceleration": "m/s^2"}
    return jfsm.read(data / "f16_fullmsine_level1.npz", force="force", acceleration="acc", units=units)


def friction_damper_brfd(data: Path) -> jfsm.Record:
    path, units = data / "brfd_harmonic_36lb.npz", {"displacement": "in", "force": "kip", "velocity": "in/s"}
    x, f, v = (f"f1Hz_a1in[{column}]" for column in range(3))
    return jfsm.read(path, displacement=x, force=f, velocity=v, units=units, drive="motion")


def motion_capture_sl(data: Path) -> jfsm.Record:
    angles, rates, trial = ["column 3", "column 4"], ["column 5", "column 6"], {"column 1": 0}
    units = {"displacement": "rad", "velocity": "rad/s"}
    path = data / "real_double_pend_h_1.txt"
    return jfsm.read(path, time="column 2", displacement=angles, velocity=rates, units=units, where=trial)


def mr_damper(data: Path) -> jfsm.Record:
    path, units = data / "mr_series_0V.npz", {"displacement": "mm", "force": "N"}
    return jfsm.read(path, displacement="x_1_1", force="F_1_1", units=units, rate=100.0, drive="motion")


def pendulum_large_angle(data: Path) -> jfsm.Record:
    return jfsm.read(data / "data31.csv", displacement="angle", units={"angle": "rad"})


def roll_decay_kvlcc2(data: Path) -> jfsm.Record:
    return jfsm.read(data / "test_21338_0kn.npz", displacement="phi", units={"phi": "rad"})


def silverbox(data: Path) -> jfsm.Record:
    units = {"u": "V", "y": "V"}
    return jfsm.read(data / "silverbox_multisine.npz", force="u", displacement="y", units=units)


def silverbox_levels(data: Path) -> jfsm.Record:
    drive = jfsm.read(data / "SNJP_um_full_FNSI_50.mat", force="um", units={"um": "V"})
    answer = data / "SNJP_ym_full_FNSI_50.mat"
    return jfsm.align([drive, jfsm.read(answer, displacement="ym", units={"ym": "V"}, rate=drive.sample_rate)])


RIGS: dict[str, Callable[[Path], jfsm.Record]] = {
    rig.__name__: rig
    for rig in (
        arm_two_joint, ball_drops, bouc_wen, brake_reuss_beam, coupled_drives, double_pendulum, emps, f16_gvt,
        friction_damper_brfd, motion_capture_sl, mr_damper, pendulum_large_angle, roll_decay_kvlcc2, silverbox,
        silverbox_levels,
    )
}  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description="Read and inspect measured rigs, a line each.")
    parser.add_argument("rigs", nargs="*", default="all", choices=["all", *RIGS])
    default = Path(os.environ.get("JFSM_DATA", Path(__file__).resolve().parents[2] / "shared" / "data"))
    parser.add_argument("--data", type=Path, default=default)
    parser.add_argument("--page", action="store_true", help="print every finding")
    given = parser.parse_args()
    for name in RIGS if "all" in given.rigs else given.rigs:
        page = RIGS[name](given.data / name).inspect()
        noise = ", ".join(
            f"{one.channel} {'?' if one.noise is None else f'{one.noise:.2g}'} {one.unit}" for one in page.channels
        )
        warnings = sum(finding.severity == "warning" for finding in page.findings)
        print(f"{name:20s} {page.samples:6d} samples {page.sample_rate:8.6g} Hz  {warnings} warnings  noise: {noise}")
        for severity, channel, message in page.findings if given.page else ():
            print(f"    {severity:7s} {channel}: {message}")


if __name__ == "__main__":
    main()
