"""The tables of an inspection, once, for the terminal and the page."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from jfsm.reporting._quantities import (
    ABSENT,
    number,
    percent,
    quantity,
    scale_for,
    with_error,
)
from jfsm.reporting._tables import Table

Dictionary = Mapping[str, Any]

ROUNDING = 1e-12  # of the largest figure of a channel, below which a figure is 0
NEGLIGIBLE = 1e-6  # of the standard deviation, below which an offset is 0
NORMAL = 1.96  # standard errors to either side of a 95 % interval


def inspected_channels_table(channels: Sequence[Dictionary]) -> Table:
    """Figures of each channel of an inspected record."""
    rows = []
    for channel in channels:
        values = [channel.get(figure) for figure in ("minimum", "maximum", "mean", "std")]
        largest = max((abs(value) for value in values if value is not None), default=0.0)
        factor, unit = scale_for(largest, channel.get("unit"))
        noise, std, frequency = (channel.get(figure) for figure in ("noise", "std", "frequency"))
        rows.append(
            (
                channel["channel"],
                unit or ABSENT,
                *(number(None if value is None else rounded(value, largest) / factor) for value in values),
                with_error(noise, channel.get("noise_error"), channel.get("unit")),
                small_percent(noise / std) if noise is not None and std else ABSENT,
                quantity(frequency, "Hz"),
            )
        )
    headings = (
        "channel",
        "unit",
        "minimum",
        "maximum",
        "mean",
        "s.d.",
        "noise ± error",
        "noise / s.d.",
        "strongest at",
    )
    return Table("Channels", headings, tuple(rows), frozenset({0, 1}))


def rounded(value: float, largest: float, least: float = ROUNDING) -> float:
    """A figure, or 0 for less than a share `least` of the largest: what rounding leaves of 0."""
    return 0.0 if abs(value) < least * largest else value


def small_percent(share: float) -> str:
    """A share as a percentage, of which less than a hundredth does not matter."""
    return percent(share) if share >= 1e-4 else "< 0.01 %"


def remarks_table(title: str, findings: Sequence[Dictionary]) -> Table:
    """What was found, channel by channel; a channel is named once."""
    channels = [finding["channel"] for finding in findings]
    rows = tuple(
        ("" if before == finding["channel"] else finding["channel"], finding["message"])
        for before, finding in zip([None, *channels], findings, strict=False)
    )
    return Table(title, ("channel", "what was found"), rows, frozenset({0, 1}))


def consistency_table(
    comparisons: Sequence[Dictionary], channels: Sequence[Dictionary], sample_rate: float | None
) -> Table:
    """Each measured quantity of a point against another one that it is a derivative of."""
    figures = {channel["channel"]: channel for channel in channels}
    rows = []
    for pair in comparisons:
        upper = figures.get(pair["upper"], {})
        gain = -pair["gain"] if pair["inverted"] else pair["gain"]
        rows.append(
            (
                pair["upper"],
                pair["lower"],
                _with_interval(gain, pair["gain_error"], 4),
                _with_interval(sample_rate * pair["delay"], sample_rate * pair["delay_error"], 3)
                if sample_rate
                else ABSENT,
                _offset(pair["offset"], pair["offset_error"], upper),
                percent(pair["agreement"]),
            )
        )
    headings = ("channel", "against", "gain", "late by [samples]", "offset", "agreement")
    return Table(
        "One point's channels against each other, with 95 % intervals", headings, tuple(rows), frozenset({0, 1})
    )


def periods_table(periods: Dictionary, channels: Sequence[Dictionary]) -> Table:
    """What averaging over periods says of each channel."""
    units = {channel["channel"]: channel.get("unit") for channel in channels}
    rows = tuple(
        (
            one["channel"],
            with_error(one["noise"], one["noise_error"], units.get(one["channel"])),
            _distortion(one["even"]),
            _distortion(one["odd"]),
        )
        for one in periods.get("channels") or ()
    )
    headings = ("channel", "noise from period to period", "even distortion", "odd distortion")
    table = Table("Noise and distortion of the periods", headings, rows)
    is_told = any(cell != ABSENT for row in rows for cell in row[2:])
    return table if is_told else table.only(*headings[:2])


def _distortion(share: float | None) -> str:
    if share is None:
        return ABSENT
    return f"{number(20.0 * math.log10(share), 2)} dB" if share else "none beyond noise"


def _with_interval(value: float, error: float, decimals: int) -> str:
    """ "1.0500 [1.0490, 1.0510]"."""
    bounds = (round(value + side * NORMAL * error, decimals) + 0.0 for side in (0.0, -1.0, 1.0))  # no −0
    middle, low, high = (f"{bound:.{decimals}f}" for bound in bounds)
    return f"{middle} [{low}, {high}]".replace("-", "−")


def _offset(value: float, error: float, channel: Dictionary) -> str:
    """ "18.8 [−0.1, 37.6] mm/s"; 0 for what is nothing beside the channel's standard deviation."""
    bounds = [value + side * NORMAL * error for side in (0.0, -1.0, 1.0)]
    bounds = [rounded(bound, channel.get("std") or 0.0, NEGLIGIBLE) for bound in bounds]
    factor, unit = scale_for(max(map(abs, bounds)), channel.get("unit"))
    middle, low, high = (number(bound / factor) for bound in bounds)
    return f"{middle} [{low}, {high}] {unit}".rstrip()
