"""The numbers that a fit may change, with what is known of each beforehand."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from ..plant import Imposed
from ..structures import AccelerationBias, Offset, Parameter, Preload, Structure
from ._nuisances import Nuisances

TRUST = {"stiffness": 0.02, "damping": 0.25, "mass": 0.01}
"""How far own values are off as a rule, where the owner does not say: masses are weighed, damping is guessed."""
_REACH = {"stiffness": math.log(5.0), "mass": math.log(5.0), "damping": math.log(50.0)}
"""Logarithm of the factor by which an own value may be off; beyond it another structure was measured,"""
_WIDTHS = 5.0
"""or so many times the logarithm of what it is trusted to."""
DEGREES = 1.5
"""Degrees of freedom of Student's law for own values: right to some per cent as a rule, but far off when wrong."""
DEGREES_BESIDE = 4.0
"""The same beside a cause that is named: a value that is far off as well would be a second fault."""
TYPICAL, TYPICAL_SPREAD = 0.15, 1.5
"""An effect's size as a share of the elastic force, and the spread of its logarithm."""
_SHAPE_SPREAD = 1.0
_UNUSUAL = math.log(100.0)
"""Nats that an unusual sign costs: filters and converters make a channel late, only the lateness of others early."""
_OFFSET, _SLIGHT = 0.02, 0.01
"""Offset of a channel, as a share of its spread: a nuisance, no more. Most sensors of a displacement are zeroed, others
are not at all; offsets of a force or an acceleration are slight, for a larger one is a cause: a constant force, or an
accelerometer's bias."""
_OFFSET_OF_ANSWER = 3.0
"""Doubt about the zero of a force that answers an imposed motion: a static load is part of it."""
_START_SPREAD = 3.0
"""Doubt about the initial state, in sizes of the motion: a model that lacks something may guess it badly."""
_SCALE_SPREAD, _SCALE_SPREAD_GUESSED = 0.5, 3.0


@dataclass(frozen=True)
class Unknown:
    """One number to be found: ``value = unit * exp(theta)`` if `log`, else ``unit * theta``.

    That is multiplied by ``exp(rate * exponent)`` where `tie` is the path of another number, its exponent, and a rate:
    the coefficient of a power law changes with the exponent as the power of a typical motion does, and theta does not.
    `center` and `width` describe theta beforehand: a normal law, or Student's law with so many `degrees` of freedom.
    `cost` is what is held against all its values, in nats. `record` is the record that it belongs to, None where all
    share it.
    """

    path: str
    theta: float
    unit: float
    log: bool
    center: float
    width: float
    degrees: float = math.inf
    record: int | None = None
    low: float = -math.inf
    high: float = math.inf
    tie: tuple[str, float] | None = None
    cost: float = 0.0

    def value(self, theta: float, exponent: float = 0.0) -> float:
        """The number itself; `exponent` is the value of the one that it is tied to."""
        scale = math.exp(self.tie[1] * exponent) if self.tie else 1.0
        return self.unit * scale * (math.exp(theta) if self.log else theta)

    def coordinate(self, value: float) -> float:
        """The theta of a number that is not tied."""
        return math.log(value / self.unit) if self.log else value / self.unit

    def slope(self, theta: float) -> float:
        """Derivative of the number by theta."""
        return self.unit * (math.exp(theta) if self.log else 1.0)


def values_of(unknowns: Sequence[Unknown], theta: Sequence[float] | Float[np.ndarray, " unknowns"]) -> list[float]:
    """The numbers themselves."""
    exponents = {(u.path, u.record): u.value(t) for u, t in zip(unknowns, theta, strict=True)}
    return [u.value(t, exponents[u.tie[0], u.record] if u.tie else 0.0) for u, t in zip(unknowns, theta, strict=True)]


def interval(
    unknowns: Sequence[Unknown],
    theta: Float[np.ndarray, " unknowns"],
    covariance: Float[np.ndarray, "unknowns unknowns"],
    path: str,
    width: float = 1.96,
    record: int | None = None,
) -> tuple[float, float, float]:
    """Value of an unknown, and what it is so many standard errors below and above, within its bounds.

    They are symmetric in its own coordinate. Of one that each record has to itself, that of the first, or of `record`.
    """
    mine = [u.record is None or record is None or u.record == record for u in unknowns]
    paths = [u.path if ours else "" for u, ours in zip(unknowns, mine, strict=True)]
    k = paths.index(path)
    u, t, slope, exponent = unknowns[k], theta[k], np.zeros(theta.size), 0.0
    slope[k] = 1.0
    if u.tie:
        m = paths.index(u.tie[0])
        exponent = unknowns[m].value(theta[m])
        slope[m] = (1.0 if u.log else t) * u.tie[1] * unknowns[m].slope(theta[m])
    sd = math.sqrt(max(slope @ covariance @ slope, 0.0))
    low, high = sorted((u.value(max(t - width * sd, u.low), exponent), u.value(min(t + width * sd, u.high), exponent)))
    return u.value(t, exponent), low, high


def untied(unknown: Unknown, structure: Structure) -> Unknown:
    """The same number by itself."""
    if unknown.tie is None:
        return unknown
    path, rate = unknown.tie
    return replace(unknown, unit=unknown.unit * math.exp(rate * structure.values()[path]), tie=None)


def _tied(unknown: Unknown, parameter: Parameter, structure: Structure, nuisances: Nuisances) -> Unknown:
    """The same number, which begins where it did, tied to its exponent if it has one."""
    if not parameter.exponent:
        return unknown
    exponent, rate = _exponent_of(unknown.path, parameter), _log_size(parameter, nuisances)
    unit = unknown.unit * math.exp(-rate * structure.values()[exponent])
    return replace(unknown, unit=unit, tie=(exponent, rate))


def natural_size(structure: Structure, path: str, nuisances: Nuisances) -> float:
    """Size of a parameter at which its force equals the elastic force of the motion."""
    parameter = structure.entries()[path][0]
    power = structure.values()[_exponent_of(path, parameter)] if parameter.exponent else 1.0
    return nuisances.elastic_force(structure) ** parameter.force * math.exp(power * _log_size(parameter, nuisances))


def _log_size(parameter: Parameter, nuisances: Nuisances) -> float:
    """Logarithm of length and time in a parameter's unit, in sizes of the motion."""
    return parameter.length * math.log(nuisances.length) - parameter.time * math.log(nuisances.omega)


def _exponent_of(path: str, parameter: Parameter) -> str:
    return f"{path.rpartition('.')[0]}.{parameter.exponent}"


def own_unknown(structure: Structure, path: str, trust: Mapping[str, float], degrees: float = DEGREES) -> Unknown:
    """A value that the model states: Student's law about it, as wide as it is trusted."""
    value = structure.values()[path]
    kind = path.split("@")[0]
    stated = [name for name in trust if path in structure.select(name)]
    width = trust[max(stated, key=len)] if stated else TRUST.get(kind, 0.25)  # the longest name says most
    if value == 0:  # nothing to be relative to: damping stated as none
        raise ValueError(
            f"{path} is 0 and cannot be refitted as a share of itself; state a small value, or leave the term out."
        )
    width = math.log1p(width)
    reach = max(_REACH.get(kind, _REACH["damping"]), _WIDTHS * width)
    return Unknown(path, 0.0, value, True, 0.0, width, degrees, low=-reach, high=reach)


def free_unknown(structure: Structure, path: str, nuisances: Nuisances) -> Unknown:
    """A value to be found from the data, with a wide law about where it stands."""
    value, parameter = structure.values()[path], structure.entries()[path][0]
    if parameter.positive and value != 0:
        unknown = bounded(Unknown(path, 0.0, value, True, 0.0, 3.0), parameter.low, parameter.high)
        return _tied(unknown, parameter, structure, nuisances)
    scale = max(abs(value), TYPICAL * natural_size(structure, path, nuisances))
    low = max(parameter.low, 0.0) if parameter.positive else parameter.low
    unknown = bounded(Unknown(path, value / scale, scale, False, value / scale, 10.0), low, parameter.high)
    return _tied(unknown, parameter, structure, nuisances)


def effect_unknown(structure: Structure, path: str, nuisances: Nuisances) -> Unknown:
    """A number of a candidate: sizes are log-normal about a share of the elastic force, shapes about where they begin.

    Either keeps the sign that it has.
    """
    value, parameter = structure.values()[path], structure.entries()[path][0]
    if parameter.force or path.split("@")[0] in {sensor.kind for sensor in structure.sensors}:
        typical = TYPICAL * natural_size(structure, path, nuisances)
        unit, cost = math.copysign(typical, value), _UNUSUAL if parameter.usual * value < 0 else 0.0
        unknown = Unknown(path, math.log(value / unit), unit, True, 0.0, TYPICAL_SPREAD, cost=cost)
    elif parameter.positive:
        unknown = Unknown(path, 0.0, value, True, 0.0, _SHAPE_SPREAD)
    else:
        unit = natural_size(structure, path, nuisances)
        unknown = Unknown(path, value / unit, unit, False, 0.0, 1.0 + abs(value / unit))
    return _tied(bounded(unknown, parameter.low, parameter.high), parameter, structure, nuisances)


def with_offsets(structure: Structure, records: Sequence[Nuisances]) -> Structure:
    """The structure with an offset on every channel that the records measure, zero where it has none."""
    have = {sensor.at for sensor in structure.sensors if isinstance(sensor, Offset)}
    for nuisances in records:
        for channel in _offset_channels(structure, nuisances):
            if channel not in have:
                structure, have = structure + Offset(0.0, at=channel), have | {channel}
    return structure


def _offset_channels(structure: Structure, nuisances: Nuisances) -> list[tuple[str, int]]:
    if isinstance(nuisances.inputs, Imposed):  # of the motion only displacements; the rest follows these
        return [c for c in nuisances.channels if c[0] in ("force", "displacement")]
    acting = np.any(np.asarray(nuisances.inputs.force)[:, 0], axis=0)
    forces = [c for c in nuisances.record.channels if c[0] == "force" and acting[c[1] - 1]]
    # A bias is an offset by another name, and so is a constant force beside the measured one.
    known: set[tuple[str, int]] = {s.at for s in structure.sensors if isinstance(s, AccelerationBias)}
    known |= {("force", t.at[1]) for t in structure.terms if isinstance(t, Preload) and t.at[0] == 0}
    return [c for c in (*forces, *nuisances.channels) if c not in known]


def nuisance_unknowns(structure: Structure, nuisances: Nuisances, index: int) -> list[Unknown]:
    """Offsets, initial state and noise scales of one record; `structure` carries the offsets."""
    found = []
    values, spread = structure.values(), dict(zip(nuisances.channels, nuisances.spread.tolist(), strict=True))
    for kind, j in _offset_channels(structure, nuisances):
        size = spread.get((kind, j)) or float(np.std(nuisances.record.channels[kind, j]))
        unit, degrees = size * _SLIGHT, math.inf
        if kind in ("displacement", "velocity"):
            unit, degrees = size * _OFFSET, DEGREES
        elif kind == "force" and nuisances.path is not None:
            unit = size * _OFFSET_OF_ANSWER
        path = Offset.path(kind, j)
        found.append(Unknown(path, values[path] / unit, unit, False, 0.0, 1.0, degrees, record=index))
    if not nuisances.at_rest:
        for name, guess, unit in (
            ("x0", nuisances.x0, nuisances.length),
            ("v0", nuisances.v0, nuisances.length * nuisances.omega),
        ):
            for j, value in enumerate(guess):
                theta, path = value / unit, f"{name}@{j + 1}"
                found.append(Unknown(path, theta, unit, False, theta, _START_SPREAD, record=index))
    for c in range(len(nuisances.channels)):
        width, reach = (_SCALE_SPREAD, 2.0) if nuisances.trusted[c] else (_SCALE_SPREAD_GUESSED, 8.0)
        found.append(Unknown(f"noise@{c}", 0.0, 1.0, False, 0.0, width, record=index, low=-reach, high=reach))
    return found


def bounded(unknown: Unknown, low: float, high: float) -> Unknown:
    """The unknown confined to values between `low` and `high`."""
    ends = []
    for end in (low, high):
        if math.isinf(end):
            ends.append(end)
        elif unknown.log:
            share = end / unknown.unit
            ends.append(math.log(share) if share > 0 else -math.inf)
        else:
            ends.append(end / unknown.unit)
    low, high = min(ends), max(ends)
    return replace(unknown, low=low, high=high, theta=min(max(unknown.theta, low), high))
