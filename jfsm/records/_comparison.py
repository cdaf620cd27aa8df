"""Two channels of one point, one the derivative of the other: how far do they agree?"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jfsm.records._tapers import SHORTEST_PIECE, Pieces, Samples, Spectra

PERIODS = 4  # of the strongest frequency in a piece
FEWEST_PIECES = 4
PASSES = 3  # until the pieces stand as late as the channel is
CLEAR = 50.0  # power over noise from which on a frequency takes part
MODEL_ERROR = 0.02  # relative error of a spectrum that no noise explains: what bends between samples
WEAK = 0.01  # share of the strongest line's power below which a line counts for less


class Comparison(NamedTuple):
    """How a channel differs from what a lower derivative of the same point makes of it.

    Attributes
    ----------
    lower, upper : str
        Channels, the second a derivative of the first.
    gain, gain_error : float
        Upper over what lower implies, without its sign; 1 where they agree. Standard error beside it.
    inverted : bool
        Whether their signs differ.
    delay, delay_error : float
        How late the upper channel is [s].
    offset, offset_error : float
        Constant in the upper channel that lower does not show, in the unit of upper.
    agreement : float
        Share of the power of upper that lower explains once gain and delay are allowed for.
    """

    lower: str
    upper: str
    gain: float
    gain_error: float
    inverted: bool
    delay: float
    delay_error: float
    offset: float
    offset_error: float
    agreement: float


class Reading(NamedTuple):
    """A channel as it is compared: its name, (n,) samples, the noise in them, and which of them are no readings."""

    channel: str
    samples: Samples
    noise: float
    lost: NDArray[np.bool_]


def compare(lower: Reading, upper: Reading, order: int, dt: float, frequency: float) -> Comparison | None:
    """Gain, delay, polarity and offset of a channel against the derivative of another.

    Parameters
    ----------
    lower, upper : Reading
        On one uniform clock.
    order : int
        How many derivatives lie between them, 1 or 2.
    dt : float
        Sampling interval [s].
    frequency : float
        Strongest frequency of the motion [Hz].

    Returns
    -------
    Comparison or None
        None where too little of the record is clear of noise, or of clipping, to say anything.

    Notes
    -----
    With Q and P the spectra of both channels in a piece, P of the derivative, ln(Q/P) = ln(gain) − iω·delay at every
    frequency; the mean of its error vanishes for noise in either channel. Its scatter from piece to piece gives the
    standard errors.
    """
    n = upper.samples.size
    length = int(np.clip(round(PERIODS / (frequency * dt)), SHORTEST_PIECE, 2 * n // (FEWEST_PIECES + 1)))
    if length < SHORTEST_PIECE or n < 2 * length:
        return None
    pieces = Pieces.of(n, length, dt)
    found = None
    for _ in range(PASSES):
        found = _compared(lower, upper, order, pieces, 1.0 / frequency, found)
        if found is None:
            return None
    return found


def _compared(
    lower: Reading, upper: Reading, order: int, pieces: Pieces, period: float, before: Comparison | None
) -> Comparison | None:
    """One pass, in which the pieces of upper are as late as the pass before found it to be.

    Otherwise an envelope that grows or decays within a piece would pass for a part of the delay.
    """
    dt, omega = pieces.dt, pieces.omega
    late = 0.0 if before is None else before.delay / dt
    whole = round(late)
    starts = pieces.starts[(pieces.starts + whole >= 0) & (pieces.starts + whole + pieces.length <= lower.samples.size)]
    here, there = Pieces(starts, pieces.length, dt), Pieces(starts + whole, pieces.length, dt, late - whole)
    sound = np.logical_not(np.any(here.cut(lower.lost) | there.cut(upper.lost), axis=1))
    if sound.sum() < FEWEST_PIECES:
        return None
    here, there = here.only(sound), there.only(sound)
    q, p = there.spectra(upper.samples - upper.samples.mean()), here.spectra(lower.samples, order)
    noise_q, noise_p = pieces.noise(upper.noise), pieces.noise(lower.noise, order)

    power_q, power_p = np.abs(q) ** 2, np.abs(p) ** 2
    away = np.arange(omega.size) >= 3  # a constant reaches three lines through the taper
    clear = (power_q > CLEAR * noise_q) & (power_p > CLEAR * noise_p) & away
    if np.count_nonzero(clear.any(axis=1)) < FEWEST_PIECES:
        return None
    ratio = np.divide(q, p, out=np.ones_like(q), where=clear)
    doubt = noise_q / np.where(clear, power_q, 1.0) + noise_p / np.where(clear, power_p, 1.0)
    doubt += MODEL_ERROR**2 * (1.0 + WEAK * (_over_strongest(power_q, clear) + _over_strongest(power_p, clear)))
    weight = np.where(clear, 1.0 / doubt, 0.0)
    if before is None:
        sign, lag = _alignment(ratio, weight, pieces, period)
    else:
        sign, lag = -1.0 if before.inverted else 1.0, (late - whole) * dt
    aligned: Spectra = np.log(sign * ratio * np.exp(1j * omega * lag))
    log_gain, gain_error = _mean(aligned.real, weight)
    slope, delay_error = _mean(-aligned.imag / np.where(away, omega, 1.0), weight * omega**2)
    expected = p * sign * np.exp(log_gain - 1j * omega * (lag + slope))
    offset, offset_error = _offset(here, upper.samples, lower.samples, order)
    return Comparison(
        lower=lower.channel,
        upper=upper.channel,
        gain=float(np.exp(log_gain)),
        gain_error=gain_error,
        inverted=sign < 0,
        delay=whole * dt + lag + slope,
        delay_error=delay_error,
        offset=offset,
        offset_error=offset_error,
        agreement=_agreement(q[:, away], expected[:, away], noise_q[away], np.exp(2.0 * log_gain) * noise_p[away]),
    )


def _over_strongest(power: Samples, clear: NDArray[np.bool_]) -> Samples:
    """The strongest line's power over that of each line."""
    return np.where(clear, power, 0.0).max() / np.where(clear, power, 1.0)


def _alignment(ratio: Spectra, weight: Samples, pieces: Pieces, reach: float) -> tuple[float, float]:
    """Sign and delay [s] within `reach` that bring the phases together, the smallest delay where several do."""
    turn = np.where(weight > 0, ratio / np.abs(ratio), 0.0)
    summed = np.sum(weight * turn, axis=0) / np.sum(weight)
    half = 0.5 * pieces.dt
    steps = int(np.clip(round(reach / half), 1, pieces.length // 2))
    lags = half * np.arange(-steps, steps + 1)
    score = pieces.length * np.roll(np.fft.irfft(summed, 2 * pieces.length), steps)[: lags.size]
    best = int(np.argmax(np.abs(score) - 0.5 * np.abs(lags) / reach))
    return float(np.sign(score[best])), float(lags[best])


def _mean(value: Samples, weight: Samples) -> tuple[float, float]:
    """Weighted mean over pieces and frequencies, and its standard error.

    The error is the larger of those that follow from the scatter of whole pieces and from that of whole frequencies: a
    filter in one channel shows in the second only.
    """
    total = float(weight.sum())
    mean = float((weight * value).sum()) / total
    errors = []
    for axis in (0, 1):
        off = (weight * (value - mean)).sum(axis=axis)
        used = int(np.count_nonzero(weight.any(axis=axis)))
        errors.append(np.sqrt(off @ off * used / max(1, used - 1)))
    return mean, float(max(errors)) / total


def _offset(pieces: Pieces, upper: Samples, lower: Samples, order: int) -> tuple[float, float]:
    """Mean of upper less the mean rate of lower, both under the taper, and its standard error."""
    surplus = (pieces.spectra(upper)[:, 0] - pieces.spectra(lower, order)[:, 0]).real
    surplus /= pieces.taper[0].sum() * pieces.dt
    return float(surplus.mean()), float(surplus.std(ddof=1) / np.sqrt(surplus.size))


def _agreement(q: Spectra, expected: Spectra, noise_q: Samples, noise_p: Samples) -> float:
    """Share of the power of `q` that `expected` explains, where `q` is clear of both noises; these left out."""
    clear = np.abs(q) ** 2 > CLEAR * (noise_q + noise_p)
    left = np.abs(q - expected) ** 2 - noise_q - noise_p
    return 1.0 - max(0.0, float(left[clear].sum()) / float((np.abs(q) ** 2)[clear].sum()))
