"""The page of a file that does not say which of its channels is what: what it holds, and how to go on."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from matplotlib.figure import FigureBase

from jfsm.reporting._canvas import AFTER, label
from jfsm.reporting._curves import curve
from jfsm.reporting._quantities import ABSENT
from jfsm.reporting._shown_units import in_shown_words
from jfsm.reporting._sketch import Sketch, drawn
from jfsm.reporting._summary import Answer
from jfsm.reporting._tables import Table
from jfsm.reporting._template import inline, template
from jfsm.reporting._wording import counted

Dictionary = Mapping[str, Any]

MOST_PICTURES, BESIDE = 60, 3  # channels that are drawn, and pictures in a row


def render_listing(d: Dictionary, proposal: str) -> str:
    """The channels of a file as one self-contained HTML page.

    Parameters
    ----------
    d : mapping
        "source", "channels", "notes" and "clock" as `jfsm.records.Listing` has them, each channel a mapping.
    proposal : str
        A command line to go on with; may be empty.

    Returns
    -------
    str
        An HTML document.
    """
    channels = list(d["channels"])
    return template("listing.html.j2").render(
        version=None,
        badge=counted(len(channels), "channel"),
        tone="open",
        headline="The file does not say which channel is what",
        remark="",
        advice=f"To go on: {proposal}" if proposal else "",
        title=d["source"],
        record_line="",
        answers=[*_answers(channels)],
        pictures=inline(drawn(_sketches(channels))),
        notes=in_shown_words([*d["notes"], *filter(None, [d["clock"]])]),
        channels=_table(channels),
        timing="",
    )


def _answers(channels: Sequence[Dictionary]) -> Iterable[Answer]:
    """Samples, rate and duration, all that there are."""
    for question, key, unit in (("Samples", "samples", ""), ("Rate", "rate", "Hz"), ("Duration", "duration", "s")):
        values = sorted({channel[key] for channel in channels if channel[key] is not None})
        if values:
            first, last = (f"{value}" if key == "samples" else _plain(value) for value in (values[0], values[-1]))
            yield Answer(question, f"{first if first == last else f'{first} to {last}'} {unit}".rstrip())


def _plain(value: float | None, digits: int = 6) -> str:
    return ABSENT if value is None or math.isinf(value) else f"{value:.{digits}g}".replace("-", "−")


def _table(channels: Sequence[Dictionary]) -> Table:
    rows = tuple(
        (
            f"{channel['number'] or ABSENT}",
            channel["name"],
            channel["unit"] or ABSENT,
            channel["kind"].replace("_", " ") or ABSENT,
            f"{channel['samples']}",
            _plain(channel["rate"]),
            _plain(channel["duration"]),
            _plain(channel["lowest"], 4),
            _plain(channel["highest"], 4),
        )
        for channel in channels
    )
    headings = ("no.", "channel", "unit", "may be", "samples", "rate [Hz]", "seconds", "lowest", "highest")
    return Table("Names as they must be given", headings, rows, frozenset({1, 2, 3}))


def _sketches(channels: Sequence[Dictionary]) -> Iterable[Sketch]:
    shown = channels[:MOST_PICTURES]
    if not shown:
        return
    words = f" {len(shown)} of {len(channels)} channels are shown." if len(shown) < len(channels) else ""
    ends = (f"{c['name']} from {_plain(c['lowest'], 4)} to {_plain(c['highest'], 4)} {c['unit']}" for c in shown)
    yield Sketch(
        "channels",
        "The channels",
        "Numbers as they stand in the file, over time where the file has a clock, else over the number of the sample."
        + words,
        f"The channels of the file, one picture each: {'; '.join(end.rstrip() for end in ends)}.",
        0.3 + 1.6 * -(-len(shown) // BESIDE),
        lambda figure: _draw(figure, shown),
    )


def _draw(figure: FigureBase, channels: Sequence[Dictionary]) -> None:
    grid = figure.add_gridspec(-(-len(channels) // BESIDE), BESIDE)
    for place, channel in enumerate(channels):
        axes = figure.add_subplot(grid[divmod(place, BESIDE)])
        x, y = curve(channel["outline"]).T
        axes.plot(x, y, color=AFTER, linewidth=0.8)
        axes.set_title(channel["name"])
        label(axes, "sample" if channel["rate"] is None else "time [s]", f"[{channel['unit']}]" * bool(channel["unit"]))
