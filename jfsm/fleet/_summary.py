"""The summary of a batch: rows, effects, clusters, changes; written beside the results."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

from ..diagnosis import jfsm_version, toml_of
from ..reporting import batch_sentence, render_batch
from ._effects import effects_of
from ._folder import Folder
from ._outcome import Row, verdict_of
from ._table import csv_of

_FORMAT = 1


def write_summary(folder: Folder, rows: Sequence[Row], model: Any) -> dict[str, Any]:
    """Write ``summary.json``, ``.csv`` and ``.html``, and give what they hold."""
    found = summary_of(rows, folder.summary())
    found["model"] = toml_of(model)
    folder.write_summary(json.dumps(found, indent=1, allow_nan=False), csv_of(rows), render_batch(found))
    return found


def summary_of(rows: Sequence[Row], before: Mapping[str, Any] | None) -> dict[str, Any]:
    """What a batch found, as plain types, beside the summary of the batch before it in the folder."""
    found: dict[str, Any] = {
        "jfsm": jfsm_version(),
        "format": _FORMAT,
        "records": list(rows),
        "effects": effects_of(rows),
        "clusters": clusters_of(rows),
        "changes": changes_of(rows, before),
    }
    return {**found, "sentence": batch_sentence(found)}


def clusters_of(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Records with equal verdicts, the largest cluster first."""
    found: dict[str, list[str]] = {}
    for row in rows:
        found.setdefault(verdict_of(row), []).append(row["name"])
    return [
        {"verdict": verdict, "records": names} for verdict, names in sorted(found.items(), key=lambda c: -len(c[1]))
    ]


def changes_of(rows: Sequence[Row], before: Mapping[str, Any] | None) -> list[dict[str, Any]]:
    """Records whose verdicts differ from those of the batch before; None stands for a record that was not there."""
    if before is None or before.get("format") != _FORMAT:
        return []
    then = {row["name"]: verdict_of(row) for row in before["records"]}
    now = {row["name"]: verdict_of(row) for row in rows}
    return [
        {"record": name, "before": then.get(name), "now": now.get(name)}
        for name in {**now, **then}
        if then.get(name) != now.get(name)
    ]
