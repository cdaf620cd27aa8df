"""Every row of the tables: bad input ends right, or with one message that says what, how, and what to do."""

import re
import time
import traceback
from pathlib import Path
from typing import Any

import pytest

from . import of_calls, of_files, of_models, of_records
from .rows import ReachedError, Row, Stage

TABLES = {"records": of_records, "files": of_files, "models": of_models, "calls": of_calls}
LONGEST = 30.0
"""Seconds."""


@pytest.fixture(autouse=True)
def nothing_is_computed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a fit or a diagnosis would begin, it is said instead: what is refused is refused before."""

    def reached(*_: Any, **__: Any) -> Any:
        raise ReachedError

    for place in (
        "jfsm.diagnosis._conduct.Study",
        "jfsm.diagnosis._diagnose.stand_in",
        "jfsm.identification._fit.starts",
    ):
        monkeypatch.setattr(place, reached)


@pytest.mark.parametrize(
    "row", [pytest.param(row, id=f"{table}: {row.name}") for table, of in TABLES.items() for row in of.ROWS]
)
def test_bad_input_ends_right_or_in_one_message(row: Row, tmp_path: Path):
    began = time.process_time()
    if row.right is not None:
        assert row.right(row.call(Stage(tmp_path)))
    else:
        with pytest.raises(row.error) as caught:
            row.call(Stage(tmp_path))
        if row.says:
            said = " ".join(str(caught.value).split())
            assert re.search(row.says, said, re.S), said
            *_, (frame, _) = traceback.walk_tb(caught.tb)
            assert frame.f_globals["__name__"].startswith("jfsm.") or isinstance(caught.value, OSError), frame
    assert time.process_time() - began < LONGEST


def test_the_tables_hold_every_row_once():
    for table, of in TABLES.items():
        names = [row.name for row in of.ROWS]
        assert len(names) == len(set(names)), table
