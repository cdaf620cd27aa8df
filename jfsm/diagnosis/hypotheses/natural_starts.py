"""Structures with an effect of a natural size, from which a fit begins where nothing tells a better one."""

from itertools import product

from ...identification import Nuisances, natural_size, scale_of
from ...structures import Cause, Structure
from .candidate import Candidate

_START, _START_AT_PEAK = 0.1, 0.3
"""First guess of an effect as a share of the elastic force, in the mean and at the largest displacement.

A softening spring that outweighs the elastic one at a peak would let the motion run away from the start.
"""
_START_LATE = 0.5
"""Second guess of a delay, in radians of the motion."""
_MODEST = 0.02
"""Size of an effect that nothing speaks for, as a share of the elastic force."""


def natural_starts(model: Structure, cause: Cause, at: tuple, nuisances: Nuisances) -> tuple[Structure, ...]:
    """The model with the effect at natural sizes, of either sign where the cause has both."""
    structures = []
    parameter = cause.effect.parameters[0]
    # A law of degree n in the displacement weighs crest^(n - 1) times more at the largest displacement.
    degree = 1 if parameter.time else -parameter.length
    share = min(_START, _START_AT_PEAK / nuisances.crest ** max(degree - 1, 0))
    # The basin of a delay is no wider than a part of a period.
    shares = (share, _START_LATE) if cause.is_sensor and parameter.time == 1 else (share,)
    for sign, size in product((cause.sign,) if cause.sign else (1, -1), shares):
        unit = cause.effect(**{p.name: float(sign) for p in cause.effect.parameters}, at=at)
        extended = model + unit
        path = next(p for p in extended.entries() if p not in model.entries())
        structures.append(extended.with_values({path: sign * size * natural_size(extended, path, nuisances)}))
    return tuple(structures)


def modest(candidate: Candidate, model: Structure, nuisances: Nuisances) -> Structure:
    """The model with a small effect of a natural shape."""
    [(cause, at)] = candidate.effects
    if cause.is_sensor:
        return candidate.starts[0]
    shapes = cause.effect.shapes(scale_of(nuisances, model))
    shape = shapes[len(shapes) // 2]
    size = {p.name: _MODEST * (cause.sign or 1) if p.force else 1.0 for p in cause.effect.parameters}
    return model + cause.effect(**{name: size[name] * value for name, value in shape.items()}, at=at)
