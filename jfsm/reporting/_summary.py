"""The four answers a reader looks for first: the cause, how sure, how large, and the gain."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from jfsm.reporting._quantities import digits_for, interval, number, percent, probability, quantity, scale_for
from jfsm.reporting._wording import capitalised, cause_name, place_name

Dictionary = Mapping[str, Any]

MOST_CHANNELS = 3
MOST_ALTERNATIVES = 3


class Answer(NamedTuple):
    """A question, its short answer, and lines that qualify it; `share` in 0…1 where the answer is one."""

    question: str
    answer: str
    details: tuple[str, ...] = ()
    share: float | None = None


def key_answers(d: Dictionary) -> tuple[Answer, ...]:
    """Cause, certainty, size and gain of a diagnosis, whatever its verdict; size only where something has one."""
    findings = d.get("findings") or ()
    answers = [_cause(d, findings), _certainty(d, findings)]
    if any(finding.get("parameters") for finding in findings):
        answers.append(_size(findings))
    return (*answers, _gain(d))


def _cause(d: Dictionary, findings: Sequence[Dictionary]) -> Answer:
    if findings:
        names = " + ".join(cause_name(finding["cause"]) for finding in findings)
        families = (finding.get("family") for finding in findings)
        places = (place_name(finding.get("at")) for finding in findings)
        details = (", ".join(filter(None, pair)) for pair in zip(families, places, strict=True))
        return Answer("Cause", capitalised(names), tuple(dict.fromkeys(filter(None, details))))
    return Answer(
        "Cause",
        *{
            "consistent": ("None", ("nothing beyond noise",)),
            "unnamed": ("Not in the catalogue", ("a map of the missing force stands in",)),
        }.get(d["verdict"], ("Open", ("see what to measure next",))),
    )


def _certainty(d: Dictionary, findings: Sequence[Dictionary]) -> Answer:
    if findings:
        chances = [finding["probability"] for finding in findings if finding.get("probability") is not None]
        rivals = [rival for finding in findings for rival in finding.get("rivals") or ()]
        classes = [f"{probability(f['kind_probability'])} {f['kind']}" for f in findings if rivals and f.get("kind")]
        details = (*classes, *_alternatives(rivals)) or ("no rival explains the record",)
        return Answer("How sure", " · ".join(map(probability, chances)) or "–", details, min(chances, default=None))
    tried = d.get("candidates") or ()
    ranked = sorted(tried, key=lambda candidate: candidate.get("probability") or 0.0, reverse=True)
    if d["verdict"] == "consistent":
        return Answer("How sure", f"{len(tried)} causes tried", ("none improves on the model beyond noise",))
    return Answer("Closest", f"{len(tried)} causes tried", _alternatives(ranked))


def _alternatives(hypotheses: Sequence[Dictionary]) -> tuple[str, ...]:
    return tuple(
        f"{probability(one.get('probability'))} {cause_name(one['cause'])}" for one in hypotheses[:MOST_ALTERNATIVES]
    )


def _size(findings: Sequence[Dictionary]) -> Answer:
    lines = []
    for finding in findings:
        for name, estimate in (finding.get("parameters") or {}).items():
            value, low, high, unit = (estimate.get(key) for key in ("value", "low", "high", "unit"))
            shown = f"{name} = {quantity(value, unit, digits_for(value, low, high))}"
            lines.append((shown, interval(low, high, unit, value)))
    (first, bounds), rest = lines[0], lines[1:]
    details = (f"95 % interval {bounds}",) if bounds else ()
    return Answer("How large", first, (*details, *(" ".join(filter(None, line)) for line in rest)))


def _gain(d: Dictionary) -> Answer:
    gain = d.get("gain")
    if not gain:
        return Answer("Gain", "Not measured", ("no data were held out",))
    lines = []
    for name, channel in list((gain.get("channels") or {}).items())[:MOST_CHANNELS]:
        before, after = channel.get("before"), channel.get("after")
        scale = scale_for(before, channel.get("unit"))
        figures = " → ".join(number(None if error is None else error / scale.factor) for error in (before, after))
        lines.append(f"{name}: {figures} {scale.unit}".rstrip())
    if d["verdict"] == "consistent" or gain.get("closed") is None:
        return Answer("Gain", "Nothing to close" if d["verdict"] == "consistent" else "None claimed", tuple(lines))
    if gain.get("interval"):
        low, high = gain["interval"]
        lines.insert(0, f"95 % interval {percent(low)} to {percent(high)}")
    return Answer("Gain", f"{percent(gain['closed'])} closed", tuple(lines), min(max(gain["closed"], 0.0), 1.0))
