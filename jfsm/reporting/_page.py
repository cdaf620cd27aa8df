"""The page of a diagnosis: one HTML file that needs nothing beside it."""

from collections.abc import Mapping
from typing import Any

from jfsm.reporting._checks import checks_table, decisive_checks
from jfsm.reporting._pictures import pictures
from jfsm.reporting._provenance import provenance_table
from jfsm.reporting._quantities import number
from jfsm.reporting._shown_units import in_shown_words
from jfsm.reporting._summary import key_answers
from jfsm.reporting._tables import (
    candidates_table,
    channels_table,
    detectable_table,
    findings_table,
    gain_table,
    modes_table,
    refitted_table,
    rivals_table,
)
from jfsm.reporting._template import inline, template
from jfsm.reporting._why import why_lines
from jfsm.reporting._wording import checked_verdict, extent

FIRST_CANDIDATES = 10


def render_page(d: Mapping[str, Any]) -> str:
    """A diagnosis as one self-contained HTML page.

    The verdict, the cause, its certainty and the gain come first, then the evidence. Pictures are inside the page as
    SVG with their content in words; light, dark and print have their own colours; nothing is loaded from elsewhere, and
    every text of the diagnosis is escaped. The same dictionary gives the same characters.

    Parameters
    ----------
    d : mapping
        What ``Diagnosis.to_json`` writes; parts may be None or missing, except the verdict.

    Returns
    -------
    str
        An HTML document.

    Raises
    ------
    ValueError
        If `d` is not the dictionary of a diagnosis.
    """
    d = in_shown_words(d)
    findings, candidates = d.get("findings") or (), d.get("candidates") or ()
    record, decision = d.get("record") or {}, d.get("decision") or {}
    verdict = checked_verdict(d)
    headline, _, remark = (d.get("sentence") or verdict.meaning).partition(". ")
    return template("diagnosis.html.j2").render(
        version=d.get("jfsm"),
        badge=verdict.label,
        tone=verdict.tone,
        headline=headline,
        remark=remark,
        advice=d.get("advice"),
        title=record.get("name") or "a measured record",
        record_line=" · ".join(extent(record)),
        answers=key_answers(d),
        pictures=inline(pictures(d)),
        statements=[finding["sentence"] for finding in findings if finding.get("sentence")],
        findings=findings_table(findings),
        rivals=rivals_table(findings),
        gain=gain_table((d.get("gain") or {}).get("channels") or {}),
        first_candidates=candidates_table(candidates[:FIRST_CANDIDATES]),
        more_candidates=candidates_table(candidates[FIRST_CANDIDATES:]),
        why=why_lines(d),
        decisive=checks_table(decisive_checks(d), "Decisive checks", decision),
        every_check=checks_table(
            decision.get("checks") or (), "Every check, in the order in which they were made", decision
        ),
        refitted=refitted_table(d.get("refitted") or {}),
        modes=modes_table(d.get("modes") or ()),
        channels=channels_table(record.get("channels") or ()),
        detectable=detectable_table(d.get("detectable") or {}),
        model=d.get("model") or (),
        extended=_additions(d),
        notes=d.get("notes") or (),
        provenance=provenance_table(d.get("provenance") or {}),
        timing=_timing(d.get("timing") or {}),
    )


def _additions(d: Mapping[str, Any]) -> list[tuple[str, bool]]:
    """Lines of the extended structure, and whether the model as given has them in the same words."""
    given = set(d.get("model") or ())
    return [(line, line in given) for line in d.get("extended") or ()]


def _timing(timing: Mapping[str, Any]) -> str:
    seconds, programs = timing.get("seconds"), timing.get("programs")
    parts = (
        f"{number(seconds)} s of computing" if seconds is not None else "",
        f"{programs} compiled programs" if programs is not None else "",
    )
    return ", ".join(filter(None, parts))
