"""The term contract: everything on the left-hand side of the equation of motion is a term."""

import abc
from typing import Any, ClassVar, dataclass_transform

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ._definition import checked, completed
from ._parameter import ABOVE_ZERO as ABOVE_ZERO
from ._parameter import Parameter as Parameter
from ._parameter import Scale as Scale
from ._parameter import as_link as as_link
from ._written import part_text

Scalar = Float[Array, ""]


Numbers = dict[str, float]


@dataclass_transform(field_specifiers=(eqx.field,))
class _Law(type(eqx.Module)):
    """A class of laws is looked at as soon as it is defined."""

    def __init__(cls, *given: Any, **options: Any):
        super().__init__(*given, **options)
        checked(cls)


class AbstractTerm(eqx.Module, metaclass=_Law):
    """A force on the link ``at=(i, j)``, restoring side positive: it resists d = x_j - x_i and w = v_j - v_i.

    A law of your own derives from it, lists its `parameters`, and gives the `force`, written with ``jax.numpy``; the
    numbers are then its attributes, and the class is called with them and with the place, ``at=(i, j)``. One with a
    memory says how many hidden `states` it has, and gives `state_rate` and, where they do not begin at zero,
    `initial_state`; where a hidden state is confined, `settle` puts it back at the end of a step. One that acts on the
    past gives `delay`. For friction that sticks there is `AbstractFriction`.

    Raises
    ------
    TypeError, ValueError
        Where the class is defined: if a parameter has no unit or no usable name, `kind` is taken, a method takes or
        gives something else than a law's does, or JAX cannot trace it.

    Examples
    --------
    >>> import jax.numpy as jnp, jfsm
    >>> class TanhSpring(jfsm.AbstractTerm):
    ...     '''A spring that saturates smoothly, force F·tanh(d/s).'''
    ...     family, label, sign = "stiffness", "a smoothly saturating spring", 1
    ...     parameters = (
    ...         jfsm.Parameter("F", unit="N", meaning="largest force"),
    ...         jfsm.Parameter("s", unit="m", meaning="displacement at which it turns over"),
    ...     )
    ...     def force(self, d, w, z, t):
    ...         return self.F * jnp.tanh(d / self.s)
    >>> model = jfsm.Structure.sdof(1.0, 100.0, 0.5) + TanhSpring(2.0, 0.01, at=(0, 1))
    """

    at: eqx.AbstractVar[tuple[int, int]]
    kind: ClassVar[str]
    """First part of the path of its parameters, ``coulomb`` in ``coulomb@0-1.F``, and its name in a model file; by
    default the class's own name in small letters, ``tanh_spring``."""
    family: ClassVar[str] = ""
    """What it counts as where a diagnosis looks for it: ``"stiffness"``, ``"damping"``, ``"memory"``, ``"time"`` or
    ``"input"``. Friction, laws with hidden states and those of the time need not say it."""
    label: ClassVar[str] = ""
    """What a verdict calls it, ``"a cubic hardening spring"``; by default its kind."""
    classes: ClassVar[tuple[str, ...]] = ()
    """Classes of laws that it belongs to by what it is, ``("dry friction",)``. Those of springs and dampers without a
    memory come from the curve of their force."""
    sign: ClassVar[int] = 0
    """Sign of its first parameter where it is a cause; 0 where it may have either."""
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
    takes: ClassVar[str] = ""
    """The number that is inertia of the place itself, of a law behind which part of it moves; the place keeps the
    rest."""
    base: ClassVar[tuple[float, ...]] = ()
    """Share of the base's acceleration that each hidden state loses: 1 for the velocity of a mass of its own."""

    def __init_subclass__(cls, **options: Any):
        super().__init_subclass__(**options)
        completed(cls)

    def __repr__(self) -> str:
        return part_text(self)

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
