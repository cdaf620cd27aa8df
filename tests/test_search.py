"""The fits behind a diagnosis: how hypotheses are followed to their tops."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import jfsm
from jfsm._limit import UNLIMITED
from jfsm.diagnosis.evidence.prediction import Prediction
from jfsm.diagnosis.evidence.score_test import Replaced, gains
from jfsm.diagnosis.evidence.setup import Problem
from jfsm.diagnosis.hypotheses.candidate import Candidate
from jfsm.diagnosis.hypotheses.candidates import candidates, chosen_causes
from jfsm.diagnosis.hypotheses.effect import Effect
from jfsm.diagnosis.hypotheses.initial_values import Begin, Start, begun
from jfsm.diagnosis.hypotheses.parametrisation import hypothesis
from jfsm.diagnosis.hypotheses.placement import Laws
from jfsm.diagnosis.search import batches, climbing, rounds
from jfsm.diagnosis.search.baseline import fit_model, refit_from
from jfsm.diagnosis.search.batches import groups
from jfsm.diagnosis.search.climbing import Found, LeftBehind
from jfsm.diagnosis.search.pairs import crossed, instead, pairs
from jfsm.diagnosis.search.related_laws import beside_a_spring, instead_of, late_instead, special_cases
from jfsm.diagnosis.search.searches import (
    search,
    search_again,
    search_akin,
    search_pairs,
)
from jfsm.identification import prepare
from jfsm.structures import Coulomb, DeadZone, EndStop, SineStiffness, SmoothCoulomb, Stribeck, causes

MODEL = jfsm.Structure.sdof(1.0, 9.0, 0.3)


def test_a_special_case_begins_from_the_numbers_of_the_law_that_holds_it():
    begin: Begin = {("stiffness@0-1.k", None): Start(8.0, 9.0)}
    coulomb = Candidate((Effect(causes()["coulomb"], (0, 1)),), (MODEL + Coulomb(0.3, at=(0, 1)),))
    spring = Candidate((Effect(causes()["cubic_hardening"], (0, 1)),), (MODEL + jfsm.CubicStiffness(1.0, at=(0, 1)),))
    (case,) = special_cases(Stribeck(2.0, 2.5, 0.1, at=(0, 1)), begin, [coulomb, spring])
    assert case.effects == coulomb.effects
    assert case.starts[0].values() == MODEL.values() | {"coulomb@0-1.F": 2.0}
    assert case.begin is begin


@pytest.mark.parametrize(("found", "other"), [(EndStop, DeadZone), (DeadZone, EndStop)])
def test_play_in_a_spring_is_followed_from_a_stop_beside_a_softer_one_and_the_other_way(found, other):
    model, known = jfsm.Structure.sdof(2.0, 8.0, 0.1), jfsm.causes()
    among = [Candidate((Effect(known[name], (0, 1)),), (model,)) for name in ("end_stop", "dead_zone", "coulomb")]
    kept: Begin = {("mass@1", None): Start(2.1, 2.0), ("stiffness@1-2.k", None): Start(4.0, 3.0)}
    begin: Begin = {("stiffness@0-1.k", None): Start(5.0, 8.0), **kept}
    (case,) = beside_a_spring(found(3.0, 0.2, at=(0, 1)), begin, among, model)
    assert case.effects[0].cause.effect is other
    assert isinstance(case.starts[0].terms[-1], other) and case.starts[0].terms[-1].values == (3.0, 0.2)
    assert case.begin == kept
    assert beside_a_spring(Coulomb(1.0, at=(0, 1)), begin, among, model) == []


def test_an_early_channel_is_a_late_other_one():
    known = causes()

    def delay(kind, at) -> Effect:
        return Effect(known[kind], at)

    force, channel = delay("force_delay", ("force", 1)), delay("channel_delay", ("displacement", 1))
    early = jfsm.ForceDelay(-0.04, at=("force", 1))
    begin: Begin = {("stiffness@0-1.k", None): Start(8.0, 9.0)}
    (late,) = late_instead(early, begin, [force, channel], MODEL)
    assert late.effects == (channel,)
    assert late.starts[0].values() == MODEL.values() | {"channel_delay@displacement-1.tau": 0.04}
    assert late.begin is begin
    assert late_instead(jfsm.ForceDelay(0.04, at=("force", 1)), begin, [force, channel], MODEL) == []
    other = delay("channel_delay", ("acceleration", 1))
    assert late_instead(early, begin, [force, channel, other], MODEL) == []


def test_starts_climb_side_by_side_only_with_as_many_unknowns():
    chain = jfsm.Structure.chain(mass=[1.0, 1.0], stiffness=[9.0, 9.0], damping=[0.3, 0.3])
    time = np.arange(200) * 0.1
    force = np.stack([np.sin(time) + np.cos(2.3 * time), np.zeros(200)], 1)
    noisy = np.random.default_rng(0).standard_normal((200, 2))
    record = prepare(jfsm.Record(time, force, displacement=noisy), chain)
    problem = Problem(chain, [record], [200])
    lots = []
    for cause, law in (
        ("preload", jfsm.Preload(0.1, at=(0, 1))),
        ("cubic_hardening", jfsm.CubicStiffness(1.0, at=(0, 1))),
    ):
        terms = [replace(law, at=at) for at in ((0, 1), (1, 2))]
        tried = [Candidate((Effect(causes()[cause], term.at),), (chain + term,)) for term in terms]
        lots.append(groups(tried, None, problem))
        for lot in lots[-1]:
            posed = hypothesis(chain, [start for _, start, _ in lot], [record])
            assert len({len(unknowns) for unknowns in posed.unknowns}) == 1
    # A constant force between ground and a driven mass is an offset of its force sensor by another name.
    assert [len(each) for each in lots] == [2, 1]


def test_only_a_gain_begins_at_own_values_as_given_alone():
    time = np.arange(200) * 0.1
    noisy = np.random.default_rng(0).standard_normal(200)
    problem = Problem(MODEL, [prepare(jfsm.Record(time, np.sin(time), displacement=noisy), MODEL)], [200])
    own: Begin = {("damping@0-1.c", None): Start(0.1, 0.3)}

    def begins(cause: str, sensor) -> list:
        (lot,) = groups([Candidate((Effect(causes()[cause], sensor.at),), (MODEL + sensor,))], own, problem)
        return [begin for _, _, begin in lot]

    assert begins("force_gain", jfsm.ForceGain(0.1, at=("force", 1))) == [None]
    assert begins("force_delay", jfsm.ForceDelay(0.1, at=("force", 1))) == [None, own]


def rubbing(static: float) -> Problem:
    """A record of dry friction that the model lacks, with how much of it is fitted; slowly it is `static` as large."""
    time = np.arange(600) * 0.06

    def force(t):
        return 4 * np.cos(1.1 * t) + 3 * np.sin(2.3 * t + 1) + 3 * np.cos(3.7 * t + 2)

    def rate(t, y):
        friction = 0.8 * (1 + (static - 1) * np.exp(-((y[1] / 0.4) ** 2))) * np.tanh(y[1] / 1e-3)
        return [y[1], force(t) - 9.0 * y[0] - 0.3 * y[1] - friction]

    x = solve_ivp(rate, (0, time[-1]), [0.0, 0.0], t_eval=time, method="LSODA", rtol=1e-8, atol=1e-10).y[0]
    noise = 0.01 * np.random.default_rng(1).standard_normal((2, time.size))
    record = jfsm.Record(time, force(time) + 4 * noise[0], x + np.std(x) * noise[1], at_rest=True)
    return Problem(MODEL, [prepare(record, MODEL)], [time.size])


@pytest.fixture(scope="module")
def with_friction():
    return rubbing(static=1.0)


@pytest.fixture(scope="module")
def fitted(with_friction):
    """The model as given and refitted."""
    return fit_model(with_friction)


@pytest.fixture(scope="module")
def rubbed(with_friction, fitted):
    """The best that a search for Coulomb friction finds."""
    given, refitted = fitted
    every = candidates(MODEL, with_friction.records, chosen_causes(["coulomb"]))
    return max(search(every, given, refitted, with_friction, tell).trials, key=lambda t: t.evidence)


def tell(what, steps):
    pass


@pytest.mark.slow
def test_a_special_case_that_stopped_on_its_way_is_fitted_from_the_law_that_holds_it(with_friction, fitted):
    every = candidates(MODEL, with_friction.records, chosen_causes(["stribeck", "coulomb"]))
    stribeck, coulomb = (next(c for c in every if c.effects[0].cause.id == name) for name in ("stribeck", "coulomb"))
    given, refitted = fitted
    alone = search([stribeck], given, refitted, with_friction, tell)
    stopped = Found(alone.trials, [LeftBehind(coulomb.effects, 613.0)])
    found = search_akin(alone.trials, every, stopped, with_friction, tell)
    evidence = {t.effects[0].cause.id: t.evidence for t in found.trials}
    assert found.behind == []
    assert 0.0 < evidence["coulomb"] - evidence["stribeck"] < 10.0
    (value,) = (t.structure.values()["coulomb@0-1.F"] for t in found.trials if t.effects == coulomb.effects)
    assert abs(value - 0.8) < 0.05


def test_a_law_that_stopped_on_its_way_goes_on_from_where_another_stands_for_it():
    time, rng = np.arange(1500) * 0.06, np.random.default_rng(0)
    force = sum(np.cos(omega * time + omega**2) for omega in np.arange(0.7, 4.5, 0.31))
    late = MODEL + jfsm.DelayedForce(-1.5, 0.6, at=(0, 1))
    x = jfsm.simulate(late, jfsm.Record(time, force, at_rest=True), solver="grid").displacement
    noisy = x + 0.3 * np.std(x) * rng.standard_normal(x.shape)
    record = jfsm.Record(time, force, displacement=noisy, at_rest=True)
    problem = Problem(MODEL, [prepare(record, MODEL)], [1500])
    given, refitted = fit_model(problem)
    delayed, maxwell = (Effect(causes()[name], (0, 1)) for name in ("delayed_force", "maxwell"))
    astray = Candidate((delayed,), (MODEL + jfsm.DelayedForce(0.5, 2.5, at=(0, 1)),))
    # To the second order in the delay either is the other: k_M = -2 k, and half the delay.
    near = Candidate((maxwell,), (MODEL + jfsm.Maxwell(3.0, 0.3, at=(0, 1)),))
    alone = search([astray, near], given, refitted, problem, tell)
    stopped = {t.effects: t.evidence for t in alone.trials}
    found = search_akin([t for t in alone.trials if t.effects == near.effects], [astray, near], alone, problem, tell)
    (there,) = (t for t in found.trials if t.effects == astray.effects)
    assert stopped[astray.effects] < stopped[near.effects] < there.evidence - 10.0
    assert float(there.structure.values()["delayed_force@0-1.tau"]) == pytest.approx(0.6, rel=0.1)


@pytest.mark.parametrize(("static", "more"), [(1.0, []), (2.0, ["stribeck"])])
def test_a_law_is_tried_that_holds_the_one_that_was_found_where_a_score_test_promises_more_of_it(
    static, more, with_friction, fitted
):
    problem = rubbing(static) if more else with_friction
    given, refitted = fit_model(problem) if more else fitted
    every = candidates(MODEL, problem.records, chosen_causes(["stribeck", "coulomb"]))
    stribeck, coulomb = (next(c for c in every if c.effects[0].cause.id == name) for name in ("stribeck", "coulomb"))
    alone = search([coulomb], given, refitted, problem, tell)
    (friction,) = alone.trials
    cases = instead_of(friction, friction.laws[0], [stribeck], {}, problem)
    assert [c.effects[0].cause.id for c in cases] == more
    assert instead_of(friction, friction.laws[0], [coulomb], {}, problem) == []
    if more:
        found = search_akin(alone.trials, every, alone, problem, tell)
        (falling,) = (t for t in found.trials if t.effects == stribeck.effects)
        assert falling.evidence > friction.evidence + 20.0
        assert abs(falling.structure.values()["stribeck@0-1.F_static"] - 1.6) < 0.15


def test_a_stop_that_gives_way_is_found_from_a_stop_that_was_found():
    time, k, gap, plus, minus = np.arange(700) * 0.06, 6.0, 0.5, 4.5, 4.0

    def pull(d, slider):
        stretch = d - slider
        return k * (stretch - np.clip(stretch, -gap, gap))

    def rate(t, y):
        d, w, slider = y
        held = pull(d, slider)
        slides = (held >= plus and w > 0) or (held <= -minus and w < 0)
        return [w, -9.0 * d - 0.3 * w - np.clip(held, -minus, plus), w if slides else 0.0]

    x = solve_ivp(rate, (0, time[-1]), [3.0, 0.0, 3.0], t_eval=time, max_step=0.005).y[0]
    record = jfsm.Record(time, None, x + 0.01 * np.std(x) * np.random.default_rng(2).standard_normal(time.size))
    problem = Problem(MODEL, [prepare(record, MODEL)], [time.size])
    every = candidates(MODEL, problem.records, chosen_causes(["end_stop", "free_play"]))
    stop, play = (next(c for c in every if c.effects[0].cause.id == name) for name in ("end_stop", "free_play"))
    alone = search([stop], *fit_model(problem), problem, tell)
    found = search_akin(alone.trials, every, alone, problem, tell)
    (gives_way,) = (t for t in found.trials if t.effects == play.effects)
    values = gives_way.structure.values()
    assert gives_way.evidence > alone.trials[0].evidence + 1000.0
    sizes = [values[f"free_play@0-1.{name}"] for name in ("k", "gap", "F_plus", "F_minus")]
    np.testing.assert_allclose(sizes, [k, gap, plus, minus], rtol=0.1)


def test_a_refit_that_stopped_on_its_way_is_climbed_again_from_own_values_found_beside_an_effect(with_friction, fitted):
    _, refitted = fitted
    (stiffness,) = (i for i, u in enumerate(refitted.unknowns) if u.path == "stiffness@0-1.k")
    beside = replace(refitted, theta=np.where(np.arange(refitted.theta.size) == stiffness, np.log(8.9 / 9.0), 0.0))
    stopped = replace(refitted, evidence=refitted.evidence - 17.0)
    again = refit_from([beside], stopped, with_friction)
    assert again.label == "refitted" and again.effects == ()
    assert abs(again.evidence - refitted.evidence) < 0.1
    better = replace(refitted, evidence=refitted.evidence + 17.0)
    assert refit_from([beside], better, with_friction) is better
    assert refit_from([], stopped, with_friction) is stopped


def found_beside_friction(records: Any, *parts: Any, cause: str) -> Any:
    """A trial of Coulomb friction beside an effect, whose parts its structure has with offsets, one of a force.

    All its numbers ended off where they are believed to be.
    """
    friction, known = jfsm.Coulomb(0.8, at=(0, 1)), causes()
    structure = MODEL + friction
    for part in parts:
        structure = structure + part
    effects = (Effect(known["coulomb"], (0, 1)), *(Effect(known[cause], part.at) for part in parts))
    posed = hypothesis(MODEL, [structure], records)
    (unknowns,) = posed.unknowns
    theta, found = np.full(len(unknowns), 0.07), posed.structures[0].with_values({"offset@force-1.b": 0.3})
    return SimpleNamespace(
        effects=effects,
        parts=(friction, *parts),
        structure=found,
        unknowns=unknowns,
        theta=theta,
        evidence=0.0,
        covariance=1e-6 * np.eye(theta.size),
        steps=tuple(n.inputs.substeps for n in records),
    )


@pytest.mark.slow
def test_a_single_effect_that_stopped_on_its_way_is_fitted_again_from_the_best_pair_that_has_it(with_friction, fitted):
    given, refitted = fitted
    records = with_friction.records
    every = candidates(MODEL, records, chosen_causes(["cubic_hardening", "coulomb"]))
    spring, friction = (
        next(c for c in every if c.effects[0].cause.id == name) for name in ("cubic_hardening", "coulomb")
    )
    alone = search([spring], given, refitted, with_friction, tell).trials
    effects = [*spring.effects, *friction.effects]
    found = search_pairs(effects, alone, None, refitted, with_friction, tell)
    (again,) = (t for t in found.trials if t.effects == friction.effects)
    assert abs(again.structure.values()["coulomb@0-1.F"] - 0.8) < 0.05
    assert again.evidence > max(t.evidence for t in alone) + 100.0


def test_the_force_that_is_missing_would_gain_most_beside_a_refit(with_friction, fitted, rubbed):
    records = with_friction.records
    _, refitted = fitted
    laws = Laws(refitted.structure, records[0])
    tried = [jfsm.Coulomb(0.3, at=(0, 1)), jfsm.CubicStiffness(0.1, at=(0, 1))]
    forces = np.concatenate([laws.forces([law]) for law in tried])
    forces = np.concatenate([forces, -forces[:1], np.full_like(forces[:1], np.nan), np.zeros_like(forces[:1])])
    friction, spring, backwards, runaway, none = gains(refitted, with_friction, forces)
    assert 0.5 < friction / (rubbed.evidence - refitted.evidence) < 2.0
    assert [backwards, runaway, none] == pytest.approx([0.0] * 3, abs=1e-9)
    assert spring < 0.1 * friction


def test_a_number_with_which_the_motion_runs_away_says_nothing_of_what_a_force_would_gain(with_friction, fitted):
    records = with_friction.records
    _, refitted = fitted
    force = Laws(refitted.structure, records[0]).forces([jfsm.Coulomb(0.3, at=(0, 1))])
    (known,) = gains(refitted, with_friction, force)
    untold = np.where(np.arange(refitted.theta.size) == 0, 1e12, 1.0)  # the nudge of it is as large
    (found,) = gains(replace(refitted, covariance=refitted.covariance * untold), with_friction, force)
    assert known > 100.0 and 0.8 < found / known < 1.25


def test_a_trial_is_looked_at_in_steps_no_longer_than_those_it_was_fitted_in(with_friction, fitted):
    records = with_friction.records
    _, refitted = fitted
    assert refitted.steps == (records[0].inputs.substeps,)
    finer = replace(refitted, steps=(4 * records[0].inputs.substeps,))
    assert with_friction.posterior_of(finer).records[0].inputs.substeps == finer.steps[0]
    assert with_friction.posterior_of(replace(refitted, steps=(1,))).records[0] is records[0]


def test_what_would_replace_an_effect_gains_what_that_gained_if_it_is_alike_and_loses_it_if_not(
    with_friction, fitted, rubbed
):
    _, refitted = fitted
    records = with_friction.records
    laws = Laws(rubbed.structure.without(rubbed.parts[0]), records[0])
    (force,) = laws.forces(rubbed.laws)
    tried = [jfsm.Coulomb(0.3, at=(0, 1)), jfsm.CubicStiffness(0.1, at=(0, 1))]
    forces = np.concatenate([laws.forces([law]) for law in tried])
    replaced = Replaced(force, frozenset({"coulomb@0-1.F"}))
    same, spring = gains(rubbed, with_friction, forces, replaced)
    lost = refitted.evidence - rubbed.evidence
    assert lost < -100.0
    assert abs(same) < 0.05 * abs(lost) and spring < 0.5 * lost


def test_effects_of_pairs_alike_are_tried_together_too(with_friction):
    known, records = causes(), with_friction.records
    friction, stribeck = (Effect(known[name], (0, 1)) for name in ("coulomb", "stribeck"))
    spring, sine = (Effect(known[name], (0, 1)) for name in ("cubic_hardening", "sine_stiffness"))
    parts = {
        friction: jfsm.Coulomb(0.8, at=(0, 1)),
        stribeck: Stribeck(0.8, 0.9, 0.1, at=(0, 1)),
        spring: jfsm.CubicStiffness(0.2, at=(0, 1)),
        sine: SineStiffness(1.0, 0.5, at=(0, 1)),
    }

    def pair(one: Effect, other: Effect, evidence: float) -> Any:
        (unknowns,) = hypothesis(MODEL, [MODEL + parts[one] + parts[other]], records).unknowns
        theta = np.full(len(unknowns), evidence / 1000)
        return SimpleNamespace(
            effects=(one, other), parts=(parts[one], parts[other]), unknowns=unknowns, theta=theta, evidence=evidence
        )

    found = [pair(friction, spring, 70.0), pair(stribeck, sine, 60.0), pair(stribeck, spring, 50.0)]
    (candidate,) = crossed(found, [], MODEL)
    assert candidate.effects == (friction, sine)
    assert candidate.starts[0].terms[-2:] == (parts[friction], parts[sine])
    (unknowns,) = hypothesis(MODEL, candidate.starts, records, begins=[candidate.begin]).unknowns
    assert next(u.theta for u in unknowns if u.path == "stiffness@0-1.k") == pytest.approx(0.07)
    smooth = Effect(known["smooth_coulomb"], (0, 1))
    alone: Any = SimpleNamespace(effects=(smooth,), parts=(SmoothCoulomb(0.8, 0.1, at=(0, 1)),), evidence=40.0)
    tried = {candidate.effects for candidate in crossed(found, [alone], MODEL)}
    assert tried == {(friction, sine), (smooth, spring), (smooth, sine)}


def test_what_is_tried_beside_an_effect_begins_where_that_left_all_other_numbers(with_friction):
    records = with_friction.records
    base, spring = found_beside_friction(records, cause="coulomb"), Effect(causes()["cubic_hardening"], (0, 1))
    (pair,) = pairs([base], None, [spring], with_friction)
    (unknowns,) = hypothesis(MODEL, pair.starts[:1], records, begins=[pair.begin]).unknowns
    others = {u.path: u for u in unknowns if not u.path.startswith(("coulomb", "cubic"))}
    assert {"stiffness@0-1.k", "offset@force-1.b", "offset@displacement-1.b", "noise@0"} < others.keys()
    np.testing.assert_allclose([u.theta for u in others.values()], 0.07)
    assert [u.center for u in others.values()] == [u.center for u in base.unknowns if u.path in others]


def test_a_number_begins_where_it_is_said_to_and_is_believed_there(with_friction):
    records = with_friction.records
    (refit,) = hypothesis(MODEL, [MODEL], records).unknowns
    (offset,) = (u for u in refit if u.path == "offset@displacement-1.b")
    of_all: Begin = {("offset@displacement-1.b", None): Start(5.0, 4.0)}
    moved = begun(offset, of_all)
    assert moved.value(moved.theta) == pytest.approx(5.0) and moved.value(moved.center) == pytest.approx(4.0)
    mine = begun(offset, of_all | {("offset@displacement-1.b", 0): Start(1.0, 2.0)})
    assert mine.value(mine.theta) == pytest.approx(1.0) and mine.value(mine.center) == pytest.approx(2.0)
    assert begun(offset, {("x0@1", None): Start(1.0, 2.0)}) is offset and begun(offset, None) is offset


def test_a_constant_force_beside_another_effect_begins_as_what_the_offset_of_the_force_is(with_friction):
    base, preload = found_beside_friction(with_friction.records, cause="coulomb"), Effect(causes()["preload"], (0, 1))
    (pair,) = pairs([base], None, [preload], with_friction)
    assert {effect.cause.id for effect in pair.effects} == {"coulomb", "preload"}
    assert pair.starts[0].values()["preload@0-1.F"] == -0.3  # a reading too large by 0.3 is a force the other way


def test_beside_another_effect_an_early_channel_is_a_late_other_one_too(with_friction):
    early = jfsm.ForceDelay(-0.04, at=("force", 1))
    late = Effect(causes()["channel_delay"], ("displacement", 1))
    pair = found_beside_friction(with_friction.records, early, cause="force_delay")
    found = instead(pair, [*pair.effects, late], with_friction)
    starts = [start.values() for c in found for start in c.starts if late in c.effects]
    assert 0.04 in [values["channel_delay@displacement-1.tau"] for values in starts]
    assert all(values["coulomb@0-1.F"] == 0.8 for values in starts)


def test_starts_that_begin_best_where_more_or_less_is_forgiven_both_climb(monkeypatch):
    class Start:
        """One that is the better the more is forgiven, or the less, and ends at its top."""

        def __init__(self, begun, top):
            self.begun, self.top = begun, top

    def begun(starts, shares):
        return np.array([[start.begun[share] for start in starts] for share in shares])

    monkeypatch.setattr(batches, "beginnings", begun)
    starts = [
        Start({0.03: 2.0, 0.01: 1.0}, -5.0),
        Start({0.03: 3.0, 0.01: 5.0}, -9.0),
        Start({0.03: 1.0, 0.01: 3.0}, -4.0),
    ]
    monkeypatch.setattr(
        batches,
        "rungs",
        lambda start, ladder, limit: (SimpleNamespace(value=np.array([start.top * share])) for share in (0.1, 1.0)),
    )
    lot = object.__new__(batches.Batch)
    lot.limit = UNLIMITED
    stood = list(lot._climb(starts, ("first", "second", "third"), 1, (0.1, 0.03, 0.01)))  # pyright: ignore
    assert [float(found.value[0]) for found in stood] == [-0.5, -5.0]
    assert lot.posterior is starts[0] and lot.candidates == ("first",)


def test_where_no_law_was_looked_for_none_is_fitted_again():
    none: Any = SimpleNamespace(rung=0.0, value=0.0)
    problem: Any = SimpleNamespace(model=None, records=[])
    found = search_again([], none, problem, lambda *_: None)
    assert found.trials == [] and found.behind == []


@pytest.mark.parametrize(
    ("left", "named"), [((0.2, 0.2), "blind"), ((0.2, 0.01), "sees")], ids=["both predict", "one predicts nothing"]
)
def test_of_two_fits_of_a_law_the_more_probable_one_stands_unless_it_predicts_nothing(left, named):
    class Fit(NamedTuple):
        name: str
        evidence: float
        prediction: Any

    def fit(name: str, evidence: float, power: float) -> Any:
        error = np.full(2, power)
        return Fit(name, evidence, Prediction(error, error, error))

    assert climbing._better(fit("blind", 900.0, left[0]), fit("sees", 100.0, left[1])).name == named
    assert climbing._better(fit("sees", 100.0, left[1]), fit("blind", 900.0, left[0])).name == named


@pytest.mark.parametrize("imposed", [True, False])
def test_along_an_imposed_motion_a_law_that_predicts_goes_on_behind_those_that_are_far_more_probable(imposed: bool):
    def batch(best: float, left: float) -> Any:
        return SimpleNamespace(best=best, left=left, imposed=imposed, behind=0.0)

    blind, sees = [batch(-1e4 - k, 0.4) for k in range(3)], batch(0.0, 0.01)
    assert (sees in climbing._near([*blind, sees], 2)) == imposed


STAGES = batches.Schedule((0.3, 0.03), 10, 0.5)


class Climber:
    """A batch after a stage."""

    def __init__(self, name: str, best: float, share: float = np.inf, leaves: float = 1.0):
        self.candidates, self.best, self.share, self.leaves = (name,), best, share, leaves
        self.samples, self.imposed, self.limit, self.behind = 1000, False, UNLIMITED, 0.0

    def misfit(self, share: float) -> float:
        return self.leaves


def going_on(climbers: list[Climber], kept: tuple[str, ...] = ()) -> list[str]:
    every: Any = climbers
    staying: Any = [c for c in climbers if c.candidates[0] in kept]
    on: Any = climbing._going_on(every, STAGES, 1, staying)
    return [c.candidates[0] for c in on]


@pytest.mark.parametrize(("leaves", "count"), [(1.1, 4), (3.0, 15)], ids=["arrived", "on its way"])
def test_once_a_leader_leaves_hardly_more_than_noise_those_far_behind_stay_behind(leaves: float, count: int):
    climbers = [Climber("leader", 0.0, leaves=leaves), *(Climber(f"{k}", 1e4 + k) for k in range(30))]
    assert len(going_on(climbers)) == count


def test_a_law_that_is_kept_goes_on_far_behind_a_leader_that_has_arrived_and_a_sensor_does_not():
    climbers = [Climber("leader", 0.0), *(Climber(f"{k}", 1e4 + k) for k in range(8))]
    climbers += [Climber("law", 9e4, share=0.3), Climber("sensor", 9e4)]
    on = going_on(climbers, kept=("law", "sensor"))
    assert "law" in on and "sensor" not in on


def test_a_start_that_is_hopeless_beside_another_of_the_same_candidates_does_not_go_on():
    climbers = [Climber("leader", 0.0, leaves=9.0), Climber("law", 1e4), Climber("law", 1e5), Climber("other", 1e5)]
    assert sorted(going_on(climbers)) == ["law", "leader", "other"]


@pytest.mark.parametrize(("share", "fitted"), [(0.9, ["law here", "same law", "sensor"]), (0.3, None)])
def test_where_a_law_explains_half_others_are_looked_for_at_its_place_only(monkeypatch, share: float, fitted):
    kinds = causes()

    def candidate(cause: str, at: tuple) -> Candidate:
        return Candidate((Effect(kinds[cause], at),), (MODEL,))

    others = {
        "law here": candidate("coulomb", (0, 1)),
        "law elsewhere": candidate("coulomb", (1, 2)),
        "same law": candidate("cubic_hardening", (1, 2)),
        "sensor": candidate("channel_delay", ("acceleration", 2)),
    }
    best = SimpleNamespace(
        evidence=1.0, laws=(jfsm.CubicStiffness(1.0, at=(0, 1)),), effects=(Effect(kinds["cubic_hardening"], (0, 1)),)
    )
    monkeypatch.setattr(rounds, "explained", lambda trial, refitted: share)
    found = rounds.Rounds._there(SimpleNamespace(refitted=None), [best], list(others.values()))  # type: ignore
    assert [name for name, one in others.items() if one in found] == (fitted or list(others))


@pytest.mark.parametrize(("share", "goes_on"), [(0.3, True), (0.03, False)], ids=["forgiven", "told"])
def test_what_is_hopeless_behind_the_leader_stops_where_little_force_is_forgiven(share: float, goes_on: bool):
    climbers: Any = [Climber("leader", 0.0), Climber("sensor", 1e5)]
    hopeful: Any = climbing._hopeful(climbers, share)
    assert ("sensor" in [c.candidates[0] for c in hopeful]) == goes_on


def test_a_search_has_settled_once_what_is_left_turns_out_to_be_noise(monkeypatch):
    found = SimpleNamespace(trials=[SimpleNamespace(evidence=1.0, effects=(), laws=())], behind=[])
    asked = []
    monkeypatch.setattr(rounds, "amid_noise", lambda given, refitted, trials, *_: (None, ["amid", *trials]))
    monkeypatch.setattr(rounds, "settled", lambda trials, lack: asked.append(trials))
    search = SimpleNamespace(given="given", refitted="refitted", problem=None, key=None, _lack=None)
    search._apart_from_the_drive, search._there = list, lambda trials, others: others
    rounds.Rounds._worth_a_second_round(search, found, [], [], [], [])  # type: ignore
    assert asked == [["amid", *found.trials]]
