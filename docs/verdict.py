"""Writes `docs/verdict.md` from the checks and the thresholds of the library.

python docs/verdict.py
"""

import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from jfsm.diagnosis.thresholds import THRESHOLDS  # noqa: E402  (needs the line above when run as a script)
from jfsm.diagnosis.verdict.checks import CHECKS, STAGES  # noqa: E402

PAGE = Path(__file__).with_suffix(".md")

HEAD = """# How a verdict is reached

This page is made from the code by `python docs/verdict.py`; a test holds it current.

A diagnosis measures once, judges once, and writes down every step.

1. **Measure.** Every hypothesis (the model as given, the model with its own values refitted, each cause at each place,
   pairs of causes) is fitted. What was measured about it is its *scorecard*: log-evidence, errors of prediction and
   what noise explains of them, whiteness of its innovations, own values at their bounds, and more
   (`jfsm/diagnosis/evidence/scorecard.py`). What is costly is measured when a check first asks for it: what forces of
   other shapes would gain, what a map of the missing force would explain, errors of runs over held-out readings.
2. **Judge.** `jfsm/diagnosis/verdict/judge.py` is a pure function of the scorecards and the thresholds. It makes the
   checks below, in stages, and ends in the table of verdicts.
3. **Read.** `d.why()` shows the checks that decided, `d.why("coulomb")` those of one cause, also of one that lost
   early. `jfsm diagnose … --why` and `jfsm why run.json [CAUSE]` do the same in the terminal. `d.decision.checks` is
   the whole log, in order; the page has it folded under "Why this verdict".

In JSON, `decision` holds the verdict with `checks`, `factors` (whose product is the probability of each alternative),
`reasons` (why each candidate is not named) and, where the verdict is undecided, `stopped_by`: the check that stopped it
with what was measured and the limit. `evidence` holds the scorecards; to judge them again:

```python
import json
from jfsm.diagnosis import Evidence, Thresholds, judge

written = json.load(open("run.json"))
judge(Evidence.of_plain(written["evidence"]))  # the same verdict
judge(Evidence.of_plain(written["evidence"]), Thresholds(named=0.9))  # with another threshold
```

## Table of verdicts
"""

REMARK = """A channel that is cut off at a limit is a cause whatever else cannot be told. So is a force that acts
later than it was recorded, where nothing else is wrong and that changes a run of the model as given. Where no cause is
named, all hypotheses are compared once more with a share of the elastic force admitted as model error, if that makes
the best of them likelier.
"""

TAIL = """## To change something

- *A threshold*: its default in `jfsm/diagnosis/thresholds.py`; for one judgement, `judge(evidence, Thresholds(…))`.
- *A check*: its entry in `jfsm/diagnosis/verdict/checks.py` (stage, relation, unit, what it asks), and the function
  that makes it: `admissible.py`, `ranking.py` (names and probabilities), `judgement.py` (detected, sufficient),
  `right_shape.py`, `confirmed.py` (held-out readings) or `judge.py`, all beside it.
- *What is measured*: `jfsm/diagnosis/evidence/`.
- Then `python benchmarks/replay.py DIR` judges recorded cases anew in seconds and lists the verdicts that change;
  `--sensitivity` moves every threshold by a fifth, `--checks` leaves out each check. `benchmarks/blind.py --cards DIR`
  and `benchmarks/cards.py` record.
"""


VERDICTS = (
    ("no", "", "", "", "", "", "consistent"),
    ("yes", "yes", "", "", "", "", "parameters"),
    ("yes", "no", "yes", "right", "yes, or none are held out", "", "cause"),
    ("yes", "no", "yes", "wrong, the rest negligible", "nearly all is closed", "", "cause, its class; the law is open"),
    ("yes", "no", "no, or wrong shape", "", "yes", "yes", "unnamed"),
    ("otherwise", "", "", "", "", "", "undecided, with the check that stopped it"),
)
CONDITIONS = (
    "something is wrong", "refitted values suffice", "a cause is admissible and named", "its shape",
    "held-out readings agree", "a map explains half", "verdict",
)  # fmt: skip


def page() -> str:
    """The page as Markdown."""
    return "\n".join([HEAD, *_table(CONDITIONS, VERDICTS), REMARK, *_checks(), *_thresholds(), TAIL])


def _table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    for cells in (headings, ["---"] * len(headings), *rows):
        yield f"| {' | '.join(cells)} |"
    yield ""


def _checks() -> Iterator[str]:
    yield "## Checks\n"
    yield "In their order; of a candidate the first that fails is its reason, and later ones are not made.\n"
    for stage, question in STAGES.items():
        yield f"### {stage.capitalize()}: {question}\n"
        kinds = ((name, kind) for name, kind in CHECKS.items() if kind.stage == stage)
        yield from _table(
            ("check", "passes where", "measured", "limits"),
            [
                (f"`{name}`", k.asks, f"{k.unit}, {k.relation} limit", ", ".join(f"`{x}`" for x in k.limits) or "none")
                for name, k in kinds
            ],
        )


def _thresholds() -> Iterator[str]:
    yield "## Thresholds\n"
    yield "*Blind cases*: the number was set so that simulated records with known, hidden causes are judged right.\n"
    rows = THRESHOLDS.explained().items()
    cells = [(f"`{name}`", f"{n.value:g}", n.unit, n.means, n.source) for name, n in rows]
    yield from _table(("name", "value", "unit", "meaning", "source"), cells)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
