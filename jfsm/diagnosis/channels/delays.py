"""Responses that are late by less than a sample, as every sensor may be: they are no finding, and are shifted back."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ...identification import Nuisances
from ...records import Record, advanced
from ...structures import ChannelDelay, ForceDelay, Structure
from ..evidence.fitted import Trial, cost, standardised
from ..evidence.setup import Problem
from ..evidence.split import HeldOut
from ..thresholds import THRESHOLDS

_DELAYS = (ForceDelay, ChannelDelay)
Late = Mapping[tuple[str, int], float]
"""How late channels are, by (kind, degree of freedom) [s]."""
OF_THE_MISFIT = 0.5
"""Share of what a trial leaves beyond its noise that another time of a channel has to promise: it shall explain all."""
_STEP = 0.25
"""Samples by which a channel is read earlier and later."""
_FARTHER = 4.0
"""Multiple of the gain by a parabola about no delay that a longer delay may reach."""


def slightly_late(trials: Sequence[Trial], known: Late, record: Record) -> Late:
    """How late response channels of a record are by the likeliest trial, on top of what is `known`; that alone where
    nothing is new.

    Each is so by less than a sample, and the same trial with all channels in time is far less likely. The force is none
    of them, nor a response by which alone it is told that the force is in time.
    """
    best = max(trials, key=lambda t: t.evidence)
    delays = [part for part in best.parts if isinstance(part, _DELAYS)]
    if not delays or not all(_is_slight(part, record) for part in delays):
        return known
    if best.evidence <= _in_time_evidence(best, trials) + THRESHOLDS.significant:
        return known
    return {**known, **{part.at: known.get(part.at, 0.0) + float(part.tau) for part in delays}}


def _is_slight(part: ForceDelay | ChannelDelay, record: Record) -> bool:
    """Whether a response channel is late by less than a sample, and others tell the time."""
    tells = len(record.responses) > 1 or len(record.channels) == 1
    return tells and isinstance(part, ChannelDelay) and abs(part.value) < record.dt


def _in_time_evidence(best: Trial, trials: Sequence[Trial]) -> float:
    """Log-evidence of the effects of a trial without its delays; minus infinity where nobody fitted them."""
    rest = tuple(effect for effect in best.effects if not issubclass(effect.cause.effect, _DELAYS))
    return max((t.evidence for t in trials if t.effects == rest), default=-math.inf)


def seems_late(beside: Trial, problem: Problem) -> ChannelDelay | None:
    """The delay, of less than a sample, of a channel that would make a trial without delays far likelier, and explain
    most of what it leaves, if any."""
    found = likeliest_delay(beside, problem)
    if found is None or found[1] < max(THRESHOLDS.searched, OF_THE_MISFIT * misfit(beside, problem)):
        return None
    return found[0]


def misfit(beside: Trial, problem: Problem) -> float:
    """Nats by which the innovations of a trial exceed what its noise makes."""
    posterior = problem.posterior_of(beside)
    every = (standardised(posterior, beside.theta, index) for index in range(len(problem.records)))
    return sum(0.5 * float(np.sum(r**2) - np.count_nonzero(r)) for r in every)


def likeliest_delay(beside: Trial, problem: Problem) -> tuple[ChannelDelay, float] | None:
    """The delay of a channel, of less than a sample, by which a trial gains most, and so many nats; None where none is
    seen.

    The trial's numbers stay: a parabola through what it is worth a quarter of a sample earlier and later.
    """
    if problem.imposed:
        return None
    now, found = cost(problem.posterior_of(beside), beside.theta), dict[tuple[str, int], tuple[float, float]]()
    for c, channel in enumerate(problem.first.channels):
        slope, curvature = _parabola(beside, problem, c, now)
        if curvature > 0 and abs(slope) * _STEP < curvature:
            found[channel] = slope**2 / (2 * curvature), -slope / curvature * _STEP
    most = max(found, key=lambda channel: found[channel], default=None)
    if most is None:
        return None
    return ChannelDelay(found[most][1] * problem.first.record.dt, at=most), found[most][0]


def gain_of_delay(beside: Trial, channel: tuple[str, int], problem: Problem) -> float:
    """Nats that a trial would gain at most, as far as a parabola tells, were a channel late; infinite where none does.

    A delay of several samples may gain more than the parabola about none, but not many times more.
    """
    if problem.imposed:
        return math.inf
    c = problem.first.channels.index(channel)
    slope, curvature = _parabola(beside, problem, c, cost(problem.posterior_of(beside), beside.theta))
    return _FARTHER * slope**2 / (2 * curvature) if curvature > 0 else math.inf


def _parabola(t: Trial, problem: Problem, c: int, now: float) -> tuple[float, float]:
    """Slope and curvature of a trial's cost, `now` without a delay, over the delay of a channel in steps."""
    moved = (_read_later(problem, c, samples) for samples in (-_STEP, _STEP))
    earlier, later = (cost(other.posterior_of(t), t.theta) for other in moved)
    return (later - earlier) / 2, later + earlier - 2 * now


def _read_later(problem: Problem, c: int, samples: float) -> Problem:
    """The same problem, a channel of its records read so many samples later."""

    def moved(nuisances: Nuisances) -> Nuisances:
        values = np.array(nuisances.readings.values)[: nuisances.samples]
        values[:, c] = advanced(values[:, c], samples, nuisances.record.dt)
        return nuisances.showing(values)

    return problem._replace(records=[moved(nuisances) for nuisances in problem.records])


def in_time(
    training: Sequence[tuple[Record, int]], held: Sequence[HeldOut], late: Late
) -> tuple[list[tuple[Record, int]], list[HeldOut]]:
    """The fitted and the held-out records, with the channels shifted back that are known to be late."""
    if not late:
        return list(training), list(held)

    def said(record: Record) -> list[str]:
        samples = {channel: tau / record.dt for channel, tau in late.items()}
        return [
            f"{kind} {j} seems late by {much:.2g} of a sample; so much is taken for the sensor's."
            for (kind, j), much in samples.items()
        ]

    fitted = [(record.aligned(late).noted(*said(record)), until) for record, until in training]
    return fitted, [replace(part, record=part.record.aligned(late)) for part in held]


def showing_late(structure: Structure, late: Late) -> Structure:
    """The structure, as it shows in channels that are so late."""
    for (kind, j), tau in late.items():
        structure = structure + (ForceDelay(tau, at=(kind, j)) if kind == "force" else ChannelDelay(tau, at=(kind, j)))
    return structure
