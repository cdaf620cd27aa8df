"""A quick sketch of a plant's motion, good for choosing the size of an effect."""

from typing import Any

import numpy as np

from .arrays import FloatArray
from .drives import Drive
from .laws import Law
from .laws.base import Hidden
from .plants import EscapeError, Motion, Plant, State


def sketch(plant: Plant, law: Law, drive: Drive, start: State, time: FloatArray, limit: float = np.inf) -> Motion:
    """The motion of m x'' + c x' + k x + law = g by one Runge-Kutta step a sample, blind to the ends of modes.

    A per cent of error at a tenth of the price of the exact motion; the law may be replaced by its twin.

    Raises
    ------
    EscapeError
        If abs(x) passes the law's reach or `limit` [m].
    """
    law = law.twin
    m, k, c, dt = plant.mass, plant.stiffness, plant.damping, float(time[1] - time[0])
    times = time.tolist()
    whole = drive(np.append(time, time[-1] + dt)).tolist()
    half = drive(time + 0.5 * dt).tolist()
    reach = min(law.reach(k), limit)
    force, hidden_rates, first_mode, confined = law.force, law.hidden_rates, law.first_mode, law.confined
    delay, past = law.delay / dt, []

    def late(steps: float) -> tuple[float, ...]:
        """What a law with a delay remembers at so many steps from the start: x, between or beyond the points so far."""
        if not delay:
            return ()
        at = min(max(steps - delay, 0.0), len(past) - 1.0)
        i = int(at)
        return (past[i] if i + 1 == len(past) else past[i] + (at - i) * (past[i + 1] - past[i]),)

    def rates(t: float, g: float, x: float, v: float, z: Hidden) -> tuple[float, Hidden]:
        load = g - c * v - k * x
        mode = first_mode(x, v, z, t, load)
        return (load - force(x, v, z, t, load, mode)) / m, hidden_rates(x, v, z, mode)

    def moved(z: tuple[Any, ...], h: float, rate: Hidden) -> tuple[Any, ...]:
        return tuple(confined(tuple(a + h * b for a, b in zip(z, rate, strict=True)))) if z else z

    x, v = start
    z = tuple(law.hidden_start(x, v))
    rows = []
    for i in range(time.size):
        t, middle, end = times[i], times[i] + 0.5 * dt, times[i] + dt
        if delay:
            past.append(x)
        late1, late2, late4 = late(i), late(i + 0.5), late(i + 1.0)
        a1, r1 = rates(t, whole[i], x, v, z + late1)
        rows.append((x, v, a1, *z, *late1))
        v2 = v + 0.5 * dt * a1
        a2, r2 = rates(middle, half[i], x + 0.5 * dt * v, v2, moved(z, 0.5 * dt, r1) + late2)
        v3 = v + 0.5 * dt * a2
        a3, r3 = rates(middle, half[i], x + 0.5 * dt * v2, v3, moved(z, 0.5 * dt, r2) + late2)
        v4 = v + dt * a3
        a4, r4 = rates(end, whole[i + 1], x + dt * v3, v4, moved(z, dt, r3) + late4)
        x += dt / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4)
        v += dt / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
        if z:
            z = moved(z, dt / 6.0, tuple(p + 2.0 * q + 2.0 * r + s for p, q, r, s in zip(r1, r2, r3, r4, strict=True)))
        if not abs(x) <= reach:
            raise EscapeError("the sketched motion passes the law's reach")
    xs, vs, accelerations, *hidden = np.array(rows).T
    effect = np.array(whole[:-1]) - c * vs - k * xs - m * accelerations
    return Motion(time, xs, vs, accelerations, effect, np.empty(0), tuple(hidden))
