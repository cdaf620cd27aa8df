"""Reproducing kernel maps: enriched across lines, chosen by the data, robust, tuned by gradient, and reporting."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from jfsm.surrogates import RKPM, GaussianWindow, Plane
from jfsm.surrogates.rkpm.basis import basis_size, multi_indices
from jfsm.surrogates.rkpm.interfaces import regions


def box(n: int, dim: int = 2, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1.0, 1.0, (n, dim))


def monomials_on_each_side(states: np.ndarray, order: int, across) -> np.ndarray:
    """Every monomial times the indicator of every region, eq. 48."""
    powers = np.array(multi_indices(states.shape[1], order))
    columns = np.prod(states[:, None, :] ** powers[None], axis=2)
    side = regions(states, across)
    return np.concatenate([columns * (side == number)[:, None] for number in range(2 ** len(across))], axis=1)


def smooth_force(states):
    return jnp.tanh(2.0 * states[..., 0]) + jnp.sin(3.0 * states[..., 1])


# --- enrichment -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("dim", "order", "across"),
    [
        (1, 3, (Plane((1.0,), 0.2),)),
        pytest.param(2, 2, (Plane((1.0, 0.0), 0.0), Plane((0.0, 1.0), 0.1)), marks=pytest.mark.slow),
        (2, 3, (lambda state: state @ state - 0.4,)),
        (3, 1, (Plane((1.0, -1.0, 0.5), 0.1),)),
    ],
)
def test_every_monomial_is_reproduced_on_each_side_of_lines_and_surfaces(dim, order, across):
    states, queries = box(600, dim), 0.95 * box(40, dim, seed=1)
    force_map = RKPM.fit(states, monomials_on_each_side(states, order, across), order=order, across=across)
    exact = monomials_on_each_side(queries, order, across)
    np.testing.assert_allclose(force_map.evaluate(queries), exact, atol=1e-10)
    one = np.stack([force_map(query) for query in queries[:5]])
    np.testing.assert_allclose(one, exact[:5], atol=1e-10)


def test_a_derivative_beside_a_kink_is_that_of_its_own_side():
    states = box(400)
    force_map = RKPM.fit(states, np.abs(states[:, 0]), order=2, across=[Plane((1.0, 0.0))])
    for x in (-0.3, -1e-6, 1e-6, 0.3):
        np.testing.assert_allclose(force_map.gradient(np.array([x, 0.2])), [np.sign(x), 0.0], atol=1e-9)
    assert float(force_map.std(np.array([1e-6, 0.2]))) < 1e-9


def test_a_region_with_few_nodes_uses_them_all():
    states = np.concatenate([box(300), box(9, seed=2) * 0.2 + [[1.5, 0.0]]])
    across = (Plane((1.0, 0.0), 1.1),)
    force = np.where(states[:, 0] > 1.1, 5.0 + states[:, 1], states[:, 0])
    force_map = RKPM.fit(states, force, order=1, across=across)
    query = np.array([1.45, 0.05])
    assert abs(force_map(query) - 5.05) < 1e-12
    assert abs(force_map.evaluate(query[None])[0] - 5.05) < 1e-12
    assert force_map.support(query[None]).nodes[0] == 9


@pytest.mark.parametrize(
    ("across", "error", "message"),
    [
        ((0.0,), TypeError, r"`across` must hold functions of one state such as Plane\(\(1, 0\), 0.0\); got 0.0"),
        ((lambda s: s,), ValueError, r"functions that return one number; one returned shape \(2,\)"),
        ((Plane((1.0,)),), ValueError, "functions of one state of 2 columns"),
        ((Plane((1.0, 0.0), 0.99),), ValueError, "In one region between the interfaces `across`: .* at least 6"),
    ],
)
def test_wrong_interfaces_are_refused(across, error, message):
    with pytest.raises(error, match=message):
        RKPM.fit(box(100), np.ones(100), order=2, across=across)


def test_a_state_in_a_region_without_readings_is_refused():
    states = box(200)
    both = (Plane((1.0, 0.0), 0.0), Plane((0.0, 1.0), 0.0))
    states = states[~np.all(states > 0.0, axis=1)]
    force_map = RKPM.fit(states, states[:, 0], order=1, across=both)
    with pytest.raises(RuntimeError, match="1 of 2 states lie in a region between the interfaces .* no readings"):
        force_map.evaluate(np.array([[0.5, 0.5], [-0.5, 0.5]]))
    with pytest.raises(RuntimeError, match="degenerate position"):
        force_map(np.array([0.5, 0.5]))
    with pytest.raises(ValueError, match="`normal` must not be zero"):
        Plane((0.0, 0.0))


# --- chosen by the data -----------------------------------------------------------------------------------------------


def test_an_error_left_out_is_that_of_a_map_without_the_reading():
    states = box(60)
    force = np.asarray(smooth_force(states))
    force_map = RKPM.fit(states, force, order=1, neighbours=59)  # all but one: the support is the same without one
    errors = np.asarray(force_map.leave_one_out())
    nodes = np.asarray(force_map.nodes.states)
    for k in (3, 31):
        weight = np.ones(60)
        weight[k] = 1e-9  # a reading that is there and says nothing
        without = eqx.tree_at(lambda tree: tree.nodes.multiplicity, force_map, jnp.asarray(weight))
        assert abs(force_map.nodes.force[k] - without(nodes[k]) - errors[k]) < 1e-7


def test_order_and_support_follow_the_truth_and_the_noise():
    states = box(900)
    cubic = states[:, 0] ** 3 - states[:, 0] * states[:, 1] + states[:, 1]
    clean = RKPM.select(states, cubic)
    best = next(score for score in clean.scores if score.chosen)
    assert best.order >= 3 and best.error < 1e-10
    noise = 0.1 * np.random.default_rng(3).normal(size=900)
    noisy = RKPM.select(states, cubic + noise)
    best = next(score for score in noisy.scores if score.chosen)
    assert best.neighbours >= 16 * basis_size(2, best.order)
    assert abs(best.error / 0.1 - 1.0) < 0.1  # three standard deviations of the noise's own
    queries = 0.9 * box(200, seed=4)
    exact = queries[:, 0] ** 3 - queries[:, 0] * queries[:, 1] + queries[:, 1]
    chosen, default = noisy.force_map, RKPM.fit(states, cubic + noise, order=4, neighbours=30)
    errors = [float(np.std(np.asarray(m.evaluate(queries)) - exact)) for m in (chosen, default)]
    assert errors[0] < 0.025 and errors[0] < 0.5 * errors[1], errors
    assert {score.order for score in noisy.scores} == {1, 2, 3, 4}


def test_orders_that_the_states_cannot_carry_are_left_out():
    t = np.linspace(0.0, 20.0, 300)
    ellipse = np.stack([np.sin(t), np.cos(t)], axis=1)
    selection = RKPM.select(ellipse, ellipse[:, 0], neighbours=(20, 60))
    assert {score.order for score in selection.scores} == {1}
    with pytest.raises(ValueError, match="all 6 monomials of order 2"):
        RKPM.select(ellipse, ellipse[:, 0], orders=(2, 3))
    with pytest.raises(ValueError, match="`orders` must hold at least one order"):
        RKPM.select(ellipse, ellipse[:, 0], orders=())


def test_outliers_do_not_bend_a_robust_map():
    states = box(600)
    rng = np.random.default_rng(5)
    force = np.asarray(smooth_force(states)) + 0.02 * rng.normal(size=600)
    force[::15] += 5.0 * rng.choice([-1.0, 1.0], 40)
    queries = 0.9 * box(100, seed=6)
    maps = [RKPM.fit(states, force, order=2, robust=option) for option in (False, True)]
    plain, robust = (float(jnp.std(force_map.evaluate(queries) - smooth_force(queries))) for force_map in maps)
    assert robust < 0.02 and robust < 0.1 * plain, (robust, plain)


def test_a_robust_map_still_reproduces_polynomials():
    states = box(300)
    force = 1.0 + states[:, 0] * states[:, 1]
    force_map = RKPM.fit(states, force, order=2, robust=True)
    np.testing.assert_allclose(force_map(np.array([0.3, -0.4])), 0.88, atol=1e-10)


# --- derivatives by everything ----------------------------------------------------------------------------------------


def test_a_map_is_differentiable_by_its_nodes_its_readings_its_scales_and_its_dilation():
    states = box(150)
    force_map = RKPM.fit(states, smooth_force(states), order=2, window=GaussianWindow(0.4), dilation=0.8)
    query = jnp.array([0.11, -0.23])

    def value(tree):
        return tree(query) ** 2

    slope = eqx.filter_grad(value)(force_map)
    rng = np.random.default_rng(7)
    for leaf in (
        lambda tree: tree.nodes.states,
        lambda tree: tree.nodes.force,
        lambda tree: tree.nodes.scale,
        lambda tree: tree.rule.dilation,
        lambda tree: tree.rule.window.width,
    ):
        at = leaf(force_map)
        way = jnp.asarray(rng.normal(size=at.shape))
        h = 1e-6
        ends = [value(eqx.tree_at(leaf, force_map, at + sign * h * way)) for sign in (1.0, -1.0)]
        difference = (ends[0] - ends[1]) / (2.0 * h)
        np.testing.assert_allclose(jnp.vdot(leaf(slope), way), difference, rtol=1e-5, atol=1e-9)


def test_one_call_tunes_the_scales_of_the_columns():
    states = box(500)
    force = jnp.sin(6.0 * states[:, 0]) + 0.1 * states[:, 1]  # rough along the first column alone
    force_map = RKPM.fit(states, force, order=1, neighbours=30)
    tuned = force_map.tuned()
    before, after = (float(jnp.std(m.leave_one_out())) for m in (force_map, tuned))
    assert after < 0.6 * before, (before, after)
    ratio = np.asarray(tuned.nodes.scale / force_map.nodes.scale)
    assert ratio[1] > 1.5 * ratio[0], ratio


@pytest.mark.parametrize("dilation", [0.0, 1.2])
def test_a_dilation_beyond_the_fetched_nodes_is_refused(dilation):
    with pytest.raises(ValueError, match="`dilation` must lie above 0 and at most at 1"):
        RKPM.fit(box(100), np.ones(100), dilation=dilation)


# --- what was done ----------------------------------------------------------------------------------------------------


def test_the_report_says_how_many_nodes_carry_each_state_and_where_the_map_extrapolates():
    states = box(400)
    force_map = RKPM.fit(states, smooth_force(states), order=2, neighbours=40)
    queries = np.array([[0.0, 0.0], [0.4, -0.3], [4.0, 0.0]])
    report = force_map.support(queries)
    assert np.array_equal(report.visited, [True, True, False])
    assert np.array_equal(report.nodes[:2], [40, 40])
    assert report.dilation.shape == (3, 2) and np.all(report.dilation[2] > report.dilation[0])
    assert 1.0 < report.condition[0] < 1e6 < report.condition[2]


def test_a_support_that_had_to_grow_is_reported():
    line = np.stack([np.linspace(-0.01, 0.01, 80), np.zeros(80)], axis=1)
    states = np.concatenate([line, box(200)])
    report = RKPM.fit(states, states[:, 0], order=2, neighbours=25).support(np.array([[0.001, 0.0], [0.6, 0.6]]))
    assert report.nodes[0] > 80 and report.nodes[1] == 25
