"""The force that a diagnosis found, as a table."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ...structures import AbstractTerm, ForceTable, MapTerm, Structure, causes, own_laws, table_of
from .._finding import Finding

_POINTS = 41


def found_table(
    extended: Structure | None,
    findings: Sequence[Finding],
    curves: Callable[[], Mapping[str, Any]],
    displacement: Any,
    velocity: Any,
    at: Any,
) -> ForceTable:
    """The table of the laws that were named, or of the map; `curves` are asked for the range of the motion.

    Raises
    ------
    ValueError
        If there are none, or their numbers are not at hand.
    """
    if extended is None:
        raise ValueError(
            "The extended model holds a map or a function, which JSON has no place for. Take the table of the "
            "diagnosis itself, before it is written."
        )
    terms = _found(extended, findings)
    if not terms:
        raise ValueError("There is no table: the diagnosis names no law that the model lacks, and has no map.")
    if displacement is None or velocity is None:
        motion = curves()["residual"]
        own = [_range(motion[name]) for name in ("displacement", "velocity")]
        displacement = own[0] if displacement is None else displacement
        velocity = own[1] if velocity is None else velocity
    return table_of(terms, displacement, velocity, at)


def _found(extended: Structure, findings: Sequence[Finding]) -> list[AbstractTerm]:
    """Terms of the extended model that were found."""
    known = causes()
    laws = [(known[f.cause].effect if f.cause in known else own_laws().get(f.cause), f.at) for f in findings]
    return [
        term
        for term in extended.terms
        if isinstance(term, MapTerm) or any(type(term) is law and set(term.at) == set(at) for law, at in laws)
    ]


def _range(values: Sequence[float]) -> np.ndarray:
    return np.linspace(min(values), max(values), _POINTS)
