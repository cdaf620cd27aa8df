"""Correlations of kriging: the paper's formulas, their derivatives, and what makes them valid."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jfsm.surrogates import (
    Cubic,
    Exponential,
    Gaussian,
    Linear,
    Matern32,
    Matern52,
    PowerExponential,
    Spherical,
    Spline,
)

ALL = (
    Exponential(),
    PowerExponential(1.3),
    Gaussian(),
    Linear(),
    Spherical(),
    Cubic(),
    Spline(),
    Matern32(),
    Matern52(),
)
VALID = tuple(c for c in ALL if not isinstance(c, Cubic))
LAGS = np.array([0.0, 0.1, 0.2, 0.55, 1.0, 1.7])


def name(correlation):
    return type(correlation).__name__


def paper(correlation, h):
    """Eqs. 55 to 61 and Matérn's, at one lag in length scales."""
    xi = min(1.0, abs(h))
    spline = 1 - 15 * xi**2 + 30 * xi**3 if xi <= 0.2 else 1.25 * (1 - xi) ** 3
    return {
        "Exponential": math.exp(-abs(h)),
        "PowerExponential": math.exp(-(abs(h) ** 1.3)),
        "Gaussian": math.exp(-(h**2) / 2),
        "Linear": max(0.0, 1 - abs(h)),
        "Spherical": 1 - 1.5 * xi + 0.5 * xi**3,
        "Cubic": 1 - 3 * xi**2 + 2 * xi**3,
        "Spline": spline,
        "Matern32": (1 + math.sqrt(3) * abs(h)) * math.exp(-math.sqrt(3) * abs(h)),
        "Matern52": (1 + math.sqrt(5) * abs(h) + 5 / 3 * h**2) * math.exp(-math.sqrt(5) * abs(h)),
    }[name(correlation)]


@pytest.mark.parametrize("correlation", ALL, ids=name)
def test_a_correlation_is_the_formula_of_the_paper(correlation):
    for lags in (LAGS, -LAGS):
        expected = [paper(correlation, h) for h in lags]
        np.testing.assert_allclose(correlation(jnp.asarray(lags)), expected, rtol=1e-14, atol=1e-16)


@pytest.mark.parametrize("correlation", ALL, ids=name)
def test_several_columns_multiply_and_each_has_its_length_scale(correlation):
    a, b = np.array([[0.3, 20.0], [0.0, 0.0]]), np.array([[0.1, 5.0]])
    scale = np.array([0.5, 40.0])
    expected = [[math.prod(paper(correlation, h) for h in (one - b[0]) / scale)] for one in a]
    np.testing.assert_allclose(correlation.between(jnp.asarray(a), jnp.asarray(b), jnp.asarray(scale)), expected)


@pytest.mark.parametrize("correlation", ALL, ids=name)
def test_derivatives_of_a_correlation_agree_with_differences(correlation):
    lags = jnp.array([0.13, 0.47, -0.8, 1.31])  # away from every knot
    for order in range(1, max(1, int(min(4, 2 * correlation.smoothness))) + 1):
        h = 1e-5
        below, above = (correlation.derivative(lags + s * h, order - 1) for s in (-1, 1))
        found = correlation.derivative(lags, order)
        np.testing.assert_allclose(found, (above - below) / (2 * h), rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("correlation", [c for c in ALL if c.smoothness], ids=name)
def test_a_smooth_correlation_has_the_curvature_of_its_formula_at_zero_lag(correlation):
    curvature = {"Gaussian": -1, "Cubic": -6, "Spline": -30, "Matern32": -3, "Matern52": -5 / 3}[name(correlation)]
    assert correlation.derivative(jnp.zeros(()), 2) == pytest.approx(curvature, rel=1e-14)
    scale = jnp.array([2.0, 0.1])
    assert correlation.variance_of_derivative(scale, (1, 0)) == pytest.approx(-curvature / 4.0, rel=1e-14)
    if correlation.smoothness >= 2:  # 3 and 25: fourth moments of the spectrum
        fourth = {"Gaussian": 3.0, "Matern52": 25.0}[name(correlation)]
        assert correlation.derivative(jnp.zeros(()), 4) == pytest.approx(fourth, rel=1e-13)


@pytest.mark.parametrize("correlation", VALID, ids=name)
def test_the_matrix_of_any_states_is_positive_definite(correlation):
    states = jnp.asarray(np.random.default_rng(0).uniform(size=(150, 2)))
    for length in (0.1, 0.5, 3.0):
        matrix = correlation.between(states, states, jnp.full(2, length))
        assert np.linalg.eigvalsh(matrix)[0] > -1e-12


def test_the_cubic_correlation_of_the_paper_is_not_always_valid():
    states = jnp.linspace(0.0, 3.0, 60)[:, None]
    assert np.linalg.eigvalsh(Cubic().between(states, states, jnp.ones(1)))[0] < -1e-3


def test_the_power_of_a_power_exponential_can_be_differentiated_and_joins_its_neighbours():
    lags = jnp.asarray(LAGS)

    def by_power(power):
        return jnp.sum(PowerExponential(power)(lags))

    difference = (by_power(1.3 + 1e-6) - by_power(1.3 - 1e-6)) / 2e-6
    assert jax.grad(by_power)(1.3) == pytest.approx(float(difference), rel=1e-8)
    np.testing.assert_allclose(PowerExponential(1.0)(lags), Exponential()(lags), rtol=1e-14)
    np.testing.assert_allclose(PowerExponential(2.0)(lags), Gaussian()(math.sqrt(2.0) * lags), rtol=1e-14)


@pytest.mark.parametrize("power", [0.0, 2.1, -1.0])
def test_a_power_that_no_field_can_have_is_refused(power):
    with pytest.raises(RuntimeError, match="`power` must be above 0 and at most 2, eq. 56"):
        PowerExponential(power)
