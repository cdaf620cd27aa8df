"""Kriging maps: likelihood, limits, derivatives, error bars, and what they refuse."""

import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg

import jfsm
from jfsm.structures import MapTerm
from jfsm.surrogates import (
    Cubic,
    Exponential,
    Gaussian,
    Kriging,
    Linear,
    Matern32,
    Matern52,
    PolynomialTrend,
    PowerExponential,
    Spherical,
    Spline,
    tabulate,
)
from jfsm.surrogates.kriging import inverse, kriging, likelihood, readings
from jfsm.surrogates.kriging.posterior import Posterior

UNIT = np.array([0.02, 3.0])
"""Metres and metres per second, say."""
LENGTH = np.array([0.015, 2.0])


def scattered(n: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1.0, 1.0, (n, 2)) * UNIT


def smooth_force(states):
    """A truth that is no polynomial."""
    return jnp.tanh(60.0 * states[..., 0]) + jnp.sin(states[..., 1]) * jnp.cos(30.0 * states[..., 0])


def noisy(states, share=0.05, seed=1):
    return np.asarray(smooth_force(states)) + share * np.random.default_rng(seed).normal(size=len(states))


STATES = scattered(150)
FORCE = noisy(STATES)
GIVEN: dict[str, Any] = dict(length_scale=LENGTH, nugget=0.01)
QUERIES = scattered(12, seed=2) * 0.9


@pytest.fixture(scope="module")
def fitted():
    return Kriging.fit(STATES, FORCE)


# --- likelihood -------------------------------------------------------------------------------------------------------


def dense(log_parameters, states, force, exponents, kernel, restricted):
    """Eq. 64 at its minimum, or Harville's restricted likelihood, by inverses of whole matrices."""
    length, nugget = np.exp(log_parameters[:-1]), np.exp(log_parameters[-1])
    lag = (states[:, None] - states[None]) / length
    k = np.prod(kernel(lag), axis=-1) + nugget * np.eye(len(states))
    z = states / UNIT
    f, _ = np.linalg.qr(np.stack([np.prod(z**e, axis=1) for e in exponents], axis=1))
    inverted = scipy.linalg.inv(k)
    information = f.T @ inverted @ f
    total = 0.0
    for g in force.reshape(len(states), -1).T:
        rest = g - f @ scipy.linalg.solve(information, f.T @ inverted @ g)
        freedom = len(g) - restricted * f.shape[1]
        variance = rest @ inverted @ rest / freedom
        total += 0.5 * (freedom * math.log(2 * math.pi * variance) + np.linalg.slogdet(k)[1] + freedom)
        total += 0.5 * restricted * np.linalg.slogdet(information)[1]
    return total


KERNELS = {
    "Gaussian": (Gaussian(), lambda h: np.exp(-(h**2) / 2)),
    "Matern32": (Matern32(), lambda h: (1 + math.sqrt(3) * abs(h)) * np.exp(-math.sqrt(3) * abs(h))),
    "Spherical": (Spherical(), lambda h: 1 - 1.5 * np.minimum(1, abs(h)) + 0.5 * np.minimum(1, abs(h)) ** 3),
}
POINT = np.log([0.011, 1.7, 0.02])


@pytest.mark.parametrize("restricted", [False, True])
@pytest.mark.parametrize("kernel", KERNELS)
def test_the_likelihood_is_that_of_a_dense_calculation(kernel, restricted):
    correlation, function = KERNELS[kernel]
    exponents = PolynomialTrend(2).exponents(2)
    expected = dense(POINT, STATES, FORCE, exponents, function, restricted)
    found = Kriging.negative_log_likelihood(POINT, STATES, FORCE, correlation, "quadratic", restricted)
    assert found == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize(
    ("trend", "size"), [("constant", 1), ("linear", 3), ("pure quadratic", 5), ("quadratic", 6), ("cubic", 10)]
)
def test_the_likelihood_of_every_trend_and_of_several_outputs_is_that_of_a_dense_calculation(trend, size):
    order = ("constant", "linear", "quadratic", "cubic").index(trend.removeprefix("pure "))
    exponents = PolynomialTrend(order, cross_terms="pure" not in trend).exponents(2)
    assert len(exponents) == size
    force = np.stack([FORCE, FORCE**2], axis=1)
    expected = dense(POINT, STATES, force, exponents, KERNELS["Gaussian"][1], False)
    assert Kriging.negative_log_likelihood(POINT, STATES, force, trend=trend) == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("restricted", [False, True])
@pytest.mark.parametrize("correlation", [Gaussian(), Matern52(), Exponential()], ids=lambda c: type(c).__name__)
def test_the_gradient_of_the_likelihood_agrees_with_differences(correlation, restricted):
    def value(log_parameters):
        return Kriging.negative_log_likelihood(log_parameters, STATES, FORCE, correlation, "linear", restricted)

    gradient = jax.grad(value)(jnp.asarray(POINT))
    central = [[(value(POINT + h * s) - value(POINT - h * s)) / (2 * h) for h in (1e-4, 2e-4)] for s in np.eye(3)]
    difference = [(4 * near - far) / 3 for near, far in central]
    np.testing.assert_allclose(gradient, difference, rtol=1e-6, atol=1e-6)


def test_the_likelihood_can_be_differentiated_by_readings_and_states_and_a_power():
    def by_force(force):
        return Kriging.negative_log_likelihood(POINT, STATES, force, restricted=True)

    def by_states(states):
        return Kriging.negative_log_likelihood(POINT, states, FORCE, restricted=True)

    def by_power(power):
        return Kriging.negative_log_likelihood(POINT, STATES, FORCE, PowerExponential(power))

    rng = np.random.default_rng(3)
    for function, at, step in (
        (by_force, FORCE, 1e-5 * rng.normal(size=150)),
        (by_states, STATES, 1e-6 * UNIT * rng.normal(size=(150, 2))),
        (by_power, 1.5, 1e-5),
    ):
        slope = jnp.sum(jax.grad(function)(jnp.asarray(at)) * step)
        assert slope == pytest.approx(float(function(at + step) - function(at - step)) / 2.0, rel=1e-5)


def test_the_inverse_of_the_matrix_by_blocks_is_the_inverse(monkeypatch):
    monkeypatch.setattr(inverse, "BLOCK", 64)
    a = np.random.default_rng(4).normal(size=(150, 150))
    k = a @ a.T + 10.0 * np.eye(150)
    factor = jnp.linalg.cholesky(jnp.asarray(k))
    exact = scipy.linalg.inv(k)
    np.testing.assert_allclose(inverse.inverse_diagonal(factor), np.diag(exact), rtol=1e-11)
    np.testing.assert_allclose(inverse.inverse_columns(factor, 64), exact[64:, 64:128], atol=1e-13)


def test_the_gradient_does_not_depend_on_the_blocks_in_which_it_is_summed(monkeypatch):
    def gradient(of):
        by = jax.grad(lambda p, s, power: of(p, s, FORCE, PowerExponential(power), PolynomialTrend(1), True), (0, 1, 2))
        return jax.jit(by)(jnp.asarray(POINT), jnp.asarray(STATES), 1.5)

    at_once = gradient(kriging._likelihood)
    monkeypatch.setattr(inverse, "BLOCK", 64)
    monkeypatch.setattr(likelihood, "BLOCK", 64)
    in_blocks = gradient(kriging._likelihood.__wrapped__)
    for one, other in zip(at_once, in_blocks, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9 * np.max(np.abs(one)))


@pytest.mark.parametrize("restricted", [False, True])
def test_the_fit_ends_where_the_likelihood_is_flat(fitted, restricted):
    force_map = Kriging.fit(STATES, FORCE, restricted=True) if restricted else fitted
    end = jnp.log(jnp.array([*force_map.length_scale, force_map.nugget]))

    def value(log_parameters):
        return Kriging.negative_log_likelihood(log_parameters, STATES, FORCE, restricted=restricted)

    best, gradient = jax.value_and_grad(value)(end)
    assert best == pytest.approx(-float(force_map.log_likelihood), rel=1e-9)
    assert np.max(np.abs(gradient)) < 0.01
    assert force_map.remarks == ()


# --- limits -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "correlation",
    [Exponential(), PowerExponential(1.5), Gaussian(), Linear(), Spherical(), Spline(), Matern32(), Matern52()],
    ids=lambda c: type(c).__name__,
)
def test_without_nugget_the_map_goes_through_every_reading(correlation):
    force_map = Kriging.fit(STATES[:60], FORCE[:60], correlation, nugget=0.0, length_scale=LENGTH / 4)
    np.testing.assert_allclose(force_map.evaluate(STATES[:60]), FORCE[:60], rtol=0, atol=1e-8)
    assert np.max(force_map.evaluate_std(STATES[:60])) < 1e-4


def test_a_large_nugget_leaves_the_trend():
    force_map = Kriging.fit(STATES, FORCE, length_scale=LENGTH, nugget=1e9)
    basis = np.stack([np.prod((STATES / UNIT) ** e, axis=1) for e in PolynomialTrend(2).exponents(2)], axis=1)
    beta, *_ = np.linalg.lstsq(basis, FORCE)
    np.testing.assert_allclose(force_map.evaluate(STATES), basis @ beta, atol=1e-6)
    per_unit = np.array([np.prod(UNIT ** np.array(e)) for e in PolynomialTrend(2).exponents(2)])
    np.testing.assert_allclose(force_map.trend_coefficients * per_unit, beta, atol=1e-6)


def test_a_force_that_the_trend_explains_is_found_to_rounding_with_its_derivatives():
    k, c, k3 = 400.0, 2.0, 1e5
    force = k * STATES[:, 0] + c * STATES[:, 1] + k3 * STATES[:, 0] ** 3
    force_map = Kriging.fit(STATES, force, trend="cubic")
    np.testing.assert_allclose(force_map.gradient(np.zeros(2)), [k, c], rtol=1e-9)
    np.testing.assert_allclose(force_map.derivative(np.zeros(2), (3, 0)), 6.0 * k3, rtol=1e-8)
    assert "The trend explains the force to rounding" in force_map.remarks[0]
    coefficients = dict(zip(PolynomialTrend(3).exponents(2), force_map.trend_coefficients, strict=True))
    assert coefficients[(3, 0)] == pytest.approx(k3, rel=1e-9)


def test_the_error_falls_with_the_number_of_readings():
    queries = scattered(300, seed=5) * 0.95
    errors = []
    for n in (25, 60, 150):
        states = scattered(n, seed=6)
        force_map = Kriging.fit(states, smooth_force(states), trend="linear")
        errors.append(np.sqrt(np.mean((force_map.evaluate(queries) - smooth_force(queries)) ** 2)))
    assert errors[1] < 0.3 * errors[0]
    assert errors[2] < 0.1 * errors[1]


# --- invariance -------------------------------------------------------------------------------------------------------


def test_the_map_does_not_depend_on_units_shift_or_order():
    reference = Kriging.fit(STATES, FORCE, **GIVEN)
    units, shift = np.array([1e3, 1e-4]), np.array([5.0, -1.0])
    other = Kriging.fit((STATES + shift) * units, 1e5 * FORCE, length_scale=LENGTH * units, nugget=0.01)
    moved = (QUERIES + shift) * units
    np.testing.assert_allclose(other.evaluate(moved) / 1e5, reference.evaluate(QUERIES), rtol=0, atol=1e-9)
    np.testing.assert_allclose(other.evaluate_std(moved) / 1e5, reference.evaluate_std(QUERIES), rtol=1e-8)
    shuffled = np.random.default_rng(7).permutation(150)
    again = Kriging.fit(STATES[shuffled], FORCE[shuffled], **GIVEN)
    np.testing.assert_allclose(again.evaluate(QUERIES), reference.evaluate(QUERIES), rtol=0, atol=1e-10)


def test_what_is_estimated_changes_with_the_units_as_it_should(fitted):
    units = np.array([1e3, 1e-4])
    other = Kriging.fit(STATES * units, 1e5 * FORCE)
    np.testing.assert_allclose(other.length_scale / units, fitted.length_scale, rtol=1e-4)
    np.testing.assert_allclose(other.noise_variance / 1e10, fitted.noise_variance, rtol=1e-4)


def test_a_gaussian_map_with_equal_length_scales_turns_with_the_states():
    states = STATES / UNIT
    turn = np.array([[math.cos(0.7), -math.sin(0.7)], [math.sin(0.7), math.cos(0.7)]])
    given: dict[str, Any] = dict(length_scale=[0.6, 0.6], nugget=0.01)
    upright, turned = Kriging.fit(states, FORCE, **given), Kriging.fit(states @ turn, FORCE, **given)
    queries = QUERIES / UNIT
    np.testing.assert_allclose(turned.evaluate(queries @ turn), upright.evaluate(queries), rtol=0, atol=1e-10)


# --- derivatives ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("correlation", [Gaussian(), Matern52(), Matern32(), Spline()], ids=lambda c: type(c).__name__)
def test_derivatives_of_the_map_agree_with_autodiff_of_its_value(correlation):
    force_map = Kriging.fit(STATES, FORCE, correlation, length_scale=2 * LENGTH, nugget=0.01)
    for query in jnp.asarray(QUERIES[:3]):
        np.testing.assert_allclose(force_map.gradient(query), jax.grad(force_map)(query), rtol=1e-9)
        hessian = jax.hessian(force_map)(query)
        for orders, expected in (((2, 0), hessian[0, 0]), ((1, 1), hessian[0, 1]), ((0, 2), hessian[1, 1])):
            assert force_map.derivative(query, orders) == pytest.approx(float(expected), rel=1e-7, abs=1e-7)


def test_the_standard_error_of_a_slope_is_the_limit_of_that_of_a_difference():
    force_map = Kriging.fit(STATES, FORCE, **GIVEN)
    query, h = QUERIES[0], 1e-3 * LENGTH[0]
    pair = jnp.asarray([query + [h, 0.0], query - [h, 0.0]])
    part = force_map.parts[0]
    covariance = part.covariance(pair) * part.unbiased_variance[0]
    of_difference = np.sqrt(covariance[0, 0] + covariance[1, 1] - 2 * covariance[0, 1]) / (2 * h)
    assert force_map.std(query, orders=(1, 0)) == pytest.approx(float(of_difference), rel=1e-4)


# --- error bars -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("trend", ["constant", "quadratic"])
def test_leaving_a_reading_out_in_closed_form_is_fitting_without_it(trend):
    force_map = Kriging.fit(STATES[:40], FORCE[:40], trend=trend, **GIVEN)
    left = force_map.leave_one_out()
    for i in (0, 17):
        rest = np.arange(40) != i
        without = Kriging.fit(STATES[:40][rest], FORCE[:40][rest], trend=trend, **GIVEN)
        assert left.residual[i] == pytest.approx(float(FORCE[i] - without(STATES[i])), rel=1e-9)
        share = (without.std(STATES[i]) / np.sqrt(without.parts[0].unbiased_variance[0])) ** 2 + 0.01
        own = (left.std[i] / np.sqrt(force_map.parts[0].unbiased_variance[0])) ** 2
        assert own == pytest.approx(float(share), rel=1e-9)


def test_standardised_residuals_tell_right_error_bars_from_wrong_ones(fitted):
    left = fitted.leave_one_out()
    assert 0.85 < left.spread < 1.15
    assert 0.9 <= left.coverage(0.95) <= 1.0
    assert left.rms == pytest.approx(0.06, abs=0.02)  # noise of 0.05, and what the map adds
    rigid = Kriging.fit(STATES, FORCE, length_scale=4 * LENGTH, noise_variance=1e-4)  # noise of 0.05 called 0.01
    assert rigid.leave_one_out().spread > 1.5


def test_intervals_of_95_per_cent_hold_the_truth_as_often_on_functions_drawn_from_the_prior():
    states, queries = STATES[:80], QUERIES
    both = jnp.asarray(np.concatenate([states, queries]))
    root = np.linalg.cholesky(Gaussian().between(both, both, jnp.asarray(LENGTH)) + 1e-10 * np.eye(len(both)))
    draws = root @ np.random.default_rng(8).normal(size=(len(both), 1500))
    readings_of_all = draws[:80] + 0.1 * np.random.default_rng(9).normal(size=(80, 1500))
    force_map = Kriging.fit(states, readings_of_all, outputs="shared", **GIVEN)  # every draw an output
    inside = np.abs(force_map.evaluate(queries) - draws[80:]) < 1.96 * force_map.evaluate_std(queries)
    assert 0.94 < np.mean(inside) < 0.96


@pytest.mark.slow
def test_intervals_with_every_parameter_estimated_hold_the_truth_in_93_to_97_of_100_cases():
    both = jnp.asarray(scattered(160 + 40, seed=20))
    root = np.linalg.cholesky(Gaussian().between(both, both, jnp.asarray(LENGTH)) + 1e-10 * np.eye(200))
    inside = []
    for seed in range(60):
        rng = np.random.default_rng(100 + seed)
        truth = root @ rng.normal(size=200)
        force_map = Kriging.fit(both[:160], truth[:160] + 0.1 * rng.normal(size=160), trend="linear")
        inside.append(np.abs(force_map.evaluate(both[160:]) - truth[160:]) < 1.96 * force_map.evaluate_std(both[160:]))
    assert 0.93 < np.mean(inside) < 0.97


def test_the_noise_of_the_readings_is_learned(fitted):
    assert np.sqrt(fitted.noise_variance) == pytest.approx(0.05, rel=0.2)


def test_known_noise_is_kept_and_its_likelihood_is_that_of_the_same_nugget():
    force_map = Kriging.fit(STATES, FORCE, noise_variance=0.05**2)
    assert force_map.noise_variance == pytest.approx(0.05**2, rel=1e-9)
    again = Kriging.fit(STATES, FORCE, length_scale=force_map.length_scale, nugget=force_map.nugget)
    np.testing.assert_allclose(force_map.evaluate(QUERIES), again.evaluate(QUERIES), rtol=1e-9)
    free = Kriging.fit(STATES, FORCE)
    assert abs(force_map.log_likelihood - free.log_likelihood) < 2.0  # nats: the noise is what was put in


def test_readings_of_unlike_noise_count_by_it():
    rng = np.random.default_rng(10)
    std = np.where(rng.random(150) < 0.5, 0.01, 0.5)
    force = np.asarray(smooth_force(STATES)) + std * rng.normal(size=150)
    queries = scattered(200, seed=11) * 0.9

    def error(**given):
        return np.sqrt(np.mean((Kriging.fit(STATES, force, **given).evaluate(queries) - smooth_force(queries)) ** 2))

    assert error(noise_variance=std**2) < 0.4 * error()
    assert error(nugget=std**2) < 0.5 * error()


def test_noise_in_the_states_widens_the_error_bars_where_the_map_is_steep():
    states = scattered(300, seed=12)
    std = np.array([0.04, 0.0]) * UNIT
    force = np.asarray(smooth_force(states)) + 0.01 * np.random.default_rng(13).normal(size=300)
    seen = states + std * np.random.default_rng(14).normal(size=(300, 2))
    plain, corrected = Kriging.fit(seen, force), Kriging.fit(seen, force, state_std=std)
    (part,) = corrected.parts
    assert isinstance(part, Posterior)
    steep, flat = part.relative_noise[np.argsort(np.abs(seen[:, 0]))[jnp.array([0, -1])]]
    assert steep > 2.0 * flat
    assert corrected.log_likelihood > plain.log_likelihood + 5.0


def test_maps_drawn_from_the_posterior_scatter_as_the_standard_error_says(fitted, key):
    drawn = fitted.sample(QUERIES, 2000, key)
    assert drawn.shape == (2000, 12)
    np.testing.assert_allclose(np.std(drawn, axis=0), fitted.evaluate_std(QUERIES), rtol=0.08)
    np.testing.assert_allclose(np.mean(drawn, axis=0), fitted.evaluate(QUERIES), atol=0.01)


# --- several outputs, many states, terms ------------------------------------------------------------------------------


def test_outputs_have_hyper_parameters_of_their_own_or_share_them(fitted):
    force = np.stack([FORCE, 1e3 * STATES[:, 0] ** 2 + 0.001 * FORCE], axis=1)
    own, shared = Kriging.fit(STATES, force), Kriging.fit(STATES, force, outputs="shared")
    assert own.length_scale.shape == (2, 2)
    assert shared.length_scale.shape == (2,)
    assert own.process_variance.shape == shared.process_variance.shape == (2,)
    np.testing.assert_allclose(own(QUERIES[0])[0], fitted(QUERIES[0]), rtol=1e-9)
    assert own.log_likelihood > shared.log_likelihood - 1e-6
    for force_map in (own, shared):
        assert force_map.gradient(QUERIES[0]).shape == (2, 2)
        assert force_map.std(QUERIES[0]).shape == (2,)
        assert force_map.evaluate(QUERIES).shape == (12, 2)
        assert force_map.evaluate(np.zeros((0, 2))).shape == (0, 2)
        assert force_map.trend_coefficients.shape == (6, 2)


@pytest.mark.parametrize("points", [2000, 100])
def test_a_force_that_is_known_to_vanish_at_rest_does(fitted, points):
    rest = np.zeros(2)
    assert abs(fitted(rest)) > 1e-3
    held = Kriging.fit(STATES, FORCE, zero_at_rest=True, points=points)
    assert abs(held(rest)) < 2e-4
    assert held.std(rest) < 1e-3 < fitted.std(rest)
    np.testing.assert_allclose(held.evaluate(QUERIES), fitted.evaluate(QUERIES), atol=0.05)
    weighed = Kriging.fit(STATES, FORCE, zero_at_rest=True, nugget=np.full(150, 0.01), state_std=0.01 * UNIT)
    assert abs(weighed(rest)) < 2e-4


def test_many_states_at_once_give_what_single_calls_give(fitted):
    one_by_one = np.stack([fitted(q) for q in QUERIES])
    np.testing.assert_allclose(fitted.evaluate(QUERIES), one_by_one, rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(jax.vmap(fitted)(jnp.asarray(QUERIES)), one_by_one, rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(jax.jit(lambda q: fitted.evaluate(q))(QUERIES), one_by_one, rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(fitted.evaluate_std(QUERIES)[3], fitted.std(QUERIES[3]), rtol=1e-9)


@pytest.mark.parametrize("correlation", [Gaussian(), Exponential(), Cubic()], ids=lambda c: type(c).__name__)
def test_a_map_becomes_a_table_and_a_term(correlation):
    force_map = Kriging.fit(STATES, FORCE, correlation, length_scale=5 * LENGTH, nugget=0.1)
    table = tabulate(force_map, nodes=8)
    assert np.isfinite(table.error)
    assert isinstance(force_map.on(at=(0, 1)), MapTerm)


def test_a_structure_with_a_map_moves_as_one_with_the_force_it_was_learned_from():
    time = np.arange(0.0, 8.0, 0.02)
    states = np.random.default_rng(15).uniform(-1.5, 1.5, (120, 2)) * [1.0, 3.0]
    linear = jfsm.Structure.sdof(mass=1.0, stiffness=9.0, damping=0.3)
    term = Kriging.fit(states, 10.0 * states[:, 0] ** 3 / (1.0 + states[:, 0] ** 2)).on(at=(0, 1))
    record = jfsm.Record(time=time, force=3.0 * np.sin(2.0 * time))
    found = jfsm.simulate(linear + term, record, initial_state=(0.5, 0.0)).displacement
    exact = scipy.integrate.solve_ivp(
        lambda t, y: [y[1], 3 * np.sin(2 * t) - 0.3 * y[1] - 9 * y[0] - 10 * y[0] ** 3 / (1 + y[0] ** 2)],
        (0.0, time[-1]),
        [0.5, 0.0],
        t_eval=time,
        rtol=1e-9,
        atol=1e-9,
    )
    np.testing.assert_allclose(found[:, 0], exact.y[0], atol=2e-4)


# --- size -------------------------------------------------------------------------------------------------------------


def test_more_readings_than_points_are_merged_and_every_one_counts():
    states = scattered(20_000, seed=16)
    force = noisy(states, seed=17)
    merged = Kriging.fit(states, force, points=200)
    some = Kriging.fit(states[:200], force[:200])
    queries = scattered(500, seed=18) * 0.9

    def error(force_map):
        return np.sqrt(np.mean((force_map.evaluate(queries) - smooth_force(queries)) ** 2))

    assert error(merged) < 0.4 * error(some)
    assert len(merged.parts[0].states) == 200
    assert "20000 readings were merged to means over" in merged.remarks[0]
    assert np.sqrt(merged.noise_variance) == pytest.approx(0.05, rel=0.5)  # of one reading, not of a mean


@pytest.mark.parametrize("points", [2, 37, 60])
def test_readings_in_fewer_places_than_points_are_merged_place_by_place(points):
    places = scattered(40, seed=3)
    states = np.repeat(places, 25, axis=0)
    merged = readings.merge(readings.Checked(states, states[:, :1], np.ones(len(states))), points)
    assert len(merged.states) == min(points, 40)
    assert np.sum(1 / merged.relative_noise) == pytest.approx(1000)
    np.testing.assert_allclose(merged.force, merged.states[:, :1])


def test_a_mean_is_weighted_by_the_noise_of_its_readings():
    states = np.array([[0.0], [0.1], [1.0]])
    merged = readings.merge(readings.Checked(states, np.array([[2.0], [5.0], [1.0]]), np.array([1.0, 0.5, 1.0])), 2)
    np.testing.assert_allclose(merged.force, [[4.0], [1.0]])
    np.testing.assert_allclose(merged.states, [[0.2 / 3], [1.0]])
    np.testing.assert_allclose(merged.relative_noise, [1 / 3, 1.0])


def test_what_does_not_fit_into_memory_is_refused_before_the_work():
    states = scattered(300_000)
    with pytest.raises(
        MemoryError, match=r"An exact map of 300000 points needs \d+\.\d GiB.* Set `points` to \d+00 or"
    ):
        Kriging.fit(states, states[:, 0], points=300_000)


# --- data that make trouble -------------------------------------------------------------------------------------------


def test_near_duplicates_do_no_harm_and_the_jitter_is_told():
    states = np.concatenate([STATES[:40], STATES[:40] * (1 + 1e-12), STATES[:40]])
    force = np.asarray(smooth_force(states))
    exact = Kriging.fit(states, force, nugget=0.0, length_scale=LENGTH)
    assert 0.0 < exact.jitter <= 1e-6
    assert "jitter" in exact.remarks[0]
    np.testing.assert_allclose(exact.evaluate(states), force, atol=1e-5)
    learned = Kriging.fit(states, force)
    np.testing.assert_allclose(learned.evaluate(states), force, atol=1e-4)


def test_states_spread_by_a_millionth_are_mapped_like_others():
    z = STATES / UNIT
    near, far = (Kriging.fit(1.0 + s * z, FORCE) for s in (1e-6, 1.0))
    queries = QUERIES / UNIT
    np.testing.assert_allclose(near.evaluate(1.0 + 1e-6 * queries), far.evaluate(1.0 + queries), atol=1e-4)


@pytest.mark.parametrize("level", [0.0, 3.0])
def test_a_constant_force_gives_a_constant_map_without_error(level):
    force_map = Kriging.fit(STATES, np.full(150, level))
    np.testing.assert_allclose(force_map.evaluate(QUERIES), level, atol=1e-12)
    assert np.max(force_map.evaluate_std(QUERIES)) < 1e-12


def test_an_axis_along_which_nothing_changes_is_told():
    states = scattered(80, seed=19)
    force = np.tanh(80.0 * states[:, 0]) + 0.02 * np.random.default_rng(21).normal(size=80)
    force_map = Kriging.fit(states, force, trend="constant")
    (remark,) = [r for r in force_map.remarks if "upper bound" in r]
    assert "The length scale of column 1 (velocity) reached its upper bound" in remark
    assert "velocity) is hardly excited" in remark


def test_a_correlation_that_is_not_valid_still_gives_a_map():
    force_map = Kriging.fit(STATES, FORCE, Cubic())
    assert np.sqrt(np.mean((force_map.evaluate(QUERIES) - smooth_force(QUERIES)) ** 2)) < 0.1


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        (dict(states=STATES[:, 0]), ValueError, r"`states` must have 2 axes; got shape \(150,\)"),
        (dict(states=STATES[:, :0]), ValueError, r"`states` must have at least one column; got shape \(150, 0\)"),
        (dict(force=np.ones(149)), ValueError, r"shape \(150,\) or \(150, outputs\); got shape \(149,\)"),
        (dict(force=np.full(150, np.nan)), ValueError, "`force` must be finite; 150 of 150"),
        (
            dict(states=np.where(STATES == STATES[3, 1], np.nan, STATES)),
            ValueError,
            "`states` must be finite; 1 of 300",
        ),
        (dict(states=STATES[:1], force=[1.0]), ValueError, "more points than the trend has functions, 6 in 2 .* got 1"),
        (dict(states=STATES[:6], force=np.ones(6)), ValueError, r"got 6\. Add data or take a simpler trend"),
        (dict(states=STATES[:1], force=[1.0], trend="constant"), ValueError, "functions, 1 in 2 columns; got 1"),
        (dict(states=STATES * [1, 0] + [0, 2]), ValueError, r"Column 1 of `states` is constant \(2\).* Leave it out"),
        (
            dict(states=np.stack([np.sin(np.arange(150)), np.cos(np.arange(150))], 1)),
            ValueError,
            r"all 6 monomials of the trend of order 2; the 150 points have rank 5: .* Take a simpler trend",
        ),
        (dict(correlation="gauss"), TypeError, r"`correlation` must be a correlation such as jfsm\.Gaussian\(\); got"),
        (
            dict(trend="quartic"),
            ValueError,
            "`trend` must be one of 'constant', .* or a PolynomialTrend; got 'quartic'",
        ),
        (dict(trend=PolynomialTrend(-1)), ValueError, "`trend` must have an order of 0 or more; got -1"),
        (dict(nugget="learn"), ValueError, "`nugget` must be 'estimate', a number, or one number per reading; got 'le"),
        (dict(nugget=-0.1), ValueError, "`nugget` must be 0 or more, .*; got -0.1"),
        (dict(nugget=np.ones(149)), ValueError, r"one number or one per reading \(150\); got shape \(149,\)"),
        (dict(length_scale=[1.0]), ValueError, r"`length_scale` must hold 2 positive numbers, .* got \[1\.0\]"),
        (dict(noise_variance=0.0), ValueError, "`noise_variance` must be positive; got 0"),
        (dict(noise_variance=1.0, nugget=0.1), ValueError, "both say how large the noise is; give one of them"),
        (dict(noise_variance=np.ones(3)), ValueError, r"`noise_variance` must be one number, one per reading \(150\)"),
        (dict(state_std=[1.0]), ValueError, r"`state_std` must hold 2 numbers of 0 or more, .* got shape \(1,\)"),
        (dict(points=1), ValueError, "`points` must be an integer of 2 or more; got 1"),
    ],
)
def test_a_wrong_fit_is_refused(arguments, error, message):
    with pytest.raises(error, match=message):
        Kriging.fit(**{"states": STATES, "force": FORCE, **arguments})


def test_doubles_are_not_narrowed_silently():
    with jax.enable_x64(False), pytest.raises(ValueError, match="float64 data would be narrowed to float32; run"):
        Kriging.fit(STATES, FORCE)
    with jax.enable_x64(False), pytest.raises(ValueError, match="float64 data would be narrowed to float32; run"):
        Kriging.negative_log_likelihood(POINT, STATES, FORCE)


def test_length_scales_without_end_are_refused():
    with pytest.raises(RuntimeError, match="of the 150 points is not positive definite, .* `length_scale` is far too"):
        Kriging.fit(STATES, FORCE, Cubic(), nugget=0.0, length_scale=LENGTH)


def test_wrong_queries_are_refused(fitted):
    with pytest.raises(ValueError, match=r"`state` must be one state of shape \(2,\); got shape \(3,\)\. Use `evalu"):
        fitted(np.zeros(3))
    with pytest.raises(ValueError, match=r"`states` must have 2 columns, as in `fit`; got shape \(4, 3\)"):
        fitted.evaluate(np.zeros((4, 3)))
    with pytest.raises(ValueError, match=r"`orders` must be 2 integers from 0, one per column.* got \(1,\)"):
        fitted.derivative(np.zeros(2), (1,))
    rough = Kriging.fit(STATES, FORCE, Exponential(), **GIVEN)
    with pytest.raises(ValueError, match=r"at most 1 each: more derivatives the map with Exponential correlation does"):
        rough.derivative(np.zeros(2), (2, 0))
    with pytest.raises(ValueError, match="at most 0 each: more derivatives the random field with Exponential"):
        rough.std(np.zeros(2), (1, 0))
    with pytest.raises(ValueError, match=r"logarithms of 2 length scales and of the nugget, shape \(3,\); got shape"):
        Kriging.negative_log_likelihood(np.zeros(2), STATES, FORCE)
