"""The force between its samples."""

from typing import Any, Literal, get_args

import jax.numpy as jnp
import numpy as np

from .._types import is_traced

Reconstruction = Literal["band-limited", "linear", "hold"]

_HALF_WIDTH = 32
"""Samples on either side that a band-limited value depends on."""
_KAISER_BETA = 14.0
"""Stop band near -140 dB, flat up to 0.43 of the sample rate; a force above that is taken to move nothing."""


def check_reconstruction(method: Any) -> None:
    """Refuse what is no way for a force to go between its samples.

    Raises
    ------
    ValueError
        With the ways that there are.
    """
    if not isinstance(method, str) or method not in get_args(Reconstruction):
        raise ValueError(f'`reconstruction` must be "band-limited", "linear" or "hold"; got {method!r}.')


def reconstruct(samples: Any, factor: int, method: Reconstruction = "band-limited") -> Any:
    """Values at `factor` equal steps per sample, ``(n - 1) * factor + 1`` in all, from samples (n, dof).

    Traced samples give traced values.

    ``"band-limited"`` is the rule for a force that was filtered before it was sampled: a Kaiser-windowed sinc, odd
    reflection at both ends. ``"linear"`` and ``"hold"`` (each sample kept until the next) are for forces known to be
    made that way. On a resonance with nine samples a period the choice is worth a factor of three in the error of a
    simulation, so it is the drive's, never the solver's.
    """
    check_reconstruction(method)
    n, xp = samples.shape[0], jnp if is_traced(samples) else np
    if factor == 1:
        return xp.array(samples)
    if method == "hold":
        return xp.repeat(samples, factor, axis=0)[: (n - 1) * factor + 1]
    if method == "linear":
        shares = np.arange(factor)[None, :, None] / factor
        inner = samples[:-1, None] + (samples[1:] - samples[:-1])[:, None] * shares
    else:
        width = min(_HALF_WIDTH, n - 1)
        head = 2 * samples[:1] - samples[width:0:-1]
        tail = 2 * samples[-1:] - samples[-2 : -width - 2 : -1]
        padded = xp.concatenate([head, samples, tail])
        phases = [_between(padded, phase / factor, width, n) for phase in range(1, factor)]
        inner = xp.stack([samples[:-1], *phases], 1)
    return xp.concatenate([inner.reshape((n - 1) * factor, -1), samples[-1:]])


def _between(padded: Any, share: float, width: int, n: int) -> Any:
    """Band-limited values (n - 1, dof) a share of a step after each sample but the last."""
    distance = share - np.arange(-width + 1, width + 1)  # offset o multiplies sample k + o
    taps = (
        np.sinc(distance)
        * np.i0(_KAISER_BETA * np.sqrt(np.maximum(0.0, 1 - (distance / width) ** 2)))
        / np.i0(_KAISER_BETA)
    )
    taps /= taps.sum()  # a constant force is reproduced
    xp = jnp if is_traced(padded) else np
    columns = [xp.convolve(padded[:, j], taps[::-1], mode="valid")[1:n] for j in range(padded.shape[1])]
    return xp.stack(columns, 1)
