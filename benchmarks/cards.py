"""Records what verdicts rest on, for `benchmarks/replay.py`: the scorecards of measured rigs and of cases in a file.

    python benchmarks/cards.py --out DIR [--rigs all silverbox …] [--cases FILE [NAME …]] [--data DIR]

`benchmarks/blind.py --cards DIR` records those of blind cases. A card is a JSON file with the evidence, the decision
and what was hidden, where that is known.
"""

import argparse
import contextlib
import json
import os
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any
from unittest import mock

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

LIKELIEST = 3
"""Candidates of which everything is measured, whatever the verdict asked."""


@contextlib.contextmanager
def asking_widely() -> Iterator[None]:
    """Diagnoses in here measure of the likeliest hypotheses all that another verdict might ask."""
    from jfsm.diagnosis import _conduct
    from jfsm.diagnosis.verdict.judge import judge_in_sign

    def judged(evidence: Any) -> Any:
        decision = judge_in_sign(evidence)
        ask(evidence)
        return decision

    with mock.patch.object(_conduct, "judge_in_sign", judged):
        yield


def ask(evidence: Any) -> None:
    """Measure what a verdict may ask of the model and of the likeliest candidates."""
    from jfsm.diagnosis.evidence.evidence import map_on

    likeliest = sorted(evidence.candidates, key=lambda card: -card.evidence)[:LIKELIEST]
    for key in ("given", "refitted", *(card.key for card in likeliest)):
        evidence.other_shapes(key)
        evidence.held_out(key)
    if evidence.with_map("refitted") is not None:
        evidence.held_out(map_on("refitted"))
    other = evidence.with_model_error()
    if other is not None:
        ask(other)


def keep_card(folder: Path, name: str, diagnosis: Any, truth: Mapping[str, Any]) -> None:
    """Write the card of a diagnosis into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    found = [{"cause": f.cause, "at": list(f.at), "probability": f.probability} for f in diagnosis.findings]
    card = {"name": name, "truth": dict(truth), "findings": found}
    card |= {part: diagnosis.told[part] for part in ("decision", "evidence")}
    (folder / f"{name}.json").write_text(json.dumps(card, allow_nan=False), encoding="utf-8")


def main() -> None:
    import jax

    jax.config.update("jax_enable_x64", True)
    import jfsm
    from benchmarks import rig_verdicts
    from benchmarks.diagnosis_time import loaded

    parser = argparse.ArgumentParser(description="Records the scorecards of measured rigs and of cases in a file.")
    parser.add_argument("--out", type=Path, required=True, help="folder of the cards")
    parser.add_argument("--rigs", nargs="*", default=[], choices=["all", *rig_verdicts.RIGS], metavar="RIG")
    parser.add_argument("--cases", nargs="+", default=[], metavar=("FILE", "NAME"), help="a file of cases, and which")
    default = Path(os.environ.get("JFSM_DATA", Path(__file__).resolve().parents[2] / "shared" / "data"))
    parser.add_argument("--data", type=Path, default=default, help="folder of measured records")
    given = parser.parse_args()

    def record(name: str, records: Any, model: Any, holdout: Any, truth: Mapping[str, Any]) -> None:
        if (given.out / f"{name}.json").exists():
            return
        with asking_widely():
            d = jfsm.diagnose(records, model, holdout=holdout, key=jax.random.key(0), progress=False)
        keep_card(given.out, name, d, truth)
        print(f"{name}: {d.verdict} {[(f.cause, round(f.probability, 2)) for f in d.findings]}", flush=True)

    for name in rig_verdicts.RIGS if "all" in given.rigs else given.rigs:
        rig = rig_verdicts.RIGS[name](given.data)
        model = jfsm.fit(rig.believed, rig.fitted_to or rig.record).structure
        record(f"rig-{name}", rig.record, model, rig.held, {"rig": name})
    if given.cases:
        cases = loaded(Path(given.cases[0]))
        for name in given.cases[1:]:
            case = getattr(cases, name)()
            record(f"case-{name}", case.record, case.model, case.holdout, {"right": case.right})


if __name__ == "__main__":
    main()
