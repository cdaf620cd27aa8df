"""Does the test that jfsm advises tell the rivals apart? It is done on the plant, by an integrator of its own.

    python benchmarks/advice.py [--n 20] [--seed 0] [--noise 0.02 0.05 0.1] [--out FILE]

Driven challenges of the blind examination are drawn from causes that look alike, short and with much noise, and
diagnosed. Where two causes, one of them the truth, are within 3 nats of each other, the plant is put to the advised
test, with the noise that it had before; the record of that test alone then speaks for the truth by so many nats. A
rival that holds the truth as a special case is counted apart: no test can bring more against it than that it has one
number too many. A line of JSON per challenge goes to `--out`, and the same call goes on where it was stopped.
"""

import argparse
import dataclasses
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jax
import numpy as np
from scipy.interpolate import CubicSpline

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
jax.config.update("jax_enable_x64", True)

import jfsm  # noqa: E402  (after double precision is on)
from benchmarks.blind import diagnosed  # noqa: E402
from benchmarks.blind_table import Share  # noqa: E402
from benchmarks.rows import Row, keep, kept  # noqa: E402
from jfsm.diagnosis.advice.next_test import Proposal, separation  # noqa: E402
from tests.blind import Challenge, draw, soiled  # noqa: E402
from tests.blind.arrays import rms  # noqa: E402
from tests.blind.challenge import true_channels, trusted_motion  # noqa: E402
from tests.blind.drives import DRIVES  # noqa: E402
from tests.blind.laws import Law  # noqa: E402
from tests.blind.plants import EscapeError  # noqa: E402

ALIKE = (
    "sine_stiffness", "square_stiffness", "cubic_hardening", "cubic_softening", "quintic_stiffness", "dead_zone",
    "end_stop", "saturation", "double_well", "power_damping", "van_der_pol", "coulomb_asymmetric", "smooth_coulomb",
    "stribeck", "bouc_wen", "jenkins", "free_play", "maxwell",
)  # fmt: skip
DRIVEN = tuple(name for name in DRIVES if name != "free_decay")
CLOSE, APART = 3.0, 10.0
"""Difference of log-evidences [nats] of rivals, and that at which they are told apart."""


@dataclasses.dataclass(frozen=True)
class Played:
    """A sampled force as a shaker plays it."""

    spline: CubicSpline

    def __call__(self, t: Any) -> Any:
        return self.spline(t)

    def scaled(self, factor: float) -> "Played":
        return Played(CubicSpline(self.spline.x, factor * self.spline(self.spline.x)))


def examine(seed: int, noise: Sequence[float]) -> Row:
    """The challenge of a seed, its rivals, and what the advised test says of them."""
    challenge = soiled(draw(seed, causes=ALIKE, noise=noise, excitation=DRIVEN), "short")
    d = diagnosed(challenge, max_causes=1)
    row: Row = {"seed": seed, "cause": challenge.cause, "noise": challenge.noise, "excitation": challenge.excitation}
    if d.leading is None or challenge.cause not in {rival.name for rival in d.leading.rivals}:
        return row
    one, other = d.leading.rivals
    before = one.evidence - other.evidence
    if abs(before) > CLOSE:
        return row
    right = 1.0 if one.name == challenge.cause else -1.0
    row |= {"rivals": [one.name, other.name], "before": right * before}
    causes, wrong = jfsm.causes(), other.name if right > 0 else one.name
    if wrong in causes and causes[challenge.cause].effect in getattr(causes[wrong].effect, "contains", ()):
        return row
    advised = d.next_tests(key=jax.random.key(seed))
    if not advised:
        return row | {"advised": None, "expected": 0.0, "after": 0.0}
    row |= {"advised": advised[0].what, "expected": advised[0].nats, "reach": advised[0].reach}
    try:
        return row | {"after": right * separation(d.leading, done(challenge, advised[0]))}
    except EscapeError:
        return row | {"after": 0.0}


def done(challenge: Challenge, proposal: Proposal) -> jfsm.Record:
    """The advised test on the plant, with noise.

    Raises
    ------
    EscapeError
        If the plant cannot follow.
    """
    record = proposal.record
    grid = record.time - record.time[0]
    assert record.force is not None
    drive = Played(CubicSpline(grid, record.force[:, 0]))
    typical = rms(challenge.motion.x)
    start = challenge.law.start(0.0, 0.0, challenge.truth.stiffness)
    law = without_bounds(challenge.law)
    motion = trusted_motion(challenge.truth, law, drive, start, grid, typical, 1e3 * challenge.motion.peak)
    kinds = [kind for kind, _ in record.channels]
    rng, shown = np.random.default_rng(challenge.seed), dict[str, Any]()
    for kind, y in true_channels(drive, motion, kinds).items():  # a sensor is as noisy as it was, whatever it shows
        shown[kind] = y + challenge.noise * rms(challenge.clean.get(kind, y)) * rng.standard_normal(y.size)
    return jfsm.Record(grid, **shown, units=dict(record.units), at_rest=record.at_rest)


def without_bounds(law: Law) -> Law:
    """The law where it is no fair question to be drawn any more, as a test may lead there: no wall of the plant."""
    wide = type(type(law).__name__, (type(law),), {"reach": lambda self, stiffness: np.inf})
    return wide(**{field.name: getattr(law, field.name) for field in dataclasses.fields(law)})


def told(row: Row) -> str:
    if "after" in row:
        after = f"{row['advised']}: {row['expected']:.1f} nats expected, {row['after']:.1f} found"
    else:
        after = "one holds the other" if "rivals" in row else "no close rivals"
    rivals = f"{' or '.join(row['rivals'])}: " if "rivals" in row else ""
    return f"seed {row['seed']}: {row['cause']}, {row['excitation']}, noise {row['noise']:g}: {rivals}{after}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--n", type=int, default=20, help="records with close rivals")
    parser.add_argument("--seed", type=int, default=0, help="the first seed; the others follow it")
    parser.add_argument("--noise", type=float, nargs="+", default=[0.02, 0.05, 0.1])
    parser.add_argument("--out", type=Path, help="file of JSON lines to append to and to resume from")
    given = parser.parse_args()
    rows = {row["seed"]: row for row in kept(given.out)}
    seed, close = given.seed, []
    while len(close) < given.n:
        begun = time.perf_counter()
        if seed not in rows:
            rows[seed] = examine(seed, given.noise)
            keep(rows[seed], given.out)
            print(f"{told(rows[seed])}  {time.perf_counter() - begun:.0f} s", flush=True)
        close += [rows[seed]] if "after" in rows[seed] else []
        seed += 1
    for least in (APART, 0.0):
        ahead = Share.of(close, lambda row, least=least: row["after"] >= least)
        print(f"the truth ahead by {least:g} nats or more: {ahead}")


if __name__ == "__main__":
    main()
