"""Order and support chosen by the data: leave-one-out errors of every combination, compared in pairs."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from ..._types import evenly_taken
from .basis import basis_size
from .leave_one_out import leave_one_out_errors
from .nodes import Nodes, prepare_nodes
from .rule import weighing_rule

PER_MONOMIAL = (2, 4, 8, 16, 32)
"""Neighbours per monomial that are tried."""
MOST_JUDGED = 1500
"""Nodes at which a combination is judged."""
NOISY = 0.005
"""Error, as a share of the force's standard deviation, from which readings count as noisy."""
NOISY_PER_MONOMIAL = 16
"""Least neighbours per monomial then: with noise in the states too, leave-one-out prefers too small a support."""


class Score(NamedTuple):
    """One combination and how far it misses readings that it has not seen."""

    order: int
    neighbours: int
    error: float
    """Root mean square of the leave-one-out errors, in the unit of the force (of all outputs together)."""
    chosen: bool


def choose(
    states: Any,
    force: Any,
    orders: Sequence[int],
    neighbours: Sequence[int] | None,
    **options: Any,
) -> tuple[Score, ...]:
    """Every combination tried, one of them chosen; `RKPM.select` says how."""
    tried, squares, nodes = [], [], None
    for order in orders:
        try:
            nodes = prepare_nodes(states, force, order)
            counts = _counts(nodes, order, neighbours)
            rule = weighing_rule(nodes, order, max(counts), **options)
        except ValueError:
            if not tried:
                raise
            break  # the states carry no polynomials of this order
        judged = evenly_taken(len(nodes), MOST_JUDGED)
        errors = leave_one_out_errors(nodes, rule, counts, judged)
        tried += [(order, count) for count in counts]
        squares += list(np.sum(errors**2, axis=2))
    if nodes is None:
        raise ValueError("`orders` must hold at least one order.")
    spread = float(np.sqrt(np.sum(np.var(np.asarray(nodes.force), axis=0))))
    best = _preferred(tried, np.array(squares), spread, nodes.dim)
    return tuple(
        Score(order, count, float(np.sqrt(np.mean(one))), k == best)
        for k, ((order, count), one) in enumerate(zip(tried, squares, strict=True))
    )


def _counts(nodes: Nodes, order: int, neighbours: Sequence[int] | None) -> list[int]:
    least = basis_size(nodes.dim, order)
    wanted = [per * least for per in PER_MONOMIAL] if neighbours is None else list(neighbours)
    most = max(len(nodes) // 2, least)
    return sorted({min(max(int(count), least), most) for count in wanted})


def _preferred(
    tried: list[tuple[int, int]], squares: Float[np.ndarray, "combinations judged"], spread: float, dim: int
) -> int:
    """The largest support within one standard error of the best, and of those the lowest order."""
    mean = np.mean(squares, axis=1)
    allowed = np.ones(len(tried), dtype=bool)
    if np.sqrt(mean.min()) > NOISY * spread:
        enough = np.array([count >= NOISY_PER_MONOMIAL * basis_size(dim, order) for order, count in tried])
        allowed = enough if np.any(enough) else allowed
    best = int(np.argmin(np.where(allowed, mean, np.inf)))
    worse = squares - squares[best]
    close = np.mean(worse, axis=1) <= np.std(worse, axis=1) / np.sqrt(squares.shape[1])
    return min(np.flatnonzero(allowed & close).tolist(), key=lambda k: (-tried[k][1], tried[k][0]))
