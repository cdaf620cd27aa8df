"""Kriging of several outputs that tell of each other."""

import numpy as np
import pytest
from scipy.linalg import cho_factor, cho_solve

from jfsm.surrogates import Kriging, load_map
from jfsm.surrogates.kriging.coregionalisation import _unmixed

UNIT = np.array([0.02, 3.0])
"""Metres and metres per second, say."""
NOISE = np.array([[0.09, -0.08], [-0.08, 0.09]])
"""Of the two outputs, opposite to each other [N²]."""


def mixtures(n: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """States, and two sums of two random fields of different length scales."""
    rng = np.random.default_rng(seed)
    place = rng.uniform(-1.0, 1.0, (n, 2))
    squared = np.sum((place[:, None] - place[None]) ** 2, axis=2)
    roots = [np.linalg.cholesky(np.exp(-0.5 * squared / length**2) + 1e-9 * np.eye(n)) for length in (0.4, 0.9)]
    fields = np.stack([root @ rng.standard_normal(n) for root in roots], axis=1)
    return place * UNIT, fields @ np.array([[1.0, -0.8], [0.5, 1.2]])


PLACES, TRUTH = mixtures(700, 0)
STATES, QUERIES = PLACES[:200], PLACES[200:]
FORCE = TRUTH[:200] + np.random.default_rng(3).multivariate_normal([0.0, 0.0], NOISE, 200)


@pytest.fixture(scope="module")
def maps() -> dict[str, Kriging]:
    return {how: Kriging.fit(STATES, FORCE, trend="linear", outputs=how) for how in ("separate", "coregionalised")}


def test_outputs_that_go_together_are_told_from_separate_ones(maps):
    separate, mixed = maps["separate"], maps["coregionalised"]
    assert mixed.log_likelihood > separate.log_likelihood + 100.0
    of_noise = [float(part.nugget * part.process_variance[0]) for part in mixed.parts]
    noise = np.asarray(mixed.mixing) @ np.diag(of_noise) @ np.asarray(mixed.mixing).T
    np.testing.assert_allclose(noise, NOISE, rtol=0.25)
    np.testing.assert_allclose(np.diag(noise), mixed.noise_variance)


def test_their_errors_are_as_large_as_their_standard_errors_say(maps):
    mixed = maps["coregionalised"]
    error = np.abs(mixed.evaluate(QUERIES) - TRUTH[200:])
    assert 0.9 < np.mean(error < 1.96 * mixed.evaluate_std(QUERIES)) < 0.99
    left = mixed.leave_one_out()
    assert np.all((left.spread > 0.85) & (left.spread < 1.15))


def test_their_likelihood_is_that_of_one_normal_distribution_of_all_readings(maps):
    mixed, n = maps["coregionalised"], len(STATES)
    covariance, mixing = np.zeros((2 * n, 2 * n)), np.asarray(mixed.mixing)
    for k, part in enumerate(mixed.parts):
        lag = (STATES[:, None] - STATES[None]) / np.asarray(part.length_scale)
        own = np.exp(-0.5 * np.sum(lag**2, axis=2)) + float(part.nugget) * np.eye(n)
        covariance += np.kron(np.outer(mixing[:, k], mixing[:, k]), float(part.process_variance[0]) * own)
    x, v = (STATES / UNIT).T
    trend = np.kron(np.eye(2), np.stack([np.ones(n), x, v], axis=1))
    factor, force = cho_factor(covariance, lower=True), FORCE.T.ravel()
    beta = np.linalg.solve(trend.T @ cho_solve(factor, trend), trend.T @ cho_solve(factor, force))
    rest = force - trend @ beta
    determinant = 2.0 * np.sum(np.log(np.diag(factor[0])))
    joint = -0.5 * (rest @ cho_solve(factor, rest) + determinant + 2 * n * np.log(2.0 * np.pi))
    assert mixed.log_likelihood == pytest.approx(joint, abs=1e-4)


def test_derivatives_errors_and_draws_go_together(maps, key):
    mixed, step = maps["coregionalised"], 1e-5 * UNIT[0]
    ahead, back = (mixed.evaluate(QUERIES + side * np.array([step, 0.0])) for side in (1, -1))
    by_x = mixed.evaluate_derivatives(QUERIES, [(1, 0)])[:, 0]
    np.testing.assert_allclose(by_x, (ahead - back) / (2 * step), rtol=1e-5, atol=1e-3)
    drawn = mixed.sample(QUERIES[:20], 2000, key)
    np.testing.assert_allclose(np.std(drawn, axis=0), mixed.evaluate_std(QUERIES[:20]), rtol=0.1)
    assert mixed.trend_coefficients.shape == (3, 2)
    assert mixed.length_scale.shape == (2, 2)


def test_a_file_keeps_what_outputs_are_made_of(maps, tmp_path):
    maps["coregionalised"].save(tmp_path / "map.npz")
    loaded = load_map(tmp_path / "map.npz")
    np.testing.assert_array_equal(loaded.evaluate(QUERIES), maps["coregionalised"].evaluate(QUERIES))


def test_the_rows_that_unmix_are_where_the_likelihood_of_all_fields_is_flat():
    rng = np.random.default_rng(5)
    roots = rng.normal(size=(3, 3, 6))
    misfits = roots @ np.swapaxes(roots, 1, 2)

    def value(rows):
        return 0.5 * sum(np.log(a @ s @ a) for a, s in zip(rows, misfits, strict=True)) - np.linalg.slogdet(rows)[1]

    rows = _unmixed(np.eye(3), misfits)
    for i, j in np.ndindex(3, 3):
        moved = np.zeros((3, 3))
        moved[i, j] = 1e-4
        assert value(rows + moved) > value(rows) - 1e-12
        assert value(rows - moved) > value(rows) - 1e-12


def test_many_readings_are_merged_before_they_are_mixed(maps):
    mixed = Kriging.fit(STATES, FORCE, trend="linear", outputs="coregionalised", points=150)
    assert "merged" in mixed.remarks[0]
    both = (np.asarray(one.evaluate(QUERIES)) for one in (mixed, maps["coregionalised"]))
    assert np.sqrt(np.mean(np.subtract(*both) ** 2)) < 0.1


def test_outputs_that_cannot_be_told_apart_are_refused():
    twice = np.stack([FORCE[:, 0], 2.0 * FORCE[:, 0]], axis=1)
    with pytest.raises(ValueError, match="sum of the others"):
        Kriging.fit(STATES, twice, outputs="coregionalised", length_scale=0.5 * UNIT, nugget=0.01)
    with pytest.raises(ValueError, match="separate.*shared.*coregionalised"):
        Kriging.fit(STATES, FORCE, outputs="together")  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match="noise_variance.*coregionalised"):
        Kriging.fit(STATES, FORCE, outputs="coregionalised", noise_variance=0.09)


def test_a_single_output_is_kriged_as_it_is():
    single = [Kriging.fit(STATES, FORCE[:, 0], outputs=how) for how in ("separate", "coregionalised")]
    np.testing.assert_allclose(single[0].evaluate(QUERIES), single[1].evaluate(QUERIES))
