"""Channels whose zero wanders, as with temperature: no motion, and no finding, but a state of the sensor."""

import numpy as np

from ...identification import Nuisances, Posterior
from ..evidence.fitted import Trial, cost, standardised
from ..evidence.setup import Problem
from ..thresholds import THRESHOLDS

_DEGREE = 5
"""Of the polynomials of time that stand for what is slow."""
_PERIODS = 2 * _DEGREE
"""Of the motion, from which these are slow beside it."""
PLAINLY, SLOWLY = 0.25, 0.05
"""Share of a channel's innovations that is slow, from which its zero may wander: with the model alone, where what it
lacks may be slow as well, and with the likeliest law."""


def wandering(fitted: Trial, problem: Problem, least: float, *, mostly: bool = False) -> Problem | None:
    """The problem in which zeros of channels wander, where they do so in a fitted trial; or None.

    At `least` that share of a channel's innovations is slow, and they are far likelier where its zero may wander. What
    another law would explain is in part slow, too: where the drift must be `mostly` what is left, the wandering zero
    has to take half of the covariance of the channel's innovations from sample to sample.
    """
    periods = [until * n.record.dt / n.period for n, until in zip(problem.records, problem.until, strict=True)]
    if problem.imposed or min(periods) < _PERIODS:
        return None
    found = None
    while (more := _one_more(fitted, found or problem, least, mostly)) is not None:
        found = more
    return found


def _one_more(fitted: Trial, problem: Problem, least: float, mostly: bool) -> Problem | None:
    """The problem in which the zero of one more channel wanders, beside those that are known to."""
    posterior, known = problem.posterior_of(fitted), problem.first.readings.wandering
    shares = np.mean([_slow(posterior, fitted, index) for index in range(len(problem.records))], 0)
    shares[list(known)] = 0.0
    channel = int(np.argmax(shares))
    if shares[channel] < least:
        return None
    other = problem.with_wandering(channel)
    wandered = other.posterior_of(fitted)
    if cost(posterior, fitted.theta) - cost(wandered, fitted.theta) <= THRESHOLDS.searched:
        return None
    if not mostly:
        return other
    before, after = (_carried_over(p, fitted, channel) for p in (posterior, wandered))
    return other if after < THRESHOLDS.half * before else None


def _carried_over(posterior: Posterior, beside: Trial, channel: int) -> float:
    """Sum of the products of a channel's innovations and those of the next samples."""
    each = [standardised(posterior, beside.theta, index)[:, channel] for index in range(len(posterior.records))]
    return float(sum(error[1:] @ error[:-1] for error in each))


def _slow(posterior: Posterior, beside: Trial, index: int) -> np.ndarray:
    """Share of the power of every channel's innovations (channels,) that a slow curve explains."""
    error = standardised(posterior, beside.theta, index)
    error = np.where(np.isfinite(error), error, 0.0)
    return 1.0 - np.sum(steady(error) ** 2, 0) / np.maximum(np.sum(error**2, 0), np.finfo(float).tiny)


def steadied(nuisances: Nuisances) -> Nuisances:
    """The same record without what is slow in the channels whose zeros wander."""
    wandering = list(nuisances.readings.wandering)
    if not wandering:
        return nuisances
    values = np.array(nuisances.readings.values)[: nuisances.samples]
    values[:, wandering] = steady(values[:, wandering]) + np.mean(values[:, wandering], 0)
    return nuisances.showing(values)


def steady(y: np.ndarray) -> np.ndarray:
    """Samples (n, ...) without their mean and what is slow in them."""
    powers = np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, len(y)), _DEGREE)
    slow = np.linalg.qr(powers)[0]
    return y - slow @ (slow.T @ y)


def zeros(nuisances: Nuisances) -> list[str]:
    """What is to be said of the channels whose zeros wander."""
    channels = [nuisances.channels[c] for c in nuisances.readings.wandering]
    return [f"The zero of {kind} {j} wanders slowly; that is taken for the sensor's." for kind, j in channels]
