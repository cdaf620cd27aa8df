"""The verdict over trials that are made up."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from jfsm.diagnosis._decide import Decision, decide, first_alone

import jfsm
from jfsm.diagnosis._clipped import beside_clipping
from jfsm.diagnosis._diagnose import _closes_too_little, _speaks_against
from jfsm.diagnosis._effect import Effect
from jfsm.diagnosis._enough import settled, something_left
from jfsm.diagnosis._gain import Gain
from jfsm.diagnosis._lack_of_fit import Unfit
from jfsm.diagnosis._study import shows_later
from jfsm.diagnosis._trial import Prediction
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
        noise=np.zeros(1),
        trusted=np.ones(1, bool),
    )


GIVEN, REFITTED = trial(0.0, 0.5), trial(1000.0, 0.1)


def shares(*tried: Any) -> list[float]:
    decision = decide(GIVEN, REFITTED, tried, lambda t: None, lambda t: Unfit(0.0), periods=100.0)
    assert decision.verdict == "cause" and decision.winner is tried[0]
    return [decision.share(t) for t in tried]


@pytest.mark.parametrize("left", [0.002, 0.01, 0.015])
def test_a_cause_that_leaves_something_is_no_surer_than_the_share_that_it_explains(left: float):
    found, rival = shares(trial(9000.0, left, "coulomb"), trial(8000.0, 0.04, "quadratic_damping"))
    assert 0.9 * (1 - left / 0.1) < found <= 1 - left / 0.1 and rival < 0.1


def test_a_cause_that_leaves_nothing_is_as_sure_as_its_evidence():
    found, rival = shares(trial(9000.0, 0.0, "coulomb"), trial(8000.0, 0.04, "quadratic_damping"))
    assert found > 0.995 and rival < 0.005


def test_a_cause_is_the_less_sure_the_more_other_shapes_would_gain_beside_it():
    def share(nats: float) -> float:
        found = trial(9000.0, 0.002, "coulomb")
        return decide(GIVEN, REFITTED, [found], lambda t: None, lambda t: Unfit(nats), periods=100.0).share(found)

    sure = share(15.0)  # what noise may gain
    assert sure > 0.95 and share(410.0) == pytest.approx(0.75 * sure, rel=1e-3)
    assert share(801.0) == pytest.approx(0.5 * sure, rel=1e-3)


@pytest.mark.parametrize(("other", "verdict"), [("cubic_hardening", "undecided"), ("smooth_coulomb", "cause")])
def test_no_cause_is_named_that_is_hardly_likelier_than_one_of_another_family_and_leaves_something(other, verdict):
    refitted = trial(1000.0, 0.04)
    tried = [trial(9000.0, 0.01, "coulomb"), trial(8990.0, 0.0105, other)]
    decision = decide(GIVEN, refitted, tried, lambda t: None, lambda t: Unfit(0.0), periods=100.0)
    assert decision.verdict == verdict
    assert 0.4 < decision.share(tried[0]) < 0.55 and 0.2 < decision.share(tried[1]) < 0.4


@pytest.mark.parametrize(
    ("nats", "left", "verdict"),
    [
        (15.0, 0.0, "cause"),
        (29.0, 0.0, "cause"),
        (46.0, 0.0, "undecided"),
        (600.0, 0.002, "cause"),
        (900.0, 0.002, "undecided"),
    ],
)
def test_no_cause_is_named_beside_which_other_shapes_would_explain_much(nats: float, left: float, verdict: str):
    found = trial(9000.0, left, "coulomb")
    decision = decide(GIVEN, REFITTED, [found], lambda t: None, lambda t: Unfit(nats), periods=100.0)
    assert decision.verdict == verdict
    if verdict == "undecided":
        assert decision.winner is REFITTED and decision.share(found) < 0.5 and "shape" in decision.why[id(found)]


@pytest.mark.parametrize(
    ("seen", "causes", "verdict"),
    [
        (0.0, ("position_damping", "lugre"), "undecided"),
        (0.0, ("position_damping",), "cause"),
        (0.0, ("position_damping", "accel_gain"), "cause"),
        (0.0, ("position_damping", "preload"), "cause"),
        (0.1, ("position_damping", "lugre"), "cause"),
    ],
)
def test_two_laws_of_which_predictions_show_nothing_are_not_named(seen: float, causes: tuple[str, ...], verdict: str):
    refitted, alone = trial(1000.0, seen), trial(1060.0, seen, "coulomb")
    found = trial(1100.0, 0.0, *causes)
    refitted.whiteness = 0.4
    decision = decide(GIVEN, refitted, [alone, found], lambda t: None, lambda t: Unfit(0.0), periods=100.0)
    assert decision.verdict == verdict
    assert ("predictions show nothing" in decision.why[id(found)]) == (verdict == "undecided")


@pytest.mark.parametrize(("share", "verdict"), [(0.4, "cause"), (0.6, "undecided")])
def test_no_cause_is_named_beside_which_other_shapes_explain_most_of_what_it_leaves(share: float, verdict: str):
    found = trial(9000.0, 0.002, "coulomb")
    decision = decide(GIVEN, REFITTED, [found], lambda t: None, lambda t: Unfit(100.0, share), periods=100.0)
    assert decision.verdict == verdict


@pytest.mark.parametrize(("left", "verdict"), [(8e-5, "cause"), (2e-4, "undecided")])
def test_the_shape_of_a_trace_does_not_speak_against_a_name(left: float, verdict: str):
    found = trial(9000.0, left, "coulomb")
    decision = decide(GIVEN, REFITTED, [found], lambda t: None, lambda t: Unfit(100.0, 0.9), periods=100.0)
    assert decision.verdict == verdict


@pytest.mark.parametrize(("left", "verdict"), [(0.004, "cause"), (0.006, "undecided")])
def test_where_a_second_effect_is_of_the_wrong_shape_the_first_is_named_if_it_explains_almost_all(left, verdict):
    first, two = trial(9000.0, left, "coulomb"), trial(9500.0, 0.0005, "coulomb", "cubic_hardening")
    tried, unfit = [first, two], {id(first): 100.0, id(two): 100.0}

    def decided(trials):
        return decide(GIVEN, REFITTED, trials, lambda t: None, lambda t: Unfit(unfit[id(t)]), periods=100.0)

    assert decided(tried).verdict == "undecided"
    decision = first_alone(decided(tried), tried, REFITTED, decided)
    assert decision.verdict == verdict and decision.why[id(two)]
    assert (decision.winner is first) == (verdict == "cause")


@pytest.mark.parametrize(("lasting", "verdict"), [(False, "consistent"), (True, "cause")])
def test_small_errors_over_some_periods_make_no_model_consistent_that_is_wrong_in_the_long_run(lasting, verdict):
    given, refitted, found = trial(0.0, 3e-4), trial(10.0, 3e-4), trial(9000.0, 3e-5, "bouc_wen")
    decision = decide(given, refitted, [found], lambda t: None, lambda t: Unfit(0.0), periods=100.0, lasting=lasting)
    assert decision.verdict == verdict


@pytest.mark.parametrize(("left", "whole"), [(0.02, True), (5.0, False)])
def test_a_map_of_the_whole_effect_stands_for_it_only_if_it_explains_that(left: float, whole: bool):
    found, beside, alone = trial(9000.0, 0.04, "coulomb"), trial(-np.inf, 0.001), trial(-np.inf, left)
    decision = decide(
        GIVEN, REFITTED, [found], lambda t: beside if t.effects else alone, lambda t: Unfit(0.0), periods=100.0
    )
    assert decision.verdict == "unnamed" and decision.winner is (alone if whole else beside)


@pytest.mark.parametrize(("nats", "verdict"), [(30.0, "consistent"), (50.0, "undecided")])
def test_a_record_is_not_called_consistent_where_other_shapes_explain_more_than_noise(nats: float, verdict: str):
    given, refitted = trial(0.0, 0.0), trial(-5.0, 0.0)
    assert decide(given, refitted, [], lambda t: None, lambda t: Unfit(nats), periods=100.0).verdict == verdict


@pytest.mark.parametrize(
    ("path", "width", "theta", "refit", "verdict"),
    [
        ("stiffness@0-1.k", 0.2, -3.9, 0.1, "undecided"),
        ("stiffness@0-1.k", 0.2, -3.8, 0.1, "cause"),
        ("stiffness@0-1.k", 0.2, -3.9, -3.9, "cause"),
        ("stiffness@0-1.k", 0.7, -3.9, 0.1, "cause"),
        ("stiffness@0-1.k", 0.7, 3.9, 0.1, "undecided"),
        ("damping@0-1.c", 0.2, 3.9, 0.1, "undecided"),
        ("damping@0-1.c", 0.2, -3.9, 0.1, "cause"),
    ],
)
def test_no_cause_is_named_beside_an_own_value_that_went_as_far_as_it_may(path, width, theta, refit, verdict):
    own = Unknown(path, 0.0, 1.0, True, 0.0, width, degrees=4.0, low=-3.9, high=3.9)
    found, refitted = trial(9000.0, 0.0, "coulomb"), trial(1000.0, 0.1)
    for t, value in ((found, theta), (refitted, refit)):
        t.unknowns, t.theta = (own,), np.array([value])
    decision = decide(GIVEN, refitted, [found], lambda t: None, lambda t: Unfit(0.0), periods=100.0)
    assert decision.verdict == verdict
    assert (path in decision.why[id(found)]) == (verdict == "undecided")


@pytest.mark.parametrize(("nats", "verdict"), [(25.0, "cause"), (29.0, "cause"), (31.0, "undecided")])
def test_of_a_small_effect_other_shapes_gain_more_than_a_share_before_noise_is_ruled_out(nats: float, verdict: str):
    found = trial(1200.0, 0.0, "coulomb")  # it gains 200 nats
    decision = decide(GIVEN, REFITTED, [found], lambda t: None, lambda t: Unfit(nats), periods=100.0)
    assert decision.verdict == verdict


@pytest.mark.parametrize(("nats", "verdict"), [(40.0, "cause"), (60.0, "undecided")])
def test_the_second_of_two_effects_must_gain_more_than_other_shapes_would(nats: float, verdict: str):
    # The pair gains 8000 nats, its second effect 1000 of them.
    single, pair = trial(8000.0, 0.02, "coulomb"), trial(9000.0, 0.0001, "coulomb", "cubic_hardening")
    found = decide(GIVEN, REFITTED, [single, pair], lambda t: None, lambda t: Unfit(nats), periods=100.0)
    assert found.verdict == verdict


@pytest.mark.parametrize(("left", "worth"), [(1.5e-3, False), (2.5e-3, True)])
def test_a_second_effect_is_looked_for_where_more_is_left_than_chance_leaves(left: float, worth: bool):
    refitted, best = trial(0.0, 1.0), trial(9000.0, left, "coulomb")
    scatter = np.full(2, 5e-4)
    best.prediction = Prediction(best.prediction.error, best.prediction.expected, scatter)
    assert something_left([refitted, best], refitted, lambda t: Unfit(0.0), imposed=False) == worth


def leaving(t: Any, *power: float) -> Any:
    """The trial with so much power beyond noise on either part of the record."""
    t.prediction = Prediction(np.array(power) + NOISE, np.full(2, NOISE), np.full(2, NOISE / 10))
    return t


@pytest.mark.parametrize(("ahead", "later"), [(0.0, False), (2.0, False), (5.0, True)])
def test_what_a_trial_leaves_later_is_lacking_unless_another_as_likely_leaves_nothing_there(ahead, later):
    single, pair = trial(9000.0, 0.0, "stiffness_drop"), trial(9000.0 + ahead, 0.0, "end_stop", "stiffness_drop")
    assert shows_later([REFITTED, single, leaving(pair, 0.0, 0.02)]) == later


@pytest.mark.parametrize(("late", "whiteness", "two"), [(0.0, 0.2, True), (1e-4, 0.2, False), (1e-4, 0.02, True)])
def test_a_second_effect_must_gain_wherever_the_first_leaves_anything_unless_the_two_leave_noise(late, whiteness, two):
    single, pair = trial(8000.0, 0.02, "coulomb"), trial(9000.0, 0.0, "coulomb", "end_stop")
    single, pair = leaving(single, 0.02, late), leaving(pair, 0.0, late)
    pair.whiteness = whiteness
    assert something_left([REFITTED, single], REFITTED, lambda t: Unfit(0.0), imposed=False)
    decision = decide(GIVEN, REFITTED, [single, pair], lambda t: None, lambda t: Unfit(0.0), periods=100.0)
    assert (decision.winner is pair) == two


@pytest.mark.parametrize(
    ("second", "left", "whiteness", "gained", "two"),
    [
        ("preload", 3e-4, 0.2, 20.0, True),  # an offset stands for it, and innovations tell
        ("preload", 3e-4, 0.2, 10.0, False),
        ("preload", 0.0, 0.05, 10.0, True),
        ("cubic_hardening", 0.0, 0.05, 20.0, True),  # noise hides it from every prediction
        ("cubic_hardening", 0.0, 0.05, 10.0, False),
        ("cubic_hardening", 3e-4, 0.2, 20.0, False),
        ("accel_bias", 1e-3, 0.2, 120.0, True),  # whatever else is left, no force makes an acceleration's mean
        ("accel_bias", 1e-3, 0.2, 40.0, False),
    ],
)
def test_a_second_effect_that_predictions_do_not_tell_is_told_by_evidence(second, left, whiteness, gained, two):
    single, pair = trial(8000.0, left, "coulomb"), trial(8000.0 + gained, left / 2, "coulomb", second)
    single.whiteness, pair.whiteness = whiteness, 0.02
    law = {"preload": (jfsm.Preload(1.0, at=(0, 1)),), "cubic_hardening": (jfsm.CubicStiffness(1.0, at=(0, 1)),)}
    offset = "acceleration" if second == "accel_bias" else "force"
    single.unknowns = (Unknown(f"offset@{offset}-1.b", 0.0, 1.0, False, 0.0, 0.2),)
    single.theta = np.array([1.0])
    single.laws, pair.laws = (jfsm.Coulomb(1.0, at=(0, 1)),), (jfsm.Coulomb(1.0, at=(0, 1)), *law.get(second, ()))
    for t in (single, pair):
        t.structure = SimpleNamespace(stiffness_of=lambda at: 1.0)
    decision = decide(GIVEN, REFITTED, [single, pair], lambda t: None, lambda t: Unfit(0.0), periods=100.0)
    assert (decision.winner is pair) == two


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
    assert something_left([refitted, best], refitted, lambda t: Unfit(nats), imposed=False) == worth


def test_a_prediction_whose_filter_says_it_knows_nothing_explains_nothing():
    refitted = Prediction(np.array([0.01, 0.003]), np.full(2, 1e-6), np.full(2, 1e-7))
    lost = Prediction(np.array([1e-6, 0.0029]), np.array([1e-6, 1e3]), np.array([1e-7, 1e2]))
    assert lost.left == 0.0 and lost.beside(refitted).left > 0.02
    known = Prediction(np.array([1e-6, 2e-6]), np.full(2, 2e-6), np.full(2, 1e-7))
    assert known.beside(refitted).left == known.left == 0.0


@pytest.mark.parametrize(("nats", "named"), [(700.0, "cubic_damping"), (900.0, None)])
def test_of_laws_alike_the_one_whose_shape_is_right_is_named(nats: float, named: str | None):
    lack = {"quadratic_damping": 900.0, "cubic_damping": nats}
    tried = [trial(9000.0, 0.002, "quadratic_damping"), trial(8990.0, 0.0021, "cubic_damping")]
    lacking = [lack[t.effects[0].cause.id] for t in tried]
    decision = decide(GIVEN, REFITTED, tried, lambda t: None, lambda t: Unfit(lacking[tried.index(t)]), periods=50.0)
    assert decision.verdict == ("cause" if named else "undecided")
    assert "shape" in decision.why[id(tried[0])]
    if named:
        assert decision.share(tried[0]) == 0.0
        assert decision.winner is tried[1] and 0.1 < decision.share(tried[1]) < 0.5 and not decision.why[id(tried[1])]


@pytest.mark.parametrize(
    ("left", "whiteness", "second", "mapped", "near"),
    [
        (0.002, 0.4, (), None, True),
        (0.02, 0.4, (), None, False),
        (0.002, 0.02, (), None, False),
        (0.002, 0.4, ("preload",), None, False),
        (0.002, 0.4, (), 0.01, True),
    ],
)
def test_a_law_of_the_wrong_shape_that_leaves_little_is_named_by_its_class_where_nothing_else_stands(
    left: float, whiteness: float, second: tuple[str, ...], mapped: float | None, near: bool
):
    found = trial(9000.0, left, "coulomb", *second)
    found.whiteness = whiteness
    maps = {id(REFITTED): None if mapped is None else trial(0.0, mapped)}
    decision = decide(GIVEN, REFITTED, [found], lambda t: maps.get(id(t)), lambda t: Unfit(5000.0), periods=100.0)
    assert decision.verdict == ("undecided" if mapped is None else "unnamed")
    assert decision.near is (found if near else None) and (decision.share(found) > 0) == near
    by_class = decision.by_class()
    assert (by_class is not None) == (near and mapped is None)
    assert by_class is None or (by_class.verdict == "cause" and by_class.winner is found)
    if mapped is not None and near:  # what a held-out run says of the map leaves the law
        refused = decision.refused("runs worse", REFITTED).by_class()
        assert refused is not None and refused.winner is found


@pytest.mark.parametrize(("strays", "named"), [((0.1, 0.1), 0), ((0.1, 0.05), 1)])
def test_of_laws_alike_of_the_wrong_shape_the_one_is_near_whose_run_strays_least(strays, named: int):
    tried = [trial(9000.0, 0.002, "quadratic_damping"), trial(8990.0, 0.0021, "cubic_damping")]
    unfit = [Unfit(5000.0, strays=far) for far in strays]
    decision = decide(GIVEN, REFITTED, tried, lambda t: None, lambda t: unfit[tried.index(t)], periods=50.0)
    shares = [decision.share(t) for t in tried]
    assert decision.near is tried[named] and shares[named] == max(shares) and 0.3 < sum(shares) < 0.5


@pytest.mark.parametrize(("forgiven", "named"), [(False, "stiffness_drift"), (True, "coulomb")])
def test_where_none_is_right_no_law_of_time_leads(forgiven: bool, named: str):
    tried = [trial(9000.0, 0.004, "coulomb"), trial(9900.0, 0.0005, "stiffness_drift")]
    tried[1].laws = (SimpleNamespace(timed=True, at=(0, 1), contains=(), otherwise=lambda stiffness: ""),)
    tried[1].structure = SimpleNamespace(terms=(), stiffness_of=lambda at: 1.0)
    decision = decide(GIVEN, REFITTED, tried, lambda t: None, lambda t: Unfit(0.0), periods=100.0, forgiven=forgiven)
    assert decision.verdict == "cause" and decision.winner.effects[0].cause.id == named


@pytest.mark.parametrize(("why_not", "verdict"), [("", "cause"), ("changes with time", "undecided")])
def test_what_the_motion_leaves_untold_is_no_finding(why_not: str, verdict: str):
    found = trial(9000.0, 0.0, "stiffness_drop")
    decision = decide(
        GIVEN, REFITTED, [found], lambda t: None, lambda t: Unfit(0.0), periods=100.0, untold=lambda t: why_not
    )
    assert decision.verdict == verdict and decision.why[id(found)] == why_not


@pytest.mark.parametrize(("theta", "verdict"), [(1.0, "cause"), (2.0, "parameters")])
def test_a_fault_of_a_sensor_that_is_as_large_as_it_may_be_is_no_finding(theta: float, verdict: str):
    found = trial(1040.0, 0.0, "force_gain")
    found.unknowns = (Unknown("force_gain@force-1.eps", 0.0, 1.0, True, 0.0, 1.0, low=-5.0, high=2.0),)
    found.theta = np.array([theta])
    refitted = trial(1000.0, 0.0)
    decision = decide(GIVEN, refitted, [found], lambda t: None, lambda t: Unfit(0.0), periods=100.0)
    assert decision.verdict == verdict
    assert ("as far from" in decision.why[id(found)]) == (verdict == "parameters")


@pytest.mark.parametrize(("power", "verdict"), [(0.0, "cause"), (0.004, "undecided")])
def test_a_load_that_may_stand_for_the_drive_yields_to_whatever_leaves_nothing(power: float, verdict: str):
    load, drift = trial(9040.0, 0.0, "periodic_disturbance"), trial(9000.0, power, "damping_drift")
    decision = decide(
        GIVEN,
        REFITTED,
        [load, drift],
        lambda t: None,
        lambda t: Unfit(0.0),
        periods=100.0,
        untold=lambda t: "keeps time" if t is load else "",
        in_step=lambda t: t is load,
    )
    assert decision.verdict == verdict
    if verdict == "cause":
        assert decision.winner is drift and decision.share(load) == 0.0 and "noisy drive" in decision.why[id(load)]


@pytest.mark.parametrize(
    ("strained", "gained", "verdict"),
    [
        ("without", 21.0, "parameters"),
        ("without", 23.0, "cause"),
        ("beside", 14.0, "parameters"),
        ("beside", 16.0, "cause"),
    ],
)
def test_a_law_is_not_named_only_because_own_values_are_far_off_without_it_or_beside_it(strained, gained, verdict):
    own = Unknown("stiffness@0-1.k", 0.0, 1.0, True, 0.0, 0.02, degrees=1.5, low=-3.9, high=3.9)
    refitted, found = trial(1000.0, 0.0), trial(1000.0 + gained, 0.0, "sine_stiffness")
    far = refitted if strained == "without" else found
    far.unknowns, far.theta = (own,), np.array([0.33])  # six nats and a half
    found.laws, found.structure = (
        (jfsm.SineStiffness(1.0, 1.0, at=(0, 1)),),
        SimpleNamespace(stiffness_of=lambda at: 1.0),
    )
    decision = decide(GIVEN, refitted, [found], lambda t: None, lambda t: Unfit(0.0), periods=100.0)
    assert decision.verdict == verdict


@pytest.mark.parametrize(
    ("causes", "gained", "verdict"),
    [
        (("coulomb",), -20.0, "cause"),
        (("coulomb",), 3.0, "cause"),
        (("coulomb",), 14.0, "undecided"),
        (("coulomb", "force_gain"), 14.0, "cause"),  # of many pairs with it one is likelier by chance
    ],
)
def test_a_gain_that_does_what_own_values_do_is_not_named_beside_a_likelier_law(causes, gained: float, verdict: str):
    refitted, gain, law = trial(1000.0, 0.0), trial(1004.0, 0.0, "force_gain"), trial(1000.0 + gained, 0.0, *causes)
    law.laws, law.structure = (jfsm.Coulomb(1.0, at=(0, 1)),), SimpleNamespace(stiffness_of=lambda at: 1.0)
    decision = decide(GIVEN, refitted, [gain, law], lambda t: None, lambda t: Unfit(0.0), periods=100.0)
    assert decision.verdict == verdict and decision.why[id(law)]
    assert (decision.share(law) > decision.share(gain)) == (verdict == "undecided")


@pytest.mark.parametrize(
    ("law", "gained", "verdict"),
    [
        (jfsm.SineStiffness(1.0, 1.0, at=(0, 1)), 14.0, "parameters"),
        (jfsm.SineStiffness(1.0, 1.0, at=(0, 1)), 16.0, "cause"),
        (jfsm.Preload(1.0, at=(0, 1)), 14.0, "cause"),
    ],
)
def test_beside_a_refit_that_leaves_nothing_a_law_must_gain_more_than_one_of_many_does_by_chance(law, gained, verdict):
    refitted, found = trial(1000.0, 0.0), trial(1000.0 + gained, 0.0, "sine_stiffness")
    found.laws, found.structure = (law,), SimpleNamespace(stiffness_of=lambda at: 1.0)
    decision = decide(GIVEN, refitted, [found], lambda t: None, lambda t: Unfit(0.0), periods=100.0)
    assert decision.verdict == verdict


@pytest.mark.parametrize(("behind", "named"), [(0.05, "coulomb"), (0.5, "coulomb_asymmetric")])
def test_numbers_that_a_record_does_not_show_are_not_named(behind: float, named: str):
    general, special = trial(9000.0, 0.0, "coulomb_asymmetric"), trial(9000.0 - behind, 0.0, "coulomb")
    general.laws, special.laws = (jfsm.CoulombAsymmetric(1.0, 1.1, at=(0, 1)),), (jfsm.Coulomb(1.0, at=(0, 1)),)
    for t in (general, special):
        t.structure = SimpleNamespace(stiffness_of=lambda at: 1.0)
    decision = decide(GIVEN, REFITTED, [general, special], lambda t: None, lambda t: Unfit(0.0), periods=100.0)
    assert decision.winner.effects[0].cause.id == named and not decision.why[id(decision.winner)]
    other = special if decision.winner is general else general
    assert decision.why[id(other)] and decision.share(other) > 0.3


@pytest.mark.parametrize(
    ("left", "otherwise", "enough"),
    [(0.0, "", True), (0.0, "it is another law", False), (0.01, "", False), (0.03, "", False)],
)
def test_the_search_is_settled_by_a_law_that_leaves_noise_only_and_is_what_it_is_called(left, otherwise, enough):
    best = trial(9000.0, left, "coulomb")
    best.laws = (SimpleNamespace(at=(0, 1), otherwise=lambda stiffness: otherwise),)
    best.structure = SimpleNamespace(stiffness_of=lambda at: 1.0)
    assert settled([GIVEN, REFITTED, best]) == enough


@pytest.mark.parametrize(("forgiven", "verdict"), [(False, "unnamed"), (True, "cause")])
def test_where_none_is_right_a_map_of_the_rest_does_not_speak_against_a_law_that_explains_nearly_all(forgiven, verdict):
    found = trial(9000.0, 0.004, "coulomb")
    mapped = trial(-np.inf, 0.001)
    decision = decide(
        GIVEN, REFITTED, [found], lambda t: mapped, lambda t: Unfit(0.0), periods=100.0, forgiven=forgiven
    )
    assert decision.verdict == verdict


@pytest.mark.parametrize(
    ("nats", "left", "verdict"),
    [(15.0, 0.0, "parameters"), (55.0, 0.0, "undecided"), (150.0, 1e-3, "parameters"), (250.0, 1e-3, "undecided")],
)
def test_own_values_are_not_the_cause_where_other_shapes_would_explain_more(nats: float, left: float, verdict: str):
    refitted = trial(10_000.0, left)
    decision = decide(GIVEN, refitted, [], lambda t: None, lambda t: Unfit(nats), periods=100.0)
    assert decision.verdict == verdict and decision.winner is refitted
    assert (decision.share(refitted) > 0.5) == (verdict == "parameters")


@pytest.mark.parametrize(
    ("verdict", "channel", "then"),
    [
        ("consistent", "displacement", "cause"),
        ("undecided", "displacement", "cause"),
        ("unnamed", "displacement", "unnamed"),
        ("unnamed", "force", "cause"),
    ],
)
def test_clipped_channels_are_a_cause_whatever_else_cannot_be_told(verdict: str, channel: str, then: str):
    decision = Decision(verdict, GIVEN, {}, {}, {})
    assert beside_clipping(decision, [jfsm.Clipping(1.0, at=(channel, 1))], REFITTED).verdict == then


@pytest.mark.parametrize(
    ("probability", "left", "low", "named"),
    [(0.4, 0.002, -0.1, False), (0.6, 0.002, -0.1, True), (0.4, 0.0, -0.1, True), (0.4, 0.002, 0.2, True)],
)
def test_an_unlikely_cause_that_leaves_something_must_be_confirmed_by_held_out_readings(probability, left, low, named):
    winner = trial(9000.0, left, "coulomb")
    gain = Gain(before=0.1, refitted=0.1, after=0.08, floor=0.01, channels={}, interval=(low, 0.6))
    decision = Decision("cause", winner, {id(winner): probability}, {}, {})
    assert bool(_speaks_against(gain, decision, 20.0)) != named


@pytest.mark.parametrize(
    ("verdict", "lasting", "after", "stands"),
    [
        ("unnamed", False, 0.2, True),
        ("unnamed", False, 20.0, False),
        ("cause", False, 0.7, True),
        ("cause", True, 0.7, False),
        ("cause", True, 0.2, True),
    ],
)
def test_what_held_out_runs_speak_against_does_not_stand(verdict: str, lasting: bool, after: float, stands: bool):
    winner = trial(9000.0, 0.002, "coulomb")
    gain = Gain(before=1.0, refitted=1.0, after=after, floor=0.01 * after, channels={}, interval=(0.2, 0.6))
    decision = Decision(verdict, winner, {id(winner): 0.9}, {}, {})
    assert bool(_speaks_against(gain, decision, 20.0, lasting=lasting)) != stands


@pytest.mark.parametrize(
    ("left", "after", "high", "stands"),
    [(0.01, 1.3, -0.1, False), (0.01, 1.3, 0.1, True), (0.0, 1.3, -0.1, True), (0.0, 1.6, -0.1, False)],
)
def test_a_cause_that_leaves_something_does_not_stand_where_it_runs_worse(left, after, high, stands):
    winner = trial(9000.0, left, "attached_oscillator")
    gain = Gain(before=1.0, refitted=1.0, after=after, floor=0.01, channels={}, interval=(-0.5, high))
    assert bool(_speaks_against(gain, Decision("cause", winner, {id(winner): 0.9}, {}, {}), 20.0)) != stands


@pytest.mark.parametrize(
    ("verdict", "left", "high", "half"),
    [
        ("cause", 0.01, 0.4, True),
        ("cause", 0.01, 0.6, False),
        ("cause", 0.0, 0.4, False),
        ("unnamed", 0.01, 0.4, False),
    ],
)
def test_a_cause_that_leaves_more_than_noise_and_closes_less_than_half_is_open(verdict, left, high, half):
    winner = trial(9000.0, left, "coulomb")
    gain = Gain(before=1.0, refitted=1.0, after=0.7, floor=0.01, channels={}, interval=(0.2, high))
    assert _closes_too_little(gain, Decision(verdict, winner, {id(winner): 0.9}, {}, {})) == half


@pytest.mark.parametrize(
    ("gained", "refit", "whiteness", "left", "verdict"),
    [
        (394.0, 0.12, 0.02, 0.0, "cause"),
        (394.0, 0.05, 0.02, 0.0, "parameters"),
        (10.0, 0.12, 0.02, 0.0, "consistent"),
        (394.0, 0.12, 0.2, 0.0, "consistent"),
        (394.0, 0.12, 0.02, 5e-3, "undecided"),
    ],
)
def test_where_predictions_leave_nothing_evidence_alone_may_name_what_alone_leaves_but_noise(
    gained: float, refit: float, whiteness: float, left: float, verdict: str
):
    given, refitted, found = trial(-50.0, left), trial(0.0, left), trial(gained, 0.0, "preload")
    refitted.whiteness, found.whiteness = refit, whiteness
    found.prediction = refitted.prediction
    decision = decide(given, refitted, [found], lambda t: None, lambda t: Unfit(0.0), periods=100.0)
    assert decision.verdict == verdict


@pytest.mark.parametrize(
    ("law", "gained", "verdict"),
    [
        (jfsm.Preload(1.0, at=(0, 1)), 20.0, "cause"),
        (jfsm.Preload(1.0, at=(0, 1)), 10.0, "consistent"),
        (jfsm.SineStiffness(1.0, 1.0, at=(0, 1)), 20.0, "consistent"),
    ],
)
def test_a_constant_force_that_an_offset_stands_for_is_told_by_evidence_alone(law, gained: float, verdict: str):
    given, found = trial(-2.0, 0.0), trial(gained, 0.0, "preload")
    found.laws, found.structure = (law,), SimpleNamespace(stiffness_of=lambda at: 1.0)
    decision = decide(given, trial(0.0, 0.0), [found], lambda t: None, lambda t: Unfit(0.0), periods=100.0)
    assert decision.verdict == verdict


@pytest.mark.parametrize(
    ("kappa", "low", "ahead", "named"),
    [(0.0, 0.3, 20.0, True), (0.0, -0.3, 20.0, False), (0.6, -0.3, 20.0, True), (0.0, -0.3, 40.0, True)],
)
def test_what_no_prediction_shows_is_named_if_the_held_out_run_confirms_it_or_it_is_surely_there(
    kappa: float, low: float, ahead: float, named: bool
):
    winner = trial(9000.0, 0.0, "preload")
    winner.laws = (jfsm.Preload(1.0, at=(0, 1)),)
    gain = Gain(before=0.2, refitted=0.05, after=0.05, floor=0.05, channels={}, interval=(low, 1.0))
    decision = Decision("cause", winner, {id(winner): 1.0}, {id(winner): kappa}, {})
    assert bool(_speaks_against(gain, decision, ahead)) != named


@pytest.mark.parametrize(("behind", "verdict"), [(4.0, "parameters"), (0.5, "undecided")])
def test_own_values_are_not_the_cause_where_something_else_is_as_likely(behind: float, verdict: str):
    refitted = trial(10_000.0, 0.0)
    rivals = [trial(10_000.0 - behind, 0.0, cause) for cause in ("force_gain", "accel_gain")]
    decision = decide(GIVEN, refitted, rivals, lambda t: None, lambda t: Unfit(0.0), periods=100.0)
    assert decision.verdict == verdict
