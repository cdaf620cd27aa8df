"""Writes `docs/verdict.md` from the checks and the thresholds of the library.

python docs/verdict.py
"""

import ast
import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from jfsm.diagnosis.thresholds import THRESHOLDS  # noqa: E402  (needs the line above when run as a script)
from jfsm.diagnosis.verdict.checks import CHECKS, STAGES  # noqa: E402

PAGE = Path(__file__).with_suffix(".md")
CODE = Path(__file__).resolve().parents[1] / "jfsm" / "diagnosis" / "verdict"
RECORDS = CODE.parents[1] / "records"

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
3. **Read.** `d.why()` shows the checks that decided and, where no cause is named, the law that came nearest with all
   that it failed; `d.why("coulomb")` those of one cause, also of one that lost early. `jfsm diagnose … --why` and
   `jfsm why run.json [CAUSE]` do the same in the terminal: `✓` passed, `✗` failed, `·` led to other checks.
   `d.decision.checks` is the whole log in the order in which checks were made; the page has it folded under "Why this
   verdict".

In JSON, `decision` holds

| name | what it is |
| --- | --- |
| `verdict` | as in the table below |
| `winner` | key of the hypothesis that it rests on; of an undecided one `refitted` or `given`: nothing is named |
| `near` | keys of laws whose class is right though their shape is not, or beside which a map does better |
| `checks` | every comparison; those before number `since` belong to an earlier judgement, which no longer counts |
| `stopped_by` | where it is undecided, the check that stopped it, with what was measured and the limit |
| `factors` | by key; their product is the probability of an alternative |
| `explained` | by key; the share of the refitted model's excess that a candidate explains (`kappa` in `candidates`) |
| `reasons` | by key; why a candidate is not named |
| `model_error` | share of the elastic force that was admitted as model error to all |
| `finished` | whether the search was |

If you move the limit of `stopped_by`, that check passes. Later checks were not made, and may still stop the verdict:
`--with` tells. `candidates` are in the order of their log-evidence, not of their probability.

`evidence` holds the scorecards. To judge them again with another threshold, `jfsm why run.json --with half=0.6`, or

```python
import json
from jfsm.diagnosis import Thresholds, judge_again

decision = judge_again(json.load(open("run.json")), Thresholds(half=0.6))
print(decision.verdict, decision.winner)
print(decision.why())
```

A written scorecard has what was asked when it was written. If other thresholds ask for more, a map of another
hypothesis or its errors on held-out readings, `judge` raises `NotMeasuredError`, and `jfsm why` says what is missing:
only a new diagnosis can tell then.

**Judging again is not searching again.** Some thresholds steer the search and the examination of channels, too
(`jfsm/diagnosis/search/`, `jfsm/diagnosis/channels/`): which hypotheses are fitted, and when it stops. A default
that is changed in the file changes what is measured; `--with`, `judge` and `benchmarks/replay.py` change the judgement
alone.

## Words

- *Nats*: natural logarithm of a ratio of probabilities; 5 nats are 150 to 1.
- *Own values*: the model's own parameters, its stiffnesses, dampings and masses. *Refitted*, they are fitted to the
  record within what the owner believes; *the model as given* has them as stated.
- *Innovations*: differences between readings and what the filter expects of them, one sample ahead.
- *Prediction*: over some periods, restarted from the filtered motion again and again. *Held-out run*: over all held-out
  readings, never restarted. Along an imposed motion both are predictions of the force.
- *Set of samples*: those that were fitted, and those of the same records that were kept back.
- *Excess*: mean square error of prediction, less the mean square error that noise alone would cause.
- *Map*: a smooth function of displacement and velocity for the force that is missing, without a law.
- *Looks*: how many independent errors of prediction a record stands for. Where more than noise is left, a hypothesis
  is so many times the logarithm of its error less likely.
- *Hypothesis*: the model as given, refitted, or with effects; its *key* is `given`, `refitted`, `coulomb@0-1`.
  *Candidates* have effects; those that nothing speaks against are *alternatives*. The model as
  given and the refitted model always are.

## Table of verdicts
"""

REMARK = """A channel that is cut off at a limit is a cause whatever else cannot be told. So is a force that acts
later than it was recorded, where nothing else is wrong and that changes a run of the model as given. Where no cause is
named, all hypotheses are compared once more with a share of the elastic force admitted as model error, if that makes
the best of them likelier. A map that explains much of what an admissible cause leaves comes before the name of that
cause, however probable it is; the class of its law is named all the same where runs over held-out readings confirm it.
"""

TAIL = """## To change something

- *A threshold*: its default in `jfsm/diagnosis/thresholds.py`; for one judgement, `--with`.
- *A check*: its entry in `jfsm/diagnosis/verdict/checks.py` (stage, relation, unit, what it asks), and the function
  that makes it, which the tables above name.
- *What is measured*: `jfsm/diagnosis/evidence/`.

Then write this page again, `python docs/verdict.py`, and see which verdicts change. Cards of cases are recorded once:
each is a diagnosis, 15 to 90 s of one core, so a hundred take an hour or two.

```sh
python benchmarks/blind.py --n 100 --seed 1 --jobs 2 --out blind.jsonl --cards cards
python benchmarks/cards.py --out cards --rigs all --data DATA
```

They are judged anew in seconds:

```sh
python benchmarks/replay.py cards run.json --record before.json  # before the change; diagnoses may stand beside cards
python benchmarks/replay.py cards run.json --against before.json  # after it: the verdicts that change
python benchmarks/replay.py cards --with half=0.6 --where imposed  # of some, with another threshold
python benchmarks/replay.py cards --sensitivity --checks  # each threshold moved by a fifth, each check left out
```
"""


VERDICTS = (
    ("no", "", "", "", "", "", "consistent"),
    ("yes", "yes", "", "", "", "", "parameters"),
    ("yes", "no", "yes", "right", "yes, or none are held out", "", "cause; its law is open below `class_named`"),
    ("yes", "no", "its class", "right", "yes, or none are held out", "", "cause, its class; the law is open"),
    (
        "yes",
        "no",
        "yes",
        "wrong, or a map does better",
        "half is closed",
        "",
        "cause, its class; the law is open",
    ),
    ("yes", "no", "no, or wrong shape", "", "yes, with the map", "yes", "unnamed"),
    ("yes", "no", "admissible", "not asked", "yes, with the map", "of what the cause leaves", "unnamed"),
    (
        "yes",
        "no",
        "any",
        "",
        "no, with the map",
        "yes",
        "undecided: that map is not offered; `stopped_by` names it, `near` the law",
    ),
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
    yield "In the order of the stages. The log has them as they were made: candidates one by one, their probabilities,"
    yield "then what is left, and whether anything is wrong at all. At the stage Admissible the first check that a"
    yield "candidate fails is its reason, and later ones are not made; elsewhere one may fail beside another."
    yield "Functions are those of `jfsm/diagnosis/verdict/`.\n"
    made = made_in()
    for stage, question in STAGES.items():
        yield f"### {stage.capitalize()}: {question}\n"
        kinds = ((name, kind) for name, kind in CHECKS.items() if kind.stage == stage)
        yield from _table(
            ("check", "passes where", "measured", "limits", "made in"),
            [
                (f"`{name}`", k.asks, f"{k.unit}, {k.relation} limit", _code(k.limits) or "none", _code(made[name]))
                for name, k in kinds
            ],
        )


def _code(words: Iterable[str]) -> str:
    return ", ".join(f"`{word}`" for word in words)


def made_in() -> dict[str, list[str]]:
    """Of every check the functions that make it, each with its file, from the code."""
    made: dict[str, list[str]] = {}
    for path in sorted([*CODE.glob("*.py"), *(CODE.parent / "look").glob("*.py"), RECORDS / "_look.py"]):
        functions = [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.FunctionDef)]
        for function in functions:
            for name in filter(None, map(_name_of_check, ast.walk(function))):
                made.setdefault(name, []).append(f"{path.name}: {function.name}")
    return {name: list(dict.fromkeys(places)) for name, places in made.items()}


def _name_of_check(node: ast.AST) -> str | None:
    """The name of the check that a call makes."""
    if not (
        isinstance(node, ast.Call)
        and ast.unparse(node.func).split(".")[-1] in ("check", "_check", "checked", "_checked")
    ):
        return None
    return next((str(one.value) for one in node.args[:1] if isinstance(one, ast.Constant)), None)


def _thresholds() -> Iterator[str]:
    yield "## Thresholds\n"
    yield "*Blind cases*: the number was set so that simulated records with known, hidden causes are judged right.\n"
    rows = THRESHOLDS.explained().items()
    cells = [(f"`{name}`", f"{n.value:g}", n.unit, n.means, n.source) for name, n in rows]
    yield from _table(("name", "value", "unit", "meaning", "source"), cells)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
