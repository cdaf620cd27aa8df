"""What is silence worth? An effect of the size that jfsm says a record would have shown is put on the plant.

    python benchmarks/detectable.py [--n 40] [--seed 0] [--noise 0.001 0.01 0.02 0.05] [--out FILE]

Challenges of the blind examination that hide nothing are diagnosed. Of the causes whose smallest size `detectable`
states, the seed draws one; the same plant under the same drive is simulated with that effect at the stated size, and
at a third of it, by an integrator of its own, and diagnosed with new noise of the same level. At the stated size the
cause, or one of its family, should be named in four of five at least; at a third of it in three of ten at most. A line
of JSON per challenge goes to `--out`, and the same call goes on where it was stopped.
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

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
jax.config.update("jax_enable_x64", True)

import jfsm  # noqa: E402  (after double precision is on)
from benchmarks.blind import diagnosed  # noqa: E402
from benchmarks.blind_table import Share  # noqa: E402
from benchmarks.rows import Row, keep, kept  # noqa: E402
from tests.blind import Challenge, draw  # noqa: E402
from tests.blind.arrays import rms  # noqa: E402
from tests.blind.challenge import (  # noqa: E402
    FARTHEST,
    NOISE_LEVELS,
    can_tell,
    true_channels,
    trusted_motion,
    with_earlier,
)
from tests.blind.laws import LAWS, NoLaw  # noqa: E402
from tests.blind.plants import EscapeError  # noqa: E402
from tests.blind.sensors import SENSORS, Channels, with_noise  # noqa: E402

SIZES = {"stated": 1.0, "third": 1.0 / 3.0}
"""Sizes that are tried, in stated ones."""
TARGETS = {"stated": "80 % at least", "third": "30 % at most"}
SHAPES = frozenset("gap knot side v_s n beta gamma slip tau omega zeta phase x0 t_ref t_star s".split())
"""Numbers of a law that do not grow with its size."""


def examine(seed: int, noise: Sequence[float]) -> Row:
    """The silent challenge of a seed, and what is said of it with an effect of the stated size and of a third of it."""
    challenge = draw(seed, causes="none", noise=noise)
    row: Row = {name: getattr(challenge, name) for name in ("seed", "noise", "channel_set", "excitation")}
    silent = diagnosed(challenge)
    row["verdict"] = silent.verdict
    known = {cause: said for cause, said in silent.data["detectable"].items() if cause in LAWS or cause in SENSORS}
    if silent.verdict not in ("consistent", "undecided") or not known:
        return row
    rng = np.random.default_rng([seed, 1])
    cause = sorted(known)[rng.integers(len(known))]
    row |= {"cause": cause, "family": jfsm.causes()[cause].family, "size": known[cause]}
    row["told"] = can_tell(cause, challenge.channel_set, challenge.excitation)
    for name, share in SIZES.items():
        try:
            clean, at_rest = affected(challenge, cause, known[cause], share)
        except EscapeError as escape:
            return row | {"escape": str(escape)}
        shown = dataclasses.replace(challenge, channels=with_noise(rng, clean, challenge.noise), at_rest=at_rest)
        row[name] = outcome(diagnosed(shown), cause)
    return row


def affected(challenge: Challenge, cause: str, said: dict[str, Any], share: float) -> tuple[Channels, bool]:
    """Channels of the plant with an effect of so many stated sizes, before noise, and whether it begins at rest.

    Raises
    ------
    EscapeError
        If the plant cannot follow.
    """
    plant, drive, start, time = challenge.truth, challenge.drive, challenge.start, challenge.time
    numbers = {name: number["value"] for name, number in said["effect"].items()}
    kinds = tuple(challenge.clean)
    if cause in SENSORS:
        [size] = numbers.values()
        kind: Any = SENSORS[cause][0]
        sensor = kind(said["at"][0], share * size)
        motion, earlier = with_earlier(sensor, plant, NoLaw(), drive, start, challenge.motion)
        clean = sensor.shown(true_channels(drive, motion, kinds), earlier)
        return clean, challenge.at_rest and not sensor.early
    law = LAWS[cause](**{name: value if name in SHAPES else share * value for name, value in numbers.items()})
    scale, limit = rms(challenge.motion.x), FARTHEST * challenge.motion.peak
    motion = trusted_motion(plant, law, drive, start, time, scale, limit)
    return true_channels(drive, motion, kinds), challenge.at_rest


def outcome(diagnosis: jfsm.Diagnosis, cause: str) -> Row:
    """Whether a diagnosis found the effect, and how near it came."""
    first = diagnosis.findings[0] if diagnosis.verdict == "cause" else None
    alike = () if first is None else (first.cause, *(rival.cause for rival in first.rivals))
    tried = [c for c in diagnosis.candidates if c.cause == cause]
    nearest = max(tried, key=lambda c: c.evidence, default=None)
    return {
        "verdict": diagnosis.verdict,
        "named": first and first.cause,
        "found": cause in alike or (first is not None and first.family == jfsm.causes()[cause].family),
        "candidate": nearest and {"nats": nearest.evidence, "kappa": nearest.kappa, "why": nearest.why},
        "best": [[c.cause, c.evidence, c.kappa, c.why] for c in diagnosis.candidates[:3]],
    }


def told(row: Row) -> str:
    """One row in a line."""
    setting = f"seed {row['seed']}: {row['channel_set']}, {row['excitation']}, noise {row['noise']:g}"
    if "cause" not in row:
        return f"{setting}: {row['verdict']}"
    size = row["size"]
    effect = f"{row['cause']} from {size['parameter']} = {size['value']:.3g} {size['unit']}"
    if "escape" in row:
        return f"{setting}: {effect}: {row['escape']}"
    said = (f"{name}: {row[name]['named'] or row[name]['verdict']} {'found' * row[name]['found']}" for name in SIZES)
    return f"{setting}: {effect}: {', '.join(said)}"


def summary(rows: Sequence[Row]) -> str:
    """Shares that were found, of all and of each family, beside what they should be."""
    lines = []
    silent = Share.of(rows, lambda row: row["verdict"] in ("consistent", "undecided"))
    lines.append(f"silent where nothing was hidden: {silent}")
    tried = [row for row in rows if "stated" in row and "third" in row]
    families = sorted({row["family"] for row in tried})
    for name, target in TARGETS.items():

        def found(row: Row, name: str = name) -> bool:
            return row[name]["found"]

        lines.append(f"{name}: found {Share.of(tried, found)}; wanted {target}")
        lines.append(f"  where the generator vouches for the cause: {Share.of((r for r in tried if r['told']), found)}")
        lines.append(f"  no silence: {Share.of(tried, lambda row, name=name: row[name]['verdict'] != 'consistent')}")
        lines += [f"  {one}: {Share.of((r for r in tried if r['family'] == one), found)}" for one in families]
    escaped = [row for row in rows if "escape" in row]
    return "\n".join([*lines, f"the plant could not follow: {len(escaped)}"])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--n", type=int, default=40, help="records with nothing hidden")
    parser.add_argument("--seed", type=int, default=0, help="the first seed; the others follow it")
    parser.add_argument("--noise", type=float, nargs="+", default=list(NOISE_LEVELS))
    parser.add_argument("--out", type=Path, help="file of JSON lines to append to and to resume from")
    given = parser.parse_args()
    rows = {row["seed"]: row for row in kept(given.out)}
    wanted = range(given.seed, given.seed + given.n)
    for seed in wanted:
        if seed in rows:
            continue
        begun = time.perf_counter()
        rows[seed] = examine(seed, given.noise)
        keep(rows[seed], given.out)
        print(f"{told(rows[seed])}  {time.perf_counter() - begun:.0f} s", flush=True)
    print(summary([rows[seed] for seed in wanted]))


if __name__ == "__main__":
    main()
