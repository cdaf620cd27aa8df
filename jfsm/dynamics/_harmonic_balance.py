"""Periodic motion as a sum of harmonics: what they leave unbalanced, and the motion that balances."""

import math
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import lineax as lx
import numpy as np
import optimistix as optx
from jaxtyping import Array, Float

from .._types import as_array
from ._field import Field

_ITERATIONS = 12
_SLOW = 7
_SETTLED = 1e-9
"""Last Newton step of a point that counts as found; being quadratic, it leaves rounding alone."""
_NEWTON = optx.Newton(_SETTLED, _SETTLED, norm=optx.max_norm, linear_solver=lx.LU(), cauchy_termination=True)


def tables(harmonics: int, samples: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean, cosines and sines at the samples of a period (samples, 2 harmonics + 1), and their derivatives."""
    angle = 2 * math.pi * np.arange(samples)[:, None] / samples
    h = np.arange(1, harmonics + 1)
    cosine, sine, zero = np.cos(h * angle), np.sin(h * angle), np.zeros((samples, 1))
    first = np.hstack([zero, -h * sine, h * cosine])
    return np.hstack([zero + 1.0, cosine, sine]), first, np.hstack([zero, -h * h * cosine, -h * h * sine])


def _samples(harmonics: int) -> int:
    return 8 * (harmonics + 1)


def _projection(values: Float[Array, "samples m"]) -> Float[Array, "m samples"]:
    """Coefficients from samples of a period, for harmonics that the samples resolve."""
    return values.T / jnp.sum(values**2, 0)[:, None]


class ForcedBalance(eqx.Module):
    """What harmonics do not balance, of q = (coefficients of displacement, frequency), all in units of their size."""

    system: Field
    harmonics: int = eqx.field(static=True)
    length: Float[Array, ""]
    omega: Float[Array, ""]
    drive: Float[Array, " dof"]

    def __call__(self, q: Float[Array, " n"]) -> Float[Array, " m"]:
        values, first, second = (jnp.asarray(a) for a in tables(self.harmonics, _samples(self.harmonics)))
        coefficients, omega = self.split(q)
        x, v = values @ coefficients, omega * (first @ coefficients)
        inertia = omega**2 * (second @ coefficients) @ self.system.mass
        left = jax.vmap(self.system.force)(x, v) + inertia - values[:, 1:2] * self.drive[None, :]
        return (_projection(values) @ left / jnp.max(jnp.abs(self.drive))).ravel()

    def split(self, q: Float[Array, " n"]) -> tuple[Float[Array, "m dof"], Float[Array, ""]]:
        """Coefficients and frequency with their units."""
        return self.length * q[:-1].reshape(-1, self.system.dof), self.omega * q[-1]


class FreeBalance(eqx.Module):
    """The same without force, velocity and sines: an undamped motion that begins at a turning point."""

    system: Field
    harmonics: int = eqx.field(static=True)
    length: Float[Array, ""]
    omega: Float[Array, ""]
    force: Float[Array, ""]

    def __call__(self, q: Float[Array, " n"]) -> Float[Array, " m"]:
        period = tables(self.harmonics, _samples(self.harmonics))
        values, _, second = (jnp.asarray(a[:, : self.harmonics + 1]) for a in period)
        coefficients, omega = self.length * q[:-1].reshape(-1, self.system.dof), self.omega * q[-1]
        inertia = omega**2 * (second @ coefficients) @ self.system.mass
        left = jax.vmap(lambda x: self.system.force(x, jnp.zeros_like(x)))(values @ coefficients) + inertia
        return (_projection(values) @ left / self.force).ravel()


class Solved(NamedTuple):
    """A point, the curve's direction there, the last step of Newton's method, and how many there were."""

    q: np.ndarray
    tangent: np.ndarray
    moved: float
    count: int

    @property
    def ok(self) -> bool:
        return bool(self.moved < _SETTLED) and bool(np.all(np.isfinite(self.tangent)))

    @property
    def easy(self) -> bool:
        """Whether the step that led here may be as long again."""
        return self.ok and self.count <= _SLOW


def solve(balance, guess: np.ndarray, row: np.ndarray, target: float) -> Solved:
    """The point of the curve at which row·q is `target`."""
    q, tangent, moved, count = _newton(balance, jnp.asarray(guess), jnp.asarray(row), jnp.asarray(float(target)))
    return Solved(np.asarray(q), np.asarray(tangent), float(moved), int(count))


@eqx.filter_jit
def _newton(balance, guess, row, target):
    """The point, the curve's direction there, what one more step would change, and how many were taken."""

    def left(q, _=None):
        return jnp.concatenate([balance(q), (row @ q - target)[None]])

    found = optx.root_find(left, _NEWTON, guess, max_steps=_ITERATIONS, throw=False)
    q = found.value
    sides = jnp.stack([left(q), jnp.zeros_like(q).at[-1].set(1.0)], 1)
    change, tangent = jnp.linalg.solve(jax.jacfwd(left)(q), sides).T
    size = jnp.max(jnp.abs(q[balance.system.dof :]))  # of the motion; the mean may be larger
    return q - change, tangent, jnp.max(jnp.abs(change)) / size, found.stats["num_steps"]


def check_positive(**arguments: float) -> None:
    """Refuse numbers that are not positive and finite, by name."""
    for name, value in arguments.items():
        if not (value > 0 and math.isfinite(value)):
            raise ValueError(f"`{name}` must be positive; got {value!r}.")


def displacement(around: Any, dof: int) -> np.ndarray:
    """The displacement about which to vibrate: as asked for, or the origin."""
    if around is None:
        return np.zeros(dof)
    rest = np.atleast_1d(as_array(around, "around", (0, 1)))
    if rest.shape != (dof,):
        raise ValueError(f"`around` must hold one displacement per degree of freedom ({dof}); got {rest.size}.")
    return rest
