"""One hypothesis fitted: its values, its evidence, and how well it predicts."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...identification import Hypothesis, Maximum, Nuisances, Posterior, Unknown, interval, without_small_offsets
from ...structures import AbstractSensor, AbstractTerm, Structure, is_offset
from ..hypotheses.effect import Effect, key_of, names, places
from .prediction import Prediction

FILTERED, PREDICTED = 2.0, 3.0
"""Periods of filtering before, and of free prediction in, every window."""
_LATE = 8
"""Samples at the end by which nothing is judged: what drives them a late force sensor shows after the record only."""
_RUN_AWAY = 1e6
"""Error, in spreads of a channel, at which a prediction counts as run away."""
_SLIGHT = 3.0
"""Offset of a force or an acceleration, in widths of what is believed of it, up to which it is no more than a nuisance.
"""
SLACKS = (0.0, 0.01, 0.05)
"""How loosely the state may be held while it is filtered; each hypothesis is judged by its best."""
_ENOUGH = 1600
"""Samples from which a lag-one correlation is told as it is: chance then leaves a fortieth."""
_OF_DIGITS = 0.3
"""Share of the correlation of a coarse channel's innovations that counts: its digits' errors repeat with the motion."""


@dataclass(frozen=True)
class Trial:
    """A hypothesis at its best values: the model with these effects; `label` says what it is where there are none.

    Each record was fitted in so many `steps` per sample.
    """

    label: str
    effects: tuple[Effect, ...]
    structure: Structure
    unknowns: tuple[Unknown, ...]
    theta: np.ndarray
    covariance: np.ndarray
    information: np.ndarray
    evidence: float
    value: float
    rung: float
    converged: bool
    prediction: Prediction
    whiteness: float
    noise: np.ndarray
    trusted: np.ndarray
    steps: tuple[int, ...]

    @property
    def name(self) -> str:
        """Cause ids, or what the hypothesis is."""
        return names(self.effects) or self.label

    @property
    def key(self) -> str:
        """Its effects with their places, or what the hypothesis is."""
        return key_of(self.effects) or self.label

    @property
    def noise_scale(self) -> float:
        """Largest departure of a channel's fitted noise from its floor, as a logarithm, where that is known."""
        return float(np.max(np.abs(self.noise[self.trusted]), initial=0.0))

    @property
    def at(self) -> tuple:
        """Place of the effect; places of several."""
        return places(self.effects)

    @property
    def parts(self) -> tuple[AbstractTerm | AbstractSensor, ...]:
        """The terms and sensors that the effects add, in their order."""
        count = sum(not effect.cause.is_sensor for effect in self.effects)
        terms = iter(self.structure.terms[len(self.structure.terms) - count :])
        return tuple(
            next(s for s in self.structure.sensors if isinstance(s, effect.cause.effect) and s.at == effect.at)
            if effect.cause.is_sensor
            else next(terms)
            for effect in self.effects
        )

    @property
    def laws(self) -> tuple[AbstractTerm, ...]:
        """The terms that the effects add; sensors add none."""
        return tuple(part for part in self.parts if isinstance(part, AbstractTerm))

    def effects_on(self, model: Structure) -> Structure:
        """The model with its effects."""
        for part in self.parts:
            model = model + part
        return model

    def extended(self, record: int | None = None) -> Structure:
        """The structure without the offsets that are not significant.

        What each record has to itself is that of `record`, or the mean of all.
        """
        structure = without_small_offsets(self.structure, self.unknowns, self.theta, self.covariance)
        of = {path: records if record is None else [record] for path, records in self.apart.items()}
        return structure.with_values({path: self._mean(path, records) for path, records in of.items()})

    @property
    def apart(self) -> dict[str, list[int]]:
        """Numbers of the structure that each record has to itself, by path, and these records; offsets aside."""
        found, entries = dict[str, list[int]](), self.structure.entries()
        for u in self.unknowns:
            if u.record is not None and u.path in entries and not is_offset(u.path):
                found.setdefault(u.path, []).append(u.record)
        return found

    def _mean(self, path: str, records: Sequence[int]) -> float:
        value, low, high = np.array([self.interval(path, record) for record in records]).T
        return float(np.average(value, weights=1.0 / np.maximum(high - low, np.finfo(float).tiny) ** 2))

    def beside(self, baseline: "Trial") -> "Trial":
        """The same, its prediction judged beside that of a baseline."""
        return replace(self, prediction=self.prediction.bounded_by(baseline.prediction))

    def amid(self, noise: np.ndarray) -> "Trial":
        """The same, its prediction judged amid so much more noise per set."""
        return replace(self, prediction=self.prediction.with_noise(noise))

    def interval(self, path: str, record: int | None = None) -> tuple[float, float, float]:
        """Value and 95 % interval of an unknown; symmetric in its own coordinate. Of one that each record has to
        itself, that of the first, or of `record`."""
        return interval(self.unknowns, self.theta, self.covariance, path, record=record)


def ended(t: Trial) -> list[tuple[Unknown, float]]:
    """A trial's unknowns, and where they ended."""
    return [(u, float(theta)) for u, theta in zip(t.unknowns, t.theta, strict=True)]


def own_values(t: Trial) -> list[tuple[Unknown, float]]:
    """The model's own values among a trial's unknowns, and where they ended."""
    return [(u, theta) for u, theta in ended(t) if math.isfinite(u.degrees) and not is_offset(u.path)]


def sets(nuisances: Nuisances, until: int) -> list[np.ndarray]:
    """Sample masks of the sets on which a record is judged: training and held out, or contiguous quarters."""
    n = nuisances.samples
    index = np.arange(n)
    if until < n:
        return [index < until, index >= until]
    return [index * 4 // n == q for q in range(4)]


def predict(posterior: Posterior, theta: np.ndarray, slight: bool = False) -> Prediction:
    """Multi-step prediction of a hypothesis with one start.

    With `slight` offsets what would be a cause of its own is not explained by an offset.
    """
    if slight:
        mine = [is_offset(u.path, "force", "acceleration") for u in posterior.hypothesis.unknowns[0]]
        theta = np.where(mine, np.clip(theta, -_SLIGHT, _SLIGHT), theta)
    best: list[tuple[float, Prediction]] = []
    loosely, every = np.array(SLACKS), np.repeat(theta[None], len(SLACKS), 0)
    seen = [
        posterior.many_innovations(every, index, use=windows(nuisances)[0], noise_scales=False, slack=loosely)
        for index, nuisances in enumerate(posterior.records)
    ]
    for k in range(len(SLACKS)):
        errors, expected, scatter = [], [], []
        for index, nuisances in enumerate(posterior.records):
            scored = windows(nuisances)[1]
            size, alone = extent(nuisances), _alone(nuisances)
            error, variance = seen[index].error[k], seen[index].variance[0]  # held tightly, its error bar is true
            alive = np.asarray(nuisances.readings.use)[: nuisances.samples] > 0
            for chosen in sets(nuisances, posterior.until[index]):
                mask = (scored & chosen)[:, None] & alive
                count = np.maximum(mask.sum(0), 1)
                share = np.clip(error / size, -_RUN_AWAY, _RUN_AWAY)
                errors.append(np.sum(np.sum(np.where(mask, share**2, 0.0), 0) / count))
                doubt = np.clip(variance / size**2, 0.0, _RUN_AWAY**2)
                noise = np.sum(np.where(mask, doubt, 0.0), 0) / count
                white = np.minimum(np.asarray(nuisances.readings.variance) / size**2, noise)
                # Readings err each by itself, a state that was filtered for a whole window: in two directions.
                pieces = np.maximum(count * nuisances.record.dt / (nuisances.period * PREDICTED), 1.0)
                expected.append(np.sum(noise))
                scatter.append(np.sqrt(np.sum(2 * white**2 / (count * alone) + (noise - white) ** 2 / pieces)))
        total = np.nan_to_num(np.array(errors), nan=np.inf)
        best.append((float(np.sum(total)), Prediction(total, np.array(expected), np.array(scatter))))
    return min(best, key=lambda item: item[0])[1]


def _alone(nuisances: Nuisances) -> np.ndarray:
    """Share (channels,) of the readings whose noise is as good as independent, where their power is asked for."""
    known = [nuisances.memories.get(channel, (0.0, 0.0)) for channel in nuisances.channels]
    squared = np.array([memory**2 * share for memory, share in known])
    return (1.0 - squared) / (1.0 + squared)


def free_run(posterior: Posterior, theta: np.ndarray, index: int) -> np.ndarray:
    """Readings (n, channels) of record `index` as a filter predicts them that uses none."""
    nuisances = posterior.records[index]
    none = np.zeros((nuisances.samples, len(nuisances.channels)))
    free = posterior.innovations(theta, index, use=none)
    return np.asarray(nuisances.readings.values)[: nuisances.samples] - free.error


def runs_away(run: np.ndarray, nuisances: Nuisances) -> bool:
    """Whether readings (n, channels) of a free run leave all bounds."""
    return not bool(np.all(np.abs(run) < _RUN_AWAY * nuisances.spread))


def windows(nuisances: Nuisances) -> tuple[np.ndarray, np.ndarray]:
    """Which samples the filter uses, and which it predicts freely: all of them along an imposed motion."""
    if nuisances.path is not None:
        return np.zeros((nuisances.samples, len(nuisances.channels))), np.ones(nuisances.samples, bool)
    n, period = nuisances.samples, nuisances.period / nuisances.record.dt
    period = min(period, n / (2 * (FILTERED + PREDICTED)))
    phase = np.arange(n) % max(int(round((FILTERED + PREDICTED) * period)), 2)
    free = (phase >= int(round(FILTERED * period))) & (np.arange(n) < n - _LATE)
    channels = len(nuisances.channels)
    return np.repeat((~free)[:, None], channels, 1).astype(float), free


def extent(nuisances: Nuisances) -> np.ndarray:
    """Spread (channels,) of the readings; where a window is but a part of a slow motion, of those in a window."""
    if not nuisances.drifts:
        return nuisances.spread
    free = windows(nuisances)[1]
    values = np.asarray(nuisances.readings.values)[: nuisances.samples]
    pieces = np.split(values, np.flatnonzero(np.diff(free.astype(int))) + 1)
    about = np.concatenate([piece - piece.mean(0) for piece in pieces])
    return np.minimum(np.std(about[free], 0), nuisances.spread)


def cost(posterior: Posterior, theta: np.ndarray) -> float:
    """Minus the logarithm of the posterior at one set of unknowns."""
    return float(posterior.values(theta[None])[0])


def standardised(posterior: Posterior, theta: np.ndarray, index: int) -> np.ndarray:
    """Innovations (until, channels) of what was fitted, in their standard deviations; none where no reading counts."""
    until, found = posterior.until[index], posterior.innovations(theta, index)
    alive = (np.asarray(posterior.records[index].readings.use)[:until] > 0) & (found.variance[:until] > 0)
    return np.where(alive, found.error[:until] / np.sqrt(np.where(alive, found.variance[:until], 1.0)), 0.0)


def whiteness(posterior: Posterior, theta: np.ndarray) -> float:
    """Largest lag-one correlation of the innovations of any channel over the samples that were fitted.

    Of few samples it is made smaller, as chance is larger there; of a coarse channel, too, whose errors repeat.
    """
    worst = 0.0
    for index, nuisances in enumerate(posterior.records):
        r = standardised(posterior, theta, index)[1:]
        correlation = np.abs(np.sum(r[1:] * r[:-1], 0) / np.maximum(np.sum(r * r, 0), 1e-300))
        correlation = np.where(nuisances.coarse, _OF_DIGITS * correlation, correlation)
        worst = max(worst, float(np.max(correlation)) * min(1.0, math.sqrt(len(r) / _ENOUGH)))
    return worst


def lane_left(posterior: Posterior, theta: np.ndarray, lane: int) -> float:
    """Error power that the prediction of one lane leaves, in those of the signal, over all sets."""
    return predict(_alone_in(posterior, lane), theta[lane]).power


def _alone_in(posterior: Posterior, lane: int) -> Posterior:
    """The posterior of one lane by itself."""
    if posterior.lanes == 1:
        return posterior
    hypothesis = posterior.hypothesis
    alone = Hypothesis((hypothesis.structures[lane],), (hypothesis.unknowns[lane],))
    return Posterior(alone, posterior.records, posterior.until)


def trial(
    posterior: Posterior, maximum: Maximum, lane: int, rung: float, label: str = "", effects: tuple[Effect, ...] = ()
) -> Trial:
    """The lane of a fit as a trial."""
    alone = _alone_in(posterior, lane)
    theta, unknowns = maximum.theta[lane], posterior.hypothesis.unknowns[lane]
    scales = np.array([t for u, t in zip(unknowns, theta, strict=True) if u.path.startswith("noise@")])
    return Trial(
        label=label,
        effects=effects,
        structure=alone.structure(theta),
        unknowns=unknowns,
        theta=theta,
        covariance=np.linalg.pinv(maximum.information[lane], hermitian=True),
        information=maximum.information[lane],
        evidence=maximum.evidence(lane),
        value=float(maximum.value[lane]),
        rung=rung,
        converged=maximum.results[lane].ok,
        prediction=predict(alone, theta, slight=not effects),
        whiteness=whiteness(alone, theta),
        noise=scales,
        trusted=np.concatenate([n.trusted for n in posterior.records]),
        steps=tuple(n.inputs.substeps for n in posterior.records),
    )
