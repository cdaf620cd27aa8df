"""The equation of motion of a structure, as expressions."""

import re
from dataclasses import dataclass, replace
from typing import Any

import jax.numpy as jnp
import numpy as np

from ..._types import as_array
from .._parameter import Parameter
from .._structure import Structure
from .._term import AbstractFriction, AbstractTerm
from .._written import formula_of
from ..terms import LinearStiffness, MapTerm
from .expressions import Expression, NotWrittenError, symbol, traced

_SLOW = 1e-3
"""Speed below which exported friction is smooth, as a share of that at which a mass on its springs oscillates where the
friction just holds it."""
STICK_SPEED = "stick_speed"


@dataclass(frozen=True)
class Number:
    """A number of a term by the name that it has in a text."""

    name: str
    value: float
    parameter: Parameter


@dataclass(frozen=True)
class TermEquations:
    """The force of a term at displacement d, velocity w, time t and hidden states z, and what these do."""

    title: str
    what: str
    at: tuple[int, int]
    numbers: tuple[Number, ...]
    force: Expression
    rates: tuple[Expression, ...]
    relaxed: tuple[Expression, ...]
    first: int
    """Place of its first hidden state among those of the structure."""


@dataclass(frozen=True)
class Equations:
    """M a + forces of the terms = force, and the rates of the hidden states."""

    mass: np.ndarray
    terms: tuple[TermEquations, ...]
    hidden: int
    stick_speed: float | None
    """Speed [m/s] below which friction that sticks is smooth instead; None where none sticks."""
    bounded: bool
    """Whether hidden states come to rest at bounds, where solvers for stiff equations are lost."""
    notes: tuple[str, ...]
    """What a text does otherwise than `simulate`, as sentences."""

    @property
    def dof(self) -> int:
        return len(self.mass)


def equations_of(structure: Any, stick_speed: Any = None) -> Equations:
    """The equation of motion of a structure.

    Raises
    ------
    ValueError
        If it moves by a function, has a term without a formula or of the past, or no mass; if friction sticks and
        neither `stick_speed` nor the structure's springs tell what is slow; names the term.
    """
    if structure.own is not None:
        raise ValueError(
            "The plant moves by a function of yours, which cannot be written as text. Export what was found beside it: "
            "jfsm.Structure(mass, terms=model.terms), and add its forces to your function."
        )
    mass = np.asarray(structure.mass, float)
    mass = np.diag(mass) if mass.ndim == 1 else mass
    if np.linalg.matrix_rank(mass) < len(mass):
        raise ValueError(
            f"`mass` must be positive for an equation of motion; it is {np.diag(mass).tolist()}. The forces of a "
            "structure without mass are in its table: to_table."
        )
    sticking = [term for term in structure.terms if isinstance(term, AbstractFriction)]
    slow = _stick_speed(structure, mass, sticking, stick_speed) if sticking else None
    names, paths = set[str](), iter(list(structure.entries().items())[structure.dof :])
    terms: list[TermEquations] = []
    first = 0
    for term in structure.terms:
        numbers = []
        for parameter in term.parameters:
            path, (_, value) = next(paths)
            numbers.append(Number(_named(path, names), float(value), parameter))
        terms.append(_written(term, tuple(numbers), first))
        first += term.states
    bounded = any(type(term).settle is not AbstractTerm.settle for term in structure.terms)
    return Equations(mass, tuple(terms), first, slow, bounded, tuple(_notes(structure, sticking, slow)))


def _notes(structure: Structure, sticking: list[Any], slow: float | None) -> list[str]:
    notes = []
    if slow is not None:
        where = ", ".join(f"{term.kind}@{term.place}" for term in sticking)
        notes.append(
            f"friction that sticks ({where}) is smooth here, its sliding force times tanh(w/{STICK_SPEED}) with "
            f"{STICK_SPEED} = {slow:.3g} m/s, so that what sticks creeps."
        )
    if structure.sensors:
        what = ", ".join(f"{sensor.kind}@{sensor.place}" for sensor in structure.sensors)
        notes.append(f"force and motion are the true ones; what the sensors make of them is left out ({what}).")
    return notes


def _named(path: str, taken: set[str]) -> str:
    """A name for a number that both languages take, ``coulomb_0_1_F``."""
    name = stem = re.sub(r"[^0-9A-Za-z]+", "_", path)
    count = 2
    while name in taken:
        name, count = f"{stem}_{count}", count + 1
    taken.add(name)
    return name


def _stick_speed(structure: Structure, mass: np.ndarray, sticking: list[Any], given: Any) -> float:
    """Speed below which friction is smooth: as given, or from masses and springs where they tell."""
    if given is not None:
        speed = float(as_array(given, STICK_SPEED, 0))
        if speed <= 0:
            raise ValueError(f"`{STICK_SPEED}` must be a positive speed in m/s; got {speed:g}.")
        return speed
    stiffness = np.zeros_like(mass)
    for term in structure.terms:
        if isinstance(term, LinearStiffness):
            row = _row(term.at, len(mass))
            stiffness += float(term.k) * np.outer(row, row)
    zero, speeds = jnp.zeros(()), []
    for term in sticking:
        row = _row(term.at, len(mass))
        held = float(max(jnp.abs(limit) for limit in term.limits(zero, zero, (), zero)))
        stiff, light = float(row @ stiffness @ row), float(row @ np.linalg.solve(mass, row))
        if held > 0 and stiff > 0:
            speeds.append(_SLOW * held * (light / stiff) ** 0.5)
    if not speeds:
        term = sticking[0]
        raise ValueError(
            f"`{STICK_SPEED}` must be given: {term.kind}@{term.place} sticks, which a solver without events cannot "
            "follow, and no spring tells how fast it moves. Give the speed in m/s below which friction may be smooth, "
            "a thousandth of the largest speed, say."
        )
    return min(speeds)


def _row(at: tuple[int, int], dof: int) -> np.ndarray:
    row = np.zeros(dof + 1)
    row[list(at)] = -1.0, 1.0
    return row[1:]


def _written(term: AbstractTerm, numbers: tuple[Number, ...], first: int) -> TermEquations:
    title = f"{term.kind}@{term.place}"
    if isinstance(term, MapTerm):
        raise ValueError(
            f"{title} is learned from readings and has no formula that could be written as text. Structure.to_table "
            "gives its force over displacement and velocity; Structure.save keeps it for jfsm."
        )
    if term.delay is not None:
        raise ValueError(
            f"{title} answers the motion of the past, which solve_ivp and ode45 do not keep. Run it with "
            "jfsm.simulate, or export the structure without it."
        )
    given = [symbol(each.name) for each in numbers]
    hidden = np.array([symbol(f"z{first + i + 1}") for i in range(term.states)], object)

    def asked(values: Any, d: Any, w: Any, z: Any, t: Any, slow: Any) -> Any:
        law: Any = replace(term, **{p.name: v for p, v in zip(term.parameters, values, strict=True)})
        if isinstance(law, AbstractFriction):
            lower, upper = law.limits(d, w, z, t)
            return [jnp.where(w > 0, upper, -lower) * jnp.tanh(w / slow)]
        if not law.states:
            return [law.force(d, w, (), t)]
        return [law.force(d, w, z, t), law.state_rate(d, w, z, t), law.initial_state(d, w)]

    try:
        force, *memory = traced(asked, given, symbol("d"), symbol("w"), hidden, symbol("t"), symbol(STICK_SPEED))
    except NotWrittenError as error:
        raise ValueError(
            f"{title} computes {error}, which cannot be written as text. Write its methods with sums, products, "
            "powers, jnp.where, abs, sign, minimum, maximum and elementary functions, or export the structure without "
            "it."
        ) from None
    rates, relaxed = (tuple(part.tolist()) for part in memory) if memory else ((), ())
    return TermEquations(title, formula_of(type(term)), term.at, numbers, force.item(), rates, relaxed, first)
