"""What a curve of force does beyond a straight line."""

import numpy as np

_BENT = 0.05
"""Share of a part's power that a cube must hold beside a straight line for its growth to be told."""


def bent(axis: np.ndarray, odd: np.ndarray, even: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Odd and even part of a curve without its straight line and its constant."""
    return odd - axis * (axis @ odd) / (axis @ axis), even - np.mean(even)


def growth(axis: np.ndarray, odd: np.ndarray) -> int:
    """Sign of the cube in an odd curve without its straight line, where it holds a share of it."""
    cube = axis**3 - axis * (axis @ axis**3) / (axis @ axis)
    held = float(cube @ odd) / max(np.linalg.norm(cube) * np.linalg.norm(odd), np.finfo(float).tiny)
    return int(np.sign(held)) if held**2 > _BENT else 0
