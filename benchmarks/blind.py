"""Examines `jfsm.diagnose` on plants with hidden effects, and counts how often it is right.

    python benchmarks/blind.py --n 100 --seed 1 --jobs 2 --noise 0.001 0.01 --out results.jsonl

One line of JSON per challenge is appended to the file as it is done; the same call goes on where it was stopped. With
`--two`, two effects of different families are hidden at once; with `--outside`, one that no catalogue names; with
`--chain`, one at some place of two masses in a chain, where the place counts too; with `--dirt`, records are as a
laboratory has them: coloured noise, steps, outliers, drift, half a sample of delay. `--page` writes who was taken for
whom, calibration, gain and time as a page, and the figures as JSON beside it. `--cards` keeps what every verdict rests
on, which `benchmarks/replay.py` judges anew in seconds.
"""

import argparse
import dataclasses
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.blind_page import write_page  # noqa: E402  (needs the line above when run as a script)
from benchmarks.blind_table import Row, exact, hidden, said, spot, table  # noqa: E402
from benchmarks.cards import asking_widely, keep_card  # noqa: E402
from benchmarks.rows import ONE_CORE, in_processes, keep, kept  # noqa: E402
from tests.blind import (  # noqa: E402
    CAUSES,
    CHAIN_CAUSES,
    CHAIN_SETS,
    DIRT,
    OUTSIDE,
    PAIRS,
    ChainChallenge,
    Challenge,
    UnfairError,
    draw,
    draw_chain,
    draw_two,
    soiled,
)
from tests.blind.challenge import CHANNEL_SETS, NOISE_LEVELS  # noqa: E402
from tests.blind.dirt import TAKEN_FOR  # noqa: E402
from tests.blind.drives import DRIVES  # noqa: E402
from tests.blind.plants import Plant  # noqa: E402

HOLDOUT = 0.3
ROWS_PER_PROCESS = 15
"""After which a process makes room for a new one: the programs that it holds grow to gigabytes."""

Drawing = dict[str, Any]


def examine(seed: int, drawing: Drawing, cards: Path | None = None) -> Row:
    """The challenge of a seed put to the library, as one row; an exception becomes the row's "error".

    Of a seed that gives no fair challenge the row says that alone, as "unfair". What the verdict rests on is kept among
    the `cards`.
    """
    try:
        challenge = drawn(seed, drawing)
    except UnfairError as problem:
        return {"seed": seed, "unfair": str(problem)}
    truth = question(challenge)

    def asked() -> Any:
        if cards is None:
            return diagnosed(challenge)
        with asking_widely():
            found = diagnosed(challenge)
        keep_card(cards, f"{_kind(drawing)}-{seed}", found, truth)
        return found

    return truth | {"drawing": drawing} | attempted(asked)


def _kind(drawing: Drawing) -> str:
    """What is drawn, in a word."""
    if set(drawing["causes"]) <= set(OUTSIDE):
        return "outside"
    kinds = [name for name in ("two", "chain") if drawing.get(name)]
    return next(iter([*kinds, *filter(None, [drawing.get("dirt")])]), "single")


def attempted(diagnose: Callable[[], Any]) -> Row:
    """What a diagnosis says, and how long it took; one that fails must not end an examination, and says why."""
    begin = time.perf_counter()
    try:
        said_of_it = answer(diagnose())
    except Exception as problem:
        words = f"{type(problem).__name__}: {problem}"
        said_of_it = {"verdict": "failed", "findings": [], "closed": None, "error": words}
    return said_of_it | {"seconds": time.perf_counter() - begin}


def drawn(seed: int, drawing: Drawing) -> Challenge | ChainChallenge:
    """The challenge of a seed, of two masses with "chain" in the drawing.

    With "two" in it, of two of its causes, and with "dirt" soiled by it.
    """
    arguments = dict(drawing)
    if arguments.pop("chain", False):
        return draw_chain(seed, **arguments)
    dirt = arguments.pop("dirt", None)
    if dirt is not None:
        clean = drawn(seed, arguments)
        assert isinstance(clean, Challenge)
        return soiled(clean, dirt)
    if not arguments.pop("two", False):
        return draw(seed, **arguments)
    causes = set(arguments.pop("causes"))
    return draw_two(seed, **arguments, pairs=[pair for pair in PAIRS if causes.issuperset(pair)])


def question(challenge: Challenge | ChainChallenge) -> Row:
    """What was drawn, the truth included."""
    more: Row = {}
    if isinstance(challenge, ChainChallenge):
        links = [list(at) for at in challenge.truth.links]
        more |= {"chain": True, "links": links, "driven": challenge.driven, "seen": challenge.seen}
    elif challenge.beside:
        more["beside"] = dataclasses.asdict(challenge.beside)
    if challenge.cause in OUTSIDE:
        more["outside"] = True
    return {
        "seed": challenge.seed,
        "cause": challenge.cause,
        "at": list(challenge.at),
        "parameters": challenge.parameters,
        "noise": challenge.noise,
        "channel_set": challenge.channel_set,
        "excitation": challenge.excitation,
        "at_rest": challenge.at_rest,
        "share": challenge.share,
        "left": challenge.left,
        "damping_ratio": challenge.truth.damping_ratio,
    } | more


def answer(diagnosis: Any) -> Row:
    """What a diagnosis says, as plain types."""
    named = next((c for c in diagnosis.candidates if c.why == "named"), None)
    gain = diagnosis.gain
    return {
        "verdict": diagnosis.verdict,
        "named": named and {name: getattr(named, name) for name in ("kappa", "left", "whiteness", "unfit")},
        "interval": gain and list(gain.interval),
        "findings": [
            {
                "cause": finding.cause,
                "at": list(finding.at),
                "probability": float(finding.probability),
                "parameters": {
                    name: {"value": float(e.value), "low": float(e.low), "high": float(e.high)}
                    for name, e in finding.parameters.items()
                },
                "rivals": [
                    {"cause": rival.cause, "at": list(rival.at), "probability": float(rival.probability)}
                    for rival in finding.rivals
                ],
            }
            for finding in diagnosis.findings
        ],
        "closed": None if gain is None or not gain.closable else float(gain.closed),
        "error": None,
    }


def diagnosed(challenge: Challenge | ChainChallenge, **how: Any) -> Any:
    """What is said of a challenge to the owner of its model; `how` it is asked goes to `diagnose`."""
    import jax  # only in the workers, whose environment is settled before it is loaded

    import jfsm

    channels: dict[str, Any] = {**challenge.channels, "units": challenge.units}
    record = jfsm.Record(time=challenge.time, **channels, at_rest=challenge.at_rest)
    believed = challenge.model
    if isinstance(believed, Plant):
        model = jfsm.Structure.sdof(mass=believed.mass, stiffness=believed.stiffness, damping=believed.damping)
    else:
        springs = [jfsm.LinearStiffness(k, at=at) for at, k in believed.stiffness.items()]
        dashpots = [jfsm.LinearDamping(c, at=at) for at, c in believed.damping.items()]
        model = jfsm.Structure(mass=list(believed.mass), terms=[*springs, *dashpots])
    return jfsm.diagnose(record, model, holdout=HOLDOUT, key=jax.random.key(challenge.seed), **how)


def earlier_rows(path: Path, drawing: Drawing) -> list[Row]:
    """Rows that an earlier call left in the file; none if there is no file.

    Raises
    ------
    ValueError
        If the file holds rows that were drawn in another way.
    """
    rows = kept(path)
    for row in rows:
        if row["drawing"] != drawing:
            raise ValueError(
                f"`--out` must name a new file or one of the same drawing; {path} was drawn with {row['drawing']}, "
                f"this call draws with {drawing}. Give another file, or repeat the earlier arguments."
            )
    return rows


def answers(seeds: Sequence[int], drawing: Drawing, jobs: int, cards: Path | None = None) -> Iterator[Row]:
    """Rows of these seeds as they are done, from `jobs` processes of one core each."""
    return in_processes(examine, [(seed, drawing, cards) for seed in seeds], jobs, ROWS_PER_PROCESS, ONE_CORE)


def progress_line(row: Row, done: int, total: int, elapsed: float) -> str:
    """One line for one row: which, the truth, what was said, and the time left."""
    findings = row["findings"] if "beside" in row else row["findings"][:1]
    mark = "ok   " if exact(row) else "WRONG"
    truth, answer = (
        f"{words} {place}".rstrip() for words, place in zip((hidden(row), said(row)), spot(row), strict=True)
    )
    sure = " p=" + " ".join(f"{finding['probability']:.2f}" for finding in findings) if findings else ""
    left = elapsed / done * (total - done)
    return (
        f"[{done:{len(str(total))}d}/{total}] {mark} seed {row['seed']}: {truth} -> {answer}{sure}"
        f"  {row['seconds']:.1f} s, {left / 60:.1f} min left"
    )


def run(
    seeds: Sequence[int],
    drawing: Drawing,
    jobs: int,
    out: Path | None,
    say: Callable[[str], None],
    cards: Path | None = None,
) -> list[Row]:
    """Rows of all seeds: those in the file already, and the others as examined now and appended to it."""
    rows = [row for row in earlier_rows(out, drawing) if row["seed"] in seeds] if out else []
    missing = sorted(set(seeds) - {row["seed"] for row in rows})
    if rows:
        say(f"{len(rows)} done before, {len(missing)} to do")
    begin = time.perf_counter()
    try:
        for done, row in enumerate(answers(missing, drawing, jobs, cards) if missing else (), start=1):
            if "unfair" in row:
                say(f"seed {row['seed']} is left out: {row['unfair']}")
                continue
            rows.append(row)
            keep(row, out)
            say(progress_line(row, done, len(missing), time.perf_counter() - begin))
    except KeyboardInterrupt:
        say("stopped; what is done is counted below" + (" and kept" if out else ""))
    return rows


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description="Examines jfsm.diagnose on plants with hidden effects.")
    parser.add_argument("--n", type=int, default=20, help="challenges")
    parser.add_argument("--seed", type=int, default=0, help="the first seed; the others follow it")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--noise", type=float, nargs="+", default=list(NOISE_LEVELS), help="shares of a channel's rms")
    parser.add_argument(
        "--causes", nargs="+", default=list(CAUSES), choices=CAUSES, metavar="ID", help="any of the catalogue"
    )
    parser.add_argument("--two", action="store_true", help="hide two of the causes at once")
    parser.add_argument("--outside", action="store_true", help="hide effects that are not in the catalogue instead")
    parser.add_argument("--chain", action="store_true", help="hide them at some place of two masses in a chain")
    parser.add_argument("--dirt", choices=list(DIRT), help="what comes on the records besides white noise")
    parser.add_argument("--channels", nargs="+", choices=list(CHANNEL_SETS | CHAIN_SETS), help="all by default")
    parser.add_argument("--excitation", nargs="+", default=list(DRIVES), choices=list(DRIVES))
    parser.add_argument("--out", type=Path, help="file of JSON lines to append to and to resume from")
    parser.add_argument("--cards", type=Path, help="folder for what verdicts rest on, for benchmarks/replay.py")
    parser.add_argument("--page", type=Path, help="HTML file for pictures and figures; the figures as JSON beside it")
    given = parser.parse_args(arguments)
    if given.page and given.page.suffix != ".html":
        parser.error(f"--page must name an .html file; got {given.page}.")
    if given.chain and (given.two or given.outside or given.dirt):
        parser.error("--chain must stand without --two, --outside and --dirt.")
    sets = list(CHAIN_SETS if given.chain else CHANNEL_SETS)
    if not set(given.channels or sets) <= set(sets):
        parser.error(f"--channels must be of {', '.join(sets)}; got {' '.join(given.channels)}.")
    given.channels = given.channels or sets
    drawing = {name: getattr(given, name) for name in ("causes", "noise", "channels", "excitation")}
    if given.outside:
        drawing["causes"] = list(OUTSIDE)
    if given.chain:
        drawing["chain"] = True
        drawing["causes"] = [cause for cause in drawing["causes"] if cause in CHAIN_CAUSES]
    if given.two:  # not said otherwise, so that files of one effect can be gone on with
        drawing["two"] = True
    if given.dirt:
        drawing["dirt"] = given.dirt
        drawing["causes"] = [cause for cause in drawing["causes"] if cause not in TAKEN_FOR.get(given.dirt, ())]
    seeds = range(given.seed, given.seed + given.n)
    rows = run(seeds, drawing, given.jobs, given.out, lambda s: print(s, flush=True), given.cards)
    rows = sorted(rows, key=lambda row: row["seed"])
    if rows:
        print("\n" + table(rows))
    if rows and given.page:
        write_page(rows, given.page)


if __name__ == "__main__":
    main()
