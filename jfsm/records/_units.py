"""Units of channels: what a recorder wrote, and the coherent unit a record keeps."""

import contextlib
import re
from collections.abc import Mapping
from typing import NamedTuple

RESPONSES = ("displacement", "velocity", "acceleration")
KINDS = ("force", *RESPONSES, "base_acceleration")


class Unit(NamedTuple):
    """A unit of one quantity: value in `coherent` = factor × value as written."""

    quantity: str
    factor: float
    coherent: str


_INCH, _FOOT, _POUND, _GRAVITY, _DEGREE = 0.0254, 0.3048, 4.4482216152605, 9.80665, 0.017453292519943295

# quantity -> coherent unit, then every accepted spelling (as `_plain` leaves it) with its size in that unit
_TABLE: dict[str, tuple[str, dict[str, float]]] = {
    "time": ("s", {"s": 1, "sec": 1, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60}),
    "length": ("m", {"m": 1, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "µm": 1e-6, "in": _INCH, "ft": _FOOT}),
    "speed": ("m/s", {"m/s": 1, "mm/s": 1e-3, "cm/s": 1e-2, "in/s": _INCH, "ft/s": _FOOT}),
    "acceleration": (
        "m/s²",
        {"m/s2": 1, "mm/s2": 1e-3, "cm/s2": 1e-2, "in/s2": _INCH, "ft/s2": _FOOT, "g": _GRAVITY, "mg": 1e-3 * _GRAVITY},
    ),
    "force": (
        "N",
        {"N": 1, "mN": 1e-3, "kN": 1e3, "MN": 1e6, "kgf": _GRAVITY, "lbf": _POUND, "lb": _POUND, "kip": 1e3 * _POUND},
    ),
    "torque": (
        "N m",
        {"Nm": 1, "mNm": 1e-3, "kNm": 1e3, "Nmm": 1e-3, "lbfft": _POUND * _FOOT, "lbfin": _POUND * _INCH},
    ),
    "angle": ("rad", {"rad": 1, "mrad": 1e-3, "deg": _DEGREE, "°": _DEGREE, "rev": 360 * _DEGREE}),
    "rotation_rate": ("rad/s", {"rad/s": 1, "deg/s": _DEGREE, "°/s": _DEGREE, "rpm": 6 * _DEGREE}),
    "rotation_acceleration": ("rad/s²", {"rad/s2": 1, "deg/s2": _DEGREE, "°/s2": _DEGREE}),
    "voltage": ("V", {"V": 1, "mV": 1e-3, "uV": 1e-6, "µV": 1e-6, "kV": 1e3}),
    "current": ("A", {"A": 1, "mA": 1e-3}),
    "pixels": ("px", {"px": 1}),
    "number": ("1", {"1": 1, "-": 1}),
}
# Raw readings, good for any kind of channel: an uncalibrated record is a consistent set of its own.
_RAW = ("voltage", "current", "pixels", "number")
_LENGTH, _ANGLE = ("length", "speed", "acceleration"), ("angle", "rotation_rate", "rotation_acceleration")
_DEFAULT_FORCE = {"angle": "N m"}


def _plain(text: str) -> str:
    """One spelling for m/s^2, m/s**2, m/s² and N·m, N*m, N m."""
    for old, new in (("**", ""), ("^", ""), ("²", "2"), ("μ", "µ"), ("·", ""), ("*", ""), (" ", "")):
        text = text.replace(old, new)
    return text


_UNITS = {
    spelling: Unit(quantity, factor, coherent)
    for quantity, (coherent, spellings) in _TABLE.items()
    for spelling, factor in spellings.items()
}
_SUFFIXES = {-2: " s²", -1: " s", 0: "", 1: "/s", 2: "/s²"}  # of a unit, by the number of differentiations
# What a raw unit becomes under differentiation, so that a written record can be read back.
_UNITS |= {
    _plain(_TABLE[quantity][0] + suffix): Unit(quantity + suffix, 1.0, _TABLE[quantity][0] + suffix)
    for quantity in _RAW
    for suffix in _SUFFIXES.values()
    if suffix
}


def find_unit(text: str, kind: str) -> Unit:
    """The unit a text stands for, as the unit of a channel of this kind.

    Raises
    ------
    ValueError
        If the unit is unknown, or is one of another quantity.
    """
    unit = _UNITS.get(_plain(text)) if isinstance(text, str) else None
    allowed = _quantities(kind)
    if unit is None or unit.quantity not in allowed:
        known = ", ".join(spelling for spelling, other in _UNITS.items() if other.quantity in allowed[:2])
        raise ValueError(
            f"`units` of {kind} must be a unit of {' or '.join(allowed[:2])} ({known}) or a raw reading (V, A, px, 1); "
            f"it was {text!r}. Convert the numbers before, and leave the unit out."
        )
    return unit


class Sensitivity(NamedTuple):
    """A sensor's reading for one unit of what it measures: value in `unit` = value as written / `size`.

    The value as written is in `reading`, a raw unit (mV).
    """

    size: float
    reading: str
    unit: str


_SENSITIVITY = re.compile(
    r"^\s*(?P<size>[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?)\s*(?P<reading>[^\d\s/]+)\s*/\s*(?P<unit>.+?)\s*$"
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
        given = Sensitivity(float(match["size"]), match["reading"], match["unit"].strip("()"))
        with contextlib.suppress(ValueError):
            is_raw = find_unit(given.reading, kind).quantity in _RAW
            is_of_kind = find_unit(given.unit, kind).quantity not in _RAW
            if given.size and is_raw and is_of_kind:
                return given
    raise ValueError(
        f"`sensitivity` of {name} must be a number of raw units for one unit of {kind}, as '100 mV/g' or "
        f"'2.25 mV/N'; it was {text!r}. Write it so, negative if the sensor points the other way."
    )


def is_unit(text: str) -> bool:
    """Whether this text is the spelling of a unit."""
    return _plain(text) in _UNITS


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
