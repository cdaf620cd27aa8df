"""The linear structure that a structure is for small motion about a state."""

from dataclasses import dataclass
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Inexact

from .._types import as_array, require_x64
from ..plant import state_matrix
from ..structures import Structure, as_model
from ._field import Field, autonomous_field


@dataclass(frozen=True)
class Linearisation:
    """Small motion about a state: y' = matrix y, y = (x, v) from that state.

    Attributes
    ----------
    matrix : (2 dof, 2 dof) array
        Jacobian of the rate of the state.
    eigenvalues : (2 dof,) array, complex unless all are real
        Of `matrix` [1/s], by size.
    frequencies : (modes,) array
        Natural frequencies [rad/s]: the size of each eigenvalue of imaginary part zero or more, ascending. An
        oscillating mode has one; an overdamped or unstable one that does not oscillate has two, real.
    damping_ratios : (modes,) array
        -Re λ/abs(λ): 1 or -1 where a mode does not oscillate, negative where it grows.
    shapes : (dof, modes) array, complex unless all eigenvalues are real
        Displacement of each mode, in its column; the largest component is 1.
    mass, stiffness, damping : (dof, dof) arrays
        Of the structure for small motion [kg], [N/m], [N s/m].
    """

    matrix: Float[np.ndarray, "state state"]
    eigenvalues: Inexact[np.ndarray, " state"]
    frequencies: Float[np.ndarray, " modes"]
    damping_ratios: Float[np.ndarray, " modes"]
    shapes: Inexact[np.ndarray, "dof modes"]
    mass: Float[np.ndarray, "dof dof"]
    stiffness: Float[np.ndarray, "dof dof"]
    damping: Float[np.ndarray, "dof dof"]


def linearise(model: Structure, state: Any = None) -> Linearisation:
    r"""The linear structure that `model` is for small motion about a state.

    Parameters
    ----------
    model : Structure
        Smooth: friction that sticks has no slope, so `model.without(term)` is what can be linearised. Learned maps
        are differentiated themselves.
    state : (2 dof,) array, optional
        Displacements [m], then velocities [m/s]; the origin when None. It need not be a point of rest.

    Returns
    -------
    Linearisation

    Raises
    ------
    ValueError
        If a term sticks, depends on time or has no slope at the state, a mass is zero, or `state` has the wrong shape.

    Notes
    -----
    :math:`M \ddot x + C \dot x + K x = 0` with :math:`K = \partial f/\partial x` and :math:`C = \partial f/\partial v`,
    the paper's eq. 73. At a corner of a piecewise force the slope is that of one of its sides.
    """
    require_x64()
    as_model(model)
    at = np.zeros(2 * model.dof) if state is None else as_array(state, "state", 1)
    if at.shape != (2 * model.dof,):
        raise ValueError(
            f"`state` must hold {model.dof} displacements, then {model.dof} velocities; got {at.size} values."
        )
    return linearise_field(autonomous_field(model), at)


def linearise_field(system: Field, state: np.ndarray) -> Linearisation:
    """The same for a right-hand side that is known to be smooth."""
    _, stiffness, damping = tangent(system, state)
    if not np.all(np.isfinite([stiffness, damping])):
        raise ValueError(
            f"`model` must have a slope at the state {state.tolist()}; one of its terms has none there. "
            "Choose another state, or leave that term out with `model.without(term)`."
        )
    minv = np.asarray(system.minv)
    matrix = state_matrix(minv @ stiffness, minv @ damping)
    eigenvalues, vectors = np.linalg.eig(matrix)
    order = np.lexsort((np.imag(eigenvalues), np.round(np.abs(eigenvalues), 12)))
    eigenvalues, vectors = eigenvalues[order], vectors[:, order]
    mode = np.imag(eigenvalues) >= 0
    values, shapes = eigenvalues[mode], vectors[: system.dof, mode]
    size = np.abs(values)
    largest = np.take_along_axis(shapes, np.argmax(np.abs(shapes), 0)[None], 0)
    return Linearisation(
        matrix=matrix,
        eigenvalues=eigenvalues,
        frequencies=size,
        damping_ratios=np.divide(-np.real(values), size, out=np.zeros_like(size), where=size > 0),
        shapes=shapes / largest,
        mass=np.asarray(system.plant.mass),
        stiffness=stiffness,
        damping=damping,
    )


def tangent(system: Field, state: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Force (dof,) at a state, and its slopes in displacement and velocity."""
    force, stiffness, damping = (np.asarray(a) for a in _tangent(system, jnp.asarray(state)))
    return force, stiffness, damping


@eqx.filter_jit
def _tangent(system: Field, state: Float[Array, " n"]):
    def twice(x, v):
        force = system.force(x, v)
        return force, force

    slopes, force = jax.jacfwd(twice, (0, 1), has_aux=True)(*jnp.split(state, 2))
    return force, *slopes


def is_stable(eigenvalues: np.ndarray) -> bool:
    """Whether every disturbance dies out: all real parts negative beyond rounding."""
    return bool(np.all(np.real(eigenvalues) < -1e-12 * np.max(np.abs(eigenvalues))))
