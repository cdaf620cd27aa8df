"""Forces that are noise only: the test was a free decay with the force channel left on."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from jfsm.records._abstract_record import AbstractRecord
from jfsm.records._noise_floor import SHORTEST, noise_floor

SEGMENT, SEGMENTS = 64, 16  # samples of a segment at most, and segments at least
SIGNIFICANT = 5.0  # standard deviations by which phases must agree more than those of strangers


def silent_forces(record: AbstractRecord) -> tuple[int, ...]:
    """Dofs whose force channel is noise only, and counts as zero.

    Raises
    ------
    ValueError
        If time is uneven; the message names the remedy.
    """
    responses = list(record.responses.values())
    return tuple(
        dof
        for (kind, dof), force in record.channels.items()
        if kind == "force" and is_silent(force, responses, record.dt)
    )


def is_silent(force: NDArray[np.float64], responses: Iterable[NDArray[np.float64]], dt: float) -> bool:
    """Whether a driving channel is noise that no response follows.

    Parameters
    ----------
    force : (n,) float array
    responses : (n,) float arrays
        Without any, a force is taken at its word.
    dt : float
        Sampling interval [s].

    Notes
    -----
    A smooth curve finds no signal in white noise, but a shaker may well have been driven with it: then the phases of
    the responses follow those of the force, segment after segment.
    """
    responses = list(responses)
    if not responses or force.size < SHORTEST:
        return False
    return noise_floor(force, dt).silent and not any(_follows(force, response) for response in responses)


def _follows(force: NDArray[np.float64], response: NDArray[np.float64]) -> bool:
    """Whether the phase between two channels is the same in all segments.

    For a white force that has nothing to do with the response, K·|mean of K unit phasors|² is 1 on average at every
    frequency, whatever the response: amplitudes do not enter, so a decay is no obstacle.
    """
    length = max(8, min(SEGMENT, force.size // SEGMENTS))
    count = force.size // length
    window = np.hanning(length)

    def spectra(samples: NDArray[np.float64]) -> NDArray[np.complex128]:
        segments = samples[: count * length].reshape(count, length)
        return np.fft.rfft((segments - segments.mean(axis=1, keepdims=True)) * window)[:, 1:-1]

    cross = spectra(force) * spectra(response).conj()
    size = np.abs(cross)
    phasors = np.where(size > 0, cross / np.where(size > 0, size, 1.0), 0.0)
    agreement = count * np.abs(phasors.mean(axis=0)) ** 2
    # The window ties neighbouring frequencies together: half of them are independent.
    return bool(agreement.mean() > 1.0 + SIGNIFICANT * np.sqrt(2.0 / agreement.size))
