"""Two laws placed at once, on motions that SciPy made."""

from itertools import combinations

import numpy as np
import pytest
from references import driven_readings

import jfsm
from jfsm.diagnosis.evidence.setup import Problem
from jfsm.diagnosis.hypotheses.candidate import Candidate
from jfsm.diagnosis.hypotheses.candidates import candidates, chosen_causes
from jfsm.diagnosis.search.pairs import pairs
from jfsm.identification import missing_force, place, place_together, prepare, scale_of

T = np.arange(1200) * 0.06
MODEL = jfsm.Structure.sdof(1.0, 9.0, 0.3)
AT = (0, 1)
LAWS = (
    jfsm.CubicStiffness(1.0, at=AT),
    jfsm.QuadraticStiffness(1.0, at=AT),
    jfsm.EndStop(1.0, 1.0, at=AT),
    jfsm.QuadraticDamping(1.0, at=AT),
    jfsm.Coulomb(1.0, at=AT),
    jfsm.PositionDamping(1.0, at=AT),
)
EITHER = (0,) * len(LAWS)
PAIRS = list(combinations(range(len(LAWS)), 2))


def record(law) -> jfsm.Record:
    return jfsm.Record(T, *driven_readings(law, T), at_rest=True)


def stopped_and_damped(x, v):
    return 6.0 * np.sign(x) * np.maximum(np.abs(x) - 0.8, 0.0) + 0.5 * v * np.abs(v)


def square_and_position(x, v):
    return 1.5 * x**2 + 0.6 * x**2 * v


def placed(law, signs=EITHER, tried=PAIRS):
    nuisances = prepare(record(law), MODEL)
    return place_together(
        LAWS, signs, tried, missing_force(MODEL, nuisances), MODEL, scale_of(nuisances, MODEL), nuisances
    )


@pytest.mark.parametrize(
    ("law", "right", "sizes"),
    [(stopped_and_damped, (2, 3), (6.0, 0.5)), (square_and_position, (1, 5), (1.5, 0.6))],
)
def test_the_two_laws_that_act_explain_most_together_and_have_their_sizes(law, right, sizes):
    found = placed(law)
    assert [one.share for one in found] == sorted((one.share for one in found), reverse=True)
    best = found[0]
    assert best.laws == right
    assert [type(term) for term in best.terms] == [type(LAWS[i]) for i in right]
    for term, size in zip(best.terms, sizes, strict=True):
        assert float(term.values[0]) == pytest.approx(size, rel=0.3)


def test_a_pair_explains_more_than_either_alone():
    nuisances = prepare(record(stopped_and_damped), MODEL)
    latent, scale = missing_force(MODEL, nuisances), scale_of(nuisances, MODEL)
    [pair] = place_together(LAWS, EITHER, [(2, 3)], latent, MODEL, scale, nuisances)
    alone = [place(LAWS[i], latent, MODEL, scale, nuisances, sides=True)[0].share for i in (2, 3)]
    assert pair.share > 0.8 and all(share is not None and share < pair.share - 0.1 for share in alone)


def test_signs_are_kept_and_a_law_is_no_pair_with_itself():
    softening = placed(lambda x, v: stopped_and_damped(x, v) + 1.5 * x**2, (-1, -1, 0, 0, 0, 0), [(0, 2), (1, 3)])
    for one in softening:
        assert float(one.terms[0].values[0]) < 0
    nuisances = prepare(record(stopped_and_damped), MODEL)
    latent, scale = missing_force(MODEL, nuisances), scale_of(nuisances, MODEL)
    assert place_together([LAWS[0]] * 2, (0, 0), [(0, 1)], latent, MODEL, scale, nuisances) == []


def test_pairs_are_tried_that_explain_most_together_whatever_each_explains_alone():
    """No single cause is handed in to build on."""
    nuisances = prepare(record(stopped_and_damped), MODEL)
    chosen = chosen_causes(("end_stop", "quadratic_damping", "coulomb", "quadratic_stiffness", "force_gain"))
    every: list[Candidate] = candidates(MODEL, [nuisances], chosen)
    effects, problem = (
        [effect for one in every for effect in one.effects],
        Problem(MODEL, [nuisances], [nuisances.samples]),
    )
    tried = pairs([], None, effects, problem)
    first = tried[0]
    assert {effect.cause.id for effect in first.effects} == {"end_stop", "quadratic_damping"}
    assert [type(term) for term in first.starts[0].terms[-2:]] == [e.cause.effect for e in first.effects]
    families = [tuple(effect.cause.family for effect in one.effects) for one in tried]
    assert len(set(families)) == len(families)
