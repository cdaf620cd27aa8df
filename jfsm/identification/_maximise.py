"""Levenberg-Marquardt on the posterior, several starts side by side."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from .._limit import UNLIMITED, Limit
from .._result import Result
from ._posterior import Posterior

LADDER = (1.0, 0.3, 0.1, 0.03, 0.01)
"""Shares of unmodelled force that the first rungs forgive: the top ones compare forces and have wide basins."""
_LAST_RUNG = 0.003
_RUNG_STEPS, _LAST_RUNG_STEPS, _RUNG_ENOUGH = 3, 10, 0.5
_LAST_STEPS = 8
"""Steps by exact slopes, at most, from where those along a run lead."""
_ENOUGH = 0.01
"""A step that promises less than this many nats is the last,"""
_HOPELESS = 0.02
"""or less than this share of what the start is behind the best value known."""
_PATIENCE = 4
"""Lanes that climb below a top that another has reached get so many times the steps that it took."""
_ROUNDS = 8
"""Most times that a climb gets its steps; in as many again it must promise to reach the best value known,"""
_WORTH = 8.0
"""or to gain so many nats."""
_LOST = 50.0
"""Nats for each sample from which a hypothesis is no explanation, wherever its top is: it gets its steps once. So far
behind another start one gets none."""
_WALL = 1e-3
"""Damping of a step that is to come down from the wall of a valley, not to go along it."""
_LONGEST = 1.0
"""Largest change of a logarithm in one step."""


@dataclass(frozen=True)
class Maximum:
    """Best values of every lane: minus log-posterior, theta, information, and how it ended."""

    value: Float[np.ndarray, " lanes"]
    theta: Float[np.ndarray, "lanes unknowns"]
    information: Float[np.ndarray, "lanes unknowns unknowns"]
    results: tuple[Result, ...]

    def evidence(self, lane: int) -> float:
        """Laplace approximation of the log-evidence of one lane."""
        sign, logdet = np.linalg.slogdet(self.information[lane])
        if sign <= 0:
            return -np.inf
        return float(-self.value[lane] + 0.5 * self.theta.shape[1] * np.log(2 * np.pi) - 0.5 * logdet)


def approach(
    posterior: Posterior,
    ladder: Sequence[float] = LADDER,
    theta: Float[np.ndarray, "lanes unknowns"] | None = None,
    limit: Limit = UNLIMITED,
) -> Maximum:
    """Climb with a process noise that forgives unmodelled force, less from rung to rung.

    From the true noise alone, a period wrong by some per cent scores worse than no motion at all, and a climb ends
    there. Past its `limit` it ends on the rung where it stands.
    """
    stands = rungs(posterior, ladder, theta, limit)
    found = next(stands)
    while not limit.over and (above := next(stands, None)) is not None:
        found = above
    return found


def rungs(
    posterior: Posterior,
    ladder: Sequence[float] = LADDER,
    theta: Float[np.ndarray, "lanes unknowns"] | None = None,
    limit: Limit = UNLIMITED,
) -> Iterator[Maximum]:
    """What `approach` stands on after each rung."""
    theta = posterior.initial() if theta is None else theta
    for share in ladder[:-1]:
        found = _climb(posterior, theta, share, _RUNG_STEPS, _RUNG_ENOUGH, first=True, limit=limit)
        yield found
        theta = found.theta
    yield _climb(posterior, theta, ladder[-1], _LAST_RUNG_STEPS, _RUNG_ENOUGH, first=True, limit=limit)


def finish(
    posterior: Posterior, start: Maximum, steps: int = 25, best: float = np.inf, limit: Limit = UNLIMITED
) -> Maximum:
    """Climb to the top with the true noise.

    `best` is the smallest minus log-posterior that any hypothesis reached: one that stays far above it need not be
    exact. One that is still on its way, fast enough to come near it, gets as many steps again: a long valley that bends
    takes short ones. Past its `limit` it stays where it is.
    """
    theta = start.theta
    if not limit.over:
        theta = _climb(posterior, theta, _LAST_RUNG, _RUNG_STEPS, _RUNG_ENOUGH, limit=limit).theta
    if not posterior.has_tangents:
        return _up(posterior, theta, steps, _ENOUGH, best, limit, exact=True)
    near = _up(posterior, theta, steps, _RUNG_ENOUGH, best, limit, exact=False)
    return _climb(posterior, near.theta, 0.0, _LAST_STEPS, _ENOUGH, min(best, float(np.min(near.value))), limit=limit)


def _up(
    posterior: Posterior,
    theta: Float[np.ndarray, "lanes unknowns"],
    steps: int,
    enough: float,
    best: float,
    limit: Limit,
    exact: bool,
) -> Maximum:
    """Climb with the true noise, as long as it promises something."""
    found = _climb(posterior, theta, 0.0, steps, enough, best, limit=limit, exact=exact)
    for _ in range(_ROUNDS - 1):
        before = found.value
        if limit.over or not any(one is Result.maximum_steps for one in found.results):
            break
        if np.min(before) > _LOST * posterior.samples:
            break
        best = min(best, float(np.min(before)))
        found = _climb(posterior, found.theta, 0.0, steps, enough, best, limit=limit, exact=exact)
        if np.all(before < found.value + np.maximum(found.value - best, _WORTH) / _ROUNDS):
            break
    return found


def settle(posterior: Posterior, theta: Float[np.ndarray, " unknowns"], limit: Limit = UNLIMITED) -> Maximum:
    """Climb from values (unknowns,) that are near the top, of a hypothesis with one start."""
    return _climb(posterior, theta[None], 0.0, 25, _ENOUGH, limit=limit)


def maximise(posterior: Posterior) -> Maximum:
    """The most probable values, from every start."""
    return finish(posterior, approach(posterior))


class _Place(NamedTuple):
    """Where the lanes stand: theta, minus log-posterior, its gradient and the information."""

    theta: Float[np.ndarray, "lanes unknowns"]
    value: Float[np.ndarray, " lanes"]
    gradient: Float[np.ndarray, "lanes unknowns"]
    information: Float[np.ndarray, "lanes unknowns unknowns"]

    def where(self, chosen: Bool[np.ndarray, " lanes"], other: "_Place") -> "_Place":
        """This place for the chosen lanes, the other for the rest."""
        pairs = zip(self, other, strict=True)
        return _Place(*(np.where(chosen.reshape((-1,) + (1,) * (a.ndim - 1)), a, b) for a, b in pairs))


def _climb(
    posterior: Posterior,
    theta: Float[np.ndarray, "lanes unknowns"],
    slack: float,
    steps: int,
    enough: float,
    best: float = np.inf,
    first: bool = False,
    limit: Limit = UNLIMITED,
    exact: bool | None = None,
) -> Maximum:
    """The top from `theta` by damped steps, or past its `limit` how far they came.

    In a narrow valley that bends, a long step along it ends on the wall. So a step that leads up is not taken back at
    once: a second one, from where it led and straight down, may end below where both began.
    """
    unknowns = posterior.hypothesis.unknowns
    low = np.array([[u.low for u in row] for row in unknowns])
    high = np.array([[u.high for u in row] for row in unknowns])
    log = np.array([[u.log or u.path.startswith("noise@") for u in row] for row in unknowns])
    lanes = theta.shape[0]
    exact = slack == 0.0 if exact is None else exact
    here = _Place(theta, *_finite(posterior.evaluate(theta, slack, first, exact=exact)))
    beyond, astray = here, np.zeros(lanes, bool)
    damp = np.full(lanes, 1e-3)
    open_, results = np.ones(lanes, bool), [Result.maximum_steps] * lanes
    if slack == 0.0 and np.isfinite(np.min(here.value)):
        open_ = here.value <= np.min(here.value) + _LOST * posterior.samples
        results = [Result.maximum_steps if is_open else Result.stalled for is_open in open_]
    last, reached = steps, np.inf
    for step in range(steps):
        if limit.over:
            break
        start = beyond.where(astray, here)
        damping = np.where(astray, np.maximum(damp, _WALL), damp)
        move, promise = _steps(start, damping, low, high, log)
        for lane in np.flatnonzero(open_ & ~astray):
            target = min(best, float(np.min(here.value)))
            behind = here.value[lane] - target if np.isfinite(target) and np.isfinite(here.value[lane]) else 0.0
            # A negative promise is no sign of a top, but of a step that its bounds bent: a shorter one will do.
            if 0 <= promise[lane] < enough + _HOPELESS * max(behind, 0.0) and damp[lane] < 1.0:
                open_[lane], results[lane] = False, Result.successful
                last, reached = min(last, _PATIENCE * (step + 1)), min(reached, here.value[lane])
            elif damp[lane] > 1e8:
                open_[lane], results[lane] = False, Result.stalled
        if not np.any(open_) or (step >= last and not np.any(open_ & (here.value < reached))):
            break
        trial = np.where(open_[:, None], start.theta + move, here.theta)
        there = _Place(trial, *_finite(posterior.evaluate(trial, slack, first, open_, exact=exact)))
        better = open_ & (there.value < here.value)
        failed = open_ & ~better & (astray | (damp >= _WALL) | ~np.isfinite(there.value))
        astray = open_ & ~better & ~failed
        here, beyond = there.where(better, here), there
        damp = np.where(better, np.maximum(damp / 10, 1e-9), np.where(failed, np.maximum(damp, 1e-4) * 10, damp))
    return Maximum(here.value, here.theta, here.information, tuple(results))


def _steps(place: "_Place", damp, low, high, log):
    """Damped Newton steps within bounds, and the gain that each promises."""
    theta, _, gradient, information = place
    moves, promises = np.zeros_like(theta), np.zeros(theta.shape[0])
    for lane in range(theta.shape[0]):
        g, f = gradient[lane], information[lane]
        if not np.all(np.isfinite(f)):
            continue
        held = ((theta[lane] <= low[lane]) & (g > 0)) | ((theta[lane] >= high[lane]) & (g < 0))
        free = ~held
        if not np.any(free):
            continue
        a = f[np.ix_(free, free)]
        damped = a + damp[lane] * np.diag(np.diag(a))
        step = np.zeros(theta.shape[1])
        step[free] = -np.linalg.lstsq(damped, g[free], rcond=None)[0]
        longest = np.max(np.abs(step[log[lane]]), initial=0.0)
        if longest > _LONGEST:
            step *= _LONGEST / longest
        heavier = f + damp[lane] * np.diag(np.diag(f))
        moves[lane] = step = _confined(theta[lane], step, g, heavier, low[lane], high[lane])
        promises[lane] = -(g @ step) - 0.5 * step @ f @ step
    return moves, promises


def _confined(theta, step, g, f, low, high):
    """A step that would leave the bounds: what meets one goes up to it, and the others are solved for again."""
    met = np.zeros(theta.size, bool)
    still = step == 0  # held where they are
    for _ in range(theta.size):
        beyond = ~met & ((theta + step < low) | (theta + step > high))
        if not np.any(beyond):
            break
        met |= beyond
        step = np.where(beyond, np.clip(theta + step, low, high) - theta, step)
        rest = ~met & ~still
        if np.any(rest):
            right = g[rest] + f[np.ix_(rest, met)] @ step[met]
            again = -np.linalg.lstsq(f[np.ix_(rest, rest)], right, rcond=None)[0]
            size, before = np.max(np.abs(again)), np.max(np.abs(step[rest]))
            step[rest] = again if size <= before else again * before / size
    return np.clip(theta + step, low, high) - theta


def _finite(outcome):
    """A lane whose filter ran away counts as infinitely bad."""
    value, gradient, information = outcome
    bad = ~(np.isfinite(value) & np.all(np.isfinite(gradient), 1) & np.all(np.isfinite(information), (1, 2)))
    value = np.where(bad, np.inf, value)
    return (
        value,
        np.where(bad[:, None], 0.0, gradient),
        np.where(bad[:, None, None], np.eye(gradient.shape[1]), information),
    )
