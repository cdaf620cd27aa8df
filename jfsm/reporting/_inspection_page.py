"""The page of an inspection: what a record shows by itself, what is wrong with it first."""

from collections.abc import Mapping, Sequence
from typing import Any

from jfsm.reporting._checks import checks_table
from jfsm.reporting._inspection_pictures import inspection_pictures
from jfsm.reporting._inspection_tables import (
    consistency_table,
    inspected_channels_table,
    periods_table,
    remarks_table,
    small_percent,
)
from jfsm.reporting._quantities import number, percent, quantity, with_error
from jfsm.reporting._shown_units import in_shown_words
from jfsm.reporting._summary import Answer
from jfsm.reporting._template import inline, template
from jfsm.reporting._wording import counted, extent, listed

Dictionary = Mapping[str, Any]

MOST_CHANNELS = 3
NO_BREAK = "\N{NO-BREAK SPACE}"


def render_inspection(d: Dictionary) -> str:
    """An inspection as one self-contained HTML page, made as `render_page` makes that of a diagnosis.

    Parameters
    ----------
    d : mapping
        What ``Inspection.to_dict`` returns; with "curves", as `inspection_pictures` takes them, also the channels over
        time. Parts may be None or missing.

    Returns
    -------
    str
        An HTML document.
    """
    d = in_shown_words(d)
    findings, channels = d.get("findings") or (), d.get("channels") or ()
    warnings = [finding for finding in findings if finding["severity"] == "warning"]
    remarks = [finding for finding in findings if finding["severity"] != "warning"]
    return template("inspection.html.j2").render(
        version=d.get("jfsm"),
        badge=counted(len(warnings), "warning"),
        tone="open" if warnings else "good",
        headline=_headline(warnings),
        remark="",
        advice="",
        title=d.get("name") or "a measured record",
        record_line=" · ".join(extent(d)),
        answers=_answers(d, channels),
        pictures=inline(inspection_pictures(d)),
        looked=checks_table(d.get("checks") or (), "What was looked at first", {}),
        warnings=remarks_table("Warnings", warnings),
        remarks=remarks_table("Remarks", remarks),
        channels=inspected_channels_table(channels),
        consistency=consistency_table(d.get("comparisons") or (), channels, d.get("sample_rate")),
        periods=periods_table(d.get("periods") or {}, channels),
        timing="",
    )


def _headline(warnings: Sequence[Dictionary]) -> str:
    if not warnings:
        return "The record shows no fault by itself"
    channels = dict.fromkeys(name for finding in warnings for name in finding["channel"].split(", "))
    names = ["the whole record" if name == "record" else name.replace(" ", NO_BREAK) for name in channels]
    if len(names) > MOST_CHANNELS:
        names = [*names[:MOST_CHANNELS], counted(len(names) - MOST_CHANNELS, "more channel")]
    return f"{'A warning' if len(warnings) == 1 else 'Warnings'} on {listed(names)}"


def _answers(d: Dictionary, channels: Sequence[Dictionary]) -> list[Answer]:
    """What drives, where the motion is strongest, how noisy it is, and what else says in short what the record is."""
    answers = []
    if "drives" in d:
        answers.append(_drive(d))
    moving = [channel for channel in channels if channel["channel"] not in (d.get("drives") or ())]
    strongest = [channel for channel in moving if channel.get("frequency")]
    if strongest and d.get("sample_rate") and d.get("duration"):
        frequency = strongest[0]["frequency"]
        periods, samples = frequency * d["duration"], d["sample_rate"] / frequency
        count = f"{periods:.0f}" if periods >= 10.0 else number(periods, 2)
        detail = f"{strongest[0]['channel']}: {count} periods of {number(samples)} samples"
        answers.append(Answer("Strongest at", quantity(frequency, "Hz"), (detail,)))
    noisy = [channel for channel in channels if channel.get("noise") is not None and channel.get("std")]
    if noisy:
        share = small_percent(max(channel["noise"] / channel["std"] for channel in noisy))
        details = tuple(
            f"{channel['channel']}: {with_error(channel['noise'], channel.get('noise_error'), channel['unit'])}"
            for channel in noisy[:MOST_CHANNELS]
        )
        answers.append(Answer("Noise", f"up to {share}" if len(noisy) > 1 else share, details))
    if coherence := d.get("coherence"):
        details = tuple(f"{one['channel']}: {percent(one['mean'])}" for one in coherence[:MOST_CHANNELS])
        least = min(one["mean"] for one in coherence)
        answers.append(Answer("Follows the drive", percent(least), details, least))
    return answers


def _drive(d: Dictionary) -> Answer:
    drives = list(d["drives"] or ())
    if not drives:
        decays = {check["passed"] for check in d.get("checks") or () if check["name"] == "drive_measured"}
        if False in decays:
            return Answer("Driven by", "Nothing that was measured", ("the motion does not decay",))
        return Answer("Driven by", "Nothing", ("a free decay",) if True in decays else ("no force was measured",))
    periods = d.get("periods")
    detail = f"{periods['count']} periods of {quantity(periods['seconds'], 's')}" if periods else "not periodic"
    shown = drives[:MOST_CHANNELS]
    more = [counted(len(drives) - MOST_CHANNELS, "more channel")] if len(drives) > MOST_CHANNELS else []
    return Answer("Driven by", listed([*shown, *more]), (detail,))
