"""Lines of jumps and kinks in readings, the most certain first."""

from typing import Any

import numpy as np

from ..._types import as_array, evenly_taken
from .discontinuity import Discontinuity, described
from .evidence import weeded
from .regression import FLOOR, Regression
from .search import lines_of

MOST_READINGS = 20_000
"""Readings that are used, evenly taken."""


def find_discontinuities(
    states: Any,
    force: Any,
    directions: Any = None,
    confidence: float = 0.99,
    resolution: float = 0.02,
) -> tuple[Discontinuity, ...]:
    """Lines across which a force jumps or kinks, the most certain first; empty where the force is smooth.

    Parameters
    ----------
    states : (n, dim) array
        Any units.
    force : (n,) array
        Readings of the force; noise is estimated from them.
    directions : (k, dim) array, optional
        Normals along which lines are looked for, per unit of the columns; every column by itself when None.
    confidence : float
        Lines less certain are not returned.
    resolution : float
        Share of the range along a normal below which a smooth transition counts as a line: noise in the states blurs
        every line a little.

    Raises
    ------
    TypeError, ValueError
        If shapes disagree, values are not finite, a direction is zero, or fewer than 50 states are given.

    Notes
    -----
    The paper reads such lines off a plot (section 4.3). Here a global regression

    .. math:: f = \\sum_j \\beta_j T_j(x) + \\sum_k (a_k + b_k (s_k - o_k)) U(s_k - o_k)

    is fitted, T Chebyshev polynomials of an order chosen by BIC, s = normal · state, a = 0 for a kink. Lines enter one
    at a time at the best of many places. A kink is then refined by linearisation [1]_, a jump to the best of all gaps
    between neighbouring readings; its interval holds every place that the likelihood does not refuse, with readings
    that noise in the states has put on the wrong side. A line is kept if it is far more probable than (i) none and
    (ii) a tanh or softplus of finite width at its best place, each with its own best polynomial order. Residuals that
    are no noise, by their nearest neighbours, count as at most twenty independent looks.

    References
    ----------
    .. [1] V. M. R. Muggeo, Statist. Med. 22 (2003) 3055-3071.
    """
    states, force = as_array(states, "states", 2), as_array(force, "force", 1)
    if len(states) != len(force):
        raise ValueError(f"`force` must have one value per state, shape ({len(states)},); got {force.shape}.")
    if len(states) < 50:
        raise ValueError(f"`states` must hold at least 50 readings to tell a line from a bend; got {len(states)}.")
    normals = np.eye(states.shape[1]) if directions is None else as_array(directions, "directions", 2)
    if normals.shape[1] != states.shape[1] or not np.all(np.any(normals, axis=1)):
        raise ValueError(f"`directions` must be nonzero rows of {states.shape[1]} numbers; got {normals.tolist()}.")
    if np.std(force) <= FLOOR * np.max(np.abs(force)):
        return ()
    taken = evenly_taken(len(states), MOST_READINGS)
    regression = Regression(states[taken], force[taken], normals, resolution)
    found = weeded(regression, lines_of(regression), confidence)
    return tuple(described(regression, found, k) for k in np.argsort([-line.confidence for line in found]))
