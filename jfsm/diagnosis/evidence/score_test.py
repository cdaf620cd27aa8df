"""The score test: what a small force beside those of a trial would explain of its innovations.

C. R. Rao, Proc. Camb. Phil. Soc. 44 (1948) 50-57. The force is added to what drives the filter, and the innovations are
regressed on what it does to them beside what the trial's own unknowns do.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..._threads import side_by_side
from ...identification import Placed, Posterior
from ...structures import AbstractSensor, AbstractTerm
from ..hypotheses.placement import Laws
from .fitted import Trial
from .setup import Problem

_SMALL = 1e-4
"""Size of the force that is added, as a share of the elastic force."""
_NUDGE = 1e-2
"""Change of an unknown that shows what it does, in its standard errors."""
_TOGETHER = 16
"""Runs that are asked for at once."""
_APART = 1e-6
"""Singular values, as shares of the largest, below which shapes are no longer told apart."""


class Moved(NamedTuple):
    """Fitted readings of a record in their standard deviations: innovations, and how unknowns and forces move them."""

    error: np.ndarray
    by_unknown: np.ndarray
    by_force: np.ndarray


class Replaced(NamedTuple):
    """A part of a trial that something else would replace: its restoring force (n, dof), and its numbers' paths."""

    force: np.ndarray
    paths: frozenset[str]


def moved(trial: Trial, posterior: Posterior, index: int, forces: np.ndarray) -> Moved:
    """What each unknown and each restoring force (forces, n, dof) of unit size does to record `index`."""
    nuisances, theta = posterior.records[index], trial.theta
    slack = nuisances.forgiven
    base = posterior.innovations(theta, index, slack=slack)
    error, deviation = np.asarray(base.error), np.sqrt(np.maximum(base.variance, 1e-300))
    counted = np.asarray(nuisances.readings.use)[: len(error)] > 0
    counted[0], counted[posterior.until[index] :] = False, False  # the start is an unknown

    def ours(readings: np.ndarray) -> np.ndarray:
        inside = readings[counted] / deviation[counted]
        return inside if np.all(np.isfinite(inside)) else np.zeros_like(inside)  # a motion that runs away tells nothing

    mine = [not u.path.startswith("noise@") and u.record in (None, index) for u in trial.unknowns]
    change = np.where(mine, _NUDGE * np.maximum(np.sqrt(np.maximum(np.diag(trial.covariance), 0.0)), 1e-9), 0.0)
    picked = np.flatnonzero(mine)
    push = -_SMALL * nuisances.elastic_force(trial.structure) * forces
    push = np.concatenate([np.zeros((len(picked), *push.shape[1:])), push])
    values = theta + np.concatenate([np.diag(change)[picked], np.zeros((len(forces), theta.size))])
    lots = [slice(k, k + _TOGETHER) for k in range(0, len(values), _TOGETHER)]

    def run(lot: slice) -> np.ndarray:
        loose = np.full(len(values[lot]), slack)
        found = posterior.many_innovations(values[lot], index, push=push[lot], slack=loose)
        return np.asarray(found.error) - error

    changes = np.concatenate(list(side_by_side(run, lots)))
    changes /= np.concatenate([change[picked], np.full(len(forces), _SMALL)])[:, None, None]
    by_unknown = np.zeros((np.count_nonzero(counted), theta.size))
    for k, moved_by in zip(picked, changes, strict=False):
        by_unknown[:, k] = ours(moved_by)
    by_force = np.stack([ours(moved_by) for moved_by in changes[len(picked) :]], 1)
    return Moved(ours(error), by_unknown, by_force)


def regressed(columns: np.ndarray, wanted: np.ndarray) -> tuple[np.ndarray, int]:
    """What least squares leave of one or several columns, and how many of the others are told apart."""
    scale = np.linalg.norm(columns, axis=0)
    columns = columns / np.where(scale > 0, scale, 1.0)
    found, _, rank, _ = np.linalg.lstsq(columns, wanted, rcond=_APART)
    return wanted - columns @ found, int(rank)


def gains(trial: Trial, problem: Problem, forces: np.ndarray, instead_of: Replaced | None = None) -> np.ndarray:
    """Nats that each restoring force (forces, n, dof) would gain by itself in the first record, of whatever size.

    None where it runs away, or would have to act the other way round. With a part that is replaced, what is gained by
    its replacement, and lost with it.
    """
    every = forces if instead_of is None else np.concatenate([instead_of.force[None], forces])
    size = np.sqrt(np.mean(every**2, (1, 2)))
    told = np.isfinite(size) & (size > 0)
    found = np.zeros(len(forces))
    if not np.any(told) or (instead_of is not None and not told[0]):
        return found
    unit = every[told] / size[told, None, None]
    unit = np.pad(unit, ((0, 0), (0, problem.first.samples - unit.shape[1]), (0, 0)))
    error, by_unknown, by_force = moved(trial, problem.posterior_of(trial), 0, unit)
    before = float(np.sum(regressed(by_unknown, error)[0] ** 2))
    if instead_of is not None:
        error = error - by_force[:, 0] * size[0] / problem.first.elastic_force(trial.structure)
        by_unknown = by_unknown[:, [u.path not in instead_of.paths for u in trial.unknowns]]
        by_force, told = by_force[:, 1:], told[1:]
    left, _ = regressed(by_unknown, np.column_stack([error, by_force]))
    error, by_force = left[:, 0], left[:, 1:]
    with np.errstate(divide="ignore", invalid="ignore"):
        gained = np.minimum(error @ by_force, 0.0) ** 2 / np.sum(by_force**2, 0)
    found[told] = np.nan_to_num(gained, nan=0.0, posinf=0.0)
    return (before - float(np.sum(error**2)) + found) / 2


def promised(
    base: Trial,
    changed: AbstractTerm | AbstractSensor | None,
    laws: Laws,
    placed: Sequence[list[Placed]],
    problem: Problem,
) -> list[list[tuple[Placed, float]]]:
    """The shapes of each law, best first, with the evidence that they promise beside a trial, instead of its part that
    is `changed` if that is a law.

    Along an imposed motion with minus the mean square force that they leave.
    """
    if not placed:
        return []
    if problem.imposed:
        return [_best_first(shapes, [-shape.left for shape in shapes]) for shapes in placed]
    replaced = None
    if isinstance(changed, AbstractTerm):
        paths = base.structure.entries().keys() - laws.structure.entries().keys()
        replaced = Replaced(laws.forces([changed])[0], frozenset(paths))
    forces = np.concatenate([laws.forces([shape.term for shape in shapes]) for shapes in placed])
    nats = base.evidence + gains(base, problem, forces, replaced)
    parts = np.split(nats, np.cumsum([len(shapes) for shapes in placed])[:-1])
    return [_best_first(shapes, part.tolist()) for shapes, part in zip(placed, parts, strict=True)]


def _best_first(shapes: Sequence[Placed], promise: Sequence[float]) -> list[tuple[Placed, float]]:
    return sorted(zip(shapes, promise, strict=True), key=lambda one: -one[1])
