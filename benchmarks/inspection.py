"""Does `Record.inspect()` find sensor faults, blame the right channel, and know the noise?

    python benchmarks/inspection.py --n 100 --seed 1 [--out inspection.jsonl]

Plants are drawn by seed (`tests/blind`, NumPy and SciPy only) with nothing hidden, Coulomb friction, a cubic spring, an
end stop or quadratic damping, under five excitations in turn, and integrated twice as finely as they are sampled, so
that half a sample of delay is exact. Displacement, velocity, acceleration and force carry white noise of 0.1 to 2 %.
Each record is inspected as it is, then once with each fault, on a channel drawn at random:

- gain: 5 % too much or too little; offset: 5 % of the channel's rms; both on displacement, velocity or acceleration;
- late by half a sample, late by two samples, on the same;
- clipped: the largest 1 % of the samples; inverted; both on any channel, the force too.

A fault is found when a warning names its channel and the fault, and another channel is blamed when a warning names it.
An offset of a displacement leaves no trace in the other channels and may be a static load: there the figure counts,
by which it differs from that of the exact motion, within a fifth of the truth, although it is no warning. Then the
noise levels of `--n` records with 0.1 to 5 % on every channel are compared with the truth: found within 15 %, and the
truth within two standard errors.
"""

import argparse
import collections
import json
import re
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np  # noqa: E402  (needs the line above when run as a script)

from jfsm.records import Record  # noqa: E402
from jfsm.records._inspect import Inspection  # noqa: E402
from jfsm.records._level import level  # noqa: E402
from tests.blind import draw  # noqa: E402
from tests.blind.exact import integrate  # noqa: E402

CAUSES = ("none", "coulomb", "cubic_hardening", "end_stop", "quadratic_damping")
EXCITATIONS = ("multisine", "noise", "sweep", "harmonic", "free_decay")
MOTION = ("displacement", "velocity", "acceleration")
EVERY = (*MOTION, "force")
LATEST = 4  # half samples of the longest delay

FAULTS = {"gain": MOTION, "offset": MOTION, "half": MOTION, "two": MOTION, "clipped": EVERY, "inverted": EVERY}
WORDS = {
    "gain": "Reads .* than",
    "offset": "Offset of",
    "half": "Comes .* late",
    "two": "Comes .* late",
    "clipped": "clipped",
    "inverted": "Inverted|turn the sign",
}


class Truth(NamedTuple):
    """The exact motion of one plant; `fine` has two samples to each `step` [s], by kind, the force too."""

    cause: str
    excitation: str
    step: float
    fine: dict[str, np.ndarray]

    def channel(self, kind: str, late: int = 0) -> np.ndarray:
        """Samples of a channel that is late by so many half samples."""
        fine = self.fine[kind]
        return fine[LATEST - late : fine.size - late : 2]


def truth(seed: int, cause: str, excitation: str) -> Truth:
    """The motion of a plant drawn by seed."""
    c = draw(seed, causes=cause, noise=0.0, channels="xva", excitation=excitation)
    step = float(c.time[1])
    fine = np.linspace(0.0, step * (c.time.size - 1), 2 * c.time.size - 1)
    motion = integrate(c.truth, c.law, c.drive, c.start, fine, float(np.sqrt(np.mean(c.motion.x**2))))
    channels = {"displacement": motion.x, "velocity": motion.v, "acceleration": motion.acceleration}
    if excitation != "free_decay":
        channels["force"] = c.drive(fine)
    return Truth(cause, excitation, step, channels)


def measured(
    plant: Truth, rng: np.random.Generator, level: float, fault: str = "none", on: str = ""
) -> tuple[Record, dict[str, float]]:
    """A noisy record with a fault on one channel, and the standard deviation of the noise in each."""
    channels, noise = {}, {}
    for kind in plant.fine:
        y = plant.channel(kind)
        rms, sign = float(np.sqrt(np.mean(y**2))), float(rng.choice([-1.0, 1.0]))
        added = level * rms * rng.standard_normal(y.size)
        if kind == on:
            match fault:
                case "gain":
                    y = y * (1.0 + 0.05 * sign)
                case "offset":
                    y = y + 0.05 * rms * sign
                case "half" | "two":
                    y = plant.channel(kind, late=1 if fault == "half" else LATEST)
                case "inverted":
                    y = -y
        y = y + added
        if kind == on and fault == "clipped":
            y = np.clip(y, *(np.array([-1.0, 1.0]) * np.quantile(np.abs(y), 0.99)))
        channels[kind], noise[kind] = y, float(added.std())
    time_ = plant.step * np.arange(next(iter(channels.values())).size)
    return Record(time_, **channels), noise


def judged(inspection: Inspection, plant: Truth, fault: str, on: str) -> dict[str, bool]:
    """Whether the fault is found, whether another channel is blamed, and whether nothing is said at all."""
    warnings = [finding for finding in inspection.findings if finding.severity == "warning"]
    others = [finding for finding in warnings if finding.channel != f"{on} 1"]
    named = [finding for finding in inspection.findings if finding.channel == f"{on} 1"]
    if fault == "none":
        return {"false": bool(warnings)}
    if fault == "offset" and on == "displacement":
        shown = next(row.level for row in inspection.channels if row.channel == f"{on} 1")
        y, force = plant.channel(on), [plant.channel("force")] if "force" in plant.fine else []
        size, sound = 0.05 * float(np.sqrt(np.mean(y**2))), level(y, plant.step, force).offset
        said = any(re.search(WORDS[fault], finding.message) for finding in named)
        found = said and shown is not None and abs(abs(shown.offset - sound) - size) < 0.2 * size
    else:
        found = any(re.search(WORDS[fault], finding.message) for finding in named if finding.severity == "warning")
    return {"found": bool(found), "blamed": bool(others)}


def plants(n: int, seed: int) -> Iterator[Truth]:
    """The plants of the benchmark; causes and excitations in turn."""
    for i in range(n):
        yield truth(seed + i, CAUSES[i // len(EXCITATIONS) % len(CAUSES)], EXCITATIONS[i % len(EXCITATIONS)])


def examine(plant: Truth, seed: int) -> Iterator[dict[str, Any]]:
    """Rows of one plant: without fault, with each, and the noise levels."""
    common = {"seed": seed, "cause": plant.cause, "excitation": plant.excitation}
    for fault, places in {"none": ("",), **FAULTS}.items():
        rng = np.random.default_rng([seed, len(fault)])
        level = float(np.exp(rng.uniform(*np.log([0.001, 0.02]))))
        on = str(rng.choice([kind for kind in places if not kind or kind in plant.fine]))
        inspection = measured(plant, rng, level, fault, on)[0].inspect()
        warnings = [f"{f.channel}: {f.message}" for f in inspection.findings if f.severity == "warning"]
        row = {**common, "fault": fault, "on": on, "level": level, **judged(inspection, plant, fault, on)}
        yield {**row, "warnings": warnings}
    rng = np.random.default_rng([seed, 99])
    level = float(np.exp(rng.uniform(*np.log([0.001, 0.05]))))
    record, noise = measured(plant, rng, level)
    for channel in record.inspect().channels:
        kind = channel.channel.split()[0]
        assert channel.noise is not None and channel.noise_error is not None
        ratio = channel.noise / noise[kind]
        within = abs(channel.noise - noise[kind]) < 2.0 * channel.noise_error
        yield {**common, "fault": "noise", "on": kind, "level": level, "ratio": ratio, "covered": bool(within)}


def summary(rows: list[dict[str, Any]]) -> Iterator[str]:
    """The figures that count, line by line."""
    clean = [row["false"] for row in rows if row["fault"] == "none"]
    yield f"sound records with a warning: {np.mean(clean):.1%} of {len(clean)} (at most 2 %)"
    groups = {fault: (fault, FAULTS[fault]) for fault in FAULTS}
    groups["offset"] = ("offset", MOTION[1:])
    groups["offset of a displacement"] = ("offset", MOTION[:1])
    for title, (fault, places) in groups.items():
        mine = [row for row in rows if row["fault"] == fault and row["on"] in places]
        parts = collections.defaultdict(list)
        for row in mine:
            parts[row["excitation"]].append(row["found"])
        yield (
            f"{title}: found {np.mean([row['found'] for row in mine]):.0%} of {len(mine)} (at least 90 %), "
            f"another channel blamed {np.mean([row['blamed'] for row in mine]):.1%}; "
            + ", ".join(f"{name} {np.mean(found):.0%}" for name, found in parts.items())
        )
    noise = [row for row in rows if row["fault"] == "noise"]
    for kind in EVERY:
        mine = [row for row in noise if row["on"] == kind]
        rough = [row for row in mine if row["cause"] in ("coulomb", "end_stop")]
        within = [np.mean([abs(row["ratio"] - 1.0) < 0.15 for row in some]) for some in (mine, rough)]
        yield (
            f"noise of {kind:12} within 15 %: {within[0]:.0%} of {len(mine)} (at least 90 %), {within[1]:.0%} with "
            f"friction or stops; within two errors {np.mean([row['covered'] for row in mine]):.0%}"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--n", type=int, default=100, help="plants")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, help="write every row here, as JSON lines")
    options = parser.parse_args()
    begin, rows = time.perf_counter(), []
    for i, plant in enumerate(plants(options.n, options.seed)):
        rows.extend(examine(plant, options.seed + i))
    if options.out:
        options.out.write_text("".join(json.dumps(row) + "\n" for row in rows))
    for line in summary(rows):
        print(line)
    print(f"{len(rows)} inspections and noise levels in {time.perf_counter() - begin:.0f} s")


if __name__ == "__main__":
    main()
