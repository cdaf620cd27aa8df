"""The held-out record: what was measured, what the simulation said, what the extended one says."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from jfsm.reporting._canvas import AFTER, BEFORE, MEASURED, MUTED, key_above, label
from jfsm.reporting._curves import Curve, curve, envelope, loudest_stretch, peak, rms
from jfsm.reporting._quantities import quantity, scale_for

MODELS = {"before": ("as given", BEFORE), "after": ("extended", AFTER)}


def draw_record(figure: FigureBase, holdout: Mapping[str, Any]) -> None:
    """A channel in two rows, curves above errors, and a close-up beside them if the curves are dense."""
    channels = holdout["channels"]
    time = curve(holdout["time"])
    stretches = [loudest_stretch(curve(channel["measured"])) for channel in channels.values()]
    widths = [7, 5] if any(stretches) else [1]
    grid = figure.add_gridspec(
        2 * len(channels), len(widths), height_ratios=[5, 3] * len(channels), width_ratios=widths
    )
    for row, ((name, channel), stretch) in enumerate(zip(channels.items(), stretches, strict=True)):
        above, below = figure.add_subplot(grid[2 * row, 0]), figure.add_subplot(grid[2 * row + 1, 0])
        _draw_channel(above, below, time, channel, slice(None))
        above.set_title(name)
        key_above(above, 3)
        if stretch:
            close, close_below = figure.add_subplot(grid[2 * row, 1]), figure.add_subplot(grid[2 * row + 1, 1])
            _draw_channel(close, close_below, time, channel, stretch)
            close.set_title("loudest stretch", fontweight="normal", color=MUTED)


def describe_record(holdout: Mapping[str, Any]) -> str:
    """The picture in words, for those who cannot see it."""
    parts = []
    for name, channel in holdout["channels"].items():
        measured, unit = curve(channel["measured"]), channel.get("unit")
        errors = [
            f"rms error {quantity(rms(values - measured), unit)} {word}"
            for word, values in ((MODELS[key][0], curve(channel.get(key))) for key in MODELS)
            if values.size
        ]
        parts.append(f"{name}, rms {quantity(rms(measured), unit)}: {', '.join(errors) or 'no simulation'}")
    return "Measured and simulated curves of the held-out record. " + "; ".join(parts) + "."


def _draw_channel(above: Axes, below: Axes, time: Curve, channel: Mapping[str, Any], view: slice) -> None:
    measured = curve(channel["measured"])
    models = {key: values for key in MODELS if (values := curve(channel.get(key))).size}
    errors = {key: values - measured for key, values in models.items()}
    signal_scale = scale_for(peak(measured), channel.get("unit"))
    error_scale = scale_for(peak(*errors.values()), channel.get("unit"))

    above.plot(*_seen(time, measured / signal_scale.factor, view), color=MEASURED, linewidth=2.6, label="measured")
    for key, values in models.items():
        word, colour = MODELS[key]
        above.plot(*_seen(time, values / signal_scale.factor, view), color=colour, linewidth=1.0, label=word)
        below.plot(*_seen(time, errors[key] / error_scale.factor, view), color=colour, linewidth=1.0)
    # A model that ran away must not flatten the measured curve.
    tallest = 1.6 * peak(measured[view]) / signal_scale.factor
    if tallest > 0:
        low, high = above.get_ylim()
        above.set_ylim(max(low, -tallest), min(high, tallest))
    for axes in (above, below):
        axes.set_xlim(time[view][0], time[view][-1])
    above.tick_params(labelbottom=False)
    label(above, "", f"reading [{signal_scale.unit}]")
    label(below, "time [s]", f"error [{error_scale.unit}]")


def _seen(time: Curve, values: Curve, view: slice) -> tuple[Curve, Curve]:
    return envelope(time[view], np.asarray(values[view]))
