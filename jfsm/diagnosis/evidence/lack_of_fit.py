"""Lack of fit: what a law of any other shape, beside those of a hypothesis, would explain of its innovations.

A score test of many shapes at once: polynomials of the motion that the hypothesis itself predicts, so that no noise of
the readings is in them.
"""

from collections.abc import Sequence

import numpy as np

from ...identification import Posterior, missing_force
from ...plant import direction
from .fitted import Trial, free_run, runs_away
from .score_test import moved, regressed
from .scorecard import OtherShapes
from .setup import Problem

_DEGREE = 5
"""Of the polynomials in displacement and velocity."""
_FARTHEST = 4.0
"""Standard deviations of the motion beyond which a shape stays as it is there."""


class LackOfFit:
    """What other shapes would gain beside trials of a problem; asked again, it remembers."""

    def __init__(self, problem: Problem):
        self.problem = problem
        self._known: dict[int, tuple[np.ndarray, OtherShapes]] = {}

    def __call__(self, trial: Trial) -> OtherShapes:
        """What other shapes would gain where the trial has its laws.

        Nothing is known, and nothing gained, where the motion is imposed or runs away.
        """
        # A trial that is judged anew, beside another baseline, has the same values still.
        if id(trial.theta) not in self._known:
            self._known[id(trial.theta)] = trial.theta, _unfit(trial, self.problem)
        return self._known[id(trial.theta)][1]

    def known(self, trial: Trial) -> float | None:
        """The nats, if they were asked before; None otherwise."""
        return self._known[id(trial.theta)][1].nats if id(trial.theta) in self._known else None


def _unfit(trial: Trial, problem: Problem) -> OtherShapes:
    if problem.imposed:
        return OtherShapes(0.0)
    posterior = problem.posterior_of(trial)
    links = list(dict.fromkeys(law.at for law in trial.laws)) or list(trial.structure.links)
    runs = [free_run(posterior, trial.theta, index) for index in range(len(posterior.records))]
    if any(map(runs_away, runs, posterior.records)):
        return OtherShapes(0.0, strays=np.inf)
    shapes = _shapes(trial, posterior, links, runs)
    parts = [moved(trial, posterior, index, shape) for index, shape in enumerate(shapes)]
    error, by_unknown, by_shape = (np.concatenate(part) for part in zip(*parts, strict=True))
    digits = all(np.all(nuisances.coarse) for nuisances in posterior.records)
    (left, told), (less, more) = _left(by_unknown, error), _left(np.hstack([by_unknown, by_shape]), error)
    nats = (left - less) / 2 - (more - told) / 2  # half of chi-square, less half of its mean
    # Errors of coarse digits are a curve of the motion as well, if a small one.
    return OtherShapes(
        0.0 if digits else nats, (left - less) / max(left, np.finfo(float).tiny), _strays(posterior, runs)
    )


def _strays(posterior: Posterior, runs: Sequence[np.ndarray]) -> float:
    """Root mean square error of runs over what was fitted, in spreads of the channels."""
    off = []
    for nuisances, until, run in zip(posterior.records, posterior.until, runs, strict=True):
        readings, use = (np.asarray(a)[:until] for a in (nuisances.readings.values, nuisances.readings.use))
        off.append(((run[:until] - readings) / nuisances.spread)[use > 0])
    return float(np.sqrt(np.mean(np.concatenate(off) ** 2)))


def _left(columns: np.ndarray, wanted: np.ndarray) -> tuple[float, int]:
    """Sum of squares that least squares leave, and how many of the columns are told apart."""
    left, told = regressed(columns, wanted)
    return float(np.sum(left**2)), told


def _shapes(
    trial: Trial, posterior: Posterior, links: Sequence[tuple[int, int]], runs: Sequence[np.ndarray]
) -> list[np.ndarray]:
    """Forces (shapes, n, dof) of unit size along the motion of every record, as a hypothesis runs over it."""
    rows = np.array([direction(link, trial.structure.dof) for link in links])
    motions = []
    for nuisances, run in zip(posterior.records, runs, strict=True):
        motion = missing_force(trial.structure, nuisances.showing(run), nuisances.samples)
        motions.append(np.stack([motion.displacement @ rows.T, motion.velocity @ rows.T]))  # (2, n, links)
    every = np.concatenate(motions, 1)
    spread = np.maximum(every.std(1, keepdims=True), 1e-300)
    d, w = np.clip((every - every.mean(1, keepdims=True)) / spread, -_FARTHEST, _FARTHEST)
    found = np.stack([d**i * w**j for i in range(_DEGREE + 1) for j in range(_DEGREE + 1 - i)])
    found = found / np.maximum(np.sqrt(np.mean(found**2, 1, keepdims=True)), 1e-300)
    forces = np.concatenate([found[:, :, i, None] * row for i, row in enumerate(rows)])
    return np.split(forces, np.cumsum([motion.shape[1] for motion in motions])[:-1], 1)
