"""What can be wrong with a record before any model is asked."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from jfsm.records._defects import clipped, spikes
from jfsm.records._noise_floor import SHORTEST, SPACINGS, NoiseFloor, noise_floor
from jfsm.records._quantisation import quantisation_step

Samples = NDArray[np.float64]

OFFSET_SHARE = 0.05  # of the standard deviation: an offset worth a word
NOISY_SHARE = 0.1
COARSE_SHARE = 0.1  # of the standard deviation: a quantisation step that shapes the signal
FEW_PER_PERIOD = 8.0
BANDS, NARROW = 10, 4  # bands of amplitude, and how few of them leave laws of amplitude indistinguishable
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
    noise : float or None
        Noise floor; None in a record too short to tell.
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
    """

    channel: str
    unit: str
    minimum: float
    maximum: float
    mean: float
    std: float
    noise: float | None
    quantisation: float
    clipped: int
    spikes: int
    noise_only: bool
    frequency: float | None
    coverage: float | None


def examine(channel: str, unit: str, raw: Samples, uniform: Samples, dt: float) -> tuple[ChannelSummary, list[Finding]]:
    """Figures and findings of one channel.

    Parameters
    ----------
    channel, unit : str
    raw : (n,) float array
        Samples as recorded.
    uniform : (m,) float array
        The same channel on a uniform clock.
    dt : float
        Interval of that clock [s].
    """
    floor = noise_floor(uniform, dt) if uniform.size >= SHORTEST else None
    summary = ChannelSummary(
        channel=channel,
        unit=unit,
        minimum=float(raw.min()),
        maximum=float(raw.max()),
        mean=float(raw.mean()),
        std=float(raw.std()),
        noise=None if floor is None else floor.std,
        quantisation=quantisation_step(raw),
        clipped=int(clipped(raw).sum()),
        spikes=0 if floor is None else int(spikes(raw, floor.std).sum()),
        noise_only=floor is not None and floor.silent,
        frequency=None if floor is None or floor.silent else strongest_frequency(floor.smooth, dt),
        coverage=None if floor is None or floor.silent else amplitude_coverage(floor.smooth),
    )
    found = [*_of_samples(summary, raw.size), *_of_noise(summary, floor), *_of_motion(summary, uniform.size * dt, dt)]
    return summary, found


def strongest_frequency(y: Samples, dt: float) -> float:
    """Frequency [Hz] of the largest line of the spectrum, the mean left out."""
    power = np.abs(np.fft.rfft((y - y.mean()) * np.hanning(y.size))) ** 2
    return float(np.fft.rfftfreq(y.size, dt)[1 + np.argmax(power[1:])])


def amplitude_coverage(y: Samples) -> float:
    """Share of ten equal bands of amplitude that a motion visits, amplitude being the radius in its phase plane."""
    rate = np.gradient(y)
    motion = y - y.mean()
    radius = np.hypot(motion / max(float(motion.std()), 1e-300), rate / max(float(rate.std()), 1e-300))
    counts, _ = np.histogram(radius, bins=BANDS, range=(0.0, float(radius.max()) or 1.0))
    return float(np.mean(counts > VISITED * y.size))


def _of_samples(summary: ChannelSummary, n: int) -> Iterator[Finding]:
    channel, unit, std = summary.channel, summary.unit, summary.std
    if std == 0:
        yield Finding("warning", channel, f"Constant at {summary.mean:.4g} {unit}. Leave a dead channel out.")
        return
    if summary.clipped:
        yield Finding(
            "warning",
            channel,
            f"{summary.clipped} of {n} samples sit at the limit of {summary.minimum:.4g} or {summary.maximum:.4g} "
            f"{unit}: clipped. They carry no reading.",
        )
    if summary.spikes:
        message = f"{summary.spikes} of {n} samples are spikes, torn out of the curve beside them."
        yield Finding("warning", channel, message)
    if abs(summary.mean) > OFFSET_SHARE * std:
        share = abs(summary.mean) / std
        yield Finding("info", channel, f"Offset of {summary.mean:.4g} {unit}, {share:.0%} of the standard deviation.")
    if summary.quantisation:
        coarse = summary.quantisation > COARSE_SHARE * std
        steps = std / summary.quantisation
        message = f"Quantised in steps of {summary.quantisation:.4g} {unit}, {steps:.3g} to the standard deviation."
        yield Finding("warning" if coarse else "info", channel, message)


def _of_noise(summary: ChannelSummary, floor: NoiseFloor | None) -> Iterator[Finding]:
    channel, unit = summary.channel, summary.unit
    if floor is None:
        yield Finding("info", channel, f"Fewer than {SHORTEST} samples: the noise cannot be told.")
        return
    if summary.std == 0:
        return
    if floor.silent:
        yield Finding("info", channel, f"Noise only, {floor.std:.3g} {unit}, or too fast to be told from it.")
        return
    share = floor.std / summary.std
    severity = "warning" if share > NOISY_SHARE else "info"
    yield Finding(severity, channel, f"Noise of {floor.std:.3g} {unit}, {share:.2%} of the standard deviation.")
    if floor.spacing == SPACINGS[0]:
        message = "The signal reaches the band limit: the noise may be partly signal. Sample faster if you can."
        yield Finding("warning", channel, message)


def _of_motion(summary: ChannelSummary, duration: float, dt: float) -> Iterator[Finding]:
    if summary.frequency is None or summary.coverage is None:
        return
    channel, periods, per_period = summary.channel, summary.frequency * duration, 1.0 / (summary.frequency * dt)
    severity = "warning" if per_period < FEW_PER_PERIOD else "info"
    yield Finding(
        severity,
        channel,
        f"Strongest at {summary.frequency:.4g} Hz: {periods:.3g} periods of {per_period:.3g} samples.",
    )
    if round(summary.coverage * BANDS) <= NARROW and channel.split()[0] != "force":
        message = (
            f"Amplitude stays within {round(summary.coverage * BANDS)} of {BANDS} bands: laws that differ in how they "
            f"grow with amplitude will look alike. Add a record at another level."
        )
        yield Finding("info", channel, message)
