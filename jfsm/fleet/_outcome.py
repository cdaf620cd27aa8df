"""What became of a record, in short: a row of the summary, from the file of its result."""

from collections.abc import Mapping
from typing import Any, Literal, NamedTuple

FailureKind = Literal["unreadable", "refused", "internal", "not done"]
Row = dict[str, Any]
"""A record in the summary, as plain types."""


class Failure(NamedTuple):
    """Why a record has no diagnosis.

    It is "unreadable", "refused" by `diagnose`, an "internal" error of jfsm or of its process, or "not done" for what
    lies outside it. The first two stand until the record, the model or the settings change; the others are tried again.
    """

    kind: FailureKind
    message: str
    traceback: str = ""

    @property
    def stands(self) -> bool:
        """Whether another try would end alike."""
        return self.kind in ("unreadable", "refused")


def row_of(name: str, slug: str, source: str, numbers: Mapping[str, Any]) -> Row:
    """A diagnosis in short, from what `Diagnosis.to_json` writes."""
    gain = numbers.get("gain") or {}
    first = next(iter((numbers.get("provenance") or {}).get("records") or ()), {})
    return {
        "name": name,
        "source": source,
        "status": "done",
        "verdict": numbers["verdict"],
        "finished": numbers.get("finished", True),
        "sentence": numbers.get("sentence", ""),
        "findings": [_finding(found) for found in numbers.get("findings") or ()],
        "closed": gain.get("closed"),
        "begins": first.get("begins"),
        "json": f"records/{slug}.json",
        "page": f"records/{slug}.html",
    }


def failed_row(name: str, slug: str, source: str, failure: Failure) -> Row:
    """A record without a diagnosis in short."""
    return {
        "name": name,
        "source": source,
        "status": "failed",
        "verdict": None,
        "findings": [],
        "kind": failure.kind,
        "message": failure.message,
        "json": None if failure.kind == "not done" else f"records/{slug}.failed.json",
    }


def _finding(found: Mapping[str, Any]) -> Row:
    names = ("cause", "family", "at", "kind", "law_open", "probability", "parameters", "members", "size")
    return {name: found.get(name) for name in names}


def verdict_of(row: Mapping[str, Any]) -> str:
    """A verdict with its causes and places, as one line that is equal for equal verdicts."""
    if row["status"] == "failed":
        return f"failed ({row['kind']})"
    found = sorted(f"{_called(one)}@{'-'.join(map(str, one['at'] or ()))}" for one in row["findings"])
    return f"{row['verdict']}: {', '.join(found)}" if found else row["verdict"]


def _called(finding: Mapping[str, Any]) -> str:
    return finding["kind"] if finding.get("law_open") and finding.get("kind") else finding["cause"]
