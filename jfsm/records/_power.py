"""The mean power of a force along a motion that is imposed: a passive part takes energy."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jfsm.records._abstract_record import AbstractRecord

Samples = NDArray[np.float64]

FEWEST_CYCLES = 4
ERRORS = 5.0  # standard errors that a mean power must be below zero by
ELASTIC = 0.1  # share of the force that a spring with the right sign takes, from which the force is not inverted


class Power(NamedTuple):
    """Mean power of a force [unit of force times m/s] and its standard error; `elastic` is the share of the force that
    a positive spring explains, negative for a negative one."""

    mean: float
    error: float
    elastic: float

    @property
    def is_negative(self) -> bool:
        """Whether it is below zero by more than chance, and no spring says that the sign is right."""
        return self.mean < -ERRORS * self.error and self.elastic < ELASTIC


def mean_power(record: AbstractRecord, dof: int) -> Power | None:
    """The mean power of the force on a degree of freedom, from cycle to cycle of its motion; None where too few are
    whole, or its velocity or displacement was not measured.

    Over a cycle what a spring and a mass have stored comes back, so that its work is what was lost.
    """
    force = record.channels.get(("force", dof))
    x, v = (record.channels.get((kind, dof)) for kind in ("displacement", "velocity"))
    if force is None or (x is None and v is None):
        return None
    dt = float(np.median(np.diff(record.time)))
    speed = np.gradient(x, dt) if v is None and x is not None else np.asarray(v)
    place = np.cumsum(speed - speed.mean()) * dt if x is None else x
    edges = _cycles(place)
    if edges.size <= FEWEST_CYCLES:
        return None
    whole = slice(edges[0], edges[-1])
    force = force - force[whole].mean()
    speed = speed - speed[whole].mean()
    work = np.add.reduceat((force * speed)[whole], edges[:-1] - edges[0]) * dt
    times = np.diff(edges) * dt
    mean = float(work.sum() / times.sum())
    scatter = work - mean * times
    error = float(np.sqrt(np.sum(scatter**2) * work.size / (work.size - 1)) / times.sum())
    columns = np.stack([place[whole] - place[whole].mean(), speed[whole]], 1)
    spring = float(np.linalg.lstsq(columns, force[whole], rcond=None)[0][0])
    size = float(np.std(force[whole]))
    return Power(mean, error, spring * float(np.std(place[whole])) / size if size > 0 else 0.0)


def _cycles(y: Samples) -> NDArray[np.int64]:
    """Samples at which a motion begins a cycle: upwards through its mean, once it was well below."""
    y = y - y.mean()
    band, below, edges = 0.3 * y.std(), False, []
    for i in np.flatnonzero(np.diff(np.sign(y)) != 0) + 1:
        start = edges[-1] if edges else 0
        below = below or bool(y[start:i].min(initial=0.0) < -band)
        if y[i] > 0 and below:
            edges.append(int(i))
            below = False
    return np.array(edges, dtype=np.int64)
