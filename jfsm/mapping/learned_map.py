"""Force state maps learned from readings, by each of the methods."""

import math
from dataclasses import dataclass

import jax
import numpy as np

from ..estimation import estimate_force_map
from ..records import Record
from ..surrogates import RKPM, Discontinuity, Kriging, PolynomialTrend

_ORDERS, _SUPPORTS = (2, 3), (160, 320, 640)
"""What is tried: sixteen readings per monomial of a cubic at least. Leave-one-out errors would prefer fewer, for
readings in a row share their errors; more than these make a map slow."""
_UNCORRELATED = 0.05
"""Correlation of what the map leaves from which readings count as independent."""


@dataclass(frozen=True)
class LearnedMap:
    """A map, its error, how it came about, by how much its standard errors are to be multiplied, and whether noise in
    the states flattens it."""

    force_map: RKPM | Kriging
    error: float
    words: dict[str, str]
    widening: float
    remarks: tuple[str, ...] = ()
    flattened: bool = True

    def std(self, states: np.ndarray, orders: tuple[int, ...] = (0, 0)) -> np.ndarray:
        """Standard errors of the map or of its derivative at many states."""
        if isinstance(self.force_map, Kriging):
            return self.widening * np.asarray(self.force_map.evaluate_std(states, orders))
        rkpm = self.force_map
        return self.widening * np.asarray(jax.vmap(lambda state: rkpm.std(state, orders))(states))


def check_method(method: str, mass: float | None, order: int | None) -> None:
    """Refuse a method that does not exist or cannot be used.

    Raises
    ------
    ValueError
        If there is no such method, it needs a mass, or the order is too low for it.
    """
    if not isinstance(method, str) or method not in ("rkpm", "kriging", "joint"):
        raise ValueError(f'`method` must be "rkpm", "kriging" or "joint"; got {method!r}.')
    if method == "joint" and mass is None:
        raise ValueError('`method="joint"` maps all of the force on a single mass: give `mass`, and no model.')
    least = 1 if method == "rkpm" else 0
    if order is not None and not (isinstance(order, int | np.integer) and order >= least):
        raise ValueError(f"`order` must be an integer of {least} or more; got {order!r}.")


def learn(
    method: str,
    record: Record,
    mass: float | None,
    states: np.ndarray,
    force: np.ndarray,
    edges: tuple[Discontinuity, ...],
    order: int | None,
) -> LearnedMap:
    """The map of a force over its states by a method; only "joint" needs the record and the mass."""
    if method == "joint":
        return _by_joint(record, mass, states, force, order)
    return _by_rkpm(states, force, edges, order) if method == "rkpm" else _by_kriging(states, force, order)


def _by_rkpm(states: np.ndarray, force: np.ndarray, edges: tuple[Discontinuity, ...], order: int | None) -> LearnedMap:
    orders, remarks = _ORDERS if order is None else (order,), ()
    supports = [count for count in _SUPPORTS if count <= len(states) // 2] or None
    try:
        force_map, scores = RKPM.select(states, force, orders, supports, across=edges)
    except ValueError:
        if not edges:
            raise
        remarks = ("The readings on one side of a discontinuity are too few for a map of their own: it is smoothed.",)
        force_map, scores = RKPM.select(states, force, orders, supports)
    best = next(score for score in scores if score.chosen)
    words = {
        "method": "RKPM",
        "order": str(best.order),
        "support": f"{best.neighbours} of {len(force_map.nodes)} readings around each state",
    }
    return LearnedMap(force_map, best.error, words, _widening(force_map, states, force), remarks)


def _by_kriging(states: np.ndarray, force: np.ndarray, order: int | None) -> LearnedMap:
    trend = PolynomialTrend(2 if order is None else order)
    force_map = Kriging.fit(states, force, trend=trend)
    error = float(force_map.leave_one_out().rms)
    words = _kriging_words("Kriging", force_map, trend)
    return LearnedMap(force_map, error, words, _widening(force_map, states, force), force_map.remarks)


def _by_joint(
    record: Record, mass: float | None, states: np.ndarray, force: np.ndarray, order: int | None
) -> LearnedMap:
    trend = PolynomialTrend(2 if order is None else order)
    force_map = estimate_force_map(record, mass, trend=trend)
    error = float(np.sqrt(np.mean((force - np.asarray(force_map.evaluate(states))) ** 2)))
    words = _kriging_words("Kriging together with the motion", force_map, trend)
    return LearnedMap(force_map, error, words, 1.0, force_map.remarks, flattened=False)


def _kriging_words(method: str, force_map: Kriging, trend: PolynomialTrend) -> dict[str, str]:
    lengths = ", ".join(f"{length:.3g}" for length in np.asarray(force_map.length_scale))
    return {
        "method": method,
        "order": f"{trend.order} (trend)",
        "support": f"Gaussian correlation, length scales {lengths}",
    }


def _widening(force_map: RKPM | Kriging, states: np.ndarray, force: np.ndarray) -> float:
    """Root of how many readings in a row count as one, by the correlation of what the map leaves."""
    residual = force - np.asarray(force_map.evaluate(states))
    residual = residual - residual.mean()
    n = residual.size
    power = np.abs(np.fft.rfft(residual, 2 * n)) ** 2
    correlation = np.fft.irfft(power)[: n // 4]
    if correlation[0] == 0.0:
        return 1.0
    correlation = correlation / correlation[0]
    last = int(np.argmax(correlation < _UNCORRELATED)) or correlation.size
    return math.sqrt(1.0 + 2.0 * float(np.sum(correlation[1:last])))
