"""Stretches of a record that the structure of the rest does not predict."""

import numpy as np

from ...identification import Nuisances
from ..evidence.fitted import FILTERED, PREDICTED, Trial, windows
from ..evidence.setup import Problem

_ADVICE = "A structure that changed, or a sensor that failed: diagnose the parts by themselves."
_BLOCKS, _FEWEST = 20, 8
"""Blocks of a record, at most and at least; each holds a prediction."""
_WORSE = 5.0
"""Error of a block, in that of half of them, from which it is another structure's, or a sensor's that failed,"""
_AT_AN_EDGE = 2.0
"""and that from which a block next to a bad one is partly bad;"""
_MATTERS = 0.05
"""if it is so much of the signal,"""
_LOUDER = 2.0
"""and the block not that much louder than half of them, as what a model lacks may grow with the motion."""
_LASTS = 0.8
"""Share of the blocks after the first bad one that are bad where it stays so."""


def unsteady(t: Trial, problem: Problem) -> list[str]:
    """When records are predicted far worse than in the rest of their time, in words.

    Nothing is said of a structure with several rests: on the hill between them a small error grows by itself.
    """
    if t.structure.rests():
        return []
    posterior, words = problem.posterior_of(t), []
    for index, nuisances in enumerate(problem.records):
        use, free = windows(nuisances)
        error = np.asarray(posterior.innovations(t.theta, index, use=use, noise_scales=False).error)
        for c, (kind, j) in enumerate(nuisances.channels):
            bad = _bad_blocks(nuisances, c, error[:, c], free)
            if bad is None:
                continue
            when = f" of record {index + 1}" if len(problem.records) > 1 else ""
            words.append(f"{kind.capitalize()} {j}{when} is predicted far worse {bad} than elsewhere. {_ADVICE}")
    return words


def _bad_blocks(nuisances: Nuisances, channel: int, error: np.ndarray, free: np.ndarray) -> str | None:
    """When a channel is predicted far worse than elsewhere, in words; None where that is nowhere."""
    record, n = nuisances.record, nuisances.samples
    count = min(_BLOCKS, int(record.duration / ((FILTERED + PREDICTED) * nuisances.period)))
    if count < _FEWEST or not np.all(np.isfinite(error)):
        return None
    readings, alive = (np.asarray(a)[:n, channel] for a in (nuisances.readings.values, nuisances.readings.use))
    counted, about = free & (alive > 0), readings - np.mean(readings)
    blocks = [block[counted[block]] for block in np.array_split(np.arange(n), count)]
    if not all(block.size for block in blocks):
        return None
    off, loud = _rms(error, blocks), _rms(about, blocks)
    relative = off / np.hypot(nuisances.floor[channel], _MATTERS * loud)
    bad = (relative > _WORSE * np.median(relative)) & (off > _MATTERS * nuisances.spread[channel])
    bad = np.flatnonzero(bad & (loud < _LOUDER * np.median(loud)))
    if bad.size == 0:
        return None
    first, last = _widened(bad[0], bad[-1], relative > _AT_AN_EDGE * np.median(relative))
    begin, end = record.time[blocks[first][0]], record.time[blocks[last][-1]]
    if bad.size >= _LASTS * (count - bad[0]):
        return f"from {begin:.4g} s on"
    return f"between {begin:.4g} and {end:.4g} s"


def _rms(y: np.ndarray, blocks: list[np.ndarray]) -> np.ndarray:
    """Root mean square of samples in every block."""
    return np.array([np.sqrt(np.mean(y[block] ** 2)) for block in blocks])


def _widened(first: int, last: int, partly_bad: np.ndarray) -> tuple[int, int]:
    """A range of blocks with the partly bad ones next to it."""
    while first > 0 and partly_bad[first - 1]:
        first -= 1
    while last < partly_bad.size - 1 and partly_bad[last + 1]:
        last += 1
    return first, last
