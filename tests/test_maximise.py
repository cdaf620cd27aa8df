"""The climb: its steps, damped and confined to bounds without losing what the others can gain, and its valleys."""

from types import SimpleNamespace

import numpy as np
import pytest

from jfsm._limit import Limit
from jfsm._result import Result
from jfsm.identification import Unknown
from jfsm.identification._maximise import Maximum, _climb, _Place, _steps, finish

F = np.array([[4.0, 3.0, 0.5], [3.0, 5.0, -1.0], [0.5, -1.0, 2.0]])
G = np.array([-10.0, 4.0, -6.0])
WIDE = np.full((1, 3), np.inf)
LINEAR = np.zeros((1, 3), bool)


def step(theta, low, high, log=LINEAR):
    place = _Place(theta[None], np.zeros(1), G[None], F[None])
    moves, promises = _steps(place, np.array([0.0]), low, high, log)
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


class Valley:
    """Minus log-posterior with a narrow valley that bends: the sum of two exponentials is known well, little else."""

    def __init__(self, much: float = 1.0):
        self.much, self.asked, self.has_tangents, self.samples = much, 0, False, 1000
        names = ("a.k", "b.k")
        self.hypothesis = SimpleNamespace(unknowns=(tuple(Unknown(n, 0.0, 1.0, True, 0.0, 1.0) for n in names),))

    def evaluate(self, theta, slack=0.0, first=False, lanes=None, *, exact=True):
        self.asked += 1
        a, b = theta[0]
        residuals = np.array([1e3 * (np.exp(a) + np.exp(b) - 2.0), self.much * (a + 1.5)])
        slopes = np.array([[1e3 * np.exp(a), 1e3 * np.exp(b)], [self.much, 0.0]])
        return np.array([0.5 * residuals @ residuals]), (slopes.T @ residuals)[None], (slopes.T @ slopes)[None]


def test_a_narrow_valley_that_bends_is_followed_to_its_end():
    valley = Valley()
    found = _climb(valley, np.array([[0.5, np.log(2 - np.exp(0.5))]]), 0.0, 200, 1e-6)  # pyright: ignore[reportArgumentType]
    assert found.results[0] == Result.successful
    np.testing.assert_allclose(found.theta[0], [-1.5, np.log(2 - np.exp(-1.5))], atol=1e-3)


@pytest.mark.parametrize(("best", "goes_on"), [(np.inf, True), (-1e6, False)])
def test_a_climb_that_is_on_its_way_goes_on_unless_it_would_stay_far_behind(best: float, goes_on: bool):
    valley, begin = Valley(much=30.0), np.array([[0.5, np.log(2 - np.exp(0.5))]])
    found = finish(valley, Maximum(np.zeros(1), begin, np.zeros((1, 2, 2)), ()), best=best)  # pyright: ignore[reportArgumentType]
    assert (abs(found.theta[0, 0] + 1.5) < 1e-3) == goes_on
    assert (valley.asked > 40) == goes_on


@pytest.mark.parametrize("after", [1, 7])
def test_a_climb_whose_time_is_over_looks_once_more_at_most(after: int):
    limit, begin = Limit(), np.array([[0.5, np.log(2 - np.exp(0.5))]])

    class Watched(Valley):
        def evaluate(self, theta, slack=0.0, first=False, lanes=None, *, exact=True):
            if self.asked + 1 == after:
                limit.ask()
            return super().evaluate(theta, slack, first, lanes)

    valley = Watched(much=30.0)
    start = Maximum(np.zeros(1), begin, np.zeros((1, 2, 2)), ())
    found = finish(valley, start, limit=limit)  # pyright: ignore[reportArgumentType]
    assert valley.asked <= after + 1 and not found.results[0].ok


class Two(Valley):
    """Two starts of the valley, the second one far up its wall."""

    def evaluate(self, theta, slack=0.0, first=False, lanes=None, *, exact=True):
        asked = [super(Two, self).evaluate(one[None], slack, first) for one in theta]
        value, gradient, information = (np.concatenate(each) for each in zip(*asked, strict=True))
        value = np.where(lanes, value, np.inf) if lanes is not None else value
        self.second += 0 if lanes is None else int(lanes[1])
        return value, gradient, information


@pytest.mark.parametrize(("wall", "climbs"), [(0.1, True), (3.0, False)])
def test_a_start_that_is_lost_behind_another_gets_no_steps(wall: float, climbs: bool):
    two = Two(much=30.0)
    two.second, two.hypothesis = 0, SimpleNamespace(unknowns=two.hypothesis.unknowns * 2)
    begin = np.array([[-1.4, np.log(2 - np.exp(-1.4))], [wall, wall]])
    found = _climb(two, begin, 0.0, 50, 1e-6)  # pyright: ignore[reportArgumentType]
    assert found.results[0].ok and (two.second > 0) == climbs
    assert climbs or found.results[1] is Result.stalled
