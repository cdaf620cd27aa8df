"""How calls of jfsm are held to the shapes in their annotations while the tests run."""

import inspect
from collections.abc import Callable
from typing import Any, get_args, get_origin

import numpy as np
from beartype import BeartypeConf, FrozenDict, beartype
from jaxtyping import AbstractArray

CHECKED = ("jfsm.surrogates", "jfsm.plant", "jfsm.dynamics", "jfsm.estimation", "jfsm.identification")
"""Rooms whose calls are checked."""

_NUMBERS = BeartypeConf(
    hint_overrides=FrozenDict({int: int | np.integer, float: float | int | np.floating | np.integer})
)
"""Beside shapes, numbers of NumPy pass for those of Python, and an int for a float."""


def has_shape(hint: Any) -> bool:
    """Whether an annotation tells the shape of an array; those of a function that is passed show in no call of ours."""
    if get_origin(hint) is Callable:
        return False
    return inspect.isclass(hint) and issubclass(hint, AbstractArray) or any(map(has_shape, get_args(hint)))


def checked(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, whose arrays must have the shapes that their annotations tell.

    Of other annotations the type checker takes care, and of other arguments the library, with words of its own.
    """
    hints = {name: hint for name, hint in function.__annotations__.items() if has_shape(hint)}
    if not hints:
        return function
    function.__annotations__ = hints
    return beartype(conf=_NUMBERS)(function)
