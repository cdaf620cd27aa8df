"""The numbers of a law: their units, their bounds, and the sizes that are natural to them."""

import math
import operator
import re
from typing import Any, NamedTuple

from jax.core import Tracer

ABOVE_ZERO = 1e-300
"""`Parameter.least` of a number that a law divides by."""

_BASES = {"N": (1, 0, 0), "m": (0, 1, 0), "s": (0, 0, 1), "kg": (1, -1, 2), "rad": (0, 0, 0), "1": (0, 0, 0)}
"""Exponents of force, length and time of what a unit may be made of."""
_RAISED = str.maketrans({"²": "^2", "³": "^3", "·": " ", "*": " "})
_FACTOR = re.compile(r"([A-Za-z]+|1)(?:\^(-?\d+))?")


class _Fields(NamedTuple):
    name: str
    force: int = 0
    length: int = 0
    time: int = 0
    positive: bool = True
    meaning: str = ""
    low: float = -math.inf
    high: float = math.inf
    least: float = -math.inf
    free: bool = True
    exponent: str = ""
    usual: int = 0
    has_unit: bool = False


class Parameter(_Fields):
    """One number of a law.

    Parameters
    ----------
    name : str
        What it is called, ``F`` in ``coulomb@0-1.F``.
    force, length, time : int
        Exponents of its unit: N/m³ is ``force=1, length=-3``. Those of length and time count as often as the law's
        number named `exponent` says: 1/mⁿ is ``length=-1, exponent="n"``.
    unit : str, optional
        The unit in words instead, made of N, m, s and kg: ``"N/m^3"``, ``"N s/m"``; ``"1"`` is without a unit. Records
        in other units of force and length have theirs in place of N and m.
    positive : bool
        Whether it is never negative: a fit then works with its logarithm.
    meaning : str
        What it is, in a few words.
    low, high : float
        Bounds that a fit keeps it between.
    least : float
        A value below it is refused.
    free : bool
        False of one that a fit leaves alone (a side, an origin of time).
    usual : int
        Sign that it has as a rule, of one that may have either.

    Raises
    ------
    TypeError
        If the unit is given both in words and by exponents.
    ValueError
        If the unit is not made of N, m, s and kg.

    Examples
    --------
    >>> jfsm.Parameter("k3", unit="N/m^3", positive=False, meaning="cubic stiffness").unit()
    'N/m^3'
    """

    __slots__ = ()

    def __new__(
        cls, name: str, force: int | None = None, length: int | None = None, time: int | None = None,
        positive: bool = True, meaning: str = "", low: float = -math.inf, high: float = math.inf,
        least: float = -math.inf, free: bool = True, exponent: str = "", usual: int = 0, *, unit: str | None = None,
    ):  # fmt: skip
        given = [each for each in (force, length, time) if each is not None]
        if unit is not None and given:
            raise TypeError(f"`unit` of {name} must be given in words or by force=, length= and time=, not both.")
        exponents = (force or 0, length or 0, time or 0) if unit is None else _exponents(unit, name)
        has_unit = unit is not None or bool(given)
        return super().__new__(
            cls, name, *exponents, positive, meaning, low, high, least, free, exponent, usual, has_unit
        )

    def check(self, value: Any, owner: str) -> None:
        """Refuse a value below `least`; one that is being traced cannot be looked at."""
        if isinstance(value, Tracer) or float(value) >= self.least:
            return
        must = "be positive" if self.least > 0 else "not be negative"
        raise ValueError(f"`{self.name}` of {owner} must {must}; got {float(value):g}.")

    def unit(self, force: str = "N", length: str = "m", time: str = "s") -> str:
        """The unit in words, ``"N/m^3"``, from the record's unit of force and of length."""
        if self.exponent:
            over = self._replace(force=0, exponent="").unit(force, length, time)
            over = f"{over}^{self.exponent}" if over.startswith("1/") else f"({over})^{self.exponent}"
            return f"{force} {over}" if self.force else over
        if (self.force, self.length, self.time, force, length, time) == (1, -1, 2, "N", "m", "s"):
            return "kg"
        powers = [(force, self.force), (length, self.length), (time, self.time)]
        above = [name if p == 1 else f"{name}^{p}" for name, p in powers if p > 0]
        below = [name if p == -1 else f"{name}^{-p}" for name, p in powers if p < 0]
        if not above and not below:
            return "1"
        top = " ".join(above) or "1"
        return top if not below else f"{top}/{below[0]}" if len(below) == 1 else f"{top}/({' '.join(below)})"


def _exponents(unit: str, name: str) -> tuple[int, int, int]:
    """Exponents of force, length and time of a unit in words."""
    above, _, below = unit.translate(_RAISED).partition("/")
    found = [0, 0, 0]
    for sign, factors in ((1, above.split()), (-1, re.sub(r"^\((.*)\)$", r"\1", below.strip()).split())):
        for factor in factors:
            match = _FACTOR.fullmatch(factor)
            if match is None or match[1] not in _BASES:
                raise ValueError(
                    f"`unit` of {name} must be made of N, m, s and kg, as N/m^3 or N s/m, or be 1; got {unit!r}. Other "
                    "units of force and length come with the record."
                )
            power = sign * int(match[2] or 1)
            found = [mine + power * base for mine, base in zip(found, _BASES[match[1]], strict=True)]
    if not above.strip():
        raise ValueError(f"`unit` of {name} must be a unit such as N/m, or 1 for a number without one; got {unit!r}.")
    return found[0], found[1], found[2]


def as_link(at: Any) -> tuple[int, int]:
    """A pair (i, j) of two different degrees of freedom; 0 is ground."""
    try:
        i, j = (operator.index(a) for a in at)
    except (TypeError, ValueError):
        raise ValueError(f"`at` must be a pair (i, j) of degrees of freedom, 0 for ground; got {at!r}.") from None
    if i < 0 or j < 0 or i == j:
        raise ValueError(f"`at` must name two different degrees of freedom, 0 for ground; got {at!r}.")
    return i, j


class Scale(NamedTuple):
    """Sizes of a motion, which a law's numbers are natural to.

    `force` is the rms of the elastic force, `length` the rms of the displacement, `peak` its largest value, `omega` the
    angular frequency [rad/s], `begin` and `end` the record's first and last instant.
    """

    force: float
    length: float
    peak: float
    omega: float
    begin: float
    end: float

    def of(self, parameter: Parameter) -> float:
        """Natural size of a number by its unit."""
        return self.force**parameter.force * self.length**parameter.length * self.omega**-parameter.time

    @property
    def speed(self) -> float:
        return self.length * self.omega

    def instants(self, count: int) -> list[float]:
        """So many instants inside the record, evenly spread."""
        return [self.begin + (i + 1) / (count + 1) * (self.end - self.begin) for i in range(count)]
