"""Natural frequencies and damping ratios of what is linear in a structure, with their intervals."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float

from .._result import Estimate
from ..plant import lower, state_matrix
from ..structures import LinearDamping, LinearStiffness, Structure
from ._unknowns import Unknown, values_of

WIDEST = 0.5
"""Largest distance of a bound from a frequency, as a share of it, with which a mode is well defined."""
_STEP = 1e-3
"""Standard errors by which an unknown is moved for the derivatives of eigenvalues."""
_SIGMAS = 1.96


class Mode(NamedTuple):
    """Frequency [Hz] and damping ratio of one mode of the masses, linear springs and dashpots."""

    frequency: Estimate
    damping_ratio: Estimate


def modes_of(
    structure: Structure,
    unknowns: Sequence[Unknown],
    theta: Float[np.ndarray, " unknowns"],
    covariance: Float[np.ndarray, "unknowns unknowns"],
) -> tuple[Mode, ...]:
    """The modes of what is linear in a fitted structure that oscillate and are well defined, by frequency.

    The structure is that of `theta`; where records have numbers of their own, that of the first. Intervals follow from
    the covariance by the slopes of log frequency and damping ratio. A mode is left out that does not oscillate, or
    whose frequency is known to no better than a half.
    """
    paths = set(structure.values())

    def at(values: Float[np.ndarray, " unknowns"]) -> Complex[np.ndarray, " modes"]:
        pairs = reversed(list(zip(unknowns, values_of(unknowns, values), strict=True)))
        return oscillations(structure.with_values({u.path: value for u, value in pairs if u.path in paths}))

    found = at(theta)
    slopes = np.zeros((len(unknowns), 2, found.size))
    for k, sd in enumerate(np.sqrt(np.maximum(np.diag(covariance), 0.0))):
        if unknowns[k].path not in paths or sd == 0:
            continue
        step = np.zeros(theta.size)
        step[k] = _STEP * sd
        ends = [at(theta + sign * step) for sign in (1, -1)]
        if any(end.size != found.size for end in ends):
            return ()
        upper, under = (np.stack([np.log(np.abs(end)), ratios(end)]) for end in ends)
        slopes[k] = (upper - under) / (2 * _STEP * sd)
    errors = np.sqrt(np.maximum(np.einsum("kqm,kl,lqm->qm", slopes, covariance, slopes), 0.0))
    return tuple(
        Mode(_frequency(value, _SIGMAS * error[0]), _ratio(value, _SIGMAS * error[1]))
        for value, error in zip(found, errors.T, strict=True)
        if np.expm1(_SIGMAS * error[0]) <= WIDEST
    )


def oscillations(structure: Structure) -> Complex[np.ndarray, " modes"]:
    """Eigenvalues [1/s] of what is linear in a structure, one of each pair that oscillates, by size."""
    linear = [term for term in structure.terms if isinstance(term, LinearStiffness | LinearDamping)]
    plant = lower(Structure(structure.mass, linear))
    mass = np.asarray(plant.mass)
    if not np.linalg.matrix_rank(mass) == mass.shape[0]:
        return np.zeros(0, complex)
    stiffness, damping = (np.linalg.solve(mass, np.asarray(each)) for each in (plant.stiffness, plant.damping))
    values = np.linalg.eigvals(state_matrix(stiffness, damping))
    values = values[np.imag(values) > 1e-9 * np.abs(values)]
    return values[np.argsort(np.abs(values))].astype(complex)


def ratios(values: Complex[np.ndarray, " modes"]) -> Float[np.ndarray, " modes"]:
    """Damping ratios of eigenvalues."""
    return -np.real(values) / np.abs(values)


def _frequency(value: complex, width: float) -> Estimate:
    hertz = abs(value) / (2 * np.pi)
    return Estimate(hertz, hertz * float(np.exp(-width)), hertz * float(np.exp(width)), "Hz")


def _ratio(value: complex, width: float) -> Estimate:
    ratio = -value.real / abs(value)
    return Estimate(ratio, ratio - float(width), ratio + float(width), "1")
