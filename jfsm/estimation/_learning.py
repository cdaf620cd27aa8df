"""The most probable numbers of a record's motion: roughness of the random forces, their swelling, drift of sensors."""

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import minimize

from ._kalman import swell_of
from ._part import STEADY, Part
from ._resonator import Kind, Numbers, cost, motion

_LEARNED = 8192
"""Samples, the first ones, that the numbers are learned from."""
_SMOOTHNESS = (0, 2)
"""Derivatives that the random forces may have."""
_CYCLES = (1.0, 4.0)
"""Cycles of the motion over which the random forces may swell or fade."""
_DRIFT = 8.0
"""Nats by which a bias that wanders must be more probable than a constant."""
_SEARCH = {"maxiter": 80, "ftol": 1e-8}
_WORSE = 1e3
"""Nats by which numbers that the filter cannot run with count as worse than the first: what is far steeper stalls."""


@dataclass(frozen=True)
class Learned:
    """Most probable numbers of one kind of model, and how improbable they make the record.

    `price` is the part of `cost` that its freedom costs.
    """

    cost: float
    price: float
    kind: Kind
    theta: np.ndarray
    swell: np.ndarray

    @property
    def numbers(self) -> Numbers:
        return Numbers.unpacked(jnp.asarray(self.theta), self.kind)

    @property
    def drifting(self) -> list[int]:
        """Those of the biases, by their order, that wander."""
        return np.flatnonzero(np.asarray(self.numbers.drift) > STEADY).tolist()


def learned(part: Part) -> Learned:
    """The most probable numbers of a record, and the kind of model that they belong to."""
    even, begin = np.ones(len(part.seen)), part.beliefs[0]
    begin = begin._replace(drift=np.full_like(begin.drift, STEADY)).packed
    best = min((_climbed(part, part.kind(p), begin, even) for p in _SMOOTHNESS), key=lambda found: found.cost)
    return _swollen(part, _drifting(part, best))


def smoothed(part: Part, found: Learned) -> tuple[np.ndarray, np.ndarray]:
    """Mean and covariance of (x, v, a) of every degree of freedom, then of the biases, then of the random forces."""
    n = len(part.seen)
    mean, covariance = motion(jnp.asarray(found.theta), part.data(n, found.swell), kind=found.kind)
    return np.asarray(mean)[:n], np.asarray(covariance)[:n]


class _Cost:
    """Minus log-posterior of the first samples. A bias whose wandering begins as none stays without."""

    def __init__(self, part: Part, kind: Kind, begin: np.ndarray, swell: np.ndarray):
        count = len(kind.biased)
        steady = np.concatenate([np.zeros(begin.size - count, bool), begin[begin.size - count :] <= STEADY])
        centre, width, low, high = (numbers.packed for numbers in part.beliefs)
        centre, low, high = (np.where(steady, STEADY, q) for q in (centre, low, high))
        self.kind, self.low, self.high = kind, low, high
        self.data = part.data(min(len(part.seen), _LEARNED), swell)
        self.belief = jnp.asarray(centre), jnp.asarray(width)

    def __call__(self, theta: np.ndarray) -> tuple[float, np.ndarray]:
        value, slope = cost(jnp.asarray(theta), self.data, *self.belief, kind=self.kind)
        return float(value), np.asarray(slope)


def _climbed(part: Part, kind: Kind, begin: np.ndarray, swell: np.ndarray, price: float = 0.0) -> Learned:
    cost_of = _Cost(part, kind, begin, swell)
    bounds = list(zip(cost_of.low, cost_of.high, strict=True))
    begin = np.clip(begin, cost_of.low, cost_of.high)
    value, slope = cost_of(begin)
    # The first step of the search is as long as the slope: in these units one, not from bound to bound.
    unit = max(float(np.max(np.abs(slope))), 1.0)

    def scaled(theta):
        tried, slope = cost_of(theta)
        if not np.isfinite(tried):  # numbers that the filter cannot run with; the search turns back
            return (value + _WORSE) / unit, np.zeros(theta.size)
        return tried / unit, slope / unit

    best = minimize(scaled, begin, jac=True, method="L-BFGS-B", bounds=bounds, options=_SEARCH)
    return Learned(float(best.fun) * unit + price, price, kind, best.x, swell)


def _drifting(part: Part, steady: Learned) -> Learned:
    """The same with biases that wander, if that is more probable by far.

    Numbers that had to explain a drift without one are no good start, so this begins anew.
    """
    kind, even, count = steady.kind, np.ones(len(part.seen)), len(steady.kind.biased)
    if not count:
        return steady
    begin = part.beliefs[0]
    free = _climbed(part, kind, begin.packed, even)
    wanders = np.array(free.numbers.drift)
    for i in range(count):
        held = free.theta.copy()
        held[held.size - count + i] = STEADY
        if _Cost(part, kind, held, even)(held)[0] < free.cost + _DRIFT:
            wanders[i] = STEADY
    wandering = int(np.sum(wanders > STEADY))
    if not wandering:
        return steady
    begin, price = begin._replace(drift=wanders).packed, wandering * _DRIFT
    tried = [_climbed(part, part.kind(p), begin, even, price) for p in _SMOOTHNESS]
    return min([steady, *tried], key=lambda found: found.cost)


def _swollen(part: Part, found: Learned) -> Learned:
    """The same with random forces that swell and fade as those found do, if that is more probable."""
    n, loads = len(part.seen), found.kind.loads
    mean, covariance = smoothed(part, found)
    spread = np.diagonal(covariance[:, -loads:, -loads:], axis1=1, axis2=2)
    power = np.mean((mean[:, -loads:] ** 2 + spread) / np.exp(2 * np.asarray(found.numbers.size)), 1)
    best = found
    for cycles in _CYCLES:
        window = cycles * 2 * np.pi / (part.omega * part.dt)
        local = gaussian_filter1d(power, window, mode="nearest")
        swell = swell_of(local)
        # What is free to swell fits better by chance: half a nat for every window.
        better = _climbed(part, found.kind, found.theta, swell, found.price + 0.5 * min(n, _LEARNED) / window)
        best = min(best, better, key=lambda each: each.cost)
    return best
