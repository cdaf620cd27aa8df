"""Scales, dilation and window of a map fitted to its readings by the gradient of the leave-one-out error."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float
from scipy.optimize import minimize

from ..._types import evenly_taken
from .estimates import Rule, nearest_nodes
from .leave_one_out import error_at_node
from .nodes import Nodes
from .support import gathered_nodes

MOST_JUDGED = 300
BATCH = 32
FARTHEST = np.log(8.0)
"""Largest change of a scale or a window's width, as a logarithm."""
SMALLEST_DILATION = np.log(0.5)
STEPS = 20


def tune(nodes: Nodes, rule: Rule) -> tuple[Nodes, Rule]:
    """Nodes and rule at the smallest mean square of leave-one-out errors."""
    judged = evenly_taken(len(nodes), MOST_JUDGED)
    start = _start(nodes, rule)
    bounds = [(-FARTHEST, FARTHEST)] * len(start)
    bounds[nodes.dim] = (min(SMALLEST_DILATION, start[nodes.dim]), 0.0)

    def objective(values: np.ndarray) -> tuple[float, np.ndarray]:
        error, slope = _log_error(jnp.asarray(values), nodes, rule, jnp.asarray(judged))
        return float(error), np.asarray(slope)

    found = minimize(objective, start, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": STEPS})
    return _turned(jnp.asarray(found.x), nodes, rule)


def _start(nodes: Nodes, rule: Rule) -> np.ndarray:
    """Logarithms of the factors on the scales, of the dilation, and of the factors on what shapes the window."""
    shape = jax.tree.leaves(eqx.filter(rule.window, eqx.is_inexact_array))
    start = np.zeros(nodes.dim + 1 + sum(leaf.size for leaf in shape))
    start[nodes.dim] = np.log(rule.dilation)
    return start


def _turned(values: Float[Array, " knobs"], nodes: Nodes, rule: Rule) -> tuple[Nodes, Rule]:
    """Nodes and rule with those factors put in."""
    scale, dilation, factors = values[: nodes.dim], values[nodes.dim], values[nodes.dim + 1 :]
    shape, fixed = eqx.partition(rule.window, eqx.is_inexact_array)
    flat, restore = ravel_pytree(shape)
    window = eqx.combine(restore(flat * jnp.exp(factors)), fixed)
    return (
        eqx.tree_at(lambda tree: tree.scale, nodes, nodes.scale * jnp.exp(scale)),
        eqx.tree_at(lambda tree: (tree.window, tree.dilation), rule, (window, jnp.exp(dilation))),
    )


@eqx.filter_jit
def _log_error(values: Float[Array, " knobs"], nodes: Nodes, rule: Rule, judged: Array) -> tuple[Array, Array]:
    def error(values: Float[Array, " knobs"]) -> Float[Array, ""]:
        tuned, new_rule = _turned(values, nodes, rule)

        def at(state: Float[Array, " dim"]) -> Float[Array, ""]:
            near = nearest_nodes(tuned, state, gathered_nodes(rule.neighbours, len(nodes)), rule.across)
            return jnp.sum(error_at_node(near, state, tuned.scale, new_rule.neighbours, new_rule) ** 2)

        return 0.5 * jnp.log(jnp.mean(jax.lax.map(at, nodes.states[judged], batch_size=min(BATCH, len(judged)))))

    return jax.value_and_grad(error)(values)
