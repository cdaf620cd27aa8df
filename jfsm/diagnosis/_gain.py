"""What mending the model is worth: free runs, or forces of an imposed motion, on readings that took no part."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import jax
import numpy as np

from ..dynamics import Reconstruction, simulate
from ..records import Record
from ..structures import Structure
from ._holdout import HeldOut

_PERIODS = 2.0
"""Periods, at least, from which the state of a held-out run is estimated; they are not counted."""
_LEAD = 50.0
"""Periods, at most, that lead a structure that remembers to what was held out."""
_END = 20
"""One in so many samples of an imposed motion is its end."""
_CLOSABLE = 1.05
"""Error before, in floors, from which there is anything to close."""
_DRAWS = 4
"""Draws of noise that show what it leaves of a perfect model's run."""
_FEWEST, _MOST_BLOCKS = 5, 20
"""Blocks of held-out readings, two periods long where there are enough, that are drawn anew for an interval."""
_RESAMPLED = 1000


@dataclass(frozen=True)
class ChannelGain:
    """Root mean square error of a channel's free run, in its unit, and as a share of its spread."""

    unit: str
    spread: float
    before: float
    refitted: float
    after: float
    floor: float

    @property
    def closed(self) -> float:
        """Share of the closable error that is closed."""
        return _closed(self.before, self.after, self.floor)


@dataclass(frozen=True)
class Gain:
    """Errors of free runs on held-out readings, as shares of the channels' spreads (root of the mean over channels).

    `before` is the model as given, `refitted` its own values refitted, `after` the extended model, `floor` what noise
    in the drive, in the start and in the readings would leave.
    """

    before: float
    refitted: float
    after: float
    floor: float
    channels: dict[str, ChannelGain]
    interval: tuple[float, float]
    """95 % interval of `closed`, from blocks of the held-out readings drawn anew."""

    @property
    def closable(self) -> bool:
        """Whether the model as given leaves more than noise would."""
        return _closable(self.before, self.floor)

    @property
    def significant(self) -> bool:
        """Whether the extended model predicts better by more than chance."""
        return self.interval[0] > 0

    @property
    def closed(self) -> float:
        """Share of the closable error that is closed: (before - after) / (before - floor), at most 1.

        0 where there was nothing to close.
        """
        return _closed(self.before, self.after, self.floor)


def _closed(before: float, after: float, floor: float) -> float:
    return min((before - after) / (before - floor), 1.0) if _closable(before, floor) else 0.0


def _closable(before: float, floor: float) -> bool:
    return before > _CLOSABLE * floor


def window_for(record: Record, omega: float) -> int:
    """Samples from which the start of a held-out run is estimated."""
    return min(max(50, math.ceil(_PERIODS * 2 * math.pi / (omega * record.dt))), len(record) // 3)


def measure_gain(
    given: Structure,
    refitted: Structure,
    extended: Structure,
    held: Sequence[HeldOut],
    noise: Mapping[tuple, float],
    omega: float,
    reconstruction: Reconstruction,
    key: jax.Array,
) -> tuple[Gain, list[dict]]:
    """Gain on what was held out, and per record the curves behind it (measured, before, after).

    `noise` is the standard deviation of each channel's noise.
    """
    seed = np.random.default_rng(np.asarray(jax.random.key_data(key)).astype(np.uint32).tolist())
    squares: dict[str, dict[tuple, list[float]]] = {
        name: {} for name in ("before", "refitted", "after", "floor", "spread")
    }
    curves = []
    pieces: list[np.ndarray] = []
    remembers = any(term.states or term.delay is not None for term in extended.terms)
    for part in held:
        # What remembers shows at no instant: it is led to where a run begins, or would begin relaxed.
        lead = math.ceil(_LEAD * 2 * math.pi / (omega * part.record.dt)) if remembers else 0
        record, begin = part.led_by(lead)
        window = window_for(record, omega)
        counted = _counted(record, max(window, begin))
        runs = {
            name: _run(model, record, window, reconstruction)
            for name, model in (("before", given), ("refitted", refitted), ("after", extended))
        }
        left = _noise(extended, record, window, counted, reconstruction, runs["after"], noise, seed)
        pieces += _blocks(record, [runs["before"], runs["after"]], counted, 2 * math.pi / (omega * record.dt))
        for channel, y in record.answers.items():
            for name, run in runs.items():
                squares[name].setdefault(channel, []).append(float(np.mean((run[channel][counted] - y[counted]) ** 2)))
            squares["floor"].setdefault(channel, []).append(left[channel])
            squares["spread"].setdefault(channel, []).append(float(np.var(y[begin:])))
        curves.append({"record": record[begin:], **{name: _from(begin, run) for name, run in runs.items()}})
    rms = {name: {c: math.sqrt(float(np.mean(v))) for c, v in table.items()} for name, table in squares.items()}
    units = held[0].record.units
    channels = {
        f"{kind} {j}": ChannelGain(
            units[kind], rms["spread"][kind, j], *(rms[n][kind, j] for n in ("before", "refitted", "after", "floor"))
        )
        for kind, j in rms["before"]
    }
    total = {
        name: math.sqrt(float(np.mean([(getattr(c, name) / c.spread) ** 2 for c in channels.values()])))
        for name in ("before", "refitted", "after", "floor")
    }
    spread = np.array([c.spread for c in channels.values()])
    interval = _interval(np.mean(np.stack(pieces) / spread**2, -1), total["floor"], seed)
    return Gain(**total, channels=channels, interval=interval), curves


def _blocks(record: Record, runs: Sequence[Mapping[tuple, np.ndarray]], counted: slice, period: float) -> list:
    """Mean square errors (runs, channels) of contiguous blocks of the readings that are counted."""
    errors = np.stack([[(run[c] - y)[counted] ** 2 for c, y in record.answers.items()] for run in runs])
    count = int(np.clip(errors.shape[-1] / (_PERIODS * period), _FEWEST, _MOST_BLOCKS))
    return [block.mean(-1) for block in np.array_split(errors, min(count, errors.shape[-1]), axis=-1)]


def _interval(blocks: np.ndarray, floor: float, rng: np.random.Generator) -> tuple[float, float]:
    """95 % interval of the share closed, from mean square errors (blocks, 2) before and after.

    References
    ----------
    B. Efron, R. J. Tibshirani, An Introduction to the Bootstrap, 1993, ch. 13 (percentile interval).
    """
    drawn = blocks[rng.integers(len(blocks), size=(_RESAMPLED, len(blocks)))]
    closed = [_closed(before, after, floor) for before, after in np.sqrt(drawn.mean(1))]
    low, high = np.quantile(closed, [0.025, 0.975])
    return float(low), float(high)


def _run(model: Structure, record: Record, window: int, reconstruction: Reconstruction) -> dict[tuple, np.ndarray]:
    response = simulate(model, record, window=window, reconstruction=reconstruction, solver="grid")
    shown = response.readings(record)
    # A run that escaped counts as one that stays at its last value: bad, and finite.
    return {c: np.concatenate([y, np.full(len(record) - y.size, y[-1] if y.size else 0.0)]) for c, y in shown.items()}


def _from(begin: int, run: Mapping[tuple, np.ndarray]) -> dict[tuple, np.ndarray]:
    return {channel: y[begin:] for channel, y in run.items()}


def _counted(record: Record, begin: int) -> slice:
    """Samples on which a gain is measured; of an imposed motion not the last ones, where its rate is hardly known."""
    return slice(begin, len(record) - len(record) // _END if record.drive == "motion" else None)


def _noise(
    model, record: Record, window: int, counted: slice, reconstruction, run, levels: Mapping[tuple, float], rng
) -> dict[tuple, float]:
    """Mean square error that noise alone leaves, per channel: its readings', its drive's and its start's."""
    total = {c: 0.0 for c in record.answers}
    for _ in range(_DRAWS):
        # The extended model's own run stands for the truth; fresh noise on what was measured, and all steps again.
        truth = {c: run[c] if c in run else y for c, y in record.channels.items()}
        again = _run(model, remeasured(record, truth, levels, rng), window, reconstruction)
        for c in total:
            total[c] += float(np.mean((again[c] - run[c])[counted] ** 2)) / _DRAWS
    return {c: total[c] + levels.get(c, 0.0) ** 2 for c in total}


def remeasured(
    record: Record, truth: Mapping[tuple, np.ndarray], levels: Mapping[tuple, float], rng: np.random.Generator
) -> Record:
    """The record, had its channels measured this, with fresh noise of these standard deviations."""
    kinds: dict[str, Any] = {}
    for (kind, j), y in truth.items():
        kinds.setdefault(kind, {})[j] = y + levels.get((kind, j), 0.0) * rng.standard_normal(y.size)
    return Record(
        record.time, **kinds, base_acceleration=record.base_acceleration, at_rest=record.at_rest, drive=record.drive
    )  # pyright: ignore
