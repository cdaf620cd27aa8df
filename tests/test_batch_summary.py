"""One verdict on many records: effects with their sizes, clusters, words, table and page."""

import csv
import io
import math
from typing import Any

import numpy as np
import pytest

from jfsm.fleet import Batch, spread_of
from jfsm.fleet._effects import effects_of
from jfsm.fleet._summary import summary_of
from jfsm.fleet._table import csv_of
from jfsm.reporting import batch_sentence, print_batch, render_batch


def estimate(value: float, error: float = 0.1, unit: str = "N") -> dict[str, Any]:
    return {"value": value, "low": value - 1.96 * error, "high": value + 1.96 * error, "unit": unit}


def finding(cause: str = "coulomb", size: float = 1.0, at: Any = (0, 1), **more: Any) -> dict[str, Any]:
    return {
        "cause": cause, "family": "damping", "at": list(at), "kind": "dry friction", "law_open": False,
        "probability": 0.99, "parameters": {"F": estimate(size)}, "members": {cause: 0.99},
        "size": estimate(2 * size), **more,
    }  # fmt: skip


def row(name: str, *findings: dict[str, Any], verdict: str | None = None) -> dict[str, Any]:
    return {
        "name": name, "source": f"/runs/{name}.csv", "status": "done", "finished": True, "sentence": "",
        "verdict": verdict or ("cause" if findings else "consistent"), "findings": list(findings), "closed": 0.9,
        "begins": None, "json": f"records/{name}.json", "page": f"records/{name}.html",
    }  # fmt: skip


def failed(name: str, message: str = "it holds no numbers") -> dict[str, Any]:
    return {
        "name": name, "source": "", "status": "failed", "verdict": None, "findings": [], "kind": "unreadable",
        "message": message, "json": None,
    }  # fmt: skip


def test_the_spread_of_equal_errors_is_that_of_the_analysis_of_variance():
    values, error = np.array([9.0, 10.0, 12.0, 13.0, 16.0]), 0.5
    found = spread_of(values, np.full(5, error))
    assert found.mean == pytest.approx(12.0)
    assert found.between == pytest.approx(math.sqrt(values.var(ddof=1) - error**2))
    half = 2.776445 * values.std(ddof=1) / math.sqrt(5)  # Student's quantile of 4 degrees of freedom
    assert (found.low, found.high) == pytest.approx((12.0 - half, 12.0 + half), rel=1e-5)
    # (n - 1) s² over the quantiles of chi-squared, 11.1433 and 0.4844, less the error
    low, high = (math.sqrt(4 * values.var(ddof=1) / quantile - error**2) for quantile in (11.14329, 0.4844186))
    assert (found.between_low, found.between_high) == pytest.approx((low, high), rel=1e-5)


def test_parts_that_differ_by_their_errors_alone_have_no_spread():
    found = spread_of(np.array([1.0, 1.01, 0.99]), np.full(3, 0.1))
    assert found.between == found.between_low == 0.0 and not found.outliers
    assert all(map(math.isnan, found.distance))  # three are too few to tell


def test_an_exact_value_and_a_single_one_have_a_mean():
    assert spread_of(np.array([2.0]), np.array([0.5])).low == pytest.approx(2.0 - 0.98, abs=1e-3)
    assert spread_of(np.array([2.0, 2.0]), np.zeros(2)).mean == pytest.approx(2.0)
    assert spread_of(np.zeros(3), np.zeros(3)).mean == 0.0


def test_means_intervals_and_outliers_are_as_often_right_as_they_say():
    """Of 600 fleets of 8 parts, errors of unlike sizes; three standard errors of the count are allowed for."""
    rng, n, trials = np.random.default_rng(0), 8, 600
    covered = between = out = 0
    for _ in range(trials):
        errors = rng.uniform(0.05, 0.6, n)
        values = 5.0 + 0.5 * rng.standard_normal(n) + errors * rng.standard_normal(n)
        found = spread_of(values, errors)
        covered += found.low <= 5.0 <= found.high
        between += found.between_low <= 0.5 <= found.between_high
        out += bool(found.outliers)
    allowed = 3 * math.sqrt(0.05 * 0.95 / trials)
    assert covered / trials > 0.95 - allowed and between / trials > 0.95 - allowed
    assert out / trials < 0.05 + allowed


def test_a_part_far_off_stands_out():
    values = np.array([1.0, 1.1, 0.9, 1.05, 0.95, 3.0])
    assert spread_of(values, np.full(6, 0.05)).outliers == (5,)


def test_the_same_law_at_another_place_is_another_effect():
    rows = [row("a", finding()), row("b", finding()), row("c", finding(at=(1, 2)))]
    found = effects_of(rows)
    assert [(effect["at"], effect["records"]) for effect in found] == [([0, 1], ["a", "b"]), ([1, 2], ["c"])]


def test_laws_that_may_be_the_same_are_one_effect_with_the_size_that_they_share():
    either = finding("smooth_coulomb", law_open=True, members={"smooth_coulomb": 0.6, "coulomb": 0.35, "lugre": 0.05})
    found = effects_of(
        [row("a", finding()), row("b", either), row("c", finding("lugre")), row("d", finding("coulomb"))]
    )
    assert [sorted(effect["records"]) for effect in found] == [["a", "b", "d"], ["c"]]
    assert found[0]["causes"] == {"coulomb": 2, "smooth_coulomb": 1} and found[0]["kind"] == "dry friction"
    assert [size["parameter"] for size in found[0]["sizes"]] == ["size"]
    assert found[0]["sizes"][0]["mean"] == pytest.approx(2.0)


def test_sizes_in_unlike_units_are_kept_apart_and_those_without_ends_left_out():
    odd = finding(parameters={"F": estimate(1000.0, unit="mN")})
    endless = finding(parameters={"F": {**estimate(1.0), "high": None}})
    (effect,) = effects_of([row("a", finding()), row("b", odd), row("c", endless)])
    assert [(size["unit"], len(size["values"])) for size in effect["sizes"]] == [("N", 1), ("mN", 1)]


def test_one_sentence_says_what_the_records_have_in_common():
    sizes = [0.50, 0.52, 0.48, 0.51, 0.49, 3.0]
    rows = [row(f"p{i}", finding(size=size)) for i, size in enumerate(sizes)]
    rows += [row("p6"), row("p7", verdict="undecided"), failed("p8")]
    found = summary_of(rows, None)
    words = found["sentence"]
    assert words.startswith("Coulomb friction at link ground–1 shows in 6 of 8 records. F = ")
    assert "from part to part beyond the errors of the fits. p5 (3.00 N," in words and "stands out." in words
    assert "1 other record is consistent. 1 other record is undecided (p7). 1 of 9 records has no diagnosis." in words
    assert [len(cluster["records"]) for cluster in found["clusters"]] == [6, 1, 1, 1]


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ([row("a"), row("b")], "2 records are consistent."),
        ([failed("a")], "1 of 1 records has no diagnosis."),
        (
            [row("a", finding()), row("b", finding())],
            "Coulomb friction at link ground–1 shows in 2 of 2 records. F = 1.00 N [0.10, 1.90] in the mean, "
            "and parts differ by no more than the errors of the fits.",
        ),
    ],
)
def test_simple_batches_have_simple_sentences(rows, words):
    assert summary_of(rows, None)["sentence"] == words


def test_the_table_has_a_line_for_every_number():
    rows = [row("a", finding(), finding("cubic_hardening", at=(1, 2))), row("b"), failed('c, "d"')]
    lines = list(csv.DictReader(io.StringIO(csv_of(rows))))
    assert [(line["record"], line["cause"], line["at"], line["value"]) for line in lines] == [
        ("a", "coulomb", "0-1", "1.0"),
        ("a", "cubic_hardening", "1-2", "1.0"),
        ("b", "", "", ""),
        ('c, "d"', "", "", ""),
    ]
    assert lines[-1]["message"] == "it holds no numbers"


def test_a_batch_is_a_dataframe():
    pytest.importorskip("pandas")
    frame = Batch("out", summary_of([row("a", finding()), failed("b")], None)).to_dataframe()
    assert list(frame["record"]) == ["a", "b"] and frame["value"][0] == 1.0


def test_the_page_shows_every_record_escaped_and_links_to_its_page():
    rows = [row(f"p{i}", finding(size=1 + 0.01 * i)) for i in range(4)]
    page = render_batch(summary_of([*rows, row("p<4>"), failed("p5", "<script>alert(1)</script>")], None))
    assert '<a href="records/p0.html">p0</a>' in page and "<script>" not in page and "p&lt;4&gt;" in page
    assert page.count("<svg") == 1 and "<link" not in page and "src=" not in page
    assert "http" not in page.replace("http://www.w3.org", "")


def test_the_summary_is_short_on_the_terminal(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "100")
    names = [f"p{i}" for i in range(60)]
    before = summary_of([row(name, verdict="undecided") for name in names], None)
    print_batch(summary_of([row(name) for name in names], before))
    printed = capsys.readouterr().out
    assert "60 records are consistent." in printed and "p0: undecided → consistent" in printed
    assert "50 more" in printed and len(printed.splitlines()) < 40


def test_a_sentence_is_in_the_units_that_are_asked_for():
    from jfsm.records import out_units
    from jfsm.reporting import shown_in

    found = summary_of([row("a", finding())], None)
    with shown_in(out_units("in,lbf,deg")):
        assert "lbf" in batch_sentence(found)
