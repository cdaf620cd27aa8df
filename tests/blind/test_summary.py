"""What the examination counts as right, and how it adds up, on made-up rows."""

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from benchmarks import blind
from benchmarks.blind_page import write_page
from benchmarks.blind_table import (
    Row,
    Share,
    calibration,
    calibration_error,
    confusions,
    covers,
    exact,
    group,
    half,
    hidden,
    in_class,
    kind,
    placed,
    right_class,
    right_family,
    said,
    silent,
    table,
    twins,
    wrong,
)

from . import OUTSIDE


def finding(
    cause: str, probability: float = 0.99, rivals: tuple[str, ...] = (), **intervals: tuple[float, float]
) -> Row:
    parameters = {
        name: {"value": 0.5 * (low + high), "low": low, "high": high} for name, (low, high) in intervals.items()
    }
    others = [{"cause": rival, "at": [0, 1], "probability": 0.1} for rival in rivals]
    return {"cause": cause, "at": [0, 1], "probability": probability, "parameters": parameters, "rivals": others}


def row(truth: str, verdict: str, *findings: Row, **changes) -> Row:
    return {
        "seed": 1, "cause": truth, "at": [0, 1], "parameters": {}, "noise": 0.01, "channel_set": "x",
        "excitation": "sweep", "at_rest": False, "verdict": verdict, "findings": list(findings), "closed": 1.0,
        "error": None, "seconds": 2.0,
    } | changes  # fmt: skip


NAMED = row("coulomb", "cause", finding("coulomb"))
RIVAL = row("coulomb", "cause", finding("quadratic_damping", 0.6, rivals=("coulomb",)))
SURE_AND_WRONG = row("coulomb", "cause", finding("quadratic_damping", 0.97), seed=7)
MISSED = row("coulomb", "parameters", finding("damping_value", 0.95))
VALUE = row("stiffness_value", "parameters", finding("damping_value"), finding("stiffness_value"))
WRONG_VALUE = row("stiffness_value", "parameters", finding("mass_value"))
FALSE_ALARM = row("none", "cause", finding("coulomb", 0.7))
QUIET = row("none", "consistent")
FAILED = row("coulomb", "failed", error="ValueError: no", closed=None)


def pair(verdict: str, *findings: Row, **changes) -> Row:
    """A row of two hidden effects: friction, and a cubic spring beside it."""
    beside = {"cause": "cubic_hardening", "at": [0, 1], "parameters": {"k3": 7.0}, "share": 0.2, "left": 0.1}
    return row("coulomb", verdict, *findings, parameters={"F": 2.0}, beside=beside, **changes)


TWO = pair("cause", finding("cubic_hardening", k3=(6.0, 6.5)), finding("coulomb", F=(1.9, 2.1)))
TWO_BY_RIVAL = pair("cause", finding("coulomb"), finding("quintic_stiffness", 0.6, rivals=("cubic_hardening",)))
HALF = pair("cause", finding("coulomb"))
HALF_WRONG = pair("cause", finding("coulomb"), finding("jenkins", 0.97), seed=8)
ALL_WRONG = pair("cause", finding("jenkins", 0.8))
BLAMED = pair("parameters", finding("damping_value", 0.95), seed=9)
LEFT_UNNAMED, UNDECIDED, CALLED_FINE = pair("unnamed"), pair("undecided"), pair("consistent")
TWO_FAILED = pair("failed", error="ValueError: no", closed=None)
PAIRS = [
    *(TWO, TWO_BY_RIVAL, HALF, HALF_WRONG, ALL_WRONG, BLAMED),
    *(LEFT_UNNAMED, UNDECIDED, CALLED_FINE, TWO_FAILED),
]


def test_wilsons_interval_is_the_published_one():
    # Newcombe, Stat. Med. 17 (1998) 857-872, table I, method 3.
    assert Share(81, 263).interval() == pytest.approx((0.2553, 0.3662), abs=5e-5)
    assert Share(0, 20).interval() == pytest.approx((0.0, 0.1611), abs=5e-5)
    assert Share(1, 29).interval() == pytest.approx((0.0061, 0.1718), abs=5e-5)
    assert Share(0, 0).interval() == (0.0, 1.0)


def test_a_share_reads_with_its_count_and_interval():
    assert str(Share(81, 263)) == "81 of 263 = 31% (95 %: 26% to 37%)"
    assert str(Share(0, 0)) == "none drawn"


def test_rows_are_of_three_kinds():
    assert [kind(r) for r in (QUIET, VALUE, NAMED)] == ["none", "parameters", "cause"]


def test_a_cause_is_right_only_if_it_is_named_first():
    assert exact(NAMED)
    assert not any(exact(r) for r in (RIVAL, SURE_AND_WRONG, MISSED, FAILED))
    assert not exact(row("coulomb", "cause", finding("quadratic_damping"), finding("coulomb")))
    assert not exact(row("coulomb", "unnamed")) and not exact(row("coulomb", "cause"))


def test_a_wrong_value_is_right_anywhere_among_the_findings_of_that_verdict():
    assert exact(VALUE)
    assert not exact(WRONG_VALUE)
    assert not exact(row("stiffness_value", "cause", finding("stiffness_value")))


def test_with_nothing_wrong_only_consistent_and_undecided_are_right():
    assert exact(QUIET) and exact(row("none", "undecided"))
    assert not any(exact(row("none", verdict)) for verdict in ("parameters", "cause", "unnamed", "failed"))


def test_the_class_is_right_if_the_truth_is_a_rival():
    assert in_class(NAMED) and in_class(RIVAL)
    assert not in_class(SURE_AND_WRONG) and not in_class(MISSED) and not in_class(FAILED)


def test_silence_is_broken_by_a_cause_by_a_map_and_by_failing():
    assert all(silent(row("none", verdict)) for verdict in ("consistent", "parameters", "undecided"))
    assert not any(silent(row("none", verdict)) for verdict in ("cause", "unnamed", "failed"))


def test_coverage_counts_the_true_parameters_of_a_rightly_named_finding():
    truth = {"F": 2.0, "k": 5.0}
    named = row("coulomb", "cause", finding("coulomb", F=(1.9, 2.1), k=(5.5, 6.0), other=(0.0, 1.0)), parameters=truth)
    assert covers(named) == {"F": True, "k": False}
    assert covers(row("coulomb", "cause", finding("quadratic_damping", F=(1.9, 2.1)), parameters=truth)) == {}


def test_what_was_said_is_the_first_cause_the_values_or_the_verdict():
    assert [said(r) for r in (NAMED, VALUE, QUIET)] == ["coulomb", "damping_value+stiffness_value", "consistent"]


def test_twins_are_what_narrow_motion_does_not_separate():
    cubic = row("cubic_damping", "cause", finding("quadratic_damping", rivals=("cubic_damping", "power_damping")))
    assert twins(cubic) == {"quadratic_damping", "cubic_damping", "power_damping"}
    assert right_class(cubic) and in_class(cubic) and group(cubic) == 3
    assert not right_class(row("cubic_damping", "cause", finding("coulomb")))
    assert not right_class(row("cubic_damping", "unnamed"))
    assert not twins(row("jenkins", "cause", finding("jenkins")))


def test_a_late_force_is_a_late_channel_where_there_is_but_one():
    late = row("force_delay", "cause", finding("channel_delay"))
    assert right_class(late) and twins(late) == {"force_delay", "channel_delay"}
    assert not twins(late | {"channel_set": "xva"}) and not right_class(late | {"channel_set": "xva"})


def test_the_family_may_be_right_where_the_name_is_not():
    assert right_family(RIVAL) and not right_family(MISSED) and not right_family(FAILED)
    assert not right_family(row("coulomb", "cause", finding("jenkins")))


def test_calibration_compares_what_was_said_with_how_often_it_held():
    half_sure = [row("coulomb", "cause", finding(said, 0.55)) for said in ("coulomb", "jenkins", "jenkins", "jenkins")]
    sure = [row("coulomb", "cause", finding("coulomb", 0.95))] * 4
    [(first, low), (second, high)] = calibration([*half_sure, *sure, QUIET, FAILED])
    assert (first, low, second, high) == (0.55, Share(1, 4), pytest.approx(0.95), Share(4, 4))
    assert calibration_error([*half_sure, *sure]) == pytest.approx(0.5 * 0.3 + 0.5 * 0.05)


def test_confusions_are_counted_commonest_first():
    assert confusions([NAMED, MISSED, RIVAL, SURE_AND_WRONG, QUIET]) == [
        ("coulomb", "quadratic_damping", 2),
        ("coulomb", "damping_value", 1),
    ]


def test_the_table_counts_each_row_where_it_belongs():
    covered = row("coulomb", "cause", finding("coulomb", F=(1.9, 2.1)), parameters={"F": 2.0}, closed=0.5, noise=0.05)
    rows = [NAMED, covered, RIVAL, SURE_AND_WRONG, MISSED, VALUE, WRONG_VALUE, FALSE_ALARM, QUIET, FAILED]
    text = table(rows)
    lines = [" ".join(line.split("(")[0].split()) for line in text.splitlines()]
    for expected in (
        "challenges 10",
        "cause named exactly 2 of 6 = 33%",
        "cause first or a rival 3 of 6 = 50%",
        "of those without twin none drawn",
        "twins: one of them 2 of 6 = 33%",
        "twins: mean group 1.25",
        "family named 4 of 6 = 67%",
        "wrong value named 1 of 2 = 50%",
        "silent where no law is 3 of 4 = 75%",
        "with nothing wrong 1 of 2 = 50%",
        "intervals that cover 1 of 1 = 100%",
        "right where p > 0.9 3 of 6 = 50%",
        "closed share, median 1",
        "seconds, median 2",
        "2 x coulomb -> quadratic_damping",
        "0.05 1 of 1 = 100%",
        "seed 1: coulomb: ValueError: no",
    ):
        assert expected in lines
    sure = text[text.index("wrong with p > 0.9") : text.index("no answer")]
    assert "seed 7: coulomb -> quadratic_damping, p = 0.970, sweep, x, noise 0.01" in sure
    assert sure.count("seed") == 3


def test_of_an_effect_outside_the_catalogue_no_name_is_the_right_answer():
    outside = {"outside": True, "closed": 0.4}
    rows = [row("whirl", verdict, **outside) for verdict in ("unnamed", "undecided", "consistent")]
    rows += [row("whirl", "unnamed", outside=True, closed=0.6), row("whirl", "cause", finding("coulomb"), **outside)]
    assert [exact(r) for r in rows] == [True, True, False, True, False]
    lines = [" ".join(line.split("(")[0].split()) for line in table(rows).splitlines()]
    assert "outside: none named 3 of 5 = 60%" in lines and "a map half closes it 1 of 2 = 50%" in lines
    assert "cause named exactly none drawn" in lines


def test_a_table_of_nothing_but_failures_still_prints():
    assert "seconds, median none" in " ".join(table([FAILED]).split())


def test_the_page_shows_whom_what_was_taken_for_and_the_figures_stand_beside_it(tmp_path: Path):
    write_page([NAMED, RIVAL, SURE_AND_WRONG, QUIET, FAILED], tmp_path / "blind.html")
    page, plain = (tmp_path / "blind.html").read_text(), json.loads((tmp_path / "blind.json").read_text())
    assert page.count("<svg") == 3 and "quadratic_damping" in page and "seeds 1 to 7" in page
    assert "wrong with p &gt; 0.9" in page
    assert plain["cause named exactly"] == {"hits": 1, "count": 4, "low": pytest.approx(0.0456, abs=5e-5),
                                            "high": pytest.approx(0.6994, abs=5e-5)}  # fmt: skip
    assert plain["twins: mean group"] == pytest.approx(4 / 3) and plain["seconds, median"] == 2.0
    write_page([FAILED], tmp_path / "failed.html")
    assert json.loads((tmp_path / "failed.json").read_text())["seconds, median"] is None


# two hidden effects


def test_of_two_effects_both_must_be_named_in_any_order_and_nothing_else():
    assert [r for r in PAIRS if exact(r)] == [TWO]
    assert not exact(pair("cause", finding("coulomb"), finding("cubic_hardening"), finding("jenkins")))
    assert not exact(pair("cause", finding("coulomb"), finding("coulomb")))


def test_of_two_effects_each_must_be_a_finding_or_a_rival_of_another_finding():
    assert [r for r in PAIRS if in_class(r)] == [TWO, TWO_BY_RIVAL]
    one_for_both = finding("coulomb", rivals=("cubic_hardening",))
    assert not in_class(pair("cause", one_for_both)) and not in_class(pair("cause", one_for_both, finding("jenkins")))
    assert in_class(pair("cause", one_for_both, finding("jenkins", rivals=("coulomb",))))


def test_of_two_effects_one_may_be_named_with_nothing_wrong_or_beside_a_wrong_name():
    assert [r for r in PAIRS if half(r)] == [HALF]
    assert [r for r in PAIRS if wrong(r)] == [TWO_BY_RIVAL, HALF_WRONG, ALL_WRONG, BLAMED]
    assert [f["cause"] for f in wrong(HALF_WRONG)] == ["jenkins"]


def test_coverage_of_two_effects_is_that_of_each_named_one():
    assert covers(TWO) == {"cubic_hardening.k3": False, "coulomb.F": True}
    assert covers(ALL_WRONG) == {}


def test_the_table_of_two_effects_counts_each_row_where_it_belongs():
    assert hidden(TWO) == "coulomb + cubic_hardening" and said(TWO) == "cubic_hardening + coulomb"
    text = table(PAIRS)
    lines = [" ".join(line.split("(")[0].split()) for line in text.splitlines()]
    for expected in (
        "pairs 10",
        "both named exactly 1 of 10 = 10%",
        "both named or rivals 2 of 10 = 20%",
        "one named, nothing wrong 1 of 10 = 10%",
        "any wrong name 4 of 10 = 40%",
        "undecided 1 of 10 = 10%",
        "left unnamed 1 of 10 = 10%",
        "called consistent 1 of 10 = 10%",
        "own values blamed alone 1 of 10 = 10%",
        "intervals that cover 1 of 2 = 50%",
        "names right where p > 0.9 5 of 7 = 71%",
        "1 x coulomb + cubic_hardening -> coulomb + jenkins",
        "coulomb 4 of 10 = 40%",
        "cubic_hardening 1 of 10 = 10%",
        "seed 1: coulomb + cubic_hardening: ValueError: no",
    ):
        assert expected in lines
    sure = text[text.index("wrong with p > 0.9") : text.index("no answer")]
    assert "seed 8: coulomb + cubic_hardening -> coulomb + jenkins, p = 0.970, sweep, x, noise 0.01" in sure
    assert "seed 9" in sure and sure.count("seed") == 2
    assert table([TWO_FAILED, TWO]).startswith("pairs")


# two masses


CHAIN = row("coulomb", "cause", finding("coulomb", F=(1.9, 2.1)), parameters={"F": 2.0}, chain=True)
ELSEWHERE = CHAIN | {"findings": [finding("coulomb", F=(1.9, 2.1)) | {"at": [1, 2]}], "seed": 2}
ITS_FAMILY = CHAIN | {"findings": [finding("quadratic_damping")]}
CHAIN_VALUE = VALUE | {"chain": True}
VALUE_ELSEWHERE = CHAIN_VALUE | {"at": [1, 2]}


def test_in_a_chain_the_place_is_right_or_wrong_by_itself():
    rows = [CHAIN, ELSEWHERE, ITS_FAMILY, CHAIN_VALUE, VALUE_ELSEWHERE, CHAIN | {"findings": []}]
    assert [placed(r) for r in rows] == [True, False, True, True, False, False]
    assert [exact(r) for r in rows] == [True, True, False, True, True, False]
    assert covers(CHAIN) == {"F": True} and covers(ELSEWHERE) == {}


def test_the_table_counts_places_where_there_were_two_masses():
    text = table([CHAIN, ELSEWHERE, ITS_FAMILY, CHAIN_VALUE, VALUE_ELSEWHERE, NAMED])
    lines = [" ".join(line.split("(")[0].split()) for line in text.splitlines()]
    for expected in (
        "cause named exactly 3 of 4 = 75%",
        "cause named at its place 1 of 3 = 33%",
        "place, cause right 1 of 2 = 50%",
        "place, family right 2 of 3 = 67%",
        "place, value right 1 of 2 = 50%",
    ):
        assert expected in lines
    assert "place" not in table([NAMED, RIVAL])


def test_in_a_chain_a_line_tells_the_places():
    assert "coulomb at 0-1 -> coulomb at 1-2 p=0.99" in blind.progress_line(ELSEWHERE, 1, 1, 1.0)
    nothing = row("none", "consistent", at=[], chain=True)
    assert "none -> consistent  2.0 s" in blind.progress_line(nothing, 1, 1, 1.0)
    late = row("force_delay", "cause", finding("accel_gain") | {"at": ["acceleration", 2]}, at=["force", 1], chain=True)
    assert "seed 1: force_delay at force-1 -> accel_gain at acceleration-2, p = 0.990" in table([late])


def test_the_causes_are_hidden_in_a_chain_where_the_drawing_says_so(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(blind, "diagnosed", lambda challenge: diagnosis(None))
    drawing = {"causes": ["force_gain"], "excitation": ["harmonic"], "channels": ["xx"], "chain": True}
    result = blind.examine(0, drawing)
    assert result["drawing"] == drawing and json.loads(json.dumps(result)) == result
    assert result["chain"] and result["cause"] == "force_gain" and result["at"] == ["force", result["driven"]]
    assert result["links"][:2] == [[0, 1], [1, 2]] and not exact(result)


def test_only_a_call_for_a_chain_draws_one(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    drawings = []
    monkeypatch.setattr(blind, "run", lambda seeds, drawing, *others: drawings.append(drawing) or [])
    blind.main(["--causes", "coulomb", "clipping"])
    blind.main(["--causes", "coulomb", "clipping", "--chain"])
    assert "chain" not in drawings[0] and drawings[0]["channels"] == ["xva", "x", "a"]
    assert drawings[1]["chain"] and drawings[1]["causes"] == ["coulomb"] and "xx" in drawings[1]["channels"]
    for wrong_call, words in (
        (["--chain", "--two"], "--chain must stand without"),
        (["--channels", "xx"], "--channels must be of xva, x, a; got xx"),
    ):
        with pytest.raises(SystemExit):
            blind.main(wrong_call)
        assert words in capsys.readouterr().err


def diagnosis(gain: SimpleNamespace | None) -> SimpleNamespace:
    estimate = SimpleNamespace(value=2.0, low=1.9, high=2.1, unit="N")
    rival = SimpleNamespace(cause="quadratic_damping", at=(0, 1), probability=0.04)
    found = SimpleNamespace(
        cause="coulomb", at=(0, 1), probability=0.96, parameters={"F": estimate}, rivals=(rival,), sentence="sticks"
    )
    named = SimpleNamespace(why="named", kappa=0.97, left=0.01, whiteness=0.2, unfit=4.0)
    return SimpleNamespace(verdict="cause", findings=(found,), candidates=(named,), gain=gain)


def test_a_diagnosis_becomes_plain_types():
    answer = blind.answer(diagnosis(SimpleNamespace(closed=0.98, interval=(0.9, 1.0), closable=True)))
    assert json.loads(json.dumps(answer)) == answer
    assert answer["findings"][0]["parameters"] == {"F": {"value": 2.0, "low": 1.9, "high": 2.1}}
    assert answer["findings"][0]["rivals"] == [{"cause": "quadratic_damping", "at": [0, 1], "probability": 0.04}]
    assert answer["closed"] == 0.98 and answer["interval"] == [0.9, 1.0]
    assert answer["named"] == {"kappa": 0.97, "left": 0.01, "whiteness": 0.2, "unfit": 4.0}
    assert blind.answer(diagnosis(None))["closed"] is None
    nothing = SimpleNamespace(closed=0.0, interval=(0.0, 0.0), closable=False)
    assert blind.answer(diagnosis(nothing))["closed"] is None


def test_a_diagnosis_that_fails_becomes_a_row_with_its_error(monkeypatch: pytest.MonkeyPatch):
    def broken(challenge):
        raise ValueError("no such thing")

    monkeypatch.setattr(blind, "diagnosed", broken)
    result = blind.examine(0, {"causes": ["force_gain"], "excitation": ["harmonic"]})
    assert (result["verdict"], result["error"], result["cause"]) == (
        "failed",
        "ValueError: no such thing",
        "force_gain",
    )
    assert json.loads(json.dumps(result)) == result
    assert not exact(result)


def test_two_of_the_causes_are_hidden_where_the_drawing_says_so(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(blind, "diagnosed", lambda challenge: diagnosis(None))
    drawing = {"causes": ["preload", "accel_bias", "none"], "excitation": ["harmonic"], "two": True}
    result = blind.examine(0, drawing)
    assert (result["cause"], result["beside"]["cause"]) == ("preload", "accel_bias")
    assert result["drawing"] == drawing and json.loads(json.dumps(result))["beside"]["parameters"]
    assert half(result) is False and exact(result) is False
    assert "beside" not in blind.examine(0, {"causes": ["force_gain"], "excitation": ["harmonic"]})


def test_only_a_call_for_two_effects_draws_them(monkeypatch: pytest.MonkeyPatch):
    drawings = []
    monkeypatch.setattr(blind, "run", lambda seeds, drawing, *others: drawings.append(drawing) or [])
    blind.main(["--causes", "coulomb", "maxwell"])
    blind.main(["--causes", "coulomb", "maxwell", "--two"])
    blind.main(["--outside"])
    assert drawings.pop()["causes"] == list(OUTSIDE)
    assert "two" not in drawings[0] and drawings[1] == drawings[0] | {"two": True}


def test_a_repeated_call_examines_only_the_seeds_that_are_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    asked = []

    def answers(seeds, drawing, jobs, cards=None):
        for seed in seeds:
            asked.append(seed)
            yield row("none", "consistent", seed=seed, drawing=drawing)

    monkeypatch.setattr(blind, "answers", answers)
    drawing, out, told = {"noise": [0.01]}, tmp_path / "rows.jsonl", []
    assert len(blind.run(range(0, 2), drawing, 1, out, told.append)) == 2
    rows = blind.run(range(1, 4), drawing, 1, out, told.append)
    assert asked == [0, 1, 2, 3]
    assert sorted(r["seed"] for r in rows) == [1, 2, 3]
    assert [json.loads(line)["seed"] for line in out.read_text().splitlines()] == [0, 1, 2, 3]
    assert told[2] == "1 done before, 2 to do"
    assert len(blind.run(range(1, 4), drawing, 1, out, told.append)) == 3 and asked == [0, 1, 2, 3]


def test_a_seed_without_a_fair_challenge_is_left_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def drawn(seed, drawing):
        if seed == 1:
            raise blind.UnfairError("no fair coulomb")
        return blind.draw(seed, causes="none", channels="x", excitation="free_decay")

    monkeypatch.setattr(blind, "drawn", drawn)
    monkeypatch.setattr(blind, "diagnosed", lambda challenge: None)
    monkeypatch.setattr(
        blind, "answers", lambda seeds, drawing, jobs, cards=None: (blind.examine(seed, drawing) for seed in seeds)
    )
    out, told = tmp_path / "rows.jsonl", []
    assert [row["seed"] for row in blind.run(range(3), {}, 1, out, told.append)] == [0, 2]
    assert len(out.read_text().splitlines()) == 2
    assert told[1] == "seed 1 is left out: no fair coulomb"


def test_what_is_done_is_kept_when_the_examination_is_interrupted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def answers(seeds, drawing, jobs, cards=None):
        yield row("none", "consistent", seed=0, drawing=drawing)
        raise KeyboardInterrupt

    monkeypatch.setattr(blind, "answers", answers)
    out, told = tmp_path / "rows.jsonl", []
    assert len(blind.run(range(0, 2), {}, 1, out, told.append)) == 1
    assert len(out.read_text().splitlines()) == 1
    assert told[-1] == "stopped; what is done is counted below and kept"


def test_a_file_of_another_drawing_is_refused(tmp_path: Path):
    out = tmp_path / "rows.jsonl"
    out.write_text(json.dumps(row("none", "consistent", drawing={"noise": [0.01]})) + "\n")
    with pytest.raises(ValueError, match=r"`--out` must name a new file .* was drawn with {'noise': \[0.01\]}"):
        blind.run(range(2), {"noise": [0.05]}, 1, out, print)


def test_a_line_of_progress_tells_the_time_left():
    line = blind.progress_line(NAMED, done=2, total=10, elapsed=60.0)
    assert line == "[ 2/10] ok    seed 1: coulomb -> coulomb p=0.99  2.0 s, 4.0 min left"
    assert "WRONG seed 7: coulomb -> quadratic_damping p=0.97" in blind.progress_line(SURE_AND_WRONG, 1, 1, 1.0)
    two = "ok    seed 1: coulomb + cubic_hardening -> cubic_hardening + coulomb p=0.99 0.99"
    assert two in blind.progress_line(TWO, 1, 1, 1.0)
