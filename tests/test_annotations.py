"""Shapes in annotations: calls are held to them while the tests run, and what the rooms offer has them."""

import inspect
from collections.abc import Callable, Iterator
from importlib import import_module
from types import ModuleType
from typing import Any, get_args, get_origin

import jax
import numpy as np
import pytest
from checker import CHECKED
from jaxtyping import AbstractArray, ArrayLike, TypeCheckError

from jfsm import identification
from jfsm._result import Result


def functions(thing: Any) -> Iterator[tuple[str, Any]]:
    """A function, or the public methods and properties of a class, each with its name."""
    if not inspect.isclass(thing):
        yield thing.__name__, inspect.unwrap(thing)
        return
    for owner in thing.__mro__:
        if not owner.__module__.startswith("jfsm."):
            continue
        for name, member in vars(owner).items():
            for inside in ("__func__", "fget", "func", "method"):  # of a class method, properties, an equinox module
                member = getattr(member, inside, member)
            if inspect.isfunction(member) and (name == "__call__" or not name.startswith("_")):
                yield f"{owner.__name__}.{name}", inspect.unwrap(member)


def without_shape(hint: Any) -> bool:
    """Whether an array stands in an annotation by itself; not so in what takes anything and says what is wrong."""
    if inspect.isclass(hint) and issubclass(hint, AbstractArray) or get_origin(hint) is Callable:
        return False
    if set(get_args(ArrayLike)) <= set(get_args(hint)):
        return False
    return hint in (np.ndarray, jax.Array) or get_origin(hint) is np.ndarray or any(map(without_shape, get_args(hint)))


def offered(room: ModuleType) -> Iterator[Any]:
    """Public functions and classes of a room."""
    for name, thing in vars(room).items():
        if not name.startswith("_") and callable(thing) and getattr(thing, "__module__", "").startswith(room.__name__):
            yield thing


def shapeless(thing: Any) -> Iterator[str]:
    """What of a function or class has an array without a shape, or no annotation."""
    for owner in thing.__mro__ if inspect.isclass(thing) else ():
        if owner.__module__.startswith("jfsm."):
            hints = inspect.get_annotations(owner)
            yield from (f"{owner.__name__}.{name}" for name, hint in hints.items() if without_shape(hint))
    for name, function in functions(thing):
        hints = inspect.get_annotations(function)
        for argument in [*inspect.signature(function).parameters, "return"]:
            if without_shape(hints.get(argument)) or argument not in (*hints, "self", "cls"):
                yield f"{name}: {argument}"


def test_a_call_with_a_wrong_number_of_axes_is_refused():
    with pytest.raises(TypeCheckError, match="unknowns"):
        identification.prior((), np.zeros((2, 2)))


def test_a_part_whose_axis_has_another_length_than_the_same_axis_elsewhere_is_refused():
    with pytest.raises(TypeCheckError, match="lanes unknowns"):
        identification.Maximum(np.zeros(2), np.zeros((3, 1)), np.zeros((3, 1, 1)), (Result.successful,))


@pytest.mark.parametrize("room", CHECKED)
def test_every_array_that_a_room_takes_or_gives_has_a_shape(room):
    found = sorted({line for thing in offered(import_module(room)) for line in shapeless(thing)})
    assert not found, "\n".join(found)


def test_an_array_without_a_shape_is_seen():
    class Offered:
        values: np.ndarray | None

        def method(self, fine: Any, plain) -> tuple[float, jax.Array]: ...

        def silent(self): ...

    assert list(shapeless(type("Offered", (Offered,), {"__module__": "elsewhere"}))) == []
    Offered.__module__ = "jfsm.here"
    found = list(shapeless(Offered))
    assert found == ["Offered.values", "Offered.method: plain", "Offered.method: return", "Offered.silent: return"]
