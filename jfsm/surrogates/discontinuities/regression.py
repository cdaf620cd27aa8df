"""The regression on all readings, for any set of lines and all polynomial orders at once."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from ..rkpm.basis import basis_size, chebyshev_polynomials
from .line import Line

HIGHEST_ORDER = 12
LARGEST_BASIS = 66
"""Polynomials of the smooth part, at most; order 10 in two dimensions."""
LOOKS = 20.0
"""Independent looks that a residual is worth which is misfit and not noise."""
FLOOR = 1e-7
"""Residual, as a share of the force's standard deviation, that is rounding: sums of squares are differences here."""


class Regression:
    """Polynomials and lines fitted to readings of unit variance; `s` holds their places along every direction."""

    def __init__(self, states: NDArray, force: NDArray, normals: NDArray, resolution: float):
        low, high = states.min(axis=0), states.max(axis=0)
        varied = high > low
        z = (2.0 * states - high - low)[:, varied] / (high - low)[varied]
        self.normals, along = normals, states @ normals.T
        self.middle = (along.max(axis=0) + along.min(axis=0)) / 2.0
        self.half = (along.max(axis=0) - along.min(axis=0)) / 2.0
        self.directions = np.flatnonzero(self.half > 0.0)
        self.s = ((along - self.middle) / np.where(self.half > 0.0, self.half, 1.0)).T
        self.unit = float(np.std(force))
        self.force = (force - np.mean(force)) / self.unit
        self.n, dim = z.shape
        fitting = [p for p in range(1, HIGHEST_ORDER + 1) if basis_size(dim, p) <= min(self.n // 10, LARGEST_BASIS)]
        self.sizes = np.array([basis_size(dim, p) for p in fitting or [1]])
        self.q = np.linalg.qr(chebyshev_polynomials(z, len(self.sizes)))[0]
        self.load = self.q.T @ self.force
        self.resolution = 2.0 * resolution
        self.rounding = self.n * FLOOR**2
        self.twin = np.asarray(KDTree(z).query(z, k=2)[1])[:, 1]

    def columns(self, lines: Sequence[Line]) -> NDArray:
        """Columns of several lines."""
        return np.concatenate([np.zeros((self.n, 0)), *(line.columns(self.s) for line in lines)], axis=1)

    def beside(self, others: NDArray, line: Line, width: float = 0.0) -> NDArray:
        """Columns of a line, blurred over `width`, after the columns `others`."""
        return np.concatenate([others, line.columns(self.s, width)], axis=1)

    def squares(self, columns: NDArray) -> NDArray:
        """Sum of squared residuals for every polynomial order, with `columns` beside the polynomials."""
        rest = np.cumsum(np.append(0.0, self.load**2))[self.sizes]
        smooth = self.force @ self.force - rest
        if columns.shape[1]:
            shadow = self.q.T @ columns
            gram, load = columns.T @ columns, columns.T @ self.force
            for row, m in enumerate(self.sizes):
                g, b = gram - shadow[:m].T @ shadow[:m], load - shadow[:m].T @ self.load[:m]
                smooth[row] -= b @ np.linalg.lstsq(g, b, rcond=1e-13)[0]
        return np.maximum(smooth, self.rounding)

    def scores(self, squares: NDArray, price: float, looks: float) -> NDArray:
        """Negative log-likelihood and half the price of the parameters, in nats; polynomial orders in the last axis."""
        return 0.5 * looks * np.log(squares / self.n) + 0.5 * (self.sizes + price) * math.log(looks)

    def score(self, columns: NDArray, price: float, looks: float) -> float:
        """That of the best polynomial order."""
        return float(np.min(self.scores(self.squares(columns), price, looks)))

    def best_size(self, columns: NDArray) -> int:
        """Number of polynomials that is best beside `columns`."""
        return int(self.sizes[np.argmin(self.scores(self.squares(columns), 0.0, self.n))])

    def residual(self, columns: NDArray, size: int) -> tuple[NDArray, NDArray, NDArray]:
        """Residual at one polynomial order, coefficients of `columns`, and these freed of the polynomials."""
        q = self.q[:, :size]
        freed = columns - q @ (q.T @ columns)
        freed = freed - q @ (q.T @ freed)
        rest = self.force - q @ self.load[:size]
        coefficients = np.linalg.lstsq(freed, rest, rcond=1e-13)[0]
        return rest - freed @ coefficients, coefficients, freed

    def looks(self, residual: NDArray) -> float:
        """How many independent readings the residual is worth: all if it is noise between nearest neighbours."""
        power = float(np.mean(residual**2))
        noise = 0.5 * float(np.mean((residual - residual[self.twin]) ** 2))
        misfit = max(0.0, 1.0 - 1.15 * noise / power) if power > FLOOR**2 else 0.0
        return 1.0 / (1.0 / self.n + misfit / LOOKS)


def variance(residual: NDArray, freed: NDArray, which: int) -> float:
    """Variance of one coefficient under noise of unequal size (White): largest beside a line blurred by noise."""
    inverse = np.linalg.pinv(freed.T @ freed, rcond=1e-13, hermitian=True)
    row = freed @ inverse[which]
    return float(np.sum((row * residual) ** 2)) + FLOOR**2 * float(row @ row)
