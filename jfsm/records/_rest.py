"""Where a record shows motion, and where rest: what is neither fitted nor predicted."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jfsm.records._abstract_record import AbstractRecord
from jfsm.records._core import core_std
from jfsm.records._noise_floor import noise_floor
from jfsm.records._quantisation import quantisation_step

BLOCKS = 50  # pieces of a record whose power is compared with that of noise
LOUD = 2.0  # power of a piece, in those of noise, from which something moves
LEAST = 0.05  # share of a record that is always used
CREEP = 0.02  # share of a channel's extent that it may creep by, all in all, where nothing moves
TURNS, SURE = 2, 4.0  # times that a creep turns back, at most; standard errors of a step that tells
LONG = 0.2  # share of a driven record, from which rest is left out: a pause is a part of a test


class Span(NamedTuple):
    """First sample of the motion, and the one after its last."""

    begin: int
    end: int


def span_of_motion(record: AbstractRecord) -> Span:
    """The part of a record in which something moves or drives.

    A structure at rest shows noise about one level, or a slow creep of the sensor. A released structure is at rest once
    all its motion has died away, and before it is let go; one that a force or a motion drives, only while that rests
    too, and if that is a fifth of the record or more. A structure that a constant force holds is not at rest. The piece
    in which the motion ends is kept to its end: that friction holds what it stopped shows there alone.
    """
    n = len(record)
    everything = Span(0, n)
    if n < 2 * BLOCKS or not record.channels:
        return everything
    if _span(record, [(y, rough_noise(y)) for y in _watched(record)]) == everything:
        return everything  # as most records are: the noise need not be known well
    return _span(record, [(y, noise_floor(y, record.dt).std) for y in _watched(record)])


def _span(record: AbstractRecord, channels: list[tuple[NDArray[np.float64], float]]) -> Span:
    """The part of a record with motion, of channels with their noise."""
    n = len(record)
    everything = Span(0, n)
    end = max((_loud_until(y, noise) for y, noise in channels), default=0)
    begin = min((n - _loud_until(y[::-1], noise) for y, noise in channels), default=0)
    if not end or begin >= end:
        return everything
    end = max(end, int(LEAST * n))
    if not record.driven:
        return Span(_released(channels, begin) if begin > 0 else 0, end)
    loaded = record.drive == "force" and [_is_loaded(record, part) for part in (slice(0, begin), slice(end, n))]
    first, last = (not loaded or not held for held in (loaded or (False, False)))
    return Span(begin if begin >= LONG * n and first else 0, end if n - end >= LONG * n and last else n)


def way_gone(record: AbstractRecord) -> NDArray[np.float64]:
    """Share of its whole way that the motion has gone at each sample, from 0 to 1, without what noise goes.

    The way is that of the channels that do not drive, each in its own spread: of a record in pieces, the sum of how
    much each piece moves.
    """
    blocks = np.array_split(np.arange(len(record)), BLOCKS)
    moves = np.zeros(len(blocks))
    for y in record.responses.values():
        if np.ptp(y) > 0:
            noise = noise_floor(y, record.dt).std
            moves += [np.sqrt(max(np.var(y[block]) - noise**2, 0.0)) / np.std(y) for block in blocks]
    gone = np.cumsum([0.0, *moves])
    edges = [0, *(int(block[-1]) + 1 for block in blocks)]
    return np.interp(np.arange(len(record)), edges, gone / gone[-1] if gone[-1] else np.linspace(0.0, 1.0, gone.size))


def drives_until(record: AbstractRecord) -> int:
    """Samples until every force channel shows no more than noise about its last level.

    0 without a force, and of a record that is too short to tell.
    """
    if len(record) < 2 * BLOCKS:
        return 0
    forces = [y for (kind, _), y in record.channels.items() if kind == "force" and np.ptp(y) > 0]
    return max((_loud_until(y, noise_floor(y, record.dt).std) for y in forces), default=0)


def _watched(record: AbstractRecord) -> list[NDArray[np.float64]]:
    """Channels that tell motion or drive."""
    named = list(record.channels.values())
    if record.base_acceleration is not None:
        named.append(record.base_acceleration)
    return [y for y in named if np.ptp(y) > 0]


def rough_noise(y: NDArray[np.float64]) -> float:
    """Noise of a channel, at least: of a signal that fills its band far more."""
    return max(core_std(np.diff(y, 6)) / np.sqrt(924.0), quantisation_step(y) / np.sqrt(12.0))


def _loud_until(y: NDArray[np.float64], noise: float) -> int:
    """Samples until a channel shows no more than noise about its last level, or about a slow creep to it."""
    blocks = np.array_split(np.arange(y.size), BLOCKS)
    level = float(np.mean(y[blocks[-1]]))
    loud = [k for k, block in enumerate(blocks) if np.mean((y[block] - level) ** 2) > LOUD * noise**2]
    if not loud:
        return 0
    return int(blocks[_before_creep(y, blocks, noise, loud[-1])][-1]) + 1


def _before_creep(y: NDArray[np.float64], blocks: list[NDArray[np.int64]], noise: float, last: int) -> int:
    """The last block that is more than noise about a slow creep, which the rest of the channel follows.

    A creep turns back twice at most: what does so more often still swings.
    """
    most, low, high, quiet = CREEP * float(np.ptp(y)), np.inf, -np.inf, len(blocks) - 1
    way, turns, after = 0.0, 0, float(np.mean(y[blocks[-1]]))
    for k in range(len(blocks) - 1, 0, -1):
        own = y[blocks[k]]
        mean, slope, left = _line(own)
        low, high = min(low, mean - abs(slope)), max(high, mean + abs(slope))
        step = mean - after
        if abs(step) > SURE * noise * np.sqrt(2.0 / own.size):
            turns, way, after = turns + (step * way < 0), np.sign(step), mean
        if turns > TURNS:
            return last
        if left > LOUD * noise**2 or high - low > most:
            break
        quiet = k - 1
    return quiet if len(blocks) - 1 - quiet >= LONG * len(blocks) else last


def _line(y: NDArray[np.float64]) -> tuple[float, float, float]:
    """Mean of a piece, the half of its rise, and what a straight line leaves of it in mean square."""
    place = np.linspace(-1.0, 1.0, y.size)
    mean, slope = float(np.mean(y)), float(place @ y / (place @ place))
    return mean, slope, float(np.mean((y - mean - slope * place) ** 2))


def _released(channels: list[tuple[NDArray[np.float64], float]], begin: int) -> int:
    """The sample at which a structure that was held is let go: the first one that is clear of the noise."""
    first = []
    for y, noise in channels:
        level = float(np.mean(y[: max(begin, 1)]))
        clear = np.flatnonzero(np.abs(y[begin:] - level) > 6.0 * noise)
        first += [begin + int(clear[0])] if clear.size else []
    return min(first, default=begin)


def _is_loaded(record: AbstractRecord, part: slice) -> bool:
    """Whether a force holds the structure in a part of the record."""
    forces = [y for (kind, _), y in record.channels.items() if kind == "force"]
    return any(y[part].size and abs(np.mean(y[part])) > CREEP * np.ptp(y) for y in forces)


def rest_words(record: AbstractRecord, span: Span) -> Iterator[str]:
    """What is at rest, one sentence each."""
    time = record.time
    if span.begin > 0:
        what = "at rest" if record.driven else "held or at rest"
        yield f"{what} until t = {time[span.begin]:.4g} s, left out"
    if span.end < time.size:
        yield f"at rest from t = {time[span.end]:.4g} s on, left out"
