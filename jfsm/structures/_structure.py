"""The simulation its owner believes in: masses, terms and sensors."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, cast

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._types import as_array, as_numbers, is_traced
from ._own_motion import EvaluatedMotion, OwnMotion
from ._sensors import AbstractSensor
from ._shown import structure_text
from ._term import AbstractTerm, Parameter
from .terms import LinearDamping, LinearStiffness

if TYPE_CHECKING:
    from .export import ForceTable

MASS = Parameter("mass", force=1, length=-1, time=2, meaning="mass")


class Structure(eqx.Module):
    r"""M ẍ + Σ Bᵀ f(B x, B v, z, t) = g(t), and what the sensors make of it.

    Parameters
    ----------
    mass : (dof,) or (dof, dof) array
        Masses [kg], or a symmetric positive definite mass matrix.
    terms : sequence of terms
        Everything else on the left-hand side; place (0, 1) is between ground and degree of freedom 1.
    sensors : sequence of sensor effects
    trust : mapping of path to float, optional
        Relative uncertainty of own values.
    commands : sequence of int, optional
        Degrees of freedom whose force is what a drive was told to do, not what was measured; see `commanded`.

    Raises
    ------
    ValueError
        If a mass is negative, the mass matrix is not symmetric positive definite, or a term, a sensor or a command
        names a degree of freedom that the structure does not have.
    """

    mass: Float[Array, "..."]
    terms: tuple[AbstractTerm, ...]
    sensors: tuple[AbstractSensor, ...]
    trust: tuple[tuple[str, float], ...] = eqx.field(static=True)
    commands: tuple[int, ...] = eqx.field(static=True)
    own: OwnMotion | EvaluatedMotion | None = eqx.field(static=True, repr=False)
    """The function that a `Simulation` moves by."""
    own_numbers: Float[Any, " own"] = eqx.field(repr=False)

    def __init__(
        self,
        mass: Any,
        terms: Iterable[AbstractTerm] = (),
        sensors: Iterable[AbstractSensor] = (),
        trust: Mapping[str, float] | Iterable[tuple[str, float]] = (),
        commands: Iterable[int] = (),
    ):
        masses = as_numbers(mass, "mass", (0, 1, 2))
        if not is_traced(masses):
            masses = np.atleast_1d(masses)
            _check_mass(masses)
        self.mass = jnp.atleast_1d(jnp.asarray(masses))
        self.terms = _parts(terms, "terms", AbstractTerm)
        self.sensors = _parts(sensors, "sensors", AbstractSensor)
        try:
            self.trust = tuple((str(name), float(share)) for name, share in dict(trust).items())
        except (TypeError, ValueError):
            raise TypeError(f"`trust` must be shares by name, as {{'stiffness': 0.05}}; got {trust!r}.") from None
        self.own, self.own_numbers = None, np.zeros(0)
        self.commands = _commands(commands, self.dof)
        for term in self.terms:
            if not isinstance(term, AbstractTerm):
                raise TypeError(f"`terms` must hold terms such as jfsm.LinearStiffness(9.0, at=(0, 1)); got {term!r}.")
            if max(term.at) > self.dof:
                raise ValueError(
                    f"`at`={term.at} of {term.kind} names a degree of freedom beyond the structure's {self.dof}."
                )
        for sensor in self.sensors:
            if not isinstance(sensor, AbstractSensor):
                raise TypeError(
                    f"`sensors` must hold sensor effects such as jfsm.ForceGain(0.1, at=('force', 1)); got {sensor!r}."
                )
            if sensor.at[1] > self.dof:
                raise ValueError(
                    f"`at`={sensor.at} of {sensor.kind} names a degree of freedom beyond the structure's {self.dof}."
                )

    def __repr__(self) -> str:
        try:
            return structure_text(self)
        except (AttributeError, TypeError, jax.errors.JAXTypeError):  # amid a transformation it may hold anything
            return eqx.tree_pformat(self)

    @classmethod
    def sdof(cls, mass: float, stiffness: float, damping: float = 0.0) -> "Structure":
        """One mass [kg] on a spring [N/m] and a dashpot [N s/m] to ground."""
        return cls.chain([mass], [stiffness], [damping])

    @classmethod
    def chain(cls, mass: Any, stiffness: Any, damping: Any = None) -> "Structure":
        """Masses in a row; spring and dashpot i join mass i - 1 (ground for the first) to mass i."""
        masses = as_numbers(mass, "mass", 1)
        springs = as_numbers(stiffness, "stiffness", 1)
        dashpots = np.zeros(springs.shape) if damping is None else as_numbers(damping, "damping", 1)
        for name, values in (("stiffness", springs), ("damping", dashpots)):
            if values.size != masses.size:
                raise ValueError(f"`{name}` must have one value per mass ({masses.size}); got {values.size}.")
        links = [(i, i + 1) for i in range(masses.size)]
        terms = [LinearStiffness(k, at=at) for k, at in zip(springs, links, strict=True)]
        return cls(masses, [*terms, *(LinearDamping(c, at=at) for c, at in zip(dashpots, links, strict=True))])

    @classmethod
    def from_matrices(cls, mass: Any, stiffness: Any, damping: Any = None) -> "Structure":
        """Structure of a mass, a stiffness and a damping matrix, each (dof, dof).

        A spring or dashpot joins every two degrees of freedom that the matrix couples, and ground where a row's sum
        is not zero, so that each can be refitted, or replaced, by itself.

        Raises
        ------
        ValueError
            If a matrix is not square and symmetric, or they differ in size.
        """
        masses = as_array(mass, "mass", 2)
        terms: list[AbstractTerm] = []
        for name, law, values in (("stiffness", LinearStiffness, stiffness), ("damping", LinearDamping, damping)):
            if values is None:
                continue
            matrix = as_array(values, name, 2)
            if matrix.shape != masses.shape or not np.allclose(matrix, matrix.T):
                raise ValueError(
                    f"`{name}` must be symmetric and of the size of `mass` {masses.shape}; got shape {matrix.shape}."
                )
            nothing = 1e-12 * np.max(np.abs(matrix), initial=0.0)
            for i in range(len(matrix)):
                couplings = [((0, i + 1), float(np.sum(matrix[i])))]
                couplings += [((i + 1, j + 1), -float(matrix[i, j])) for j in range(i + 1, len(matrix))]
                terms += [law(value, at=at) for at, value in couplings if abs(value) > nothing]
        diagonal = np.diag(masses)
        return cls(diagonal if np.array_equal(np.diag(diagonal), masses) else masses, terms)

    @classmethod
    def from_modes(cls, frequencies: Any, damping_ratios: Any, shapes: Any, modal_masses: Any = None) -> "Structure":
        """Structure of as many modes as degrees of freedom.

        Parameters
        ----------
        frequencies, damping_ratios : (dof,) arrays
            Undamped natural frequencies [Hz] and damping ratios.
        shapes : (dof, dof) array
            One mode per column.
        modal_masses : (dof,) array, optional
            [kg]; 1 for mass-normalised shapes, the default.

        Raises
        ------
        ValueError
            If the numbers of modes differ, or the shapes are not independent.
        """
        shape = as_array(shapes, "shapes", 2)
        omega = 2 * np.pi * as_array(frequencies, "frequencies", 1)
        ratios = as_array(damping_ratios, "damping_ratios", 1)
        masses = np.ones_like(omega) if modal_masses is None else as_array(modal_masses, "modal_masses", 1)
        if np.any(omega < 0) or np.any(masses < 0):
            raise ValueError("`frequencies` and `modal_masses` must not be negative; one of them is.")
        for name, values in (("damping_ratios", ratios), ("shapes", shape), ("modal_masses", masses)):
            if any(size != omega.size for size in values.shape):
                raise ValueError(f"`{name}` must have {omega.size} modes, as `frequencies` has; got {values.shape}.")
        if np.linalg.matrix_rank(shape) < omega.size:
            raise ValueError("`shapes` must hold independent columns, one per mode; theirs are not.")
        inverse = np.linalg.inv(shape)  # M = Φ⁻ᵀ diag(m) Φ⁻¹, and so the others
        mass, stiffness, damping = (
            inverse.T @ np.diag(values) @ inverse for values in (masses, masses * omega**2, 2 * masses * ratios * omega)
        )
        return cls.from_matrices((mass + mass.T) / 2, (stiffness + stiffness.T) / 2, (damping + damping.T) / 2)

    def having(self, *, terms: Any = None, sensors: Any = None, trust: Any = None) -> "Structure":
        """The same plant with other terms, sensors or trust."""
        return Structure(
            self.mass,
            self.terms if terms is None else terms,
            self.sensors if sensors is None else sensors,
            self.trust if trust is None else trust,
            self.commands,
        )

    def commanded(self, at: int, stiffness: float, damping: float = 0.0) -> Self:
        """The structure, degree of freedom `at` of which a position loop holds where it is told to be.

        The loop pulls it to the commanded position as a spring does, and brakes it as a dashpot does. The force of a
        record is then the stiffness times the commanded position, as it was sent: a drive that acts on it late is
        found as such.

        Parameters
        ----------
        at : int
            Degree of freedom, from 1.
        stiffness, damping : float
            Gains of the loop for the position and for the velocity, in the units of a spring and a dashpot.

        Examples
        --------
        >>> joint = jfsm.Structure([0.04]).commanded(1, stiffness=60.0, damping=3.0)
        >>> record = jfsm.Record(t, force=60.0 * wanted, displacement=angle, units={"displacement": "rad"})
        """
        loop = (LinearStiffness(stiffness, at=(0, at)), LinearDamping(damping, at=(0, at)))
        held = self.having(terms=(*self.terms, *(term for term in loop if float(term.values[0]))))
        return cast(Self, held._told(_commands((*self.commands, at), self.dof)))

    def _told(self, commands: tuple[int, ...]) -> "Structure":
        """The same plant, in which the forces of these degrees of freedom are commands."""
        return Structure(self.mass, self.terms, self.sensors, self.trust, commands)

    @property
    def dof(self) -> int:
        """Number of degrees of freedom."""
        return int(self.mass.shape[0])

    @property
    def links(self) -> tuple[tuple[int, int], ...]:
        """Places that already carry a term, in the order of their first term."""
        return tuple(dict.fromkeys(term.at for term in self.terms))

    def stiffness_of(self, link: tuple[int, int]) -> float:
        """Stiffness of all linear springs of a link together."""
        return sum(float(t.k) for t in self.terms if isinstance(t, LinearStiffness) and set(t.at) == set(link))

    def untied(self, kind: type[AbstractTerm]) -> list[tuple[int, int]]:
        """Pairs of degrees of freedom that no term of a kind ties: neighbours, theirs, and each with the ground (0)."""
        tied = {frozenset(t.at) for t in self.terms if isinstance(t, kind)}
        near = {frozenset(link) for link in self.links}
        further = {one ^ other for one in near for other in near if len(one & other) == 1}
        ground = {frozenset((0, j)) for j in range(1, self.dof + 1)}
        return sorted((min(pair), max(pair)) for pair in (near | further | ground) - tied)

    def rests(self) -> list[tuple[tuple[int, int], float]]:
        """Links and the relative displacements, other than none, at which one of their laws lets them rest."""
        return [(law.at, rest) for law in self.terms for rest in law.rests(self.stiffness_of(law.at))]

    def __add__(self, other: AbstractTerm | AbstractSensor) -> "Structure":
        if isinstance(other, AbstractTerm):
            return self.having(terms=(*self.terms, other))
        if isinstance(other, AbstractSensor):
            return self.having(sensors=(*self.sensors, other))
        return NotImplemented

    def without(self, part: AbstractTerm | AbstractSensor) -> "Structure":
        """The structure less one of its terms or sensors."""
        terms = [term for term in self.terms if term is not part]
        sensors = [sensor for sensor in self.sensors if sensor is not part]
        if len(terms) + len(sensors) == len(self.terms) + len(self.sensors):
            raise ValueError(f"`part` must be one of the structure's own terms or sensors; got {part!r}.")
        return self.having(terms=terms, sensors=sensors)

    def uncertain(self, **relative: float) -> "Structure":
        """The same structure with stated trust: ``uncertain(stiffness=0.05)`` says stiffnesses are right to 5 %."""
        for name, value in relative.items():
            if not _number(name, value) > 0:
                raise ValueError(f"The uncertainty of `{name}` must be a positive share such as 0.05; got {value!r}.")
            if not self.select(name):
                raise ValueError(f"`{name}` names no parameter of this structure; it has {', '.join(self.values())}.")
        return self.having(trust={**dict(self.trust), **relative})

    def entries(self) -> dict[str, tuple[Parameter, Float[Array, ""]]]:
        """Every number of the structure by path (``mass@1``, ``stiffness@0-1.k``), with what it is."""
        found = self._own_entries()
        for part in (*self.terms, *self.sensors):
            for parameter in part.parameters:
                path = base = f"{part.kind}@{part.place}.{parameter.name}"
                count = 2
                while path in found:  # two terms of one law at one link
                    path, count = f"{base}#{count}", count + 1
                found[path] = (parameter, getattr(part, parameter.name))
        return found

    def _own_entries(self) -> dict[str, tuple[Parameter, Float[Array, ""]]]:
        """The numbers of the plant itself."""
        diagonal = self.mass if self.mass.ndim == 1 else jnp.diag(self.mass)
        return {f"mass@{i + 1}": (MASS, diagonal[i]) for i in range(self.dof)}

    def values(self) -> dict[str, float]:
        """Every number of the structure by path."""
        return {path: float(value) for path, (_, value) in self.entries().items()}

    def select(self, name: str) -> tuple[str, ...]:
        """Paths that `name` means: a path itself, or a bare kind such as ``"mass"`` or ``"stiffness@0-1"``."""
        return tuple(path for path in self.entries() if path == name or re.match(rf"{re.escape(name)}[@.]", path))

    def with_values(self, values: Mapping[str, float]) -> "Structure":
        """The same structure with other numbers, by path."""
        if not isinstance(values, Mapping):
            raise TypeError(f"`values` must be numbers by path, as {{'mass@1': 2.0}}; got {values!r}.")
        known = self.entries()
        unknown = [path for path in values if path not in known]
        if unknown:
            raise ValueError(f"{unknown[0]!r} names no parameter of this structure; it has {', '.join(known)}.")
        values = {path: _number(path, value) for path, value in values.items()}
        paths = iter(known)
        own = [values.get(next(paths)) for _ in self._own_entries()]
        parts = []
        for part in (*self.terms, *self.sensors):
            for parameter in part.parameters:
                value = values.get(next(paths))
                if value is not None:
                    part = replace(part, **{parameter.name: value})  # checked like a new one
            parts.append(part)
        n = len(self.terms)
        return self._with_own_values(own, parts[:n], parts[n:])

    def _with_own_values(self, values: list[Any], terms: list[Any], sensors: list[Any]) -> "Structure":
        """The same plant with other parts and with these values, in the order of `_own_entries`, where they are not
        None."""
        mass = np.array(self.mass)
        for i, value in enumerate(values):
            if value is not None:
                mass[i if mass.ndim == 1 else (i, i)] = value
        return Structure(mass, terms, sensors, self.trust, self.commands)

    def describe(self, units: Mapping[str, str] | None = None) -> list[str]:
        """One line per number, with units."""
        force, length = (units or {}).get("force", "N"), (units or {}).get("displacement", "m")
        lines = []
        for path, (parameter, value) in self.entries().items():
            lines.append(f"{path} = {float(value):.6g} {parameter.unit(force, length)}")
        return lines + [f"{term.kind}@{term.place}" for term in self.terms if not term.parameters]

    def save(self, path: str | Path) -> None:
        """Write the structure as TOML; the file appears whole or not at all."""
        from ._toml import save

        save(self, path)

    def to_toml(self) -> str:
        """What `save` writes, as text.

        Raises
        ------
        ValueError
            If it holds a map or a function, which need more than a text.
        """
        from ._toml import dumps

        return dumps(self)

    @classmethod
    def from_toml(cls, text: str) -> "Structure":
        """The structure that a text of `to_toml` is of."""
        from ._toml import loads

        return loads(text, Path("text"))

    def to_python(self, path: str | Path | None = None, stick_speed: float | None = None) -> str:
        """The equation of motion as a file of Python that needs NumPy and SciPy alone; written to `path` if given.

        It holds every number by name with its unit, ``acceleration(t, q, v, force)``, and ``simulate(time, force)``.

        Parameters
        ----------
        path : path, optional
        stick_speed : float, optional
            Speed [m/s] below which friction that sticks is smooth instead: its sliding force times tanh(w/stick_speed).
            By default a thousandth of the speed of a mass that its springs can only just move against the friction.

        Raises
        ------
        ValueError
            If it moves by a function of yours, or has a map, a delay or a law whose operations no text is known of.

        Warns
        -----
        UserWarning
            Of what the file does otherwise than `simulate`: smooth friction, sensors that are left out. It says so,
            too.
        """
        from .export import equations_of, exported, python_text

        equations = equations_of(self, stick_speed)
        return exported(equations, python_text(equations), path)

    def to_matlab(self, path: str | Path | None = None, stick_speed: float | None = None) -> str:
        """The equation of motion as a function file of MATLAB and Octave, for ``ode45``; as `to_python`.

        The function is called as the file is, without its ending; ``equation_of_motion`` without a path.

        Raises
        ------
        ValueError
            As of `to_python`, and if MATLAB cannot call a function as the file is called.
        """
        from .export import equations_of, exported, function_name, matlab_text

        equations = equations_of(self, stick_speed)
        return exported(equations, matlab_text(equations, function_name(path)), path)

    def to_table(
        self, displacement: Any, velocity: Any = (0.0,), at: Any = None, path: str | Path | None = None
    ) -> "ForceTable":
        """Force of the terms at a link over its displacement and velocity; written to `path`, a csv, if given.

        Friction that sticks is zero at zero velocity. A map is a guess where it has no readings.

        Parameters
        ----------
        displacement, velocity : (n,), (m,) arrays
            Of the link's ends, relative to each other.
        at : (int, int), optional
            The link; by default the only one that has a term.
        path : path, optional

        Returns
        -------
        ForceTable
            Its ``displacement``, ``velocity``, ``force`` (n, m), ``to_dataframe()`` and ``write(path)``.

        Raises
        ------
        ValueError
            If no term is there, or one has a memory, a delay, or changes with time; names it.
        """
        from .export import table_of

        table = table_of(self.terms, displacement, velocity, at)
        if path is not None:
            table.write(path)
        return table

    @classmethod
    def load(cls, path: str | Path) -> "Structure":
        """Read a structure that `save` wrote, or one written by hand."""
        from ._toml import load

        return load(path)


def _number(name: str, given: Any) -> float:
    try:
        return float("no" if isinstance(given, str) else given)
    except (TypeError, ValueError):
        raise TypeError(f"`{name}` must be one number; got {given!r}.") from None


def _parts(given: Any, name: str, kind: type) -> tuple[Any, ...]:
    """Terms or sensor effects in their order, one alone among them."""
    if isinstance(given, kind):
        return (given,)
    try:
        return tuple(given)
    except TypeError:
        raise TypeError(f"`{name}` must be a list; got {given!r}.") from None


def _commands(given: Iterable[int], dof: int) -> tuple[int, ...]:
    """Degrees of freedom that are commanded, each once."""
    found = tuple(dict.fromkeys(given))
    for at in found:
        if isinstance(at, bool) or not isinstance(at, int | np.integer) or not 1 <= at <= dof:
            raise ValueError(f"`commands` must be degrees of freedom from 1 to {dof}; got {at!r}.")
    return tuple(map(int, found))


def _check_mass(mass: np.ndarray) -> None:
    if mass.ndim == 1:
        if mass.size == 0 or np.any(mass < 0):
            raise ValueError(f"`mass` must hold at least one mass, none negative; got {mass.tolist()}.")
        return
    if mass.size == 0 or mass.shape[0] != mass.shape[1] or not np.allclose(mass, mass.T):
        raise ValueError(f"`mass` as a matrix must be square and symmetric; got shape {mass.shape}.")
    smallest = float(np.linalg.eigvalsh(mass)[0])
    if smallest <= 0:
        raise ValueError(f"`mass` as a matrix must be positive definite; its smallest eigenvalue is {smallest:g}.")
