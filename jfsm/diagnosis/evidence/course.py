"""How a structure is run over a held-out record: from where, how long at a time, and how far noise leads runs apart."""

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.signal import lfilter

from ...dynamics import simulate
from ...identification import Nuisances
from ...plant import Reconstruction
from ...records import Record, bridged, spikes
from ...structures import Structure
from ..channels.drift import steady
from .fitted import FILTERED, PREDICTED
from .split import HeldOut

_LEAD = 50.0
"""Periods, at most, that lead a structure that remembers to what was held out."""
_END = 20
"""One in so many samples of an imposed motion is its end."""
_DRAWS = 4
"""Draws of noise that show what it leaves of a perfect model's run."""
_PARTED, _CLOSE = 0.3, 0.1
"""Distance of two runs, as a share of the signal over a period, from which they are no longer one motion, and up to
which they are nearly."""
BASE = ("base_acceleration", 0)
"""What stands for the acceleration of the base among channels."""

Run = Mapping[tuple, np.ndarray]
"""Readings (n,) of a run, by channel."""


class Course(NamedTuple):
    """A held-out record as it is run: in `stretches`, each from a start that a `window` of samples tells.

    What is held out begins at sample `begin`, and errors are `counted` at these samples. Zeros of channels may be
    `wandering`.
    """

    record: Record
    begin: int
    stretches: Sequence[slice]
    window: int
    counted: np.ndarray
    wandering: Sequence[tuple]

    @classmethod
    def of(
        cls,
        part: HeldOut,
        structure: Structure,
        fitted: Nuisances,
        noise: Mapping[tuple, float],
        rng: np.random.Generator,
        length: float | None,
    ) -> "Course":
        """The course of what was held out, `length` seconds at a time, or in one run."""
        period = fitted.period / part.record.dt
        wandering = [fitted.channels[c] for c in fitted.readings.wandering]
        whole = part.led_by(_lead(structure, period)) if length is None else (part.record[part.begin :], 0)
        record, begin = _cleaned(whole[0], wandering, noise, rng), whole[1]
        stretches = stretches_of(record, length)
        window = window_of(min(s.stop - s.start for s in stretches), period)
        return cls(record, begin, stretches, window, _counted(record, stretches, window, begin), wandering)

    def run(self, model: Structure, record: Record, reconstruction: Reconstruction) -> Run:
        """What a structure shows of a record, run over every stretch of it anew."""
        shown: dict[tuple, list[np.ndarray]] = {}
        for piece in (record[stretch] for stretch in self.stretches):
            response = simulate(model, piece, window=self.window, reconstruction=reconstruction, solver="grid")
            for c, y in response.readings(piece).items():
                # A run that escaped counts as one that stays at its last value: bad, and finite.
                last = y[-1] if y.size else 0.0
                shown.setdefault(c, []).append(np.concatenate([y, np.full(len(piece) - y.size, last)]))
        return {c: np.concatenate(pieces) for c, pieces in shown.items()}

    def off(self, run: Run) -> dict[tuple, np.ndarray]:
        """Errors of a run in the readings that are counted; where a zero wanders, what is slow in them is none."""
        errors = {channel: (run[channel] - y)[self.counted] for channel, y in self.record.answers.items()}
        return errors | {channel: steady(errors[channel]) for channel in self.wandering}

    def shown(self, run: Run) -> dict[tuple, np.ndarray]:
        """The part of a run that was held out."""
        return {channel: y[self.begin :] for channel, y in run.items()}

    def spread(self, noise: Mapping[tuple, float]) -> dict[tuple, float]:
        """Variance of what was held out; at the end of a decay a digitised channel may show one level only."""
        answers = self.record.answers.items()
        return {c: max(float(np.var(y[self.begin :])), noise.get(c, 0.0) ** 2) for c, y in answers}


def in_parts(fitted: Nuisances) -> float | None:
    """Seconds for which a structure is run at a time that nothing holds in place: as long as predictions.

    In a longer run it goes astray, however right the model.
    """
    return (FILTERED + PREDICTED) * fitted.period if fitted.drifts else None


def window_of(samples: int, period: float) -> int:
    """Samples from which the start of a run of so many is estimated, which are not counted; a period has `period`."""
    return min(max(50, math.ceil(FILTERED * period)), samples // 3)


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


def stretches_of(record: Record, length: float | None) -> list[slice]:
    """Stretches of a record that are run one by one: the whole, or at most `length` seconds each.

    In a longer one what nothing holds in place goes astray, however right the model.
    """
    count = 1 if length is None else math.ceil(len(record) * record.dt / length - 1e-9)
    ends = np.linspace(0, len(record), count + 1).astype(int).tolist()
    return [slice(*pair) for pair in itertools.pairwise(ends)]


def _counted(record: Record, stretches: Sequence[slice], window: int, begin: int) -> np.ndarray:
    """Samples on which a gain is measured; of an imposed motion not the last ones, where its rate is hardly known."""
    end = len(record) - len(record) // _END if record.drive == "motion" else len(record)
    counted = np.concatenate([np.arange(stretch.start + window, stretch.stop) for stretch in stretches])
    return counted[(counted >= begin) & (counted < end)]


def strayed(
    run: Callable[[Record], Run],
    record: Record,
    shown: Run,
    levels: Mapping[tuple, float],
    memories: Mapping[tuple, tuple[float, float]],
    rng: np.random.Generator,
) -> dict[tuple, np.ndarray]:
    """How far runs (draws, n) stray from the one `shown` by noise alone, per channel: its drive's and its start's."""
    apart: dict[tuple, list[np.ndarray]] = {c: [] for c in record.answers}
    for _ in range(_DRAWS):
        # The extended model's own run stands for the truth; fresh noise on what was measured, and all steps again.
        truth = {c: shown[c] if c in shown else y for c, y in record.channels.items()}
        again = run(remeasured(record, truth, levels, rng, memories))
        for c, each in apart.items():
            each.append(again[c] - shown[c])
    return {c: np.stack(each) for c, each in apart.items()}


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


def agrees_for(
    draws: Mapping[tuple, np.ndarray], spread: Mapping[tuple, float], begin: int, period: float
) -> int | None:
    """Samples from `begin` over which runs that differ by noise alone are one motion; None where they stay so.

    Chaos, and motions between wells, magnify whatever differs.
    """
    apart = np.mean([np.mean(off**2, 0) / spread[c] for c, off in draws.items()], 0)[begin:]
    over = max(int(round(period)), 1)
    mean = np.convolve(apart, np.ones(over) / over, "valid")
    if np.all(mean <= _PARTED**2):
        return None
    return int(np.flatnonzero(mean > _CLOSE**2)[0])
