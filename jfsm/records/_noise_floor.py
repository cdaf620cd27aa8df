"""How noisy a channel is, read from the channel itself."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import BSpline
from scipy.linalg import solveh_banded

from jfsm.records._asked_again import kept
from jfsm.records._core import core_std
from jfsm.records._flat_top import flat_top_std, spectrum_by_band
from jfsm.records._quantisation import quantisation_step
from jfsm.records._resting import resting_std

DEGREE = 5
SPACINGS = (2, 3, 4, 6, 9, 14, 24, 60, 200)  # samples between knots, tried from fine to coarse
SILENCE = 0.15  # a spline that explains less than this share of the variance has found no signal
INFLATED = 0.85  # a robust estimate below this share of the residual's means isolated jumps, not noise
SHORTEST = 16  # samples; fewer cannot tell a quintic from its noise

# Standard error of the floor: so many times that of white noise, for the choice of the spacing; and so much of what the
# estimates differ by. Two such errors hold the truth in 98 of 100 channels of oscillators, with friction in 95.
SCATTER, DISAGREEMENT = 1.5, 0.7
FARTHEST = 0.25  # share of the floor that counts of a disagreement: jumps spoil two estimates, not the third
# A spline that leaves more than this share of the variance, in a spectrum that is not white, has left signal.
MOST_LEFT, UNEVEN = 0.1, 0.5
STRETCHES, SHORT = 5, 200  # of a digitised channel, and samples that one has at least: at rest it shows no noise


@dataclass(frozen=True)
class NoiseFloor:
    """What a smooth curve leaves of a channel.

    Attributes
    ----------
    std : float
        Standard deviation of the noise, in the channel's unit.
    effective_parameters : int
        Coefficients of the chosen spline; a value of `smooth` carries about effective_parameters / n of the variance.
    smooth : (n,) float array
        The spline at the samples.
    explained : float
        Share of the channel's variance (about its mean) that is signal, 0 to 1.
    spacing : int
        Samples between knots. At the finest, 2, the signal reaches farther up than a spline does, and `smooth` leaves
        part of it.
    fills_band : bool
        Whether the signal reaches to the band limit as well and never rests, so that `std` may contain part of it.
        `std_error` then reaches down to the quietest tenth of the spectrum.
    dt : float
        Sampling interval [s].
    std_error : float
        Standard error of `std`.
    """

    std: float
    effective_parameters: int
    smooth: NDArray[np.float64]
    explained: float
    spacing: int
    fills_band: bool
    dt: float
    std_error: float

    @property
    def intensity(self) -> float:
        """Spectral density of the continuous white noise with the same power, std² dt, in unit² s."""
        return self.std**2 * self.dt

    @property
    def silent(self) -> bool:
        """Whether smoothing leaves no signal: noise about a constant, or a signal as broad as noise."""
        return self.explained < SILENCE


@kept
def noise_floor(y: ArrayLike, dt: float) -> NoiseFloor:
    """Noise of one uniformly sampled channel.

    Quintic splines with uniform knots are fitted by least squares; generalised cross-validation chooses the spacing of
    the knots. The residual gives the noise, unless the core of the residual or of the sixth difference is clearly
    narrower: the jumps that dry friction leaves in an acceleration widen the residual, at a few samples only. Where a
    signal reaches farther up than a spline does, the noise is the flat end of the spectrum, if it has one, or what is
    left where the signal rests.

    Parameters
    ----------
    y : (n,) array
        At least 16 finite samples of the channel.
    dt : float
        Sampling interval [s].

    Returns
    -------
    NoiseFloor

    Raises
    ------
    ValueError
        If `y` is not one column of at least 16 finite numbers, or `dt` is not positive.

    Notes
    -----
    Exact for white noise only. Noise that is correlated over several samples is taken for signal.
    """
    y = np.asarray(y, dtype=np.float64)
    if y.ndim != 1 or y.size < SHORTEST or not np.all(np.isfinite(y)):
        raise ValueError(
            f"`y` must be one channel of at least {SHORTEST} finite samples; it has shape {y.shape} and "
            f"{np.count_nonzero(~np.isfinite(y))} values that are not finite. Pass one channel of a longer record."
        )
    if not (np.isfinite(dt) and dt > 0):
        raise ValueError(f"`dt` must be a positive number of seconds; it is {dt}. Pass record.dt.")

    spacing, parameters, smooth = _best_spline(y)
    residual = y - smooth
    freedom = y.size - parameters
    variance = float(residual @ residual) / freedom
    std = np.sqrt(variance)
    digitised = quantisation_step(y) / np.sqrt(12.0)
    stretches = max(1, min(STRETCHES, y.size // SHORT)) if digitised > 0 else 1
    narrowest, middle, _ = sorted(
        (
            std,
            np.sqrt(y.size / freedom) * core_std(residual, stretches),
            # 924: the sum of the squared binomial coefficients of order 6
            core_std(np.diff(y, 6), stretches) / np.sqrt(924.0),
        )
    )
    if narrowest < INFLATED * std:
        std = narrowest
    apart = min(max(middle, std) - narrowest, FARTHEST * std)
    fills_band = spacing == SPACINGS[0]
    if fills_band and (alone := _noise_alone(y)) is not None:
        std, variance, apart, fills_band = alone, alone**2, 0.0, False
    total = float(np.var(y, ddof=1))
    explained = max(0.0, 1.0 - variance / total) if total > 0 else 0.0
    if fills_band or explained < SILENCE:  # what is left may be signal
        apart = max(apart, std - _quietest_std(y))
    smooth.flags.writeable = False
    return NoiseFloor(
        std=float(max(std, digitised)),
        effective_parameters=parameters,
        smooth=smooth,
        explained=explained,
        spacing=spacing,
        fills_band=fills_band,
        dt=float(dt),
        std_error=float(np.hypot(SCATTER * std / np.sqrt(2.0 * freedom), DISAGREEMENT * apart)),
    )


def _best_spline(y: NDArray[np.float64]) -> tuple[int, int, NDArray[np.float64]]:
    """Spacing, number of coefficients and values of the spline with the smallest cross-validation score.

    The score takes what is left for white; where that is much, and is not, or far more than noise between jumps, the
    finest spline leaves least of a signal.
    """
    n = y.size
    splines = []
    for spacing in SPACINGS:
        spans = max(1, (n - 1) // spacing)
        parameters = spans + DEGREE
        if 2 * parameters > n + 2 * DEGREE:
            continue
        smooth = _least_squares_spline(y, spans)
        residual = y - smooth
        score = float(residual @ residual) / (n - parameters) ** 2
        splines.append((score, spacing, parameters, smooth))
    best = min(splines)
    residual, rest = y - best[-1], resting_std(y)
    left = float(np.var(residual))
    much = left > MOST_LEFT * np.var(y) and _quietest_std(y) ** 2 < UNEVEN * left
    jumps = rest is not None and rest < UNEVEN * core_std(residual)
    return (splines[0] if much or jumps else best)[1:]


def _noise_alone(y: NDArray[np.float64]) -> float | None:
    """Standard deviation of the noise where the signal is not; None if it is everywhere."""
    flat = flat_top_std(y)
    return resting_std(y) if flat is None else flat


def _quietest_std(y: NDArray[np.float64]) -> float:
    """Standard deviation of white noise as strong as the quietest tenth of the spectrum."""
    return float(np.sqrt(np.min(spectrum_by_band(y))))


def _least_squares_spline(y: NDArray[np.float64], spans: int) -> NDArray[np.float64]:
    """Values at the samples of the quintic spline on `spans` equal intervals, by banded normal equations."""
    position = np.linspace(0.0, spans, y.size)
    knots = np.concatenate([np.zeros(DEGREE), np.arange(spans + 1.0), np.full(DEGREE, float(spans))])
    basis = BSpline.design_matrix(position, knots, DEGREE)
    normal = (basis.T @ basis).todia()
    bands = np.zeros((DEGREE + 1, spans + DEGREE))
    for offset, diagonal in zip(normal.offsets, normal.data, strict=True):
        if offset >= 0:
            bands[DEGREE - offset] = diagonal
    return basis @ solveh_banded(bands, basis.T @ y)
