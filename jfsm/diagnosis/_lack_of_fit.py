"""Lack of fit: what a law of any other shape, beside those of a hypothesis, would explain of its innovations.

A score test (C. R. Rao, Proc. Camb. Phil. Soc. 44, 1948, 50-57): a small force of many shapes is added to what drives
the filter, and the innovations are regressed on what each does to them beside what the hypothesis' own unknowns do. The
shapes are polynomials of the motion that the hypothesis itself predicts, so that no noise of the readings is in them.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jax import Array

from .._threads import side_by_side
from ..dynamics._plant import direction
from ..identification import Nuisances, Posterior, missing_force
from ._trial import Trial, free_run

_DEGREE = 5
"""Of the polynomials in displacement and velocity."""
_FARTHEST = 4.0
"""Standard deviations of the motion beyond which a shape stays as it is there."""
_SMALL = 1e-4
"""Size of the force that is added, as a share of the elastic force."""
_NUDGE = 1e-2
"""Change of an unknown that shows what it does, in its standard errors."""
_APART = 1e-6
"""Singular values, as shares of the largest, below which shapes are no longer told apart."""


class Unfit(NamedTuple):
    """What other shapes would gain beside a hypothesis: nats beyond what noise lets them in the mean, and the share of
    its innovations' power that they explain."""

    nats: float
    share: float = 0.0


class _Shown(NamedTuple):
    """Fitted readings of a record in their standard deviations: innovations, and how unknowns and shapes move them."""

    error: np.ndarray
    by_unknown: np.ndarray
    by_shape: np.ndarray


class LackOfFit:
    """What other shapes would gain beside trials of these records; asked again, it remembers."""

    def __init__(self, records: Sequence[Nuisances], until: Sequence[int]):
        self.records, self.until = records, until
        self._known: dict[int, tuple[np.ndarray, Unfit]] = {}

    def __call__(self, trial: Trial) -> Unfit:
        """What other shapes would gain where the trial has its laws.

        Nothing is known, and nothing gained, where the motion is imposed or runs away.
        """
        # A trial that is judged anew, beside another baseline, has the same values still.
        if id(trial.theta) not in self._known:
            self._known[id(trial.theta)] = trial.theta, _unfit(trial, self.records, self.until)
        return self._known[id(trial.theta)][1]

    def known(self, trial: Trial) -> float | None:
        """The nats, if they were asked before; None otherwise."""
        return self._known[id(trial.theta)][1].nats if id(trial.theta) in self._known else None


def _unfit(trial: Trial, records: Sequence[Nuisances], until: Sequence[int]) -> Unfit:
    if records[0].path is not None:
        return Unfit(0.0)
    posterior = trial.posterior(records, until)
    links = list(dict.fromkeys(law.at for law in trial.laws)) or list(trial.structure.links)
    shapes = _shapes(trial, posterior, links)
    if shapes is None:
        return Unfit(0.0)
    shown = [_shown(trial, posterior, index, shape) for index, shape in enumerate(shapes)]
    error, by_unknown, by_shape = (np.concatenate(parts) for parts in zip(*shown, strict=True))
    left, told = _regressed(by_unknown, error)
    less, more = _regressed(np.hstack([by_unknown, by_shape]), error)
    nats = (left - less) / 2 - (more - told) / 2  # half of chi-square, less half of its mean
    return Unfit(nats, (left - less) / max(left, np.finfo(float).tiny))


def _shapes(trial: Trial, posterior: Posterior, links: Sequence[tuple[int, int]]) -> list[np.ndarray] | None:
    """Forces (shapes, n, dof) of unit size along the motion of every record; None where it runs away."""
    rows = np.array([direction(link, trial.structure.dof) for link in links])
    motions = []
    for index, nuisances in enumerate(posterior.records):
        run = free_run(posterior, trial.theta, index)
        if not np.all(np.isfinite(run)):
            return None
        motion = missing_force(trial.structure, nuisances.showing(run), nuisances.samples)
        motions.append(np.stack([motion.displacement @ rows.T, motion.velocity @ rows.T]))  # (2, n, links)
    every = np.concatenate(motions, 1)
    spread = np.maximum(every.std(1, keepdims=True), 1e-300)
    d, w = np.clip((every - every.mean(1, keepdims=True)) / spread, -_FARTHEST, _FARTHEST)
    found = np.stack([d**i * w**j for i in range(_DEGREE + 1) for j in range(_DEGREE + 1 - i)])
    found = found / np.maximum(np.sqrt(np.mean(found**2, 1, keepdims=True)), 1e-300)
    forces = np.concatenate([found[:, :, i, None] * row for i, row in enumerate(rows)])
    return np.split(forces, np.cumsum([motion.shape[1] for motion in motions])[:-1], 1)


def _shown(trial: Trial, posterior: Posterior, index: int, shapes: np.ndarray) -> _Shown:
    """What each unknown and each shape (shapes, n, dof) does to record `index`."""
    nuisances, theta = posterior.records[index], trial.theta
    slack = nuisances.forgiven
    base = posterior.innovations(theta, index, slack=slack)
    error, deviation = np.asarray(base.error), np.sqrt(np.maximum(base.variance, 1e-300))
    counted = np.asarray(nuisances.readings.use)[: len(error)] > 0
    counted[0], counted[posterior.until[index] :] = False, False  # the start is an unknown

    def ours(readings: np.ndarray) -> np.ndarray:
        return readings[counted] / deviation[counted]

    def moved(then: Array, change: float) -> np.ndarray:
        return ours(np.asarray(then) - error) / change

    def by_unknown(k: int) -> np.ndarray:
        if trial.unknowns[k].path.startswith("noise@") or trial.unknowns[k].record not in (None, index):
            return np.zeros(np.count_nonzero(counted))
        change = _NUDGE * max(math.sqrt(max(trial.covariance[k, k], 0.0)), 1e-9)
        nudged = theta + change * (np.arange(theta.size) == k)
        return moved(posterior.innovations(nudged, index, slack=slack).error, change)

    def by_shape(shape: np.ndarray) -> np.ndarray:
        push = -_SMALL * nuisances.elastic_force(trial.structure) * shape
        return moved(posterior.innovations(theta, index, push=push, slack=slack).error, _SMALL)

    unknowns, forces = side_by_side(by_unknown, range(theta.size)), side_by_side(by_shape, shapes)
    return _Shown(ours(error), np.stack(list(unknowns), 1), np.stack(list(forces), 1))


def _regressed(columns: np.ndarray, wanted: np.ndarray) -> tuple[float, int]:
    """Sum of squares that least squares leave, and how many of the columns are told apart."""
    scale = np.linalg.norm(columns, axis=0)
    scale = np.where(scale > 0, scale, 1.0)
    found, _, rank, _ = np.linalg.lstsq(columns / scale, wanted, rcond=_APART)
    return float(np.sum((wanted - columns @ (found / scale)) ** 2)), int(rank)
