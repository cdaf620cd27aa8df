"""Values as JSON has them, and back, without loss."""

import math
from typing import Any

import numpy as np


def as_plain(value: Any) -> Any:
    """Dataclasses, named tuples, tuples and NumPy numbers as plain types; numbers without bounds as their names."""
    if hasattr(value, "__dataclass_fields__"):
        return {name: as_plain(getattr(value, name)) for name in value.__dataclass_fields__}
    if hasattr(value, "_asdict"):
        return as_plain(value._asdict())
    if isinstance(value, dict):
        return {name: as_plain(each) for name, each in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [as_plain(each) for each in value]
    if isinstance(value, bool | np.bool_):
        return bool(value)
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else str(float(value))
    return int(value) if isinstance(value, np.integer) else value


def number(written: float | str) -> float:
    """A number that `as_plain` wrote."""
    return float(written)
