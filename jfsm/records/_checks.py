"""What can be wrong with a record before any model is asked."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from jfsm.records._figures import figure, plus_minus, share
from jfsm.records._level import Level, level
from jfsm.records._noise_floor import SHORTEST, SPACINGS, NoiseFloor
from jfsm.records._phase_plane import PhasePlane, phase_plane
from jfsm.records._quantisation import quantisation_step
from jfsm.records._repeats import longest_hold, repetition
from jfsm.records._trace import Trace

Samples = NDArray[np.float64]

OFFSET_SHARE = 0.025  # of the standard deviation: an offset worth a word
DRIFT_SHARE = 0.1  # of the standard deviation: a drift over the record worth a word
LEVEL_ERRORS = 4.0  # standard errors that offset and drift must have besides
NOISY_SHARE = 0.1
COARSE_SHARE = 0.1  # of the standard deviation: a quantisation step that shapes the signal
FINE_SHARE = 0.01  # of the noise: a quantisation step that does nothing
FEW_PER_PERIOD = 8.0
FEWEST_PERIODS = 1.5  # between the first line of the spectrum, which any slow motion fills, and the second
MOSTLY = 0.8  # share of the spikes that friction must account for
FAST, FAST_SHARE = 0.125, 0.1  # of the sampling rate; of the power, above which a signal is near the band limit
BANDS, NARROW = 10, 4  # bands of amplitude, and how few of them leave laws of amplitude indistinguishable
STEADY = 2.0  # times the motion of another quarter of the record, below which the amplitude is one level
VISITED = 0.01  # share of samples that makes a band visited


class Finding(NamedTuple):
    """One remark on a record: how serious, on which channel ("record" for all), and what to know or do."""

    severity: Literal["info", "warning"]
    channel: str
    message: str


@dataclass(frozen=True)
class ChannelSummary:
    """Figures of one channel, in its unit.

    Attributes
    ----------
    channel, unit : str
    minimum, maximum, mean, std : float
    noise, noise_error : float or None
        Noise floor and its standard error; None in a record too short to tell.
    level : Level or None
        Offset and drift with their standard errors, of a displacement those that no drive explains; None without a
        signal.
    quantisation : float
        Step between levels, 0 for a continuous channel.
    clipped, spikes : int
        Number of such samples.
    noise_only : bool
        Whether no signal is left when the channel is smoothed.
    frequency : float or None
        Strongest frequency [Hz].
    coverage : float or None
        Share of ten bands of amplitude, from rest to the largest motion, in which the channel spends time.
    phase_plane : PhasePlane or None
        Where the channel has been against its rate of change; None without a signal.
    """

    channel: str
    unit: str
    minimum: float
    maximum: float
    mean: float
    std: float
    noise: float | None
    noise_error: float | None
    level: Level | None
    quantisation: float
    clipped: int
    spikes: int
    noise_only: bool
    frequency: float | None
    coverage: float | None
    phase_plane: PhasePlane | None


def examine(
    trace: Trace,
    uniform: Samples,
    dt: float,
    floor: NoiseFloor | None,
    turning: NDArray[np.bool_] | None = None,
    drives: Sequence[Samples] = (),
) -> tuple[ChannelSummary, list[Finding]]:
    """Figures and findings of one channel.

    Parameters
    ----------
    trace : Trace
        As recorded.
    uniform : (m,) float array
        The same channel on a uniform clock.
    dt : float
        Interval of that clock [s].
    floor : NoiseFloor or None
        Of `uniform`; None if it is too short to have one.
    turning : (n,) bool array, optional
        Samples at which the velocity changes its sign, where friction makes an acceleration jump.
    drives : (m,) float arrays, optional
        What pushes a displacement to and fro, however slowly.
    """
    smooth = None if floor is None or floor.silent else floor.smooth
    raw = trace.samples
    summary = ChannelSummary(
        channel=trace.channel,
        unit=trace.unit,
        minimum=float(raw.min()),
        maximum=float(raw.max()),
        mean=float(raw.mean()),
        std=float(raw.std()),
        noise=None if floor is None else floor.std,
        noise_error=None if floor is None else floor.std_error,
        level=None if smooth is None else level(uniform, dt, drives),
        quantisation=quantisation_step(raw),
        clipped=int(trace.clipped.sum()),
        spikes=int(trace.spikes.sum()),
        noise_only=floor is not None and floor.silent,
        frequency=None if smooth is None else strongest_frequency(smooth, dt),
        coverage=None if smooth is None else amplitude_coverage(smooth),
        phase_plane=None if smooth is None else phase_plane(smooth, dt),
    )
    found = [
        *_of_samples(summary, raw),
        *_of_spikes(summary, trace.spikes, turning),
        *_of_level(summary),
        *_of_noise(summary, floor),
        *_of_motion(summary, uniform, dt),
    ]
    return summary, found


def strongest_frequency(y: Samples, dt: float) -> float:
    """Frequency [Hz] of the largest line of the spectrum, the mean left out."""
    power = np.abs(np.fft.rfft((y - y.mean()) * np.hanning(y.size))) ** 2
    return float(np.fft.rfftfreq(y.size, dt)[1 + np.argmax(power[1:])])


def fast_share(y: Samples) -> float:
    """Share of the power, the mean left out, with fewer than eight samples a period."""
    power = np.abs(np.fft.rfft((y - y.mean()) * np.hanning(y.size))) ** 2
    return float(power[int(FAST * y.size) :].sum() / max(float(power.sum()), 1e-300))


def amplitude_coverage(y: Samples) -> float:
    """Share of ten equal bands of amplitude that a motion visits, amplitude being the radius in its phase plane."""
    rate = np.gradient(y)
    motion = y - y.mean()
    radius = np.hypot(motion / max(float(motion.std()), 1e-300), rate / max(float(rate.std()), 1e-300))
    counts, _ = np.histogram(radius, bins=BANDS, range=(0.0, float(radius.max()) or 1.0))
    return float(np.mean(counts > VISITED * y.size))


def _of_samples(summary: ChannelSummary, raw: Samples) -> Iterator[Finding]:
    channel, unit, std, n = summary.channel, summary.unit, summary.std, raw.size
    if np.ptp(raw) == 0:
        if channel.startswith(("force", "base")):  # of a response the look before says it
            yield Finding("info", channel, f"Constant at {summary.mean:.4g} {unit}: a load that does not change.")
        return
    if summary.clipped:
        yield Finding(
            "warning",
            channel,
            f"{summary.clipped} of {n} samples sit at the limit of {summary.minimum:.4g} or {summary.maximum:.4g} "
            f"{unit}: clipped. They carry no reading.",
        )
    if summary.quantisation > FINE_SHARE * (summary.noise or 0.0):
        coarse = summary.quantisation > COARSE_SHARE * std
        steps = std / summary.quantisation
        message = f"Quantised in steps of {summary.quantisation:.4g} {unit}, {steps:.3g} to the standard deviation."
        yield Finding("warning" if coarse else "info", channel, message)
    start, length = longest_hold(raw)
    if length:
        message = f"Holds one value for {length} samples from sample {start} on: the sensor hung. Leave them out."
        yield Finding("warning", channel, message)
    stride = repetition(raw)
    if stride > 1:
        message = f"Every value stands {stride} times: the channel was sampled more slowly. Resample the record."
        yield Finding("info", channel, message)


def _of_spikes(
    summary: ChannelSummary, torn: NDArray[np.bool_], turning: NDArray[np.bool_] | None
) -> Iterator[Finding]:
    if not summary.spikes:
        return
    message = f"{summary.spikes} of {torn.size} samples are spikes, torn out of the curve beside them."
    if turning is not None and turning[torn].mean() >= MOSTLY:
        where = " They lie where the velocity changes its sign: friction leaves such."
        yield Finding("info", summary.channel, message + where)
    else:
        yield Finding("warning", summary.channel, message)


def _of_level(summary: ChannelSummary) -> Iterator[Finding]:
    channel, unit, std = summary.channel, summary.unit, summary.std
    if summary.minimum == summary.maximum:
        return
    offset, error, drift, drift_error = summary.level or (summary.mean, 0.0, 0.0, 0.0)
    if abs(offset) > max(OFFSET_SHARE * std, LEVEL_ERRORS * error):
        message = f"Offset of {plus_minus(offset, error)} {unit}, {share(abs(offset) / std)} of the standard deviation."
        yield Finding("info", channel, message)
    if abs(drift) > max(DRIFT_SHARE * std, LEVEL_ERRORS * drift_error):
        message = (
            f"Drifts by {plus_minus(drift, drift_error)} {unit} over the record, {share(abs(drift) / std)} of the "
            f"standard deviation. Take the trend off if it is the sensor's."
        )
        yield Finding("info", channel, message)


def _of_noise(summary: ChannelSummary, floor: NoiseFloor | None) -> Iterator[Finding]:
    channel, unit = summary.channel, summary.unit
    if floor is None:
        yield Finding("info", channel, f"Fewer than {SHORTEST} samples: the noise cannot be told.")
        return
    if summary.minimum == summary.maximum:
        return
    if floor.silent:
        yield Finding("info", channel, f"Noise only, {floor.std:.3g} {unit}, or too fast to be told from it.")
        return
    fast = floor.spacing == SPACINGS[0] and fast_share(floor.smooth) > FAST_SHARE
    if floor.std > NOISY_SHARE * summary.std and not (fast and floor.fills_band):
        level = plus_minus(floor.std, floor.std_error)
        message = f"Noise of {level} {unit}, {share(floor.std / summary.std)} of the standard deviation."
        yield Finding("warning", channel, message)
    if fast:
        doubt = ": part of the noise may be signal" if floor.fills_band else ""
        message = f"Much of the signal has fewer than {1 / FAST:.0f} samples a period{doubt}. Sample faster if you can."
        yield Finding("warning", channel, message)
    elif floor.fills_band:
        yield Finding("info", channel, "Bends or jumps within a sample or two; the noise level leaves that out.")


def _of_motion(summary: ChannelSummary, uniform: Samples, dt: float) -> Iterator[Finding]:
    if summary.frequency is None or summary.coverage is None:
        return
    channel, per_period = summary.channel, 1.0 / (summary.frequency * dt)
    periods = uniform.size / per_period
    if periods < FEWEST_PERIODS:
        message = "Strongest below two periods in the record: its frequency cannot be told."
        yield Finding("info", channel, message)
    elif per_period < FEW_PER_PERIOD:
        message = (
            f"Strongest at {summary.frequency:.4g} Hz: {figure(periods)} periods of only {figure(per_period)} samples. "
            f"Sample faster if you can."
        )
        yield Finding("warning", channel, message)
    narrow = round(summary.coverage * BANDS) <= NARROW and _is_steady(uniform)
    if narrow and channel.split()[0] != "force":
        message = (
            f"Amplitude stays within {round(summary.coverage * BANDS)} of {BANDS} bands: laws that differ in how they "
            f"grow with amplitude will look alike. Add a record at another level."
        )
        yield Finding("info", channel, message)


def _is_steady(y: Samples) -> bool:
    """Whether no quarter moves far more than another, as where a motion dies out, however short its first blow."""
    sizes = [float(quarter.std()) for quarter in np.array_split(y, 4)]
    return max(sizes) < STEADY * min(sizes)
