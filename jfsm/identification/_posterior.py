"""A structure's posterior on one or several records: likelihood times what was known beforehand."""

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import minimize

from ..dynamics._grid import Fine
from ..dynamics._imposed import Imposed
from ..dynamics._plant import Grid, Plant, Readout, hidden_width, numbers_of
from ..estimation._filter import Innovations, ProcessNoise, Readings
from ..structures import AbstractFriction, ChannelDelay, ForceDelay, Structure
from ._colour import Colour
from ._layout import plant_rows, plant_vector
from ._likelihood import Lanes, derivatives, predictions, slope_by_colour
from ._nuisances import Nuisances
from ._unknowns import Unknown, values_of

LANES = 2
"""Starts that run side by side where nothing sticks; fewer are repeated, so that one program serves all."""
_KNOWN_START, _HIDDEN_START = 1e-6, 0.3
"""Doubt about the initial state, and about hidden states there, as shares of the motion's size."""
_WIDTHS = (16, 20, 24, 32, 48, 64, 96, 128)


def lanes_of(structure: Structure) -> int:
    """Starts of such a structure that run side by side.

    Where links stick, one alone: a reversal is a branch then, which costs nothing while there is none. And one where a
    sensor is late, which has no second start.
    """
    sticks = any(isinstance(term, AbstractFriction) for term in structure.terms)
    return 1 if sticks or _is_late(structure) else LANES


def _is_late(structure: Structure) -> bool:
    return any(isinstance(sensor, ForceDelay | ChannelDelay) for sensor in structure.sensors)


@dataclass(frozen=True)
class Hypothesis:
    """Structures that differ in their numbers, places or signs only, as starts of one fit.

    `unknowns[i]` belong to `structures[i]`; all have the same paths up to the place of the effect.
    """

    structures: tuple[Structure, ...]
    unknowns: tuple[tuple[Unknown, ...], ...]

    @property
    def size(self) -> int:
        return len(self.unknowns[0])


class Posterior:
    """Value, gradient and information of minus the log-posterior for `LANES` starts of one hypothesis.

    `until` (one per record) ends the samples that count.
    """

    def __init__(self, hypothesis: Hypothesis, records: Sequence[Nuisances], until: Sequence[int] | None = None):
        self.hypothesis, self.records = hypothesis, tuple(records)
        self.until = tuple(n.samples for n in records) if until is None else tuple(until)
        count = len(hypothesis.structures)
        lanes = lanes_of(hypothesis.structures[0])
        if count > lanes:
            raise ValueError(f"At most {lanes} starts fit into one call; got {count}.")
        self._pick = [min(i, count - 1) for i in range(lanes)]
        self._parts = [self._part(index, nuisances) for index, nuisances in enumerate(self.records)]

    @property
    def lanes(self) -> int:
        return len(self.hypothesis.structures)

    @property
    def program(self) -> Hashable:
        """Posteriors for which this is equal share their compiled programs."""
        used = [(plant, maps, n.fine) for n, (plant, maps, _) in zip(self.records, self._parts, strict=True)]
        leaves, tree = jax.tree.flatten(used)
        return tree, tuple((leaf.shape, leaf.dtype) for leaf in leaves)

    def initial(self) -> np.ndarray:
        """Starting values (lanes, unknowns)."""
        return np.array([[u.theta for u in unknowns] for unknowns in self.hypothesis.unknowns])

    def evaluate(
        self, theta: np.ndarray, slack: float = 0.0, first: bool = False
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Minus log-posterior (lanes,), gradient and information.

        `slack` is the share of unmodelled force forgiven, no less than the record's own; of every record only its
        `first` readings count, as many as lead to a basin, where these are asked for.
        """
        return self._evaluate(theta, slack, first)[:3]

    def scatter(self, theta: np.ndarray) -> np.ndarray:
        """Covariance (lanes, unknowns, unknowns) of the gradient as the record itself shows it, from its stretches."""
        return self._evaluate(theta)[3]

    def _evaluate(self, theta: np.ndarray, slack: float = 0.0, first: bool = False):
        lanes, size = theta.shape
        value, gradient, information = np.zeros(lanes), np.zeros((lanes, size)), np.zeros((lanes, size, size))
        scatter = np.zeros_like(information)
        for nuisances, end, (plant, maps, mine) in zip(self.records, self.until, self._parts, strict=True):
            until = min(end, nuisances.leading) if first else end
            width = maps.unit.shape[1]
            inner = np.zeros((len(self._pick), width))
            inner[:, : len(mine)] = theta[self._pick][:, mine]
            seen = _Seen.of(nuisances, plant, until, max(slack, nuisances.forgiven))
            out = derivatives(plant, maps, jnp.asarray(inner), *seen)
            v, g, f, s = (np.asarray(o)[:lanes] for o in out)
            value += v
            gradient[:, mine] += g[:, : len(mine)]
            information[:, mine[:, None], mine[None, :]] += f[:, : len(mine), : len(mine)]
            scatter[:, mine[:, None], mine[None, :]] += s[:, : len(mine), : len(mine)]
        for lane in range(lanes):
            p, pg, pf = prior(self.hypothesis.unknowns[lane], theta[lane])
            value[lane] += p
            gradient[lane] += pg
            information[lane] += np.diag(pf)
        return value, gradient, information, scatter

    def innovations(
        self,
        theta: np.ndarray,
        index: int = 0,
        *,
        use: np.ndarray | None = None,
        push: np.ndarray | None = None,
        noise_scales: bool = True,
        slack: float = 0.0,
    ) -> Innovations:
        """Innovations of record `index` at `theta` (unknowns,) of a hypothesis with one start.

        `use` (n, channels) masks readings, `push` (n, dof) is a force that drives it as well, `slack` forgives
        unmodelled force as in `evaluate`. Without `noise_scales` the channels' noise is taken at its floor.
        """
        nuisances, (plant, maps, mine) = self.records[index], self._parts[index]
        inner = np.zeros((len(self._pick), maps.unit.shape[1]))
        inner[:, : len(mine)] = (theta if noise_scales else self.at_the_floor(theta))[mine]
        readings = nuisances.readings
        if use is not None:
            padded = np.zeros(readings.use.shape)
            padded[: len(use)] = use
            readings = replace(readings, use=jnp.asarray(padded) * readings.use)
        found = predictions(
            plant,
            maps,
            jnp.asarray(inner),
            nuisances.show,
            nuisances.fine if push is None else nuisances.pushed(push),
            readings,
            slackened(nuisances, slack),
            _doubt(plant, nuisances),
        )
        n = nuisances.samples
        return Innovations(*(np.asarray(array)[0, :n] for array in found))  # pyright: ignore[reportArgumentType]

    def at_the_floor(self, theta: np.ndarray) -> np.ndarray:
        """The same values (unknowns,), the noise of every channel as strong as it was taken to be."""
        scales = [u.path.startswith("noise@") for u in self.hypothesis.unknowns[0]]
        return np.where(scales, 0.0, theta)

    def colour(self, theta: np.ndarray, channels: Sequence[int], loudest: float) -> Colour:
        """The most likely colour of the noise of these channels at `theta` (unknowns,) of a hypothesis with one start.

        It is the same in all records. The noise of the force is up to `loudest` times as strong as it was taken to be.
        """
        quiet, picked, powers = self.at_the_floor(theta), list(channels), []
        for index, end in enumerate(self.until):
            use = np.asarray(self.records[index].readings.use)[:end, picked]
            error = np.where(use > 0, self.innovations(theta, index).error[:end, picked], 0.0)
            powers.append(np.sum(error**2, 0) / np.maximum(np.sum(use, 0), 1))

        def cost(values: np.ndarray) -> tuple[float, np.ndarray]:
            found = [self._slope_by_colour(quiet, index, values, channels) for index in range(len(self.records))]
            return sum(value for value, _ in found), np.sum([slope for _, slope in found], 0)

        begin = Colour.begin(np.mean(powers, 0))
        found = minimize(cost, begin, jac=True, method="L-BFGS-B", bounds=Colour.reach(begin, loudest))
        return Colour.of(jnp.asarray(found.x), channels)

    def _slope_by_colour(
        self, theta: np.ndarray, index: int, values: np.ndarray, channels: Sequence[int]
    ) -> tuple[float, np.ndarray]:
        """Minus log-likelihood of a record at `theta`, and its gradient by the values of its noise's colour."""
        nuisances, until, (plant, maps, mine) = self.records[index], self.until[index], self._parts[index]
        inner = np.zeros(maps.unit.shape[1])
        inner[: len(mine)] = theta[mine]
        seen = _Seen.of(nuisances, plant, until)
        value, slope = slope_by_colour(plant, maps, jnp.asarray(inner), *seen, jnp.asarray(values), tuple(channels))
        return float(value), np.asarray(slope)

    def structure(self, theta: np.ndarray, lane: int = 0) -> Structure:
        """The structure with the values of one lane."""
        unknowns = self.hypothesis.unknowns[lane]
        known = self.hypothesis.structures[lane].values()
        pairs = reversed(list(zip(unknowns, values_of(unknowns, theta), strict=True)))
        first = {u.path: value for u, value in pairs if u.path in known}
        return self.hypothesis.structures[lane].with_values(first)

    def _part(self, index: int, nuisances: Nuisances) -> tuple[Plant, Lanes, np.ndarray]:
        """Plants and parameter maps of all lanes on one record, and which unknowns act on it."""
        structures = [self.hypothesis.structures[i] for i in self._pick]
        mine = np.array([k for k, u in enumerate(self.hypothesis.unknowns[0]) if u.record in (None, index)], int)
        width = next(w for w in _WIDTHS if w >= len(mine))
        grid = Grid(float(nuisances.record.dt), nuisances.fine.substeps)
        slots = {"smooth_slots": _slot_bucket(structures[0]), "grid": grid, "rolled": True}
        plants = [numbers_of(s, nuisances.channels, **slots) for s in structures]
        reach = max(plant.reach for plant in plants)  # of delays that begin far apart
        plants = [replace(plant, reach=reach) for plant in plants]
        packed = {}
        for lane in set(self._pick):
            mine_of = [self.hypothesis.unknowns[lane][k] for k in mine]
            structure = self.hypothesis.structures[lane]
            packed[lane] = _lane(structure, mine_of, nuisances, plant_vector(plants[lane]), width, slots)
        maps = Lanes(*(jnp.asarray(np.stack(parts)) for parts in zip(*(packed[i] for i in self._pick), strict=True)))
        stacked = jax.tree.map(
            lambda *leaves: jnp.asarray(
                np.stack(leaves) if jnp.issubdtype(leaves[0].dtype, jnp.floating) else leaves[0]
            ),
            *plants,
        )
        return stacked, maps, mine


class _Seen(NamedTuple):
    """What programs see of the first samples of a record, as many as `until`."""

    show: Readout
    fine: Fine | Imposed
    readings: Readings
    noise: ProcessNoise
    doubt: jax.Array
    until: jax.Array

    @classmethod
    def of(cls, nuisances: Nuisances, plant: Plant, until: int, slack: float = 0.0) -> "_Seen":
        """With a `slack` of unmodelled force forgiven."""
        fine, readings = nuisances.head(until)
        noise, doubt = slackened(nuisances, slack), _doubt(plant, nuisances)
        # The number of samples as a plain number would be part of the program.
        return cls(nuisances.show, fine, readings, noise, doubt, jnp.asarray(until))


def _lane(structure, unknowns, nuisances: Nuisances, vector, width, slots):
    dof, channels = structure.dof, len(nuisances.channels)
    tail = (
        {f"x0@{j + 1}": j for j in range(dof)}
        | {f"v0@{j + 1}": dof + j for j in range(dof)}
        | {f"noise@{c}": 2 * dof + c for c in range(channels)}
    )
    size = vector.size + 2 * dof + channels
    base, rows = np.zeros(size), np.zeros((width, size))
    unit, log, tie = np.zeros(width), np.zeros(width), np.zeros((width, width))
    base[: vector.size] = vector
    base[vector.size :] = np.concatenate([nuisances.x0, nuisances.v0, np.zeros(channels)])
    inside = [u.path for u in unknowns if u.path not in tail]
    found = dict(zip(inside, plant_rows(structure, inside, nuisances.channels, **slots), strict=True))
    known = structure.values()
    for k, u in enumerate(unknowns):
        unit[k], log[k] = u.unit, float(u.log)
        if u.tie:
            tie[k, next(i for i, other in enumerate(unknowns) if other.path == u.tie[0])] = u.tie[1]
        if u.path in tail:
            rows[k, vector.size + tail[u.path]] = 1.0
            base[vector.size + tail[u.path]] = 0.0
        else:
            rows[k, : vector.size] = found[u.path]
            base[: vector.size] -= found[u.path] * known[u.path]
    return base, rows, unit, log, tie


def _doubt(plant: Plant, nuisances: Nuisances):
    """Standard deviation of the state at the first sample.

    Displacement and velocity are among the unknowns themselves. Hidden states are not: unless the record began at rest
    they may be anything up to the size of the motion. Of an imposed motion it is the share of its own size that what
    remembers may be off there.
    """
    share = 0.0 if nuisances.record.at_rest else 1.0
    if isinstance(nuisances.fine, Imposed):
        return jnp.asarray(share)
    length, speed = nuisances.length, nuisances.length * nuisances.omega
    known = _KNOWN_START * np.repeat([length, speed], plant.mass.shape[-1])
    hidden = share * _HIDDEN_START * np.resize([length, speed], plant.memory.kind.shape[0] * hidden_width(plant.memory))
    return jnp.asarray(np.concatenate([known, hidden]))


def _slot_bucket(structure: Structure) -> int:
    """Smooth slots of the program: one for a candidate beside a linear model, then powers of two."""
    plant = numbers_of(structure)
    count = len(plant.smooth)
    if count == 0 and (len(plant.friction) or len(plant.memory) or len(plant.delayed) or _is_late(structure)):
        return 0  # in a program of its own anyway
    return 1 if count <= 1 else 2 ** math.ceil(math.log2(count))


def slackened(nuisances: Nuisances, share: float) -> ProcessNoise:
    """Process noise that also forgives an unmodelled force of `share` of the elastic force."""
    if isinstance(nuisances.fine, Imposed):
        size = share * np.max(nuisances.spread[nuisances.judged])
        return ProcessNoise(jnp.asarray(size**2 * np.eye(nuisances.fine.a.shape[1])))
    size = share * nuisances.omega**2 * nuisances.length
    forgiven, known = size**2 / nuisances.omega * nuisances.record.dt, np.asarray(nuisances.noise.velocity)
    return ProcessNoise(jnp.asarray(known + forgiven * np.eye(len(known))))


def prior(unknowns: Sequence[Unknown], theta: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Minus log-density of the unknowns beforehand, its gradient and a positive curvature."""
    value, gradient, curvature = 0.0, np.zeros(theta.size), np.zeros(theta.size)
    for k, (u, t) in enumerate(zip(unknowns, theta, strict=True)):
        r = (t - u.center) / u.width
        value += u.cost
        if math.isfinite(u.degrees):
            spread = u.degrees + r * r
            value += (u.degrees + 1) / 2 * math.log(spread / u.degrees) + math.log(u.width) + _student(u.degrees)
            gradient[k] = (u.degrees + 1) * r / (u.width * spread)
            curvature[k] = (u.degrees + 1) / (u.width**2 * spread)
        else:
            value += r * r / 2 + math.log(u.width) + 0.5 * math.log(2 * math.pi)
            gradient[k], curvature[k] = r / u.width, 1 / u.width**2
    return value, gradient, curvature


def _student(degrees: float) -> float:
    """Logarithm of the constant of Student's law."""
    return math.lgamma(degrees / 2) + 0.5 * math.log(degrees * math.pi) - math.lgamma((degrees + 1) / 2)
