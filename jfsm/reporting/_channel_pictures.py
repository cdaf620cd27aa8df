"""The channels of an inspected record over time, and what of them is no reading."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from jfsm.reporting._canvas import AFTER, BEFORE, FLOOR, MUTED, REFITTED, key_above, label
from jfsm.reporting._curves import Curve, curve, envelope, loudest_stretch, peak
from jfsm.reporting._quantities import quantity, scale_for
from jfsm.reporting._wording import counted

DEFECTS = {"clipped": BEFORE, "spikes": REFITTED}
MOST_MARKS, MOST_GAPS = 300, 100
VISIBLE = 1 / 400  # of the time axis: a gap as wide as that interrupts the line
AROUND = 40  # samples shown on either side of a spike

Gap = Sequence[float]


def draw_channels(figure: FigureBase, curves: Mapping[str, Any], gaps: Sequence[Gap]) -> None:
    """A row a channel: all of it, and a close-up beside if it is dense or has a spike."""
    channels = curves["channels"]
    time = curve(curves["time"])
    views = [_close_up(channel) for channel in channels.values()]
    grid = figure.add_gridspec(len(channels), 2 if any(views) else 1, width_ratios=[7, 5] if any(views) else [1])
    for row, ((name, channel), view) in enumerate(zip(channels.items(), views, strict=True)):
        last = row == len(channels) - 1
        whole = figure.add_subplot(grid[row, 0])
        _draw_channel(whole, time, channel, gaps, slice(None))
        whole.set_title(name)
        whole.set_xlabel("time [s]" if last else "")
        if whole.get_legend_handles_labels()[0]:
            key_above(whole, 3)
        if view:
            part, words = view
            close = figure.add_subplot(grid[row, 1])
            _draw_channel(close, time, channel, gaps, part)
            close.set_title(words, fontweight="normal", color=MUTED)
            close.set_xlabel("time [s]" if last else "")


def describe_channels(curves: Mapping[str, Any], gaps: Sequence[Gap]) -> str:
    """The picture in words."""
    parts = []
    for name, channel in curves["channels"].items():
        marks = [
            f"{np.count_nonzero(channel[kind])} samples marked as {kind}" for kind in DEFECTS if channel[kind].any()
        ]
        parts.append(", ".join([f"{name}, up to {quantity(peak(curve(channel['samples'])), channel['unit'])}", *marks]))
    missing = f" {counted(len(gaps), 'gap')} in time." if gaps else ""
    return f"The channels over time. {'; '.join(parts)}.{missing}"


def _close_up(channel: Mapping[str, Any]) -> tuple[slice, str] | None:
    """Samples worth a closer look, and why."""
    if channel["spikes"].any():
        first = int(np.argmax(channel["spikes"]))
        return slice(max(first - AROUND, 0), first + AROUND + 1), "around the first spike"
    loudest = loudest_stretch(curve(channel["samples"]))
    return None if loudest is None else (loudest, "loudest stretch")


def _draw_channel(axes: Axes, time: Curve, channel: Mapping[str, Any], gaps: Sequence[Gap], view: slice) -> None:
    samples = curve(channel["samples"])
    factor, unit = scale_for(peak(samples), channel["unit"])
    t, y = time[view], samples[view] / factor
    here = [(start, end) for start, end in gaps if start >= t[0] and end <= t[-1]]
    here = sorted(sorted(here, key=lambda gap: gap[0] - gap[1])[:MOST_GAPS])  # the widest
    for piece in _pieces(t, here):
        axes.plot(*envelope(t[piece], y[piece]), color=AFTER, linewidth=0.9)
    for start, end in here:
        axes.axvspan(start, end, color=FLOOR, alpha=0.35, linewidth=0, label="gap" if start == here[0][0] else None)
    for kind, colour in DEFECTS.items():
        marked = np.flatnonzero(channel[kind][view])
        if marked.size:
            marked = marked[:: -(-marked.size // MOST_MARKS)]
            axes.plot(t[marked], y[marked], ".", markersize=4.5, color=colour, label=kind)
    axes.set_xlim(t[0], t[-1])
    label(axes, "", f"[{unit}]")


def _pieces(time: Curve, gaps: Sequence[Gap]) -> Iterator[slice]:
    """Samples between gaps that are wide enough to be seen."""
    wide = [gap for gap in gaps if gap[1] - gap[0] > VISIBLE * (time[-1] - time[0])]
    edges = [0, *(int(np.searchsorted(time, end)) for _, end in wide), time.size]
    yield from (slice(*pair) for pair in zip(edges[:-1], edges[1:], strict=True))
