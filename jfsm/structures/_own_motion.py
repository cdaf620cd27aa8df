"""How a plant moves that is given as a function."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

Acceleration = Callable[..., Any]

_STEP = 6e-6
"""Step of a central difference, as a share of the quantity or of one: the cube root of rounding."""


class OwnMotion(NamedTuple):
    """A function for the acceleration (dof,), and the names of its numbers."""

    function: Acceleration
    names: tuple[str, ...]

    def __call__(self, numbers: Float[Array, " own"], q: Any, v: Any, force: Any, t: Any) -> Float[Array, " dof"]:
        parameters = {name: numbers[i] for i, name in enumerate(self.names)}
        return jnp.asarray(self.function(q, v, force, t, parameters))

    def answer(self, numbers: Float[Array, " own"], q: Any, v: Any, t: Any) -> Float[Array, "dof dof"]:
        """Accelerations per unit of force, one force per column: the inverse of the mass matrix."""
        return jax.jacfwd(lambda force: self(numbers, q, v, force, t))(jnp.zeros_like(q))


class EvaluatedMotion(NamedTuple):
    """A function in NumPy for the accelerations (n, dof) of many states at once, and the names of its numbers.

    Programs of JAX call it back; its derivatives are central differences.
    """

    function: Acceleration
    names: tuple[str, ...]

    def __call__(self, numbers: Float[Array, " own"], q: Any, v: Any, force: Any, t: Any) -> Float[Array, " dof"]:
        return _asked(self.many, jnp.shape(q), numbers, q, v, force, t)

    def answer(self, numbers: Float[Array, " own"], q: Any, v: Any, t: Any) -> Float[Array, "dof dof"]:
        """As of an `OwnMotion`."""
        return _asked(self.answers, (*jnp.shape(q), *jnp.shape(q)), numbers, q, v, jnp.zeros_like(q), t)

    def many(
        self,
        numbers: Float[np.ndarray, "n own"],
        q: Float[np.ndarray, "n dof"],
        v: Float[np.ndarray, "n dof"],
        force: Float[np.ndarray, "n dof"],
        t: Float[np.ndarray, " n"],
    ) -> Float[np.ndarray, "n dof"]:
        """Accelerations in rows of states, each with its own numbers."""
        if np.all(numbers == numbers[:1]):
            return np.asarray(self.function(q, v, force, t, self._named(numbers[0])))
        found = np.empty(q.shape)
        different, which = np.unique(numbers, axis=0, return_inverse=True)
        for k, row in enumerate(different):
            mine = which.ravel() == k
            found[mine] = self.function(q[mine], v[mine], force[mine], t[mine], self._named(row))
        return found

    def _named(self, row: Float[np.ndarray, " own"]) -> dict[str, float]:
        return dict(zip(self.names, row.tolist(), strict=True))

    def with_numbers(self, numbers: Float[np.ndarray, " own"]) -> "EvaluatedMotion":
        """The same function, which has no numbers to choose any more."""
        named = self._named(numbers)
        return EvaluatedMotion(lambda q, v, force, t, _: self.function(q, v, force, t, named), ())

    def answers(
        self,
        numbers: Float[np.ndarray, "n own"],
        q: Float[np.ndarray, "n dof"],
        v: Float[np.ndarray, "n dof"],
        force: Float[np.ndarray, "n dof"],
        t: Float[np.ndarray, " n"],
    ) -> Float[np.ndarray, "n dof dof"]:
        """Accelerations per unit of force, one force per column: a function that is additive in it needs no small
        ones."""
        dof = q.shape[1]
        pushed = np.concatenate([force[:, None], force[:, None] + np.eye(dof)], 1)
        n, x, w, time = (np.repeat(each, dof + 1, 0) for each in (numbers, q, v, t))
        a = self.many(n, x, w, pushed.reshape(-1, dof), time).reshape(-1, dof + 1, dof)
        return np.swapaxes(a[:, 1:] - a[:, :1], 1, 2)


@partial(jax.custom_jvp, nondiff_argnums=(0, 1))
def _asked(ask: Callable[..., np.ndarray], shape: tuple[int, ...], *state: Any) -> Any:
    """What a function of rows (numbers, q, v, force, t) gives of one of them, of this shape."""
    called = jax.ShapeDtypeStruct(shape, float)
    return jax.pure_callback(partial(_on_rows, ask, len(shape)), called, *state, vmap_method="broadcast_all")


@_asked.defjvp
def _asked_near(ask: Callable[..., np.ndarray], shape: tuple[int, ...], state: Any, moved: Any) -> tuple[Any, Any]:
    change = jnp.concatenate([jnp.ravel(part) for part in moved])
    slopes = _asked(partial(_differences, ask), (*shape, change.size), *state)
    return _asked(ask, shape, *state), slopes @ change


def _on_rows(ask: Callable[..., np.ndarray], axes: int, *state: Any) -> np.ndarray:
    """What a function of rows gives of states with any axes before their own."""
    *columns, t = (np.asarray(part) for part in state)
    rows = [part.reshape(-1, part.shape[-1]) for part in columns] if t.ndim else [part[None] for part in columns]
    found = ask(*rows, t.reshape(-1))
    return found.reshape(*t.shape, *found.shape[found.ndim - axes :])


def _differences(ask: Callable[..., np.ndarray], *state: np.ndarray) -> np.ndarray:
    """Derivatives (n, ..., columns) of a function of rows by all that these hold."""
    *parts, t = state
    flat = np.concatenate([*parts, t[:, None]], 1)
    ends = np.cumsum([part.shape[1] for part in parts])
    columns = []
    for k in range(flat.shape[1]):
        step = _STEP * np.maximum(np.abs(flat[:, k]), 1.0)
        there = []
        for sign in (1.0, -1.0):
            moved = flat.copy()
            moved[:, k] += sign * step
            *split, time = np.split(moved, ends, 1)
            there.append(ask(*split, time[:, 0]))
        columns.append((there[0] - there[1]) / (2 * step).reshape(-1, *(1,) * (there[0].ndim - 1)))
    return np.stack(columns, -1)
