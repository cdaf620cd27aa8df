"""Judges recorded evidence anew: which verdicts differ from those recorded, and on which number they turn.

    python benchmarks/replay.py DIR … [--sensitivity] [--checks] [--with NAME=VALUE …] [--without CHECK …]

`DIR` holds cards of `benchmarks/blind.py --cards` and `benchmarks/cards.py`. With `--sensitivity` every threshold is
moved by a fifth, down and up, and the verdicts that change are counted in a hundred: those that were right before and
those that are right then; with `--checks` every check is left out by itself, as if all passed it. A card that lacks
what another verdict asks is counted as not measured.
"""

import argparse
import contextlib
import dataclasses
import json
import sys
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple
from unittest import mock

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.blind_table import exact  # noqa: E402  (needs the line above when run as a script)
from jfsm.diagnosis.evidence.evidence import Evidence, NotMeasuredError  # noqa: E402
from jfsm.diagnosis.thresholds import THRESHOLDS, Thresholds  # noqa: E402
from jfsm.diagnosis.verdict import bench, confirmed  # noqa: E402
from jfsm.diagnosis.verdict import judge as protocol  # noqa: E402
from jfsm.diagnosis.verdict.checks import CHECKS, Check, checked  # noqa: E402
from jfsm.diagnosis.verdict.decision import Decision  # noqa: E402
from jfsm.diagnosis.verdict.judge import judge  # noqa: E402

MOVED = (0.8, 1.2)
SAME = 1e-12
"""Difference of a probability up to which it is the same."""


class Card(NamedTuple):
    """A recorded case."""

    name: str
    truth: Mapping[str, Any]
    findings: Sequence[Mapping[str, Any]]
    evidence: Evidence
    decision: Decision

    @classmethod
    def of(cls, path: Path) -> "Card":
        written = json.loads(path.read_text(encoding="utf-8"))
        evidence, decision = Evidence.of_plain(written["evidence"]), Decision.of_plain(written["decision"])
        return cls(written["name"], written["truth"], written["findings"], evidence, decision)


def cards_in(folders: Iterable[Path]) -> list[Card]:
    """The cards of all folders, by name."""
    return [Card.of(path) for folder in folders for path in sorted(folder.glob("*.json"))]


def judged(card: Card, limits: Thresholds) -> Decision | None:
    """The verdict on a card; None where it asks what was not measured."""
    try:
        return judge(card.evidence, limits)
    except NotMeasuredError:
        return None


def same(one: Decision, other: Decision) -> bool:
    """Whether two verdicts are the same, with the same winner, as probable."""
    apart = abs(one.probability(one.winner) - other.probability(other.winner))
    return (one.verdict, one.winner) == (other.verdict, other.winner) and apart <= SAME


def right(card: Card, decision: Decision) -> bool | None:
    """Whether a verdict is right; None where that is not known."""
    if "cause" not in card.truth:
        return None
    effects = [part.split("@")[0] for part in decision.winner.split("+")] if decision.verdict == "cause" else []
    findings = [{"cause": cause} for cause in effects]
    if decision.verdict == "parameters":  # which values are off is no part of the verdict
        findings = list(card.findings) if card.decision.verdict == "parameters" else [{"cause": card.truth["cause"]}]
    return exact({**card.truth, "verdict": decision.verdict, "findings": findings})


def flips(cards: Sequence[Card], limits: Thresholds) -> tuple[list[str], Counter]:
    """Cards whose verdict is another one with these thresholds, in words, and how many of each kind."""
    lines, counts = [], Counter()
    for card in cards:
        found, before = judged(card, limits), card.decision
        if found is None:
            counts["not measured"] += 1
            continue
        if (found.verdict, found.winner) == (before.verdict, before.winner):
            counts["less sure" if not same(found, before) else "same"] += 1
            continue
        was, now = right(card, before), right(card, found)
        kind = {(True, False): "lost", (False, True): "won"}.get((bool(was), bool(now)), "changed")
        counts[kind] += 1
        lines.append(f"{card.name}: {before.verdict} {before.winner} -> {found.verdict} {found.winner} ({kind})")
    return lines, counts


@contextlib.contextmanager
def without(names: Sequence[str]) -> Iterator[None]:
    """Verdicts in here pass these checks whatever was measured."""

    def passed(*row: Any) -> Check:
        done = checked(*row)
        return done._replace(passed=done.passed or done.name in names)

    with contextlib.ExitStack() as patched:
        for module in (bench, confirmed, protocol):
            patched.enter_context(mock.patch.object(module, "checked", passed))
        yield


def ablation(cards: Sequence[Card]) -> None:
    """For each check left out: the verdicts that change."""
    print(f"{'check':30s} flips/100  lost  won other not measured")
    for name in CHECKS:
        with without([name]):
            lines, counts = flips(cards, THRESHOLDS)
        print(f"{name:30s} {figures_of(counts, len(cards))}")
        for line in lines:
            print(f"    {line}")


def figures_of(counts: Mapping[str, int], cards: int) -> str:
    """Verdicts that change, in a hundred and by kind."""
    lost, won, other = (counts.get(kind, 0) for kind in ("lost", "won", "changed"))
    share = 100 * (lost + won + other) / max(cards, 1)
    return f"{share:9.1f} {lost:5d} {won:4d} {other:5d} {counts.get('not measured', 0):12d}"


def sensitivity(cards: Sequence[Card]) -> None:
    """For each threshold moved by a fifth: verdicts that change, of a hundred."""
    print(f"{'threshold':24s} times flips/100  lost  won other not measured")
    for field in dataclasses.fields(THRESHOLDS):
        for times in MOVED:
            limits = dataclasses.replace(THRESHOLDS, **{field.name: times * getattr(THRESHOLDS, field.name)})
            _, counts = flips(cards, limits)
            print(f"{field.name:24s} {times:5.1f} {figures_of(counts, len(cards))}")


def main() -> None:
    parser = argparse.ArgumentParser(description="Judges recorded evidence anew.")
    parser.add_argument("folders", nargs="+", type=Path, metavar="DIR")
    parser.add_argument("--sensitivity", action="store_true", help="move each threshold by a fifth")
    parser.add_argument("--checks", action="store_true", help="leave out each check by itself")
    parser.add_argument("--without", nargs="+", default=[], choices=list(CHECKS), metavar="CHECK")
    parser.add_argument("--with", dest="moved", nargs="+", default=[], metavar="NAME=VALUE", help="other thresholds")
    given = parser.parse_args()
    begin, cards = time.perf_counter(), cards_in(given.folders)
    moved = {name: float(value) for name, _, value in (each.partition("=") for each in given.moved)}
    with without(given.without):
        lines, counts = flips(cards, dataclasses.replace(THRESHOLDS, **moved))
    for line in lines:
        print(line)
    known = [found for card in cards if (found := right(card, card.decision)) is not None]
    print(f"{len(cards)} cards, {sum(known)} of {len(known)} right as recorded; {dict(counts)}")
    if given.sensitivity:
        sensitivity(cards)
    if given.checks:
        ablation(cards)
    print(f"{time.perf_counter() - begin:.1f} s")


if __name__ == "__main__":
    main()
