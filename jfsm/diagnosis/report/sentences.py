"""A decision in words: the verdict as a sentence, and what to do."""

from collections.abc import Mapping, Sequence

from ...reporting import MOST_PERCENT, nearest, place_name, stopping_line
from ...structures import Cause, causes
from .._finding import Finding
from ..advice.next_test import RIVAL
from ..evidence.between_records import Difference
from ..evidence.evidence import Evidence
from ..evidence.fitted import Trial
from ..evidence.free_runs import Gain
from ..thresholds import THRESHOLDS
from ..verdict.decision import Decision
from .force_shape import Shape

_GO_ON = "Let the search go on to its end before the model is changed."
_NO_GAIN = "Do not change the model for the sake of its predictions: on held-out readings it gains no more than chance."
_OPEN_LAW = (
    "Use the refitted values: of the laws that were tried none has the same numbers in every motion. Fit one to a test "
    "with the motions that the model is to predict."
)
_ADVICE = {
    "consistent": "Keep the model as it is.",
    "parameters": "Use the refitted values.",
    "cause": "Use the extended model.",
    "unnamed": "Look at the map's shape; record a second run with another amplitude.",
    "undecided": "Record a second run with another amplitude, or measure the missing channels.",
}
_ADVICE_IMPOSED = _ADVICE | {
    "undecided": "Record a second run with another amplitude, or measure the velocity beside the displacement."
}
"""Advice where the motion is imposed."""


def verdict_sentence(
    decision: Decision,
    winner: Trial,
    findings: Sequence[Finding],
    gain: Gain | None,
    shape: Shape | None,
    differences: Sequence[str],
    *,
    imposed: bool,
) -> str:
    """The verdict in words, with the sentences on `differences` between records and the gain on held-out readings."""
    gained = _gained(gain, imposed=imposed)
    if decision.verdict == "consistent":
        return "The record shows nothing beyond noise that the model lacks." + _trace(decision, winner)
    if decision.verdict == "parameters":
        what = "; ".join(f.sentence for f in findings) or "its own values moved together"
        words = f"The form of the model is right, its values are off: {what}.{_trace(decision, winner)}"
        return " ".join([words, *differences]) + gained
    if decision.verdict == "cause":
        return " ".join([_named(decision, winner, findings, shape), *differences]) + gained
    if decision.verdict == "unnamed":
        looks = "" if shape is None else f" {shape.words}"
        return f"A real effect is there that no law of the catalogue explains; a map stands in.{looks}{gained}"
    if not decision.finished:
        return "The search was ended before it was finished, and nothing that was tried until then is found."
    stopped = stopping_line(decision.plain)
    looks = "" if shape is None else f" Of the missing force: {shape.words[0].lower()}{shape.words[1:]}"
    return f"Something is wrong beyond noise, and this record cannot tell what. {stopped}{looks}".strip()


def verdict_advice(decision: Decision, gain: Gain | None, evidence: Evidence) -> str:
    """What to do about the verdict."""
    if decision.verdict in ("cause", "undecided") and not decision.finished:
        return _GO_ON
    if decision.verdict in ("cause", "parameters") and gain is not None and not gain.significant:
        return _NO_GAIN
    if decision.of_a_class_alone:
        return _OPEN_LAW
    far = _too_far(decision, evidence)
    if far:
        given = f"{far[0].partition('@')[0]}=2"
        return (
            f"Look up {' and '.join(far)} of the model: the law that comes nearest would need another value than may "
            f"be there. If as little is known of it, say so: model.uncertain({given}), or {given} under [uncertain] in "
            "the model's file."
        )
    return (_ADVICE_IMPOSED if evidence.setting.imposed else _ADVICE)[decision.verdict]


def _too_far(decision: Decision, evidence: Evidence) -> list[str]:
    """Own values that the law which came nearest takes to their bounds, if it is refused for that."""
    key = nearest({"verdict": decision.verdict, "decision": decision.plain})
    refused = any(c.name == "own_values_within_bounds" and c.of == key and not c.passed for c in decision.checks)
    return sorted(set(evidence.cards[key].at_bounds) - set(evidence.refitted.at_bounds)) if refused else []


def difference_sentence(difference: Difference, unit: str) -> str:
    """The values of a number that differs between records, in each of them."""
    records = enumerate(difference.intervals, start=1)
    each = [f"{value:.4g} [{low:.4g}, {high:.4g}] in record {i}" for i, (value, low, high) in records]
    return f"Records differ: {difference.path} [{unit}] is {', '.join(each)}."


def finding_sentence(finding: Finding, known: Mapping[str, Cause]) -> str:
    """A finding in words; where its law is open, its class comes first, and then the laws that it may be."""
    cause, where = known[finding.cause], _where(finding, known)
    lacks = "The record shows" if cause.is_sensor else "The model lacks"
    if finding.law_open and finding.kind_probability - finding.probability > RIVAL:
        return f"{lacks} {finding.kind} at {where}{_how_much(finding)}; its law is open: {_laws(finding, known)}."
    named = f"{lacks} {cause.label} at {where}: {finding.sentence}."
    if finding.probability >= THRESHOLDS.named or not finding.rivals:
        return named
    others = (known[r.cause].label for r in finding.rivals if r.cause in known)
    return f"{named} By this record it may as well be {' or '.join(dict.fromkeys(others))}."


def _where(finding: Finding, known: Mapping[str, Cause]) -> str:
    """Where a finding is; of a drive, what it is told stands in the channel of a force."""
    of_drive = known[finding.cause].family == "drive"
    return place_name(("command", finding.at[1]) if of_drive else finding.at)


def _how_much(finding: Finding) -> str:
    """How sure a class is, and its size with the interval, in words."""
    size = finding.size
    about = "" if size is None else f", about {size.value:.4g} {size.unit} [{size.low:.4g}, {size.high:.4g}]"
    return f" ({finding.kind_probability:.0%}){about}"


def _laws(finding: Finding, known: Mapping[str, Cause]) -> str:
    """The laws of a class with their probabilities in words, and that of one that is none of them."""
    laws = [f"{known[name].label} ({share:.0%})" for name, share in finding.members.items() if name in known]
    other = finding.kind_probability - sum(finding.members.values())
    return ", ".join([*laws, f"or one of another shape ({other:.0%})"] if other > RIVAL else laws)


def _named(decision: Decision, winner: Trial, findings: Sequence[Finding], shape: Shape | None) -> str:
    """The causes that were named, and what remains unexplained or untried."""
    known = dict(causes()) | {e.cause.id: e.cause for e in winner.effects}
    words = " ".join(finding_sentence(f, known) for f in findings) + _remainder(winner, shape)
    if decision.winner in decision.near:
        words += " Its shape is not quite that of any law that was tried."
    if not decision.finished:
        words += " The search was not finished: what was not tried may explain it as well."
    return words


def leaves_something(decision: Decision, winner: Trial) -> bool:
    """Whether the named causes leave more than a negligible error unexplained."""
    return decision.verdict == "cause" and winner.prediction.left() >= THRESHOLDS.negligible


def _remainder(winner: Trial, shape: Shape | None) -> str:
    """The error that the named causes leave unexplained, and the shape of its force; empty where it is negligible."""
    left = winner.prediction.left()
    if left < THRESHOLDS.negligible:
        return ""
    looks = "" if shape is None else f" {shape.words}"
    return f" Something is left beyond {'them' if len(winner.effects) > 1 else 'it'}: {left:.1%} of the signal.{looks}"


def _trace(decision: Decision, winner: Trial) -> str:
    """What is left where it is no cause; empty where nothing is."""
    if all(row.passed for row in decision.checks if row.name == "more_than_a_trace"):
        return ""
    left = winner.prediction.left()
    return f" A trace is left, {left:.1%} of the signal, which laws of several classes explain alike: it is no cause."


def _gained(gain: Gain | None, *, imposed: bool) -> str:
    """Errors on held-out readings before and after."""
    if gain is None:
        return ""
    error = "error of the predicted force" if imposed else "free-run error"
    refitted = f" ({_share(gain.refitted)} refitted)" if gain.beyond_refit else ""
    to = f"to {_share(gain.after)} of the signal"
    return f" The {error} on held-out readings goes from {_share(gain.before)}{refitted} {to}."


def _share(error: float) -> str:
    """An error as a share of the signal; a bound where it is so large that no more is said by it."""
    return f"{error:.2%}" if error <= 0.01 * MOST_PERCENT else f"over {MOST_PERCENT:.0f}%"
