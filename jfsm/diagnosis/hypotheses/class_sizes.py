"""How large a law is along a motion, by what the laws of its class have in common."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from ...plant import forces_of_law
from ...structures import AbstractTerm
from .law_classes import AMPLITUDE, DAMPING, FASTER, FRICTION, HARDENING, PLAY, SOFTENING, TWO_WAYS


class _Measure(NamedTuple):
    """A size of a force along a motion, in the units of force, displacement and time."""

    of: Callable[[np.ndarray, np.ndarray, np.ndarray], float]
    unit: Callable[[Mapping[Any, str]], str]


def _mean_power_by_speed(force: np.ndarray, d: np.ndarray, w: np.ndarray) -> float:
    return float(force @ w / np.sum(np.abs(w)))


def _equivalent_damping(force: np.ndarray, d: np.ndarray, w: np.ndarray) -> float:
    return float(force @ w / (w @ w))


def _equivalent_stiffness(force: np.ndarray, d: np.ndarray, w: np.ndarray) -> float:
    about = d - np.mean(d)
    return float(force @ about / (about @ about))


def _rms(force: np.ndarray, d: np.ndarray, w: np.ndarray) -> float:
    return float(np.sqrt(np.mean(force**2)))


_GAINED = _Measure(_equivalent_stiffness, lambda units: f"{units['force']}/{units['displacement']}")
_FORCE = _Measure(_rms, lambda units: units["force"])
_OF_CLASS: Mapping[str, _Measure] = {
    FRICTION: _Measure(_mean_power_by_speed, lambda units: units["force"]),
    **dict.fromkeys(
        (FASTER, AMPLITUDE, DAMPING, TWO_WAYS),
        _Measure(_equivalent_damping, lambda units: f"{units['force']}*s/{units['displacement']}"),
    ),
    **dict.fromkeys((HARDENING, SOFTENING, PLAY), _GAINED),
}
"""Of friction the energy that it takes, by the way; of damping what it adds to a dashpot; of springs that grow harder
or softer the stiffness that they gain beyond that of small motions (least squares); of all others the rms of force."""
_AS_GOOD_AS_REST = 1e-4
"""Displacement that counts as a small motion, as a share of the largest."""


def size_unit(kind: str, units: Mapping[Any, str]) -> str:
    """Unit of the sizes of a class."""
    return _OF_CLASS.get(kind, _FORCE).unit(units)


def sizes_along(
    kind: str, law: type[AbstractTerm], rows: np.ndarray, d: np.ndarray, w: np.ndarray, dt: float
) -> np.ndarray:
    """Sizes (rows,) of a law of class `kind` with these rows of numbers, on a link of displacement `d` (n,) and
    velocity `w` (n,), `dt` seconds apart."""
    measure = _OF_CLASS.get(kind, _FORCE)
    forces = forces_of_law(law, rows, d, w, dt * np.arange(d.size))
    if measure is _GAINED and not law.states:
        forces = forces - _about_rest(law, rows, float(np.max(np.abs(d))))[:, None] * d
    return np.array([measure.of(force, d, w) for force in forces])


def _about_rest(law: type[AbstractTerm], rows: np.ndarray, peak: float) -> np.ndarray:
    """Stiffness (rows,) of small motions."""
    d = _AS_GOOD_AS_REST * peak * np.array([1.0, -1.0])
    force = forces_of_law(law, rows, d, np.zeros(2), np.arange(2.0))
    return (force[:, 0] - force[:, 1]) / (d[0] - d[1])
