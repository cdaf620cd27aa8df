"""What was looked at before, beside a verdict: channels of the wrong sign as causes, and words."""

from ..._result import Estimate
from ...reporting import capitalised
from ...structures import Structure, causes
from .._finding import Finding
from .looked import MENDED, TURNED, Looked


def with_signs(findings: tuple[Finding, ...], verdict: str, looked: Looked) -> tuple[Finding, ...]:
    """The findings of a verdict, channels of the wrong sign first; own values are no findings beside them."""
    if not looked.inverted:
        return findings
    return (*_sign_findings(looked), *(findings if verdict == "cause" else ()))


def _sign_findings(looked: Looked) -> tuple[Finding, ...]:
    """Channels of the wrong sign as findings: a gain error of −2 turns a sign."""
    found = []
    for kind, j in looked.inverted:
        law = MENDED[kind].kind
        cause, gain = causes()[law], MENDED[kind].parameters[0].name
        size = Estimate(TURNED, TURNED, TURNED, "1")
        found.append(Finding.of_sensor(cause, (kind, j), gain, size, _why(looked, kind, j), "a wrong sign"))
    return tuple(found)


def _why(looked: Looked, kind: str, dof: int) -> str:
    """The look that showed it."""
    own = [check.says for check in looked.turned_by if check.of == f"{kind} {dof}"]
    return next(iter([*own, *(check.says for check in looked.turned_by)]), "")


def mended_model(structure: Structure, looked: Looked) -> Structure:
    """A structure that reads its channels with the signs that they were recorded with."""
    for kind, j in looked.inverted:
        structure = structure + MENDED[kind](TURNED, at=(kind, j))
    return structure


def in_words(sentence: str, looked: Looked, advice: str) -> tuple[str, str]:
    """Sentence and advice of a verdict with what was seen before it."""
    if looked.inverted:
        wrong = " ".join(dict.fromkeys(f"{_why(looked, *channel)}." for channel in looked.inverted))
        turns = "".join(f".turned({channel!r})" for channel in looked.inverted)
        sentence = f"{capitalised(wrong)} With the sign turned: {sentence}"
        advice = f"Turn the sign: record{turns}. {advice}"
    if looked.undriven:
        sentence = f"{sentence} Without a measured force the motion does not decay: {looked.undriven}."
    return sentence, advice
