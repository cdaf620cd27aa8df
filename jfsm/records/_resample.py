"""Another sampling rate, without aliasing and without a shift in time."""

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.special import i0

Samples = NDArray[np.float64]

LOBES = 32  # of the windowed sinc on each side
KAISER = 9.0  # side lobes of its window below −90 dB; the transition band is then 0.18 of the cut-off wide
PASSBAND = 0.91  # cut-off over the lower of the two Nyquist frequencies: the transition ends there
CLOSE = 0.1  # samples nearer than this share of the median step are one reading
GAP = 3.5  # median steps without a sample from which on nothing is known between: more than two are missing
HAIR = 1e-6  # of a sample, that rounding makes of none
ROUNDED = 0.25  # share of a step up to which the digits of a time stamp may be missing
MOST = 1e8  # samples of a record
MEMORY, FITTED = 48, 1024  # order of the prediction beyond the ends, and samples it is learnt from
BATCH = 1 << 20  # products held at once


def resampled(
    time: Samples, values: Samples, rate: float, uneven: bool, span: tuple[float, float] | None = None
) -> tuple[Samples, Samples, str]:
    """Instants, samples (n, channels) at `rate` [Hz], and a sentence that says what was done.

    The instants go from the first to the last of `span` [s], by default those of `time`.

    Raises
    ------
    ValueError
        If `rate` is not positive, or leaves fewer than two samples.
    """
    duration = time[-1] - time[0] if span is None else span[1] - span[0]
    if not (np.isfinite(rate) and rate > 0 and duration * rate >= 1.0):
        raise ValueError(
            f"`rate` must be a positive number of samples per second with at least two of them in {duration:.6g} s; "
            f"it was {rate}. Pass at least {1 / duration:.6g}."
        )
    if duration * rate > MOST:
        raise ValueError(
            f"`rate` must leave at most {MOST:.0e} samples; {rate:.6g} Hz makes {duration * rate:.3g}. "
            "Pass a lower rate, in samples per second."
        )
    note = f"Resampled from {(time.size - 1) / (time[-1] - time[0]):.6g} to {rate:.6g} Hz"
    if uneven and (resolution := _rounding(time)):
        slope, start = np.polyfit(np.arange(time.size), time, 1)
        time = start + slope * np.arange(time.size)
        note += f"; its uniform clock was written to {resolution:.3g} s only"
    elif uneven:
        values, gap = _even(time, values)
        note += f", by cubic interpolation of uneven samples with gaps of up to {gap:.6g} s"
    source_rate = (values.shape[0] - 1) / (time[-1] - time[0])
    start, end = (time[0], time[-1]) if span is None else span
    steps = np.arange(int(np.floor((end - start) * rate * (1.0 + 1e-12) + HAIR)) + 1)
    position = (start - time[0]) * source_rate + steps * (source_rate / rate)
    kept = round(position[0]) + steps
    if kept[-1] < values.shape[0] and np.all(np.abs(position - kept) <= HAIR):
        values = values[kept[0] : kept[-1] + 1]
        note = note if uneven else f"Kept as sampled, at {rate:.6g} Hz"
    else:
        values = filtered(values, position, rate / source_rate)
    return start + steps / rate, values, note + "."


def _rounding(time: Samples) -> float:
    """The unit [s] to which the stamps of a uniform clock were rounded, 0 if the clock is not uniform."""
    steps = np.diff(time)
    levels = np.unique(np.round(steps, 9))
    if levels.size < 2:
        return 0.0
    unit = float(np.min(np.diff(levels)))
    if unit > ROUNDED * float(np.mean(steps)) or np.max(np.abs(steps / unit - np.round(steps / unit))) > 0.01:
        return 0.0
    index = np.arange(time.size)
    drift = time - np.polyval(np.polyfit(index, time, 1), index)
    return unit if float(np.max(np.abs(drift))) <= unit else 0.0  # otherwise the steps themselves differ


def long_gaps(time: Samples) -> list[tuple[float, float]]:
    """Last and next instant [s] of every gap of more than two samples."""
    steps = np.diff(time)
    wide = np.flatnonzero(steps > GAP * float(np.median(steps)))
    return [(float(time[i]), float(time[i + 1])) for i in wide]


def _even(time: Samples, values: Samples) -> tuple[Samples, float]:
    """The samples on the uniform clock of the median step, and the longest step [s] that had to be bridged.

    Short gaps are bridged by the spline through all samples beside them, long ones by straight lines.
    """
    median = float(np.median(np.diff(time)))
    # Two readings at almost the same instant would make the spline follow their noise far beyond both.
    reading = np.concatenate([[0], np.cumsum(np.diff(time) > CLOSE * median)])
    weight = np.bincount(reading)
    merged = np.bincount(reading, time) / weight
    merged[0], merged[-1] = time[0], time[-1]
    columns = [np.bincount(reading, column) / weight for column in values.T]
    uniform = np.linspace(time[0], time[-1], max(2, round((time[-1] - time[0]) / median) + 1))
    together = np.stack(columns, axis=1) if columns else np.empty((merged.size, 0))
    bounds = np.flatnonzero(np.diff(merged) > GAP * median)
    result = (
        np.stack([np.interp(uniform, merged, column) for column in together.T], axis=1)
        if columns
        else (np.empty((uniform.size, 0)))
    )
    for first, last in zip([0, *(bounds + 1)], [*bounds, merged.size - 1], strict=True):
        inside = (uniform >= merged[first]) & (uniform <= merged[last])
        if last - first > 2 and columns:
            result[inside] = CubicSpline(merged[first : last + 1], together[first : last + 1])(uniform[inside])
    return result, float(np.max(np.diff(merged)))


def filtered(values: Samples, position: Samples, ratio: float) -> Samples:
    """Uniform samples at fractional positions, below the lower of both band limits, by a Kaiser-windowed sinc."""
    # The cut-off leaves room for the transition only where something could fold back.
    cutoff = PASSBAND * ratio if ratio < 1.0 else 1.0
    reach = LOBES / cutoff
    taps = np.arange(-int(np.floor(reach)), int(np.floor(reach)) + 2)
    padded = _extended(values, taps.size)
    result = np.empty((position.size, values.shape[1]))
    step = max(1, BATCH // (taps.size * max(1, values.shape[1])))
    for start in range(0, position.size, step):
        some = position[start : start + step]
        nearest = np.floor(some).astype(int)
        distance = some[:, None] - nearest[:, None] - taps
        inside = np.clip(1.0 - (distance / reach) ** 2, 0.0, None)
        weight = np.sinc(cutoff * distance) * i0(KAISER * np.sqrt(inside)) * (np.abs(distance) <= reach)
        weight /= weight.sum(axis=1, keepdims=True)  # a constant stays what it is
        window = padded[nearest[:, None] + taps + taps.size]
        result[start : start + step] = np.einsum("st,stc->sc", weight, window)
    return result


def _extended(values: Samples, margin: int) -> Samples:
    """The samples continued beyond both ends by linear prediction, so that the filter meets no edge."""
    continued = [
        np.concatenate([_predicted(column[::-1], margin)[::-1], column, _predicted(column, margin)])
        for column in values.T
    ]
    return np.stack(continued, axis=1) if continued else np.empty((values.shape[0] + 2 * margin, 0))


def _predicted(past: Samples, count: int) -> Samples:
    """The next samples of a series as an autoregression continues it: oscillations go on, noise does not."""
    level = float(past[-FITTED:].mean())
    recent = past[-FITTED:] - level
    coefficients = _burg(recent, min(MEMORY, recent.size // 3))
    order = coefficients.size
    series = np.concatenate([recent, np.zeros(count)])
    for i in range(recent.size, series.size):
        series[i] = coefficients @ series[i - order : i][::-1]
    return series[recent.size :] + level


def _burg(series: Samples, order: int) -> Samples:
    """Coefficients of the last `order` samples, latest first, by Burg's method: a prediction that cannot grow."""
    forward, backward = series[1:], series[:-1]
    coefficients = np.empty(0)
    for _ in range(order):
        power = float(forward @ forward + backward @ backward)
        if power <= 1e-24 * float(series @ series):
            break
        reflection = 2.0 * float(forward @ backward) / power
        coefficients = np.concatenate([coefficients - reflection * coefficients[::-1], [reflection]])
        forward, backward = (forward - reflection * backward)[1:], (backward - reflection * forward)[:-1]
    return coefficients
