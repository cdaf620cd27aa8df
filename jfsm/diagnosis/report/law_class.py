"""What class a law belongs to: what a record tells even where it does not tell the law."""

import numpy as np

from ...plant import force_at
from ...structures import AbstractSensor, AbstractTerm, Cause
from .force_shape import bent, growth

_POINTS = 41
"""Points along displacement and velocity at which a law is looked at."""
_OF_FAMILY = {
    "memory": "a force with memory",
    "time": "a change with time",
    "input": "an unmeasured force",
    "sensor": "a sensor's fault",
}
WIDER = {"stiffness": "nonlinear stiffness", "damping": "nonlinear damping"}
"""What is said of a family's laws where none of its classes is likely by itself."""
_GROWING = {
    "displacement": {1: "hardening stiffness", -1: "softening stiffness", 0: WIDER["stiffness"]},
    "velocity": {1: "damping that grows with speed", -1: "friction", 0: WIDER["damping"]},
}
_EVEN = {"displacement": "asymmetric stiffness", "velocity": "asymmetric damping"}
_BOTH = "damping that changes with displacement"


def class_of(cause: Cause, part: AbstractTerm | AbstractSensor, peak: float = 1.0, speed: float = 1.0) -> str:
    """The class of a law or a sensor's fault in words, for motions up to `peak` and `speed`.

    Of springs and dampers it is what the force does beyond a straight line: one that narrow-band motion does not tell
    from others of its class by more than its details.
    """
    if cause.family in _OF_FAMILY or not isinstance(part, AbstractTerm):
        return _OF_FAMILY.get(cause.family, _OF_FAMILY["sensor"])
    u = np.linspace(-1.0, 1.0, _POINTS)
    d, w = (a.ravel() for a in np.meshgrid(peak * u, speed * u, indexing="ij"))
    along = {"displacement": force_at(part, peak * u, 0 * u), "velocity": force_at(part, 0 * u, speed * u)}
    over = force_at(part, d, w).reshape(_POINTS, _POINTS)
    mixed = over - along["displacement"][:, None] - along["velocity"][None, :] + over[_POINTS // 2, _POINTS // 2]
    parts = {name: bent(u, *_odd_and_even(values)) for name, values in along.items()}
    power = {name: float(np.var(odd) + np.var(even)) for name, (odd, even) in parts.items()}
    leading = max(power, key=lambda name: power[name])
    if np.var(mixed) > power[leading]:
        return _BOTH
    odd, even = parts[leading]
    return _EVEN[leading] if np.var(even) > np.var(odd) else _GROWING[leading][growth(u, odd)]


def _odd_and_even(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return (values - values[::-1]) / 2, (values + values[::-1]) / 2
