"""The term contract: everything on the left-hand side of the equation of motion is a term."""

import abc
import math
import operator
from typing import Any, ClassVar, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

Scalar = Float[Array, ""]


class Parameter(NamedTuple):
    """One number of a law.

    `force`, `length` and `time` are the exponents of its unit: N/m³ is ``force=1, length=-3``. A fit keeps it between
    `low` and `high`.
    """

    name: str
    force: int = 0
    length: int = 0
    time: int = 0
    positive: bool = True
    meaning: str = ""
    low: float = -math.inf
    high: float = math.inf

    def unit(self, force: str = "N", length: str = "m", time: str = "s") -> str:
        """The unit in words, ``"N/m^3"``, from the record's unit of force and of length."""
        if (self.force, self.length, self.time, force, length, time) == (1, -1, 2, "N", "m", "s"):
            return "kg"
        powers = [(force, self.force), (length, self.length), (time, self.time)]
        above = [name if p == 1 else f"{name}^{p}" for name, p in powers if p > 0]
        below = [name if p == -1 else f"{name}^{-p}" for name, p in powers if p < 0]
        if not above and not below:
            return "1"
        top = " ".join(above) or "1"
        return top if not below else f"{top}/{below[0]}" if len(below) == 1 else f"{top}/({' '.join(below)})"


def as_link(at: Any) -> tuple[int, int]:
    """A pair (i, j) of two different degrees of freedom; 0 is ground."""
    try:
        i, j = (operator.index(a) for a in at)
    except (TypeError, ValueError):
        raise ValueError(f"`at` must be a pair (i, j) of degrees of freedom, 0 for ground; got {at!r}.") from None
    if i < 0 or j < 0 or i == j:
        raise ValueError(f"`at` must name two different degrees of freedom, 0 for ground; got {at!r}.")
    return i, j


class AbstractTerm(eqx.Module):
    """A force on the link ``at=(i, j)``, restoring side positive: it resists d = x_j - x_i and w = v_j - v_i.

    A concrete term lists its numbers as fields, in the order of `parameters`, and then `at`.
    """

    at: eqx.AbstractVar[tuple[int, int]]
    kind: ClassVar[str]
    """First part of the path of its parameters, ``coulomb`` in ``coulomb@0-1.F``."""
    parameters: ClassVar[tuple[Parameter, ...]]

    @abc.abstractmethod
    def force(self, d: Scalar, w: Scalar, z: Any, t: Scalar) -> Scalar:
        """Force of the term [N] at relative displacement `d`, relative velocity `w`, memory `z` and time `t`."""

    @property
    def place(self) -> str:
        """The link as it stands in a path, ``0-1``."""
        return f"{self.at[0]}-{self.at[1]}"

    @property
    def values(self) -> tuple[Scalar, ...]:
        """The numbers of the law in the order of `parameters`."""
        return tuple(getattr(self, p.name) for p in self.parameters)


class AbstractFriction(AbstractTerm):
    """A force that sticks: at w = 0 it takes any value between its limits."""

    @abc.abstractmethod
    def limits(self, d: Scalar, w: Scalar, z: Any, t: Scalar) -> tuple[Scalar, Scalar]:
        """Force while sliding backward and while sliding forward at speed abs(w); at w = 0 the bounds of sticking."""

    def force(self, d: Scalar, w: Scalar, z: Any, t: Scalar) -> Scalar:
        lower, upper = self.limits(d, w, z, t)
        return jnp.where(w > 0, upper, jnp.where(w < 0, lower, jnp.zeros_like(upper)))
