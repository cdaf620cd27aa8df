"""What an inspected record says of motion: whether its channels agree, and where in the phase plane it has been."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.collections import PatchCollection
from matplotlib.figure import FigureBase
from matplotlib.patches import Ellipse, Rectangle
from matplotlib.ticker import MaxNLocator

from jfsm.reporting._canvas import AFTER, INK, MUTED, label
from jfsm.reporting._quantities import percent, quantity, rate_unit, scale_for

Dictionary = Mapping[str, Any]

NORMAL = 1.96  # standard errors to either side of a 95 % interval
MOST_PLANES = 4
FAINTEST = 0.12  # opacity of a cell that was entered once


def draw_consistency(figure: FigureBase, pairs: Sequence[Dictionary], d: Dictionary) -> None:
    """Gain, delay and offset of each pair of channels with their 95 % intervals; 0 is agreement."""
    std = {channel["channel"]: channel["std"] for channel in d["channels"]}
    rate = d["sample_rate"]
    measures = {
        "gain − 1 [%]": [(100.0 * (pair["gain"] - 1.0), 100.0 * pair["gain_error"]) for pair in pairs],
        "late by [samples]": [(rate * pair["delay"], rate * pair["delay_error"]) for pair in pairs],
        "offset [% of s.d.]": [
            (100.0 * pair["offset"] / std[pair["upper"]], 100.0 * pair["offset_error"] / std[pair["upper"]])
            for pair in pairs
        ],
    }
    places = np.arange(len(pairs))
    first = None
    for place, (text, values) in enumerate(measures.items(), start=1):
        axes = first = figure.add_subplot(1, 3, place, sharey=first)
        middle, error = np.transpose(values)
        axes.axvline(0.0, color=MUTED, linewidth=0.8)
        axes.hlines(places, middle - NORMAL * error, middle + NORMAL * error, color=AFTER, linewidth=2.0)
        axes.plot(middle, places, "o", color=AFTER, markersize=4.5)
        axes.margins(x=0.15, y=0.35 / len(pairs) + 0.1)
        axes.tick_params(axis="y", length=0, labelleft=place == 1)
        axes.grid(axis="y", visible=False)
        axes.xaxis.set_major_locator(MaxNLocator(4))
        axes.set_xlabel(text)
    if first is not None:
        first.set_yticks(places, [f"{pair['upper']}\nagainst {pair['lower']}" for pair in pairs])
        first.invert_yaxis()


def describe_consistency(pairs: Sequence[Dictionary]) -> str:
    """The picture in words."""
    parts = [
        f"{pair['upper']} against {pair['lower']}: gain {pair['gain']:.4g}, {quantity(pair['delay'], 's')} late"
        f"{', inverted' if pair['inverted'] else ''}"
        for pair in pairs
    ]
    return f"Gain, delay and offset of channels of one point against each other. {'; '.join(parts)}."


def draw_planes(figure: FigureBase, channels: Sequence[Dictionary]) -> None:
    """A panel a channel: the cells of the phase plane that it has entered, the darker the longer."""
    for place, channel in enumerate(channels):
        axes = figure.add_subplot(1, max(len(channels), 2), place + 1)
        plane = channel["phase_plane"]
        x, v = (
            scale_for(plane[reach], unit)
            for reach, unit in (("reach", channel["unit"]), ("rate_reach", rate_unit(channel["unit"])))
        )
        centre, reach, rate = plane["centre"] / x.factor, plane["reach"] / x.factor, plane["rate_reach"] / v.factor
        share = np.asarray(plane["time"])
        count = len(share)
        width, height = 2.0 * reach / count, 2.0 * rate / count
        entered = np.argwhere(share > 0)
        cells = [Rectangle((centre - reach + i * width, -rate + j * height), width, height) for i, j in entered]
        opacity = FAINTEST + (1.0 - FAINTEST) * np.sqrt(share[share > 0] / share.max())
        axes.add_collection(PatchCollection(cells, facecolor=AFTER, alpha=list(opacity), linewidth=0))
        axes.add_patch(Ellipse((centre, 0.0), 2 * reach, 2 * rate, fill=False, edgecolor=INK, linestyle="dashed"))
        axes.set_xlim(centre - 1.05 * reach, centre + 1.05 * reach)
        axes.set_ylim(-1.05 * rate, 1.05 * rate)
        axes.set_title(f"{channel['channel']}: {percent(plane['coverage'])}")
        label(axes, f"value [{x.unit}]", f"rate of change [{v.unit}]")


def planes_of(channels: Sequence[Dictionary]) -> list[Dictionary]:
    """Channels whose phase plane is worth a picture: of each point the motion that is the least derivative."""
    kinds, found = ("displacement", "velocity", "acceleration"), {}
    for channel in channels:
        kind, _, point = channel["channel"].partition(" ")
        if kind in kinds and channel.get("phase_plane"):
            found.setdefault(point, []).append((kinds.index(kind), channel))
    return [min(options, key=lambda option: option[0])[1] for options in found.values()][:MOST_PLANES]


def describe_planes(channels: Sequence[Dictionary]) -> str:
    """The picture in words."""
    parts = [f"{channel['channel']} {percent(channel['phase_plane']['coverage'])}" for channel in channels]
    return f"Share of the phase plane that the record has entered: {', '.join(parts)}."
