"""Least value of a smooth function within bounds: optimistix's BFGS, one evaluation at a time."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array, Bool, Float
from numpy.typing import NDArray

INSIDE = 0.95
"""Share of the half-width between bounds from whose middle a search sets out at most: at a bound the sine is flat."""

SHORTEST = 1e-6
"""Step below which a search has ended, or its line search has."""

NEAR = 0.2
"""Distance, in every parameter, at which a search is taken to go where an earlier one ended."""

_SOLVER = optx.BFGS(rtol=0.0, atol=SHORTEST)


class Minimum(NamedTuple):
    """Where a search ended: the least value met, infinite where the very first point was refused."""

    parameters: NDArray[np.float64]
    value: float


def minimise_within(
    function: Callable[[NDArray[np.float64]], tuple[Any, Any]],
    start: NDArray[np.float64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    *,
    unit: float,
    flat: float,
    steps: int,
    known: Sequence[NDArray[np.float64]] = (),
) -> Minimum:
    r"""Search from one start, at most `steps` evaluations.

    Parameters
    ----------
    function : callable
        Value and gradient (parameters,) at parameters (parameters,). A point is refused where either is not finite.
    start, lower, upper : (parameters,) arrays
        Set out from near `start`, never beyond the bounds.
    unit : float
        Change of the value that a parameter's change by one may bring: the second derivative expected.
    flat : float
        Largest slope at which the value counts as least. Where the line search fails before, at a kink, the search
        begins again by steepest descent as long as that gains more than this.
    known : sequence of (parameters,) arrays
        Ends of earlier searches: one that comes within `NEAR` of such an end is over.

    Notes
    -----
    With the middle c and half-width h of the bounds, :math:`p = c + h \sin(u / h)` and u is free (James and Roos,
    Comput. Phys. Commun. 10 (1975) 343). A least value on a bound is then a common minimum at a finite u; under a
    logistic map it lies at infinity.

    The solver is handed the value and the slope as a tangent plane, so that its own program, 0.3 s to compile, depends
    on the number of parameters alone, and `function` is compiled once, for one evaluation. `optimistix.minimise` around
    the likelihood of kriging compiles 0.5 to 0.9 s longer for every number of readings, and cannot be interrupted.
    """
    middle, half = 0.5 * (lower + upper), 0.5 * (upper - lower)

    def evaluated(u: Array) -> tuple[NDArray[np.float64], float, NDArray[np.float64]]:
        angle = np.asarray(u) / half
        parameters = middle + half * np.sin(angle)
        value, gradient = function(parameters)
        value, gradient = float(value), np.asarray(gradient) * np.cos(angle)
        sound = np.isfinite(value) and np.all(np.isfinite(gradient))
        return parameters, value if sound else np.inf, gradient if sound else np.zeros_like(half)

    u = jnp.asarray(half * np.arcsin(np.clip((start - middle) / half, -INSIDE, INSIDE)))
    best, begun = Minimum(np.asarray(start), np.inf), np.inf
    state = _begin(u)
    for taken in range(steps):
        parameters, value, gradient = evaluated(state.y_eval)
        if taken == 0:
            if np.isinf(value):
                break
            begun, unit = value, max(unit, float(np.max(np.abs(gradient))))  # a first step of one at most
        if value < best.value:
            best = Minimum(parameters, value)
            if np.max(np.abs(gradient)) < flat or any(np.max(np.abs(parameters - end)) < NEAR for end in known):
                break
        u, state, ended = _step(u, state, jnp.asarray(value / unit), jnp.asarray(gradient / unit))
        if ended:
            if begun - best.value < flat:
                break
            begun, state = best.value, _begin(u)
    return best


def _tangent(u: Float[Array, " parameters"], known: tuple[Array, Array, Array]) -> tuple[Float[Array, ""], None]:
    value, gradient, at = known
    return value + jnp.dot(gradient, u - at), None


@eqx.filter_jit
def _begin(u: Float[Array, " parameters"]) -> Any:
    value = jax.ShapeDtypeStruct((), u.dtype)
    return _SOLVER.init(_tangent, u, (value, u, u), {}, value, None, frozenset())


@eqx.filter_jit
def _step(
    u: Float[Array, " parameters"], state: Any, value: Float[Array, ""], gradient: Float[Array, " parameters"]
) -> tuple[Array, Any, Bool[Array, ""]]:
    """The solver's next point, in ``state.y_eval``, from value and slope at its last one."""
    known = value, gradient, state.y_eval
    u, state, _ = _SOLVER.step(_tangent, u, known, {}, state, frozenset())
    ended, _ = _SOLVER.terminate(_tangent, u, known, {}, state, frozenset())
    return u, state, ended | (jnp.max(jnp.abs(state.y_eval - u)) < SHORTEST)
