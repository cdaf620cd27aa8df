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
_PLAINLY, _SLOWLY = 0.25, 0.05
"""Share of a channel's innovations that is slow, from which its zero may wander: beside the model alone, of which what
it lacks may be slow as well, and beside the likeliest law."""


def plainly_wandering(beside: Trial, problem: Problem) -> int | None:
    """The channel whose zero wanders beside the model alone, or None; one that is known to do so is none."""
    return _channel(_wandering(beside, problem, _PLAINLY))


def slowly_wandering(beside: Trial, problem: Problem) -> int | None:
    """As `plainly_wandering`, beside the likeliest law, which leaves less."""
    return _channel(_wandering(beside, problem, _SLOWLY))


def mostly_wandering(beside: Trial, problem: Problem) -> int | None:
    """As `slowly_wandering`, where the wandering zero takes half of the covariance of the channel's innovations from
    sample to sample: what another law would explain is in part slow, too."""
    found = _wandering(beside, problem, _SLOWLY)
    if found is None:
        return None
    channel, wandered = found
    before, after = (_carried_over(p, beside, channel) for p in (problem.posterior_of(beside), wandered))
    return channel if after < THRESHOLDS.half * before else None


def _channel(found: tuple[int, Posterior] | None) -> int | None:
    return None if found is None else found[0]


def _wandering(beside: Trial, problem: Problem, least: float) -> tuple[int, Posterior] | None:
    """The channel of whose innovations at least that share is slow, the most of all, and the posterior in which its
    zero may wander; None where that is not far likelier."""
    periods = [until * n.record.dt / n.period for n, until in zip(problem.records, problem.until, strict=True)]
    if problem.imposed or min(periods) < _PERIODS:
        return None
    posterior, known = problem.posterior_of(beside), problem.first.readings.wandering
    shares = np.mean([_slow(posterior, beside, index) for index in range(len(problem.records))], 0)
    shares[list(known)] = 0.0
    channel = int(np.argmax(shares))
    if shares[channel] < least:
        return None
    wandered = problem.with_wandering(channel).posterior_of(beside)
    gain = cost(posterior, beside.theta) - cost(wandered, beside.theta)
    return (channel, wandered) if gain > THRESHOLDS.searched else None


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
