"""When a force acts: how it goes between its samples, and how much later than it was recorded."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple, get_args

import numpy as np

from ...identification import Nuisances, Unknown, settle
from ...plant import Channel, InterpolatedInput, Reconstruction
from ...structures import ForceDelay, Structure
from ..evidence.excess import explained, is_noise_only
from ..evidence.fitted import Trial, trial
from ..evidence.identifiable import single_line
from ..evidence.setup import Problem
from ..thresholds import THRESHOLDS
from .delays import OF_THE_MISFIT, likeliest_delay, misfit

WAYS: tuple[Reconstruction, ...] = get_args(Reconstruction)
"""Of a force between its samples; what is filtered before it is sampled goes the first one."""
Lateness = Mapping[Channel, tuple[float, float, float]]
"""How late forces are, by channel, with the 95 % interval [s]; negative where they act later than was recorded."""
_USUAL, _FARTHEST = 0.5, 1.0
"""Samples by which a force is late as a rule, and at most: one that is later is a candidate like any other."""
_WORTH_A_FIT = 0.8
"""Share of the most nats that some time of the force promises, from which another one is fitted too."""


class _Way(NamedTuple):
    """A way of the force between its samples, as recorded or late, and the nats that it promises beside a trial."""

    reconstruction: Reconstruction
    late: bool
    promise: float


class _Timed(NamedTuple):
    """A trial where the force acts at other times."""

    problem: Problem
    trial: Trial
    late: bool


def in_its_time(beside: Trial, problem: Problem, *, to_noise: bool, likeliest: float | None = None) -> Problem | None:
    """The problem in which the force acts otherwise, where that is far likelier beside a trial; None elsewhere.

    It has to explain nearly all of what the trial leaves, or leave noise alone, as it must with `to_noise`: what a
    model lacks may look like a late force, and so may one late response of two. A single line does not show it.
    The `likeliest` evidence known is what it has to exceed, that of the trial by default.
    """
    behind = 0.0 if likeliest is None else likeliest - beside.evidence
    ways = _worth_a_fit(beside, problem, behind)
    found = [] if problem.limit.over else [one for way in ways for one in _fitted(beside, problem, way)]
    if not found:
        return None
    best = _likeliest(found)
    least = max(behind + THRESHOLDS.searched, _by_a_late_channel(beside, problem))
    likelier = best.trial.evidence - beside.evidence >= least
    enough = is_noise_only(best.trial) or (not to_noise and explained(best.trial, beside) >= THRESHOLDS.nearly_all)
    return best.problem if likelier and enough else None


def late_channels(structure: Structure, problem: Problem, assumed: Reconstruction) -> list[Channel]:
    """The channels of the force that are late in a problem that knows when it acts: all, or none. One that is held is,
    unless that was `assumed`."""
    first = problem.first
    return _forces(structure, first) if first.late or first.reconstruction == "hold" != assumed else []


def lateness(t: Trial, problem: Problem, assumed: Reconstruction = WAYS[0]) -> Lateness:
    """How late the force is in a problem that knows it, beside a trial.

    One that is held between its samples is late by half of one; what goes straight is in time.
    """
    first, dt = problem.first, problem.first.record.dt
    channels = late_channels(t.structure, problem, assumed)
    by_holding = dt * (_by_holding(first.reconstruction) - _by_holding(assumed))
    if not first.late:
        return {channel: (by_holding, by_holding, by_holding) for channel in channels}
    free, found = _with_delays(t, problem), dict[Channel, tuple[float, float, float]]()
    covariance = np.linalg.pinv(problem.posterior_of(free).evaluate(free.theta[None])[2][0], hermitian=True)
    for k, channel in enumerate(channels, start=t.theta.size):
        tau, far = first.late.get(channel, 0.0) + by_holding, 1.96 * dt * float(np.sqrt(max(covariance[k, k], 0.0)))
        found[channel] = tau, tau - far, tau + far
    return found


def _worth_a_fit(beside: Trial, problem: Problem, behind: float) -> list[_Way]:
    """The ways that promise most beside a trial, where they promise enough for one that is so far behind."""
    if not problem.ways or not _forces(beside.structure, problem.first) or single_line(problem.records) is not None:
        return []
    ways = [way for name in problem.ways for way in _promises(beside, problem, name)]
    most = max((way.promise for way in ways), default=0.0)
    least = max(behind + THRESHOLDS.searched, _WORTH_A_FIT * most, OF_THE_MISFIT * misfit(beside, problem))
    return [way for way in ways if way.promise >= least]


def _forces(structure: Structure, nuisances: Nuisances) -> list[Channel]:
    """The channels of the force that drive a structure and of whose delay it says nothing."""
    if not isinstance(nuisances.inputs, InterpolatedInput):
        return []
    known = {sensor.at for sensor in structure.sensors if isinstance(sensor, ForceDelay)}
    acting = np.any(np.asarray(nuisances.inputs.force)[:, 0], axis=0)
    channels = [c for c in nuisances.record.channels if c[0] == "force" and acting[c[1] - 1]]
    return [channel for channel in channels if channel not in known]


def _by_holding(way: Reconstruction) -> float:
    """Samples by which the way of a force between its samples makes it late, as its delay is counted."""
    return -0.5 if way == "hold" else 0.0


def _with_delays(t: Trial, problem: Problem) -> Trial:
    """The trial with the delays of the forces among its unknowns, none so far."""
    dt, structure, unknowns = problem.first.record.dt, t.structure, list(t.unknowns)
    low = -_FARTHEST - _by_holding(problem.first.reconstruction)
    for channel in _forces(structure, problem.first):
        sensor = ForceDelay(0.0, at=channel)
        structure = structure + sensor
        path = f"{sensor.kind}@{sensor.place}.tau"
        unknowns.append(Unknown(path, 0.0, dt, False, 0.0, _USUAL, low=low, high=_FARTHEST))
    theta = np.concatenate([t.theta, np.zeros(len(unknowns) - t.theta.size)])
    return replace(t, structure=structure, unknowns=tuple(unknowns), theta=theta)


def _promises(beside: Trial, problem: Problem, way: Reconstruction) -> Iterator[_Way]:
    """What the force going some way, as recorded and late, promises beside a trial whose numbers follow: the gain of
    one Newton step, the noise staying as strong as it was."""
    other, free = problem.timed(way, {}), _with_delays(beside, problem)
    value, gradient, information = (each[0] for each in other.posterior_of(free).evaluate(free.theta[None]))
    if not (np.isfinite(value) and np.all(np.isfinite(gradient)) and np.all(np.isfinite(information))):
        return  # it runs away there
    now = beside.value + _prior_of_delays(free.theta.size - beside.theta.size)
    follows = np.array([not u.path.startswith("noise@") for u in free.unknowns])
    for late in (False, True):
        mine = follows & (late | (np.arange(free.theta.size) < beside.theta.size))
        slope, curvature = gradient[mine], information[np.ix_(mine, mine)]
        step = np.linalg.lstsq(curvature, slope, rcond=None)[0]
        yield _Way(way, late, float(now - value + 0.5 * slope @ step))


def _prior_of_delays(count: int) -> float:
    """Minus the logarithm of the prior of so many delays, at none."""
    return count * float(np.log(_USUAL) + 0.5 * np.log(2 * np.pi))


def _fitted(beside: Trial, problem: Problem, way: _Way) -> Iterator[_Timed]:
    """A trial fitted again where the force goes some way; none where it would be later than it may be."""
    other, theta = problem.timed(way.reconstruction, {}), beside.theta
    if way.late:
        free = _with_delays(beside, other)
        found = settle(other.posterior_of(free), free.theta, problem.limit)
        theta, delays = np.split(found.theta[0], [beside.theta.size])
        if any(not u.low < delay < u.high for u, delay in zip(free.unknowns[theta.size :], delays, strict=True)):
            return
        seconds = (delays * problem.first.record.dt).tolist()
        channels = _forces(beside.structure, problem.first)
        other = problem.timed(way.reconstruction, dict(zip(channels, seconds, strict=True)))
    posterior = other.posterior_of(beside)
    found = settle(posterior, theta, problem.limit)
    yield _Timed(other, trial(posterior, found, 0, beside.rung, beside.label, beside.effects), way.late)


def _likeliest(found: list[_Timed]) -> _Timed:
    """The likeliest; the likeliest without a delay where one hardly makes it likelier."""
    best = max(found, key=lambda one: one.trial.evidence)
    least = best.trial.evidence - THRESHOLDS.significant
    in_time = [one for one in found if not one.late and one.trial.evidence > least]
    return max(in_time, key=lambda one: one.trial.evidence, default=best)


def _by_a_late_channel(beside: Trial, problem: Problem) -> float:
    """Nats that a trial would gain were one of several response channels late: of one alone the force may be early."""
    if len(problem.first.channels) < 2:
        return 0.0
    found = likeliest_delay(beside, problem)
    return 0.0 if found is None else found[1]
