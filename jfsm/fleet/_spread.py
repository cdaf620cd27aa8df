"""One size over many parts: its mean, how much parts differ beyond the error of each, and which stand out."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.stats import chi2, norm
from scipy.stats import t as student

Values = NDArray[np.float64]

CHANCE = 0.05
"""Probability that one of all parts stands out by chance."""
LEAST = 4
"""Parts from which one can stand out: three others tell how parts differ."""
_SMALLEST = 1e-9
"""Standard error, as a share of the largest value, that an exact value is given."""


class Spread(NamedTuple):
    """A size over n parts.

    Attributes
    ----------
    mean, low, high : float
        The mean over parts with its 95 % interval, in the unit of the values.
    between, between_low, between_high : float
        Standard deviation between parts, the errors of the fits taken out, with its 95 % interval; NaN of one part.
    distance : tuple of float
        Of each part from the mean of the others, in standard deviations of what is to be expected; NaN where too few
        parts are left to tell.
    outliers : tuple of int
        Places of the parts that stand out.
    """

    mean: float
    low: float
    high: float
    between: float
    between_low: float
    between_high: float
    distance: tuple[float, ...]
    outliers: tuple[int, ...]


def spread_of(values: Values, errors: Values) -> Spread:
    """Mean and spread of one size over parts, by a random-effects model: value = mean + part + error.

    Parameters
    ----------
    values : (n,) array
        The size of each part, in one unit.
    errors : (n,) array
        Standard error of each, in the same unit.

    Returns
    -------
    Spread

    Notes
    -----
    The variance between parts is that of Paule and Mandel [1]_, whose weighted sum of squares is what is to be
    expected, n − 1; its interval is by the profile of the same sum [2]_. The interval of the mean is that of Knapp and
    Hartung [3]_, never narrower than without their factor, with Student's quantile of n − 1 degrees of freedom. A part
    stands out if its deleted residual, from a model of all others [4]_, is beyond the quantile for a chance of 5 % in
    all n parts together. The quantile is Student's of n − 2 degrees of freedom, exact where all errors are alike: with
    the normal one of the source, one fleet in four of 8 parts had an outlier by chance. Several that lie together may
    hide one another.

    References
    ----------
    .. [1] R. C. Paule, J. Mandel, J. Res. Natl. Bur. Stand. 87 (1982) 377-385.
    .. [2] W. Viechtbauer, Statistics in Medicine 26 (2007) 37-52.
    .. [3] G. Knapp, J. Hartung, Statistics in Medicine 22 (2003) 2693-2710.
    .. [4] W. Viechtbauer, M. W.-L. Cheung, Research Synthesis Methods 1 (2010) 112-125.
    """
    n = values.size
    errors = np.maximum(errors, _SMALLEST * (float(np.max(np.abs(values))) or 1.0))
    variances = errors**2
    if n == 1:
        half = norm.ppf(0.975) * errors[0]
        nan = float("nan")
        return Spread(float(values[0]), float(values[0] - half), float(values[0] + half), nan, nan, nan, (nan,), ())
    between = _between(values, variances, n - 1)
    mean, weights = _mean(values, variances, between)
    scale = max(1.0, float(weights @ (values - mean) ** 2) / (n - 1))
    half = student.ppf(0.975, n - 1) * np.sqrt(scale / weights.sum())
    low, high = (_between(values, variances, float(chi2.ppf(q, n - 1))) for q in (0.975, 0.025))
    distance = _distances(values, variances)
    limit = student.ppf(1 - CHANCE / (2 * n), n - 2) if n >= LEAST else np.inf
    far = tuple(int(i) for i in np.flatnonzero(np.abs(np.nan_to_num(distance)) > limit))
    return Spread(
        mean, float(mean - half), float(mean + half), float(np.sqrt(between)), float(np.sqrt(low)),
        float(np.sqrt(high)), tuple(distance.tolist()), far,
    )  # fmt: skip


def _mean(values: Values, variances: Values, between: float) -> tuple[float, Values]:
    """The weighted mean, and the weights, whose sum is the inverse of its variance."""
    weights = 1.0 / (variances + between)
    return float(weights @ values / weights.sum()), weights


def _between(values: Values, variances: Values, expected: float) -> float:
    """The variance between parts at which the weighted sum of squares is as expected; 0 where it is less without."""

    def excess(between: float) -> float:
        mean, weights = _mean(values, variances, between)
        return float(weights @ (values - mean) ** 2) - expected

    if excess(0.0) <= 0.0:
        return 0.0
    top = float(np.ptp(values)) ** 2 + float(variances.max())
    while excess(top) > 0.0:
        top *= 4.0
    return float(brentq(excess, 0.0, top, xtol=1e-12 * top))  # pyright: ignore[reportArgumentType]


def _distances(values: Values, variances: Values) -> Values:
    """(n,) deleted residuals: each value from the mean of the others, in standard deviations of the difference."""
    n = values.size
    if n < LEAST:
        return np.full(n, np.nan)
    found = np.empty(n)
    for i in range(n):
        others, theirs = np.delete(values, i), np.delete(variances, i)
        between = _between(others, theirs, n - 2)
        mean, weights = _mean(others, theirs, between)
        found[i] = (values[i] - mean) / np.sqrt(variances[i] + between + 1.0 / weights.sum())
    return found
