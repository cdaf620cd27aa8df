"""A term or a sensor effect as it would be written in Python."""

import re
from typing import Any

import equinox as eqx

from .._types import is_traced


def part_text(part: Any) -> str:
    """``Coulomb(F=3, at=(0, 1))``; one without numbers, or whose numbers are not known, as its tree."""
    numbers = [getattr(part, p.name) for p in part.parameters]
    if not numbers or any(is_traced(number) or getattr(number, "shape", None) != () for number in numbers):
        return eqx.tree_pformat(part)
    words = ", ".join(f"{p.name}={float(number):.6g}" for p, number in zip(part.parameters, numbers, strict=True))
    return f"{type(part).__name__}({words}, at={part.at})"


def formula_of(law: Any) -> str:
    """The first paragraph of what the class of a law says of itself, which holds its formula, without references."""
    words = " ".join((law.__doc__ or "").partition("\n\n")[0].split())
    return re.sub(r",? \[\d+\]_( Eqs?\.( \(\d+\),?)*)?", "", words)
