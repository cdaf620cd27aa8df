"""The electronic Duffing oscillator of Schoukens: what a linear model lacks, and what naming it is worth.

    python benchmarks/silverbox.py [--data DIR] [--out table.json]

The model is a linear oscillator fitted by jfsm itself to one period of the 5 mV record of the second campaign. The
first 20 000 samples of the multisine record are diagnosed; the free run over its last 21 688 samples starts from the
first 50, and the error counts after them (T. Wigren, J. Schoukens, ECC 2013, 2933-2938).
"""

import argparse
import json
import os
import time
from pathlib import Path

import jax
import numpy as np
import scipy.io

jax.config.update("jax_enable_x64", True)

import jfsm  # noqa: E402  (after double precision is on)

PERIOD, PERIODS_SKIPPED = 8192, 5
TRAINING, TEST, WINDOW = 20_000, 21_688, 50
UNITS = {"force": "V", "displacement": "V"}


def low_level(data: Path) -> jfsm.Record:
    """One steady period of the 5 mV record."""
    um = scipy.io.loadmat(data / "silverbox_levels" / "SNJP_um_full_FNSI_5.mat")
    ym = scipy.io.loadmat(data / "silverbox_levels" / "SNJP_ym_full_FNSI_5.mat")
    take = slice(PERIODS_SKIPPED * PERIOD, (PERIODS_SKIPPED + 1) * PERIOD)
    u, y = um["um"].ravel()[take], ym["ym"].ravel()[take]
    return jfsm.Record(np.arange(PERIOD) / float(um["fs"].item()), u, y, units=UNITS)


def multisine(data: Path) -> jfsm.Record:
    """The whole multisine record."""
    return jfsm.read(
        data / "silverbox" / "silverbox_multisine.npz", force="u", displacement="y", units={"u": "V", "y": "V"}
    )


def first_guess(record: jfsm.Record) -> jfsm.Structure:
    """Unit stiffness, and a mass and damping from the largest frequency response."""
    assert record.force is not None and record.displacement is not None
    force, displacement = record.force[:, 0], record.displacement[:, 0]
    spectrum = np.abs(np.fft.rfft(force - force.mean()))
    excited = spectrum > 0.1 * spectrum.max()
    response = np.abs(np.fft.rfft(displacement - displacement.mean()))[excited] / spectrum[excited]
    omega = 2 * np.pi * np.fft.rfftfreq(len(record), record.dt)[excited][int(np.argmax(response))]
    return jfsm.Structure.sdof(mass=1 / omega**2, stiffness=1.0, damping=0.1 / omega)


def rms_mv(model: jfsm.Structure, test: jfsm.Record) -> float:
    """Root mean square error of the free run after the window [mV]."""
    response = jfsm.simulate(model, test, window=WINDOW)
    assert test.displacement is not None
    return 1e3 * float(np.sqrt(np.mean((response.displacement - test.displacement)[WINDOW:] ** 2)))


def main() -> None:
    """Run, print the table, write it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    default = os.environ.get("JFSM_DATA", str(Path(__file__).resolve().parents[2] / "shared" / "data"))
    parser.add_argument("--data", type=Path, default=Path(default), help="folder with silverbox and silverbox_levels")
    parser.add_argument("--out", type=Path, help="write the table as JSON")
    arguments = parser.parse_args()

    low, record = low_level(arguments.data), multisine(arguments.data)
    begun = time.perf_counter()
    linear = jfsm.fit(first_guess(low), low).structure
    fitted = time.perf_counter()
    training, test = record[:TRAINING], record[-TEST:]
    d = jfsm.diagnose(training, linear, holdout=test, key=jax.random.key(0))
    done = time.perf_counter()

    # With nothing to name, whatever is there has to be left to a map.
    unnamed = jfsm.diagnose(training, linear, holdout=test, causes=[], key=jax.random.key(0))
    assert unnamed.gain is not None
    rows = {
        "linear, from 5 mV": rms_mv(linear, test),
        "linear, refitted": 1e3 * unnamed.gain.channels["displacement 1"].refitted,
        "named terms": rms_mv(d.extended, test),
        "RKPM map": rms_mv(unnamed.extended, test),
    }
    print(f"verdict    {d.verdict}: " + ", ".join(f"{f.cause} at {f.at}, p = {f.probability:.3f}" for f in d.findings))
    for f in d.findings:
        for name, e in f.parameters.items():
            print(f"           {name} = {e.value:.5g} ({e.low:.5g} to {e.high:.5g}) {e.unit}")
    stiffness = d.extended.values()["stiffness@0-1.k"]
    print("           k3/k1 = " + ", ".join(f"{f.parameters['k3'].value / stiffness:.4g} 1/V^2" for f in d.findings))
    print("\nfree run over the last 21 688 samples, error after 50 [mV]")
    for name, value in rows.items():
        print(f"  {name:<20}{value:8.3f}")
    print(f"\nfit {fitted - begun:.1f} s, diagnosis {done - fitted:.1f} s, compilation included")
    if arguments.out:
        arguments.out.write_text(json.dumps({"rms_mv": rows, "verdict": d.verdict}, indent=1))


if __name__ == "__main__":
    main()
