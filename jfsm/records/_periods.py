"""A record that repeats itself: noise by averaging, and distortion where the excitation leaves room to see it."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jfsm.records._tapers import Samples

SHORTEST_PERIOD = 32
REPEATS = 0.02  # share of a driving channel's variance by which one period may differ from the next
CHANGED = 0.5  # such a share by which a channel must have changed before it can return
BEST = 1.5  # times the smallest difference of any lag, from which on the first such lag is the period
EVEN = 1.3  # ratio of energies that periods of one record may have
SETTLED = 1.25  # times the usual difference from the last period, below which a period is free of the transient
EXCITED = 0.03  # of the strongest line
FEWEST_LINES = 3  # excited, or left free for distortion to show on
ROUNDING = 1e-9  # of the excited lines, that is not told from nothing
SEEN = 4.0  # standard errors of the noise power from which on distortion is told from it


@dataclass(frozen=True)
class PeriodicChannel:
    """What averaging over periods says of one channel, in its unit.

    Attributes
    ----------
    channel : str
    noise, noise_error : float
        Standard deviation of what changes from period to period, and its standard error.
    frequency : (m,) float array
        Lines of the period [Hz], without 0.
    mean, noise_lines : (m,) float arrays
        Amplitude of the mean period at each line, and the standard deviation of that amplitude.
    even, odd : float or None
        Rms amplitude of the lines on which a force even in the motion, or odd, shows itself, what the driving channel
        puts on them and noise taken away, over that of the excited lines; 0 where it does not rise above noise. None
        where the excitation has no line free for it, or a response is driven by several channels.
    """

    channel: str
    noise: float
    noise_error: float
    frequency: NDArray[np.float64]
    mean: NDArray[np.float64]
    noise_lines: NDArray[np.float64]
    even: float | None
    odd: float | None


@dataclass(frozen=True)
class Periods:
    """A periodic record.

    Attributes
    ----------
    samples, seconds : int, float
        Length of a period.
    count : int
        Periods that were averaged, the last ones of the record.
    transient : int
        Periods before them that had not settled.
    excited : (lines,) int array
        Numbers of the lines with excitation, 1 being one period per period.
    channels : tuple of PeriodicChannel
    """

    samples: int
    seconds: float
    count: int
    transient: int
    excited: NDArray[np.int64]
    channels: tuple[PeriodicChannel, ...]


def period_of(y: Samples) -> int | None:
    """Samples after which a channel repeats itself, None if it does not within half of its length."""
    n = y.size
    y = y - y.mean()
    energy = np.concatenate([[0.0], np.cumsum(y**2)])
    if n < 2 * SHORTEST_PERIOD or energy[-1] == 0:
        return None
    spectrum = np.fft.rfft(y, 2 * n)
    lags = np.arange(SHORTEST_PERIOD, n // 2 + 1)
    product = np.fft.irfft(np.abs(spectrum) ** 2)[lags]
    powers = energy[n - lags] + energy[-1] - energy[lags]
    difference = 1.0 - 2.0 * product / np.maximum(powers, 1e-300)
    changed = int(np.argmax(difference > CHANGED))  # before, it has hardly moved
    smallest = float(difference[changed:].min())
    if difference[changed] <= CHANGED or smallest > REPEATS:
        return None
    first = changed + int(np.argmax(difference[changed:] <= BEST * smallest + 1e-9))
    while first + 1 < lags.size and difference[first + 1] < difference[first]:
        first += 1
    length = int(lags[first])
    strength = np.sum(y[n % length :].reshape(-1, length) ** 2, axis=1)
    return length if strength.max() < EVEN * strength.min() else None  # not the decay of a ringing


def common_period(drives: Iterable[Samples]) -> int | None:
    """Samples after which all driving channels repeat themselves, None if they do not or there are none."""
    lengths = {period_of(drive) for drive in drives}
    return lengths.pop() if len(lengths) == 1 else None


def whole_periods(y: Samples, length: int) -> NDArray[np.float64]:
    """The last whole periods of a channel, (count, length)."""
    return y[y.size % length :].reshape(-1, length)


def change(periods: NDArray[np.float64]) -> float:
    """Standard deviation of what changes from period to period (count, length), apart from their offset."""
    count = len(periods)
    off = periods - periods.mean(axis=1, keepdims=True)
    return float(np.sqrt(np.mean(np.var(off - off.mean(axis=0), axis=0) * count / (count - 1))))


def unsettled(periods: NDArray[np.float64]) -> int:
    """How many of the first periods (count, length) differ more from the last one than later ones do; two are kept."""
    if len(periods) < 3:
        return 0
    apart = np.sqrt(np.mean((periods[:-1] - periods[-1]) ** 2, axis=1))
    usual = float(np.median(apart[len(apart) // 2 :]))
    settled = np.flatnonzero(apart <= SETTLED * usual)
    return int(min(settled[0], len(periods) - 2))


def average(drives: Mapping[str, Samples], responses: Mapping[str, Samples], dt: float) -> Periods | None:
    """Mean period, noise and distortion of every channel; None if the driving channels do not repeat themselves.

    Parameters
    ----------
    drives, responses : mappings of channel to (n,) float array
    dt : float
        Sampling interval [s].

    Notes
    -----
    Under a multisine with odd lines only, of which some are left out, a nonlinear force puts its even part on even
    lines and its odd part on the odd lines that are free [1]_. What the excitation itself has there passes the
    structure linearly and is taken off, with the response to excited lines around it.

    References
    ----------
    .. [1] R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd edition, Wiley-IEEE Press,
       2012, chapter 4.
    """
    length = common_period(drives.values())
    if length is None:
        return None
    every = {**drives, **responses}
    n = next(iter(every.values())).size
    folded = {name: whole_periods(y, length) for name, y in every.items()}
    transient = max((unsettled(periods) for periods in folded.values()), default=0)
    folded = {name: periods[transient:] for name, periods in folded.items()}
    count = n // length - transient
    lines = {name: _lines(periods) for name, periods in folded.items()}
    strength = np.max([np.abs(lines[name][0]) / np.abs(lines[name][0]).max() for name in drives], axis=0)
    excited = np.flatnonzero(strength > EXCITED) + 1
    if excited.size < FEWEST_LINES:
        return None
    drive = lines[next(iter(drives))] if len(drives) == 1 else None
    frequency = np.arange(1, length // 2 + 1) / (length * dt)
    channels = []
    for name, periods in folded.items():
        mean, error = lines[name]
        noise = change(periods)
        free = {"even": None, "odd": None}
        if drive is not None and name in responses:
            free = {kind: _distortion(lines[name], drive, excited, count, kind) for kind in free}
        noise_error = noise / np.sqrt(2.0 * (count - 1) * length)
        channels.append(PeriodicChannel(name, noise, noise_error, frequency, np.abs(mean), error, **free))
    return Periods(length, length * dt, count, transient, excited, tuple(channels))


def _lines(periods: NDArray[np.float64]) -> tuple[NDArray[np.complex128], NDArray[np.float64]]:
    """Complex amplitude of each line of the mean period, and its standard error, line 0 left out."""
    count, length = periods.shape
    spectra = 2.0 / length * np.fft.rfft(periods)[:, 1 : length // 2 + 1]
    mean = spectra.mean(axis=0)
    return mean, np.sqrt(np.sum(np.abs(spectra - mean) ** 2, axis=0) / ((count - 1) * count))


def _distortion(
    response: tuple[NDArray[np.complex128], NDArray[np.float64]],
    drive: tuple[NDArray[np.complex128], NDArray[np.float64]],
    excited: NDArray[np.int64],
    count: int,
    kind: str,
) -> float | None:
    """Rms amplitude of the free lines of one parity among the excited ones, over that of the excited lines."""
    if np.any(excited % 2 == 0):
        return None  # even lines are excited: distortion of either kind falls on excited lines
    band = np.arange(excited[0], excited[-1] + 1)
    free = np.setdiff1d(band[band % 2 == (0 if kind == "even" else 1)], excited) - 1
    if free.size < FEWEST_LINES:
        return None
    (y, y_error), (u, u_error) = response, drive
    ratio = y[excited - 1] / u[excited - 1]
    passed = np.interp(free, excited - 1, ratio.real) + 1j * np.interp(free, excited - 1, ratio.imag)
    size = float(np.mean(np.abs(y[excited - 1]) ** 2))
    noise = y_error[free] ** 2 + np.abs(passed * u_error[free]) ** 2 + ROUNDING**2 * size
    surplus = float(np.mean(np.abs(y[free] - passed * u[free]) ** 2 - noise))
    # The power of noise on a line scatters as much as it is large, and its estimate from few periods scatters too.
    doubt = float(np.sqrt(np.mean(noise**2) * (1.0 + 1.0 / (count - 1)) / free.size))
    return float(np.sqrt(surplus / size)) if surplus > SEEN * doubt else 0.0
