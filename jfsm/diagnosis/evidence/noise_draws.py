"""Prediction errors that noise alone leaves: records are simulated from a hypothesis and predicted by it.

The filter tells it to first order, and from the noise that a channel was taken to have. Where a motion sticks, strikes
or leaves a well, small errors grow otherwise; and where a channel's signal fills its band, only a fit tells its noise.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import jax
import numpy as np

from ..._threads import side_by_side
from ...identification import Nuisances
from ...plant import InterpolatedInput
from ...records import Record
from ...structures import Clipping
from .course import BASE, remeasured
from .excess import is_noise_only, white
from .fitted import Prediction, Trial, ended, extent, free_run, predict, runs_away, sets
from .setup import Problem

_DRAWS = 6


def beside_chance(trials: Sequence[Trial], problem: Problem, key: jax.Array) -> list[Trial]:
    """The trials; the most probable, if its innovations are white and yet it leaves something, with draws of noise."""
    best = max(trials, key=lambda t: t.evidence)
    limits = any(isinstance(sensor, Clipping) for sensor in problem.model.sensors)
    if is_noise_only(best) or not white(best) or limits or problem.imposed or problem.limit.over:
        return list(trials)
    errors = _errors_of_noise(best, problem, key)
    if errors is None:
        return list(trials)
    found = best.prediction
    prediction = Prediction(
        error=found.error,
        expected=np.maximum(found.expected, errors.mean(0)),
        scatter=np.maximum(found.scatter, errors.std(0, ddof=1)),
    )
    return [replace(t, prediction=prediction) if t is best else t for t in trials]


def _errors_of_noise(trial: Trial, problem: Problem, key: jax.Array) -> np.ndarray | None:
    """Errors (draws, sets) with which a trial predicts records that are simulated from it, each with fresh noise.

    None where it runs away.
    """
    posterior, records = problem.posterior_of(trial), problem.records
    runs = [free_run(posterior, trial.theta, index) for index in range(len(records))]
    if any(map(runs_away, runs, records)):
        return None
    levels = [noise_levels(trial, n, index) for index, n in enumerate(records)]
    seeds = np.asarray(jax.random.key_data(key)).astype(np.uint32).tolist()

    def draw(rng: np.random.Generator) -> np.ndarray:
        noisy = [_noisy(*parts, rng) for parts in zip(records, runs, levels, strict=True)]
        again = problem.of(noisy, trial.structure)
        return predict(again.posterior_of(trial), trial.theta).error

    return np.array(list(side_by_side(draw, np.random.default_rng(seeds).spawn(_DRAWS))))


def noise_beyond(trials: Sequence[Trial], problem: Problem) -> np.ndarray:
    """Power of noise per set, in units as of predictions, beyond that which channels gave but a guess of.

    The innovations of the most probable trial tell it where they are white.
    """
    best, more = max(trials, key=lambda t: t.evidence), []
    for index, nuisances in enumerate(problem.records):
        levels = noise_levels(best, nuisances, index)
        found = np.array([levels[channel] for channel in nuisances.channels])
        guessed = ~nuisances.trusted if white(best) else np.zeros(len(found), dtype=bool)
        beyond = np.where(guessed, np.maximum(found**2 - nuisances.floor**2, 0.0), 0.0)
        power = float(np.sum(beyond / extent(nuisances) ** 2))
        more += [power] * len(sets(nuisances, problem.until[index]))
    return np.array(more)


def noise_levels(trial: Trial, nuisances: Nuisances, index: int = 0) -> dict[tuple, float]:
    """Standard deviation of every channel's noise in record `index`: of responses as fitted, of what drives at its
    floor."""
    scales = {u.path: theta for u, theta in ended(trial) if u.record in (None, index)}
    levels = {
        channel: float(floor) * math.exp(scales.get(f"noise@{c}", 0.0) / 2)
        for c, (channel, floor) in enumerate(zip(nuisances.channels, nuisances.floor, strict=True))
    }
    forces = {("force", j + 1): float(floor) for j, floor in enumerate(nuisances.force_floor)}
    return levels | forces | {BASE: nuisances.base_floor}


def _noisy(nuisances: Nuisances, run: np.ndarray, levels: dict[tuple, float], rng: np.random.Generator) -> Record:
    """The record of a run under what is taken to drive it, with fresh noise on every channel."""
    assert isinstance(nuisances.inputs, InterpolatedInput)
    force, base = (
        np.asarray(drive)[: nuisances.samples, 0] for drive in (nuisances.inputs.force, nuisances.inputs.base)
    )
    truth = {**dict(zip(nuisances.channels, run.T, strict=True)), BASE: base}
    truth |= {channel: force[:, channel[1] - 1] for channel in nuisances.record.channels if channel[0] == "force"}
    return remeasured(nuisances.record, truth, levels, rng, nuisances.memories)
