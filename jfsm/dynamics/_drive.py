"""The force between its samples."""

from typing import Literal, get_args

import numpy as np
from jaxtyping import Float

Reconstruction = Literal["band-limited", "linear", "hold"]

_HALF_WIDTH = 32
"""Samples on either side that a band-limited value is made of."""
_KAISER_BETA = 14.0
"""Stop band near -140 dB, clean up to 0.43 of the sample rate: what the window leaves out drives nothing."""


def reconstruct(
    samples: Float[np.ndarray, "n dof"], factor: int, method: Reconstruction = "band-limited"
) -> Float[np.ndarray, "fine dof"]:
    """Values at `factor` equal steps per sample, ``(n - 1) * factor + 1`` in all.

    ``"band-limited"`` is the rule for a force that was filtered before it was sampled: a Kaiser-windowed sinc, odd
    reflection at both ends. ``"linear"`` and ``"hold"`` (each sample kept until the next) are for forces known to be
    made that way. On a resonance with nine samples a period the choice is worth a factor of three in the error of a
    simulation, so it is the drive's, never the solver's.
    """
    if method not in get_args(Reconstruction):
        raise ValueError(f'`reconstruction` must be "band-limited", "linear" or "hold"; got {method!r}.')
    n = samples.shape[0]
    if factor == 1:
        return samples.copy()
    if method == "hold":
        return np.repeat(samples, factor, axis=0)[: (n - 1) * factor + 1]
    fine = np.empty(((n - 1) * factor + 1, samples.shape[1]))
    fine[::factor] = samples
    if method == "linear":
        for phase in range(1, factor):
            fine[phase::factor] = samples[:-1] + (samples[1:] - samples[:-1]) * phase / factor
        return fine
    width = min(_HALF_WIDTH, n - 1)
    head = 2 * samples[0] - samples[width:0:-1]
    tail = 2 * samples[-1] - samples[-2 : -width - 2 : -1]
    padded = np.concatenate([head, samples, tail])
    offsets = np.arange(-width + 1, width + 1)
    for phase in range(1, factor):
        distance = phase / factor - offsets
        taps = (
            np.sinc(distance)
            * np.i0(_KAISER_BETA * np.sqrt(np.maximum(0.0, 1 - (distance / width) ** 2)))
            / np.i0(_KAISER_BETA)
        )
        taps /= taps.sum()  # a constant force stays what it is
        for j in range(samples.shape[1]):
            # offset o multiplies sample k + o
            fine[phase::factor, j] = np.convolve(padded[:, j], taps[::-1], mode="valid")[1:n]
    return fine
