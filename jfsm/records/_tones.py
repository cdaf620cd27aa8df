"""A channel as a few tones: what rotating machines and stepped sines drive with."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jfsm.records._noise_floor import NoiseFloor

MOST = 8
"""Tones at most; a sum of more is a broad signal."""
UNLIKELY = 10.0
"""Nats beyond the logarithm of the number of lines that a peak of the spectrum must stand above noise."""
PADDING = 4
"""Lines of the spectrum per line of the record, so that a peak is found near its top."""
ROUNDS, SETTLED = 8, 1e-3
"""Steps of Gauss and Newton at most, and those [rad over the record] below which frequencies stay."""


class Tones(NamedTuple):
    """A constant and sines: `curve` (n,), and how many numbers describe it."""

    curve: NDArray[np.float64]
    parameters: int


def tones(y: NDArray[np.float64], floor: NoiseFloor) -> Tones | None:
    """The tones of a channel (n,) that stand out of its noise, by least squares; None where its spline is better.

    The strongest line of what the earlier ones leave is added until none stands out. All frequencies move together;
    lines closer than the record resolves are one. Generalised cross-validation compares with the spline.
    """
    found = _standing_out(y, floor.std)
    spline = Tones(floor.smooth, floor.effective_parameters)
    return found if _cross_validated(y, found) < _cross_validated(y, spline) else None


def _cross_validated(y: NDArray[np.float64], found: Tones) -> float:
    return float(np.sum((y - found.curve) ** 2)) / (y.size - found.parameters) ** 2


def _standing_out(y: NDArray[np.float64], std: float) -> Tones:
    n = y.size
    phase = np.linspace(-1.0, 1.0, n)  # in half records, so that a frequency is as large as the phase at the ends
    taper = np.hanning(n)
    noise = std**2 * float(taper @ taper)
    found = np.zeros(0)
    curve, _ = _fitted(y, phase, found)
    while found.size < MOST:
        power = np.abs(np.fft.rfft(taper * (y - curve), PADDING * n)) ** 2
        power[: 2 * PADDING] = 0.0  # a constant and what is slower than the record are none
        if power.max() <= (UNLIKELY + math.log(n)) * noise:
            break
        strongest = float(np.argmax(power)) * np.pi * (n - 1) / (PADDING * n)
        if np.any(np.abs(found - strongest) < np.pi):
            break
        found = np.append(found, strongest)
        for _ in range(ROUNDS):
            curve, step = _fitted(y, phase, found)
            found = found + step
            if np.max(np.abs(step)) < SETTLED:
                break
        curve, _ = _fitted(y, phase, found)
    return Tones(curve, 1 + 3 * found.size)


def _fitted(
    y: NDArray[np.float64], phase: NDArray[np.float64], omega: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Sum (n,) of a constant and sines of these frequencies [rad per unit of `phase`], and a step (tones,) of those."""
    angle = np.outer(omega, phase)
    cosine, sine = np.cos(angle), np.sin(angle)
    rows = np.concatenate([np.ones((1, y.size)), cosine, sine])
    size = _least_squares(rows, y)
    curve = size @ rows
    if not omega.size:
        return curve, np.zeros(0)
    a, b = size[1 : 1 + omega.size, None], size[1 + omega.size :, None]
    strength = np.maximum(np.hypot(a, b), np.finfo(float).tiny)
    slope = phase * (b * cosine - a * sine) / strength
    step = _least_squares(np.concatenate([rows, slope]), y - curve)[-omega.size :] / strength[:, 0]
    return curve, np.clip(step, -np.pi, np.pi)


def _least_squares(rows: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sizes (rows,) of rows (rows, n) of one size, told well apart, whose sum is nearest to `y` (n,)."""
    # Of a few rows the products are soon formed; a second step leaves no more of their rounding than orthogonal rows.
    inverse = np.linalg.pinv(rows @ rows.T, hermitian=True)
    size = inverse @ (rows @ y)
    return size + inverse @ (rows @ (y - size @ rows))
