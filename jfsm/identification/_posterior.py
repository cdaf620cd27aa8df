"""A structure's posterior on one or several records: likelihood times what was known beforehand."""

import math
from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import jax
import numpy as np
from jaxtyping import Bool, Float, Shaped
from scipy.optimize import minimize

from ..estimation._filter import Innovations
from ..plant import Grid, Imposed, Plant, Tabulated, hidden_width, laws_of, numbers_of
from ..structures import AbstractFriction, ChannelDelay, ForceDelay, Structure
from ._colour import Colour
from ._layout import besides_numbers, plant_rows, plant_vector
from ._likelihood import NUDGE, Runs, Scene, Slopes, innovations_of, loss, values_and_slopes
from ._linear_lanes import is_linear, linear_innovations
from ._nuisances import Nuisances
from ._tangents import has_tangents, slopes_along
from ._unknowns import Unknown, values_of

LANES = 2
"""Starts that climb side by side where nothing sticks."""
_COLOUR_SAMPLES = 2048
"""Samples of a record, its first, from which the colour of its noise is estimated."""
_COLOUR_STEPS = 12
"""Steps towards the likeliest colour, at most: where noise has one, half as many find it."""
_CLOSE = 1e-6
"""Change of its log-likelihood, as a share, that is none."""
_KNOWN_START, _HIDDEN_START = 1e-6, 0.3
"""Doubt about the initial state, and about hidden states there, as shares of the motion's size."""


def lanes_of(structure: Structure) -> int:
    """Starts of such a structure that climb side by side: one alone where links stick, or a sensor is late."""
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
    """Value, gradient and information of minus the log-posterior for some starts of one hypothesis.

    `until` (one per record) ends the samples that count.
    """

    def __init__(self, hypothesis: Hypothesis, records: Sequence[Nuisances], until: Sequence[int] | None = None):
        self.hypothesis, self.records = hypothesis, tuple(records)
        self.until = tuple(n.samples for n in records) if until is None else tuple(until)
        if self.lanes > (most := lanes_of(hypothesis.structures[0])):
            raise ValueError(f"At most {most} starts fit into one call; got {self.lanes}.")
        self._parts = [[self._part(n, index, lane) for lane in range(self.lanes)] for index, n in enumerate(records)]

    @property
    def lanes(self) -> int:
        return len(self.hypothesis.structures)

    @property
    def program(self) -> Hashable:
        """Posteriors for which this is equal share their compiled programs."""
        leaves, tree = jax.tree.flatten([parts[0].plant for parts in self._parts])
        return tree, tuple(leaf.shape for leaf in leaves), self.records[0].readings.zeros

    @property
    def has_tangents(self) -> bool:
        """Whether slopes along one run pay."""
        each = zip(self._parts, self.records, self.until, strict=True)
        scenes = (parts[0].scene(nuisances, until) for parts, nuisances, until in each)
        return any(has_tangents(scene) and not is_linear(scene) for scene in scenes)

    def initial(self) -> Float[np.ndarray, "lanes unknowns"]:
        """Starting values (lanes, unknowns)."""
        return np.array([[u.theta for u in unknowns] for unknowns in self.hypothesis.unknowns])

    def evaluate(
        self,
        theta: Float[np.ndarray, "lanes unknowns"],
        slack: float = 0.0,
        first: bool = False,
        lanes: Bool[np.ndarray, " lanes"] | None = None,
        *,
        exact: bool = True,
    ) -> tuple[
        Float[np.ndarray, " lanes"], Float[np.ndarray, "lanes unknowns"], Float[np.ndarray, "lanes unknowns unknowns"]
    ]:
        """Minus log-posterior (lanes,), gradient and information.

        `slack` is the share of unmodelled force forgiven, no less than the record's own; of every record only its
        `first` readings count, as many as lead to a basin, where these are asked for. Of `lanes` that are not asked for
        (lanes,) the value is infinite. Slopes that need not be `exact` are those along one run, where that pays.
        """
        count, size = theta.shape
        value, gradient, information = np.zeros(count), np.zeros((count, size)), np.zeros((count, size, size))
        asked = np.arange(count) if lanes is None else np.flatnonzero(lanes)
        value[~np.isin(np.arange(count), asked)] = np.inf
        for lane in asked:
            value[lane], gradient[lane], curvature = prior(self.hypothesis.unknowns[lane], theta[lane])
            information[lane] = np.diag(curvature)
        for index, parts in enumerate(self._parts):
            for lane, found in self._slopes(theta, index, asked, slack, first, exact):
                mine = parts[lane].mine
                value[lane] += found.value
                gradient[lane, mine] += found.gradient
                information[lane][np.ix_(mine, mine)] += found.information
        return value, gradient, information

    def values(
        self, theta: Float[np.ndarray, "lanes unknowns"], slack: float = 0.0, first: bool = False
    ) -> Float[np.ndarray, " lanes"]:
        """Minus log-posterior (lanes,) by itself, infinite where a filter runs away; arguments as of `evaluate`."""
        found = [self._value(one, lane, slack, first) for lane, one in enumerate(theta)]
        return np.nan_to_num(found, nan=math.inf, posinf=math.inf)

    def _value(self, theta: Float[np.ndarray, " unknowns"], lane: int, slack: float, first: bool) -> float:
        total = prior(self.hypothesis.unknowns[lane], theta)[0]
        return total + sum(float(loss(seen, use)[0]) for seen, use in self._seen(theta, lane, slack, first))

    def misfit(
        self, theta: Float[np.ndarray, " unknowns"], lane: int = 0, slack: float = 0.0, first: bool = False
    ) -> float:
        """Mean square of one lane's innovations in their standard deviations: 1 where a hypothesis holds; arguments as
        of `evaluate`."""
        total, count = 0.0, 0.0
        for seen, use in self._seen(theta, lane, slack, first):
            error, variance = np.asarray(seen.error)[0], np.asarray(seen.variance)[0]
            total += float(np.sum(np.where(use > 0, error**2 / np.maximum(variance, 1e-300), 0.0)))
            count += float(np.sum(use > 0))
        return total / max(count, 1.0)

    def _seen(
        self, theta: Float[np.ndarray, " unknowns"], lane: int, slack: float, first: bool
    ) -> Iterator[tuple[Innovations, Shaped[np.ndarray, "n channels"]]]:
        """Innovations of one lane, record by record, and which of the readings count."""
        for index, nuisances in enumerate(self.records):
            until, forgiven = self._until(index, first), max(slack, nuisances.forgiven)
            seen = self._run(theta[None], index, lane, np.full(1, forgiven), until)
            yield seen, np.asarray(nuisances.readings.use)[:until]

    @property
    def samples(self) -> int:
        """Samples of all records that count."""
        return sum(self.until)

    @property
    def leading(self) -> int:
        """Samples of all records that lead to a basin."""
        return sum(self._until(index, first=True) for index in range(len(self.records)))

    def _until(self, index: int, first: bool) -> int:
        """How many samples of a record count."""
        return min(self.until[index], self.records[index].leading) if first else self.until[index]

    def scatter(self, theta: Float[np.ndarray, "lanes unknowns"]) -> Float[np.ndarray, "lanes unknowns unknowns"]:
        """Covariance (lanes, unknowns, unknowns) of the gradient as the record itself shows it, from its stretches."""
        total = np.zeros((*theta.shape, theta.shape[1]))
        for index, parts in enumerate(self._parts):
            for lane, found in self._slopes(theta, index, np.arange(len(theta))):
                total[lane][np.ix_(parts[lane].mine, parts[lane].mine)] += found.scatter
        return total

    def _slopes(
        self,
        theta: np.ndarray,
        index: int,
        lanes: np.ndarray,
        slack: float = 0.0,
        first: bool = False,
        exact: bool = True,
    ) -> Iterator[tuple[int, Slopes]]:
        """Lane by lane, what the readings of record `index` say of the unknowns that act on it."""
        nuisances, until, parts = self.records[index], self._until(index, first), self._parts[index]
        use, forgiven = np.asarray(nuisances.readings.use)[:until], max(slack, nuisances.forgiven)
        for alike in _alike(parts, lanes):
            scene, mine = parts[alike[0]].scene(nuisances, until), parts[alike[0]].mine
            if not (exact or is_linear(scene)) and has_tangents(scene):
                for lane in alike:
                    around = theta[lane, mine] + NUDGE * np.eye(len(mine) + 1, len(mine), -1)
                    numbers = parts[lane].numbers(around)
                    yield lane, slopes_along(scene, numbers, slackened(nuisances, forgiven), use)
                continue

            def run(of: np.ndarray, values: np.ndarray, alike=alike, scene=scene) -> Innovations:
                numbers = [parts[lane].numbers(values[of == k]) for k, lane in enumerate(alike)]
                velocity = np.repeat(slackened(nuisances, forgiven)[None], len(values), 0)
                return _filtered(scene, Runs(np.concatenate(numbers), velocity), until)

            found = values_and_slopes(run, theta[alike][:, mine], use, scene.has_laws)
            yield from zip(alike, found, strict=True)

    def _run(
        self,
        theta: np.ndarray,
        index: int,
        lane: int,
        slack: np.ndarray,
        until: int,
        use: np.ndarray | None = None,
        push: np.ndarray | None = None,
        nuisances: Nuisances | None = None,
    ) -> Innovations:
        """Innovations (runs, until, channels) of record `index` at values (runs, unknowns) and slacks (runs,)."""
        part = self._parts[index][lane]
        scene = part.scene(self.records[index], until) if nuisances is None else part.of_record(nuisances, until)
        nuisances = self.records[index] if nuisances is None else nuisances
        shares, which = np.unique(slack, return_inverse=True)
        velocity = np.stack([slackened(nuisances, share) for share in shares])[which]
        return _filtered(scene, Runs(part.numbers(theta[:, part.mine]), velocity, use, push), until)

    def innovations(
        self,
        theta: Float[np.ndarray, " unknowns"],
        index: int = 0,
        *,
        use: Shaped[np.ndarray, "n channels"] | None = None,
        push: Float[np.ndarray, "n dof"] | None = None,
        noise_scales: bool = True,
        slack: float = 0.0,
    ) -> Innovations:
        """Innovations of record `index` at `theta` (unknowns,) of a hypothesis with one start.

        `use` (n, channels) masks readings, `push` (n, dof) is a force that drives it as well, `slack` forgives
        unmodelled force as in `evaluate`. Without `noise_scales` the channels' noise is taken at its floor.
        """
        many = self.many_innovations(
            theta[None], index, use=use, push=None if push is None else push[None], noise_scales=noise_scales,
            slack=np.full(1, slack),
        )  # fmt: skip
        return Innovations(*(a[0] for a in many))

    def many_innovations(
        self,
        theta: Float[np.ndarray, "runs unknowns"],
        index: int = 0,
        *,
        use: Shaped[np.ndarray, "n channels"] | None = None,
        push: Float[np.ndarray, "runs n dof"] | None = None,
        noise_scales: bool = True,
        slack: Float[np.ndarray, " runs"] | None = None,
    ) -> Innovations:
        """`innovations` (runs, n, channels) at values (runs, unknowns), each with its `push` and its `slack`."""
        nuisances = self.records[index]
        n, own = nuisances.samples, np.asarray(nuisances.readings.use)
        masked = None if use is None else own[:n] * use
        values = theta if noise_scales else np.stack([self.at_the_floor(one) for one in theta])
        loose = np.zeros(len(theta)) if slack is None else slack
        return self._run(values, index, 0, loose, n, masked, push)

    def at_the_floor(self, theta: Float[np.ndarray, " unknowns"]) -> Float[np.ndarray, " unknowns"]:
        """The same values (unknowns,), the noise of every channel as strong as it was taken to be."""
        scales = [u.path.startswith("noise@") for u in self.hypothesis.unknowns[0]]
        return np.where(scales, 0.0, theta)

    def colour(self, theta: Float[np.ndarray, " unknowns"], channels: Sequence[int], loudest: float) -> Colour:
        """The most likely colour of the noise of these channels at `theta` (unknowns,) of a hypothesis with one start.

        It is the same in all records, and estimated from the first samples of each. The noise of the force is up to
        `loudest` times as strong as it was taken to be.
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
        found = minimize(
            cost,
            begin,
            jac=True,
            method="L-BFGS-B",
            bounds=Colour.reach(begin, loudest),
            options={"ftol": _CLOSE, "maxiter": _COLOUR_STEPS},
        )
        return Colour.of(found.x, channels)

    def _slope_by_colour(
        self, theta: np.ndarray, index: int, values: np.ndarray, channels: Sequence[int]
    ) -> tuple[float, np.ndarray]:
        """Minus log-likelihood of a record at `theta`, and its gradient by the values of its noise's colour."""
        nuisances, until = self.records[index], min(self.until[index], _COLOUR_SAMPLES)
        use = np.asarray(nuisances.readings.use)[:until]

        def run(_: np.ndarray, values: np.ndarray) -> Innovations:
            found = list[Any]()
            for one in values:
                colour = Colour.of(one, channels)
                seen = replace(
                    nuisances, readings=colour.on(nuisances.readings), noise=colour.of_force(nuisances.noise)
                )
                found.append(self._run(theta[None], index, 0, np.zeros(1), until, nuisances=seen))
            together: list[Any] = [np.concatenate(each) for each in zip(*found, strict=True)]
            return Innovations(*together)

        [found] = values_and_slopes(run, values[None], use)
        return found.value, found.gradient

    def structure(self, theta: Float[np.ndarray, " unknowns"], lane: int = 0) -> Structure:
        """The structure with the values of one lane."""
        unknowns = self.hypothesis.unknowns[lane]
        known = self.hypothesis.structures[lane].values()
        pairs = reversed(list(zip(unknowns, values_of(unknowns, theta), strict=True)))
        first = {u.path: value for u, value in pairs if u.path in known}
        return self.hypothesis.structures[lane].with_values(first)

    def _part(self, nuisances: Nuisances, index: int, lane: int) -> "_Part":
        """Plant and parameter map of a start on one record."""
        structure, unknowns = self.hypothesis.structures[lane], self.hypothesis.unknowns[lane]
        mine = np.array([k for k, u in enumerate(unknowns) if u.record in (None, index)], int)
        grid = Grid(float(nuisances.record.dt), nuisances.inputs.substeps)
        slots = {"smooth_slots": _slot_bucket(structure), "grid": grid, "rolled": True}
        return _Part.of(structure, [unknowns[k] for k in mine], nuisances, mine, slots)


def _filtered(scene: Scene, runs: Runs, until: int) -> Innovations:
    """Innovations (lanes, until, channels) of all lanes."""
    return (linear_innovations if is_linear(scene) else innovations_of)(scene, runs, until)


def _alike(parts: "Sequence[_Part]", lanes: np.ndarray) -> list[list[int]]:
    """These lanes, those together of which one scene is that of all: they differ in numbers only."""
    together: dict[Hashable, list[int]] = {}
    for lane in lanes:
        together.setdefault(parts[lane].fixed, []).append(int(lane))
    return list(together.values())


def beginnings(posteriors: Sequence[Posterior], slacks: Sequence[float]) -> Float[np.ndarray, "slacks posteriors"]:
    """Minus log-posteriors with which starts of one law at one place begin, each alone in its posterior, where such
    shares of the force are forgiven; infinite where a filter runs away."""
    alike, begin = posteriors[0], [posterior.initial()[0] for posterior in posteriors]
    known = [prior(p.hypothesis.unknowns[0], theta)[0] for p, theta in zip(posteriors, begin, strict=True)]
    total = np.tile(known, (len(slacks), 1))
    for index, nuisances in enumerate(alike.records):
        until, parts = alike.until[index], [posterior._parts[index][0] for posterior in posteriors]
        numbers = [part.numbers(theta[None, part.mine]) for part, theta in zip(parts, begin, strict=True)]
        forgiven = [slackened(nuisances, max(slack, nuisances.forgiven)) for slack in slacks]
        runs = Runs(np.concatenate(numbers * len(slacks)), np.repeat(forgiven, len(parts), 0))
        seen = innovations_of(parts[0].scene(nuisances, until), runs, until)
        total += loss(seen, np.asarray(nuisances.readings.use)[:until]).reshape(total.shape)
    return np.nan_to_num(total, nan=math.inf, posinf=math.inf)


@dataclass(frozen=True)
class _Part:
    """A start on one record: its plant, which unknowns (`mine`) act on it, and how they make its numbers.

    Numbers are base + rows·value(theta), the plant's, then x0, v0 and logarithms of factors on the channels' noise. A
    value is its unit times theta or exp(theta), and times exp(tie·values) where it is tied to its exponent.
    """

    plant: Plant
    mine: np.ndarray
    base: np.ndarray
    rows: np.ndarray
    unit: np.ndarray
    log: np.ndarray
    tie: np.ndarray
    near: Tabulated | None
    scenes: dict[int, Scene] = field(default_factory=dict)

    @cached_property
    def fixed(self) -> Hashable:
        return besides_numbers(self.plant), id(self.near)

    def scene(self, nuisances: Nuisances, until: int) -> Scene:
        """`of_record` of the record that the part was made for, made once."""
        key = nuisances.head(until)[0].time.shape[0] if isinstance(nuisances.inputs, Imposed) else 0
        if key not in self.scenes:
            self.scenes[key] = self.of_record(nuisances, until)
        return self.scenes[key]

    def of_record(self, nuisances: Nuisances, until: int) -> Scene:
        """What runs of this plant share on a record, of which the first samples count."""
        imposed = isinstance(nuisances.inputs, Imposed)
        inputs, readings = nuisances.head(until) if imposed else (nuisances.inputs, nuisances.readings)
        doubt = _doubt(self.plant, nuisances)
        return Scene(self.plant, nuisances.observation, inputs, readings, doubt, nuisances.stretches, self.near)

    def numbers(self, theta: np.ndarray) -> np.ndarray:
        """Numbers (runs, size) at values (runs, unknowns)."""
        with np.errstate(over="ignore"):
            value = self.unit * np.where(self.log, np.exp(np.where(self.log, theta, 0.0)), theta)
            value = value * np.exp(value @ self.tie.T)
        return self.base + value @ self.rows

    @classmethod
    def of(
        cls, structure: Structure, unknowns: Sequence[Unknown], nuisances: Nuisances, mine: np.ndarray, slots: dict
    ) -> "_Part":
        plant = numbers_of(structure, nuisances.channels, **slots)
        near = None if nuisances.course is None else nuisances.course.near(structure)
        if near is not None:  # the table stands for the function
            plant = replace(plant, own=None)
        vector, dof, channels = plant_vector(plant), structure.dof, len(nuisances.channels)
        tail = (
            {f"x0@{j + 1}": j for j in range(dof)}
            | {f"v0@{j + 1}": dof + j for j in range(dof)}
            | {f"noise@{c}": 2 * dof + c for c in range(channels)}
        )
        width = len(unknowns)
        base = np.concatenate([vector, nuisances.x0, nuisances.v0, np.zeros(channels)])
        rows, tie = np.zeros((width, base.size)), np.zeros((width, width))
        inside = [u.path for u in unknowns if u.path not in tail]
        found = dict(zip(inside, plant_rows(structure, inside, nuisances.channels, **slots), strict=True))
        known = structure.values()
        for k, u in enumerate(unknowns):
            if u.tie:
                tie[k, next(i for i, other in enumerate(unknowns) if other.path == u.tie[0])] = u.tie[1]
            if u.path in tail:
                rows[k, vector.size + tail[u.path]] = 1.0
                base[vector.size + tail[u.path]] = 0.0
            else:
                rows[k, : vector.size] = found[u.path]
                base[: vector.size] -= found[u.path] * known[u.path]
        unit, log = np.array([u.unit for u in unknowns]), np.array([u.log for u in unknowns], bool)
        return cls(plant, mine, base, rows, unit, log, tie, near)


def _doubt(plant: Plant, nuisances: Nuisances) -> np.ndarray:
    """Standard deviation of the state at the first sample.

    Displacement and velocity are among the unknowns themselves. Hidden states are not: unless the record began at rest
    they may be anything up to the size of the motion. Of an imposed motion it is the share of its own size that what
    remembers may be off there.
    """
    share = 0.0 if nuisances.record.at_rest else 1.0
    if isinstance(nuisances.inputs, Imposed):
        return np.asarray(share)
    length, speed = nuisances.length, nuisances.length * nuisances.omega
    known = _KNOWN_START * np.repeat([length, speed], plant.mass.shape[-1])
    hidden = share * _HIDDEN_START * np.resize([length, speed], plant.memory.kind.shape[0] * hidden_width(plant.memory))
    return np.concatenate([known, hidden])


def _slot_bucket(structure: Structure) -> int:
    """Smooth slots of the program: one for a candidate beside a linear model, then powers of two."""
    laws = laws_of(structure)
    count = len(laws.smooth)
    if count == 0 and (laws.friction or laws.memory or laws.delayed):
        return 0  # in a program of its own anyway
    return 1 if count <= 1 else 2 ** math.ceil(math.log2(count))


def slackened(nuisances: Nuisances, share: float) -> Float[np.ndarray, "dof dof"]:
    """Process noise (dof, dof) that also forgives an unmodelled force of `share` of the elastic force."""
    if isinstance(nuisances.inputs, Imposed):
        size = share * np.max(nuisances.spread[nuisances.judged])
        return size**2 * np.eye(nuisances.inputs.a.shape[1])
    size = share * nuisances.omega**2 * nuisances.length
    forgiven, known = size**2 / nuisances.omega * nuisances.record.dt, np.asarray(nuisances.noise.velocity)
    return known + forgiven * np.eye(len(known))


def prior(
    unknowns: Sequence[Unknown], theta: Float[np.ndarray, " unknowns"]
) -> tuple[float, Float[np.ndarray, " unknowns"], Float[np.ndarray, " unknowns"]]:
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
