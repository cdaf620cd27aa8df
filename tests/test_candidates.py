"""What is tried, and where: laws on links and masses, and the unknowns that go with them."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from references import between_wells

import jfsm
from jfsm.diagnosis.hypotheses.candidate import Candidate, contained, elsewhere, promising
from jfsm.diagnosis.hypotheses.candidates import candidates, chosen_causes
from jfsm.diagnosis.hypotheses.effect import Effect
from jfsm.diagnosis.hypotheses.initial_values import Begin, Start
from jfsm.diagnosis.hypotheses.parametrisation import hypothesis, own_paths
from jfsm.diagnosis.hypotheses.placement import Laws
from jfsm.diagnosis.search.related_laws import resting
from jfsm.identification import LANES, Nuisances, Posterior, prepare

CHAIN = jfsm.Structure.chain([1.0, 1.0], [20.0, 20.0], [0.2, 0.2])


@pytest.fixture(scope="module")
def shaken() -> Nuisances:
    """Two masses under a sum of sines, as a cubic spring between them leaves it."""
    time = np.arange(400) * 0.05
    force = np.column_stack([10 * np.cos(1.7 * time) + 8 * np.cos(4.1 * time + 1), np.zeros(400)])
    run = jfsm.simulate(CHAIN + jfsm.CubicStiffness(30.0, at=(1, 2)), jfsm.Record(time, force, at_rest=True))
    rng = np.random.default_rng(2)
    x = run.displacement + 0.01 * run.displacement.std() * rng.standard_normal((400, 2))
    return prepare(jfsm.Record(time, force, x, at_rest=True), CHAIN)


def places(cause: str, shaken: Nuisances, given=None) -> list[tuple]:
    return [c.effects[0].at for c in candidates(CHAIN, [shaken], chosen_causes([cause]), given)]


def test_laws_are_tried_on_every_link_and_loads_and_hung_masses_on_every_mass(shaken):
    assert places("cubic_hardening", shaken) == [(0, 1), (1, 2)]
    for on_masses in ("attached_oscillator", "preload", "periodic_disturbance"):
        assert places(on_masses, shaken) == [(0, 1), (0, 2)]


def test_places_that_are_given_are_the_only_ones(shaken):
    assert places("cubic_hardening", shaken, [(1, 2)]) == [(1, 2)]
    assert places("attached_oscillator", shaken, [(1, 2)]) == []
    assert places("attached_oscillator", shaken, [(0, 2), (1, 2)]) == [(0, 2)]
    assert places("preload", shaken, [(1, 2)]) == [(1, 2)]


def test_programs_are_those_of_a_few_classes_of_laws_whatever_the_place(shaken):
    needed: dict[tuple, set[str]] = {}
    for candidate in candidates(CHAIN, [shaken], chosen_causes(None)):
        for begin in candidate.starts[:LANES]:
            seen = shaken.resolving([begin])
            posterior = Posterior(hypothesis(CHAIN, [begin], [seen]), [seen])
            needed.setdefault((posterior.program, seen.inputs.substeps), set()).add(candidate.effects[0].cause.id)
    shared = {name for names in needed.values() if len(names) > 1 for name in names}
    assert shared > {"cubic_hardening", "force_gain", "coulomb", "stribeck", "jenkins", "bouc_wen"}
    by_class = {program for program, _ in needed}
    assert len(by_class) <= 6  # smooth, sliding, remembering, answering the past, a late force, a late channel
    assert len(needed) <= 10  # and steps


def test_the_whole_catalogue_fits_a_chain(shaken):
    tried = candidates(CHAIN, [shaken], chosen_causes(None))
    assert {c.effects[0].cause.id for c in tried} > {"attached_oscillator", "jenkins", "maxwell", "force_delay"}
    best = max(tried, key=lambda c: c.share or 0.0)
    assert best.effects[0].at == (1, 2)


@pytest.mark.parametrize(("at", "tried"), [(("force", 1), []), (("displacement", 1), [("force", 1)])])
def test_no_gain_is_looked_for_on_a_channel_that_its_recorder_limited(at, tried, shaken):
    model = CHAIN + jfsm.Clipping(5.0, at=at)
    found = [c.effects[0].at for c in candidates(model, [shaken], chosen_causes(["force_gain"]))]
    assert [spot for spot in found if spot == ("force", 1)] == tried


def test_a_stated_offset_is_one_unknown_and_no_own_value(shaken):
    model = CHAIN + jfsm.Offset(0.001, at=("displacement", 2))
    assert not [p for p in own_paths(model, [shaken]) if p.startswith("offset@")]
    tried = hypothesis(model, [model + jfsm.CubicStiffness(1.0, at=(1, 2))], [shaken])
    paths = [u.path for u in tried.unknowns[0]]
    assert len(paths) == len(set(paths)) and "offset@displacement-2.b" in paths


def test_the_special_cases_of_a_law_are_followed_where_it_is(shaken):
    tried = candidates(CHAIN, [shaken], chosen_causes(["quadratic_damping", "cubic_damping", "position_damping"]))
    near = contained([jfsm.PowerDamping(1.0, 2.1, at=(1, 2)), jfsm.CubicStiffness(1.0, at=(0, 1))], tried)
    assert {(c.effects[0].cause.id, c.effects[0].at) for c in near} == {
        ("quadratic_damping", (1, 2)),
        ("cubic_damping", (1, 2)),
    }


def test_a_special_case_that_explains_nothing_is_not_followed():
    idle = Candidate((Effect(chosen_causes(["jenkins"])["jenkins"], (0, 1)),), ())
    assert contained([jfsm.FreePlay(1.0, 0.1, 1.0, 1.0, at=(0, 1))], [idle]) == []


def test_a_law_that_was_found_is_tried_at_the_other_places(shaken):
    known = chosen_causes(["cubic_hardening", "coulomb", "force_gain"])
    tried = candidates(CHAIN, [shaken], known)
    found = next(c for c in tried if c.effects == (Effect(known["cubic_hardening"], (1, 2)),))
    others = elsewhere(found.effects, [c for c in tried if c is not found])
    assert [c.effects for c in others] == [(Effect(known["cubic_hardening"], (0, 1)),)]


@pytest.mark.parametrize(("channel", "tried"), [("acceleration", True), ("displacement", False)])
def test_a_quadratic_spring_about_a_rest_that_nothing_tells_is_a_well_of_two(channel: str, tried: bool):
    well, model = jfsm.DoubleWell(25.0, 40.0, at=(0, 1)), jfsm.Structure.sdof(2.0, 18.0, 0.5)
    rest = -np.sqrt((25.0 - 18.0) / 40.0)
    slope, curvature = -25.0 + 3 * 40.0 * rest**2, 3 * 40.0 * rest
    found = jfsm.Structure.sdof(2.1, 18.0 + slope, 0.6) + jfsm.QuadraticStiffness(curvature, at=(0, 1))
    seen: Any = SimpleNamespace(at_rest=False, path=None, channels=((channel, 1),))
    among = [Candidate((Effect(jfsm.causes()[cause], (0, 1)),), ()) for cause in ("double_well", "cubic_hardening")]
    begin: Begin = {("mass@1", None): Start(2.1, 2.0), ("stiffness@0-1.k", None): Start(0.0, 18.0)}
    cases = resting(found, found.terms[-1], begin, among, model, seen)
    assert bool(cases) == tried
    for case in cases:
        assert case.effects[0].cause.id == "double_well" and case.begin is not None
        np.testing.assert_allclose(case.starts[0].terms[-1].values, well.values)
        assert case.begin.keys() == {("x0@1", None), ("mass@1", None)}
        assert case.begin["x0@1", None] == (pytest.approx(rest), pytest.approx(rest))
        assert case.begin["mass@1", None] == begin["mass@1", None]


@pytest.mark.parametrize(("channel", "tried"), [("acceleration", True), ("displacement", False)])
def test_a_mass_that_goes_from_well_to_well_begins_in_one_of_them(channel: str, tried: bool):
    """Its owner knows the spring of a well, and no channel where that is."""
    slope, curvature = 3.0, 1.2
    time = np.arange(2000) * 0.08
    force, x, a = between_wells(slope, curvature, 0.1, time, 0.55, np.linspace(0.3, 4.5, 20), seed=0)
    assert np.count_nonzero(np.diff(np.sign(x))) > 8
    y = x if channel == "displacement" else a
    shown: dict[str, Any] = {channel: y + 0.01 * np.std(y) * np.random.default_rng(1).standard_normal(time.size)}
    model = jfsm.Structure.sdof(1.0, 2.05 * slope, 0.11)
    effect = Effect(jfsm.causes()["double_well"], (0, 1))
    found = Laws(model, prepare(jfsm.Record(time, force, **shown), model)).between_rests(effect, 0.1)
    assert bool(found) == tried
    for c in found:
        k_neg, k3 = (float(q) for q in c.starts[0].terms[-1].values)
        assert k_neg == pytest.approx(3 * slope, rel=0.1) and k3 == pytest.approx(curvature, rel=0.6)
        assert c.begin is not None and c.share == 0.1
        assert abs(c.begin["x0@1", None].value) == pytest.approx(np.sqrt(slope / curvature), rel=0.3)


def test_a_law_that_begins_in_several_places_takes_no_place_of_another():
    laws = [Effect(cause, (0, 1)) for cause in list(jfsm.causes().values())[:9]]
    model = jfsm.Structure.sdof(1.0, 1.0, 0.1)
    alone = [Candidate((effect,), (model,), 0.9 - 0.1 * i) for i, effect in enumerate(laws)]
    chosen, left = promising([*alone, *[Candidate((laws[0],), (model,), 0.9)] * 5])
    assert len({c.effects for c in chosen}) == 8 and [c.effects for c in left] == [(laws[8],)]


@pytest.mark.parametrize(("best", "followed"), [(0.3, True), (0.9, False)], ids=["ill seen", "well seen"])
def test_of_a_force_that_is_ill_seen_all_laws_are_followed_that_explain_about_as_much_at_its_place(best, followed):
    laws = [Effect(cause, (1, 2)) for cause in list(jfsm.causes().values())[:10]]
    model = jfsm.Structure.sdof(1.0, 1.0, 0.1)
    leaders = [Candidate((effect,), (model,), best) for effect in laws[:8]]
    near, less = (
        Candidate((effect,), (model,), part * best) for effect, part in zip(laws[8:], (0.6, 0.4), strict=True)
    )
    elsewhere_ = Candidate((Effect(laws[8].cause, (0, 1)),), (model,), 0.6 * best)
    chosen, _ = promising([*leaders, near, less, elsewhere_])
    assert (near in chosen) == followed
    assert less not in chosen and elsewhere_ not in chosen
