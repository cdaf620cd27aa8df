"""One reading after the other, against the conditional law of all of them together."""

import jax
import jax.numpy as jnp
import numpy as np

from jfsm.estimation._measurement_update import measurement_update

STATE, CHANNELS = 5, 3


def problem():
    """Moments of a state, rows of its readings, the readings and the variances of their noise."""
    rng = np.random.default_rng(0)
    root = rng.standard_normal((STATE, STATE))
    rows, noise = rng.standard_normal((CHANNELS, STATE)), np.array([0.1, 2.0, 1e-6])
    return tuple(map(jnp.asarray, (rng.standard_normal(STATE), root @ root.T, rows, rng.standard_normal(3), noise)))


def in_turn(use):
    """Moments after the readings that are used, and the errors and variances of all of them."""
    mean, covariance, rows, readings, noise = problem()
    told = []
    for c in range(CHANNELS):
        error = readings[c] - rows[c] @ mean
        mean, covariance, variance, _ = measurement_update(mean, covariance, rows[c], error, noise[c], use[c])
        told.append((error, variance))
    return mean, covariance, np.array(told).T


def together(use):
    """Conditional moments given the readings that are used, and the logarithm of the density of these."""
    mean, covariance, rows, readings, noise = (np.asarray(q) for q in problem())
    rows, readings, noise = rows[use], readings[use], noise[use]
    spread, error = rows @ covariance @ rows.T + np.diag(noise), readings - rows @ mean
    gain = covariance @ rows.T @ np.linalg.inv(spread)
    density = -0.5 * (error @ np.linalg.solve(spread, error) + np.linalg.slogdet(2 * np.pi * spread)[1])
    return mean + gain @ error, covariance - gain @ rows @ covariance, density


def test_readings_in_turn_give_the_moments_and_the_likelihood_of_all_together():
    for use in (np.ones(3, bool), np.array([True, False, True])):
        mean, covariance, (error, variance) = in_turn(use.astype(float))
        known = together(use)
        # The third reading is 1e3 times as sure as the state was: what is left of its covariance has lost six digits.
        np.testing.assert_allclose(mean, known[0], rtol=1e-9)
        np.testing.assert_allclose(covariance, known[1], rtol=0, atol=1e-9)
        density = -0.5 * (error**2 / variance + np.log(2 * np.pi * variance))
        np.testing.assert_allclose(np.sum(density[use]), known[2], rtol=1e-9)


def test_a_reading_that_is_not_used_changes_nothing_and_still_has_its_variance():
    mean, covariance, rows, readings, noise = problem()
    found = measurement_update(mean, covariance, rows[0], readings[0], noise[0], jnp.asarray(0.0))
    assert jnp.array_equal(found.mean, mean) and jnp.array_equal(found.covariance, covariance)
    np.testing.assert_allclose(found.variance, rows[0] @ covariance @ rows[0] + noise[0], rtol=1e-14)
    assert not np.any(found.gain)


def test_several_means_with_one_covariance_are_updated_together_under_jit_as_one_by_one():
    mean, covariance, rows, _, noise = problem()
    means, errors = jnp.stack([mean, 2 * mean, 0 * mean]), jnp.array([1.0, -3.0, 0.5])

    def update(mean, error):
        return measurement_update(mean, covariance, rows[1], error, noise[1], jnp.asarray(1.0))

    found = jax.jit(jax.vmap(update))(means, errors)
    for i in range(3):
        alone = update(means[i], errors[i])
        for mine, theirs in zip(alone, found, strict=True):
            np.testing.assert_allclose(theirs[i], mine, rtol=1e-14, atol=1e-14)
