"""Scales, dilation and window of a map by the gradient of its leave-one-out errors."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float

from ..._types import evenly_taken
from .._minimise import minimise_within
from .estimates import Rule
from .leave_one_out import errors_within
from .nodes import Nodes

MOST_JUDGED = 300
FARTHEST = np.log(8.0)
"""Largest change of a scale or a window's width, as a logarithm."""
SMALLEST_DILATION = np.log(0.5)
STEPS = 30
"""Evaluations."""
FLAT = 1e-3
"""Slope of the logarithm of the error at which it counts as least."""


def tune(nodes: Nodes, rule: Rule) -> tuple[Nodes, Rule]:
    """Nodes and rule at the smallest mean square of leave-one-out errors, never a larger one than they have."""
    judged = jnp.asarray(evenly_taken(len(nodes), MOST_JUDGED))
    start = np.asarray(log_parameters(nodes, rule))
    lower, upper = start - FARTHEST, start + FARTHEST
    lower[nodes.dim], upper[nodes.dim] = min(SMALLEST_DILATION, start[nodes.dim]), 0.0

    def objective(values: np.ndarray) -> tuple[Array, Array]:
        return _log_error(jnp.asarray(values), nodes, rule, judged)

    found = minimise_within(objective, start, lower, upper, unit=1.0, flat=FLAT, steps=STEPS)
    if not found.value < float(objective(start)[0]):
        return nodes, rule
    return with_parameters(jnp.asarray(found.parameters), nodes, rule)


def log_parameters(nodes: Nodes, rule: Rule) -> Float[Array, " parameters"]:
    """Logarithms of the scales, of the dilation, and of the numbers that shape the window."""
    shape, _ = ravel_pytree(eqx.filter(rule.window, eqx.is_inexact_array))
    return jnp.log(jnp.concatenate([nodes.scale, rule.dilation[None], shape]))


def with_parameters(values: Float[Array, " parameters"], nodes: Nodes, rule: Rule) -> tuple[Nodes, Rule]:
    """Nodes and rule whose `log_parameters` are these."""
    scale, dilation, numbers = jnp.split(jnp.exp(values), [nodes.dim, nodes.dim + 1])
    shape, fixed = eqx.partition(rule.window, eqx.is_inexact_array)
    window = eqx.combine(ravel_pytree(shape)[1](numbers), fixed)
    return (
        eqx.tree_at(lambda tree: tree.scale, nodes, scale),
        eqx.tree_at(lambda tree: (tree.window, tree.dilation), rule, (window, dilation[0])),
    )


@eqx.filter_jit
def _log_error(
    values: Float[Array, " parameters"], nodes: Nodes, rule: Rule, judged: Array
) -> tuple[Float[Array, ""], Float[Array, " parameters"]]:
    def error(values: Float[Array, " parameters"]) -> Float[Array, ""]:
        return 0.5 * jnp.log(
            jnp.mean(jnp.sum(errors_within(*with_parameters(values, nodes, rule), judged) ** 2, axis=1))
        )

    return jax.value_and_grad(error)(values)
