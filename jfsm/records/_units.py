"""Units of channels: what a recorder wrote, and the coherent unit a record keeps."""

import contextlib
import re
from collections.abc import Mapping
from typing import NamedTuple

from jfsm.records._unit_words import Dimension, dimension_and_size

RESPONSES = ("displacement", "velocity", "acceleration")
KINDS = ("force", *RESPONSES, "base_acceleration")


class Unit(NamedTuple):
    """A unit of one quantity: value in `coherent` = factor × value as written."""

    quantity: str
    factor: float
    coherent: str


# quantity -> its dimension and its coherent unit
_QUANTITIES: dict[str, tuple[Dimension, str]] = {
    "time": (Dimension(time=1), "s"),
    "length": (Dimension(length=1), "m"),
    "speed": (Dimension(length=1, time=-1), "m/s"),
    "acceleration": (Dimension(length=1, time=-2), "m/s²"),
    "force": (Dimension(force=1), "N"),
    "torque": (Dimension(force=1, length=1), "N m"),
    "angle": (Dimension(angle=1), "rad"),
    "rotation_rate": (Dimension(angle=1, time=-1), "rad/s"),
    "rotation_acceleration": (Dimension(angle=1, time=-2), "rad/s²"),
    "voltage": (Dimension(voltage=1), "V"),
    "current": (Dimension(current=1), "A"),
    "pixels": (Dimension(pixels=1), "px"),
    "number": (Dimension(), "1"),
}
# Raw readings, good for any kind of channel: an uncalibrated record is a consistent set of its own.
_RAW = ("voltage", "current", "pixels", "number")
_LENGTH, _ANGLE = ("length", "speed", "acceleration"), ("angle", "rotation_rate", "rotation_acceleration")
_DEFAULT_FORCE = {"angle": "N m"}


_SUFFIXES = {-2: " s²", -1: " s", 0: "", 1: "/s", 2: "/s²"}  # of a unit, by the number of differentiations
_BY_DIMENSION = {dimension: (quantity, coherent) for quantity, (dimension, coherent) in _QUANTITIES.items()}
# What a raw unit becomes under differentiation, so that a written record can be read back.
_BY_DIMENSION |= {
    dimension.times(Dimension(time=1), -order): (quantity + suffix, coherent + suffix)
    for quantity in _RAW
    for dimension, coherent in [_QUANTITIES[quantity]]
    for order, suffix in _SUFFIXES.items()
    if suffix and quantity != "number"
}
_NUMBERS = {"1": "", "-": "", "count": "", "counts": "", "digits": ""} | {
    f"1{suffix}".replace(" ", ""): suffix for suffix in _SUFFIXES.values()
}
# Spellings that a message shows; all others are found alike.
_EXAMPLES = {
    "time": "s, ms, µs, min",
    "length": "m, mm, µm, in, ft",
    "speed": "m/s, mm/s, in/s",
    "acceleration": "m/s², mm/s², g, mg, in/s²",
    "force": "N, kN, lbf, kgf, kip",
    "torque": "N m, kN m, lbf in, lbf ft",
    "angle": "rad, mrad, deg",
    "rotation_rate": "rad/s, deg/s, rpm",
    "rotation_acceleration": "rad/s², deg/s²",
}


_ENCLOSED = re.compile(r"[\[(<{](.*)[\])>}]")


def _find(text: str) -> Unit | None:
    """The unit that a text stands for, None if it is none that is known."""
    squeezed = text.strip("[] ").replace(" ", "").replace("^", "").replace("s2", "s²").lower()
    if squeezed in _NUMBERS:
        suffix = _NUMBERS[squeezed]
        return Unit("number" + suffix, 1.0, "1" + suffix)
    found = dimension_and_size(_ENCLOSED.sub(r"\1", text.strip()))
    if found is None or found[0] not in _BY_DIMENSION:
        return None
    quantity, coherent = _BY_DIMENSION[found[0]]
    return Unit(quantity, found[1], coherent)


def find_unit(text: str, kind: str) -> Unit:
    """The unit a text stands for, as the unit of a channel of this kind.

    Raises
    ------
    ValueError
        If the unit is unknown, or is one of another quantity.
    """
    unit = _find(text) if isinstance(text, str) else None
    allowed = _quantities(kind)
    if unit is None or unit.quantity not in allowed:
        known = ", ".join(_EXAMPLES[quantity] for quantity in allowed[:2] if quantity in _EXAMPLES)
        raise ValueError(
            f"`units` of {kind} must be a unit of {' or '.join(allowed[:2])} ({known}) or a raw reading (V, A, px, 1); "
            f"it was {text!r}. Convert the numbers before, and leave the unit out."
        )
    return unit


def seconds_in(unit: str) -> float | None:
    """Seconds in a unit of time; None of what is none."""
    try:
        found = find_unit(unit, "time")
    except ValueError:
        return None
    return found.factor if found.quantity == "time" else None


class Sensitivity(NamedTuple):
    """A sensor's reading for one unit of what it measures: value in `unit` = value as written / `size`.

    The value as written is in `reading`, a raw unit (mV).
    """

    size: float
    reading: str
    unit: str


_SENSITIVITY = re.compile(
    r"^\s*(?P<size>[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?)\s*(?P<reading>1|[^\d\s/]+)?\s*/\s*(?P<unit>.+?)\s*$"
)


def find_sensitivity(text: str, name: str, kind: str) -> Sensitivity:
    """What a text as ``100 mV/g`` or ``22.4 mV/(m/s²)`` says of a channel of this kind.

    Raises
    ------
    ValueError
        If it is not a number, a raw unit, a slash and a unit of this kind.
    """
    match = _SENSITIVITY.match(text) if isinstance(text, str) else None
    if match is not None:
        given = Sensitivity(float(match["size"]), match["reading"] or "1", match["unit"].strip("()"))
        with contextlib.suppress(ValueError):
            is_raw = find_unit(given.reading, kind).quantity in _RAW
            is_of_kind = find_unit(given.unit, kind).quantity not in _RAW
            if given.size and is_raw and is_of_kind:
                return given
    raise ValueError(
        f"`sensitivity` of {name} must be a number of raw units for one unit of {kind}, as '100 mV/g' or "
        f"'2.25 mV/N'; it was {text!r}. Write it so, negative if the sensor points the other way."
    )


def coherent_unit(dimension: Dimension) -> str | None:
    """The unit that a record has for a quantity of this dimension, None if it has none."""
    return _BY_DIMENSION[dimension][1] if dimension in _BY_DIMENSION else None


def is_unit(text: str) -> bool:
    """Whether this text is the spelling of a unit."""
    return bool(text.strip()) and _find(text) is not None


def _quantities(kind: str) -> tuple[str, ...]:
    """Quantities that a channel of this kind may have, its own before the raw ones."""
    if kind == "time":
        return ("time",)
    if kind == "force":
        return ("force", "torque", *_RAW)
    order = RESPONSES.index(kind.removeprefix("base_"))
    differentiated = (
        quantity + _SUFFIXES[shift] for quantity in _RAW for shift in range(order - 2, order + 1) if shift
    )
    return (_LENGTH[order], _ANGLE[order], *_RAW, *differentiated)


def coherent_units(given: Mapping[str, Unit]) -> dict[str, str]:
    """The unit of every kind of channel, from those that were given.

    A kind without a unit takes the one that goes with the others: metres and newtons, radians and newton metres, volts
    and volts per second.

    Raises
    ------
    ValueError
        If displacement, velocity and acceleration are given in units that are not derivatives of one another.
    """
    motion: tuple[str, ...] = ("m", "m/s", "m/s²")
    system = "length"
    stated = {kind: unit for kind, unit in given.items() if kind != "force"}
    for place, (kind, unit) in enumerate(stated.items()):
        order = RESPONSES.index(kind.removeprefix("base_"))
        implied = _derivatives(unit.coherent, order)
        if place and implied != motion:
            listed = ", ".join(f"{name} in {other.coherent}" for name, other in stated.items())
            raise ValueError(
                f"`units` must give displacement, velocity and acceleration of one motion (m, m/s, m/s²; rad, rad/s, "
                f"rad/s²; V, V/s, V/s²); it gave {listed}. Put lengths and angles into records of their own, and "
                f"scale raw readings first."
            )
        motion = implied
        system = "angle" if unit.coherent.startswith("rad") else "length"
    units = {"force": _DEFAULT_FORCE.get(system, "N"), **dict(zip(RESPONSES, motion, strict=True))}
    units["base_acceleration"] = units["acceleration"]
    if "force" in given:
        units["force"] = given["force"].coherent
    return units


def _derivatives(unit: str, order: int) -> tuple[str, ...]:
    """Units of displacement, velocity and acceleration when the derivative of this order has this unit."""
    base = unit
    for shift, suffix in _SUFFIXES.items():
        if suffix and unit.endswith(suffix):
            base, order = unit.removesuffix(suffix), order - shift
            break
    return tuple(base + _SUFFIXES[step - order] for step in range(3))
