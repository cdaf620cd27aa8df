"""The term contract: everything on the left-hand side of the equation of motion is a term."""

import abc
import math
import operator
from typing import Any, ClassVar, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jax.core import Tracer
from jaxtyping import Array, Float

Scalar = Float[Array, ""]


ABOVE_ZERO = 1e-300
"""`Parameter.least` of a number that a law divides by."""


class Parameter(NamedTuple):
    """One number of a law.

    `force`, `length` and `time` are the exponents of its unit: N/m³ is ``force=1, length=-3``. Those of length and time
    count as often as the law's number named `exponent` says: 1/mⁿ is ``length=-1, exponent="n"``. A fit keeps the
    number between `low` and `high`, in logarithms if it is `positive`, and leaves it alone if it is not `free` (a side,
    an origin of time). A value below `least` is refused. One that may have either sign has the `usual` one as a rule.
    """

    name: str
    force: int = 0
    length: int = 0
    time: int = 0
    positive: bool = True
    meaning: str = ""
    low: float = -math.inf
    high: float = math.inf
    least: float = -math.inf
    free: bool = True
    exponent: str = ""
    usual: int = 0

    def check(self, value: Any, owner: str) -> None:
        """Refuse a value below `least`; one that is being traced cannot be looked at."""
        if isinstance(value, Tracer) or float(value) >= self.least:
            return
        must = "be positive" if self.least > 0 else "not be negative"
        raise ValueError(f"`{self.name}` of {owner} must {must}; got {float(value):g}.")

    def unit(self, force: str = "N", length: str = "m", time: str = "s") -> str:
        """The unit in words, ``"N/m^3"``, from the record's unit of force and of length."""
        if self.exponent:
            over = self._replace(force=0, exponent="").unit(force, length, time)
            over = f"{over}^{self.exponent}" if over.startswith("1/") else f"({over})^{self.exponent}"
            return f"{force} {over}" if self.force else over
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


class Scale(NamedTuple):
    """Sizes of a motion, which a law's numbers are natural to.

    `force` is the rms of the elastic force, `length` the rms of the displacement, `peak` its largest value, `omega` the
    angular frequency [rad/s], `begin` and `end` the record's first and last instant.
    """

    force: float
    length: float
    peak: float
    omega: float
    begin: float
    end: float

    def of(self, parameter: Parameter) -> float:
        """Natural size of a number by its unit."""
        return self.force**parameter.force * self.length**parameter.length * self.omega**-parameter.time

    @property
    def speed(self) -> float:
        return self.length * self.omega

    def instants(self, count: int) -> list[float]:
        """So many instants inside the record, evenly spread."""
        return [self.begin + (i + 1) / (count + 1) * (self.end - self.begin) for i in range(count)]


Numbers = dict[str, float]


class AbstractTerm(eqx.Module):
    """A force on the link ``at=(i, j)``, restoring side positive: it resists d = x_j - x_i and w = v_j - v_i.

    A concrete term lists its numbers as fields, in the order of `parameters`, and then `at`. One with a memory says how
    many hidden `states` it has, and gives `state_rate` and, where they do not begin at zero, `initial_state`; where a
    hidden state is confined, `settle` puts it back at the end of a step. One that acts on the past gives `delay`.
    """

    at: eqx.AbstractVar[tuple[int, int]]
    kind: ClassVar[str]
    """First part of the path of its parameters, ``coulomb`` in ``coulomb@0-1.F``."""
    parameters: ClassVar[tuple[Parameter, ...]]
    states: ClassVar[int] = 0
    hangs: ClassVar[bool] = False
    """Whether it hangs on one mass, at ``(0, j)``, and not between two."""
    timed: ClassVar[bool] = False
    """Whether its force depends on the time itself."""
    contains: ClassVar[tuple[type["AbstractTerm"], ...]] = ()
    """Laws that this one is for certain of its numbers."""
    is_whole_spring: ClassVar[bool] = False
    """Whether it may be all of a spring, so that it takes the place of a linear one, and not only add to it."""
    base: ClassVar[tuple[float, ...]] = ()
    """Share of the base's acceleration that each hidden state loses: 1 for the velocity of a mass of its own."""

    def __check_init__(self):
        for parameter in self.parameters:
            parameter.check(getattr(self, parameter.name), self.kind)

    @abc.abstractmethod
    def force(self, d: Scalar, w: Scalar, z: Any, t: Scalar) -> Scalar:
        """Force of the term [N] at relative displacement `d`, relative velocity `w`, memory `z` and time `t`.

        A term with a `delay` is given `d` and `w` as they were that long ago.
        """

    def state_rate(self, d: Scalar, w: Scalar, z: Any, t: Scalar) -> Any:
        """Rate of the hidden states (states,)."""
        return jnp.zeros(self.states)

    def fading(self, w: Scalar) -> Scalar | None:
        """Rate [1/s] at which hidden states fade, each in proportion to itself and the faster the faster the link
        moves; None where they do not."""
        return None

    def initial_state(self, d: Scalar, w: Scalar) -> Any:
        """Hidden states (states,) at rest with the link at `d`, `w`: relaxed."""
        return jnp.zeros(self.states)

    def settle(self, d: Scalar, z: Any) -> Any:
        """Hidden states within their bounds."""
        return z

    @property
    def delay(self) -> Scalar | None:
        """How long ago [s] the motion was that the force answers; None for the present."""
        return None

    @property
    def breakpoints(self) -> tuple[Scalar, ...]:
        """Instants [s] at which the law jumps."""
        return ()

    def otherwise(self, stiffness: float) -> str:
        """Why these numbers, beside so much linear stiffness of the link, make it another law; empty if they do not."""
        return ""

    def rests(self, stiffness: float) -> tuple[float, ...]:
        """Relative displacements, other than none, at which it may rest beside so much linear stiffness of the link."""
        return ()

    @classmethod
    def about_a_rest(cls, stiffness: float, slope: float, curvature: float) -> Numbers | None:
        """Numbers whose force is a constant + slope·d + curvature·d² for small d from a rest of its own, if it has any.

        The rest is one beside so much linear stiffness of the link.
        """
        return None

    @classmethod
    def shapes(cls, scale: Scale) -> list[Numbers]:
        """Sets of numbers to begin a search from, each with a force of the elastic one's size.

        All numbers whose unit holds a force scale together, so a search has to find one factor for each set.
        """
        return [{p.name: scale.of(p) for p in cls.parameters}]

    @classmethod
    def holding(cls, law: "AbstractTerm", scale: Scale) -> list[Numbers]:
        """Sets of numbers that are near `law`, a special case of it, for a search to begin from as well."""
        return []

    @classmethod
    def opposite(cls, numbers: Numbers) -> Numbers | None:
        """Numbers whose force is that of these with its sign changed, of a law that has them."""
        return None

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
