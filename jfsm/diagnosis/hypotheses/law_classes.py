"""Classes of laws: what a record tells of a cause even where it does not tell which law it is.

A real part obeys no entry of the catalogue exactly, so its class is often the most that can be said. Classes overlap:
dry friction has laws of two families, a stop is a hardening spring as well. Of springs and dampers a class is what the
force does beyond a straight line over the motion that was measured, whatever the law is called.
"""

from collections.abc import Iterable, Sequence

import numpy as np

from ...plant import force_at
from ...structures import AbstractSensor, AbstractTerm, BoucWen, Cause, FreePlay, LinearDamping, LinearStiffness
from ...structures.law_classes import (
    AMPLITUDE as AMPLITUDE,
)
from ...structures.law_classes import (
    CHANGE as CHANGE,
)
from ...structures.law_classes import (
    CHANGING_STIFFNESS as CHANGING_STIFFNESS,
)
from ...structures.law_classes import (
    DAMPING as DAMPING,
)
from ...structures.law_classes import (
    DELAY as DELAY,
)
from ...structures.law_classes import (
    DRIVE as DRIVE,
)
from ...structures.law_classes import (
    FASTER as FASTER,
)
from ...structures.law_classes import (
    FRICTION as FRICTION,
)
from ...structures.law_classes import (
    HARDENING as HARDENING,
)
from ...structures.law_classes import (
    HYSTERESIS as HYSTERESIS,
)
from ...structures.law_classes import (
    LINK as LINK,
)
from ...structures.law_classes import (
    LOAD as LOAD,
)
from ...structures.law_classes import (
    MEMORY as MEMORY,
)
from ...structures.law_classes import (
    NARROWEST_FIRST as NARROWEST_FIRST,
)
from ...structures.law_classes import (
    PLAY as PLAY,
)
from ...structures.law_classes import (
    RIPPLE as RIPPLE,
)
from ...structures.law_classes import (
    SENSOR as SENSOR,
)
from ...structures.law_classes import (
    SOFTENING as SOFTENING,
)
from ...structures.law_classes import (
    SPRING as SPRING,
)
from ...structures.law_classes import (
    TWO_SIDED as TWO_SIDED,
)
from ...structures.law_classes import (
    TWO_WAYS as TWO_WAYS,
)
from ..thresholds import THRESHOLDS
from .curves import bent, growth

_POINTS = 41
"""Points along displacement and velocity at which a law is looked at."""

_WIDEST = {
    "stiffness": SPRING,
    "damping": DAMPING,
    "memory": MEMORY,
    "time": CHANGE,
    "input": LOAD,
    "drive": DRIVE,
    "sensor": SENSOR,
}
"""The class of all laws of a family."""
_BY_LAW = {
    "dead_zone": (PLAY,),
    "end_stop": (PLAY,),
    "coulomb_asymmetric": (TWO_WAYS,),
    "jenkins": (FRICTION, HYSTERESIS, DAMPING),
    "lugre": (FRICTION, DAMPING),
    "free_play": (FRICTION, HYSTERESIS, PLAY, DAMPING),
    "bouc_wen": (HYSTERESIS,),
    "van_der_pol": (AMPLITUDE,),
    "position_damping": (AMPLITUDE,),
    "stiffness_drift": (CHANGING_STIFFNESS,),
    "stiffness_drop": (CHANGING_STIFFNESS,),
    "parametric_stiffness": (CHANGING_STIFFNESS,),
    "force_delay": (DELAY,),
    "channel_delay": (DELAY,),
}
"""Classes that a law has by what it is, whatever its numbers."""
_BY_BEND = {
    "displacement": {1: (HARDENING,), -1: (SOFTENING,), 0: ()},
    "velocity": {1: (FASTER, AMPLITUDE), -1: (FRICTION,), 0: ()},
}
_BY_ASYMMETRY = {"displacement": (TWO_SIDED,), "velocity": (TWO_WAYS,)}


def classes_of(cause: Cause, part: AbstractTerm | AbstractSensor, peak: float, speed: float) -> tuple[str, ...]:
    """The classes of a law or a sensor's fault, the narrowest first, for motions up to `peak` and `speed`."""
    if cause.effect in (LinearStiffness, LinearDamping):
        return (LINK,)
    found = {_WIDEST[cause.family], *_BY_LAW.get(cause.id, ()), *getattr(cause.effect, "classes", ())}
    if cause.family in ("stiffness", "damping") and isinstance(part, AbstractTerm) and RIPPLE not in found:
        found.update(_by_curve(part, peak, speed))
    if isinstance(part, BoucWen) and part.beta + part.gamma > 0:  # its force ends at a largest value, as friction does
        found.update((FRICTION, DAMPING))
    if isinstance(part, FreePlay):
        found -= _unseen_of_play(part, peak)
    return in_order(found)


def _unseen_of_play(part: FreePlay, peak: float) -> set[str]:
    """The classes of a slider behind a gap that a motion does not show: play where the gap is next to nothing of it,
    friction where the slider stays."""
    unseen = {PLAY} if part.gap < THRESHOLDS.negligible * peak else set[str]()
    if part.k * (peak - part.gap) <= min(part.F_plus, part.F_minus):
        unseen |= {FRICTION, HYSTERESIS, DAMPING}
    return unseen


def in_order(classes: Iterable[str]) -> tuple[str, ...]:
    """Classes, the narrowest first."""
    return tuple(sorted(set(classes), key=NARROWEST_FIRST.index))


def _by_curve(part: AbstractTerm, peak: float, speed: float) -> Sequence[str]:
    """The classes that the curve of a force without memory has beyond a straight line."""
    u = np.linspace(-1.0, 1.0, _POINTS)
    d, w = (a.ravel() for a in np.meshgrid(peak * u, speed * u, indexing="ij"))
    along = {"displacement": force_at(part, peak * u, 0 * u), "velocity": force_at(part, 0 * u, speed * u)}
    over = force_at(part, d, w).reshape(_POINTS, _POINTS)
    mixed = over - along["displacement"][:, None] - along["velocity"][None, :] + over[_POINTS // 2, _POINTS // 2]
    parts = {name: bent(u, *_odd_and_even(values)) for name, values in along.items()}
    power = {name: float(np.var(odd) + np.var(even)) for name, (odd, even) in parts.items()}
    leading = max(power, key=lambda name: power[name])
    if np.var(mixed) > power[leading]:
        return ()
    odd, even = parts[leading]
    return _BY_ASYMMETRY[leading] if np.var(even) > np.var(odd) else _BY_BEND[leading][growth(u, odd)]


def _odd_and_even(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return (values - values[::-1]) / 2, (values + values[::-1]) / 2
