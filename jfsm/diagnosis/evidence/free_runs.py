"""Gain of a mended model: free runs, or forces of an imposed motion, on readings that took no part in the fit.

A structure that nothing holds in place drifts: its runs are many short ones.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import partial
from typing import Any, NamedTuple

import jax
import numpy as np

from ...identification import Nuisances
from ...plant import Reconstruction
from ...structures import Structure
from .course import Course, agrees_for, in_parts, strayed
from .fitted import PREDICTED
from .held_out import HeldOutErrors, share_closed
from .split import HeldOut

_BLOCK, _FEWEST, _MOST_BLOCKS = 2.0, 5, 20
"""Periods in a block of held-out readings where there are enough, and how many are drawn anew for an interval."""
_SHORTEST_RUN = 6.0
"""Periods of the shortest run: its start is estimated from some of them."""
_RESAMPLED = 1000
_RUNS = ("before", "refitted", "after")
_ERRORS = (*_RUNS, "floor")


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
    beyond_refit: bool = False

    @property
    def closed(self) -> float:
        """Share of the closable error that is closed."""
        return share_closed(self.refitted if self.beyond_refit else self.before, self.after, self.floor)


@dataclass(frozen=True)
class Gain(HeldOutErrors):
    """Errors of free runs on held-out readings, in all and by channel; see `HeldOutErrors`."""

    channels: dict[str, ChannelGain] = field(default_factory=dict)

    @property
    def errors(self) -> HeldOutErrors:
        """Those of all channels together."""
        return HeldOutErrors(**{f.name: getattr(self, f.name) for f in fields(HeldOutErrors)})


def how_run(fitted: Nuisances, gain: HeldOutErrors | None = None) -> list[str]:
    """What is to be said of the runs behind a gain, where they are not those of whole records."""
    if fitted.drifts:
        return [f"Nothing holds the structure in place: it is run for {PREDICTED * fitted.period:.2g} s at a time."]
    if gain is None or gain.horizon is None:
        return []
    if gain.astray:
        return [
            f"No model follows the whole motion: run from its start, each ends farther from it than the motion is "
            f"wide. Errors on held-out readings are those of runs of {gain.horizon:.3g} s, each from its own start."
        ]
    return [
        f"The motion is sensitive: noise alone makes two of its runs part after {gain.horizon:.3g} s. Errors on "
        f"held-out readings are those of runs of this length, each from its own start."
    ]


def measure_gain(
    given: Structure,
    refitted: StructureOf,
    extended: StructureOf,
    held: Sequence[HeldOut],
    noise: Mapping[tuple, float],
    fitted: Nuisances,
    key: jax.Array,
    assumed: Reconstruction = "band-limited",
    *,
    beyond_refit: bool = False,
) -> tuple[Gain, list[dict]]:
    """Gain on what was held out, and per record the curves behind it (measured, before, after).

    `noise` is the standard deviation of each channel's noise; `fitted` tells how long a period is, whether anything
    holds the structure in place, which zeros wander, and when the force acts. The model as given runs as the force was
    recorded, and goes between its samples as is `assumed`. Where nothing holds a structure in place many short runs
    take the place of a long one; so they do where no model follows the motion from its start to its end, and, as far as
    they agree, where noise alone makes runs of the extended model part. What is closed counts from the model as given,
    or `beyond_refit` from the refitted one.
    """
    rng = np.random.default_rng(np.asarray(jax.random.key_data(key)).astype(np.uint32).tolist())
    without = "refitted" if beyond_refit else "before"
    models = [{"before": given, "refitted": refitted(part.of), "after": extended(part.of)} for part in held]
    units = held[0].record.units
    compared, horizon, astray = _as_far_as_runs_tell(held, models, noise, fitted, assumed, rng, without)
    channels = _channel_gains([each.squares for each in compared], units, beyond_refit=beyond_refit)
    total = _of_all_channels(channels)
    spreads = np.array([c.spread for c in channels.values()])
    blocks = np.stack([block for each in compared for block in each.blocks])
    interval = interval_of(np.mean(blocks / spreads**2, -1), total["floor"], rng)
    gain = Gain(
        **total, channels=channels, interval=interval, beyond_refit=beyond_refit, horizon=horizon, astray=astray
    )
    return gain, [each.curves for each in compared]


def _of_all_channels(channels: Mapping[str, ChannelGain]) -> dict[str, float]:
    """Root mean square errors over channels, as shares of their spreads."""
    return {
        name: math.sqrt(float(np.mean([(getattr(c, name) / c.spread) ** 2 for c in channels.values()])))
        for name in _ERRORS
    }


class _Compared(NamedTuple):
    """Models compared on a held-out record.

    `squares` are mean square errors by name and channel, with the channel's variance as its spread; `blocks` are those
    of contiguous blocks (2, channels), without and with the hypothesis; `curves` are for the report. The runs `agrees`
    so long [s] with others that differ by noise alone; None where they do to the end.
    """

    squares: dict[str, dict[tuple, float]]
    blocks: list[np.ndarray]
    curves: dict[str, Any]
    agrees: float | None


def _as_far_as_runs_tell(
    held: Sequence[HeldOut],
    models: Sequence[Mapping[str, Structure]],
    noise: Mapping[tuple, float],
    fitted: Nuisances,
    assumed: Reconstruction,
    rng: np.random.Generator,
    without: str,
) -> tuple[list[_Compared], float | None, bool]:
    """Models compared on every held-out record, the seconds of a run where longer ones tell nothing, and whether that
    is since no model follows the whole motion; else noise alone makes longer runs part."""

    def compared(length: float | None) -> list[_Compared]:
        pairs = zip(held, models, strict=True)
        return [_compared(part, each, noise, fitted, assumed, rng, length, without) for part, each in pairs]

    found = compared(in_parts(fitted))
    apart = [each.agrees for each in found if each.agrees is not None]
    astray = not apart and without == "refitted" and all(map(_astray, found))
    if not apart and not astray:
        return found, None, False
    horizon = max(min(apart, default=0.0), _SHORTEST_RUN * fitted.period)
    if horizon >= min(len(part.record[part.begin :]) * part.record.dt for part in held):
        return found, None, False
    return compared(horizon), horizon, astray


def _astray(runs: _Compared) -> bool:
    """Whether every model's run is farther from the measured motion than that is wide: it tells nothing then."""
    squares = runs.squares
    if runs.curves["record"].drive == "motion":
        return False
    return all(np.mean([squares[name][c] / squares["spread"][c] for c in squares["spread"]]) > 1.0 for name in _RUNS)


def _compared(
    part: HeldOut,
    models: Mapping[str, Structure],
    noise: Mapping[tuple, float],
    fitted: Nuisances,
    assumed: Reconstruction,
    rng: np.random.Generator,
    length: float | None,
    without: str,
) -> _Compared:
    """Runs of models over a held-out record, `length` seconds at a time, with their errors and those that noise alone
    leaves; blocks are of the run `without` the hypothesis and of that with it."""
    course, period = Course.of(part, models["after"], fitted, noise, rng, length), fitted.period / part.record.dt
    before = course.run(models["before"], course.record, assumed)
    course = course._replace(record=fitted.in_time(course.record))
    run_of = partial(course.run, reconstruction=fitted.reconstruction)
    runs = {"before": before} | {name: run_of(models[name], course.record) for name in ("refitted", "after")}
    draws = strayed(partial(run_of, models["after"]), course.record, runs["after"], noise, fitted.memories, rng)
    off, spread = {name: course.off(run) for name, run in runs.items()}, course.spread(noise)
    squares = {name: {c: float(np.mean(error**2)) for c, error in errors.items()} for name, errors in off.items()}
    left = {c: float(np.mean(each[:, course.counted] ** 2)) + noise.get(c, 0.0) ** 2 for c, each in draws.items()}
    curves = {"record": course.record[course.begin :], **{name: course.shown(run) for name, run in runs.items()}}
    blocks = blocks_of([off[without], off["after"]], period)
    in_one_run = length is None and part.record.drive == "force"
    apart = agrees_for(draws, spread, course.begin, period) if in_one_run else None
    agrees = None if apart is None else apart * course.record.dt
    return _Compared(squares | {"floor": left, "spread": spread}, blocks, curves, agrees)


def _channel_gains(
    squares: Sequence[Mapping[str, Mapping[tuple, float]]], units: Any, *, beyond_refit: bool
) -> dict[str, ChannelGain]:
    """Root mean square errors of all records, by channel."""
    channels = dict.fromkeys(channel for each in squares for channel in each["spread"])

    def rms(name: str, channel: tuple) -> float:
        return math.sqrt(float(np.mean([each[name][channel] for each in squares if channel in each[name]])))

    return {
        f"{c[0]} {c[1]}": ChannelGain(
            units[c[0]], rms("spread", c), **{name: rms(name, c) for name in _ERRORS}, beyond_refit=beyond_refit
        )
        for c in channels
    }


def blocks_of(off: Sequence[Mapping[tuple, np.ndarray]], period: float) -> list[np.ndarray]:
    """Mean square errors (runs, channels) of contiguous blocks of the readings that are counted."""
    errors = np.stack([[error**2 for error in errors.values()] for errors in off])
    count = int(np.clip(errors.shape[-1] / (_BLOCK * period), _FEWEST, _MOST_BLOCKS))
    return [block.mean(-1) for block in np.array_split(errors, min(count, errors.shape[-1]), axis=-1)]


def interval_of(blocks: np.ndarray, floor: float, rng: np.random.Generator) -> tuple[float, float]:
    """95 % interval of the share closed, from mean square errors (blocks, 2) before and after.

    References
    ----------
    B. Efron, R. J. Tibshirani, An Introduction to the Bootstrap, 1993, ch. 13 (percentile interval).
    """
    drawn = blocks[rng.integers(len(blocks), size=(_RESAMPLED, len(blocks)))]
    closed = [share_closed(before, after, floor) for before, after in np.sqrt(drawn.mean(1))]
    low, high = np.quantile(closed, [0.025, 0.975])
    return float(low), float(high)
