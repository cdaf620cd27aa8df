"""Scores as bars: the gain channel by channel, and the candidates side by side."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import FigureBase

from jfsm.reporting._canvas import AFTER, BEFORE, FLOOR, INK, MUTED, REFITTED, key_above
from jfsm.reporting._quantities import number, percent, probability, scale_for
from jfsm.reporting._wording import cause_name, place_name

STAGES = {
    "before": ("as given", BEFORE),
    "refitted": ("refitted", REFITTED),
    "after": ("extended", AFTER),
    "floor": ("floor", FLOOR),
}
MOST_CANDIDATES = 10


def draw_gain(figure: FigureBase, channels: Mapping[str, Mapping[str, Any]]) -> None:
    """A bar a stage for every channel, long for a large error, its size in the channel's unit at the end."""
    axes = figure.add_subplot()
    for row, (stage, (word, colour)) in enumerate(STAGES.items()):
        places = np.arange(len(channels)) + 0.2 * (row - 1.5)
        shares = [100.0 * (gain.get(f"{stage}_nrmse") or 0.0) for gain in channels.values()]
        axes.barh(places, shares, height=0.17, color=colour, label=word)
        for place, share, gain in zip(places, shares, channels.values(), strict=True):
            if gain.get(stage) is not None:
                text = _error(gain, stage)
                axes.annotate(text, (share, place), (4, 0), textcoords="offset points", va="center", fontsize=7.5)
    axes.set_yticks(np.arange(len(channels)), list(channels))
    axes.invert_yaxis()
    axes.tick_params(axis="y", length=0)
    axes.grid(axis="y", visible=False)
    axes.margins(x=0.12)
    axes.set_xlabel("rms error on held-out data, share of the signal [%]")
    key_above(axes, len(STAGES))


def describe_gain(channels: Mapping[str, Mapping[str, Any]]) -> str:
    """The picture in words."""
    parts = []
    for name, gain in channels.items():
        stages = [f"{_error(gain, stage)} {word}" for stage, (word, _) in STAGES.items() if gain.get(stage) is not None]
        parts.append(f"{name}: {', '.join(stages)}")
    return "Free-run rms error on held-out data. " + "; ".join(parts) + "."


def _error(gain: Mapping[str, Any], stage: str) -> str:
    """In the unit of the error before, so that a channel's stages compare at sight."""
    scale = scale_for(gain.get("before"), gain.get("unit"))
    return f"{number(gain[stage] / scale.factor)} {scale.unit}".rstrip()


def draw_ranking(figure: FigureBase, candidates: Sequence[Mapping[str, Any]]) -> None:
    """The best candidates: how much of the error each explains, and how far its evidence lies behind the best."""
    best = _ranked(candidates)
    colours = [AFTER if one.get("why") == "named" else FLOOR for one in best]
    places = np.arange(len(best))
    explains = [100.0 * max(one.get("kappa") or 0.0, 0.0) for one in best]
    lead = best[0].get("evidence") or 0.0
    behind = [max(lead - (one.get("evidence") or 0.0), 0.0) for one in best]

    left, right = figure.subplots(1, 2, sharey=True)
    left.barh(places, explains, height=0.62, color=colours)
    right.barh(places, behind, height=0.62, color=colours)
    # Differences of 1 and of 1000 nats both matter: linear near 0, logarithmic beyond.
    right.set_xscale("symlog", linthresh=3.0)
    right.xaxis.set_major_formatter(lambda value, _: number(value, 1))
    for place, one in enumerate(best):
        text, note = percent(one.get("kappa")), f"{number(behind[place])} · p {probability(one.get('probability'))}"
        for axes, reach, words in ((left, explains[place], text), (right, behind[place], note)):
            axes.annotate(words, (reach, place), (4, 0), textcoords="offset points", va="center", fontsize=7.5)
    left.set_yticks(
        places, [", ".join(filter(None, (cause_name(one["cause"]), place_name(one.get("at"))))) for one in best]
    )
    left.invert_yaxis()
    for axes in (left, right):
        axes.tick_params(axis="y", length=0)
        axes.grid(axis="y", visible=False)
    left.set_xlim(0.0, 117.0)
    left.set_xticks(range(0, 101, 20))
    right.margins(x=0.22)
    left.set_xlabel("explains of the excess error [%]")
    right.set_xlabel("evidence behind the best [nats]; p its probability")
    for tick, one in zip(left.get_yticklabels(), colours, strict=True):
        tick.set_color(INK if one == AFTER else MUTED)


def describe_ranking(candidates: Sequence[Mapping[str, Any]]) -> str:
    """The picture in words."""
    parts = [f"{cause_name(one['cause'])} {probability(one.get('probability'))}" for one in _ranked(candidates)]
    return "Candidates from the best down, with probability: " + ", ".join(parts) + "."


def ranked_size(candidates: Sequence[Mapping[str, Any]]) -> int:
    return min(len(candidates), MOST_CANDIDATES)


def _ranked(candidates: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    return sorted(candidates, key=lambda one: -(one.get("evidence") or -np.inf))[:MOST_CANDIDATES]
