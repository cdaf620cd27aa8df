"""Gain of a mended model: free runs, or forces of an imposed motion, on readings that took no part in the fit.

A structure that nothing holds in place drifts: its runs are many short ones.
"""

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import jax
import numpy as np
from scipy.signal import lfilter

from ...dynamics import simulate
from ...identification import Nuisances
from ...plant import Reconstruction
from ...records import Record, bridged, spikes
from ...structures import Structure
from ..channels.drift import steady
from .fitted import FILTERED, PREDICTED
from .held_out import HeldOutErrors, share_closed
from .split import HeldOut

_LEAD = 50.0
"""Periods, at most, that lead a structure that remembers to what was held out."""
_END = 20
"""One in so many samples of an imposed motion is its end."""
_DRAWS = 4
"""Draws of noise that show what it leaves of a perfect model's run."""
_BLOCK, _FEWEST, _MOST_BLOCKS = 2.0, 5, 20
"""Periods in a block of held-out readings where there are enough, and how many are drawn anew for an interval."""
_RESAMPLED = 1000
_ERRORS = ("before", "refitted", "after", "floor")
BASE = ("base_acceleration", 0)
"""What stands for the acceleration of the base among channels."""


StructureOf = Callable[[int | None], Structure]
"""The structure of a record, by its number; that of one that was not fitted (None)."""


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
        return share_closed(self.before, self.after, self.floor)


@dataclass(frozen=True)
class Gain(HeldOutErrors):
    """Errors of free runs on held-out readings, in all and by channel; see `HeldOutErrors`."""

    channels: dict[str, ChannelGain]

    @property
    def errors(self) -> HeldOutErrors:
        """Those of all channels together."""
        return HeldOutErrors(self.before, self.refitted, self.after, self.floor, self.interval)


def window_of(samples: int, period: float) -> int:
    """Samples from which the start of a run of so many is estimated, which are not counted; a period has `period`."""
    return min(max(50, math.ceil(FILTERED * period)), samples // 3)


def how_run(fitted: Nuisances) -> list[str]:
    """What is to be said of the runs behind a gain, where they are not those of whole records."""
    if not fitted.drifts:
        return []
    return [f"Nothing holds the structure in place: it is run for {PREDICTED * fitted.period:.2g} s at a time."]


def measure_gain(
    given: Structure,
    refitted: StructureOf,
    extended: StructureOf,
    held: Sequence[HeldOut],
    noise: Mapping[tuple, float],
    fitted: Nuisances,
    key: jax.Array,
    assumed: Reconstruction = "band-limited",
) -> tuple[Gain, list[dict]]:
    """Gain on what was held out, and per record the curves behind it (measured, before, after).

    `noise` is the standard deviation of each channel's noise; `fitted` tells how long a period is, whether anything
    holds the structure in place, which zeros wander, and when the force acts. The model as given runs as the force was
    recorded, and goes between its samples as is `assumed`. Where nothing holds a structure in place many short runs
    take the place of a long one.
    """
    rng = np.random.default_rng(np.asarray(jax.random.key_data(key)).astype(np.uint32).tolist())
    compared = []
    for part in held:
        models = {"before": given, "refitted": refitted(part.of), "after": extended(part.of)}
        compared.append(_compared(part, models, noise, fitted, assumed, rng))
    channels = _channel_gains([each.squares for each in compared], held[0].record.units)
    total = {
        name: math.sqrt(float(np.mean([(getattr(c, name) / c.spread) ** 2 for c in channels.values()])))
        for name in _ERRORS
    }
    spreads = np.array([c.spread for c in channels.values()])
    blocks = np.stack([block for each in compared for block in each.blocks])
    interval = _interval(np.mean(blocks / spreads**2, -1), total["floor"], rng)
    return Gain(**total, channels=channels, interval=interval), [each.curves for each in compared]


class _Compared(NamedTuple):
    """Models compared on a held-out record.

    `squares` are mean square errors by name and channel, with the channel's variance as its spread; `blocks` are those
    of contiguous blocks (2, channels), before and after; `curves` are for the report.
    """

    squares: dict[str, dict[tuple, float]]
    blocks: list[np.ndarray]
    curves: dict[str, Any]


def _compared(
    part: HeldOut,
    models: Mapping[str, Structure],
    noise: Mapping[tuple, float],
    fitted: Nuisances,
    assumed: Reconstruction,
    rng: np.random.Generator,
) -> _Compared:
    """Runs of models over a held-out record, with their errors and those that noise alone leaves."""
    period = fitted.period / part.record.dt
    wandering = [fitted.channels[c] for c in fitted.readings.wandering]
    lead = _lead(models["after"], period)
    record, begin = (part.record[part.begin :], 0) if fitted.drifts else part.led_by(lead)
    record = _cleaned(record, wandering, noise, rng)
    stretches = stretches_of(record, period, drifts=fitted.drifts)
    window = window_of(min(s.stop - s.start for s in stretches), period)
    counted = _counted(record, stretches, window, begin)
    by_pieces = partial(run_over, stretches=stretches, window=window)
    before = by_pieces(models["before"], record, reconstruction=assumed)
    record, run_of = fitted.in_time(record), partial(by_pieces, reconstruction=fitted.reconstruction)
    runs = {"before": before} | {name: run_of(models[name], record) for name in ("refitted", "after")}
    left = _noise(partial(run_of, models["after"]), record, counted, runs["after"], noise, fitted.memories, rng)
    off = {name: _off(run, record, counted, wandering) for name, run in runs.items()}
    squares = {name: {c: float(np.mean(error**2)) for c, error in errors.items()} for name, errors in off.items()}
    # At the end of a decay a digitised channel may show one level only.
    spread = {c: max(float(np.var(y[begin:])), noise.get(c, 0.0) ** 2) for c, y in record.answers.items()}
    curves = {"record": record[begin:], **{name: _from(begin, run) for name, run in runs.items()}}
    blocks = _blocks([off["before"], off["after"]], period)
    return _Compared(squares | {"floor": left, "spread": spread}, blocks, curves)


def _channel_gains(squares: Sequence[Mapping[str, Mapping[tuple, float]]], units: Any) -> dict[str, ChannelGain]:
    """Root mean square errors of all records, by channel."""
    channels = dict.fromkeys(channel for each in squares for channel in each["spread"])

    def rms(name: str, channel: tuple) -> float:
        return math.sqrt(float(np.mean([each[name][channel] for each in squares if channel in each[name]])))

    return {
        f"{c[0]} {c[1]}": ChannelGain(units[c[0]], rms("spread", c), *(rms(name, c) for name in _ERRORS))
        for c in channels
    }


def _lead(structure: Structure, period: float) -> int:
    """Samples that lead to a run, where periods have `period`.

    What remembers shows at no instant: it is led to where a run begins, or would begin relaxed.
    """
    remembers = any(term.states or term.delay is not None for term in structure.terms)
    return math.ceil(_LEAD * period) if remembers else 0


def _cleaned(record: Record, wandering: Sequence[tuple], noise: Mapping[tuple, float], rng) -> Record:
    """The record without torn readings, and without what is slow where a zero wanders.

    A run begins as it says, and is measured by it.
    """
    torn = {channel: spikes(y, noise.get(channel, 0.0)) for channel, y in record.answers.items()}
    if not wandering and not any(np.any(lost) for lost in torn.values()):
        return record
    shown = {**record.channels, **{channel: bridged(record.channels[channel], lost) for channel, lost in torn.items()}}
    shown |= {channel: steady(shown[channel]) for channel in wandering}
    return remeasured(record, shown, {}, rng)


def stretches_of(record: Record, period: float, *, drifts: bool) -> list[slice]:
    """Stretches of a record that are run one by one: the whole, or where a structure `drifts` as long as predictions.

    In a longer one what nothing holds in place goes astray, however right the model.
    """
    count = max(int(len(record) / ((FILTERED + PREDICTED) * period)), 1) if drifts else 1
    ends = np.linspace(0, len(record), count + 1).astype(int).tolist()
    return [slice(*pair) for pair in itertools.pairwise(ends)]


def _off(
    run: Mapping[tuple, np.ndarray], record: Record, counted: np.ndarray, wandering: Sequence[tuple]
) -> dict[tuple, np.ndarray]:
    """Errors of a run in the readings that are counted; where a zero wanders, what is slow in them is none."""
    errors = {channel: (run[channel] - y)[counted] for channel, y in record.answers.items()}
    return errors | {channel: steady(errors[channel]) for channel in wandering}


def _blocks(off: Sequence[Mapping[tuple, np.ndarray]], period: float) -> list[np.ndarray]:
    """Mean square errors (runs, channels) of contiguous blocks of the readings that are counted."""
    errors = np.stack([[error**2 for error in errors.values()] for errors in off])
    count = int(np.clip(errors.shape[-1] / (_BLOCK * period), _FEWEST, _MOST_BLOCKS))
    return [block.mean(-1) for block in np.array_split(errors, min(count, errors.shape[-1]), axis=-1)]


def _interval(blocks: np.ndarray, floor: float, rng: np.random.Generator) -> tuple[float, float]:
    """95 % interval of the share closed, from mean square errors (blocks, 2) before and after.

    References
    ----------
    B. Efron, R. J. Tibshirani, An Introduction to the Bootstrap, 1993, ch. 13 (percentile interval).
    """
    drawn = blocks[rng.integers(len(blocks), size=(_RESAMPLED, len(blocks)))]
    closed = [share_closed(before, after, floor) for before, after in np.sqrt(drawn.mean(1))]
    low, high = np.quantile(closed, [0.025, 0.975])
    return float(low), float(high)


def run_over(
    model: Structure, record: Record, stretches: Sequence[slice], window: int, reconstruction: Reconstruction
) -> dict[tuple, np.ndarray]:
    """What a structure shows of a record, run over every stretch of it anew."""
    shown: dict[tuple, list[np.ndarray]] = {}
    for piece in (record[stretch] for stretch in stretches):
        response = simulate(model, piece, window=window, reconstruction=reconstruction, solver="grid")
        for c, y in response.readings(piece).items():
            # A run that escaped counts as one that stays at its last value: bad, and finite.
            last = y[-1] if y.size else 0.0
            shown.setdefault(c, []).append(np.concatenate([y, np.full(len(piece) - y.size, last)]))
    return {c: np.concatenate(pieces) for c, pieces in shown.items()}


def _from(begin: int, run: Mapping[tuple, np.ndarray]) -> dict[tuple, np.ndarray]:
    return {channel: y[begin:] for channel, y in run.items()}


def _counted(record: Record, stretches: Sequence[slice], window: int, begin: int) -> np.ndarray:
    """Samples on which a gain is measured; of an imposed motion not the last ones, where its rate is hardly known."""
    end = len(record) - len(record) // _END if record.drive == "motion" else len(record)
    counted = np.concatenate([np.arange(stretch.start + window, stretch.stop) for stretch in stretches])
    return counted[(counted >= begin) & (counted < end)]


def _noise(
    run: Callable[[Record], dict[tuple, np.ndarray]],
    record: Record,
    counted: np.ndarray,
    shown: Mapping[tuple, np.ndarray],
    levels: Mapping[tuple, float],
    memories: Mapping[tuple, tuple[float, float]],
    rng: np.random.Generator,
) -> dict[tuple, float]:
    """Mean square error that noise alone leaves, per channel: its readings', its drive's and its start's."""
    total = {c: 0.0 for c in record.answers}
    for _ in range(_DRAWS):
        # The extended model's own run stands for the truth; fresh noise on what was measured, and all steps again.
        truth = {c: shown[c] if c in shown else y for c, y in record.channels.items()}
        again = run(remeasured(record, truth, levels, rng, memories))
        for c in total:
            total[c] += float(np.mean((again[c] - shown[c])[counted] ** 2)) / _DRAWS
    return {c: total[c] + levels.get(c, 0.0) ** 2 for c in total}


def remeasured(
    record: Record,
    truth: Mapping[tuple, np.ndarray],
    levels: Mapping[tuple, float],
    rng: np.random.Generator,
    memories: Mapping[tuple, tuple[float, float]] | None = None,
) -> Record:
    """The record, had its channels measured this, with fresh noise of these standard deviations.

    Of some of it a share has a memory, as in `Nuisances.memories`. What drives the base is as it was where `truth` does
    not have it.
    """
    kinds: dict[str, Any] = {}
    base = {} if record.base_acceleration is None else {BASE: truth.get(BASE, record.base_acceleration)}
    for (kind, j), y in {**{c: y for c, y in truth.items() if c != BASE}, **base}.items():
        noise = rng.standard_normal(y.size)
        if memories and (kind, j) in memories:
            memory, share = memories[kind, j]
            noise = math.sqrt(1 - share) * noise + math.sqrt(share) * _remembering(y.size, memory, rng)
        kinds.setdefault(kind, {})[j] = y + levels.get((kind, j), 0.0) * noise
    if base:
        kinds[BASE[0]] = kinds[BASE[0]][BASE[1]]
    return Record(record.time, **kinds, at_rest=record.at_rest, drive=record.drive)  # pyright: ignore


def _remembering(n: int, memory: float, rng: np.random.Generator) -> np.ndarray:
    """Noise (n,) of unit variance with this correlation from sample to sample."""
    fresh = rng.standard_normal(n)
    fresh[1:] *= math.sqrt(1 - memory**2)
    return np.asarray(lfilter([1.0], [1.0, -memory], fresh))
