"""Fits of hidden laws, on records that share no code with the library, from starts that know nothing."""

import pytest

from benchmarks.fitting import NOT_FITTED, converged, covered, examine

from . import CAUSES

DRIVES = ("multisine", "noise", "sweep")
FITTED = [cause for cause in CAUSES if cause not in NOT_FITTED]


@pytest.mark.parametrize("cause", ["end_stop", "jenkins"])
def test_a_law_is_found_from_a_natural_shape_drawn_at_random(cause):
    row = examine(cause, 3, 0.01, DRIVES)
    assert converged(row)
    for value in row["values"].values():  # twice the interval: four standard errors
        low, high = value["interval"]
        assert 1.5 * low - 0.5 * high <= value["truth"] <= 1.5 * high - 0.5 * low


@pytest.mark.slow
def test_six_records_of_every_law_are_fitted_to_the_top_with_honest_intervals():
    rows = [examine(cause, seed, 0.01, DRIVES) for cause in FITTED for seed in range(20, 26)]
    arrived = [row for row in rows if converged(row)]
    assert len(arrived) >= 0.95 * len(rows)
    inside = [c for row in arrived for c in covered(row)]
    assert 0.9 <= sum(inside) / len(inside) <= 0.98
