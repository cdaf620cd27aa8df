"""An inspected record by frequency: spectra and noise, coherence, and the lines of a period."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import FigureBase

from jfsm.reporting._canvas import AFTER, BEFORE, FLOOR, INK, REFITTED, dots, key_above, key_on_top, label, log_axis
from jfsm.reporting._curves import curve, envelope, peak
from jfsm.reporting._quantities import number, percent, quantity, scale_for

Dictionary = Mapping[str, Any]

MOST_PANELS = 6
MOST_CURVES = 4
MOST_POINTS = 2000
BEYOND = 1.5  # times the highest excited line, up to which the lines of a period are drawn
COLUMNS = 500
DEEPEST = 1e-3  # of the noise level: what lies deeper is rounding, or a filter


def draw_spectra(figure: FigureBase, spectra: Sequence[Dictionary], noise: Sequence[Dictionary], d: Dictionary) -> None:
    """A panel a channel: amplitude density, the density of the noise where it is seen, and its level if it is white."""
    channels = {channel["channel"]: channel for channel in d["channels"]}
    seen = {one["channel"]: one for one in noise}
    shown, panels = spectra[:MOST_PANELS], []
    for place, one in enumerate(shown):
        axes = figure.add_subplot(*_grid(len(shown)), place + 1)
        panels.append(axes)
        frequency, density = curve(one["frequency"]), np.sqrt(curve(one["density"]))
        channel = channels[one["channel"]]
        factor, unit = scale_for(peak(density), channel["unit"])
        axes.plot(
            *envelope(frequency, density / factor, COLUMNS, log=True), color=AFTER, linewidth=0.9, label="channel"
        )
        if one["channel"] in seen:
            own = seen[one["channel"]]
            measured = curve(own["frequency"]), np.sqrt(curve(own["density"])) / factor
            axes.plot(*measured, color=BEFORE, linewidth=1.3, label="noise")
        if channel.get("noise"):
            level = channel["noise"] * np.sqrt(2.0 / d["sample_rate"]) / factor
            axes.axhline(level, color=BEFORE, linewidth=1.0, linestyle="dashed", label="noise level")
            axes.set_ylim(bottom=max(min(density.min() / factor, level / 3.0), level * DEEPEST))
        log_axis(axes, "x")
        log_axis(axes, "y")
        axes.set_title(one["channel"])
        label(axes, "frequency [Hz]", f"[{unit}/√Hz]")
    key_on_top(figure, panels)


def describe_spectra(spectra: Sequence[Dictionary], channels: Sequence[Dictionary]) -> str:
    """The picture in words."""
    figures = {channel["channel"]: channel for channel in channels}
    parts = []
    for one in spectra[:MOST_PANELS]:
        channel = figures[one["channel"]]
        noise = quantity(channel.get("noise"), channel["unit"])
        parts.append(f"{one['channel']}: strongest at {quantity(channel.get('frequency'), 'Hz')}, noise {noise}")
    return f"Amplitude density of the channels over frequency. {'; '.join(parts)}."


def draw_coherence(figure: FigureBase, coherence: Sequence[Dictionary]) -> None:
    """A curve a response, interrupted where it is not clear of noise."""
    axes = figure.add_subplot()
    for one, colour in zip(coherence, (AFTER, BEFORE, REFITTED, INK), strict=False):
        frequency, share = curve(one["frequency"]), curve(one["coherence"])
        breaks = np.flatnonzero(np.diff(frequency) > 1.5 * np.diff(frequency).min(initial=np.inf)) + 1
        x, y = np.insert(frequency, breaks, np.nan), np.insert(share, breaks, np.nan)
        axes.plot(
            *(envelope(x, y, COLUMNS) if not breaks.size else (x, y)), color=colour, linewidth=1.0, label=one["channel"]
        )
    axes.set_ylim(0.0, 1.03)
    label(axes, "frequency [Hz]", "coherence")
    key_above(axes, MOST_CURVES)


def describe_coherence(coherence: Sequence[Dictionary]) -> str:
    """The picture in words."""
    parts = [f"{one['channel']} {percent(one['mean'])}" for one in coherence[:MOST_CURVES]]
    return f"Coherence with the drive over frequency; weighted with power: {', '.join(parts)}."


def draw_lines(figure: FigureBase, periods: Dictionary, channels: Sequence[Dictionary]) -> None:
    """A panel a channel: amplitude of the mean period at its lines, sorted by what excites them, and their noise."""
    units = {channel["channel"]: channel["unit"] for channel in channels}
    shown, panels = periods["channels"][:MOST_PANELS], []
    for place, one in enumerate(shown):
        axes = figure.add_subplot(*_grid(len(shown)), place + 1)
        panels.append(axes)
        last = int(BEYOND * max(periods["excited"]))
        frequency, mean, noise = (curve(one[part])[:last] for part in ("frequency", "mean", "noise_lines"))
        factor, unit = scale_for(peak(mean), units.get(one["channel"]))
        for (text, colour), lines in _groups(periods["excited"], mean.size).items():
            lines = lines[:: max(1, -(-lines.size // MOST_POINTS))]
            dots(axes, frequency[lines], mean[lines] / factor, colour, text)
        log_axis(axes, "y")
        axes.set_xlim(0.0, frequency[-1])
        lowest = [float(values[values > 0].min()) for values in (mean, noise) if np.any(values > 1e-12 * peak(mean))]
        axes.set_ylim(max(min(lowest), 1e-7 * peak(mean)) / factor / 2.0, 2.0 * peak(mean) / factor)
        if np.any(noise > 0):
            axes.plot(*envelope(frequency, noise / factor, COLUMNS), color=BEFORE, linewidth=0.9, label="noise")
        axes.set_title(one["channel"])
        label(axes, "frequency [Hz]", f"amplitude [{unit}]")
    key_on_top(figure, panels)


def describe_lines(periods: Dictionary) -> str:
    """The picture in words."""
    return (
        f"Amplitude of the lines of the mean of {periods['count']} periods, {len(periods['excited'])} of them excited "
        f"from {number(_hertz(periods, min(periods['excited'])))} to "
        f"{number(_hertz(periods, max(periods['excited'])))} Hz, and their noise."
    )


def panel_rows(panels: int) -> int:
    """Rows of panels on a sheet."""
    return _grid(min(panels, MOST_PANELS))[0]


def _grid(panels: int) -> tuple[int, int]:
    return (panels, 1) if panels == 1 else (-(-panels // 2), 2)


def _hertz(periods: Dictionary, line: int) -> float:
    return line / periods["seconds"]


def _groups(excited: Sequence[int], count: int) -> dict[tuple[str, str], np.ndarray]:
    """Places of the lines by what is on them: even and odd are told apart where even lines are free of excitation."""
    excited_lines = np.asarray(excited)
    lines = np.arange(1, count + 1)
    free = np.isin(lines, excited_lines, invert=True)
    if np.any(excited_lines % 2 == 0):
        groups = {("not excited", FLOOR): free}
    else:
        groups = {("even", AFTER): free & (lines % 2 == 0), ("odd", REFITTED): free & (lines % 2 == 1)}
    groups = {("excited", INK): ~free, **groups}
    return {key: np.flatnonzero(chosen) for key, chosen in groups.items() if chosen.any()}
