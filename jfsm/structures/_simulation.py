"""A simulation of the user's own: a function that answers a force with an acceleration."""

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._types import as_numbers, is_traced
from ._own_motion import Acceleration, EvaluatedMotion, OwnMotion
from ._runs import Runs
from ._sensors import AbstractSensor
from ._structure import Structure
from ._term import AbstractTerm, Parameter

_ADDITIVE = 1e-6
"""Departure from additivity in the force, relative, that is rounding."""
_SYMMETRIC = 1e-6
_PROBES = ((0.0, 0.0, 0.0), (0.1, 0.0, 0.5), (-0.2, 0.3, 1.0))
"""Displacement, velocity and instant at which a function is tried."""


class Simulation(Structure):
    """A plant that is not made of masses, springs and dashpots: any function that JAX can trace.

    Terms and sensors are added as to a structure. A term at (0, j) acts on coordinate j, one at (i, j) between two
    coordinates.

    Parameters
    ----------
    acceleration : callable
        ``acceleration(q, v, force, t, p)`` gives the accelerations (dof,) at coordinates `q` (dof,), velocities `v`
        (dof,), generalised forces `force` (dof,), and the instant `t` [s]. It is additive in the force, has no memory
        and no jumps, and is written with ``jax.numpy``; `p` holds the numbers by name.
    dof : int
        Number of coordinates.
    parameters : mapping of str to number, optional
        Numbers of the function that a fit may change, each by the name under which it is found in `p`.
    terms, sensors, trust, commands
        As of a `Structure`.

    Raises
    ------
    TypeError
        If `acceleration` cannot be called, or JAX cannot trace it.
    ValueError
        If it gives another shape than (dof,), a number that is not finite, something else at a second call, or is not
        additive in the force; or if accelerations do not follow forces as those of masses do, by a symmetric matrix
        that is positive definite.

    Examples
    --------
    A pendulum of 1 kg on a rod of 0.5 m, in N m and rad:

    >>> import jax; jax.config.update("jax_enable_x64", True)
    >>> import jax.numpy as jnp, jfsm
    >>> def pendulum(q, v, force, t, p):
    ...     return (force - p["damping"] * v - 9.81 * 0.5 * jnp.sin(q)) / p["inertia"]
    >>> model = jfsm.Simulation(pendulum, dof=1, parameters={"inertia": 0.25, "damping": 0.01})
    >>> model = model + jfsm.Coulomb(0.05, at=(0, 1))
    """

    def __init__(
        self,
        acceleration: Acceleration | OwnMotion | EvaluatedMotion,
        dof: int,
        parameters: Mapping[str, Any] | None = None,
        terms: Iterable[AbstractTerm] = (),
        sensors: Iterable[AbstractSensor] = (),
        trust: Mapping[str, float] | Iterable[tuple[str, float]] = (),
        commands: Iterable[int] = (),
    ):
        numbers = _numbers_of(parameters)
        if isinstance(acceleration, OwnMotion | EvaluatedMotion):
            own = acceleration  # tried before
        else:
            own = OwnMotion(acceleration, tuple(parameters or {}))
            _check(acceleration, "acceleration", dof, own.names)
            _try(own, _of_one(own, numbers, dof), numbers, dof)
        mass = (jnp if is_traced(numbers) else np).linalg.inv(_answer(own, numbers, jnp.zeros(dof)))
        mass = (mass + mass.T) / 2
        super().__init__(mass, terms, sensors, trust, commands)
        self.own, self.own_numbers = own, numbers

    @staticmethod
    def from_accelerations(
        accelerations: Acceleration,
        dof: int,
        parameters: Mapping[str, Any] | None = None,
        terms: Iterable[AbstractTerm] = (),
        sensors: Iterable[AbstractSensor] = (),
        trust: Mapping[str, float] | Iterable[tuple[str, float]] = (),
    ) -> "Simulation":
        """A plant whose accelerations can be asked for in any state, by a program that JAX cannot trace.

        A fit asks for them near the measured motion, so that a record must show the displacement of every coordinate.

        Parameters
        ----------
        accelerations : callable
            ``accelerations(q, v, force, t, p)`` gives the accelerations (n, dof) in `n` states at once, as NumPy
            arrays: coordinates `q` (n, dof), velocities `v` (n, dof), generalised forces `force` (n, dof), and instants
            `t` (n,) [s]; `p` holds the numbers by name. It is additive in the force, and has no memory and no jumps.
        dof, parameters, terms, sensors, trust
            As of a `Simulation`.

        Raises
        ------
        TypeError, ValueError
            As of a `Simulation`.

        Examples
        --------
        >>> import jax; jax.config.update("jax_enable_x64", True)
        >>> import numpy as np, jfsm
        >>> def pendulums(q, v, force, t, p):
        ...     return (force - 0.01 * v - 9.81 * 0.5 * np.sin(q)) / p["inertia"]
        >>> model = jfsm.Simulation.from_accelerations(pendulums, dof=1, parameters={"inertia": 0.25})
        """
        own, numbers = EvaluatedMotion(accelerations, tuple(parameters or {})), _numbers_of(parameters)
        _check(accelerations, "accelerations", dof, own.names)
        _try(own, _of_many(own, numbers, dof), numbers, dof)
        return Simulation(own, dof, parameters, terms, sensors, trust)

    @staticmethod
    def from_runs(
        run: Callable[..., Any], places: Iterable[tuple[int, int]] = (), form: Structure | None = None
    ) -> Runs:
        """A simulation that can only be run, for `diagnose`, which finds a structure that stands for it.

        Parameters
        ----------
        run : callable
            ``run(record)`` gives the motion that the simulation makes of what drives the record: a `Record`, a
            `Response`, or a mapping of ``"displacement"``, ``"velocity"`` or ``"acceleration"`` to (n,) or (n, dof)
            arrays, or to ``{dof: (n,)}``, on the record's clock. It repeats itself, and does not know the force before
            it acts.
        places : links, optional
            Where it takes forces beside those of the record. It is then called as ``run(record, extra)``, too: `extra`
            holds samples (n,) [N] by link, ``{(1, 2): samples}``, each force pushing the link's second end and pulling
            its first; (0, j) is a force on degree of freedom j. What is found is then run in the simulation itself, if
            it lies at these places, or where a force of the record acts, and a run shows the displacement of every
            degree of freedom, measured or not.
        form : Structure, optional
            Masses and links that the simulation has, whose values need not be right; by default those that a run shows
            between all that moves. Where no force is measured, its first mass sets the scale.

        Examples
        --------
        >>> def run(record):
        ...     return {"displacement": my_code(record.time, record.force)}
        >>> d = jfsm.diagnose(record, jfsm.Simulation.from_runs(run))
        >>> def run(record, extra=None):
        ...     lower = 0.0 if extra is None else extra[0, 1]
        ...     return {"displacement": my_code(record.time, record.force, lower)}
        >>> d = jfsm.diagnose(record, jfsm.Simulation.from_runs(run, places=[(0, 1)]))
        """
        return Runs(run, places, form)

    @property
    def links(self) -> tuple[tuple[int, int], ...]:
        """Places of laws: every coordinate, and where other terms act."""
        joints = ((0, j) for j in range(1, self.dof + 1))
        return tuple(dict.fromkeys([*joints, *(term.at for term in self.terms)]))

    def having(self, *, terms: Any = None, sensors: Any = None, trust: Any = None) -> "Simulation":
        return self._again(self.own_numbers, *(
            mine if given is None else given
            for given, mine in ((terms, self.terms), (sensors, self.sensors), (trust, self.trust))
        ))  # fmt: skip

    def save(self, path: Any) -> None:
        """Refused: a function has no place in a TOML file."""
        self.to_toml()

    def to_toml(self) -> str:
        """Refused: a function has no place in a TOML file."""
        raise ValueError(
            "A simulation moves by a function of yours and cannot be written as TOML; keep the Python file that makes "
            "it. Its numbers are in `values()`."
        )

    def _again(self, numbers: Any, terms: Any, sensors: Any, trust: Any) -> "Simulation":
        """The same function, which was tried before."""
        assert self.own is not None
        named = dict(zip(self.own.names, numbers, strict=True))
        return Simulation(self.own, self.dof, named, terms, sensors, trust, self.commands)

    def _told(self, commands: tuple[int, ...]) -> "Simulation":
        assert self.own is not None
        named = dict(zip(self.own.names, self.own_numbers, strict=True))
        return Simulation(self.own, self.dof, named, self.terms, self.sensors, self.trust, commands)

    def _own_entries(self) -> dict[str, tuple[Parameter, Float[Array, ""]]]:
        names = self.own.names if self.own else ()
        return {name: (Parameter(name), self.own_numbers[i]) for i, name in enumerate(names)}

    def _with_own_values(self, values: list[Any], terms: list[Any], sensors: list[Any]) -> "Simulation":
        numbers = [mine if new is None else new for mine, new in zip(self.own_numbers, values, strict=True)]
        return self._again(numbers, terms, sensors, self.trust)


def _check(function: Any, name: str, dof: Any, names: tuple[str, ...]) -> None:
    """Refuse what is no function, no number of coordinates, or no names."""
    if not callable(function):
        raise TypeError(
            f"`{name}` must be a function of (q, v, force, t, p) that gives accelerations; got {function!r}."
        )
    if isinstance(dof, bool) or not isinstance(dof, int | np.integer) or dof < 1:
        raise ValueError(f"`dof` must be the number of coordinates, at least 1; got {dof!r}.")
    for own in names:
        if not isinstance(own, str) or not own.isidentifier():
            raise ValueError(f"`parameters` must have names such as length or k_2; got {own!r}.")


def _numbers_of(parameters: Mapping[str, Any] | None) -> Float[Array, " own"]:
    values = [as_numbers(value, f"parameters {name}", 0) for name, value in (parameters or {}).items()]
    return jnp.stack([jnp.asarray(value) for value in values]) if values else jnp.zeros(0)


def _of_one(own: OwnMotion, numbers: Float[Array, " own"], dof: int) -> Callable[..., np.ndarray]:
    """The acceleration in a state, by a program, if JAX can make one of it that gives the promised shape."""
    none, ask = jnp.zeros(dof), jax.jit(partial(OwnMotion.__call__, own))
    try:
        shape = jax.eval_shape(ask, numbers, none, none, none, jnp.zeros(())).shape
    except jax.errors.JAXTypeError as error:
        raise TypeError(
            "`acceleration` must be a function that JAX can trace: written with jax.numpy, with jnp.where in place of "
            "`if`. One that is not goes into jfsm.Simulation.from_accelerations. JAX says: "
            f"{str(error).splitlines()[0]}"
        ) from error
    if shape != (dof,):
        raise ValueError(
            f"`acceleration` must give one acceleration per coordinate, shape ({dof},); it gives shape {shape}."
        )
    return lambda *state: np.asarray(ask(numbers, *map(jnp.asarray, state)))


def _of_many(own: EvaluatedMotion, numbers: Float[Array, " own"], dof: int) -> Callable[..., np.ndarray]:
    """The acceleration in a state, asked for in rows of two, if the function gives the promised shape."""

    def ask(q: Any, v: Any, force: Any, t: Any) -> np.ndarray:
        given, x, w, pushed, time = (
            np.repeat(np.asarray(part, float)[None], 2, 0) for part in (numbers, q, v, force, t)
        )
        found = own.many(given, x, w, pushed, time)
        if found.shape != (2, dof):
            raise ValueError(
                f"`accelerations` must give a row of {dof} accelerations per state, for two states shape (2, {dof}); "
                f"it gives shape {found.shape}."
            )
        return found[1]

    return ask


def _try(
    own: OwnMotion | EvaluatedMotion, ask: Callable[..., np.ndarray], numbers: Float[Array, " own"], dof: int
) -> None:
    """Refuse a function that does not keep what is promised of it."""
    name = "acceleration" if isinstance(own, OwnMotion) else "accelerations"
    some = np.linspace(1.0, 2.0, dof)
    for x, v, t in _PROBES:
        q, w = np.full(dof, x), np.full(dof, v)
        free, pushed, twice, opposite = (ask(q, w, share * some, t) for share in (0.0, 1.0, 2.0, -1.0))
        if not np.all(np.isfinite([free, pushed, twice, opposite])):
            raise ValueError(
                f"`{name}` must be finite; at q = {x:g}, v = {v:g}, t = {t:g} s it gives {pushed.tolist()}."
            )
        state = [jnp.asarray(part) for part in (q, w, np.zeros(dof), t)]
        once, again = (np.asarray(own(numbers, *state)) for _ in range(2))
        if not np.array_equal(once, again):
            raise ValueError(f"`{name}` must give the same whenever it is asked the same; it does not.")
        bend = max(np.max(np.abs(twice - 2 * pushed + free)), np.max(np.abs(pushed + opposite - 2 * free)))
        if bend > _ADDITIVE * max(np.max(np.abs(pushed - free)), np.max(np.abs(free)), 1e-300):
            raise ValueError(
                f"`{name}` must be additive in `force`: a(f1 + f2) - a(f1) - a(f2) + a(0) = 0. It departs from "
                f"that by {bend:.3g}. Friction and limits inside the function are better added as terms, for example "
                "jfsm.Coulomb(F, at=(0, 1))."
            )
        answer = np.asarray(_answer(own, numbers, jnp.full(dof, x)))
        skew = np.max(np.abs(answer - answer.T))
        if skew > _SYMMETRIC * np.max(np.abs(answer)) or np.min(np.linalg.eigvalsh((answer + answer.T) / 2)) <= 0:
            raise ValueError(
                f"`{name}` must answer forces as masses do, by a symmetric positive definite matrix; at "
                f"q = {x:g} that of accelerations per unit of force is {answer.tolist()}. Forces are generalised: each "
                "acts along its own coordinate."
            )


@eqx.filter_jit
def _answer(
    own: OwnMotion | EvaluatedMotion, numbers: Float[Array, " own"], q: Float[Array, " dof"]
) -> Float[Array, "dof dof"]:
    """Accelerations per unit of force of a plant that stands still."""
    return own.answer(numbers, q, jnp.zeros_like(q), jnp.zeros(()))
