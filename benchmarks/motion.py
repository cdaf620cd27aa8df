"""How close `jfsm.estimate_motion` comes to the true motion, beside what laboratories use at its best setting.

    python benchmarks/motion.py [--plants 10] [--noise 0.001 0.01 0.05] [--seed 1] [--out motion.json]

Plants with a smooth law, with dry friction and with a spring on one side (SciPy, events located), read with white noise
on every channel, the force included. From full readings, and from displacement, velocity or acceleration alone, each
method gives all three. Errors are rms over that of the truth. The peers are told nothing of the force, but the best of
their settings is picked by the truth, for every cell anew:

    spline     quintic least-squares spline, knots every 2 to 60 samples; derived or integrated
    savgol     Savitzky-Golay, order 3 or 5, windows of 5 to 61 samples; derived or integrated
    band       a band of the spectrum, multiplied or divided by i omega
    kalman     the filter of paper eqs. 70-71 with readings of displacement and velocity, its noise ratio varied

What is integrated loses its mean and its slow part by a high-pass of the best corner. The table gives the share of
cells in which the estimate has the smallest error or comes within 10 % of it, and how often its 95 % bands cover the
truth, farther than five samples from a jump of the acceleration.
"""

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

import jax
import numpy as np
from scipy.interpolate import make_lsq_spline
from scipy.signal import savgol_filter

jax.config.update("jax_enable_x64", True)
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import jfsm  # noqa: E402  (after double precision is on)
from tests.blind import draw  # noqa: E402

KINDS = ("displacement", "velocity", "acceleration")
SETS = {"full": KINDS, **{kind: (kind,) for kind in KINDS}}
LAWS = ("cubic_hardening", "coulomb", "bilinear_stiffness")
DRIVES = ("multisine", "noise", "sweep", "free_decay")
FAR = 5
"""Samples from a jump of the acceleration at which coverage counts."""
CORNERS = (0.0, 0.02, 0.05, 0.1, 0.2, 0.4)
"""High-pass corners tried, as shares of the motion's main frequency."""


def rms(y: np.ndarray) -> float:
    return float(np.sqrt(np.mean(y**2)))


def integrated(y: np.ndarray, times: int, dt: float) -> np.ndarray:
    """Running integral by the trapezium rule."""
    for _ in range(times):
        y = np.concatenate([[0.0], np.cumsum((y[1:] + y[:-1]) / 2) * dt])
    return y


def high_passed(y: np.ndarray, dt: float, corner: float) -> np.ndarray:
    spectrum, omega = np.fft.rfft(y), 2 * np.pi * np.fft.rfftfreq(y.size, dt)
    return np.fft.irfft(np.where(omega > corner, spectrum, 0.0), y.size)


def by_spline(y: np.ndarray, order: int, spacing: int) -> np.ndarray:
    n, k = y.size, 5
    inner = np.arange(spacing, n - spacing, spacing, dtype=float)
    knots = np.concatenate([np.zeros(k + 1), inner, np.full(k + 1, n - 1.0)])
    spline = make_lsq_spline(np.arange(n, dtype=float), y, knots, k)
    return np.asarray(spline(np.arange(n), order))


def by_band(y: np.ndarray, order: int, dt: float, low: float, high: float) -> np.ndarray:
    spectrum, omega = np.fft.rfft(y), 2 * np.pi * np.fft.rfftfreq(y.size, dt)
    inside = (omega >= low) & (omega <= high) & ((omega > 0) | (order >= 0))
    factor = np.where(inside, (1j * np.where(omega > 0, omega, 1.0)) ** order, 0.0)
    return np.fft.irfft(factor * spectrum, y.size)


def by_kalman(channels: dict[str, np.ndarray], dt: float, ratio: float) -> list[np.ndarray]:
    """Displacement, velocity and acceleration by the filter of eqs. 70-71; without an accelerometer 0 drives it."""
    n = len(next(iter(channels.values())))
    drive = channels.get("acceleration", np.zeros(n))
    step, enter = np.array([[1.0, dt], [0.0, 1.0]]), np.array([dt**2 / 2, dt])
    readings = [(i, channels[kind]) for i, kind in enumerate(KINDS[:2]) if kind in channels]
    scale = {0: rms(channels.get("displacement", np.ones(1))) ** 2, 1: rms(channels.get("velocity", np.ones(1))) ** 2}
    size = rms(drive) if "acceleration" in channels else scale[readings[0][0]] ** 0.5 / dt ** (2 - readings[0][0])
    noise = ratio * size**2 * np.outer(enter, enter)
    state, covariance = np.zeros(2), np.diag([1e3 * scale[0], 1e3 * scale[1]])
    out = np.zeros((3, n))
    for k in range(n):
        for i, y in readings:
            weight = covariance[:, i] / (covariance[i, i] + 1e-4 * scale[i])
            state = state + weight * (y[k] - state[i])
            covariance = covariance - np.outer(weight, covariance[i])
        out[:2, k], out[2, k] = state, drive[k]
        state = step @ state + enter * drive[k]
        covariance = step @ covariance @ step.T + noise
    if "acceleration" not in channels:
        out[2] = np.gradient(out[1], dt)
    return list(out)


def peers(channels: dict[str, np.ndarray], dt: float, omega: float, truth: list[np.ndarray]) -> dict[str, list[float]]:
    """Smallest error of each peer over its settings, for displacement, velocity and acceleration."""
    best = {name: [np.inf] * 3 for name in ("spline", "savgol", "band", "kalman")}

    def offer(name: str, place: int, y: np.ndarray, drifts: bool) -> None:
        for corner in CORNERS if drifts else (0.0,):
            tried = high_passed(y, dt, corner * omega) if drifts else y
            best[name][place] = min(best[name][place], rms(tried - truth[place]) / rms(truth[place]))

    for place in range(3):
        sources = [KINDS.index(kind) for kind in channels]
        source = place if place in sources else sources[0]
        y, order = channels[KINDS[source]], place - source
        for spacing in (2, 3, 4, 6, 9, 14, 24, 60):
            smooth = by_spline(y, max(order, 0), spacing) / dt ** max(order, 0)
            offer("spline", place, integrated(smooth, max(-order, 0), dt), order < 0)
        for degree in (3, 5):
            for window in range(degree + 2, 62, 4):
                width = window + 1 - window % 2
                smooth = np.asarray(savgol_filter(y, width, degree, deriv=max(order, 0), delta=dt))
                offer("savgol", place, integrated(smooth, max(-order, 0), dt), order < 0)
        for low in (0.0, 0.02, 0.05, 0.1, 0.2, 0.4):
            for high in (1.5, 2.0, 3.0, 4.0, 6.0, 9.0, 14.0, np.inf):
                offer("band", place, by_band(y, order, dt, low * omega, high * omega), False)
    if set(channels) != {"acceleration"}:
        for ratio in np.logspace(-8, 4, 13):
            for place, y in enumerate(by_kalman(channels, dt, float(ratio))):
                offer("kalman", place, y, False)
    return best


def examine(seed: int, law: str, drive: str, noise: float) -> list[dict[str, Any]]:
    """All cells of one plant at one noise level."""
    challenge = draw(seed, causes=law, noise=noise, channels="xva", excitation=drive)
    motion, dt = challenge.motion, float(challenge.time[1] - challenge.time[0])
    truth = [motion.x, motion.v, motion.acceleration]
    omega = rms(motion.v) / rms(motion.x)
    jumps = np.concatenate([motion.instants, [-np.inf]]) if law == "coulomb" else np.array([-np.inf])
    far = np.min(np.abs(challenge.time[:, None] - jumps[None, :]), 1) > FAR * dt
    rows = []
    for name, kinds in SETS.items():
        channels = {kind: challenge.channels[kind] for kind in kinds}
        force = {"force": challenge.channels["force"]} if "force" in challenge.channels else {}
        record = jfsm.Record(challenge.time, **channels, **force, at_rest=challenge.at_rest)  # pyright: ignore[reportArgumentType]
        begin = time.perf_counter()
        found = jfsm.estimate_motion(record)
        seconds = time.perf_counter() - begin
        errors = peers(channels, dt, omega, truth)
        for place, kind in enumerate(KINDS):
            miss = getattr(found, kind)[:, 0] - truth[place]
            inside = np.abs(miss) <= 1.96 * found.std[:, 0, place]
            rows.append(
                {
                    "seed": seed,
                    "law": law,
                    "drive": drive,
                    "noise": noise,
                    "set": name,
                    "kind": kind,
                    "error": rms(miss) / rms(truth[place]),
                    "covered": float(np.mean(inside[far])),
                    "seconds": seconds,
                    **{peer: values[place] for peer, values in errors.items()},
                }  # fmt: skip
            )
    return rows


def table(rows: list[dict[str, Any]]) -> str:
    lines = [
        "set           kind            cells  best  95 % bands   error, median: jfsm  spline  savgol    band  kalman"
    ]
    for name in SETS:
        for kind in KINDS:
            mine = [row for row in rows if row["set"] == name and row["kind"] == kind]
            if mine:
                medians = [
                    float(np.median([row[key] for row in mine]))
                    for key in ("error", "spline", "savgol", "band", "kalman")
                ]
                lines.append(
                    f"{name:13s} {kind:14s} {len(mine):6d} {np.mean([within(row) for row in mine]):5.0%} "
                    f"{np.median([row['covered'] for row in mine]):8.1%}  {'':12s}"
                    + "".join(f"{100 * value:7.2f}%" for value in medians)
                )
    covered = np.array([row["covered"] for row in rows])
    honest = np.mean((covered >= 0.9) & (covered <= 0.98))
    lines.append(
        f"best, or within 10 % of the best, in {np.mean([within(row) for row in rows]):.1%} of {len(rows)} cells"
    )
    lines.append(f"bands cover {np.mean(covered):.1%} on average, 90 to 98 % in {honest:.0%} of cells")
    lines.append(f"{np.median([row['seconds'] for row in rows]):.1f} s a record, compilation included where it was due")
    return "\n".join(lines)


def within(row: dict[str, Any]) -> bool:
    return row["error"] <= 1.1 * min(row[peer] for peer in ("spline", "savgol", "band", "kalman"))


def main() -> None:
    """Run, print the table, write the rows."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plants", type=int, default=10)
    parser.add_argument("--noise", type=float, nargs="+", default=[0.001, 0.01, 0.05])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, help="write the rows as JSON")
    given = parser.parse_args()
    rows: list[dict[str, Any]] = []
    for k in range(given.plants):
        for noise in given.noise:
            rows += examine(given.seed + k, LAWS[k % len(LAWS)], DRIVES[k % len(DRIVES)], noise)
            good = np.mean([within(row) for row in rows])
            print(f"plant {k + 1} of {given.plants}, {noise:.1%} noise: best in {good:.0%} so far", flush=True)
    print("\n" + table(rows))
    if given.out:
        given.out.write_text(json.dumps(rows, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
