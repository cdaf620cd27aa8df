"""Values as JSON has them."""

import math
from typing import Any

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


def _built_in(value: Any) -> Any:
    """A dataclass or a named tuple as a dictionary, an array as a list, a NumPy number as a number."""
    if hasattr(value, "__dataclass_fields__"):
        return {name: getattr(value, name) for name in value.__dataclass_fields__}
    if hasattr(value, "_asdict"):
        return value._asdict()
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return value
