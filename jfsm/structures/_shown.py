"""Structures, terms and sensor effects as they are printed."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from .terms import LinearDamping, LinearStiffness

if TYPE_CHECKING:
    from ._structure import Structure

_MOST_LINES = 24
_NONE = 1e-9
"""Damping or frequency of a mode that is none, as a share of the size of its eigenvalue."""


def linear_modes(structure: "Structure") -> list[tuple[float, float]]:
    """Natural frequency [Hz] and damping ratio of each mode that oscillates, of masses, linear springs and dashpots."""
    mass = np.asarray(structure.mass)
    mass = np.diag(mass) if mass.ndim == 1 else mass
    if structure.own is not None or np.linalg.matrix_rank(mass) < structure.dof:
        return []
    dof = structure.dof
    stiffness, damping = (np.linalg.solve(mass, _matrix(structure, law)) for law in (LinearStiffness, LinearDamping))
    matrix = np.block([[np.zeros((dof, dof)), np.eye(dof)], [-stiffness, -damping]])
    values = np.linalg.eigvals(matrix)
    moving = sorted(values[values.imag > _NONE * np.max(np.abs(values), initial=0.0)], key=abs)
    ratios = [float(-value.real / abs(value)) for value in moving]
    return [
        (float(abs(value)) / (2 * np.pi), ratio if abs(ratio) > _NONE else 0.0)
        for value, ratio in zip(moving, ratios, strict=True)
    ]


def _matrix(structure: "Structure", law: type) -> Float[np.ndarray, "dof dof"]:
    """Matrix of all linear springs, or of all linear dashpots."""
    found = np.zeros((structure.dof + 1, structure.dof + 1))
    for term in structure.terms:
        if isinstance(term, law):
            i, j = term.at
            found[np.ix_((i, j), (i, j))] += float(term.values[0]) * np.array([[1.0, -1.0], [-1.0, 1.0]])
    return found[1:, 1:]


def structure_text(structure: "Structure") -> str:
    """The structure's numbers with their units, and the modes of its linear part, in lines."""
    one, several = (
        ("degree of freedom", "degrees of freedom") if structure.own is None else ("coordinate", "coordinates")
    )
    rows = [*_numbers(structure), *_modes(structure)]
    width = max((len(name) for name, _ in rows), default=0)
    lines = [f"  {name:<{width}}  {words}".rstrip() for name, words in rows]
    left = len(lines) - _MOST_LINES
    if left > 0:
        lines = [*lines[:_MOST_LINES], f"  and {left} more; `values()` gives all numbers"]
    return "\n".join(
        [f"{type(structure).__name__} of {structure.dof} {one if structure.dof == 1 else several}", *lines]
    )


def _numbers(structure: "Structure") -> Iterator[tuple[str, str]]:
    """Every number by path, with its unit and how far it is trusted."""
    trusted = {path: share for name, share in structure.trust for path in structure.select(name)}
    own = set(structure._own_entries()) if structure.own is not None else set()
    for path, (parameter, value) in structure.entries().items():
        unit = "" if path in own or parameter.unit() == "1" else f" {parameter.unit()}"
        trust = f" ± {100 * trusted[path]:.3g} %" if path in trusted else ""
        yield path, f"{float(value):.6g}{unit}{trust}"
    for term in structure.terms:
        if not term.parameters:
            yield f"{term.kind}@{term.place}", "a map"


def _modes(structure: "Structure") -> Iterator[tuple[str, str]]:
    for number, (frequency, ratio) in enumerate(linear_modes(structure), 1):
        yield f"mode {number}", f"{frequency:.4g} Hz, damping ratio {100 * ratio:.3g} %"
