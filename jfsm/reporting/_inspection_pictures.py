"""The pictures of an inspection, each made only if there is something to show."""

from collections.abc import Iterator, Mapping
from typing import Any

from jfsm.reporting._channel_pictures import describe_channels, draw_channels
from jfsm.reporting._curves import first_channels
from jfsm.reporting._motion_pictures import (
    describe_consistency,
    describe_planes,
    draw_consistency,
    draw_planes,
    planes_of,
)
from jfsm.reporting._sketch import Picture, Sketch, drawn
from jfsm.reporting._spectrum_pictures import (
    describe_coherence,
    describe_lines,
    describe_spectra,
    draw_coherence,
    draw_lines,
    draw_spectra,
    panel_rows,
)

MOST_CHANNELS = 6


def inspection_pictures(d: Mapping[str, Any]) -> tuple[Picture, ...]:
    """Every picture that an inspection has data for, in the order of the page.

    Parameters
    ----------
    d : mapping
        What ``Inspection.to_dict`` returns, and "curves": "time" (n,) and "channels", each with its "unit", its
        "samples" and the masks "clipped" and "spikes", (n,) each. Parts may be None or missing.
    """
    return drawn(_sketches(d))


def _sketches(d: Mapping[str, Any]) -> Iterator[Sketch]:
    curves, gaps, channels = d.get("curves") or {}, d.get("gaps") or (), d.get("channels") or ()
    if curves.get("channels"):
        curves, left_out = first_channels(curves, MOST_CHANNELS)
        yield Sketch(
            "channels",
            "The channels over time",
            "Clipped samples and spikes are marked: they are no readings." + left_out,
            describe_channels(curves, gaps),
            0.4 + 1.75 * len(curves["channels"]),
            lambda figure: draw_channels(figure, curves, gaps),
        )
    spectra = d.get("spectra") or ()
    if spectra:
        yield Sketch(
            "spectra",
            "Spectra",
            "The noise is what remains of a channel where it has no signal; dashed, the noise level of the table, as "
            "white noise would have it. A channel that lies on the dashed line shows noise there and nothing else.",
            describe_spectra(spectra, channels),
            0.2 + 2.9 * panel_rows(len(spectra)),
            lambda figure: draw_spectra(figure, spectra, d.get("noise") or (), d),
        )
    coherence = d.get("coherence") or ()
    if coherence:
        yield Sketch(
            "coherence",
            "Coherence",
            "The share of each response that follows the drive linearly: 1 is all of it. It is shown where the "
            "response stands clear of its noise.",
            describe_coherence(coherence),
            2.8,
            lambda figure: draw_coherence(figure, coherence),
        )
    pairs = d.get("comparisons") or ()
    if pairs:
        yield Sketch(
            "consistency",
            "Channels of one point against each other",
            "Each channel against what the other implies by differentiation; bars are 95 % intervals, 0 is agreement.",
            describe_consistency(pairs),
            0.9 + 0.5 * len(pairs),
            lambda figure: draw_consistency(figure, pairs, d),
        )
    planes = planes_of(channels)
    if planes:
        yield Sketch(
            "planes",
            "Where the motion has been",
            "Share of the cells inside the dashed ellipse, which the largest value and the largest rate span, that the "
            "record has entered; the darker, the longer. Of a force elsewhere it can say nothing.",
            describe_planes(planes),
            3.4,
            lambda figure: draw_planes(figure, planes),
        )
    periods = d.get("periods") or {}
    if periods.get("channels"):
        yield Sketch(
            "lines",
            "Lines of the period",
            "Amplitudes of the mean period. Where the force excites no line, a response that stands above the noise is "
            "distortion: the structure is not linear.",
            describe_lines(periods),
            0.2 + 2.9 * panel_rows(len(periods["channels"])),
            lambda figure: draw_lines(figure, periods, channels),
        )
