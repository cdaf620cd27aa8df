"""Steps of the climb: damped, and confined to bounds without losing what the others can gain."""

import numpy as np
import pytest

from jfsm.identification._maximise import _steps

F = np.array([[4.0, 3.0, 0.5], [3.0, 5.0, -1.0], [0.5, -1.0, 2.0]])
G = np.array([-10.0, 4.0, -6.0])
WIDE = np.full((1, 3), np.inf)
LINEAR = np.zeros((1, 3), bool)


def step(theta, low, high, log=LINEAR):
    moves, promises = _steps(theta[None], G[None], F[None], np.array([0.0]), low, high, log)
    return moves[0], promises[0]


def test_a_free_step_is_newtons_and_keeps_its_promise():
    found, promise = step(np.zeros(3), -WIDE, WIDE)
    np.testing.assert_allclose(found, -np.linalg.solve(F, G), rtol=1e-12)
    assert promise == pytest.approx(0.5 * G @ np.linalg.solve(F, G))


def test_what_a_bound_stops_leaves_the_others_at_their_best():
    high = np.array([[1.0, np.inf, np.inf]])
    found, promise = step(np.zeros(3), -WIDE, high)
    assert found[0] == 1.0
    rest = -np.linalg.solve(F[1:, 1:], G[1:] + F[1:, 0] * 1.0)
    np.testing.assert_allclose(found[1:], rest, rtol=1e-12)
    assert promise > 0  # cutting the free step down to the bound would promise a loss
    free = -np.linalg.solve(F, G)
    cut = np.clip(free, -np.inf, high[0])
    assert promise > -(G @ cut) - 0.5 * cut @ F @ cut


def test_at_a_bound_that_the_gradient_presses_on_only_the_others_move():
    found, promise = step(np.zeros(3), -WIDE, np.array([[0.0, np.inf, np.inf]]))
    assert found[0] == 0.0
    np.testing.assert_allclose(found[1:], -np.linalg.solve(F[1:, 1:], G[1:]), rtol=1e-12)
    assert promise > 0


def test_no_logarithm_changes_by_more_than_one_in_a_step():
    found, _ = step(np.zeros(3), -WIDE, WIDE, np.array([[True, False, False]]))
    assert abs(found[0]) == pytest.approx(1.0)
