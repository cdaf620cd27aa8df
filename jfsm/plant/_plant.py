"""A structure lowered to arrays, the input of compiled programs.

A program is keyed by the number of degrees of freedom, of slots and of channels, and by the table of laws, not by
the law in a slot, nor by its place, sign or values: those are data.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from .._types import Array, is_traced, known
from ..structures import (
    DELAYED_TERMS,
    FRICTION_TERMS,
    MEMORY_TERMS,
    SMOOTH_TERMS,
    AbstractFriction,
    AccelerationBias,
    ChannelDelay,
    Clipping,
    EvaluatedMotion,
    ForceDelay,
    LinearDamping,
    LinearStiffness,
    MapTerm,
    Offset,
    OwnMotion,
    StiffnessDrop,
    Structure,
)

Channel = tuple[str, int]

LAW_PARAMETERS = 5
"""Width of a slot's row of numbers; laws with fewer leave the rest at zero."""
HIDDEN_STATES = 2
"""Width of a slot's row of hidden states; laws with fewer leave the rest at zero."""


_REACH = 64
"""Least length of a delay buffer, in samples."""


class Grid(NamedTuple):
    """Sample interval [s] and steps per sample of a fixed scheme."""

    dt: float
    substeps: int

    @property
    def ramp(self) -> float:
        """Time [s] over which a jump at an instant is spread: two steps, so that the scheme sees where it falls."""
        return 2 * self.dt / self.substeps

    def reach(self, delayed: Sequence[Any]) -> int:
        """Length of the delay buffer for these terms in samples, a power of two."""
        longest = max((float(known(term.delay, "Delays")) for term in delayed), default=0.0)
        return max(_REACH, 2 ** math.ceil(math.log2(longest / self.dt + 3)))


class Slots(eqx.Module):
    """Slots for laws of one class: one compiled program serves all laws of the class.

    An empty slot has direction zero and exerts no force.
    """

    kind: Int[Array, " slots"]
    parameters: Float[Array, "*lanes slots width"]
    direction: Float[Array, "*lanes slots dof"]
    laws: tuple[type, ...] = eqx.field(static=True)

    def __len__(self) -> int:
        return self.kind.shape[0]

    def term(self, law: type, parameters: Float[Array, " width"]) -> Any:
        """Term of a law of this class with a row of parameters."""
        count = len(law.parameters) + (law is StiffnessDrop)
        return law(*(parameters[i] for i in range(count)), at=(0, 1))

    def choose(self, slot: int, ask: Callable[[Any], Any]) -> Any:
        """Value of `ask` at the term in a slot."""
        branches = [lambda p, law=law: ask(self.term(law, p)) for law in self.laws]
        if len(branches) == 1:
            return branches[0](self.parameters[slot])
        return jax.lax.switch(self.kind[slot], branches, self.parameters[slot])

    def alone(self) -> "Slots":
        """The same slots, with their own laws as the table: a program of its own, and many times faster."""
        kinds = self.kind.tolist()
        present = list(dict.fromkeys(kinds))
        if not present:
            return self
        kind = jnp.asarray([present.index(k) for k in kinds], dtype=self.kind.dtype)
        return replace(self, kind=kind, laws=tuple(self.laws[k] for k in present))

    def motion(
        self, slot: int, x: Float[Array, " dof"], v: Float[Array, " dof"]
    ) -> tuple[Float[Array, ""], Float[Array, ""]]:
        """Relative displacement and velocity of a slot's link."""
        return jnp.sum(self.direction[slot] * x), jnp.sum(self.direction[slot] * v)


class MapSlot(eqx.Module):
    """A learned map acting along one direction."""

    force_map: Any
    direction: Float[Array, " dof"]


class Local(eqx.Module):
    """How a plant of its own motion moves within a sample, on nodes from its beginning to its end.

    What is not inertia needs `force` at a motion `x`, `v`, and `stiffness` and `damping` times what the plant's own is
    farther on: up to `reach` (2, dof), beyond which the slopes say nothing.
    """

    mass: Float[Array, "*lanes nodes dof dof"]
    force: Float[Array, "*lanes nodes dof"]
    stiffness: Float[Array, "*lanes nodes dof dof"]
    damping: Float[Array, "*lanes nodes dof dof"]
    x: Float[Array, "*lanes nodes dof"]
    v: Float[Array, "*lanes nodes dof"]
    reach: Float[Array, "*lanes 2 dof"]
    time: Float[Array, "*lanes"]
    step: Float[Array, "*lanes"]

    def weights(self, t: Float[Array, ""]) -> Float[Array, " nodes"]:
        """Those of the nodes at an instant between them."""
        last = self.mass.shape[0] - 1
        place = jnp.clip(last * (t - self.time) / self.step, 0.0, last)
        return jnp.maximum(1.0 - jnp.abs(place - jnp.arange(last + 1)), 0.0)

    def mass_at(self, t: Float[Array, ""]) -> Float[Array, "dof dof"]:
        """Mass matrix at an instant."""
        return jnp.sum(self.weights(t)[:, None, None] * self.mass, 0)

    def force_at(self, x: Float[Array, " dof"], v: Float[Array, " dof"], t: Float[Array, ""]) -> Float[Array, " dof"]:
        """Force that all but the inertia needs."""
        farther, most = (x[None, :] - self.x, v[None, :] - self.v), self.reach[:, None, :]
        dx, dv = (jnp.maximum(jnp.minimum(q, r), -r) for q, r in zip(farther, most, strict=True))
        by_node = self.force + jnp.sum(self.stiffness * dx[:, None, :] + self.damping * dv[:, None, :], 2)
        return jnp.sum(self.weights(t)[:, None] * by_node, 0)


class Plant(eqx.Module):
    """Arrays of a structure and of its sensors, for one list of response channels.

    `force_gain`, `force_offset` and `channel_offset` are empty where every lane has its own elsewhere, `force_delay`
    and `channel_delay` without delayed sensors: delays have programs of their own. The plant of a simulation moves by
    its `own` function of `own_numbers`, `mass` is the mass matrix at rest, and `behind` what of it moves behind
    springs, of which the function knows nothing (empty without memories and in other plants: XLA cannot compile kernels
    with arrays that take no part); the terms act beside. Within a sample of a measured motion it moves as `local` says,
    in place of the function.
    `late_channel` holds the channel of each channel delay. Delayed forces reach back at most `reach` samples. With
    `rolled` stages of a step the program is a third smaller, as fast for one motion and its derivatives, and half as
    fast for many motions. Plants side by side have a leading axis of lanes on every array but those of whole numbers.
    """

    mass: Float[Array, "*lanes dof dof"]
    damping: Float[Array, "*lanes dof dof"]
    stiffness: Float[Array, "*lanes dof dof"]
    smooth: Slots
    friction: Slots
    memory: Slots
    delayed: Slots
    maps: tuple[MapSlot, ...]
    force_gain: Float[Array, "*lanes _"]
    force_offset: Float[Array, "*lanes _"]
    channel_gain: Float[Array, "*lanes channels"]
    channel_offset: Float[Array, "*lanes _"]
    force_delay: Float[Array, "*lanes dof_or_none"]
    channel_delay: Float[Array, "*lanes late"]
    late_channel: Int[Array, " late"]
    own_numbers: Float[Array, "*lanes own"]
    behind: Float[Array, "*lanes parts parts"]
    own: OwnMotion | EvaluatedMotion | None = eqx.field(static=True)
    reach: int = eqx.field(static=True)
    rolled: bool = eqx.field(static=True)
    local: Local | None = None

    @property
    def dof(self) -> int:
        return self.mass.shape[0]

    @property
    def whole_mass(self) -> Float[Array, "*lanes dof dof"]:
        """The mass matrix with what moves behind springs, as a function of its own knows it."""
        return self.mass + self.behind if self.behind.size else self.mass

    @property
    def elementary(self) -> bool:
        """Whether it needs sums, products and functions alone: no delayed forces, maps or users' laws."""
        tables = (SMOOTH_TERMS, FRICTION_TERMS, MEMORY_TERMS)
        known = all(s.laws == table for s, table in zip((self.smooth, self.friction, self.memory), tables, strict=True))
        return known and not self.maps and not len(self.delayed) and self.own is None

    @property
    def laws(self) -> int:
        """Number of terms, without linear springs and dashpots; a function of its own is one."""
        terms = sum(map(len, (self.smooth, self.friction, self.memory, self.delayed, self.maps)))
        return terms + (self.own is not None)

    @property
    def hidden(self) -> int:
        """Number of hidden states."""
        return len(self.memory) * hidden_width(self.memory)


class Observation(eqx.Module):
    """Observation of the state by response channels: the kind of each, and a row that selects its degree of freedom."""

    select: Float[Array, "channels dof"]
    kinds: tuple[str, ...] = eqx.field(static=True)


def observation_of(channels: Sequence[Channel], dof: int) -> Observation:
    """Observation by response channels (kind, degree of freedom)."""
    rows = np.zeros((len(channels), dof))
    for i, (_, j) in enumerate(channels):
        rows[i, j - 1] = 1.0
    return Observation(jnp.asarray(rows), tuple(kind for kind, _ in channels))


def direction(at: tuple[int, int], dof: int) -> Float[np.ndarray, " dof"]:
    """Row B of a link: d = x_j - x_i, ground at rest."""
    row = np.zeros(dof)
    for index, sign in ((at[0], -1.0), (at[1], 1.0)):
        if index:
            row[index - 1] += sign
    return row


def state_matrix(
    stiffness: Float[np.ndarray, "*lanes dof dof"], damping: Float[np.ndarray, "*lanes dof dof"]
) -> Float[np.ndarray, "*lanes state state"]:
    """Matrix of y' = matrix y, y = (x, v), from stiffness and damping (..., dof, dof) over the mass."""
    one = np.broadcast_to(np.eye(stiffness.shape[-1]), stiffness.shape)
    return np.block([[np.zeros_like(stiffness), one], [-stiffness, -damping]])


def hidden_width(memory: Slots) -> int:
    """Hidden states per slot."""
    return max(HIDDEN_STATES, *(law.states for law in memory.laws))


def alone(plant: Plant) -> Plant:
    """The plant with tables of its own laws, and no others."""
    classes = ("smooth", "friction", "memory", "delayed")
    return replace(plant, **{name: getattr(plant, name).alone() for name in classes})


def lower(structure: Structure, channels: Sequence[Channel] = (), **how: Any) -> Plant:
    """Plant of a structure, on the device; see `numbers_of`."""
    arrays, rest = eqx.partition(numbers_of(structure, channels, **how), lambda leaf: isinstance(leaf, np.ndarray))
    return eqx.combine(jax.device_put(arrays), rest)


def numbers_of(
    structure: Structure,
    channels: Sequence[Channel] = (),
    *,
    smooth_slots: int = 0,
    grid: Grid | None = None,
    rolled: bool = False,
) -> Plant:
    """Plant of a structure, as NumPy arrays; traced numbers make their arrays traced.

    Parameters
    ----------
    structure : Structure
    channels : sequence of (kind, degree of freedom)
        Response channels, in the order of the record.
    smooth_slots : int
        Least number of slots for smooth laws; more are made where the structure needs them.
    grid : Grid, optional
        Steps of the scheme that the plant is for; None for one that finds its own.
    rolled : bool
        Whether the stages of a step are a loop, for a program of derivatives.
    """
    dof = structure.dof
    mass = structure.mass if is_traced(structure.mass) else np.asarray(structure.mass)
    mass = (jnp if is_traced(mass) else np).diag(mass) if mass.ndim == 1 else mass
    matrices: dict[type, Any] = {LinearStiffness: np.zeros((dof, dof)), LinearDamping: np.zeros((dof, dof))}
    laws = laws_of(structure)
    for term in laws.linear:
        row = direction(term.at, dof)
        matrices[type(term)] = matrices[type(term)] + _number(term.values[0]) * np.outer(row, row)
    behind: Any = np.zeros((dof, dof))
    for term in laws.memory:
        if term.takes:
            row = direction(term.at, dof)
            behind = behind + _number(getattr(term, term.takes)) * np.outer(row, row)
    sensed: dict[str, Any] = {name: np.zeros(dof) for name in ("force_gain", "force_offset", "force_delay")}
    sensed |= {name: np.zeros(len(channels)) for name in ("channel_gain", "channel_offset")}
    channel_delay = {}
    for sensor in structure.sensors:
        if isinstance(sensor, Clipping):
            continue  # acts on readings, not on the motion
        whose, place = "force", sensor.at[1] - 1
        if sensor.at[0] != "force":
            if sensor.at not in channels:
                continue
            whose, place = "channel", list(channels).index(sensor.at)
            if isinstance(sensor, ChannelDelay):
                channel_delay[place] = channel_delay.get(place, 0.0) + sensor.value
                continue
        late, shifted = isinstance(sensor, ForceDelay), isinstance(sensor, Offset | AccelerationBias)
        name = f"{whose}_{'delay' if late else 'offset' if shifted else 'gain'}"
        sensed[name] = _with(sensed[name], place, sensed[name][place] + sensor.value)
    kinds = {type(sensor) for sensor in structure.sensors}
    arrays: dict[str, Any] = {
        "mass": mass - behind,
        "behind": behind if structure.own is not None and laws.memory else np.zeros((0, 0)),
        "damping": matrices[LinearDamping],
        "stiffness": matrices[LinearStiffness],
        **sensed,
        "force_delay": sensed["force_delay"] if any(issubclass(kind, ForceDelay) for kind in kinds) else np.zeros(0),
        "channel_delay": np.array(list(channel_delay.values()), dtype=float),
        "late_channel": np.array(list(channel_delay), dtype=int),
        "own_numbers": structure.own_numbers if is_traced(structure.own_numbers) else np.asarray(structure.own_numbers),
    }
    return Plant(
        **arrays,
        smooth=_slots(laws.smooth, SMOOTH_TERMS, smooth_slots, dof, 0.0 if grid is None else grid.ramp),
        friction=_slots(laws.friction, FRICTION_TERMS, 0, dof),
        memory=_slots(laws.memory, MEMORY_TERMS, 0, dof),
        delayed=_slots(laws.delayed, DELAYED_TERMS, 0, dof),
        maps=tuple(MapSlot(term.force_map, jnp.asarray(direction(term.at, dof))) for term in laws.maps),
        own=structure.own,
        reach=_REACH if grid is None else grid.reach(laws.delayed),
        rolled=rolled,
    )


class Laws(NamedTuple):
    """Terms of a structure by what a plant has them in."""

    linear: list[Any]
    smooth: list[Any]
    friction: list[Any]
    memory: list[Any]
    delayed: list[Any]
    maps: list[Any]


def laws_of(structure: Structure) -> Laws:
    """The terms of a structure, sorted."""
    laws = Laws([], [], [], [], [], [])
    for term in structure.terms:
        if isinstance(term, LinearStiffness | LinearDamping):
            laws.linear.append(term)
        elif isinstance(term, MapTerm):
            laws.maps.append(term)
        elif isinstance(term, AbstractFriction):
            laws.friction.append(term)
        else:
            (laws.memory if term.states else laws.smooth if term.delay is None else laws.delayed).append(term)
    return laws


def _slots(terms: list, laws: tuple[type, ...], least: int, dof: int, ramp: float = 0.0) -> Slots:
    """Slots of some terms, at `least` so many."""
    count = max(least, len(terms))
    laws = laws + tuple(dict.fromkeys(type(term) for term in terms if type(term) not in laws))
    widest = max([LAW_PARAMETERS, *(len(term.values) for term in terms)])
    kind, parameters, directions = np.zeros(count, np.int32), np.zeros((count, widest)), np.zeros((count, dof))
    arrays: dict[str, Any] = {"kind": kind, "parameters": parameters, "direction": directions}
    for i, term in enumerate(terms):
        kind[i] = laws.index(type(term))
        values = [_number(value) for value in term.values] + [ramp] * isinstance(term, StiffnessDrop)
        for j, value in enumerate(values):
            arrays["parameters"] = _with(arrays["parameters"], (i, j), value)
        directions[i] = direction(term.at, dof)
    return Slots(**arrays, laws=laws)


def _number(value: Any) -> Any:
    return value if is_traced(value) else float(value)


def _with(array: Any, place: Any, value: Any) -> Any:
    """The array with one value replaced, in place unless one is traced."""
    if is_traced((array, value)):
        return jnp.asarray(array).at[place].set(value)
    array[place] = value
    return array
