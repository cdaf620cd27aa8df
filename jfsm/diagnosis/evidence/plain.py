"""Values as JSON has them."""

import math
from typing import Any

import numpy as np


def as_plain(value: Any, *, lossless: bool = True) -> Any:
    """Dataclasses, named tuples, tuples, arrays and NumPy numbers as plain types.

    Numbers without bounds, which JSON does not have, are their names, from which `float` makes them again; None if it
    need not be `lossless`.
    """

    def plain(each: Any) -> Any:
        return as_plain(each, lossless=lossless)

    if hasattr(value, "__dataclass_fields__"):
        return {name: plain(getattr(value, name)) for name in value.__dataclass_fields__}
    if hasattr(value, "_asdict"):
        return plain(value._asdict())
    if isinstance(value, dict):
        return {name: plain(each) for name, each in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [plain(each) for each in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return str(value) if lossless else None
    return value
