"""Two diagnoses, or two records, side by side."""

from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import jfsm
from jfsm import reporting
from jfsm.cli import app
from jfsm.diagnosis import compare_numbers


def value(size: float, unit: str, spread: float = 0.1) -> dict[str, Any]:
    return {"value": size, "low": size * (1 - spread), "high": size * (1 + spread), "unit": unit}


def numbers(friction: float | None, stiffness: float) -> dict[str, Any]:
    """What the comparison reads of a diagnosis."""
    finding = {
        "cause": "coulomb", "at": [0, 1], "probability": 0.97, "parameters": {"F": value(friction or 0.0, "N")},
        "kind": "dry friction", "size": value(friction or 0.0, "N"),
    }  # fmt: skip
    errors = {"unit": "m", "before": 0.2, "refitted": 0.1, "after": 0.01, "floor": 0.01}
    return {
        "verdict": "consistent" if friction is None else "cause",
        "findings": [] if friction is None else [finding],
        "refitted": {"stiffness@0-1.k": value(stiffness, "N/m")},
        "modes": [{"frequency": value(1.5, "Hz"), "damping_ratio": value(0.02, "1")}],
        "gain": {"closed": 0.99, "interval": [0.9, 1.0], "channels": {"displacement 1": errors}},
        "record": {"name": None, "channels": [{"name": "displacement 1", "unit": "m", "noise": 1e-4}]},
    }


def test_causes_values_and_errors_stand_side_by_side():
    sides = compare_numbers(numbers(2.0, 100.0), numbers(None, 150.0))
    rows = {row.name: row for row in sides.rows}
    assert rows["verdict"].apart and (rows["verdict"].first, rows["verdict"].second) == ("cause", "consistent")
    force = rows["coulomb@0-1.F"]
    assert force.unit == "N" and force.second is None and not force.apart
    assert rows["stiffness@0-1.k"].apart and not rows["mode 1, frequency"].apart
    assert rows["error of displacement 1, after"].first == 0.01
    text = str(sides)
    assert "coulomb@0-1.F" in text and "2 [1.8, 2.2]" in text and "100 [90, 110]" in text
    assert "<td>150 [135, 165]</td>" in sides._repr_html_()
    assert repr(sides) == f"<Sides, first and second: {len(rows)} quantities, 2 apart>"


def test_what_overlaps_is_not_apart():
    sides = compare_numbers(numbers(2.0, 100.0), numbers(2.3, 105.0))
    assert not any(row.apart for row in sides.rows)


def test_a_comparison_is_a_data_frame():
    frame = compare_numbers(numbers(2.0, 100.0), numbers(3.0, 100.0)).to_dataframe().set_index("name")
    row = frame.loc["coulomb@0-1.F"]
    assert (row["first"], row["second_low"], row["apart"]) == (2.0, pytest.approx(2.7), True)


def test_two_records_are_compared_by_their_channels():
    time, rng = np.arange(400) * 0.01, np.random.default_rng(1)
    one, other = (
        jfsm.Record(time=time, displacement=size * np.sin(9 * time) + 1e-3 * rng.standard_normal(400))
        for size in (1.0, 2.0)
    )
    rows = {row.name: row for row in jfsm.compare(one, other).rows}
    assert rows["rate"].unit == "Hz" and rows["rate"].first == pytest.approx(100.0)
    spread = rows["displacement 1, standard deviation"]
    assert spread.unit == "m"
    assert spread.second == pytest.approx(2 * spread.first, rel=0.01)  # pyright: ignore[reportOperatorIssue]
    assert rows["displacement 1, noise"].first == pytest.approx(1e-3, rel=0.3)
    assert rows["driven by"].first == "nothing"


def test_what_cannot_be_compared_is_refused():
    record: Any = jfsm.Record(time=np.arange(40) * 0.1, displacement=np.sin(np.arange(40.0)))
    with pytest.raises(TypeError, match="`first` and `second` must be two diagnoses or two .*got Record and str"):
        jfsm.compare(record, "run.json")  # pyright: ignore[reportArgumentType]


def test_the_command_compares_two_files(monkeypatch, tmp_path):
    given = {"monday": numbers(2.0, 100.0), "friday": numbers(None, 150.0)}
    monkeypatch.setattr(reporting, "read_diagnosis", lambda path: given[path.stem])
    done = CliRunner().invoke(app, ["compare", str(tmp_path / "monday.json"), str(tmp_path / "friday.json")])
    assert done.exit_code == 0, done.output
    assert "monday" in done.stdout and "coulomb@0-1.F" in done.stdout and "apart" in done.stdout
