"""Examines `jfsm.diagnose` on kinds of test that one driven mass does not reach, and counts how often it is right.

    python benchmarks/kinds.py --n 10 --seed 0 --jobs 1 --out kinds.jsonl [--kind base decay double_well long component]

base: one mass or a chain of two, shaken at its base. decay: two masses let go, no force measured, the structure known
up to one scale. double_well: a driven mass that crosses between two wells, believed to hang on a linear spring. long:
200 000 samples. component: imposed motions, as `benchmarks/component.py` makes them. Each row runs in a process of its
own, whose time and peak memory are stated, and is appended to the file as it is done; the same call goes on where it
was stopped.
"""

import argparse
import resource
import statistics
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.blind import attempted  # noqa: E402  (needs the line above when run as a script)
from benchmarks.blind_table import Row, Share, in_class, right_family, said  # noqa: E402
from benchmarks.chains import Chain, Drive, FloatArray, Law, Motion, move, nothing  # noqa: E402
from benchmarks.rows import DOUBLE_ON_CPU, ONE_CORE, in_processes, keep, kept  # noqa: E402
from tests.blind.drives import draw_harmonic, draw_noise, draw_sweep  # noqa: E402

HOLDOUT = 0.3
NOISE = (0.005, 0.01, 0.02)
SHARES = (0.1, 0.35)
"""Rms of the hidden force over that of its link's own, least and most,"""
LEAST_LEFT = 0.03
"""and at least so much that no other spring and dashpot at the link take up."""
FARTHEST = 5.0
"""How many times the linear motion's rms a motion may be."""
STUCK = 0.05
"""Share of it below which a law holds the mass."""
PILOT = 6000
"""Samples along which a law is brought to its size."""
LONG = 200_000
STRUCTURES = 5
"""Drawn for a seed, at most."""
SHAKEN = ("cubic_hardening", "coulomb", "quadratic_damping", "bouc_wen", "end_stop", "none")
LET_GO = ("cubic_hardening", "quintic_stiffness", "quadratic_damping", "coulomb", "none")
LASTING = ("cubic_hardening", "coulomb", "bouc_wen", "none")


class DrawAgainError(ArithmeticError):
    """What was drawn is no fair question."""


@dataclass(frozen=True)
class Case:
    """What the library is given, and the truth that it is not."""

    channels: dict[str, Any]
    """Arguments of the record."""
    model: Any
    """Arguments of the believed chain, or a structure."""
    cause: str
    at: tuple
    more: Row


def base(seed: int, rng: np.random.Generator) -> Case:
    """A structure shaken at its base; accelerations are absolute, and displacements in a third relative to it."""
    chain = drawn_chain(rng, 1 + seed % 2)
    time = clock(chain, 4000)
    shake = (draw_sweep, draw_noise)[seed // 2 % 2](rng, chain.modes[-1] / (1, 1.5)[seed % 2], time[-1])
    still = np.zeros(chain.mass.size)
    law, motion = hidden(rng, one_of(SHAKEN, seed), chain, time, (still, still), base=shake)
    shown = {"base_acceleration": shake(time), "acceleration": motion.a + shake(time)[:, None]}
    if seed % 3 == 1:
        shown["displacement"] = motion.x
    return case(rng, chain, law, motion, time, shown, {"at_rest": True}, kind_of_drive=type(shake).__name__)


def decay(seed: int, rng: np.random.Generator) -> Case:
    """Two masses let go, no force measured; accelerations or displacements of both."""
    chain = drawn_chain(rng, 2)
    time = clock(chain, 3000)
    start = rng.uniform(0.5, 1.0, 2) * rng.choice((-1.0, 1.0), 2)
    law, motion = hidden(rng, one_of(LET_GO, seed), chain, time, (start, np.zeros(2)))
    shown = {"acceleration": motion.a} if seed % 2 else {"displacement": motion.x}
    return case(rng, chain, law, motion, time, shown, {})


def double_well(seed: int, rng: np.random.Generator) -> Case:
    """A mass that a force drives across the hill between two wells; its owner believes in the spring of one well."""
    mass, slope, curvature = 1.0, rng.uniform(1.0, 20.0), rng.uniform(0.5, 2.0)
    omega, well = float(np.sqrt(2 * slope / mass)), float(np.sqrt(slope / curvature))
    damping = rng.uniform(0.08, 0.25) * mass * omega
    time = np.arange(4000) * 2 * np.pi / omega / 30
    believed = Chain(np.array([mass]), np.array([2 * slope]), np.array([damping]))
    law = Law("double_well", 0, {"k_neg": 3 * slope, "k3": curvature})
    for _ in range(50):
        draw = (draw_harmonic, draw_noise)[seed % 2]
        drive = draw(rng, omega, time[-1])
        drive = drive.scaled(rng.uniform(0.2, 0.5) * slope * well / float(np.std(drive(time))))
        motion = move(believed, law, time, (np.array([well]), np.zeros(1)), drive, size=well)
        crossings = int(np.sum(np.diff(np.sign(motion.x[:, 0])) != 0))
        if crossings >= 12:
            break
    else:
        raise DrawAgainError("the mass stays in its well")
    response = ("displacement", "acceleration", "velocity")[seed % 3]
    shown = {"force": drive(time), response: {"displacement": motion.x, "velocity": motion.v}.get(response, motion.a)}
    return case(rng, believed, law, motion, time, shown, {}, crossings=crossings)


def long(seed: int, rng: np.random.Generator) -> Case:
    """One mass under a force, 200 000 samples of one response."""
    chain = drawn_chain(rng, 1)
    time = clock(chain, LONG)
    drive = draw_noise(rng, chain.modes[0], time[-1])
    still = np.zeros(1)
    law, motion = hidden(rng, one_of(LASTING, seed), chain, time, (still, still), drive)
    shown = {"force": drive(time)} | ({"acceleration": motion.a} if seed % 2 else {"displacement": motion.x})
    return case(rng, chain, law, motion, time, shown, {"at_rest": True})


def component(seed: int, rng: np.random.Generator) -> Case:
    """An imposed motion, and the force that answers it."""
    import jfsm
    from benchmarks import component as made  # needs the library

    law, kind = str(rng.choice(made.EVERY)), str(rng.choice(["tones", "steps", "sweep"]))
    noise, velocity = float(rng.choice(NOISE)), bool(rng.integers(2))
    off = 1 + rng.uniform(-1, 1, 2) * (0.03, 0.1)
    terms = [jfsm.LinearStiffness(made.K * off[0], at=(0, 1)), jfsm.LinearDamping(made.C * off[1], at=(0, 1))]
    record = made.record_of(law, kind, noise, velocity, seed)
    cause = {"nothing": "none", "value": "damping_value"}.get(law, law)
    at = ("force", 1) if law == "force_delay" else (0, 1)
    return Case({"record": record}, jfsm.Structure([0.0], terms), cause, at, {"noise": noise, "motion": kind})


KINDS: dict[str, Callable[[int, np.random.Generator], Case]] = {
    "base": base,
    "decay": decay,
    "double_well": double_well,
    "long": long,
    "component": component,
}


def one_of(causes: Sequence[str], seed: int) -> str:
    """The cause of a seed; as many seeds as there are causes have each of them once."""
    turn, place = divmod(seed, len(causes))
    return str(np.random.default_rng((turn, len(causes))).permutation(causes)[place])


def drawn_chain(rng: np.random.Generator, dof: int) -> Chain:
    """Masses and springs of about the same size, lightly damped."""
    mass = rng.uniform(0.5, 2.0, dof)
    stiffness = mass * rng.uniform(60.0, 200.0, dof)
    return Chain(mass, stiffness, 2 * rng.uniform(0.005, 0.02, dof) * np.sqrt(stiffness * mass))


def clock(chain: Chain, samples: int) -> FloatArray:
    """Time with twenty samples in a period of the fastest mode."""
    return np.arange(samples) * 2 * np.pi / chain.modes[-1] / 20


def hidden(
    rng: np.random.Generator, cause: str, chain: Chain, time: FloatArray, start: tuple, force: Drive = nothing,
    base: Drive = nothing,
) -> tuple[Law, Motion]:  # fmt: skip
    """The cause at one of the links, of a drawn share of that link's force, and the motion with it."""
    pilot = time[:PILOT]
    plain = move(chain, Law("none", 0, {}), pilot, start, force, base, 0.1)
    scale = float(np.std(plain.x))
    if cause == "none":
        return Law(cause, 0, {}), move(chain, Law(cause, 0, {}), time, start, force, base, scale)
    for _ in range(40):
        law = drawn_law(rng, cause, int(rng.integers(chain.mass.size)), chain, plain)
        wanted = float(np.exp(rng.uniform(*np.log(SHARES))))
        try:
            for _ in range(5):
                motion = move(chain, law, pilot, start, force, base, scale)
                if np.std(motion.x) > FARTHEST * scale:
                    raise DrawAgainError("the motion grows")
                if np.std(motion.x) < STUCK * scale:
                    law = law.scaled(0.3)
                    continue
                found, left = shares(chain, law.link, motion)
                if abs(np.log(found / wanted)) < 0.3 and left > LEAST_LEFT:
                    return law, move(chain, law, time, start, force, base, scale)
                law = law.scaled(float(np.clip((wanted / found) ** 0.8, 0.3, 3.0)))
        except DrawAgainError:
            continue
    raise DrawAgainError(f"no fair {cause}")


def drawn_law(rng: np.random.Generator, cause: str, link: int, chain: Chain, plain: Motion) -> Law:
    """A law of any size that is natural to the motion without it."""
    d, w = (y @ chain.links[link] for y in (plain.x, plain.v))
    k = float(chain.stiffness[link])
    extent, speed = float(np.std(d)), float(np.std(w))
    slip = rng.uniform(0.3, 0.8) * extent
    numbers = {
        "cubic_hardening": {"k3": 0.1 * k / extent**2},
        "quintic_stiffness": {"k5": 0.03 * k / extent**4},
        "quadratic_damping": {"c2": 0.2 * k * extent / speed**2},
        "coulomb": {"F": 0.1 * k * extent},
        "bouc_wen": {"k": 0.4 * k, "beta": 0.6 / slip, "gamma": 0.4 / slip},
        "end_stop": {"k": 0.5 * k, "gap": rng.uniform(0.7, 1.2) * extent},
    }
    return Law(cause, link, numbers[cause])


def shares(chain: Chain, link: int, motion: Motion) -> tuple[float, float]:
    """Rms of the hidden force over that of the link's own, and of what no other spring and dashpot there take up."""
    d, w = (y @ chain.links[link] for y in (motion.x, motion.v))
    own = np.std(chain.stiffness[link] * d + chain.damping[link] * w)
    columns = np.stack([d / np.std(d), w / np.std(w)], 1)
    left = motion.effect - columns @ np.linalg.lstsq(columns, motion.effect, rcond=None)[0]
    return float(np.std(motion.effect) / own), float(np.std(left) / own)


def case(
    rng: np.random.Generator, chain: Chain, law: Law, motion: Motion, time: FloatArray, shown: dict[str, FloatArray],
    options: dict[str, Any], **more: Any,
) -> Case:  # fmt: skip
    """Noise on every channel, and a belief that is some per cent off."""
    noise = float(rng.choice(NOISE))
    noisy = {n: y + noise * np.std(y, 0) * rng.standard_normal(y.shape) for n, y in shown.items()}
    model = {
        "mass": chain.mass,
        "stiffness": chain.stiffness * (1 + rng.uniform(-0.03, 0.03, chain.mass.size)),
        "damping": chain.damping * (1 + rng.uniform(-0.15, 0.15, chain.mass.size)),
    }
    share, left = shares(chain, law.link, motion)
    more |= {"noise": noise, "channels": list(shown), "dof": chain.mass.size, "share": share, "left": left}
    at = () if law.cause == "none" else (law.link, law.link + 1)
    return Case({"time": time, **noisy, **options}, model, law.cause, at, more | {"parameters": law.parameters})


def drawn(kind: str, seed: int) -> Case:
    """The case of a seed: the same at every call; another structure where no fair effect is found for one."""
    rng = np.random.default_rng((seed, *kind.encode()))
    for _ in range(STRUCTURES):
        try:
            return KINDS[kind](seed, rng)
        except DrawAgainError:
            continue
    raise DrawAgainError(f"no fair {kind} from seed {seed}")


def examine(kind: str, seed: int) -> Row:
    """The case of a seed put to the library, as one row; an exception becomes the row's "error"."""
    import jax  # only in the workers, whose environment is settled before it is loaded

    import jfsm

    one = drawn(kind, seed)
    record = one.channels["record"] if "record" in one.channels else jfsm.Record(**one.channels)
    model = jfsm.Structure.chain(**one.model) if isinstance(one.model, dict) else one.model
    row = {"kind": kind, "seed": seed, "cause": one.cause, "at": list(one.at), "samples": len(record), **one.more}
    begin = time.process_time()
    row |= attempted(lambda: jfsm.diagnose(record, model, holdout=HOLDOUT, key=jax.random.key(seed)))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024  # KiB on Linux
    return row | {"cpu_seconds": time.process_time() - begin, "megabytes": peak}


def right(row: Row) -> bool:
    """Whether the one cause is named at its place; where none is hidden, whether nothing but values is called wrong.

    The believed values are some per cent off in all of them.
    """
    if row["cause"] == "none":
        return row["verdict"] in ("consistent", "parameters")
    first = row["findings"][:1]
    verdict = "parameters" if row["cause"].endswith("_value") else "cause"
    named = [(f["cause"], list(f["at"])) for f in (row["findings"] if verdict == "parameters" else first)]
    return row["verdict"] == verdict and (row["cause"], row["at"]) in named


def line(row: Row) -> str:
    """One line for one row."""
    first = row["findings"][0] if row["findings"] else None
    place = "-".join(str(part) for part in row["at"])
    told = f"{said(row)}" + (f" {'-'.join(str(p) for p in first['at'])} p={first['probability']:.2f}" if first else "")
    rivals = ", ".join(f"{r['cause']} {r['probability']:.2f}" for r in first["rivals"][:3]) if first else ""
    return (
        f"{'ok   ' if right(row) else 'WRONG'} {row['kind']:11s} {row['seed']:4d} {row['cause']} {place} -> {told}  "
        f"{row['seconds']:.0f} s (cores {row['cpu_seconds']:.0f} s) {row['megabytes']:.0f} MB  "
        f"{rivals}{row['error'] or ''}"
    )


def table(rows: Sequence[Row]) -> str:
    """Counts of each kind with Wilson's intervals, and all rows that are not right."""
    out = []
    for kind in dict.fromkeys(row["kind"] for row in rows):
        mine = [row for row in rows if row["kind"] == kind]
        caused = [row for row in mine if row["cause"] != "none"]
        out += [
            f"{kind}",
            f"  right                  {Share.of(mine, right)}",
            f"  cause first or a rival {Share.of(caused, in_class)}",
            f"  family named           {Share.of(caused, right_family)}",
            f"  seconds                median {statistics.median(row['seconds'] for row in mine):.0f}, "
            f"most {max(row['seconds'] for row in mine):.0f}",
            f"  seconds of all cores   median {statistics.median(row['cpu_seconds'] for row in mine):.0f}",
            f"  megabytes at most      {max(row['megabytes'] for row in mine):.0f}",
        ]
    wrong = [line(row) for row in rows if not right(row)]
    return "\n".join(out + (["not right", *(f"  {one}" for one in wrong)] if wrong else []))


def answers(wanted: Sequence[tuple[str, int]], jobs: int) -> Iterator[Row]:
    """Rows as they are done, each from a process of its own, whose memory is that of one diagnosis."""
    return in_processes(examine, wanted, jobs, 1, ONE_CORE if jobs > 1 else DOUBLE_ON_CPU)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description="Examines jfsm.diagnose on kinds of test beyond one driven mass.")
    parser.add_argument("--kind", nargs="+", default=list(KINDS), choices=list(KINDS))
    parser.add_argument("--n", type=int, default=10, help="cases of each kind")
    parser.add_argument("--seed", type=int, default=0, help="the first seed; the others follow it")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--out", type=Path, help="file of JSON lines to append to and to resume from")
    given = parser.parse_args(arguments)
    wanted = [(kind, seed) for kind in given.kind for seed in range(given.seed, given.seed + given.n)]
    rows = [row for row in kept(given.out) if (row["kind"], row["seed"]) in wanted]
    done = {(row["kind"], row["seed"]) for row in rows}
    try:
        for row in answers([one for one in wanted if one not in done], given.jobs):
            rows.append(row)
            keep(row, given.out)
            print(line(row), flush=True)
    except KeyboardInterrupt:
        print("stopped; what is done is counted below" + (" and kept" if given.out else ""))
    if rows:
        print("\n" + table(sorted(rows, key=lambda row: (list(KINDS).index(row["kind"]), row["seed"]))))


if __name__ == "__main__":
    main()
