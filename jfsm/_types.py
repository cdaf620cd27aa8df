"""Array helpers that every room may use: double precision is asked for once, here.

Annotations tell the shapes of arrays, and the tests hold every call to them. They are those of one point, one record,
one lane: `jax.vmap` adds axes that no annotation counts. An axis of one name has one length within a call:

=========================  ===============================================================================
`n`                        samples of a record, or readings that a map is learned from
`q`                        points that are asked for
`dof`, `modes`             degrees of freedom; natural motions
`state`                    numbers of a state: twice `dof`, with hidden ones where a filter carries them
`dim`, `outputs`           columns of the states of a map; of its forces
`nodes`, `basis`           of a map or a table
`channels`, `places`       of a record; where forces act
`lanes`, `unknowns`        plants or hypotheses side by side; numbers that are sought
`points`, `harmonics`      of a branch; of a periodic motion
`halves`, `reach`          half steps of a sample; samples that a delay buffer holds
`slots`, `hidden`, `late`  laws of a class in a plant; hidden states; channels that are read late
=========================  ===============================================================================
"""

from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Float
from numpy.typing import NDArray

if TYPE_CHECKING:
    from jaxtyping import Array

    HostArray = np.ndarray
else:
    Array = HostArray = jax.Array | np.ndarray | np.generic
    """Arrays of JAX, for which arrays and numbers of NumPy pass, as they do for JAX; and of NumPy, traced or not."""

X64_MESSAGE = 'float64 data would be narrowed to float32; run `jax.config.update("jax_enable_x64", True)` first.'


def require_x64() -> None:
    """Refuse to go on while JAX would silently narrow doubles.

    Raises
    ------
    ValueError
        If ``jax_enable_x64`` is off; the message is the line to run.
    """
    if not jax.config.jax_enable_x64:  # pyright: ignore[reportAttributeAccessIssue]
        raise ValueError(X64_MESSAGE)


def as_scalar(value: Any) -> Float[Array, ""]:
    """Double-precision scalar from a number or a traced value."""
    require_x64()
    if isinstance(value, bool | str) or value is None:
        raise TypeError(f"A parameter must be a real number; got {value!r}.")
    if not isinstance(value, jax.Array):
        number = np.asarray(value) if np.isscalar(value) or hasattr(value, "dtype") else np.empty(0, object)
        if number.dtype.kind not in "iuf" or number.ndim:
            raise TypeError(f"A parameter must be one real number; got {value!r}.")
        if not np.isfinite(number):
            raise ValueError(f"A parameter must be finite; got {value!r}.")
    elif not jnp.issubdtype(value.dtype, jnp.number):
        raise TypeError(f"A parameter must be one real number; got {value!r}.")
    return jnp.asarray(value, dtype=jnp.float64)


def as_array(value: Any, name: str, ndim: int | tuple[int, ...]) -> np.ndarray:
    """Finite float64 NumPy array of the expected number of axes.

    Raises
    ------
    TypeError, ValueError
        If `value` is not numeric, has other axes, or holds NaN or infinity; names the argument `name`.
    """
    require_x64()
    try:
        array = np.asarray(value)
    except TypeError:  # of things that only look like a sequence, and of keys of jax.random
        raise TypeError(f"`{name}` must hold real numbers; got {value!r}.") from None
    if array.dtype.kind not in "iufb":
        raise TypeError(f"`{name}` must hold real numbers; got dtype {array.dtype}.")
    allowed = (ndim,) if isinstance(ndim, int) else ndim
    if array.ndim not in allowed:
        raise ValueError(f"`{name}` must have {' or '.join(map(str, allowed))} axes; got shape {array.shape}.")
    array = array.astype(np.float64)
    if not np.all(np.isfinite(array)):
        bad = int(np.sum(~np.isfinite(array)))
        raise ValueError(
            f"`{name}` must be finite; {bad} of {array.size} values are NaN or infinite. Remove or fill them."
        )
    return array


def as_numbers(value: Any, name: str, ndim: int | tuple[int, ...]) -> Any:
    """As `as_array`; numbers that are traced stay so, and are held to their axes only."""
    if not is_traced(value):
        return as_array(value, name, ndim)
    require_x64()
    array = jnp.asarray(value, dtype=jnp.float64)
    allowed = (ndim,) if isinstance(ndim, int) else ndim
    if array.ndim not in allowed:
        raise ValueError(f"`{name}` must have {' or '.join(map(str, allowed))} axes; got shape {array.shape}.")
    return array


def known(tree: Any, what: str) -> Any:
    """The tree with the values that are being differentiated as they are now, for decisions on the host.

    Raises
    ------
    TypeError
        If `jax.jit` or `jax.vmap` keeps some value from being known.
    """
    values = jax.tree.map(lambda leaf: jax.lax.stop_gradient(leaf) if isinstance(leaf, Tracer) else leaf, tree)
    if is_traced(values):
        raise TypeError(
            f"{what} must be known numbers, which `jax.jit` and `jax.vmap` hide: steps and start are chosen by them. "
            "Call outside of both; `jax.grad`, `jax.jvp`, `jax.jacfwd` and `jax.jacrev` may be taken of the call."
        )
    return values


def is_traced(tree: Any) -> bool:
    """Whether any array of a tree is traced."""
    return any(isinstance(leaf, Tracer) for leaf in jax.tree.leaves(tree))


def evenly_taken(count: int, most: int) -> NDArray[np.intp]:
    """Indices of `most` rows out of `count`, or of all if there are fewer."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).astype(int))
