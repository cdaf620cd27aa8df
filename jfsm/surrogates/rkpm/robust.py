"""Readings that contradict their neighbours count less."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from .estimates import Rule
from .leave_one_out import leave_one_out_errors
from .nodes import Nodes

PASSES = 5
CUT = 6.0
"""Error in medians of the absolute error from which a reading counts for nothing."""
LEAST_WEIGHT = 1e-6
ROUNDING = 1e-9
"""Median error, as a share of the largest force, below which nothing is an outlier."""


def doubted(nodes: Nodes, rule: Rule) -> Nodes:
    """The same nodes, their multiplicities times Tukey's bisquare of the leave-one-out error.

    Notes
    -----
    :math:`w = (1 - (e / 6 \\mathrm{med}|e|)^2)^2`, iterated, as in W. S. Cleveland, J. Am. Statist. Assoc. 74 (1979)
    829-836, with the errors of readings left out. Of several outputs the most doubtful one counts.
    """
    readings = nodes.multiplicity
    for _ in range(PASSES):
        error = np.abs(leave_one_out_errors(nodes, rule, [rule.neighbours])[0])
        scale = np.maximum(np.median(error, axis=0), ROUNDING * np.max(np.abs(np.asarray(nodes.force))))
        ratio = np.max(error / np.where(scale > 0.0, CUT * scale, 1.0), axis=1)
        weight = np.maximum(np.maximum(1.0 - ratio**2, 0.0) ** 2, LEAST_WEIGHT)
        nodes = eqx.tree_at(lambda tree: tree.multiplicity, nodes, readings * jnp.asarray(weight))
    return nodes
