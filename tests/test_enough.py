"""Whether a search goes on, over trials that are made up."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import jfsm
from jfsm.diagnosis.evidence.own_values import at_bounds, prior_cost
from jfsm.diagnosis.evidence.prediction import Prediction
from jfsm.diagnosis.evidence.scorecard import OtherShapes
from jfsm.diagnosis.hypotheses.effect import Effect
from jfsm.diagnosis.search.stopping import settled, something_left
from jfsm.diagnosis.search.study import shows_later
from jfsm.identification import Unknown

NOISE = 1e-4


def trial(evidence: float, power: float, *causes: str) -> Any:
    """A hypothesis that leaves so much power beyond noise on the fitted samples and on the others."""
    error = np.full(2, power + NOISE)
    return SimpleNamespace(
        evidence=evidence,
        prediction=Prediction(error, np.full(2, NOISE), np.full(2, NOISE / 10)),
        effects=tuple(Effect(jfsm.structures.causes()[cause], (0, 1)) for cause in causes),
        laws=(),
        unknowns=(),
        theta=np.zeros(0),
        structure=SimpleNamespace(terms=()),
        whiteness=0.0 if power == 0 else 0.4,
        noise_scale=0.0,
    )


GIVEN, REFITTED = trial(0.0, 0.5), trial(1000.0, 0.1)


def test_correlated_innovations_alone_are_no_reason_to_look_for_a_second_effect():
    refitted, best = trial(0.0, 0.1), trial(9000.0, 2e-4, "coulomb")
    assert best.whiteness > 0.1
    assert not something_left([refitted, best], refitted, lambda t: OtherShapes(6.0), imposed=False)


@pytest.mark.parametrize(("left", "worth"), [(1.5e-3, False), (2.5e-3, True)])
def test_a_second_effect_is_looked_for_where_more_is_left_than_chance_leaves(left: float, worth: bool):
    refitted, best = trial(0.0, 1.0), trial(9000.0, left, "coulomb")
    scatter = np.full(2, 5e-4)
    best.prediction = Prediction(best.prediction.error, best.prediction.expected, scatter)
    assert something_left([refitted, best], refitted, lambda t: OtherShapes(0.0), imposed=False) == worth


def leaving(t: Any, *power: float) -> Any:
    """The trial with so much power beyond noise on either part of the record."""
    t.prediction = Prediction(np.array(power) + NOISE, np.full(2, NOISE), np.full(2, NOISE / 10))
    return t


@pytest.mark.parametrize(("ahead", "later"), [(0.0, False), (2.0, False), (5.0, True)])
def test_what_a_trial_leaves_later_is_lacking_unless_another_as_likely_leaves_nothing_there(ahead, later):
    single, pair = trial(9000.0, 0.0, "stiffness_drop"), trial(9000.0 + ahead, 0.0, "end_stop", "stiffness_drop")
    assert shows_later([REFITTED, single, leaving(pair, 0.0, 0.02)]) == later


@pytest.mark.parametrize(
    ("gained", "left", "nats", "worth"),
    [
        (9000.0, 3e-4, 18.0, False),
        (9000.0, 3e-4, 22.0, True),
        (9000.0, 0.0, 12.0, False),
        (9000.0, 0.0, 18.0, True),
    ],
)
def test_a_second_effect_is_looked_for_where_little_is_left_but_other_shapes_would_explain_much(
    gained, left, nats, worth
):
    refitted, best = trial(0.0, 1.0), trial(gained, left, "coulomb")
    assert something_left([refitted, best], refitted, lambda t: OtherShapes(nats), imposed=False) == worth


def test_a_prediction_whose_filter_says_it_knows_nothing_explains_nothing():
    refitted = Prediction(np.array([0.01, 0.003]), np.full(2, 1e-6), np.full(2, 1e-7))
    lost = Prediction(np.array([1e-6, 0.0029]), np.array([1e-6, 1e3]), np.array([1e-7, 1e2]))
    assert lost.left() == 0.0 and lost.bounded_by(refitted).left() > 0.02
    known = Prediction(np.array([1e-6, 2e-6]), np.full(2, 2e-6), np.full(2, 1e-7))
    assert known.bounded_by(refitted).left() == known.left() == 0.0


@pytest.mark.parametrize(
    ("left", "otherwise", "enough"),
    [(0.0, "", True), (0.0, "it is another law", False), (0.01, "", False), (0.03, "", False)],
)
def test_the_search_is_settled_by_a_law_that_leaves_noise_only_and_is_what_it_is_called(left, otherwise, enough):
    best = trial(9000.0, left, "coulomb")
    best.laws = (SimpleNamespace(at=(0, 1), otherwise=lambda stiffness: otherwise),)
    best.structure = SimpleNamespace(stiffness_of=lambda at: 1.0)
    assert settled([GIVEN, REFITTED, best], lambda t: OtherShapes(0.0)) == enough


@pytest.mark.parametrize(
    ("left", "nats", "enough"),
    [(3e-4, 6.0, True), (3e-4, 16.0, False), (3e-4, 0.0, False), (3e-3, 6.0, False)],
    ids=["of the right shape", "of another shape", "nobody knows", "much is left"],
)
def test_innovations_that_no_force_explains_settle_the_search(left, nats, enough):
    best = trial(9000.0, left, "coulomb")
    assert best.whiteness > 0.1
    assert settled([GIVEN, REFITTED, best], lambda t: OtherShapes(nats)) == enough


@pytest.mark.parametrize(
    ("path", "width", "theta", "there"),
    [
        ("stiffness@0-1.k", 0.2, -3.9, True),
        ("stiffness@0-1.k", 0.2, -3.8, False),
        ("stiffness@0-1.k", 0.7, -3.9, False),
        ("stiffness@0-1.k", 0.7, 3.9, True),
        ("damping@0-1.c", 0.2, 3.9, True),
        ("damping@0-1.c", 0.2, -3.9, False),
    ],
)
def test_an_own_value_that_went_as_far_as_it_may_is_at_its_bound(path: str, width: float, theta: float, there: bool):
    found = trial(9000.0, 0.0, "coulomb")
    found.unknowns = (Unknown(path, 0.0, 1.0, True, 0.0, width, degrees=4.0, low=-3.9, high=3.9),)
    found.theta = np.array([theta])
    assert at_bounds(found) == ({path} if there else set())
    assert prior_cost(found) > 0


@pytest.mark.parametrize(("theta", "there"), [(1.0, False), (2.0, True)])
def test_a_sensors_fault_that_is_as_large_as_it_may_be_is_at_its_bound(theta: float, there: bool):
    found = trial(1040.0, 0.0, "force_gain")
    found.unknowns = (Unknown("force_gain@force-1.eps", 0.0, 1.0, True, 0.0, 1.0, low=-5.0, high=2.0),)
    found.theta = np.array([theta])
    assert bool(at_bounds(found)) == there
