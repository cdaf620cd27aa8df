"""Lengths and speeds that the numbers of a structure make."""

from itertools import permutations

import numpy as np

from ..structures import MapTerm, Parameter, Structure
from ..surrogates import AbstractForceStateMap, HermiteTable


def scales(model: Structure, load: np.ndarray, *, time: int = 0) -> np.ndarray:
    """Every length (`time` 0) or speed (`time` -1) that two numbers of the terms make, ascending.

    Two numbers whose units differ by the n-th power of a length make one, the n-th root of their ratio: k/k3 the
    displacement at which a cubic spring matches a linear one, F/k a static deflection. A length itself counts, and
    so does the box of a learned map. A constant force in `load` is one of the numbers.
    """
    numbers = [(Parameter("unity"), 1.0)]
    numbers += [(Parameter("load", force=1), float(f)) for f in load]
    found = []
    for term in model.terms:
        pairs = zip(term.parameters, term.values, strict=True)
        # An exponent measures nothing, nor does what has one in its unit.
        numbers += [(p, float(v)) for p, v in pairs if (p.force or p.length or p.time) and not p.exponent]
        if isinstance(term, MapTerm) and (box := _box(term.force_map)) is not None:
            found.append(np.max(np.abs(box[:, -time])))
    for (p, a), (q, b) in permutations(numbers, 2):
        power = p.length - q.length
        if a * b != 0 and power > 0 and p.force == q.force and p.time - q.time == time * power:
            found.append(abs(a / b) ** (1.0 / power))
    return np.unique(found)


def _box(force_map) -> np.ndarray | None:
    if isinstance(force_map, HermiteTable):
        return np.asarray(force_map.lower + np.array([[0.0], [force_map.jets.shape[1] - 1.0]]) * force_map.step)
    return np.asarray(force_map.box) if isinstance(force_map, AbstractForceStateMap) else None


def spread(count: int, dim: int) -> np.ndarray:
    """Points (count, dim) that fill the cube [-1, 1]^dim evenly, the same in every run; the centre comes first.

    Additive recurrence by the generalised golden ratio: M. Roberts, "The unreasonable effectiveness of quasirandom
    sequences" (2018).
    """
    ratio = 2.0
    for _ in range(64):
        ratio = (1.0 + ratio) ** (1.0 / (dim + 1))
    steps = ratio ** -np.arange(1.0, dim + 1)
    return 2.0 * ((0.5 + np.arange(count)[:, None] * steps[None, :]) % 1.0) - 1.0
