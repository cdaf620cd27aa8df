"""The page on how a verdict is reached, which is made from the code."""

import importlib.util
import re
from pathlib import Path

from jfsm.diagnosis.thresholds import THRESHOLDS
from jfsm.diagnosis.verdict.checks import CHECKS

DOCS = Path(__file__).resolve().parents[1] / "docs"
VERDICT = Path(__file__).resolve().parents[1] / "jfsm" / "diagnosis" / "verdict"


def test_the_page_is_what_the_code_says():
    spec = importlib.util.spec_from_file_location("verdict_page", DOCS / "verdict.py")
    assert spec is not None and spec.loader is not None
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    assert (DOCS / "verdict.md").read_text(encoding="utf-8") == made.page(), "run `python docs/verdict.py`"


def test_every_check_is_made_somewhere_and_its_limits_are_thresholds():
    code = "\n".join(path.read_text(encoding="utf-8") for path in VERDICT.glob("*.py") if path.name != "checks.py")
    made = set(re.findall(r'check(?:ed)?\(\s*"(\w+)"', code))
    assert made == set(CHECKS)
    assert {limit for kind in CHECKS.values() for limit in kind.limits} == set(THRESHOLDS.explained())
