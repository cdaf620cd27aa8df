"""Numbers in the words of a finding."""

import math


def figure(value: float) -> str:
    """Three significant digits; large numbers in full, for 9770 reads better than 9.77e+03."""
    return f"{value:.0f}" if 1000 <= abs(value) < 1e6 else f"{value:.3g}"


def plus_minus(value: float, error: float) -> str:
    """A value with its standard error, cut where the error begins: "0.0061 ± 0.0001"."""
    if not (error > 0 and math.isfinite(error)):
        return figure(value)
    place = math.floor(math.log10(error))
    size = math.floor(math.log10(abs(value))) if value else place
    if size - place > 3:  # so small an error that its value need not be told to the last digit
        return f"{value:.4g} ± {error:.0e}"
    if place > -6:
        decimals = max(-place, 0)
        return f"{value:.{decimals}f} ± {error:.{decimals}f}"
    return f"{value:.{max(size - place, 0)}e} ± {error:.0e}"


def share(value: float) -> str:
    """A share in per cent; one that is too small to show says so."""
    if value < 1e-4:
        return "less than 0.01%"
    return f"{value:.2%}" if value < 0.01 else f"{value:.1%}"


def capitalised(sentence: str) -> str:
    """The first letter large, the others as they are."""
    return sentence[:1].upper() + sentence[1:]
