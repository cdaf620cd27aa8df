"""The interval of a gain: how often it holds the share that is closed."""

import numpy as np
import pytest

from jfsm.diagnosis._gain import _interval

BEFORE, AFTER, FLOOR = 0.8, 0.2, 0.1


def blocks(rng: np.random.Generator, after: float = AFTER, count: int = 20) -> np.ndarray:
    """Mean square errors (count, 2) of blocks that hold ten independent looks each."""
    return np.array([BEFORE, after]) ** 2 * rng.chisquare(10, (count, 2)) / 10


def test_nineteen_in_twenty_intervals_hold_the_share_that_is_closed():
    truth, rng = (BEFORE - AFTER) / (BEFORE - FLOOR), np.random.default_rng(0)
    held = [low <= truth <= high for low, high in (_interval(blocks(rng), FLOOR, rng) for _ in range(400))]
    # Of twenty blocks a percentile interval is somewhat short: 93 % are expected, with a standard error of 1.3 %.
    assert 0.88 < np.mean(held) < 0.98


@pytest.mark.parametrize(("after", "rarely"), [(BEFORE, True), (0.75 * BEFORE, False)])
def test_a_gain_is_significant_where_there_is_one(after: float, rarely: bool):
    rng = np.random.default_rng(1)
    significant = np.mean([_interval(blocks(rng, after), FLOOR, rng)[0] > 0 for _ in range(200)])
    assert significant < 0.08 if rarely else significant > 0.8
