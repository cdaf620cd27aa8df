"""Channels that are late by less than a sample, as every sensor may be: no finding, but time that is put right."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from ..records import Record
from ..structures import ChannelDelay, ForceDelay, Structure
from ._adequacy import SIGNIFICANT
from ._holdout import HeldOut
from ._trial import Trial

_DELAYS = (ForceDelay, ChannelDelay)
Late = Mapping[tuple[str, int], float]
"""How late channels are, by (kind, degree of freedom) [s]."""


def slightly_late(trials: Sequence[Trial], known: Late, dt: float) -> Late:
    """How late channels are by the likeliest trial, on top of what is `known`; that alone where nothing is new.

    Each is so by less than a sample, and the same trial with all channels in time is far less likely.
    """
    best = max(trials, key=lambda t: t.evidence)
    delays = [part for part in best.parts if isinstance(part, _DELAYS)]
    more = {part.at: known.get(part.at, 0.0) + float(part.tau) for part in delays}
    rest = tuple(effect for effect in best.effects if not issubclass(effect.cause.effect, _DELAYS))
    without = max((t.evidence for t in trials if t.effects == rest), default=-math.inf)
    slight = all(abs(tau) < dt for tau in more.values())
    return {**known, **more} if delays and slight and best.evidence > without + SIGNIFICANT else known


def in_time(
    training: Sequence[tuple[Record, int]], held: Sequence[HeldOut], late: Late
) -> tuple[list[tuple[Record, int]], list[HeldOut]]:
    """What is fitted, and what is held out, with channels in time that are known to be late."""
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
