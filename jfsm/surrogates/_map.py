"""What every force state map offers, whatever it was learned by."""

import abc
from collections.abc import Sequence
from pathlib import Path
from typing import Any, BinaryIO

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, ArrayLike, Bool, Float
from numpy.typing import NDArray

from .._types import as_array
from ..structures import MapTerm

_DRAWN = 81
"""Points along each column of a picture."""


class AbstractForceStateMap(eqx.Module):
    """A model of the restoring force over the states that were visited.

    Calls on one state are traceable under `jax.jit`, `jax.vmap` and `jax.grad`. Results have no trailing axis where the
    map was learned from force of shape (n,), and the axis `outputs` where it was (n, outputs). The unit of the force is
    that of the readings; a derivative is per unit of the columns.
    """

    def plot(self, ax: Any = None, *, labels: tuple[str, str, str] = ("displacement", "velocity", "force")) -> Any:
        """The force in colours over a state of two columns, within the box that was visited.

        Parameters
        ----------
        ax : matplotlib axes, optional
            A new figure without them.
        labels : (str, str, str)
            What stands along the columns and beside the colours, units included: a map does not know its units.

        Returns
        -------
        matplotlib axes

        Raises
        ------
        ValueError
            If states do not have two columns, or there are several outputs.
        """
        from ..reporting import draw_surface

        if self.dim != 2:
            raise ValueError(f"A map can be drawn over states of 2 columns; this one has {self.dim}.")
        low, high = np.asarray(self.box)
        x, y = np.linspace(low, high, _DRAWN, axis=-1)
        states = np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2)
        force = np.asarray(self.evaluate(states))
        if force.ndim > 1:
            raise ValueError(
                f"A map can be drawn where its force is one number; this one has {force.shape[1]} outputs."
            )
        return draw_surface(x, y, force.reshape(_DRAWN, _DRAWN), labels, ax)

    @property
    @abc.abstractmethod
    def dim(self) -> int:
        """Number of columns of a state."""

    @property
    @abc.abstractmethod
    def box(self) -> Float[Array, "2 dim"]:
        """Lowest and highest visited value of each column."""

    @abc.abstractmethod
    def __call__(self, state: ArrayLike) -> Float[Array, "*outputs"]:
        """Restoring force at one state."""

    @abc.abstractmethod
    def gradient(self, state: ArrayLike) -> Float[Array, "*outputs dim"]:
        """First derivatives of the restoring force at one state."""

    @abc.abstractmethod
    def derivative(self, state: ArrayLike, orders: tuple[int, ...]) -> Float[Array, "*outputs"]:
        """Mixed derivative at one state; ``orders=(3, 0)`` is the third one in the first column."""

    @abc.abstractmethod
    def std(self, state: ArrayLike) -> Float[Array, "*outputs"]:
        """Standard error of the restoring force at one state, in its unit."""

    @abc.abstractmethod
    def evaluate_derivatives(
        self, states: ArrayLike, orders: Sequence[tuple[int, ...]]
    ) -> Float[Array, "q derivatives *outputs"]:
        """Several derivatives at many states at once; orders of zero mean the force itself."""

    @abc.abstractmethod
    def visited(self, states: ArrayLike) -> Bool[NDArray[np.bool_], " q"]:
        """Whether each state lies where readings were taken; elsewhere the map extrapolates."""

    def evaluate(self, states: ArrayLike) -> Float[Array, "q *outputs"]:
        """Restoring force at many states: the fast path, which may search neighbours on the host."""
        return self.evaluate_derivatives(states, ((0,) * self.dim,))[:, 0]

    def on(self, at: tuple[int, int] = (0, 1)) -> MapTerm:
        """This map as a term of a structure, on the link `at`.

        Raises
        ------
        ValueError
            If a state has other columns than one displacement and one velocity.
        """
        if self.dim != 2:
            raise ValueError(
                f"`on` needs a map of one displacement and one velocity; this one has {self.dim} columns. "
                "Fit a map of the link's own motion."
            )
        return MapTerm(self, at=at)

    def save(self, file: str | Path | BinaryIO) -> None:
        """Write the map as an npz file, whole or not at all, or into a binary stream; `jfsm.load_map` reads it.

        Raises
        ------
        ValueError
            If a part of the map is no part of jfsm, such as an interface that is a function of yours.
        """
        from ._map_file import save_map

        save_map(self, file)

    def _states(self, states: Any) -> NDArray[np.float64]:
        states = as_array(states, "states", 2)
        if states.shape[1] != self.dim:
            raise ValueError(f"`states` must have {self.dim} columns, as in `fit`; got shape {states.shape}.")
        return states

    def _state(self, state: Any) -> Float[Array, " dim"]:
        state = state if isinstance(state, Tracer) else jnp.asarray(as_array(state, "state", 1))
        if state.shape != (self.dim,):
            raise ValueError(
                f"`state` must be one state of shape ({self.dim},); got shape {state.shape}. "
                "Use `evaluate` or `jax.vmap` for many."
            )
        return state
