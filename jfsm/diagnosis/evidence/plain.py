"""Values as JSON has them."""

import math
from functools import partial
from types import UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np


def as_plain(value: Any, *, lossless: bool = True) -> Any:
    """Dataclasses, named tuples, tuples, arrays and NumPy numbers as plain types.

    Numbers without bounds, which JSON does not have, are their names, from which `float` makes them again; None if it
    need not be `lossless`.
    """
    value = _built_in(value)
    if isinstance(value, dict):
        return {name: as_plain(each, lossless=lossless) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [as_plain(each, lossless=lossless) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value) if lossless else None
    return value


def made_of(kind: Any, written: Any) -> Any:
    """What `as_plain` was made of: dataclasses and named tuples by their annotations, tuples, dictionaries, numbers.

    A number that JSON does not have, written as None, is not a number. Of a bare tuple, as a place is one, lists are
    tuples.
    """
    origin, inner = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):  # something or None
        return written if written is None else made_of(inner[0], written)
    if kind is float:
        return float("nan" if written is None else written)
    if kind is tuple:
        return _tuples(written)
    if origin is tuple:
        return tuple(map(partial(made_of, inner[0]), written))
    if origin is dict:
        return {name: made_of(inner[1], each) for name, each in written.items()}
    return _with_fields(kind, written) if isinstance(written, dict) else written


def _with_fields(kind: Any, written: dict[str, Any]) -> Any:
    kinds = get_type_hints(kind)
    return kind(**{name: made_of(kinds[name], each) for name, each in written.items() if name in kinds})


def _tuples(written: Any) -> Any:
    return tuple(map(_tuples, written)) if isinstance(written, list) else written


def _built_in(value: Any) -> Any:
    """A dataclass or a named tuple as a dictionary, an array as a list, a NumPy number as a number."""
    if hasattr(value, "__dataclass_fields__"):
        return {name: getattr(value, name) for name in value.__dataclass_fields__}
    if hasattr(value, "_asdict"):
        return value._asdict()
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return value
