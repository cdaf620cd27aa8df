"""Where a structure stays at rest, and whether it comes back there."""

from dataclasses import dataclass
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Inexact

from .._types import as_array, require_x64
from ..structures import MapTerm, Structure, as_model
from ._field import Field, autonomous_field
from ._linearise import is_stable, linearise_field, tangent
from ._scales import scales, spread
from ._simulate import with_tables

_ITERATIONS = 200
"""Steps of one start: a threefold root, where each step gains a third, is then found to 1e-35 of the start."""
_SETTLED = 1e-10
"""Last step of a root that counts as found, in the shortest length of the structure."""
_POLISH = 3
_APART = 1e-6
"""Distance of two roots that count as two, in the same."""
_GROWTH = 4.0
_ENOUGH = 4.0
_TOO_FAR = 1000.0
"""Box, in the longest length of the structure, that is searched in any case, and beyond which it must be said."""


@dataclass(frozen=True)
class FixedPoint:
    """A state of rest.

    Attributes
    ----------
    state : (2 dof,) array
        Displacements [m], then velocities, all zero.
    eigenvalues : (2 dof,) array, complex unless all are real
        Of the motion near it [1/s], the paper's eq. 73.
    stable : bool
        Whether every small disturbance dies out: all real parts negative. Without damping none does.
    residual : float
        Largest force left over [N].
    """

    state: Float[np.ndarray, " state"]
    eigenvalues: Inexact[np.ndarray, " state"]
    stable: bool
    residual: float


def fixed_points(
    model: Structure, within: Any = None, *, starts: int = 256, force: Any = None
) -> tuple[FixedPoint, ...]:
    """All states of rest of a structure inside a box, in the order of their displacements.

    Parameters
    ----------
    model : Structure
        Smooth and independent of time.
    within : pair (low, high), optional
        Displacements [m] between which to look, each a number or (dof,). When None the box grows about the origin,
        fourfold each time, from the shortest to four times the longest length that the numbers of the terms make
        (a gap, the displacement at which a cubic spring matches the linear one), and on until two boxes in a row
        bring nothing new.
    starts : int
        Evenly spread points of each box from which Newton's method sets out, its centre first.
    force : (dof,) array, optional
        A constant force [N].

    Returns
    -------
    tuple of FixedPoint
        Found to rounding where the force crosses zero; to about seven digits where it only touches it in more than
        one degree of freedom. States that a learned map has never visited are left out.

    Raises
    ------
    ValueError
        If a term sticks or depends on time, a mass is zero, the points of rest are a continuum or go on without end,
        or an argument has the wrong form.
    """
    require_x64()
    as_model(model)
    if not isinstance(starts, int) or starts < 1:
        raise ValueError(f"`starts` must be 1 or more, a whole number; got {starts!r}.")
    box = None if within is None else _as_box(within, model.dof)
    system = autonomous_field(with_tables(model), force)
    points, shortest = search(system, model, box, starts)
    _refuse_continuum(system, points, shortest)
    if any(isinstance(term, MapTerm) for term in model.terms):  # the table led there; the map itself has the last word
        system = autonomous_field(model, force)
        points = [_polished(system, x) for x in points]
    return tuple(_fixed_point(system, x) for x in points)


def search(system: Field, model: Structure, box: np.ndarray | None, starts: int) -> tuple[np.ndarray, float]:
    """Points of rest (points, dof) in lexicographic order, and the shortest length of the structure."""
    lengths = scales(model, np.asarray(system.load))
    lengths = lengths if lengths.size else np.ones(1)
    shortest, longest = float(lengths[0]), float(lengths[-1])
    cube = spread(starts, system.dof)
    found = np.zeros((0, system.dof))
    if box is not None:
        middle, half = box.mean(0), (box[1] - box[0]) / 2
        return _merge(found, _inside(system, cube * half + middle, box, shortest), shortest), shortest
    size, quiet = shortest, 0
    while size <= _ENOUGH * longest or quiet < 2:
        if size > _TOO_FAR * longest:
            raise ValueError(
                f"`within` must be given: points of rest go on without end ({len(found)} within ±{size:.3g}). "
                "Say between which displacements to look, for example `within=(-1.0, 1.0)`."
            )
        size *= _GROWTH
        before = len(found)
        found = _merge(found, _inside(system, size * cube, None, shortest), shortest)
        quiet = quiet + 1 if len(found) == before else 0
        _refuse_continuum(system, found[:4], shortest)
    return found, shortest


def _inside(system: Field, starts: np.ndarray, box: np.ndarray | None, shortest: float) -> np.ndarray:
    x, good = _newton(system, starts, shortest, float(np.max(np.ptp(starts, 0))) / 4 + shortest)
    if box is not None:
        good = good & np.all((x >= box[0] - _APART * shortest) & (x <= box[1] + _APART * shortest), 1)
    return x[good]


def _merge(known: np.ndarray, new: np.ndarray, shortest: float) -> np.ndarray:
    """Distinct points, the ones found first kept."""
    kept = list(known)
    for x in new:
        if all(np.max(np.abs(x - y)) > _APART * shortest for y in kept):
            kept.append(x)
    kept = np.array(kept).reshape(-1, new.shape[1])
    return kept[np.lexsort(np.round(kept / shortest, 6).T[::-1])]


def _newton(system: Field, starts: np.ndarray, shortest: float, reach: float) -> tuple[np.ndarray, np.ndarray]:
    x, good = _roots(system, jnp.asarray(starts), jnp.asarray(shortest), jnp.asarray(reach))
    return np.asarray(x), np.asarray(good)


@eqx.filter_jit
def _roots(system: Field, starts: Float[Array, "starts dof"], shortest, reach):
    """Newton's method from every start with steps up to `reach`: displacements, and whether each is a point of rest.

    `optimistix.Newton` knows no longest step, and would leave the box where a spring is almost flat.
    """
    still = jnp.zeros(system.dof)

    def static(x):
        return system.force(x, still)

    def step(carry):
        x, _, count = carry
        # The shortest step where the slope is singular: none at all in the middle of a continuum.
        change = jnp.linalg.pinv(jax.jacfwd(static)(x), rtol=1e-14) @ static(x)
        size = jnp.linalg.norm(change)
        return x - change * jnp.minimum(1.0, reach / jnp.maximum(size, 1e-300)), size, count + 1

    def unsettled(carry):
        x, size, count = carry
        return (size > 1e-15 * shortest) & (size > 1e-15 * jnp.linalg.norm(x)) & (count < _ITERATIONS)

    def one(start):
        x, size, _ = jax.lax.while_loop(unsettled, step, (start, jnp.full((), jnp.inf), 0))
        state = jnp.concatenate([x, still])
        return x, (size < _SETTLED * shortest) & jnp.all(jnp.isfinite(x)) & system.visited(state)

    return jax.vmap(one)(starts)


def _refuse_continuum(system: Field, points: np.ndarray, shortest: float) -> None:
    """Raise where the structure rests beside a point of rest too."""
    for x in points:
        softest = np.linalg.svd(tangent(system, np.append(x, 0.0 * x))[1])[2][-1]
        beside = shortest * np.array([-0.25, 0.25])[:, None]
        near = np.max(np.abs(_static(system, x + beside * softest)), 1)
        far = np.max(np.abs(_static(system, x + 16 * beside * np.ones_like(x))))
        if np.min(near) <= 1e-13 * far or far == 0:
            place, way = (", ".join(f"{q:.3g}" for q in values + 0.0) for values in (x, softest))
            raise ValueError(
                f"`model` must be held in place; about the displacement ({place}) it rests anywhere along ({way}), "
                "so its points of rest are a continuum. Add a spring that holds it there."
            )


@eqx.filter_jit
def _static(system: Field, x):
    return jax.vmap(lambda x: system.force(x, jnp.zeros(system.dof)))(x)


def _polished(system: Field, x: np.ndarray) -> np.ndarray:
    for _ in range(_POLISH):
        force, stiffness, _ = tangent(system, np.append(x, 0.0 * x))
        x = x - np.linalg.pinv(stiffness, rtol=1e-14) @ force
    return x


def _fixed_point(system: Field, x: np.ndarray) -> FixedPoint:
    state = np.append(x + 0.0, np.zeros_like(x))
    eigenvalues = linearise_field(system, state).eigenvalues
    left = float(np.max(np.abs(tangent(system, state)[0])))
    return FixedPoint(state, eigenvalues, is_stable(eigenvalues), left)


def _as_box(within: Any, dof: int) -> np.ndarray:
    try:
        low, high = (np.broadcast_to(as_array(side, "within", (0, 1)), (dof,)) for side in within)
    except (TypeError, ValueError):
        raise ValueError(
            f"`within` must be a pair (low, high) of displacements, each a number or one per degree of freedom "
            f"({dof}); got {within!r}."
        ) from None
    if np.any(low >= high):
        raise ValueError(f"`within` must be a pair (low, high) with low below high; got {within!r}.")
    return np.stack([low, high])
