"""What the checks of a verdict say: one name of a cause, one way to write its place, and sentences that parse."""

import numpy as np
import pytest
from test_verdict import CAUSES, FRICTION, RIGHT, card, evidence_of, held, judged, refit, rows_of

from jfsm.diagnosis.evidence.scorecard import GIVEN, REFITTED, OtherShapes
from jfsm.diagnosis.hypotheses.effect import Effect
from jfsm.diagnosis.nats import gains, many
from jfsm.diagnosis.report.sentences import verdict_advice
from jfsm.diagnosis.thresholds import THRESHOLDS
from jfsm.diagnosis.verdict.claims import words
from jfsm.diagnosis.verdict.decision import Decision
from jfsm.diagnosis.verdict.judge import judge


def said(decision: Decision, name: str, of: str) -> str:
    return rows_of(decision, name, of)[-1].says


@pytest.mark.parametrize(
    ("cause", "at", "label"),
    [
        ("jenkins", (0, 1), "Jenkins slider at link ground–1"),
        ("coulomb", (1, 2), "Coulomb friction at link 1–2"),
        ("accel_gain", ("acceleration", 2), "accelerometer gain at acceleration channel 2"),
    ],
)
def test_a_cause_has_the_name_and_the_place_that_tables_give_it(cause: str, at: tuple, label: str):
    assert Effect(CAUSES[cause], at).label == label


def test_a_class_has_the_same_place():
    assert words((((0, 1), "dry friction"),)) == "dry friction at link ground–1"


@pytest.mark.parametrize(
    ("nats", "words"),
    [(25.0, "gains 25 nats"), (-19049.0, "loses more than 10,000 nats"), (994374.0, "gains more than 10,000 nats")],
)
def test_more_nats_than_tell_anything_are_not_shown(nats: float, words: str):
    assert gains(nats) == words and many(9999.0) == "9,999"


def test_the_factor_that_makes_a_leader_less_sure_names_it():
    decision = judged(card(9000.0, 0.002, "coulomb"))
    names = [factor.name for factor in decision.factors[REFITTED]]
    assert "share of the excess that Coulomb friction at link ground–1 explains" in names


@pytest.mark.parametrize(
    ("imposed", "error", "reason"), [(False, "its error on held-out", "runs"), (True, "its error of the", "predicts")]
)
def test_what_is_worse_on_held_out_readings_has_the_errors_that_were_compared(imposed: bool, error: str, reason: str):
    decision = judged(RIGHT, held_out=held(3.96, before=0.57, floor=0.35), imposed=imposed)
    told = said(decision, "not_worse", FRICTION)
    assert told.startswith(error)
    assert told.endswith(
        "on held-out readings is 396% of the signal; the model as given has 57%, noise leaves 35%: 6.95 times the "
        "larger; 1.5 at most"
    )
    assert decision.reasons[FRICTION] == f"{reason} worse on held-out readings than the model as given"


@pytest.mark.parametrize("imposed", [False, True])
def test_a_model_that_falls_out_of_step_does_so_in_a_run_or_in_its_force(imposed: bool):
    evidence = evidence_of(card(0.0, 0.0, key=GIVEN), refit(-5.0, 0.0), held_out=held(0.5, before=0.5), imposed=imposed)
    told = said(judge(evidence), "stays_in_step", "model")
    assert told.startswith("the force predicted over all held-out" if imposed else "a run over all held-out")


@pytest.mark.parametrize(
    ("shapes", "imposed", "words"),
    [
        (OtherShapes(0.0), True, "no score test can be made along an imposed motion"),
        (OtherShapes(0.0, strays=np.inf), False, "its motion over what was fitted runs away"),
        (OtherShapes(3.0), False, "forces of other shapes would gain 3 nats beside it"),
    ],
)
def test_a_shape_that_was_not_tested_is_said_to_be_so(shapes: OtherShapes, imposed: bool, words: str):
    assert words in said(judged(RIGHT, shapes=shapes, imposed=imposed), "right_shape", FRICTION)


@pytest.mark.parametrize(
    ("mine", "refitted", "advice"),
    [
        (("stiffness@0-1.k",), (), "Look up stiffness@0-1.k of the model"),
        (("stiffness@0-1.k",), ("stiffness@0-1.k",), "Record a second run"),
        ((), (), "Record a second run"),
    ],
)
def test_a_law_that_needs_another_value_of_the_model_s_own_is_an_occasion_to_look_it_up(mine, refitted, advice):
    law = card(9000.0, 0.05, "coulomb", at_bounds=mine)  # it leaves much
    evidence = evidence_of(refit(1000.0, 0.1, at_bounds=refitted), law, shapes=5000.0)
    decision = judge(evidence, THRESHOLDS)
    assert decision.verdict == "undecided"
    assert verdict_advice(decision, None, evidence).startswith(advice)


@pytest.mark.parametrize(
    ("mine", "refitted", "words"),
    [
        ((), (), "takes no own value to a bound"),
        (("mass@1.m",), ("mass@1.m",), "takes mass@1.m to a bound, as the refitted model does, too"),
        (("mass@1.m",), (), "takes mass@1.m as far from what the model states as a value may be"),
    ],
)
def test_own_values_at_a_bound_are_said_to_be_there(mine: tuple, refitted: tuple, words: str):
    decision = judged(refit(1000.0, 0.1, at_bounds=refitted), card(9000.0, 0.0, "coulomb", at_bounds=mine))
    assert said(decision, "own_values_within_bounds", FRICTION) == words
