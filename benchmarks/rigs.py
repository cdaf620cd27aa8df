"""Two measured or simulated standards whose model is known: the values that jfsm finds, and the free run they give.

    python benchmarks/rigs.py [bouc_wen] [emps] [--data DIR]

bouc_wen: the hysteretic benchmark of Noël and Schoukens (2016); fitted to the mean of periods 2 to 5 of the noisy
multisine, run freely on the clean test period. emps: the positioning axis of Janot, Gautier and Brunot (2019); fitted
to the first 60 %, judged on 0.5 s segments of the last 40 % and on the whole of it in one run.
"""

import argparse
import os
import time
from pathlib import Path

import jax
import numpy as np
import scipy.io

jax.config.update("jax_enable_x64", True)

import jfsm  # noqa: E402  (after double precision is on)


def rms(y) -> float:
    return float(np.sqrt(np.mean(np.square(y))))


def show(fit: jfsm.Fit) -> None:
    for path, value in fit.values.items():
        low, high = fit.intervals[path]
        print(f"  {path:28s} {value:12.6g}   [{low:.6g}, {high:.6g}]")
    for words in fit.identifiability:
        print(f"  {words}")


def bouc_wen(data: Path) -> None:
    """Steady periods are repeated once: the first repetition lets the loop settle, the second counts."""
    loaded = np.load(data / "bouc_wen" / "boucwen_multisine.npz")
    rate, period = 750.0, 8192
    u, y = (loaded[name].ravel()[period:].reshape(4, period).mean(0) for name in ("u_train", "y_train"))
    dt = 1 / rate
    record = jfsm.Record(np.arange(period) * dt, u, y)
    linear = jfsm.fit(jfsm.Structure.sdof(2.0, 5e4, 10.0), record).structure
    begin = time.perf_counter()
    law = jfsm.BoucWen(k=2e4, beta=1e3, gamma=100.0, n=1.0, at=(0, 1))
    found = jfsm.fit(linear + law, record, fixed=("bouc_wen@0-1.n",))
    print(f"bouc_wen: {found.result}, {time.perf_counter() - begin:.0f} s")
    show(found)
    print("  truth: mass 2, stiffness 5e4, damping 10, bouc_wen k 5e4, beta 800, gamma -1100")
    u, y = loaded["u_test"].ravel(), loaded["y_test"].ravel()
    twice = jfsm.Record(np.arange(2 * y.size) * dt, np.tile(u, 2))
    for name, model in (("linear", linear), ("Bouc-Wen", found.structure)):
        run = jfsm.simulate(model, twice, initial_state=(0.0, 0.0)).displacement[y.size :, 0]
        error = rms(run - np.mean(run - y) - y)
        print(f"  clean test, {name:9s} {error:.3e} m  {20 * np.log10(error):.1f} dB")


def emps(data: Path) -> None:
    loaded = scipy.io.loadmat(data / "emps" / "DATA_EMPS.mat")
    t, x, g = (loaded[name].ravel() for name in ("t", "qm", "vir"))
    record = jfsm.Record(t, 35.1507 * g, x)
    split = int(0.6 * len(record))
    training, test = record[:split], record[split:]
    axis = jfsm.Structure([95.0], [jfsm.LinearDamping(200.0, at=(0, 1)), jfsm.Preload(1.0, at=(0, 1))])
    for name, model in (("linear", axis), ("Coulomb", axis + jfsm.Coulomb(10.0, at=(0, 1)))):
        begin = time.perf_counter()
        found = jfsm.fit(model, training)
        print(f"emps, {name}: {found.result}, {time.perf_counter() - begin:.0f} s")
        show(found)
        print(f"  0.5 s segments of the last 40 %: {1e6 * segments(found.structure, test, 500):.0f} um")
        run = jfsm.simulate(found.structure, record, solver="grid").displacement[:, 0]
        print(f"  one free run over all of it: {1e3 * rms(run - x[: run.size]):.2f} mm")


def segments(model: jfsm.Structure, record: jfsm.Record, length: int) -> float:
    """Error of free runs over segments of `length` samples, each from its best initial state."""
    errors = []
    for begin in range(0, len(record) - length + 1, length):
        piece = record[begin : begin + length]
        run = jfsm.simulate(model, piece, window=length, solver="grid").displacement[:, 0]
        errors.append(run - piece.channels["displacement", 1])
    return rms(np.concatenate(errors))


def main() -> None:
    parser = argparse.ArgumentParser(description="Values and free runs of two standards whose model is known.")
    parser.add_argument("rigs", nargs="*", default="all", choices=["all", "bouc_wen", "emps"])
    default = Path(os.environ.get("JFSM_DATA", Path(__file__).resolve().parents[2] / "shared" / "data"))
    parser.add_argument("--data", type=Path, default=default)
    given = parser.parse_args()
    every = {"bouc_wen": bouc_wen, "emps": emps}
    for name in every if "all" in given.rigs else given.rigs:
        every[name](given.data)


if __name__ == "__main__":
    main()
