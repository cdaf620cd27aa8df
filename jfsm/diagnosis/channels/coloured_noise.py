"""Channels with autocorrelated noise: sensors and amplifiers add it, and it is neither motion nor a finding."""

import math

import numpy as np
from scipy.linalg import solve_toeplitz
from scipy.signal import lfilter

from ...identification import Nuisances, Posterior
from ...records import rolloff
from ..evidence.excess import white
from ..evidence.fitted import Trial, cost, standardised
from ..evidence.setup import Problem
from ..thresholds import THRESHOLDS

_FALLS = 3.0
"""Nats by which the upper part of a channel's spectrum has to speak for a memory of its noise."""
_LAGS = 5, 40
"""Samples over which innovations are correlated: half a period, within these."""
_CORRELATED = 0.02
"""Power that correlations have in all, beyond chance, from which innovations are not those of noise,"""
_CHANCE = 5.0
"""or so many of its standard deviations."""
_ORDER = 3
"""Samples that foretell the next innovation, where noise has a memory and is white in part;"""
_STILL = 4.0
"""and correlated power that may be left then, in that from which innovations are not those of noise."""
_MOSTLY = 0.5
"""Share of a force's noise that is left where the structure moves, at least, where the force is not a few tones."""


def coloured(beside: Trial, problem: Problem) -> Problem | None:
    """The problem with autocorrelated noise in its channels, where a trial leaves that alone; None otherwise.

    The correlation has to show in the innovations far above the motion, where what the model lacks leaves noise as it
    is; once it is modelled they have to be white over half a period, and far likelier. The noise of the force is as
    strong as its own spectrum lets it be, at most.
    """
    if problem.imposed or problem.first.colour is not None or white(beside):
        return None
    posterior = problem.posterior_of(beside)
    channels = _remembering(posterior, beside.theta)
    if not channels:
        return None
    loudest = max(_loudest(n, end) for n, end in zip(problem.records, problem.until, strict=True))
    other = problem.with_colour(posterior.colour(beside.theta, channels, loudest))
    again = other.posterior_of(beside)
    theta = again.at_the_floor(beside.theta)
    if cost(posterior, beside.theta) - cost(again, theta) < THRESHOLDS.searched:
        return None
    return other if _uncorrelated(again, _innovations(again, theta)) else None


def _innovations(posterior: Posterior, theta: np.ndarray) -> list[np.ndarray]:
    """Those of every record (until, channels), in their standard deviations."""
    return [standardised(posterior, theta, index) for index in range(len(posterior.records))]


def _remembering(posterior: Posterior, theta: np.ndarray) -> list[int]:
    """Channels whose innovations grow weaker towards high frequencies; none where a short memory leaves any channel's
    correlated."""
    errors = _innovations(posterior, theta)
    channels = _falling(errors)
    unforeseen = [np.column_stack([_unforeseen(one, _ORDER) for one in error.T]) for error in errors]
    return channels if channels and _uncorrelated(posterior, unforeseen, _STILL) else []


def _falling(errors: list[np.ndarray]) -> list[int]:
    """Channels whose innovations grow weaker towards high frequencies, by the upper part of their spectra."""
    falls = sum(np.array([rolloff(y).nats for y in error.T]) for error in errors)
    return np.flatnonzero(falls > _FALLS).tolist()


def _loudest(nuisances: Nuisances, until: int) -> float:
    """How many times the noise of the forces may be as strong as it was taken to be, by their spectra above the signal.

    Where a force is a few tones, none of its noise is left where the structure moves.
    """
    most = 1.0
    for (kind, j), samples in nuisances.record.channels.items():
        if kind != "force" or not nuisances.force_floor.size or nuisances.force_floor[j - 1] == 0:
            continue
        found, known = rolloff(samples[:until]), float(nuisances.force_covariance[j - 1, j - 1])
        if found.nats > _FALLS and known > _MOSTLY * float(nuisances.force_floor[j - 1]) ** 2:
            most = max(most, found.density(nuisances.omega * nuisances.record.dt) / known)
    return most


def _uncorrelated(posterior: Posterior, errors: list[np.ndarray], much: float = 1.0) -> bool:
    """Whether the errors of every record and channel are uncorrelated over half a period, but for so many times what
    counts as chance.

    References
    ----------
    G. M. Ljung, G. E. P. Box, Biometrika 65 (1978) 297.
    """
    for nuisances, until, error in zip(posterior.records, posterior.until, errors, strict=True):
        lags = int(np.clip(nuisances.period / nuisances.record.dt / 2, *_LAGS))
        total = np.maximum(np.sum(error**2, 0), np.finfo(float).tiny)
        power = sum((np.sum(error[k:] * error[:-k], 0) / total) ** 2 for k in range(1, lags + 1)) - lags / until
        if not np.all(power < much * max(_CORRELATED, _CHANCE * np.sqrt(2 * lags) / until)):
            return False
    return True


def _unforeseen(error: np.ndarray, order: int) -> np.ndarray:
    """What the samples before do not foretell of each, by their correlations (Yule and Walker)."""
    products = np.array([error[k:] @ error[: len(error) - k] for k in range(order + 1)])
    if products[0] == 0:
        return error
    foretold = solve_toeplitz(products[:-1], products[1:])
    return np.asarray(lfilter(np.concatenate([[1.0], -foretold]), [1.0], error))


def memories(nuisances: Nuisances) -> list[str]:
    """What is to be said of channels whose noise has a memory."""
    return [
        f"The noise of {kind} {j} remembers {-1 / math.log(memory):.2g} samples; that is taken for the sensor's."
        for (kind, j), (memory, _) in nuisances.memories.items()
    ]
