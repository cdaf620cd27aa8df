"""What becomes of a law where its class is defined: fields from its parameters, and refusals in words."""

import inspect
import keyword
import re
from collections.abc import Iterator, Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp

from .._types import as_scalar
from ._parameter import Parameter, as_link
from .law_classes import NARROWEST_FIRST

FAMILIES = ("stiffness", "damping", "memory", "time", "input")
"""Chapters of the catalogue that a law may belong to."""

_LAWS: dict[str, Any] = {}
"""Every law by its kind, the newest definition of one of the user's."""
_ARGUMENTS = {
    "force": ("d", "w", "z", "t"), "limits": ("d", "w", "z", "t"), "state_rate": ("d", "w", "z", "t"),
    "initial_state": ("d", "w"), "settle": ("d", "z"),
}  # fmt: skip
"""What the methods of a law are given."""


def own_laws() -> Mapping[str, Any]:
    """The laws that were defined outside jfsm, by kind."""
    return {kind: law for kind, law in _LAWS.items() if _is_own(law)}


def completed(cls: Any) -> None:
    """Give a law that lists its parameters and writes no fields a field for each, and one for its place."""
    if "parameters" not in vars(cls):
        return
    cls.parameters = tuple(cls.parameters) if isinstance(cls.parameters, list) else cls.parameters
    if "kind" not in vars(cls):
        cls.kind = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", cls.__name__).lower()
    if not _is_own(cls):
        return
    _check_parameters(cls)
    if vars(cls).get("__annotations__"):
        return
    cls.__annotations__ = {p.name: Any for p in cls.parameters} | {"at": tuple[int, int]}
    for parameter in cls.parameters:
        setattr(cls, parameter.name, eqx.field(converter=as_scalar))
    cls.at = eqx.field(converter=as_link, static=True, kw_only=True)


def checked(cls: Any) -> None:
    """Register a law; refuse one of the user's whose methods cannot be used.

    Raises
    ------
    TypeError, ValueError
        If it lists no parameters, its kind is another law's, a method takes or gives something else than a law's does,
        or JAX cannot trace it.
    """
    if cls.__abstractmethods__:
        return
    if _is_own(cls):
        if not hasattr(cls, "parameters"):
            raise TypeError(
                f"`parameters` of {cls.__name__} must list its numbers, as "
                'parameters = (jfsm.Parameter("F", unit="N", meaning="friction force"),).'
            )
        _check_traits(cls)
        for look in (_unlike_arguments, _unlike_shapes):
            for problem in look(cls):
                raise problem
    _LAWS[cls.kind] = cls


def _is_own(cls: type) -> bool:
    return cls.__module__.partition(".")[0] != "jfsm"


def _check_parameters(cls: Any) -> None:
    """Refuse numbers that are none, have no name that can be written, or no unit."""
    if not isinstance(cls.parameters, tuple) or not all(isinstance(p, Parameter) for p in cls.parameters):
        raise TypeError(
            f"`parameters` of {cls.__name__} must be a tuple of jfsm.Parameter; got {cls.parameters!r}. A tuple of "
            "one ends in a comma."
        )
    names = [p.name for p in cls.parameters]
    taken = {"at"}.union(vars(cls), *(vars(base) for base in cls.__mro__[1:]))
    for name in names:
        if not name.isidentifier() or keyword.iskeyword(name) or name in taken or names.count(name) > 1:
            raise ValueError(
                f"`parameters` of {cls.__name__} must have names of their own that can be written in Python and do not "
                f"mean anything else in a law; got {name!r}."
            )
    bare = [p.name for p in cls.parameters if not p.has_unit]
    if bare:
        raise ValueError(
            f'`{bare[0]}` of {cls.__name__} has no unit; write jfsm.Parameter("{bare[0]}", unit="N/m"), or unit="1" '
            "where it is a plain number."
        )


def _check_traits(cls: Any) -> None:
    """Refuse a kind that is taken or cannot be written, and traits that nothing knows."""
    name, before = cls.__name__, _LAWS.get(cls.kind)
    if not re.fullmatch(r"[a-z][a-z0-9_]*", cls.kind):
        raise ValueError(f"`kind` of {name} must be small letters, digits and _, as tanh_spring; got {cls.kind!r}.")
    if before is not None and before.__name__ != name or before is not None and not _is_own(before):
        raise ValueError(f"`kind` of {name} must be its own; {cls.kind!r} is that of {before.__name__}.")
    if cls.family and cls.family not in FAMILIES:
        raise ValueError(f"`family` of {name} must be one of {', '.join(FAMILIES)}; got {cls.family!r}.")
    if cls.sign not in (-1, 0, 1):
        raise ValueError(f"`sign` of {name} must be +1, -1, or 0 where both signs are one cause; got {cls.sign!r}.")
    unknown = [each for each in cls.classes if each not in NARROWEST_FIRST]
    if unknown:
        raise ValueError(
            f"`classes` of {name} must be names of classes in a tuple; got {unknown[0]!r}. They are: "
            f"{'; '.join(NARROWEST_FIRST)}."
        )
    missing = [p.name for p in cls.parameters if p.name not in cls.__dataclass_fields__]
    if missing:
        raise ValueError(
            f"`{missing[0]}` of {name} must be a field, as its other numbers are; leave all fields out, and they are "
            "made from `parameters`."
        )


def _unlike_arguments(cls: Any) -> Iterator[Exception]:
    """What is wrong with the arguments of its methods."""
    for method, names in _ARGUMENTS.items():
        found = getattr(cls, method, None)
        if found is None:
            continue
        try:
            inspect.signature(found).bind(None, *names)
        except TypeError:
            yield TypeError(
                f"`{method}` of {cls.__name__} must take (self, {', '.join(names)}); it takes "
                f"{inspect.signature(found)}."
            )


def _unlike_shapes(cls: Any) -> Iterator[Exception]:
    """What is wrong with the shapes that its methods give."""
    try:
        found = jax.eval_shape(lambda numbers: _answers(cls, numbers), (jnp.ones(()),) * len(cls.parameters))
    except jax.errors.JAXTypeError as error:
        yield TypeError(
            f"{cls.__name__} must be written with jax.numpy, with jnp.where in place of `if`, for JAX to trace it. "
            f"JAX says: {str(error).splitlines()[0]}"
        )
        return
    for method, answer in found.items():
        expected = (cls.states,) if method in ("state_rate", "initial_state", "settle") else ()
        shapes = [leaf.shape for leaf in jax.tree.leaves(answer)]
        if shapes != [expected] * (2 if method == "limits" else 1):
            yield ValueError(
                f"`{method}` of {cls.__name__} must give {_what(method, expected)}; it gives shape "
                f"{', '.join(map(str, shapes)) or 'nothing'}."
            )


def _what(method: str, expected: tuple[int, ...]) -> str:
    if method == "limits":
        return "two numbers, the force while sliding backward and while sliding forward"
    return f"its {expected[0]} hidden states, shape {expected}" if expected else "one number, the force"


def _answers(cls: Any, numbers: Any) -> dict[str, Any]:
    """What the methods of a law give at some state."""
    law, one = object.__new__(cls), jnp.ones(())
    for parameter, number in zip(cls.parameters, numbers, strict=True):
        object.__setattr__(law, parameter.name, number)
    object.__setattr__(law, "at", (0, 1))
    z = law.initial_state(one, one)
    found = {"initial_state": z, "force": law.force(one, one, jnp.zeros(cls.states), one)}
    if hasattr(law, "limits"):
        found["limits"] = law.limits(one, one, jnp.zeros(cls.states), one)
    if cls.states:
        found["state_rate"] = law.state_rate(one, one, jnp.zeros(cls.states), one)
        found["settle"] = law.settle(one, jnp.zeros(cls.states))
    return found
