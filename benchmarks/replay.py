"""Judges recorded evidence anew: which verdicts differ from those before, and on which number they turn.

    python benchmarks/replay.py PATH … [--where TEXT] [--with NAME=VALUE …] [--without CHECK …]
    python benchmarks/replay.py PATH … --record before.json; edit the code; the same with --against before.json
    python benchmarks/replay.py PATH … --sensitivity --checks --calibration

A `PATH` is a folder of cards (of `benchmarks/blind.py --cards`, `benchmarks/cards.py`), a card, or what
`jfsm diagnose --json` wrote, of which no truth is known. Verdicts are compared with those that were recorded; after
`--record`, with those of the code before a change. With `--sensitivity` every threshold is moved by a fifth, down and
up, and the verdicts that change are counted in a hundred: those that were right before and those that are right then;
with `--checks` every check is left out by itself, as if all passed it. With `--calibration` laws and classes that were
named are counted by the probability that they were given, and how many were right. A card that lacks what another
verdict asks is named as not measured, one that this version cannot read is named and left out.
"""

import argparse
import contextlib
import dataclasses
import itertools
import json
import sys
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple
from unittest import mock

import jax

jax.config.update("jax_enable_x64", True)

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import jfsm  # noqa: E402  (needs the line above when run as a script)
from benchmarks.blind_table import exact  # noqa: E402
from jfsm.diagnosis.evidence.evidence import Evidence, NotMeasuredError  # noqa: E402
from jfsm.diagnosis.evidence.scorecard import Scorecard  # noqa: E402
from jfsm.diagnosis.hypotheses.law_classes import SENSOR, classes_of  # noqa: E402
from jfsm.diagnosis.thresholds import THRESHOLDS, Thresholds  # noqa: E402
from jfsm.diagnosis.verdict import bench, confirmed  # noqa: E402
from jfsm.diagnosis.verdict import judge as protocol  # noqa: E402
from jfsm.diagnosis.verdict.checks import CHECKS, Check, checked  # noqa: E402
from jfsm.diagnosis.verdict.claims import narrowest_sure  # noqa: E402
from jfsm.diagnosis.verdict.decision import Decision  # noqa: E402
from jfsm.diagnosis.verdict.judge import evidence_behind, judge  # noqa: E402

MOVED = (0.8, 1.2)
NOT_MEASURED = "not measured"
SAME = 1e-12
"""Difference of a probability up to which it is the same."""


class Card(NamedTuple):
    """A recorded case; `before` is the verdict that others are compared with, None where it was not measured."""

    path: Path
    name: str
    truth: Mapping[str, Any]
    findings: Sequence[Mapping[str, Any]]
    evidence: Evidence
    decision: Decision
    before: Decision | None

    @classmethod
    def of(cls, path: Path) -> "Card":
        """A card, or a diagnosis, whose truth is not known.

        Raises
        ------
        ValueError
            If it is neither, or of another version.
        """
        try:
            written = json.loads(path.read_text(encoding="utf-8"))
            evidence, decision = Evidence.of_plain(written["evidence"]), Decision.of_plain(written["decision"])
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise ValueError(f"{type(error).__name__}: {error}") from error
        name, truth = written.get("name") or path.stem, written.get("truth") or {}
        return cls(path, name, truth, written.get("findings") or (), evidence, decision, decision)

    def fits(self, text: str) -> bool:
        """Whether the name has this text in it, or it is `imposed` and the motion is."""
        return text in self.name or (text == "imposed" and self.evidence.setting.imposed)


def files_in(path: Path) -> list[Path]:
    """The cards of a folder, by name, or the one file.

    Raises
    ------
    ValueError
        If there is none.
    """
    found = [path] if path.is_file() else sorted(path.glob("*.json"))
    if not found:
        raise ValueError(
            f"{path} holds no cards (*.json); `benchmarks/blind.py --cards DIR` and `benchmarks/cards.py` record them"
        )
    return found


def cards_in(paths: Iterable[Path]) -> tuple[list[Card], list[str]]:
    """The cards of all folders and files, and in words those that cannot be read."""
    cards, unread = [], []
    for path in itertools.chain.from_iterable(map(files_in, paths)):
        try:
            cards.append(Card.of(path))
        except ValueError as error:
            unread.append(f"{path}: not read, it is of another version or no card ({error})")
    return cards, unread


def record(cards: Sequence[Card], limits: Thresholds, path: Path) -> None:
    """Keep the verdicts of the code as it is."""
    found = {str(card.path): judged(card, limits) for card in cards}
    path.write_text(json.dumps({at: one and one.plain for at, one in found.items()}, allow_nan=False), encoding="utf-8")


def against(cards: Sequence[Card], path: Path) -> tuple[list[Card], list[str]]:
    """The cards with the verdicts that were kept, and in words those of which none was."""
    kept = json.loads(path.read_text(encoding="utf-8"))
    plain = {at: written and Decision.of_plain(written) for at, written in kept.items()}
    known = [card._replace(before=plain[str(card.path)]) for card in cards if str(card.path) in plain]
    return known, [f"{card.path}: not in {path}" for card in cards if str(card.path) not in plain]


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
        found, before = judged(card, limits), card.before
        if found is None or before is None:
            counts[NOT_MEASURED] += 1
            lines.append(f"{card.name}: {NOT_MEASURED}")
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
            if not line.endswith(NOT_MEASURED):
                print(f"    {line}")


def figures_of(counts: Mapping[str, int], cards: int) -> str:
    """Verdicts that change, in a hundred and by kind."""
    lost, won, other = (counts.get(kind, 0) for kind in ("lost", "won", "changed"))
    share = 100 * (lost + won + other) / max(cards, 1)
    return f"{share:9.1f} {lost:5d} {won:4d} {other:5d} {counts.get(NOT_MEASURED, 0):12d}"


def sensitivity(cards: Sequence[Card]) -> None:
    """For each threshold moved by a fifth: verdicts that change, of a hundred."""
    print(f"{'threshold':24s} times flips/100  lost  won other not measured")
    for field in dataclasses.fields(THRESHOLDS):
        for times in MOVED:
            limits = dataclasses.replace(THRESHOLDS, **{field.name: times * getattr(THRESHOLDS, field.name)})
            _, counts = flips(cards, limits)
            print(f"{field.name:24s} {times:5.1f} {figures_of(counts, len(cards))}")


def arguments() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description="Judges recorded evidence anew.")
    parser.add_argument("paths", nargs="+", type=Path, metavar="PATH", help="folder of cards, a card, or a diagnosis")
    parser.add_argument("--where", default="", metavar="TEXT", help="cards with this in their name, or `imposed`")
    parser.add_argument("--sensitivity", action="store_true", help="move each threshold by a fifth")
    parser.add_argument("--checks", action="store_true", help="leave out each check by itself")
    parser.add_argument("--calibration", action="store_true", help="how often what was named is right")
    parser.add_argument("--without", nargs="+", default=[], choices=list(CHECKS), metavar="CHECK")
    parser.add_argument("--with", dest="moved", nargs="+", default=[], metavar="NAME=VALUE", help="other thresholds")
    parser.add_argument("--record", type=Path, metavar="FILE", help="keep the verdicts here, to compare later ones")
    parser.add_argument("--against", type=Path, metavar="FILE", help="compare with what --record kept")
    return parser


def chosen(given: argparse.Namespace) -> list[Card]:
    """The cards that are asked for; what is left out is said."""
    cards, left_out = cards_in(given.paths)
    cards = [card for card in cards if card.fits(given.where)]
    if given.against is not None:
        cards, unknown = against(cards, given.against)
        left_out += unknown
    for line in left_out:
        print(line)
    if left_out:
        print(f"{len(left_out)} left out")
    if not cards:
        raise ValueError(f"no card is left to judge{f' with {given.where!r} in its name' if given.where else ''}")
    return cards


def compare(cards: Sequence[Card], limits: Thresholds) -> None:
    """Verdicts that differ from those before."""
    lines, counts = flips(cards, limits)
    for line in lines:
        print(line)
    known = [found for card in cards if (found := right(card, card.decision)) is not None]
    print(f"{len(cards)} cards, {sum(known)} of {len(known)} right as recorded; {dict(counts)}")


BANDS = (0.0, 0.5, 0.8, 0.95, 1.0)
"""Of probability, among which what was named is counted."""


def calibration(cards: Sequence[Card], limits: Thresholds) -> None:
    """How often laws and classes that were named are right, by the probability that they were given."""
    laws, classes = list[tuple[float, bool]](), list[tuple[float, bool]]()
    for card in cards:
        found = judged(card, limits) if "cause" in card.truth and not card.truth.get("outside") else None
        if found is None or found.verdict != "cause":
            continue
        behind = evidence_behind(found, card.evidence).cards
        drawn = [card.truth, *([card.truth["beside"]] if card.truth.get("beside") else [])]
        truths = [truth["cause"] for truth in drawn]
        true_classes = set().union(*(classes_of_truth(truth, behind) for truth in drawn))
        for effect in behind[found.winner].effects:
            mine = [key for key, other in behind.items() if effect in other.effects]
            laws.append((sum(map(found.probability, mine)), effect.cause in truths))
            kind, chance = narrowest_sure(effect, found, behind, limits)
            classes.append((chance, kind in true_classes))
    print(f"{'probability':12s} {'laws':>6s} right  {'classes':>8s} right")
    for low, high in itertools.pairwise(BANDS):
        rows = [[right for chance, right in named if low < chance <= high] for named in (laws, classes)]
        shares = [f"{sum(row) / len(row):6.1%}" if row else "     -" for row in rows]
        print(f"{low:.2f} to {high:.2f} {len(rows[0]):6d} {shares[0]} {len(rows[1]):8d} {shares[1]}")


def classes_of_truth(truth: Mapping[str, Any], cards: Mapping[str, Scorecard]) -> set[str]:
    """The classes of a hidden cause: with the numbers that were fitted, or of a motion of unit size where none were."""
    name, known = truth["cause"], jfsm.causes()
    fitted = {kind for card in cards.values() for one in card.effects if one.cause == name for kind in one.classes}
    if fitted or name not in known:
        return fitted
    if known[name].is_sensor:
        return {SENSOR}
    return set(classes_of(known[name], known[name].term(at=tuple(truth["at"]), **truth["parameters"]), 1.0, 1.0))


def main() -> None:
    parser = arguments()
    given, begin = parser.parse_args(), time.perf_counter()
    try:
        limits, cards = THRESHOLDS.changed(given.moved), chosen(given)
    except (OSError, ValueError) as error:
        parser.error(str(error))
    with without(given.without):
        compare(cards, limits)
        if given.record is not None:
            record(cards, limits, given.record)
    if given.sensitivity:
        sensitivity(cards)
    if given.checks:
        ablation(cards)
    if given.calibration:
        calibration(cards, limits)
    print(f"{time.perf_counter() - begin:.1f} s")


if __name__ == "__main__":
    main()
