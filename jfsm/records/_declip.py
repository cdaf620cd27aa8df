"""What a clipped channel would have shown."""

import numpy as np
import scipy.linalg
from jaxtyping import Float

_ORDER = 32
_ROUNDS = 6
_CLOSE = 1e-6
"""Readings within this share of the limit are at it."""


def declipped(samples: Float[np.ndarray, " n"], limit: float) -> Float[np.ndarray, " n"]:
    """Samples with the arcs beyond ±`limit` put back.

    The lost samples minimise the prediction error of an autoregressive model, and the model is fitted to the samples
    so completed, in turns [1]_; where that stays inside the limit, the limit stands.

    Raises
    ------
    ValueError
        If more than half of the samples are at the limit.

    References
    ----------
    .. [1] A. J. E. M. Janssen, R. N. J. Veldhuis, L. B. Vries, IEEE Trans. Acoust. Speech Signal Process. 34 (1986)
       317-330.
    """
    lost = np.abs(samples) >= limit * (1 - _CLOSE)
    if not np.any(lost):
        return samples
    if np.mean(lost) > 0.5:
        raise ValueError(
            f"`limit` must leave most of the channel's samples below it; {np.mean(lost):.0%} are at {limit:g} or more."
        )
    order = min(_ORDER, samples.size // 8)
    sign, found = np.sign(samples), samples.astype(float)
    where = np.flatnonzero(lost)
    for _ in range(_ROUNDS):
        kernel = np.concatenate([[1.0], -_autoregression(found, order)])
        # Normal equations of the prediction error by the lost samples: banded, by the kernel's own correlation.
        correlation = np.correlate(kernel, kernel, "full")[order:]
        known = np.where(lost, 0.0, found)
        residual = np.convolve(np.convolve(known, kernel), kernel[::-1])[order : order + samples.size]
        gap = np.abs(where[:, None] - where[None, :])
        matrix = np.where(gap <= order, correlation[np.minimum(gap, order)], 0.0)
        solved = scipy.linalg.solve(
            matrix + 1e-12 * correlation[0] * np.eye(where.size), -residual[where], assume_a="pos"
        )
        found[where] = np.where(solved * sign[where] > limit, solved, sign[where] * limit)
    return found


def _autoregression(samples: np.ndarray, order: int) -> np.ndarray:
    """Coefficients that predict a sample from those before it, by least squares."""
    rows = np.lib.stride_tricks.sliding_window_view(samples, order)[:-1, ::-1]
    normal = rows.T @ rows
    normal += 1e-10 * np.trace(normal) / order * np.eye(order)
    return np.linalg.solve(normal, rows.T @ samples[order:])
