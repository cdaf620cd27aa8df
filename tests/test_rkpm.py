"""Reproducing kernel particle maps: what they reproduce, what leaves them unchanged, and what they refuse."""

import itertools
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from jfsm.structures import MapTerm
from jfsm.surrogates import (
    RKPM,
    CubicSplineWindow,
    GaussianWindow,
    QuarticSplineWindow,
    tabulate,
)
from jfsm.surrogates.rkpm import many, shape_functions
from jfsm.surrogates.rkpm.basis import basis_size, derivative_targets, monomials, multi_indices

WINDOWS = (CubicSplineWindow(), QuarticSplineWindow(), GaussianWindow(0.4))


def scattered(n: int, dim: int, seed: int = 0) -> np.ndarray:
    """States of unlike units: metres and metres per second, say."""
    units = np.array([0.02, 3.0, 0.5, 40.0])[:dim]
    return np.random.default_rng(seed).uniform(-1.0, 1.0, (n, dim)) * units


def trajectory(n: int = 1500) -> np.ndarray:
    """States along one motion of two incommensurate frequencies."""
    t = np.linspace(0.0, 60.0, n)
    x = 0.6 * np.sin(t) + 0.4 * np.sin(math.sqrt(7.0) * t + 0.5)
    v = 0.6 * np.cos(t) + 0.4 * math.sqrt(7.0) * np.cos(math.sqrt(7.0) * t + 0.5)
    return np.stack([x, v], axis=1)


def smooth_force(states):
    """A truth that is no polynomial."""
    return jnp.tanh(40.0 * states[..., 0]) + jnp.sin(states[..., 1]) * jnp.cos(30.0 * states[..., 0])


def monomial_derivative(states: np.ndarray, exponents: tuple[int, ...], orders: tuple[int, ...]) -> np.ndarray:
    """Exact derivative of one monomial."""
    value = np.ones(states.shape[0])
    for axis, (power, order) in enumerate(zip(exponents, orders, strict=True)):
        if order > power:
            return np.zeros(states.shape[0])
        value = value * math.perm(power, order) * states[:, axis] ** (power - order)
    return value


def all_monomials(states: np.ndarray, order: int) -> np.ndarray:
    return np.stack(
        [monomial_derivative(states, e, (0,) * states.shape[1]) for e in multi_indices(states.shape[1], order)], axis=1
    )


# --- windows and basis ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("window", WINDOWS, ids=lambda w: type(w).__name__)
def test_a_window_is_positive_inside_its_support_and_zero_beyond(window):
    inside = jnp.linspace(0.0, 0.999, 50) * window.radius
    assert np.all(window(inside) > 0.0)
    assert np.all(np.diff(window(inside)) <= 0.0)
    assert np.all(window(jnp.array([1.0, 1.5, 20.0]) * window.radius) == 0.0)


def test_the_cubic_spline_window_is_the_one_of_the_paper():
    # Eq. 8 at z = 0, 1/2, 1, 3/2: 2/3, 2/3 - (1/4)(3/2)/2, 1/6, (1/2)³/6
    expected = [2 / 3, 2 / 3 - 0.1875, 1 / 6, 1 / 48]
    np.testing.assert_allclose(CubicSplineWindow()(jnp.array([0.0, 0.5, 1.0, 1.5])), expected, rtol=1e-15)


@pytest.mark.parametrize(("dim", "order"), list(itertools.product((1, 2, 3, 4), (1, 2, 3, 4))))
def test_the_basis_holds_every_monomial_once(dim, order):
    indices = multi_indices(dim, order)
    assert len(set(indices)) == len(indices) == basis_size(dim, order)
    z = np.random.default_rng(1).normal(size=(7, dim))
    np.testing.assert_allclose(monomials(jnp.asarray(z), order), all_monomials(z, order), rtol=1e-13)


def test_the_target_of_a_derivative_is_that_of_the_monomials_at_the_origin_with_the_sign_of_the_paper():
    # (-1)^3 times the derivative x¹v² → 1!·2! of the one monomial that survives at the origin
    target = derivative_targets([(1, 2)], 3).at_origin[0]
    assert target[multi_indices(2, 3).index((1, 2))] == -2.0
    assert np.count_nonzero(target) == 1


# --- reproduction -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("window", WINDOWS, ids=lambda w: type(w).__name__)
def test_shape_functions_sum_to_one_and_those_of_derivatives_to_zero(window):
    nodes = jnp.asarray(np.random.default_rng(2).uniform(-1.0, 1.0, (60, 2)))
    at: dict[str, Any] = dict(order=2, window=window)
    point, dilation = jnp.array([0.1, -0.2]), jnp.array([1.0, 1.2])
    assert abs(jnp.sum(shape_functions(point, nodes, dilation, **at)) - 1.0) < 1e-13
    assert abs(jnp.sum(shape_functions(point, nodes, dilation, orders=(1, 1), **at))) < 1e-11


@pytest.mark.parametrize(("dim", "order"), [(1, 1), (1, 4), (2, 1), (2, 2), (2, 3), (2, 4), (3, 3), (4, 2)])
def test_every_monomial_and_its_derivatives_are_reproduced_on_scattered_nodes(dim, order):
    states = scattered(max(300, 9 * basis_size(dim, order)), dim)
    unit = states.std(axis=0)
    force_map = RKPM.fit(states, all_monomials(states / unit, order), order=order)
    queries = scattered(6, dim, seed=3) * 0.9
    for beta in multi_indices(dim, order):
        exact = np.stack([monomial_derivative(queries / unit, e, beta) for e in multi_indices(dim, order)], axis=1)
        found = np.stack([force_map.derivative(q, orders=beta) for q in queries]) * np.prod(unit ** np.array(beta))
        # each derivative divides rounding by the support, about a quarter of the domain
        np.testing.assert_allclose(found, exact, atol=1e-12 * 20.0 ** sum(beta))


@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_every_monomial_and_its_derivatives_are_reproduced_on_a_trajectory(order):
    states = trajectory()
    force_map = RKPM.fit(states, all_monomials(states, order), order=order)
    queries = states[::211] * 0.97
    for beta in multi_indices(2, order):
        exact = np.stack([monomial_derivative(queries, e, beta) for e in multi_indices(2, order)], axis=1)
        found = np.stack([force_map.derivative(q, orders=beta) for q in queries])
        np.testing.assert_allclose(found, exact, atol=1e-12 * 30.0 ** sum(beta))


@pytest.mark.parametrize("window", WINDOWS, ids=lambda w: type(w).__name__)
@pytest.mark.parametrize("neighbours", [10, pytest.param(20, marks=pytest.mark.slow), 160])
def test_any_window_and_any_number_of_neighbours_reproduce_a_cubic(window, neighbours):
    states = scattered(500, 2)
    unit = states.std(axis=0)
    force_map = RKPM.fit(states, all_monomials(states / unit, 3), neighbours=neighbours, window=window)
    queries = scattered(20, 2, seed=4) * 0.8
    np.testing.assert_allclose(force_map.evaluate(queries), all_monomials(queries / unit, 3), atol=1e-9)


def test_a_duffing_record_gives_back_its_stiffness_damping_and_cubic_spring():
    k, c, alpha = 9.0, 0.12, 10.0
    a, b = np.random.default_rng(7).normal(size=(2, 15))
    omega = 2.4 * np.arange(1, 16)

    def acceleration(t, x, v):
        g = 10.0 * (a @ np.sin(np.outer(omega, t)) + b @ np.cos(np.outer(omega, t)))
        return g, g - c * v - k * x - alpha * x**3

    times = np.arange(0.0, 15.0, 2.0 * np.pi / 240.0)
    run = solve_ivp(
        lambda t, y: [y[1], acceleration(t, *y)[1][0]],
        (0.0, times[-1]),
        [0.0, 0.0],
        method="DOP853",
        t_eval=times,
        rtol=1e-12,
        atol=1e-12,
    )
    x, v = run.y
    g, measured_acceleration = acceleration(times, x, v)
    force_map = RKPM.fit(run.y.T, g - measured_acceleration, order=3)
    origin = np.zeros(2)
    np.testing.assert_allclose(force_map.gradient(origin), [k, c], rtol=1e-8)
    np.testing.assert_allclose(force_map.derivative(origin, orders=(3, 0)) / 6.0, alpha, rtol=1e-8)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_the_error_falls_with_the_spacing_to_the_power_of_the_order_plus_one(order):
    queries = np.random.default_rng(8).uniform(-0.6, 0.6, (300, 2))

    def truth(s):
        return np.sin(2.0 * s[:, 0]) * np.exp(0.7 * s[:, 1])

    errors = []
    for n in (20, 40, 80):  # jittered grids, so that the spacing is what it says
        axis = np.linspace(-1.0, 1.0, n)
        grid = np.stack(np.meshgrid(axis, axis), -1).reshape(-1, 2)
        grid = grid + np.random.default_rng(n).uniform(-0.3, 0.3, grid.shape) / n
        force_map = RKPM.fit(grid, truth(grid), order=order)
        errors.append(np.sqrt(np.mean((np.asarray(force_map.evaluate(queries)) - truth(queries)) ** 2)))
    rates = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert np.all(rates > order + 0.7), rates


# --- invariance -------------------------------------------------------------------------------------------------------


def test_the_map_does_not_depend_on_units_or_on_the_order_of_the_nodes():
    states = scattered(400, 2)
    force = np.asarray(smooth_force(states))
    queries = scattered(30, 2, seed=5)
    reference = RKPM.fit(states, force).evaluate(queries)
    units = np.array([1e3, 1e-4])
    np.testing.assert_allclose(RKPM.fit(states * units, force).evaluate(queries * units), reference, rtol=0, atol=1e-11)
    shuffled = np.random.default_rng(6).permutation(400)
    np.testing.assert_allclose(RKPM.fit(states[shuffled], force[shuffled]).evaluate(queries), reference, atol=1e-11)


def test_a_state_read_many_times_counts_as_often_as_it_was_read():
    states, rng = scattered(40, 2), np.random.default_rng(9)
    noise = rng.normal(size=(3, 40))
    repeated = RKPM.fit(np.tile(states, (3, 1)), noise.reshape(-1), order=1)
    merged = RKPM.fit(states, noise.mean(axis=0), order=1)
    query = np.array([0.001, 0.1])
    np.testing.assert_allclose(repeated(query), merged(query), rtol=1e-11)


# --- derivatives ------------------------------------------------------------------------------------------------------


def test_autodiff_of_the_value_agrees_with_finite_differences():
    states = scattered(400, 2)
    force_map = RKPM.fit(states, smooth_force(states))
    for state in scattered(4, 2, seed=11) * 0.8:
        slope = jax.grad(force_map)(jnp.asarray(state))
        for axis, h in enumerate((2e-7, 3e-5)):
            step = np.eye(2)[axis] * h
            difference = (force_map(state + step) - force_map(state - step)) / (2.0 * h)
            assert abs(difference - slope[axis]) < 1e-6 * max(1.0, abs(slope[axis]))


def test_the_gradient_is_finite_at_a_node():
    states = scattered(200, 2)
    force_map = RKPM.fit(states, smooth_force(states))
    assert np.all(np.isfinite(jax.grad(force_map)(jnp.asarray(states[17]))))
    assert np.all(np.isfinite(jax.hessian(force_map)(jnp.asarray(states[17]))))


def test_reproduced_gradients_come_near_those_of_a_smooth_truth():
    states = scattered(4000, 2)
    force_map = RKPM.fit(states, smooth_force(states))
    for state in scattered(5, 2, seed=12) * 0.8:
        exact = jax.grad(smooth_force)(jnp.asarray(state))
        np.testing.assert_allclose(force_map.gradient(state), exact, rtol=0.02, atol=0.02)


def test_the_gradient_is_the_first_derivatives_in_the_order_of_the_columns():
    states = scattered(300, 2)
    force_map = RKPM.fit(states, np.stack([smooth_force(states), states[:, 1]], axis=1))
    query = np.array([0.003, -0.4])
    stacked = np.stack([force_map.derivative(query, (1, 0)), force_map.derivative(query, (0, 1))], axis=-1)
    np.testing.assert_allclose(force_map.gradient(query), stacked, rtol=1e-12, atol=1e-12)


@pytest.mark.slow
def test_the_map_can_be_differentiated_by_the_width_of_its_window_and_by_the_readings():
    states = scattered(300, 2)
    force, queries = smooth_force(states), scattered(10, 2, seed=13)

    def by_width(width):
        return jnp.sum(RKPM.fit(states, force, window=GaussianWindow(width)).evaluate(queries) ** 2)

    difference = (by_width(0.4001) - by_width(0.3999)) / 2e-4
    np.testing.assert_allclose(jax.grad(by_width)(0.4), difference, rtol=1e-4)

    def by_force(force):
        return jnp.sum(RKPM.fit(states, force).evaluate(queries))

    # the map is linear in the readings
    np.testing.assert_allclose(jax.grad(by_force)(force) @ force, by_force(force), rtol=1e-10)


# --- one path and the other -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("dim", "outputs"),
    [(1, 0), pytest.param(2, 0, marks=pytest.mark.slow), pytest.param(2, 3, marks=pytest.mark.slow), (4, 2)],
)
def test_many_states_at_once_give_what_single_calls_give(dim, outputs):
    states = scattered(400, dim)
    columns = all_monomials(states / states.std(axis=0), 4)
    force = columns[:, -1] if outputs == 0 else columns[:, -outputs:]
    force_map = RKPM.fit(states, force, order=3 if dim < 4 else 2)
    queries = scattered(9, dim, seed=14) * 0.9
    shape = (outputs,) if outputs else ()
    assert force_map(queries[0]).shape == shape
    assert force_map.gradient(queries[0]).shape == (*shape, dim)
    assert force_map.std(queries[0]).shape == shape
    many_at_once = force_map.evaluate(queries)
    assert many_at_once.shape == (9, *shape)
    one_by_one = np.stack([force_map(q) for q in queries])
    np.testing.assert_allclose(many_at_once, one_by_one, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(jax.vmap(force_map)(jnp.asarray(queries)), one_by_one, rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(eqx.filter_jit(force_map)(queries[0]), one_by_one[0], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(jax.jit(lambda q: force_map.evaluate(q))(queries), one_by_one, rtol=1e-9, atol=1e-9)


def test_outputs_are_fitted_independently_of_each_other():
    states = scattered(300, 2)
    force = np.stack([smooth_force(states), states[:, 0] ** 2], axis=1)
    query = np.array([0.004, 0.3])
    both = RKPM.fit(states, force)
    for column in (0, 1):
        alone = RKPM.fit(states, force[:, column])
        np.testing.assert_allclose(both(query)[column], alone(query), rtol=1e-12)
        np.testing.assert_allclose(both.std(query)[column], alone.std(query), rtol=1e-9, atol=1e-15)


def test_several_derivatives_come_from_one_evaluation():
    states = scattered(300, 2)
    force_map = RKPM.fit(states, smooth_force(states))
    queries, orders = scattered(5, 2, seed=15) * 0.8, ((0, 0), (1, 0), (1, 1), (0, 3))
    found = force_map.evaluate_derivatives(queries, orders)
    assert found.shape == (5, 4)
    expected = np.array([[force_map.derivative(q, o) for o in orders] for q in queries])
    np.testing.assert_allclose(found, expected, rtol=1e-7)


def test_ill_conditioned_neighbourhoods_are_solved_again_exactly():
    states = trajectory(1500)
    force_map = RKPM.fit(states, all_monomials(states, 3), neighbours=11)
    corners = np.array([[0.9, 1.4], [-0.9, 1.4], [0.0, 0.0], [0.9, -1.4]])
    nodes, rule = force_map.nodes, force_map.rule
    tree = many.search_tree(nodes)
    _, ratio = many._by_moments(tree, nodes, rule, corners, derivative_targets([(0, 0)], 3))
    assert np.any(ratio < many.TRUSTED_PIVOT_RATIO), "the case no longer tests what it is for"
    np.testing.assert_allclose(force_map.evaluate(corners), all_monomials(corners, 3), rtol=0, atol=1e-8)


def test_many_derivatives_of_a_large_basis_need_no_more_than_a_moment():
    """XLA once waited for ever on 64 neighbourhoods of 225 nodes, 28 monomials, 6 derivatives and an exact solve."""
    states, queries = scattered(1000, 2, seed=4), scattered(64, 2, seed=5) * 0.9
    force_map = RKPM.fit(states, all_monomials(states, 6)[:, 12:14], order=6, neighbours=56)
    tree, orders = many.search_tree(force_map.nodes), ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
    targets = derivative_targets(orders, 6)
    exact, _ = many._by_factorisation(tree, force_map.nodes, force_map.rule, queries, targets)
    truth = [[monomial_derivative(queries, e, o) for e in multi_indices(2, 6)[12:14]] for o in orders]
    np.testing.assert_allclose(exact, np.transpose(truth, (2, 0, 1)), rtol=0, atol=1e-6)


def test_a_thousand_states_that_need_factorisation_are_no_more_than_a_hundred():
    states = trajectory()
    force_map = RKPM.fit(states, smooth_force(states), neighbours=80)
    corner = np.linspace(0.9, 1.3, 1000)[:, None] * states.max(axis=0)  # far from all readings
    orders = ((0, 0), (1, 0), (0, 1), (1, 1))
    few, many_ = (force_map.evaluate_derivatives(part, orders) for part in (corner[:100], corner))
    np.testing.assert_allclose(many_[:100], few, rtol=1e-9)


def test_a_map_keeps_its_search_tree_as_long_as_it_lives():
    states = scattered(300, 2)
    force_map, before = RKPM.fit(states, smooth_force(states)), len(many._TREES)
    tree = many.search_tree(force_map.nodes)
    assert many.search_tree(force_map.nodes) is tree
    same = jax.tree.map(lambda leaf: leaf, force_map)
    assert many.search_tree(same.nodes) is tree
    wider = eqx.tree_at(lambda m: m.nodes.scale, force_map, 2.0 * force_map.nodes.scale)
    np.testing.assert_allclose(many.search_tree(wider.nodes).data, tree.data / 2.0)
    del wider, same, force_map
    assert len(many._TREES) == before


def test_counts_within_one_power_of_two_share_one_program(monkeypatch):
    states = scattered(300, 2)
    force_map = RKPM.fit(states, smooth_force(states))
    traced = eqx.filter_jit(eqx.debug.assert_max_traces(many.moment_estimates.__wrapped__, max_traces=1))
    monkeypatch.setattr(many, "moment_estimates", traced)
    for count in (70, 100, 128):
        assert force_map.evaluate(scattered(count, 2, seed=count)).shape == (count,)
    force_map.evaluate_derivatives(scattered(90, 2), ((1, 0),))
    larger = RKPM.fit(scattered(417, 2), np.ones(417))
    larger.evaluate(scattered(90, 2))


def test_no_states_give_no_forces():
    force_map = RKPM.fit(scattered(100, 2), np.ones((100, 2)))
    assert force_map.evaluate(np.zeros((0, 2))).shape == (0, 2)


# --- noise and extrapolation ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("orders", [(0, 0), (1, 0), (1, 1)])
def test_the_standard_error_is_the_scatter_of_repeated_experiments(orders):
    states = scattered(300, 2)
    noise = np.random.default_rng(16).normal(scale=0.3, size=(300, 400))
    force_map = RKPM.fit(states, states[:, :1] / 0.02 + noise, order=2, neighbours=10)  # few degrees of freedom left
    query = np.array([0.004, -0.5])
    scatter = np.std(np.asarray(force_map.derivative(query, orders)))
    stated = np.sqrt(np.mean(np.asarray(force_map.std(query, orders)) ** 2))
    if orders == (0, 0):
        np.testing.assert_array_equal(force_map.std(query), force_map.std(query, orders))
    assert abs(stated / scatter - 1.0) < 0.12  # three standard deviations of both, from 400 experiments


def test_the_standard_error_knows_how_often_a_state_was_read():
    states = np.tile(scattered(60, 2), (4, 1))
    noise = np.random.default_rng(17).normal(size=(240, 400))
    force_map = RKPM.fit(states, noise, order=1)
    query = np.array([0.004, -0.5])
    stated = np.sqrt(np.mean(np.asarray(force_map.std(query)) ** 2))
    assert abs(stated / np.std(np.asarray(force_map(query))) - 1.0) < 0.12


def test_states_far_from_every_reading_are_flagged():
    states = trajectory()
    force_map = RKPM.fit(states, states[:, 0])
    assert np.mean(force_map.visited(states)) == 1.0
    assert not np.any(force_map.visited(np.array([[3.0, 0.0], [0.0, -4.0], [1.0, 1.6]])))


# --- degenerate neighbourhoods ----------------------------------------------------------------------------------------


def clustered() -> np.ndarray:
    """Eighty states on one short line, and two hundred spread around it."""
    line = np.stack([np.linspace(-0.01, 0.01, 80), np.zeros(80)], axis=1)
    return np.concatenate([line, np.random.default_rng(18).uniform(-1.0, 1.0, (200, 2))])


def test_a_neighbourhood_on_one_line_grows_until_it_carries_the_basis():
    states = clustered()
    force_map = RKPM.fit(states, all_monomials(states, 2), order=2, neighbours=25)
    query = np.array([[0.001, 0.0]])
    np.testing.assert_allclose(force_map(query[0]), all_monomials(query, 2)[0], atol=1e-9)
    np.testing.assert_allclose(force_map.evaluate(query), all_monomials(query, 2), atol=1e-9)


def test_a_neighbourhood_that_cannot_grow_enough_is_refused_on_both_paths():
    states = clustered()
    force_map = RKPM.fit(states, states[:, 0], order=2, neighbours=8)
    message = r"degenerate position: the nearest 33 of 280 determine fewer than the 6 monomials of order 2 \(the moment"
    with pytest.raises(RuntimeError, match=message):
        force_map(np.array([0.001, 0.0]))
    with pytest.raises(RuntimeError, match=message + r".*So at 1 of 2 states, the first \[0\.001 0\."):
        force_map.evaluate(np.array([[0.5, 0.5], [0.001, 0.0]]))


def test_a_record_that_rests_for_long_is_mapped_as_if_it_had_rested_briefly():
    states = trajectory(400)
    resting = np.concatenate([np.zeros((1000, 2)), states])
    force_map = RKPM.fit(resting, resting[:, 0] ** 3)
    assert len(force_map.nodes) == 401
    assert abs(force_map(np.array([0.01, 0.01])) - 1e-6) < 1e-12


# --- refusals ---------------------------------------------------------------------------------------------------------


def test_states_that_cannot_determine_the_polynomials_are_refused_with_their_rank():
    t = np.linspace(0.0, 20.0, 400)
    ellipse = np.stack([np.sin(t), np.cos(t)], axis=1)
    with pytest.raises(
        ValueError, match=r"all 6 monomials of order 2; the 400 distinct points have rank 5: .*lower `order`"
    ):
        RKPM.fit(ellipse, t, order=2)
    assert RKPM.fit(ellipse, ellipse[:, 0], order=1)(np.array([0.1, 0.9])) == pytest.approx(0.1, abs=1e-12)
    with pytest.raises(ValueError, match="all 3 monomials of order 1; the 400 distinct points have rank 2"):
        RKPM.fit(np.stack([t, 2.0 * t], axis=1), t, order=1)


GOOD = scattered(50, 2)


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        (dict(states=GOOD[:, 0]), ValueError, r"`states` must have 2 axes; got shape \(50,\)"),
        (dict(states=GOOD[:, :0]), ValueError, r"`states` must have at least one column; got shape \(50, 0\)"),
        (dict(force=np.ones(49)), ValueError, r"shape \(50,\) or \(50, outputs\); got shape \(49,\)"),
        (dict(force=np.full(50, np.nan)), ValueError, "`force` must be finite; 50 of 50"),
        (dict(states=np.where(GOOD == GOOD[3, 1], np.nan, GOOD)), ValueError, "`states` must be finite; 1 of 100"),
        (
            dict(states=GOOD[:9], force=np.ones(9)),
            ValueError,
            r"at least 10 distinct points for order 3 .* got 9\.",
        ),
        (dict(states=np.repeat(GOOD[:5], 10, axis=0)), ValueError, "at least 10 distinct points .* got 5"),
        (dict(states=GOOD * [1, 0] + [0, 2]), ValueError, r"Column 1 of `states` is constant \(2\).* Leave it out"),
        (dict(order=0), ValueError, "`order` must be an integer of 1 or more; got 0"),
        (dict(order=2.5), ValueError, "`order` must be an integer of 1 or more; got 2.5"),
        (dict(neighbours=9), ValueError, r"from 10 \(n\*, eq\. 72, for order 3 in 2 dimensions\) to 50 .* got 9"),
        (dict(neighbours=51), ValueError, r"to 50 \(all distinct states\); got 51"),
        (dict(window="cubic"), TypeError, r"`window` must be a window such as CubicSplineWindow\(\); got 'cubic'"),
    ],
)
def test_a_wrong_fit_is_refused(arguments, error, message):
    with pytest.raises(error, match=message):
        RKPM.fit(**{"states": GOOD, "force": np.ones(50), **arguments})


def test_wrong_queries_are_refused():
    force_map = RKPM.fit(GOOD, np.ones(50), neighbours=10)
    with pytest.raises(
        ValueError, match=r"`state` must be one state of shape \(2,\); got shape \(3,\)\. Use `evaluate`"
    ):
        force_map(np.zeros(3))
    with pytest.raises(ValueError, match="`state` must have 1 axes"):
        force_map(np.zeros((2, 2)))
    with pytest.raises(ValueError, match="`state` must be finite"):
        force_map(np.array([np.nan, 0.0]))
    with pytest.raises(ValueError, match=r"`states` must have 2 columns, as in `fit`; got shape \(4, 3\)"):
        force_map.evaluate(np.zeros((4, 3)))
    wrong: list[Any] = [(4, 0), (1,), (-1, 0), (0.5, 0)]
    for orders in wrong:
        with pytest.raises(ValueError, match="`orders` must be 2 integers from 0, one per column, .* order 3 at most"):
            force_map.derivative(np.zeros(2), orders)
    with pytest.raises(ValueError, match="`std` needs more neighbours than the 10 monomials; .* with 10. Enlarge"):
        force_map.std(np.zeros(2))
    with pytest.raises(ValueError, match="one displacement and one velocity; this one has 1 columns"):
        RKPM.fit(GOOD[:, :1], np.ones(50)).on(at=(0, 1))


def test_doubles_are_not_narrowed_silently():
    program = (
        "import numpy as np\n"
        "from jfsm.surrogates import RKPM\n"
        "try:\n"
        "    RKPM.fit(np.random.rand(50, 2), np.ones(50))\n"
        "except ValueError as error:\n"
        "    print(error)\n"
    )
    root = Path(__file__).resolve().parents[1]
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=root)
    message = 'float64 data would be narrowed to float32; run `jax.config.update("jax_enable_x64", True)` first.'
    assert run.stdout.strip() == message, run.stderr


# --- a map as a term, and as a table ----------------------------------------------------------------------------------


def test_a_map_becomes_a_term_of_a_structure():
    force_map = RKPM.fit(GOOD, GOOD[:, 0] / 0.02, order=1)
    for term in (force_map.on(at=(0, 2)), tabulate(RKPM.fit(GOOD, GOOD[:, 0] / 0.02, order=2), nodes=8).on(at=(0, 2))):
        assert isinstance(term, MapTerm)
        assert term.at == (0, 2)
        force = term.force(jnp.asarray(0.004), jnp.asarray(0.1), (), jnp.asarray(0.0))
        assert force == pytest.approx(0.2, abs=1e-12)


def test_a_table_of_a_bicubic_map_is_exact_and_says_so():
    def truth(s):
        return (s[..., 0] / 0.02) ** 3 + s[..., 0] * s[..., 1] ** 2 - s[..., 1]

    states = scattered(400, 2)
    table = tabulate(RKPM.fit(states, truth(states)), nodes=8)
    queries = scattered(50, 2, seed=19) * 0.95
    found = jax.jit(jax.vmap(table))(jnp.asarray(queries[:, 0]), jnp.asarray(queries[:, 1]))
    np.testing.assert_allclose(found, truth(queries), atol=1e-10)
    assert table.box_error < 1e-10


def test_the_error_a_table_states_is_the_one_it_makes():
    states = scattered(3000, 2)
    force_map = RKPM.fit(states, smooth_force(states))
    table = tabulate(force_map, nodes=32)
    queries = scattered(2000, 2, seed=20) * 0.98
    error = np.abs(jax.vmap(table)(jnp.asarray(queries)) - force_map.evaluate(queries))[force_map.visited(queries)]
    assert 0.2 * table.error < np.max(error) < 2.0 * table.error
    finer = tabulate(force_map, nodes=64)
    assert finer.error < table.error < 0.02
    assert table.error <= table.box_error


def test_a_table_is_continuous_in_value_and_slope_across_cells():
    states = scattered(500, 2)
    table = tabulate(RKPM.fit(states, smooth_force(states)), nodes=12)
    edge = table.lower + table.step * jnp.array([4.0, 5.3])
    for axis in (0, 1):
        h = jnp.array([1e-12, 0.0]) * table.step[0]
        before, after = edge - h, edge + h
        assert abs(table(before) - table(after)) < 1e-9
        slopes = jax.grad(table)(before)[axis], jax.grad(table)(after)[axis]
        np.testing.assert_allclose(*slopes, rtol=1e-8)


def test_outside_its_box_a_table_holds_the_force_of_the_edge():
    states = scattered(400, 2)
    table = tabulate(RKPM.fit(states, smooth_force(states)), box=[[-0.01, -1.0], [0.01, 1.0]], nodes=16)
    d, w = jnp.asarray(0.5), jnp.asarray(0.3)
    assert table(d, w) == table(jnp.asarray(0.01), w)
    assert jax.grad(table)(d, w) == 0.0
    assert not table.inside(d, w)
    assert table.inside(jnp.asarray(0.01), w)


def test_all_tables_of_one_size_share_one_program():
    @eqx.filter_jit
    @eqx.debug.assert_max_traces(max_traces=1)
    def read(table, state):
        return table(state)

    for n in (200, 300):
        states = scattered(n, 2)
        read(tabulate(RKPM.fit(states, states[:, 0], order=2), nodes=8), jnp.zeros(2))


@pytest.mark.parametrize(
    ("columns", "outputs", "order", "arguments", "message"),
    [
        (1, (), 3, {}, "`force_map` must have two columns, displacement and velocity; it has 1"),
        (2, (2,), 3, {}, "`force_map` must have one output; it has 2. Fit one map per output"),
        (2, (), 3, {"nodes": 1}, "`nodes` must be 2 or more; got 1"),
        (2, (), 3, {"box": [[0, 0], [0, 1]]}, r"`box` must be \(2, 2\), .* got \[\[0\.0, 0\.0\]"),
        (2, (), 3, {"box": [[0, 0, 0]]}, r"`box` must be \(2, 2\)"),
        (2, (), 1, {}, "`orders` must be 2 integers .* order 1 at most"),
    ],
)
def test_a_map_that_no_table_can_hold_is_refused(columns, outputs, order, arguments, message):
    force_map = RKPM.fit(GOOD[:, :columns], np.ones((50, *outputs)), order=order)
    with pytest.raises(ValueError, match=message):
        tabulate(force_map, **arguments)
