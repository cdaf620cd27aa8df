"""Least values within bounds: where a search ends, what it refuses, and how seldom it is compiled."""

from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

from jfsm.surrogates import _minimise
from jfsm.surrogates._minimise import minimise_within

LOWER, UPPER = np.array([-2.0, -2.0]), np.array([2.0, 3.0])
KNOBS: dict[str, Any] = dict(unit=1.0, flat=1e-6, steps=100)


def valley(p):
    """Rosenbrock's, least at (1, 1)."""
    x, y = p
    return 100.0 * (y - x**2) ** 2 + (1.0 - x) ** 2, np.array(
        [-400.0 * x * (y - x**2) - 2.0 * (1.0 - x), 200.0 * (y - x**2)]
    )


def test_a_curved_valley_is_followed_to_its_end():
    end = minimise_within(valley, np.array([-1.2, 1.0]), LOWER, UPPER, **KNOBS)
    np.testing.assert_allclose(end.parameters, [1.0, 1.0], atol=1e-5)
    assert end.value < 1e-10


def test_a_least_value_on_a_bound_is_found_and_no_bound_is_passed():
    met = []

    def slope(p):
        met.append(p)
        return 3.0 * p[0] + (p[1] - 0.5) ** 2, np.array([3.0, 2.0 * (p[1] - 0.5)])

    end = minimise_within(slope, np.array([1.0, -1.0]), LOWER, UPPER, **KNOBS)
    np.testing.assert_allclose(end.parameters, [-2.0, 0.5], atol=1e-5)
    assert np.all(np.array(met) >= LOWER) and np.all(np.array(met) <= UPPER)


def test_a_start_on_the_wrong_bound_is_left():
    end = minimise_within(lambda p: (p[0], np.array([1.0, 0.0])), UPPER, LOWER, UPPER, **KNOBS)
    assert end.parameters[0] == pytest.approx(-2.0, abs=1e-5)


@pytest.mark.parametrize("refused", [np.nan, np.inf])
def test_points_without_a_value_are_stepped_back_from(refused):
    def walled(p):
        value, gradient = valley(p)
        return (refused, gradient) if p[0] > 0.9 else (value, gradient)

    end = minimise_within(walled, np.array([-1.2, 1.0]), LOWER, UPPER, **KNOBS)
    assert end.parameters[0] <= 0.9
    assert end.value < 0.1


def test_a_start_without_a_value_is_told_by_an_infinite_one():
    start = np.array([0.3, 0.4])
    end = minimise_within(lambda p: (np.nan, np.zeros(2)), start, LOWER, UPPER, **KNOBS)
    assert end.value == np.inf
    np.testing.assert_array_equal(end.parameters, start)


def test_a_search_that_comes_near_an_earlier_end_is_over():
    counts = []
    for known in ([], [np.array([1.0, 1.0])]):
        evaluations = []

        def counted(p, evaluations=evaluations):
            evaluations.append(p)
            return valley(p)

        end = minimise_within(counted, np.array([-1.2, 1.0]), LOWER, UPPER, known=known, **KNOBS)
        assert np.max(np.abs(end.parameters - 1.0)) < _minimise.NEAR
        counts.append(len(evaluations))
    assert counts[1] < counts[0]


def test_at_a_kink_the_search_begins_again():
    def ridge(p):
        """Least at zero, with an edge along one axis."""
        return abs(p[0]) + 0.1 * p[1] ** 2, np.array([np.sign(p[0]), 0.2 * p[1]])

    end = minimise_within(ridge, np.array([1.0, 1.5]), LOWER, UPPER, **{**KNOBS, "flat": 1e-3})
    assert end.value < 0.02


def test_the_solver_is_compiled_once_for_all_functions_of_as_many_parameters():
    minimise_within(valley, np.array([-1.2, 1.0]), LOWER, UPPER, **KNOBS)
    step, begin = _minimise._step, _minimise._begin
    before = step._cached._cache_size(), begin._cached._cache_size()  # pyright: ignore
    minimise_within(lambda p: (jnp.sum(p**2), 2.0 * p), np.array([0.5, 1.0]), LOWER - 1.0, UPPER, **KNOBS)
    assert (step._cached._cache_size(), begin._cached._cache_size()) == before  # pyright: ignore
