"""Numbers as a person reads them: significant digits, SI prefixes, a unit on each."""

import math
import re
from typing import NamedTuple

from jfsm.reporting._shown_units import in_shown_unit

ABSENT = "–"
PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
# Units that take a prefix. Kiloseconds and kiloradians exist, but nobody reads them.
GROWING = {"m", "N", "V", "Pa"}
SHRINKING = GROWING | {"s", "rad"}
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class Scale(NamedTuple):
    """What to divide by, and the unit that is left."""

    factor: float
    unit: str


def scale_for(value: float | None, unit: str | None) -> Scale:
    """Prefix that brings a value of this size between 0.1 and 1000, as in 29.8 µm for 2.98e-5 m.

    Where another unit is asked for, that unit, and no prefix.
    """
    size, asked = in_shown_unit(unit or "")
    if asked != (unit or ""):
        return Scale(size, asked)
    unit = unit or ""
    size = abs(value) if value is not None and math.isfinite(value) else 0.0
    symbol = re.match(r"[A-Za-z]+(?![²³⁴⁵\d^*])", unit)
    takes = symbol.group() if symbol else ""
    if size == 0.0 or 0.1 <= size < 1000.0 or takes not in (GROWING if size > 1 else SHRINKING):
        return Scale(1.0, unit)
    factor, prefix = next(((f, p) for f, p in PREFIXES if size >= f * (1 - 1e-9)), PREFIXES[-1])
    return Scale(factor, prefix + unit)


def number(value: float | None, digits: int = 3) -> str:
    """A number to so many significant digits; powers of ten only where zeros would have to be counted."""
    if value is None or math.isnan(value):
        return ABSENT
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    if value == 0:
        return "0"
    mantissa, exponent = f"{abs(value):.{digits - 1}e}".split("e")
    power = int(exponent)
    if -4 < power < 6:
        text = f"{abs(value):.{max(digits - 1 - power, 0)}f}"
    else:
        text = f"{mantissa} × 10{str(power).translate(SUPERSCRIPTS)}"
    return f"−{text}" if value < 0 else text


def quantity(value: float | None, unit: str | None, digits: int = 3) -> str:
    """A number with its unit, prefixed where that reads better."""
    if value is None:
        return ABSENT
    scale = scale_for(value, unit)
    return f"{number(value / scale.factor, digits)} {scale.unit}".rstrip()


def power_of_ten(value: float) -> str:
    """ "0.1", "10", "10⁻⁵" for a power of ten; empty for what is none."""
    power = round(math.log10(value)) if value > 0 else 0
    if not math.isclose(value, 10.0**power, rel_tol=1e-6):
        return ""
    return f"{10.0**power:g}" if -2 <= power <= 3 else f"10{str(power).translate(SUPERSCRIPTS)}"


def with_error(value: float | None, error: float | None, unit: str | None) -> str:
    """A quantity with its standard error, cut where the error begins: "5.1 ± 0.9 mV"."""
    if value is None or not error or not math.isfinite(error):
        return quantity(value, unit)
    scale = scale_for(value, unit)
    value, error = value / scale.factor, error / scale.factor
    decimals = max(-math.floor(math.log10(error)), 0)
    if decimals > 6:
        text = f"{number(value)} ± {number(error, 1)}"
    else:
        text = f"{value:.{decimals}f} ± {error:.{decimals}f}".replace("-", "−")
    return f"{text} {scale.unit}".rstrip()


def rate_unit(unit: str | None) -> str:
    """Unit of the rate of change: m/s of m, m/s² of m/s."""
    unit = unit or "1"
    return unit + "²" if unit.endswith("/s") else f"{unit}/s"


def interval(low: float | None, high: float | None, unit: str | None, like: float | None = None) -> str:
    """ "[9.8, 10.2]" with the prefix and the decimals that `quantity` has for the value `like`; empty if unknown."""
    if low is None or high is None:
        return ""
    factor, digits = scale_for(like, unit).factor, digits_for(like, low, high)
    shown = abs(like or max(abs(low), abs(high))) / factor
    power = math.floor(math.log10(shown)) if shown > 0 else 0
    if not -4 < power < 6:
        return f"[{number(low / factor, digits)}, {number(high / factor, digits)}]"
    decimals = max(digits - 1 - power, 0)
    return f"[{low / factor:.{decimals}f}, {high / factor:.{decimals}f}]".replace("-", "−")


def digits_for(value: float | None, low: float | None, high: float | None) -> int:
    """Significant digits that a value deserves: two digits of its interval's width show, at least three in all."""
    if value is None or low is None or high is None or not math.isfinite(high - low) or not value or high <= low:
        return 3
    return min(max(3, 2 + math.floor(math.log10(abs(value))) - math.floor(math.log10(high - low))), 8)


MOST_PERCENT, LEAST_PERCENT = 1e4, 1e-3
"""Percentages beyond which only the bound is shown."""


def percent(share: float | None) -> str:
    """A share as a percentage; one decimal below ten and close below a hundred, where it matters.

    Shares that are too large or too small to mean more are bounds.
    """
    if share is None or math.isnan(share):
        return ABSENT
    hundredths = 100.0 * share
    size = abs(hundredths)
    if size > MOST_PERCENT:
        return f"{'< −' if hundredths < 0 else '> '}{MOST_PERCENT:.0f} %"
    if 0 < size < LEAST_PERCENT:
        return f"< {LEAST_PERCENT:g} %" if hundredths > 0 else f"> −{LEAST_PERCENT:g} %"
    if 0 < size < 0.05:
        return f"{number(hundredths, 1)} %"
    if 99.5 <= size < 100.0:
        text = f"{min(size, 99.9):.1f}"  # what is not whole is not rounded to it
    else:
        text = f"{size:.0f}" if size >= 9.95 else f"{size:.1f}".removesuffix(".0")
    return f"−{text} %" if hundredths < 0 else f"{text} %"


def probability(value: float | None) -> str:
    """A probability in whole per cent; near 0 and 1 a bound, for nothing measured is certain."""
    if value is None or math.isnan(value):
        return ABSENT
    if value > 0.99:
        return "> 99 %"
    if value < 0.01:
        return "< 1 %"
    return f"{100 * value:.0f} %"
